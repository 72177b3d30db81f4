//! NPZ: one array a column, named as it is, for `numpy.load`.
//!
//! Counts are `<u8`, numbers `<f8` or `<f4` with NaN for none, statuses bytes (`b"ok"`), text `<U`; flags are `|i1`:
//! 1, 0, or -1 where it is unknown.

use super::error::damaged;
use super::{Column, Table, TableError, Values};
use crate::model::Status;
use std::io::{Cursor, Read, Seek, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

const FORMAT: &str = "NPZ";
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
/// Bytes of a status; the longest word has 13.
const STATUS_WIDTH: usize = 16;

/// The archive of a table. The same rows make the same bytes.
///
/// # Errors
///
/// A table that the archive cannot hold.
pub fn encode(table: &Table) -> Result<Vec<u8>, TableError> {
    let unwritable =
        |error: &dyn std::fmt::Display| TableError::Unwritable { format: FORMAT, reason: error.to_string() };
    // The time is that of 1980, the first that ZIP knows.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for column in &table.columns {
        archive.start_file(format!("{}.npy", column.name), options).map_err(|error| unwritable(&error))?;
        let (kind, data) = array(&column.values);
        let header = header(&kind, column.values.len());
        archive.write_all(&header).and_then(|()| archive.write_all(&data)).map_err(|error| unwritable(&error))?;
    }
    Ok(archive.finish().map_err(|error| unwritable(&error))?.into_inner())
}

/// Header of a `.npy` file, version 1.0: padded so that the data begin at a multiple of 64 bytes.
fn header(kind: &str, rows: usize) -> Vec<u8> {
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({rows},), }}");
    let length = (MAGIC.len() + 2 + text.len() + 1).next_multiple_of(64) - MAGIC.len() - 2;
    text += &" ".repeat(length - text.len() - 1);
    text.push('\n');
    [MAGIC, &(length as u16).to_le_bytes(), text.as_bytes()].concat()
}

/// NumPy's name of the kind, and the rows as bytes.
fn array(values: &Values) -> (String, Vec<u8>) {
    match values {
        Values::Index(values) => ("<u8".into(), values.iter().flat_map(|value| value.to_le_bytes()).collect()),
        Values::Double(values) => ("<f8".into(), values.iter().flat_map(|value| value.to_le_bytes()).collect()),
        Values::Single(values) => ("<f4".into(), values.iter().flat_map(|value| value.to_le_bytes()).collect()),
        Values::Flag(values) => {
            ("|i1".into(), values.iter().map(|flag| flag.map_or(-1, i8::from).to_le_bytes()[0]).collect())
        }
        Values::Status(values) => {
            let padded = |status: &Status| {
                let mut bytes = [0; STATUS_WIDTH];
                bytes[..status.name().len()].copy_from_slice(status.name().as_bytes());
                bytes
            };
            (format!("|S{STATUS_WIDTH}"), values.iter().flat_map(padded).collect())
        }
        Values::Text(values) => {
            // NumPy has no text of width 0.
            let width = values.iter().map(|word| word.chars().count()).max().unwrap_or(0).max(1);
            let padded = |word: &String| -> Vec<u8> {
                let letters = word.chars().chain(std::iter::repeat('\0')).take(width);
                letters.flat_map(|letter| u32::from(letter).to_le_bytes()).collect()
            };
            (format!("<U{width}"), values.iter().flat_map(padded).collect())
        }
    }
}

/// Reads the columns of `like` that are named (all, if none are), with its kinds and units: NumPy knows no units.
///
/// # Errors
///
/// A file that cannot be read, or lacks a column, or has another kind of values.
pub fn read(path: &Path, names: &[&str], like: &Table) -> Result<Table, TableError> {
    read_archive(std::io::BufReader::new(crate::files::open(path)?), names, like)
}

/// As [`read`], of an archive in memory.
///
/// # Errors
///
/// An archive that is damaged, or lacks a column, or has another kind of values.
pub fn decode(bytes: &[u8], names: &[&str], like: &Table) -> Result<Table, TableError> {
    read_archive(Cursor::new(bytes), names, like)
}

fn read_archive(file: impl Read + Seek, names: &[&str], like: &Table) -> Result<Table, TableError> {
    let mut archive = ZipArchive::new(file).map_err(|error| damaged(FORMAT, error))?;
    let mut table = Table::default();
    let mut bytes = Vec::new();
    for column in like.columns.iter().filter(|column| names.is_empty() || names.contains(&column.name.as_str())) {
        bytes.clear();
        let mut file = archive.by_name(&format!("{}.npy", column.name)).map_err(|error| damaged(FORMAT, error))?;
        file.read_to_end(&mut bytes).map_err(|error| damaged(FORMAT, error))?;
        let values = parse_array(column, &bytes)?;
        if table.columns.first().is_some_and(|first| first.values.len() != values.len()) {
            return Err(damaged(FORMAT, format!("the array `{}` is of another length than the first", column.name)));
        }
        table.columns.push(column.with_values(values));
    }
    Ok(table)
}

/// A `.npy` file as the kind of values that its column holds.
fn parse_array(column: &Column, bytes: &[u8]) -> Result<Values, TableError> {
    let strange = || damaged(FORMAT, format!("the array `{}` is of another kind", column.name));
    let (kind, data) = parse_header(bytes).ok_or_else(strange)?;
    let values = match (&column.values, kind) {
        (Values::Index(_), "<u8") => Values::Index(rows(data, u64::from_le_bytes)),
        (Values::Double(_), "<f8") => Values::Double(rows(data, f64::from_le_bytes)),
        (Values::Single(_), "<f4") => Values::Single(rows(data, f32::from_le_bytes)),
        (Values::Flag(_), "|i1") => {
            let flag = |byte: [u8; 1]| Some(i8::from_le_bytes(byte)).filter(|flag| *flag >= 0).map(|flag| flag > 0);
            Values::Flag(rows(data, flag))
        }
        (Values::Status(_), _) => {
            let width: usize = kind.strip_prefix("|S").and_then(|width| width.parse().ok()).ok_or_else(strange)?;
            let status = |word: &[u8]| {
                let word = word.split(|byte| *byte == 0).next().unwrap_or_default();
                Status::ALL.into_iter().find(|status| status.name().as_bytes() == word)
            };
            let statuses: Option<Vec<Status>> = data.chunks_exact(width.max(1)).map(status).collect();
            Values::Status(statuses.ok_or_else(strange)?)
        }
        (Values::Text(_), _) => {
            let width: usize = kind.strip_prefix("<U").and_then(|width| width.parse().ok()).ok_or_else(strange)?;
            let letters: Vec<u32> = rows(data, u32::from_le_bytes);
            let word =
                |letters: &[u32]| letters.iter().filter(|c| **c != 0).filter_map(|c| char::from_u32(*c)).collect();
            Values::Text(letters.chunks_exact(width.max(1)).map(word).collect())
        }
        _ => return Err(strange()),
    };
    Ok(values)
}

/// NumPy's name of the kind, and the data.
fn parse_header(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let length = usize::from(u16::from_le_bytes(*rest.first_chunk()?));
    let (header, data) = rest.get(2..)?.split_at_checked(length)?;
    let kind = std::str::from_utf8(header).ok()?.split_once("'descr': '")?.1.split('\'').next()?;
    Some((kind, data))
}

fn rows<const WIDTH: usize, T>(data: &[u8], of: impl Fn([u8; WIDTH]) -> T) -> Vec<T> {
    data.as_chunks().0.iter().map(|bytes| of(*bytes)).collect()
}
