//! Arrays of numbers in a MATLAB file of version 5 to 7, of any shape.
//!
//! Such a file is a list of elements, each a tag (kind and size) and its data; `save` deflates them. A matrix is an element of elements:
//! flags, dimensions, name, numbers. Source: "MAT-File Format", The MathWorks.

use super::TableError;
use super::error::damaged;
use super::npy::{NumberArray, last_fastest, numbers_of};
use flate2::read::ZlibDecoder;
use std::io::{Read, Result as IoResult};

const FORMAT: &str = "MATLAB";
const HEADER: usize = 128;
/// Files of this version are HDF5, which is not read.
const HDF5: &[u8] = b"MATLAB 7.3";
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays that hold numbers: double to uint64.
const NUMBERS: std::ops::RangeInclusive<u32> = 6..=15;
const COMPLEX: u32 = 0x800;
/// Bytes of flags, dimensions and a name, at most.
const MOST_HEAD: u64 = 1 << 12;

/// Names of the arrays of numbers in a file, in its order.
///
/// # Errors
///
/// A file of another version, or a damaged one.
pub fn array_names(bytes: &[u8]) -> Result<Vec<String>, TableError> {
    let mut names = Vec::new();
    each_matrix(bytes, |head, _| {
        names.push(head.name);
        Ok(())
    })?;
    Ok(names)
}

/// The arrays of these names that the file has, in the order of the names.
///
/// # Errors
///
/// A file of another version, a damaged one, complex numbers, more than `most` numbers.
pub fn read_arrays(bytes: &[u8], names: &[&str], most: u64) -> Result<Vec<NumberArray>, TableError> {
    let mut found = Vec::new();
    each_matrix(bytes, |head, data| {
        if let Some(at) = names.iter().position(|name| *name == head.name) {
            found.push((at, numbers(head, data, most)?));
        }
        Ok(())
    })?;
    found.sort_by_key(|(at, _)| *at);
    found.dedup_by_key(|(at, _)| *at);
    Ok(found.into_iter().map(|(_, array)| array).collect())
}

/// Name, shape and kind of a matrix: its head.
struct Head {
    name: String,
    shape: Vec<usize>,
    is_complex: bool,
}

/// Calls `tell` for every matrix of numbers, with its head and the data after it.
fn each_matrix(
    bytes: &[u8],
    mut tell: impl FnMut(Head, &mut dyn Read) -> Result<(), TableError>,
) -> Result<(), TableError> {
    if bytes.starts_with(HDF5) {
        return Err(damaged(
            FORMAT,
            "a file of version 7.3 is HDF5, which is not read: save(\"map.mat\", \"-v7\") writes another",
        ));
    }
    let endings = bytes.get(HEADER - 2..HEADER);
    if endings != Some(b"IM") {
        let reason = match endings {
            Some(b"MI") => "its numbers are big-endian",
            _ => "it has no head of version 5 to 7: save(\"map.mat\", \"-v7\") writes one",
        };
        return Err(damaged(FORMAT, reason));
    }
    let mut rest = &bytes[HEADER..];
    while !rest.is_empty() {
        let (tag, after) = rest.split_at_checked(8).ok_or_else(|| damaged(FORMAT, "it ends within a tag"))?;
        let [kind, size] = [word(tag, 0), word(tag, 4)];
        let end = size as usize;
        let data = after.get(..end).ok_or_else(|| damaged(FORMAT, "it ends within an array"))?;
        match kind {
            MATRIX => matrix(&mut &data[..], &mut tell)?,
            COMPRESSED => {
                let mut inflated = ZlibDecoder::new(data);
                let tag = tag_of(&mut inflated).map_err(|error| damaged(FORMAT, error))?;
                if word(&tag, 0) == MATRIX {
                    matrix(&mut inflated, &mut tell)?;
                }
            }
            _ => {}
        }
        // Deflated elements are not padded.
        let padded = if kind == COMPRESSED { end } else { end.next_multiple_of(8) };
        rest = after.get(padded..).unwrap_or_default();
    }
    Ok(())
}

/// Reads the head of a matrix, and hands it on with the data after it if these are numbers.
fn matrix(
    data: &mut dyn Read,
    tell: &mut impl FnMut(Head, &mut dyn Read) -> Result<(), TableError>,
) -> Result<(), TableError> {
    let mut next = || element(data, MOST_HEAD).map_err(|error| damaged(FORMAT, error));
    let (_, flags) = next()?;
    let first = flags.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    if !NUMBERS.contains(&(first & 0xff)) {
        return Ok(());
    }
    let (_, dimensions) = next()?;
    let shape = dimensions.as_chunks().0.iter().map(|bytes| i32::from_le_bytes(*bytes).max(0) as usize).collect();
    let (_, name) = next()?;
    let name = String::from_utf8_lossy(&name).into_owned();
    tell(Head { name, shape, is_complex: first & COMPLEX != 0 }, data)
}

fn numbers(head: Head, data: &mut dyn Read, most: u64) -> Result<NumberArray, TableError> {
    let Head { name, shape, is_complex } = head;
    let count = shape.iter().try_fold(1_u64, |product, n| product.checked_mul(*n as u64)).unwrap_or(u64::MAX);
    if count > most {
        return Err(TableError::TooLarge { rows: count, columns: 1, most });
    }
    if is_complex {
        return Err(TableError::Kind { column: name, found: "complex numbers", expected: "real numbers" });
    }
    let (kind, bytes) = element(data, 8 * most).map_err(|error| damaged(FORMAT, error))?;
    let values = values(kind, &bytes).filter(|values| values.len() as u64 == count);
    let values = values
        .ok_or_else(|| damaged(FORMAT, format!("the array `{name}` has not as many numbers as its shape says")))?;
    Ok(NumberArray { values: last_fastest(&shape, &values), name, shape })
}

/// Numbers of a kind of data, whatever the class of their array: `save` writes small whole numbers in few bytes.
fn values(kind: u32, bytes: &[u8]) -> Option<Vec<f64>> {
    Some(match kind {
        1 => numbers_of(bytes, |[byte]| f64::from(byte as i8)),
        2 => numbers_of(bytes, |[byte]| f64::from(byte)),
        3 => numbers_of(bytes, |bytes| f64::from(i16::from_le_bytes(bytes))),
        4 => numbers_of(bytes, |bytes| f64::from(u16::from_le_bytes(bytes))),
        5 => numbers_of(bytes, |bytes| f64::from(i32::from_le_bytes(bytes))),
        6 => numbers_of(bytes, |bytes| f64::from(u32::from_le_bytes(bytes))),
        7 => numbers_of(bytes, |bytes| f64::from(f32::from_le_bytes(bytes))),
        9 => numbers_of(bytes, f64::from_le_bytes),
        12 => numbers_of(bytes, |bytes| i64::from_le_bytes(bytes) as f64),
        13 => numbers_of(bytes, |bytes| u64::from_le_bytes(bytes) as f64),
        _ => return None,
    })
}

/// The next tag: kind and size, or kind, size and data of a small element.
fn tag_of(data: &mut dyn Read) -> IoResult<[u8; 8]> {
    let mut tag = [0; 8];
    data.read_exact(&mut tag)?;
    Ok(tag)
}

/// Kind and data of an element of at most so many bytes. A small one stands in its tag.
fn element(data: &mut dyn Read, most: u64) -> IoResult<(u32, Vec<u8>)> {
    let tag = tag_of(data)?;
    let first = word(&tag, 0);
    let (kind, small) = (first & 0xffff, (first >> 16) as usize);
    if small > 0 {
        return Ok((kind, tag[4..][..small.min(4)].to_vec()));
    }
    let size = u64::from(word(&tag, 4));
    let padded = size.next_multiple_of(8);
    let mut bytes = Vec::new();
    // A last element may lack its padding.
    data.take(padded.min(most.next_multiple_of(8))).read_to_end(&mut bytes)?;
    if (bytes.len() as u64) < size {
        return Err(std::io::Error::other("an element ends before its data, or is too large"));
    }
    bytes.truncate(size as usize);
    Ok((kind, bytes))
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes[at..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes))
}
