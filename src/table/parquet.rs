//! Parquet: zstd, byte-stream split, no dictionary; checksum of the data pages in the footer.

use super::{Column, Table, Values};
use crate::model::Status;
use crate::results::{
    ResultsError,
    parts::{FileMetadata, PartInfo, checksum},
};
use arrow::array::AsArray;
use arrow::array::{Array, ArrayRef, BooleanArray, Float32Array, Float64Array, StringArray, UInt64Array};
use arrow::buffer::NullBuffer;
use arrow::datatypes::{DataType, Field, Schema};
use arrow::datatypes::{Float32Type, Float64Type, Int32Type, Int64Type, UInt64Type};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::arrow_writer::{ArrowRowGroupWriterFactory, compute_leaves};
use parquet::arrow::{ArrowSchemaConverter, ProjectionMask, add_encoded_arrow_schema_to_metadata};
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, ParquetMetaDataReader};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

const PART_KEY: &str = "rodsweep.part";

/// Makes `bytes` a part; what they held is forgotten.
pub fn encode(
    path: &Path,
    table: &Table,
    metadata: &FileMetadata,
    info: &mut PartInfo,
    bytes: &mut Vec<u8>,
) -> Result<(), ResultsError> {
    bytes.clear();
    try_encode(table, metadata, info, bytes).map_err(|error| damaged(path, error))
}

fn damaged(path: &Path, error: impl ToString) -> ResultsError {
    ResultsError::Damaged { path: path.into(), reason: error.to_string() }
}

/// Column after column, so that only one is there as an array and as pages.
fn try_encode(
    table: &Table,
    metadata: &FileMetadata,
    info: &mut PartInfo,
    bytes: &mut Vec<u8>,
) -> Result<(), ParquetError> {
    let fields: Vec<Field> = table.columns.iter().map(field).collect();
    let schema = Arc::new(Schema::new(fields));
    let mut properties = properties(table)?;
    add_encoded_arrow_schema_to_metadata(&schema, &mut properties);
    let root = ArrowSchemaConverter::new().convert(&schema)?.root_schema_ptr();
    let mut writer = SerializedFileWriter::new(bytes, root, Arc::new(properties))?;
    let encoders = ArrowRowGroupWriterFactory::new(&writer, schema.clone()).create_column_writers(0)?;
    let mut group = writer.next_row_group()?;
    for ((column, field), mut encoder) in table.columns.iter().zip(schema.fields()).zip(encoders) {
        for leaf in compute_leaves(field, &array(&column.values))? {
            encoder.write(&leaf)?;
        }
        encoder.close()?.append_to_row_group(&mut group)?;
    }
    group.close()?;
    writer.flush()?;
    info.checksum = checksum(writer.inner());
    let part = serde_json::to_string(info).unwrap_or_default();
    let pairs = [
        ("rodsweep.sweep", metadata.sweep.clone()),
        ("rodsweep.seed", metadata.seed.to_string()),
        ("rodsweep.version", env!("CARGO_PKG_VERSION").to_owned()),
        (PART_KEY, part),
    ];
    for (key, value) in pairs {
        writer.append_key_value_metadata(KeyValue::new(key.to_owned(), value));
    }
    writer.into_inner().map(|_| ())
}

fn properties(table: &Table) -> Result<WriterProperties, ParquetError> {
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_created_by(concat!("rodsweep ", env!("CARGO_PKG_VERSION")).into());
    for column in &table.columns {
        let encoding = match column.values {
            Values::Double(_) | Values::Single(_) => Encoding::BYTE_STREAM_SPLIT,
            Values::Index(_) => Encoding::DELTA_BINARY_PACKED,
            Values::Status(_) | Values::Flag(_) => continue,
        };
        properties = properties.set_column_encoding(ColumnPath::new(vec![column.name.clone()]), encoding);
    }
    Ok(properties.build())
}

fn field(column: &Column) -> Field {
    let kind = match column.values {
        Values::Index(_) => DataType::UInt64,
        Values::Double(_) => DataType::Float64,
        Values::Single(_) => DataType::Float32,
        Values::Status(_) => DataType::Utf8,
        Values::Flag(_) => DataType::Boolean,
    };
    let nullable = !matches!(column.values, Values::Index(_) | Values::Status(_));
    let unit = HashMap::from([("unit".to_owned(), column.unit.clone())]);
    Field::new(&column.name, kind, nullable).with_metadata(unit)
}

fn array(values: &Values) -> ArrayRef {
    match values {
        Values::Index(values) => Arc::new(UInt64Array::from(values.clone())),
        Values::Double(values) => {
            let known = known(values.iter().map(|x| !x.is_nan()));
            Arc::new(Float64Array::new(values.clone().into(), known))
        }
        Values::Single(values) => {
            let known = known(values.iter().map(|x| !x.is_nan()));
            Arc::new(Float32Array::new(values.clone().into(), known))
        }
        Values::Status(values) => Arc::new(values.iter().map(|status| Some(status.name())).collect::<StringArray>()),
        Values::Flag(values) => Arc::new(values.iter().copied().collect::<BooleanArray>()),
    }
}

/// Which values there are, unless all are.
fn known(is_known: impl Iterator<Item = bool>) -> Option<NullBuffer> {
    Some(NullBuffer::from_iter(is_known)).filter(|nulls| nulls.null_count() > 0)
}

/// Compares the data pages with the checksum in the footer.
pub fn check(path: &Path, bytes: &[u8]) -> Result<PartInfo, ResultsError> {
    let file = std::fs::File::open(path).map_err(ResultsError::io(path, "reading"))?;
    let metadata = ParquetMetaDataReader::new().parse_and_finish(&file).map_err(|error| damaged(path, error))?;
    let pairs = metadata.file_metadata().key_value_metadata();
    let text = pairs.into_iter().flatten().find(|pair| pair.key == PART_KEY).and_then(|pair| pair.value.as_ref());
    let text = text.ok_or_else(|| damaged(path, "its footer has no checksum"))?;
    let info: PartInfo = serde_json::from_str(text).map_err(|error| damaged(path, error))?;
    let length: usize = info.checksum.rsplit(':').next().and_then(|length| length.parse().ok()).unwrap_or(usize::MAX);
    match bytes.get(..length) {
        Some(data) if checksum(data) == info.checksum && metadata.file_metadata().num_rows() as u64 == info.rows => {
            Ok(info)
        }
        _ => Err(damaged(path, "the checksum differs")),
    }
}

fn open(path: &Path) -> Result<ParquetRecordBatchReaderBuilder<std::fs::File>, ResultsError> {
    let file = std::fs::File::open(path).map_err(ResultsError::io(path, "reading"))?;
    ParquetRecordBatchReaderBuilder::try_new(file).map_err(|error| damaged(path, error))
}

/// The named columns of a part; all of them if no name is given.
pub fn read(path: &Path, names: &[&str]) -> Result<Table, ResultsError> {
    let builder = open(path)?;
    let chosen: Vec<usize> = (0..builder.schema().fields().len())
        .filter(|index| names.is_empty() || names.contains(&builder.schema().field(*index).name().as_str()))
        .collect();
    let mask = ProjectionMask::roots(builder.parquet_schema(), chosen);
    let reader = builder.with_projection(mask).build().map_err(|error| damaged(path, error))?;
    let mut table = Table::default();
    for batch in reader {
        let batch = batch.map_err(|error| damaged(path, error))?;
        let mut columns = Vec::new();
        for (field, array) in batch.schema().fields().iter().zip(batch.columns()) {
            let values =
                values(array).ok_or_else(|| damaged(path, format!("column {} has a strange type", field.name())))?;
            let unit = field.metadata().get("unit").cloned().unwrap_or_default();
            columns.push(Column { name: field.name().clone(), unit, values });
        }
        table.append(&Table { columns });
    }
    Ok(table)
}

fn values(array: &ArrayRef) -> Option<Values> {
    Some(match array.data_type() {
        DataType::UInt64 => Values::Index(array.as_primitive::<UInt64Type>().values().to_vec()),
        DataType::Float64 => {
            Values::Double(array.as_primitive::<Float64Type>().iter().map(|x| x.unwrap_or(f64::NAN)).collect())
        }
        DataType::Float32 => {
            Values::Single(array.as_primitive::<Float32Type>().iter().map(|x| x.unwrap_or(f32::NAN)).collect())
        }
        DataType::Boolean => Values::Flag(array.as_boolean().iter().collect()),
        DataType::Utf8 => {
            let of = |word: Option<&str>| Status::ALL.into_iter().find(|status| Some(status.name()) == word);
            Values::Status(array.as_string::<i32>().iter().map(|word| of(word).unwrap_or_default()).collect())
        }
        _ => return None,
    })
}

/// Every numeric column of any Parquet file, as f64 with NaN for null; a text column is an error.
pub fn read_numbers(path: &Path) -> Result<Vec<(String, Vec<f64>)>, ResultsError> {
    let reader = open(path)?.build().map_err(|error| damaged(path, error))?;
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for batch in reader {
        let batch = batch.map_err(|error| damaged(path, error))?;
        for (index, (field, array)) in batch.schema().fields().iter().zip(batch.columns()).enumerate() {
            let numbers: Vec<f64> = match array.data_type() {
                DataType::Int32 => {
                    array.as_primitive::<Int32Type>().iter().map(|x| x.map_or(f64::NAN, f64::from)).collect()
                }
                DataType::Int64 => {
                    array.as_primitive::<Int64Type>().iter().map(|x| x.map_or(f64::NAN, |x| x as f64)).collect()
                }
                DataType::UInt64 | DataType::Float32 | DataType::Float64 => {
                    let values = values(array).unwrap_or(Values::Double(Vec::new()));
                    (0..values.len()).map(|row| values.number(row)).collect()
                }
                other => return Err(damaged(path, format!("column {} is {other}; give numbers", field.name()))),
            };
            match columns.get_mut(index) {
                Some((_, column)) => column.extend(numbers),
                None => columns.push((field.name().clone(), numbers)),
            }
        }
    }
    Ok(columns)
}
