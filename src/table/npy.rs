//! Arrays of numbers in an NPZ file, of any shape.

use super::TableError;
use super::error::damaged;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

const FORMAT: &str = "NPZ";
const MAGIC: &[u8] = b"\x93NUMPY";

/// An array of numbers, the last index the fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberArray {
    /// As it was saved.
    pub name: String,
    /// Of each index.
    pub shape: Vec<usize>,
    /// All numbers.
    pub values: Vec<f64>,
}

/// Names of the arrays of a file, in its order.
///
/// # Errors
///
/// A file that cannot be read.
pub fn array_names(path: &Path) -> Result<Vec<String>, TableError> {
    let file = BufReader::new(crate::files::open(path)?);
    let archive = ZipArchive::new(file).map_err(|error| damaged(FORMAT, error))?;
    let mut names = Vec::new();
    for name in archive.file_names() {
        let name = name.map_err(|error| damaged(FORMAT, error))?;
        names.extend(name.strip_suffix(".npy").map(String::from));
    }
    Ok(names)
}

/// The arrays of these names that the file has.
///
/// # Errors
///
/// A file that cannot be read, an array of another kind than numbers, more than `most` numbers.
pub fn read_arrays(path: &Path, names: &[&str], most: u64) -> Result<Vec<NumberArray>, TableError> {
    let file = BufReader::new(crate::files::open(path)?);
    let mut archive = ZipArchive::new(file).map_err(|error| damaged(FORMAT, error))?;
    let mut arrays = Vec::new();
    for name in names {
        let member = format!("{name}.npy");
        if archive.index_for_name(&member).is_none() {
            continue;
        }
        let file = archive.by_name(&member).map_err(|error| damaged(FORMAT, error))?;
        let mut bytes = Vec::new();
        // Eight bytes a number, and a header.
        let limit = 8 * most + (1 << 16);
        file.take(limit + 1).read_to_end(&mut bytes).map_err(|error| damaged(FORMAT, error))?;
        if bytes.len() as u64 > limit {
            return Err(TableError::TooLarge { rows: bytes.len() as u64 / 8, columns: 1, most });
        }
        let array = parse(name, &bytes).ok_or_else(|| TableError::Kind {
            column: (*name).into(),
            found: "an array of another kind",
            expected: "numbers (f8, f4 or integers, little-endian)",
        })?;
        arrays.push(array);
    }
    Ok(arrays)
}

fn parse(name: &str, bytes: &[u8]) -> Option<NumberArray> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (version, rest) = rest.split_at_checked(2)?;
    let (length, rest) = match version[0] {
        1 => (usize::from(u16::from_le_bytes(*rest.first_chunk()?)), &rest[2..]),
        _ => (u32::from_le_bytes(*rest.first_chunk()?) as usize, &rest[4..]),
    };
    let (header, data) = rest.split_at_checked(length)?;
    let header = std::str::from_utf8(header).ok()?;
    let kind = header.split_once("'descr': '")?.1.split('\'').next()?;
    let is_fortran = header.split_once("'fortran_order': ")?.1.starts_with("True");
    let shape = header.split_once("'shape': (")?.1.split(')').next()?;
    let numbers = shape.split(',').map(str::trim).filter(|number| !number.is_empty());
    let shape: Vec<usize> = numbers.map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let values: Vec<f64> = match kind {
        "<f8" => numbers_of(data, f64::from_le_bytes),
        "<f4" => numbers_of(data, |bytes| f64::from(f32::from_le_bytes(bytes))),
        "<i8" => numbers_of(data, |bytes| i64::from_le_bytes(bytes) as f64),
        "<i4" => numbers_of(data, |bytes| f64::from(i32::from_le_bytes(bytes))),
        _ => return None,
    };
    let count = shape.iter().try_fold(1_usize, |product, n| product.checked_mul(*n))?;
    if count != values.len() {
        return None;
    }
    let values = if is_fortran { last_fastest(&shape, &values) } else { values };
    Some(NumberArray { name: name.into(), shape, values })
}

pub(super) fn numbers_of<const WIDTH: usize>(data: &[u8], of: impl Fn([u8; WIDTH]) -> f64) -> Vec<f64> {
    data.as_chunks().0.iter().map(|bytes| of(*bytes)).collect()
}

/// From the first index the fastest.
pub(super) fn last_fastest(shape: &[usize], values: &[f64]) -> Vec<f64> {
    let place = |mut at: usize| {
        let mut index = 0;
        // `at` counts with the last index the fastest.
        for (k, n) in shape.iter().enumerate().rev() {
            index += at % n * shape[..k].iter().product::<usize>();
            at /= n;
        }
        index
    };
    (0..values.len()).map(|at| values[place(at)]).collect()
}
