//! Legacy VTK files of a grid: `STRUCTURED_POINTS` or `RECTILINEAR_GRID`, as text or binary, with a vector or a scalar at
//! each point.

use super::data::{Factors, Samples, Values};
use super::grid::{Lattice, of_axes};
use super::{MOST_NODES, wrong};
use crate::input::InputError;
use crate::model::short_name;
use std::path::Path;

/// Words and numbers one after the other.
struct Cursor<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    is_binary: bool,
}

impl<'a> Cursor<'a> {
    fn wrong(&self, words: impl Into<String>) -> InputError {
        wrong(self.path, None, "", words)
    }

    fn line(&mut self) -> Option<&'a str> {
        if self.bytes.is_empty() {
            return None;
        }
        let end = self.bytes.iter().position(|byte| *byte == b'\n').unwrap_or(self.bytes.len());
        let line = std::str::from_utf8(&self.bytes[..end]).unwrap_or("");
        self.bytes = &self.bytes[(end + 1).min(self.bytes.len())..];
        Some(line.trim())
    }

    fn word(&mut self) -> &'a str {
        let start = self.bytes.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(self.bytes.len());
        let rest = &self.bytes[start..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.bytes = &rest[end..];
        std::str::from_utf8(&rest[..end]).unwrap_or("")
    }

    /// Numbers of this kind.
    fn numbers(&mut self, count: usize, kind: &str) -> Result<Vec<f64>, InputError> {
        if count > 3 * MOST_NODES {
            return Err(self.wrong(format!("asks for {count} numbers: at most {} are read", 3 * MOST_NODES)));
        }
        if !self.is_binary {
            let number = |cursor: &mut Self| {
                let word = cursor.word();
                word.parse()
                    .map_err(|_| cursor.wrong(format!("has \"{}\" where a number has to stand", short_name(word))))
            };
            return (0..count).map(|_| number(self)).collect();
        }
        let width = match kind {
            "double" => 8,
            "float" => 4,
            _ => return Err(self.wrong(format!("holds {} numbers; write float or double", short_name(kind)))),
        };
        if self.bytes.len() < count * width {
            return Err(self.wrong("ends before its numbers do"));
        }
        let (data, rest) = self.bytes.split_at(count * width);
        self.bytes = rest;
        Ok(match width {
            8 => data.as_chunks().0.iter().map(|bytes| f64::from_be_bytes(*bytes)).collect(),
            _ => data.as_chunks().0.iter().map(|bytes| f64::from(f32::from_be_bytes(*bytes))).collect(),
        })
    }
}

fn three<T: std::str::FromStr>(cursor: &Cursor, words: &[&str]) -> Result<[T; 3], InputError> {
    let numbers: Option<Vec<T>> = words.iter().skip(1).map(|word| word.parse().ok()).collect();
    let three = numbers.and_then(|numbers| <[T; 3]>::try_from(numbers).ok());
    three.ok_or_else(|| cursor.wrong(format!("needs three numbers after {}", words[0])))
}

/// Reads the grid and the first field of vectors, or else the first of scalars, which is a potential.
pub(super) fn read(path: &Path, bytes: &[u8], factors: &Factors) -> Result<Samples, InputError> {
    let mut cursor = Cursor { path, bytes, is_binary: false };
    if !cursor.line().is_some_and(|line| line.starts_with("# vtk DataFile")) {
        return Err(cursor.wrong("is no legacy VTK file: name it .vti if it is one of XML"));
    }
    cursor.line();
    cursor.is_binary = cursor.line().is_some_and(|line| line.eq_ignore_ascii_case("BINARY"));
    let (mut counts, mut origin, mut steps) = ([0_usize; 3], [0.0_f64; 3], [0.0_f64; 3]);
    let mut axes: [Vec<f64>; 3] = Default::default();
    let (mut vectors, mut scalars) = (None, None);
    let mut is_of_points = false;
    let mut is_even = true;
    while let Some(line) = cursor.line() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some(first) = words.first() else { continue };
        let nodes = counts.iter().try_fold(1_usize, |product, n| product.checked_mul(*n)).unwrap_or(usize::MAX);
        let kind = words.get(2).copied().unwrap_or("float");
        match first.to_uppercase().as_str() {
            "DATASET" => match words.get(1).map(|word| word.to_uppercase()).as_deref() {
                Some("STRUCTURED_POINTS") => {}
                Some("RECTILINEAR_GRID") => is_even = false,
                other => {
                    let found = short_name(other.unwrap_or("nothing"));
                    return Err(cursor.wrong(format!(
                        "the grid is irregular: it is {found}; sample the field again on STRUCTURED_POINTS"
                    )));
                }
            },
            "DIMENSIONS" => counts = three(&cursor, &words)?,
            "ORIGIN" => origin = three(&cursor, &words)?,
            "SPACING" | "ASPECT_RATIO" => steps = three(&cursor, &words)?,
            "X_COORDINATES" => axes[0] = cursor.numbers(counts[0], kind)?,
            "Y_COORDINATES" => axes[1] = cursor.numbers(counts[1], kind)?,
            "Z_COORDINATES" => axes[2] = cursor.numbers(counts[2], kind)?,
            "POINT_DATA" => is_of_points = true,
            "CELL_DATA" => is_of_points = false,
            "VECTORS" if is_of_points && vectors.is_none() => {
                vectors = Some(cursor.numbers(nodes.saturating_mul(3), kind)?);
            }
            "SCALARS" if is_of_points && vectors.is_none() && scalars.is_none() => {
                let before = cursor.bytes;
                if !cursor.line().is_some_and(|line| line.to_uppercase().starts_with("LOOKUP_TABLE")) {
                    cursor.bytes = before;
                }
                scalars = Some(cursor.numbers(nodes, kind)?);
            }
            _ => {}
        }
    }
    if is_even {
        for axis in 0..3 {
            axes[axis] = (0..counts[axis].min(MOST_NODES)).map(|k| origin[axis] + k as f64 * steps[axis]).collect();
        }
    }
    samples(path, axes, vectors, scalars, factors)
}

/// Of nodes along each axis, and vectors or a potential at each, in the file's units.
pub(super) fn samples(
    path: &Path,
    axes: [Vec<f64>; 3],
    vectors: Option<Vec<f64>>,
    scalars: Option<Vec<f64>>,
    factors: &Factors,
) -> Result<Samples, InputError> {
    let [x, y, z] = axes.map(|axis| axis.into_iter().map(|x| x * factors.length()).collect::<Vec<f64>>());
    let lattice: Lattice = of_axes(path, [&x, &y, &z])?;
    let values = match (vectors, scalars) {
        (Some(vectors), _) => {
            let of = |k: usize| vectors.iter().skip(k).step_by(3).map(|x| x * factors.field()).collect();
            Values::FluxDensity([of(0), of(1), of(2)])
        }
        (None, Some(scalars)) => {
            let factor = factors.field() * factors.length();
            Values::Potential(scalars.iter().map(|x| x * factor).collect())
        }
        (None, None) => {
            return Err(wrong(path, None, "", "has neither vectors nor scalars at its points: give B, or a potential"));
        }
    };
    Ok(Samples { lattice, values, strays: None, notes: Vec::new() })
}
