//! NPZ: one array a column. `status` holds bytes (`b"ok"`); `stable` 1, 0, or -1 where it is unknown.

use super::{Column, Table, Values};
use crate::model::Status;
use crate::results::ResultsError;
use npyz::npz::{NpzArchive, NpzWriter};
use npyz::zip::{DateTime, write::FileOptions};
use npyz::{AutoSerialize, DType, TypeStr, WriterBuilder};
use std::io::Cursor;
use std::path::Path;

/// Bytes of a status; the longest word has 13.
const WORD: usize = 16;

pub fn encode(table: &Table) -> std::io::Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    let mut archive = NpzWriter::new(&mut bytes);
    for column in &table.columns {
        match &column.values {
            Values::Index(values) => array(&mut archive, &column.name, values)?,
            Values::Double(values) => array(&mut archive, &column.name, values)?,
            Values::Single(values) => array(&mut archive, &column.name, values)?,
            Values::Flag(values) => {
                let flags: Vec<i8> = values.iter().map(|flag| flag.map_or(-1, i8::from)).collect();
                array(&mut archive, &column.name, &flags)?;
            }
            Values::Status(values) => words(&mut archive, &column.name, values)?,
        }
    }
    drop(archive);
    Ok(bytes.into_inner())
}

type Archive<'a> = NpzWriter<&'a mut Cursor<Vec<u8>>>;

/// The same time in every archive, so that the same rows make the same bytes.
fn options() -> FileOptions {
    FileOptions::default().last_modified_time(DateTime::default())
}

fn array<T: AutoSerialize + Copy>(archive: &mut Archive, name: &str, values: &[T]) -> std::io::Result<()> {
    let builder = archive.array::<T>(name, options())?.default_dtype().shape(&[values.len() as u64]);
    let mut writer = builder.begin_nd()?;
    writer.extend(values.iter().copied())?;
    writer.finish()
}

fn words(archive: &mut Archive, name: &str, values: &[Status]) -> std::io::Result<()> {
    let kind: TypeStr = format!("|S{WORD}").parse().map_err(std::io::Error::other)?;
    let builder = archive.array::<[u8]>(name, options())?;
    let mut writer = builder.dtype(DType::Plain(kind)).shape(&[values.len() as u64]).begin_nd()?;
    for status in values {
        writer.push(status.name().as_bytes())?;
    }
    writer.finish()
}

pub fn read(path: &Path, names: &[&str], like: &Table) -> Result<Table, ResultsError> {
    let mut archive = NpzArchive::open(path).map_err(ResultsError::io(path, "reading"))?;
    let mut table = Table::default();
    let wanted = like.columns.iter().filter(|column| names.is_empty() || names.contains(&column.name.as_str()));
    for column in wanted {
        let values = read_array(&mut archive, column).map_err(ResultsError::io(path, "reading"))?;
        table.columns.push(Column { name: column.name.clone(), unit: column.unit.clone(), values });
    }
    Ok(table)
}

fn read_array(archive: &mut NpzArchive<std::io::BufReader<std::fs::File>>, column: &Column) -> std::io::Result<Values> {
    let missing = || std::io::Error::other(format!("no array {}", column.name));
    let array = archive.by_name(&column.name)?.ok_or_else(missing)?;
    Ok(match column.values {
        Values::Index(_) => Values::Index(array.into_vec()?),
        Values::Double(_) => Values::Double(array.into_vec()?),
        Values::Single(_) => Values::Single(array.into_vec()?),
        Values::Flag(_) => {
            let flags: Vec<i8> = array.into_vec()?;
            Values::Flag(flags.into_iter().map(|flag| (flag >= 0).then_some(flag > 0)).collect())
        }
        Values::Status(_) => {
            let words: Vec<Vec<u8>> = array.into_vec()?;
            let of = |word: &Vec<u8>| {
                let word = word.split(|byte| *byte == 0).next().unwrap_or_default();
                Status::ALL.into_iter().find(|status| status.name().as_bytes() == word).unwrap_or_default()
            };
            Values::Status(words.iter().map(of).collect())
        }
    })
}
