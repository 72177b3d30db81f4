//! Arrays of an NPZ or a MATLAB file: a number for each node, or an index for each of x, y and z.

use super::data::{Factors, POTENTIAL, Samples, Values};
use super::grid::of_axes;
use super::nodes::{FLUX, Named, PLACES, meaning, of_columns};
use super::{MOST_NODES, wrong};
use crate::input::InputError;
use crate::model::{short_list, short_name};
use crate::table::npy::NumberArray;
use crate::table::{TableError, mat, npy};
use std::path::Path;

/// Three numbers a node: B.
const VECTOR: &str = "B";
/// Three coordinates a node, by one of these names.
const POINTS: &str = "points";
const NAMES_OF_POINTS: [&str; 10] =
    [POINTS, "grid", "positions", "position", "pos", "xyz", "coords", "coordinates", "nodes", "observers"];
const NAMES_OF_VECTORS: [&str; 4] = [VECTOR, "b", "B_field", "flux_density"];

/// The meaning of an array's name, and whether it is our own name.
fn of_array(name: &str) -> Option<(&'static str, bool)> {
    match name {
        _ if NAMES_OF_VECTORS.contains(&name) => Some((VECTOR, name == VECTOR)),
        _ if NAMES_OF_POINTS.iter().any(|known| known.eq_ignore_ascii_case(name)) => Some((POINTS, name == POINTS)),
        _ => meaning(name),
    }
}

/// Format of a file of arrays, and the bytes of one that is read from memory.
pub(super) enum File<'a> {
    Npz,
    Matlab(&'a [u8]),
}

impl File<'_> {
    fn names(&self, path: &Path) -> Result<Vec<String>, TableError> {
        match self {
            File::Npz => npy::array_names(path),
            File::Matlab(bytes) => mat::array_names(bytes),
        }
    }

    fn arrays(&self, path: &Path, names: &[&str]) -> Result<Vec<NumberArray>, TableError> {
        let most = 3 * MOST_NODES as u64;
        match self {
            File::Npz => npy::read_arrays(path, names, most),
            File::Matlab(bytes) => mat::read_arrays(bytes, names, most),
        }
    }
}

/// An array without indices of one place, by its meaning.
struct Array {
    means: &'static str,
    own: NumberArray,
}

pub(super) fn read(path: &Path, factors: &Factors, file: &File) -> Result<Samples, InputError> {
    let refused = |words: String| wrong(path, None, "", words);
    let names = file.names(path).map_err(|error| refused(error.to_string()))?;
    let mut chosen: Vec<(&str, &'static str, bool)> = Vec::new();
    for name in names.iter().map(String::as_str) {
        let Some((means, is_own)) = of_array(name) else { continue };
        match chosen.iter().position(|(_, other, _)| *other == means) {
            None => chosen.push((name, means, is_own)),
            Some(at) if is_own => chosen[at] = (name, means, is_own),
            Some(at) if chosen[at].2 => {}
            Some(at) => {
                let another = short_name(chosen[at].0);
                let words = format!("and `{another}` both may be {means}: drop one of the arrays, or rename it");
                return Err(wrong(path, None, name, words));
            }
        }
    }
    let there = format!("the file has {}", listed(&names));
    let asked: Vec<&str> = chosen.iter().map(|(name, ..)| *name).collect();
    let arrays = file.arrays(path, &asked).map_err(|error| refused(error.to_string()))?;
    let mut all = Vec::new();
    for (mut own, (_, means, _)) in arrays.into_iter().zip(chosen) {
        let factor = factors.of(if means == POINTS { PLACES[0] } else { means });
        own.values.iter_mut().for_each(|x| *x *= factor);
        let is_place = means == POINTS || PLACES.contains(&means);
        if is_place && own.values.iter().any(|x| !x.is_finite()) {
            return Err(wrong(path, None, &own.name, "has a place that is not finite: give each node its coordinates"));
        }
        // MATLAB knows no array of one index.
        if own.shape.iter().filter(|n| **n != 1).count() == 1 {
            own.shape.retain(|n| *n != 1);
        }
        all.push(Array { means, own });
    }
    if let File::Matlab(_) = file {
        turn_meshgrid(path, &mut all)?;
    }
    let found = |means: &str| all.iter().find(|array| array.means == means).map(|array| &array.own);
    let axes = PLACES.map(found);
    if let [Some(x), Some(y), Some(z)] = axes {
        let by_axes = [x, y, z].iter().all(|axis| axis.shape.len() == 1);
        let has_grid = |array: &Array| !PLACES.contains(&array.means) && array.own.shape.len() >= 3;
        if by_axes && all.iter().any(has_grid) {
            return of_grid(path, [x, y, z], &found, &there);
        }
    }
    of_nodes(path, &found, &there)
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        return "no arrays".into();
    }
    short_list(names.iter().map(|name| format!("`{}`", short_name(name))))
}

/// Every node with its coordinates: arrays of equal shapes, or three numbers a node.
fn of_nodes<'a>(
    path: &Path,
    found: &impl Fn(&str) -> Option<&'a NumberArray>,
    there: &str,
) -> Result<Samples, InputError> {
    let mut named: Named = Vec::new();
    let mut nodes: Option<(&str, &[usize], usize)> = None;
    let mut same = |array: &'a NumberArray, shape: &'a [usize], count: usize| match nodes {
        Some((other, of, others)) if others != count => {
            let words = format!("has the shape {:?} and `{other}` {of:?}: give one number a node in each", array.shape);
            Err(wrong(path, None, &array.name, words))
        }
        _ => {
            nodes = Some((&array.name, shape, count));
            Ok(())
        }
    };
    for (whole, parts) in [(POINTS, PLACES), (VECTOR, FLUX)] {
        if let Some(array) = found(whole) {
            let columns = in_three(array).ok_or_else(|| {
                let words =
                    format!("has the shape {:?}: give three numbers a node, (N, 3) or (nx, ny, nz, 3)", array.shape);
                wrong(path, None, &array.name, words)
            })?;
            same(array, &array.shape, columns[0].len())?;
            named.extend(parts.into_iter().zip(columns));
        }
    }
    for means in PLACES.into_iter().chain(FLUX).chain([POTENTIAL]) {
        if let Some(array) = found(means).filter(|_| named.iter().all(|(other, _)| *other != means)) {
            same(array, &array.shape, array.values.len())?;
            named.push((means, array.values.clone()));
        }
    }
    of_columns(path, &named, there)
}

/// Numbers of three components, whose index is the last or, where that cannot be, the first.
fn in_three(array: &NumberArray) -> Option<[Vec<f64>; 3]> {
    let nodes = array.values.len() / 3;
    match array.shape[..] {
        [.., 3] => Some([0, 1, 2].map(|k| array.values.iter().skip(k).step_by(3).copied().collect())),
        [3, ..] => Some([0, 1, 2].map(|k| array.values[k * nodes..(k + 1) * nodes].to_vec())),
        _ => None,
    }
}

/// Turns arrays with the indices y, x, z, as MATLAB's `meshgrid` has them, to x, y, z, beside places along each axis. Where there are as
/// many places along x as along y, nothing tells the two ways apart.
fn turn_meshgrid(path: &Path, all: &mut [Array]) -> Result<(), InputError> {
    let axis = |means: &str| all.iter().find(|array| array.means == means && array.own.shape.len() == 1);
    let [Some(nx), Some(ny), Some(_)] = PLACES.map(|means| axis(means).map(|axis| axis.own.values.len())) else {
        return Ok(());
    };
    for Array { own, .. } in all {
        let [a, b, rest @ ..] = &own.shape[..] else { continue };
        if rest.is_empty() {
            continue;
        }
        if nx == ny && [*a, *b] == [nx, ny] {
            let words = "may have the indices x, y or y, x, since both have as many places: save an array of each node's \
                         coordinates, [x, y, z] = ndgrid(x, y, z) or meshgrid(x, y, z), in place of the places along each axis";
            return Err(wrong(path, None, &own.name, words));
        }
        if [*a, *b] == [ny, nx] {
            let inner: usize = rest.iter().product();
            let value = |at: usize| {
                let (i, j, k) = (at / (ny * inner), at / inner % ny, at % inner);
                own.values[(j * nx + i) * inner + k]
            };
            own.values = (0..own.values.len()).map(value).collect();
            own.shape.swap(0, 1);
        }
    }
    Ok(())
}

/// Places along each axis, and arrays with an index for each of them.
fn of_grid<'a>(
    path: &Path,
    axes: [&NumberArray; 3],
    found: &impl Fn(&str) -> Option<&'a NumberArray>,
    there: &str,
) -> Result<Samples, InputError> {
    let lattice = of_axes(path, axes.map(|axis| &axis.values[..]))?;
    let [nx, ny, nz] = lattice.counts;
    let shape = [nx, ny, nz];
    let misfit = |array: &NumberArray, expected: &[usize]| {
        let mut turned = array.shape.clone();
        turned[..3.min(array.shape.len())].reverse();
        let remedy = match turned == expected {
            true => format!(
                "; its indices are z, y, x: save {}.transpose(2, 1, 0{})",
                array.name,
                if expected.len() == 4 { ", 3" } else { "" }
            ),
            false => String::new(),
        };
        let words = format!("has the shape {:?}; x, y and z ask for {expected:?}{remedy}", array.shape);
        wrong(path, None, &array.name, words)
    };
    // The last index of the file is the fastest, here the first is.
    let turned = |values: &[f64]| {
        let node = |at: usize| [at % nx, at / nx % ny, at / (nx * ny)];
        let value = |at: usize| {
            let [i, j, k] = node(at);
            values[(i * ny + j) * nz + k]
        };
        (0..nx * ny * nz).map(value).collect::<Vec<f64>>()
    };
    let scalar = |array: &NumberArray| {
        if array.shape == shape { Ok(turned(&array.values)) } else { Err(misfit(array, &shape)) }
    };
    let values = if let Some(potential) = found(POTENTIAL) {
        Values::Potential(scalar(potential)?)
    } else if let Some(b) = found(VECTOR) {
        let ways = [vec![nx, ny, nz, 3], vec![3, nx, ny, nz]];
        let columns = in_three(b).filter(|_| ways.contains(&b.shape)).ok_or_else(|| misfit(b, &ways[0]))?;
        Values::FluxDensity(columns.map(|column| turned(&column)))
    } else {
        let part = |name: &str| {
            let array = found(name).ok_or_else(|| {
                let words = "is missing: give B, or Bx, By and Bz, or potential, with an index for each of x, y, z";
                wrong(path, None, name, format!("{words}; {there}"))
            })?;
            scalar(array)
        };
        let [x, y, z] = FLUX.map(part);
        Values::FluxDensity([x?, y?, z?])
    };
    Ok(Samples { lattice, values, strays: None, notes: Vec::new() })
}
