//! Samples of a field on a grid, SI: what a file's extension says, and the names of its columns or arrays.

use super::data::{Factors, POTENTIAL, Samples, Values};
use super::grid::{Placed, of_points};
use super::{arrays, columns, vti, vtk, wrong};
use crate::input::InputError;
use crate::input::units::LARGEST;
use std::path::Path;

pub(super) const FLUX: [&str; 3] = ["Bx", "By", "Bz"];
pub(super) const PLACES: [&str; 3] = ["x", "y", "z"];

/// Numbers by what they are: `x`, `Bx`, `potential`.
pub(super) type Named = Vec<(&'static str, Vec<f64>)>;

/// Reads a file by its extension.
pub(super) fn read(path: &Path, bytes: Vec<u8>, factors: &Factors) -> Result<Samples, InputError> {
    let extension = path.extension().map(|word| word.to_string_lossy().to_lowercase()).unwrap_or_default();
    let samples = match extension.as_str() {
        "csv" | "txt" | "tsv" | "dat" => columns::read(path, bytes, factors)?,
        "npz" => arrays::read(path, factors)?,
        "vtk" => vtk::read(path, &bytes, factors)?,
        "vti" => vti::read(path, &bytes, factors)?,
        "mat" => {
            let words = "is a MATLAB file, which is not read: write a table there, writematrix([x(:) y(:) z(:) Bx(:) By(:) \
                         Bz(:)], \"map.csv\"), or in Python numpy.savez(\"map.npz\", **scipy.io.loadmat(\"map.mat\"))";
            return Err(wrong(path, None, "", words));
        }
        _ => {
            let words = format!(
                "`.{extension}` is no format of samples: give .csv, .txt, .tsv, .dat, .npz, .vtk (legacy) or .vti"
            );
            return Err(wrong(path, None, "", words));
        }
    };
    if let Some(node) = samples.values.all().iter().find_map(|values| values.iter().position(|x| x.abs() > LARGEST)) {
        let [nx, ny, _] = samples.lattice.counts;
        let [i, j, k] = [node % nx, node / nx % ny, node / (nx * ny)];
        let words = format!(
            "a value at node ({i}, {j}, {k}) is not finite, or beyond 1e60: write NaN where there is none, or cut the grid"
        );
        return Err(wrong(path, None, "", words));
    }
    Ok(samples)
}

/// What a name of another program means: `mf.Bx`, `X`, `B_y`; with it, whether it is our own name.
pub(super) fn meaning(name: &str) -> Option<(&'static str, bool)> {
    let known = || PLACES.into_iter().chain(FLUX).chain([POTENTIAL]);
    if let Some(own) = known().find(|known| *known == name) {
        return Some((own, true));
    }
    let word: String = name.rsplit('.').next().unwrap_or(name).chars().filter(|c| !matches!(c, '_' | ' ')).collect();
    known().find(|known| known.eq_ignore_ascii_case(&word)).map(|known| (known, false))
}

/// One number a node in each column, in any order.
pub(super) fn of_columns(path: &Path, columns: &Named, there: &str) -> Result<Samples, InputError> {
    let column = |name: &str| columns.iter().find(|(other, _)| *other == name).map(|(_, values)| &values[..]);
    let needed = |name: &str| {
        column(name).ok_or_else(|| {
            let words = "is missing: give columns x, y, z and Bx, By, Bz, or x, y, z and potential";
            wrong(path, None, name, format!("{words}; {there}"))
        })
    };
    let [x, y, z] = PLACES.map(needed);
    let Placed { lattice, nodes, strays } = of_points(path, [x?, y?, z?])?;
    let sorted = |values: &[f64]| {
        let mut all = vec![0.0; values.len()];
        nodes.iter().zip(values).for_each(|(node, value)| all[*node] = *value);
        all
    };
    let values = match column(POTENTIAL) {
        Some(potential) => Values::Potential(sorted(potential)),
        None => {
            let [x, y, z] = FLUX.map(needed);
            Values::FluxDensity([sorted(x?), sorted(y?), sorted(z?)])
        }
    };
    let strays = strays.map(|strays| strays.map(|values| sorted(&values)));
    Ok(Samples { lattice, values, strays, notes: Vec::new() })
}
