//! Samples of a field on a grid, SI, by the extension of their file.

use super::data::{Factors, Samples};
use super::{arrays, columns, vti, vtk, wrong};
use crate::input::InputError;
use crate::input::units::LARGEST;
use std::path::Path;

/// Reads a file by its extension.
pub(super) fn read(path: &Path, bytes: Vec<u8>, factors: &Factors) -> Result<Samples, InputError> {
    let extension = path.extension().map(|word| word.to_string_lossy().to_lowercase()).unwrap_or_default();
    let samples = match extension.as_str() {
        "csv" | "txt" | "tsv" | "dat" => columns::read(path, bytes, factors)?,
        "npz" => arrays::read(path, factors, &arrays::File::Npz)?,
        "mat" => arrays::read(path, factors, &arrays::File::Matlab(&bytes))?,
        "vtk" => vtk::read(path, &bytes, factors)?,
        "vti" => vti::read(path, &bytes, factors)?,
        _ => {
            let words = format!(
                "`.{extension}` is no format of samples: give .csv, .txt, .tsv, .dat, .npz, .mat, .vtk (legacy) or .vti"
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
