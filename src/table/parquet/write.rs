//! Tables to Parquet, columns side by side, straight from their memory.

use super::numbers::{LEVEL, Pages};
use super::{FORMAT, seal};
use crate::clock::Busy;
use crate::model::Status;
use crate::table::{Column, Table, TableError, Values, arrow_schema};
use bytemuck::cast_slice;
use bytes::Bytes;
use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::writer::{ColumnCloseResult, ColumnWriterImpl, get_column_writer, get_typed_column_writer};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedPageWriter, TrackedWrite};
use parquet::schema::types::{ColumnDescPtr, ColumnPath, Type, TypePtr};
use rayon::prelude::*;
use std::sync::Arc;

/// Words that are made at a time.
const WORDS: usize = 4096;

/// The file of a table, with pairs of keys and values in its footer.
///
/// # Errors
///
/// A table that Parquet cannot hold.
pub fn encode(table: &Table, metadata: &[(&str, String)]) -> Result<Vec<u8>, TableError> {
    let mut encoder = Encoder::default();
    let pairs = metadata.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    encoder.encode(table, |_| pairs)?;
    Ok(encoder.bytes)
}

/// Makes one file after another in the same memory.
#[derive(Debug, Default)]
pub struct Encoder {
    /// The last file.
    pub bytes: Vec<u8>,
    /// Its columns.
    columns: Vec<Vec<u8>>,
}

impl Encoder {
    /// Makes `bytes` the file of a table.
    ///
    /// `metadata` gives the pairs of the footer. It is shown everything before the footer, to take a checksum of. The
    /// footer gets a checksum of its own.
    ///
    /// # Errors
    ///
    /// As [`encode`].
    pub fn encode(
        &mut self,
        table: &Table,
        metadata: impl FnOnce(&[u8]) -> Vec<(String, String)>,
    ) -> Result<(), TableError> {
        self.try_encode(table, metadata)
            .map_err(|error| TableError::Unwritable { format: FORMAT, reason: error.to_string() })
    }

    fn try_encode(
        &mut self,
        table: &Table,
        metadata: impl FnOnce(&[u8]) -> Vec<(String, String)>,
    ) -> Result<(), ParquetError> {
        let Encoder { bytes, columns } = self;
        bytes.clear();
        columns.resize_with(table.columns.len(), Vec::new);
        let properties = Arc::new(properties(table)?);
        let mut writer = SerializedFileWriter::new(bytes, schema(table)?, properties.clone())?;
        let described = writer.schema_descr().columns().to_vec();
        let busy = Busy::here();
        let chunks = table.columns.par_iter().zip(&described).zip(columns.par_iter_mut()).map_init(
            Pages::new,
            |pages, ((column, description), to)| {
                let _busy = busy.enter();
                let pages = pages.as_mut().map_err(|error| ParquetError::General(error.to_string()))?;
                write_column(&column.values, pages, (description, &properties), to)
            },
        );
        let chunks: Vec<ColumnCloseResult> = chunks.collect::<Result<_, ParquetError>>()?;
        let mut group = writer.next_row_group()?;
        for (column, description) in columns.iter_mut().zip(chunks) {
            let encoded = Bytes::from(std::mem::take(column));
            group.append_column(&encoded, description)?;
            *column = encoded.into();
        }
        group.close()?;
        writer.flush()?;
        for (key, value) in metadata(writer.inner()) {
            writer.append_key_value_metadata(KeyValue::new(key, value));
        }
        writer.append_key_value_metadata(KeyValue::new(seal::KEY.into(), seal::UNSEALED.to_owned()));
        let data = writer.inner().len();
        seal::seal(&mut writer.into_inner()?[data..]);
        Ok(())
    }
}

fn properties(table: &Table) -> Result<WriterProperties, ParquetError> {
    let schema = KeyValue::new(arrow_schema::KEY.to_owned(), arrow_schema::encode(&table.columns));
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(LEVEL)?))
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_created_by(concat!("rodsweep ", env!("CARGO_PKG_VERSION")).into())
        .set_key_value_metadata(Some(vec![schema]));
    for column in table.columns.iter().filter(|column| matches!(column.values, Values::Index(_))) {
        let path = ColumnPath::new(vec![column.name.clone()]);
        properties = properties.set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
    }
    Ok(properties.build())
}

fn schema(table: &Table) -> Result<TypePtr, ParquetError> {
    let fields = table.columns.iter().map(field).collect::<Result<_, _>>()?;
    // The name that Arrow gives it.
    Ok(Arc::new(Type::group_type_builder("arrow_schema").with_fields(fields).build()?))
}

fn field(column: &Column) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match column.values {
        Values::Index(_) => (Physical::INT64, Some(LogicalType::integer(64, false))),
        Values::Double(_) => (Physical::DOUBLE, None),
        Values::Single(_) => (Physical::FLOAT, None),
        Values::Status(_) | Values::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Values::Flag(_) => (Physical::BOOLEAN, None),
    };
    let repetition = if column.values.is_nullable() { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    let field = Type::primitive_type_builder(&column.name, physical).with_logical_type(logical);
    Ok(Arc::new(field.with_repetition(repetition).build()?))
}

/// Makes `to` a column as it stands in a file; returns what the footer says of it.
fn write_column(
    values: &Values,
    pages: &mut Pages,
    (description, properties): (&ColumnDescPtr, &Arc<WriterProperties>),
    to: &mut Vec<u8>,
) -> Result<ColumnCloseResult, ParquetError> {
    to.clear();
    let mut encoder = ColumnEncoder { description, properties, to };
    match values {
        Values::Double(values) => pages.write(values, description, encoder.to),
        Values::Single(values) => pages.write(values, description, encoder.to),
        // The same bits; the logical type says that they are unsigned.
        Values::Index(values) => encoder.write::<Int64Type>(|to| to.write_batch(cast_slice(values), None, None)),
        Values::Flag(values) => {
            let known: Vec<bool> = values.iter().flatten().copied().collect();
            let levels: Vec<i16> = values.iter().map(|flag| i16::from(flag.is_some())).collect();
            encoder.write::<BoolType>(|to| to.write_batch(&known, Some(&levels), None))
        }
        Values::Status(values) => {
            let words = Status::ALL.map(|status| ByteArray::from(status.name()));
            encoder.write_words(values, |status| words[usize::from(status.code())].clone())
        }
        Values::Text(values) => encoder.write_words(values, |word| ByteArray::from(word.as_str())),
    }
}

/// Parquet's own encoder for one column.
struct ColumnEncoder<'a> {
    description: &'a ColumnDescPtr,
    properties: &'a Arc<WriterProperties>,
    to: &'a mut Vec<u8>,
}

impl ColumnEncoder<'_> {
    fn write<T: DataType>(
        &mut self,
        write: impl FnOnce(&mut ColumnWriterImpl<T>) -> Result<usize, ParquetError>,
    ) -> Result<ColumnCloseResult, ParquetError> {
        let mut sink = TrackedWrite::new(&mut *self.to);
        let pages = Box::new(SerializedPageWriter::new(&mut sink));
        let encoder = get_column_writer(self.description.clone(), self.properties.clone(), pages);
        let mut encoder = get_typed_column_writer::<T>(encoder);
        write(&mut encoder)?;
        let closed = encoder.close()?;
        sink.into_inner()?;
        Ok(closed)
    }

    fn write_words<T>(
        &mut self,
        values: &[T],
        word: impl Fn(&T) -> ByteArray,
    ) -> Result<ColumnCloseResult, ParquetError> {
        self.write::<ByteArrayType>(|to| {
            let mut words = Vec::with_capacity(values.len().min(WORDS));
            for block in values.chunks(WORDS) {
                words.clear();
                words.extend(block.iter().map(&word));
                to.write_batch(&words, None, None)?;
            }
            Ok(values.len())
        })
    }
}
