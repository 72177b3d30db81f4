//! Tables of studies: numbers, counts, flags and words by column, as CSV or Parquet by the file's extension.

use crate::results::{ResultsError, parts::write_atomically};
use arrow::array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// One column of a study's table.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainColumn {
    pub name: String,
    /// SI; empty for none.
    pub unit: String,
    pub values: PlainValues,
}

/// NaN stands for "none".
#[derive(Clone, Debug, PartialEq)]
pub enum PlainValues {
    Count(Vec<u64>),
    Number(Vec<f64>),
    Flag(Vec<bool>),
    Word(Vec<String>),
}

impl PlainColumn {
    pub fn new(name: impl Into<String>, unit: &str, values: PlainValues) -> Self {
        Self { name: name.into(), unit: unit.into(), values }
    }
}

/// Writes columns of equal length; CSV unless the name ends in `.parquet`. What is there is replaced.
pub fn write_plain(path: &Path, columns: &[PlainColumn], metadata: &[(&str, String)]) -> Result<(), ResultsError> {
    let is_parquet = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    let bytes = if is_parquet {
        let damaged = |error: ParquetError| ResultsError::Damaged { path: path.into(), reason: error.to_string() };
        encode_parquet(columns, metadata).map_err(damaged)?
    } else {
        encode_csv(columns).into_bytes()
    };
    write_atomically(path, &bytes, true).map(|_| ())
}

fn encode_csv(columns: &[PlainColumn]) -> String {
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    let mut text = names.join(",") + "\n";
    let row_count = columns.first().map_or(0, |column| column.values.len());
    for row in 0..row_count {
        let cells: Vec<String> = columns.iter().map(|column| column.values.cell(row)).collect();
        text += &(cells.join(",") + "\n");
    }
    text
}

impl PlainValues {
    fn len(&self) -> usize {
        match self {
            PlainValues::Count(values) => values.len(),
            PlainValues::Number(values) => values.len(),
            PlainValues::Flag(values) => values.len(),
            PlainValues::Word(values) => values.len(),
        }
    }

    fn cell(&self, row: usize) -> String {
        match self {
            PlainValues::Count(values) => values[row].to_string(),
            PlainValues::Number(values) if values[row].is_nan() => String::new(),
            PlainValues::Number(values) => format!("{:?}", values[row]),
            PlainValues::Flag(values) => values[row].to_string(),
            PlainValues::Word(values) => values[row].clone(),
        }
    }

    fn array(&self) -> ArrayRef {
        match self {
            PlainValues::Count(values) => Arc::new(UInt64Array::from(values.clone())),
            PlainValues::Number(values) => {
                Arc::new(values.iter().map(|x| (!x.is_nan()).then_some(*x)).collect::<Float64Array>())
            }
            PlainValues::Flag(values) => Arc::new(BooleanArray::from(values.clone())),
            PlainValues::Word(values) => Arc::new(StringArray::from(values.clone())),
        }
    }

    fn kind(&self) -> DataType {
        match self {
            PlainValues::Count(_) => DataType::UInt64,
            PlainValues::Number(_) => DataType::Float64,
            PlainValues::Flag(_) => DataType::Boolean,
            PlainValues::Word(_) => DataType::Utf8,
        }
    }
}

fn encode_parquet(columns: &[PlainColumn], metadata: &[(&str, String)]) -> Result<Vec<u8>, ParquetError> {
    let field = |column: &PlainColumn| {
        let nullable = matches!(column.values, PlainValues::Number(_));
        let unit = HashMap::from([("unit".to_owned(), column.unit.clone())]);
        Field::new(&column.name, column.values.kind(), nullable).with_metadata(unit)
    };
    let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<Field>>()));
    let batch = RecordBatch::try_new(schema.clone(), columns.iter().map(|column| column.values.array()).collect())?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_created_by(concat!("rodsweep ", env!("CARGO_PKG_VERSION")).into())
        .build();
    let mut writer = ArrowWriter::try_new(Vec::new(), schema, Some(properties))?;
    writer.write(&batch)?;
    for (key, value) in metadata {
        writer.append_key_value_metadata(KeyValue::new((*key).to_owned(), value.clone()));
    }
    writer.into_inner()
}
