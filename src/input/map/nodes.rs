//! Samples given node by node, and the names of their columns or arrays.

use super::data::{POTENTIAL, Samples, Values};
use super::grid::{Placed, of_points};
use super::wrong;
use crate::input::InputError;
use std::path::Path;

pub(super) const FLUX: [&str; 3] = ["Bx", "By", "Bz"];
pub(super) const PLACES: [&str; 3] = ["x", "y", "z"];

/// Numbers by what they are: `x`, `Bx`, `potential`.
pub(super) type Named = Vec<(&'static str, Vec<f64>)>;

/// The meaning of a name of another program: `mf.Bx`, `X`, `B_y`; with it, whether it is our own name.
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
    let places = [x?, y?, z?];
    let potential = column(POTENTIAL);
    let flux = match potential {
        Some(_) => None,
        None => {
            let [x, y, z] = FLUX.map(needed);
            Some([x?, y?, z?])
        }
    };
    let Placed { lattice, nodes, strays } = of_points(path, places)?;
    let sorted = |values: &[f64]| {
        let mut all = vec![0.0; values.len()];
        nodes.iter().zip(values).for_each(|(node, value)| all[*node] = *value);
        all
    };
    let values = match flux {
        Some(flux) => Values::FluxDensity(flux.map(sorted)),
        None => Values::Potential(sorted(potential.unwrap_or_default())),
    };
    let strays = strays.map(|strays| strays.map(|values| sorted(&values)));
    Ok(Samples { lattice, values, strays, notes: Vec::new() })
}
