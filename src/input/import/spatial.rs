//! The published solver's spatial configuration: field, gravity, entry point and entry frame.

use super::super::error::{InputError, Problem};
use super::super::scene_file::read_text;
use super::keywords::{Bound, Keyword, KeywordFile};
use super::name_of;
use crate::model::Vector;
use crate::model::rotation_vector;
use std::path::Path;

const FIELD: Keyword = Keyword { name: "B0", unit: "T", bound: Bound::Any };
const GRAVITY: Keyword = Keyword { name: "gravity", unit: "m/s^2", bound: Bound::Any };
const POSITION: Keyword = Keyword { name: "p0", unit: "mm", bound: Bound::Any };
const ROTATION: Keyword = Keyword { name: "R0", unit: "", bound: Bound::Any };

pub(crate) const KNOWN: [&str; 4] = [FIELD.name, GRAVITY.name, POSITION.name, ROTATION.name];

/// Largest deviation of R0 from a rotation; published files have six digits or more.
const ORTHONORMAL: f64 = 1e-5;

/// A spatial configuration; texts are quantities of a scene file.
pub(crate) struct Spatial {
    pub file: String,
    pub flux_density: [String; 3],
    pub gravity: [String; 3],
    pub position: [String; 3],
    /// Rotation vector, body to world (rad)
    pub rotation: Vector,
}

pub(crate) fn read(file: &Path) -> Result<Spatial, InputError> {
    let text = read_text(file)?;
    let source = KeywordFile::parse(file, text.strip_prefix('\u{feff}').unwrap_or(&text), &KNOWN)?;
    let vector = |keyword: &Keyword| -> Result<[String; 3], InputError> {
        let numbers = source.numbers(keyword, 3, "along x, y, z of the world")?;
        Ok(std::array::from_fn(|k| format!("\"{} {}\"", numbers[k].text, keyword.unit)))
    };
    let entries = source.numbers(&ROTATION, 9, "a rotation matrix row by row, body to world")?;
    let matrix = std::array::from_fn(|row| std::array::from_fn(|col| entries[3 * row + col].value));
    if !is_rotation(&matrix) {
        let value = "no rotation".into();
        let expected =
            "nine numbers, row by row, whose columns are the body's axes in the world, at right angles".into();
        return Err(source.error(ROTATION.name, Problem::Range { value, expected }));
    }
    Ok(Spatial {
        file: name_of(file),
        flux_density: vector(&FIELD)?,
        gravity: vector(&GRAVITY)?,
        position: vector(&POSITION)?,
        rotation: rotation_vector(&matrix),
    })
}

/// Orthonormal rows, right-handed.
fn is_rotation(m: &[Vector; 3]) -> bool {
    let dot = |a: Vector, b: Vector| -> f64 { (0..3).map(|k| a[k] * b[k]).sum() };
    let cross = |a: Vector, b: Vector| -> Vector {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let close = |a: f64, b: f64| (a - b).abs() <= ORTHONORMAL;
    let right_handed = cross(m[0], m[1]).iter().zip(m[2]).all(|(a, b)| close(*a, b));
    close(dot(m[0], m[0]), 1.0) && close(dot(m[1], m[1]), 1.0) && close(dot(m[0], m[1]), 0.0) && right_handed
}
