//! Samples of a field on a grid, SI: from CSV with a row for each node, or from the arrays of an NPZ.

use super::data::{Factors, POTENTIAL, Samples, Values};
use super::grid::{of_axes, of_points};
use super::{MOST_NODES, vti, vtk, wrong};
use crate::input::InputError;
use crate::input::number_table::{cells, csv_lines};
use crate::input::units::LARGEST;
use crate::input::units::{Dimension, parse_quantity};
use crate::table::npy::{NumberArray, read_arrays};
use std::collections::HashSet;
use std::path::Path;

const FLUX: [&str; 3] = ["Bx", "By", "Bz"];
const PLACES: [&str; 3] = ["x", "y", "z"];

/// A column or an array by its name.
struct Named<'a> {
    name: &'a str,
    values: &'a [f64],
}

/// Reads a file by its extension.
pub(super) fn read(path: &Path, bytes: &[u8], factors: &Factors) -> Result<Samples, InputError> {
    let extension = path.extension().map(|word| word.to_string_lossy().to_lowercase()).unwrap_or_default();
    let samples = match extension.as_str() {
        "csv" => of_csv(path, bytes, factors)?,
        "npz" => of_npz(path, factors)?,
        "vtk" => vtk::read(path, bytes, factors)?,
        "vti" => vti::read(path, bytes, factors)?,
        _ => {
            let words = format!("`.{extension}` is no format of samples: give .csv, .npz, .vtk (legacy) or .vti");
            return Err(wrong(path, None, "", words));
        }
    };
    let all: Vec<&Vec<f64>> = match &samples.values {
        Values::FluxDensity(b) => b.iter().collect(),
        Values::Potential(potential) => vec![potential],
    };
    if let Some(node) = all.iter().flat_map(|values| values.iter().position(|x| x.is_nan() || x.abs() > LARGEST)).next()
    {
        let [nx, ny, _] = samples.lattice.counts;
        let [i, j, k] = [node % nx, node / nx % ny, node / (nx * ny)];
        let words = format!("a value at node ({i}, {j}, {k}) is not finite, or beyond 1e60: fill it, or cut the grid");
        return Err(wrong(path, None, "", words));
    }
    Ok(samples)
}

/// Unit in brackets after a name, as in `Bx [mT]`.
fn split_unit(cell: &str) -> (&str, Option<&str>) {
    match cell.split_once('[') {
        Some((name, unit)) => (name.trim(), Some(unit.trim_end_matches(']').trim())),
        None => (cell, None),
    }
}

fn of_csv(path: &Path, bytes: &[u8], factors: &Factors) -> Result<Samples, InputError> {
    let text = std::str::from_utf8(bytes).map_err(|_| wrong(path, None, "", "is not UTF-8 text"))?;
    let mut lines = csv_lines(text);
    let asked = "the first line must name x, y, z and Bx, By, Bz, or x, y, z and potential";
    let (header_line, header) = lines.next().ok_or_else(|| wrong(path, None, "", asked))?;
    let mut columns: Vec<(&str, f64, Vec<f64>)> = Vec::new();
    let mut names = HashSet::new();
    for cell in cells(header) {
        let (name, unit) = split_unit(cell);
        let dimension = match name {
            "x" | "y" | "z" => Dimension::of("m"),
            POTENTIAL => Dimension::of("T·m"),
            _ => Dimension::of("T"),
        };
        let factor = match unit {
            None => factors.of(name),
            Some(unit) => parse_quantity(&format!("1 {unit}"), dimension).map_err(|problem| InputError {
                problem: Box::new(problem.into()),
                ..wrong(path, Some(header_line), name, "")
            })?,
        };
        if !names.insert(name) {
            return Err(wrong(
                path,
                Some(header_line),
                name,
                "stands twice in the first line: drop one of the columns",
            ));
        }
        columns.push((name, factor, Vec::new()));
    }
    for (line, row) in lines {
        let mut count = 0;
        for (cell, (name, factor, values)) in cells(row).zip(&mut columns) {
            let value: f64 = cell.parse().map_err(|_| {
                let words = format!(
                    "\"{cell}\" is no number; write the unit once, in the first line as `{name} [mT]` or as `field_unit` of the scene"
                );
                wrong(path, Some(line), name, words)
            })?;
            values.push(value * *factor);
            count += 1;
        }
        let found = cells(row).count();
        if count != columns.len() || found != columns.len() {
            let words = format!("has {found} columns where the first line has {}; mend the line", columns.len());
            return Err(wrong(path, Some(line), "", words));
        }
    }
    let named: Vec<Named> = columns.iter().map(|(name, _, values)| Named { name, values }).collect();
    of_columns(path, &named)
}

/// One row a node, in any order.
fn of_columns(path: &Path, columns: &[Named]) -> Result<Samples, InputError> {
    let column = |name: &str| columns.iter().find(|column| column.name == name).map(|column| column.values);
    let needed = |name: &str| {
        let words = "is missing: give columns x, y, z and Bx, By, Bz, or x, y, z and potential";
        column(name).ok_or_else(|| wrong(path, None, name, words))
    };
    let [x, y, z] = PLACES.map(needed);
    let (lattice, nodes) = of_points(path, [x?, y?, z?])?;
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
    Ok(Samples { lattice, values })
}

/// Columns of equal length, or axes x, y, z and arrays with an index for each of them, perhaps one more for `B`.
fn of_npz(path: &Path, factors: &Factors) -> Result<Samples, InputError> {
    let names: Vec<&str> = PLACES.iter().chain(&FLUX).copied().chain([POTENTIAL, "B"]).collect();
    let arrays = read_arrays(path, &names, 3 * MOST_NODES as u64);
    let mut arrays = arrays.map_err(|error| wrong(path, None, "", error.to_string()))?;
    for array in &mut arrays {
        let factor = factors.of(&array.name);
        array.values.iter_mut().for_each(|x| *x *= factor);
    }
    if arrays.iter().all(|array| array.shape.len() == 1) && !arrays.is_empty() {
        let same = arrays.windows(2).all(|pair| pair[0].values.len() == pair[1].values.len());
        if !same {
            return Err(wrong(path, None, "", "has arrays of different lengths: give one number a node in each"));
        }
        let named: Vec<Named> = arrays.iter().map(|a| Named { name: &a.name, values: &a.values }).collect();
        return of_columns(path, &named);
    }
    let array = |name: &str| arrays.iter().find(|array| array.name == name);
    let axis = |name: &str| {
        let found = array(name).filter(|array| array.shape.len() == 1);
        found.map(|array| &array.values[..]).ok_or_else(|| {
            wrong(path, None, name, "is missing: give the places along each axis as arrays x, y, z of one index")
        })
    };
    let [x, y, z] = PLACES.map(axis);
    let lattice = of_axes(path, [x?, y?, z?])?;
    let shape = lattice.counts.to_vec();
    let fits = |array: &NumberArray, more: &[usize]| {
        let expected = [&shape[..], more].concat();
        if array.shape == expected {
            return Ok(());
        }
        let words = format!("has the shape {:?}; x, y and z ask for {expected:?}", array.shape);
        Err(wrong(path, None, &array.name, words))
    };
    let component = |array: &NumberArray, of: usize, each: usize| {
        let [nx, ny, nz] = lattice.counts;
        let node = |at: usize| [at % nx, at / nx % ny, at / (nx * ny)];
        let value = |at: usize| {
            let [i, j, k] = node(at);
            array.values[((i * ny + j) * nz + k) * each + of]
        };
        (0..nx * ny * nz).map(value).collect::<Vec<f64>>()
    };
    if let Some(potential) = array(POTENTIAL) {
        fits(potential, &[])?;
        return Ok(Samples { lattice, values: Values::Potential(component(potential, 0, 1)) });
    }
    if let Some(b) = array("B") {
        fits(b, &[3])?;
        return Ok(Samples { lattice, values: Values::FluxDensity([0, 1, 2].map(|k| component(b, k, 3))) });
    }
    let part = |name: &str| {
        let found = array(name).ok_or_else(|| {
            wrong(
                path,
                None,
                name,
                "is missing: give B, or Bx, By and Bz, or potential, with an index for each of x, y, z",
            )
        })?;
        fits(found, &[])?;
        Ok(component(found, 0, 1))
    };
    let [x, y, z] = FLUX.map(part);
    Ok(Samples { lattice, values: Values::FluxDensity([x?, y?, z?]) })
}
