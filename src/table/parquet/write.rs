//! Tables to Parquet, columns side by side, straight from their memory.

use super::{FORMAT, seal};
use crate::clock::Busy;
use crate::model::Status;
use crate::table::{Column, Table, TableError, Values, arrow_schema};
use bytemuck::cast_slice;
use bytes::Bytes;
use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::writer::{ColumnCloseResult, get_column_writer};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter, SerializedPageWriter, TrackedWrite};
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
        let ones = vec![1; table.row_count()];
        let busy = Busy::here();
        let chunks = table.columns.par_iter().zip(&described).zip(columns.par_iter_mut()).map_init(
            || Memory::new(&ones),
            |memory, ((column, description), to)| {
                let _busy = busy.enter();
                memory.chunk(column, description, &properties, to)
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
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_created_by(concat!("rodsweep ", env!("CARGO_PKG_VERSION")).into())
        .set_key_value_metadata(Some(vec![schema]));
    for column in &table.columns {
        let encoding = match column.values {
            Values::Double(_) | Values::Single(_) => Encoding::BYTE_STREAM_SPLIT,
            Values::Index(_) => Encoding::DELTA_BINARY_PACKED,
            Values::Status(_) | Values::Flag(_) | Values::Text(_) => continue,
        };
        properties = properties.set_column_encoding(ColumnPath::new(vec![column.name.clone()]), encoding);
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

/// Memory that the columns of a thread use.
struct Memory<'a> {
    /// A one for each row: all of them are known.
    ones: &'a [i16],
    /// One for each row that is known, zero for the others.
    levels: Vec<i16>,
    doubles: Vec<f64>,
    singles: Vec<f32>,
}

impl<'a> Memory<'a> {
    fn new(ones: &'a [i16]) -> Self {
        Self { ones, levels: Vec::new(), doubles: Vec::new(), singles: Vec::new() }
    }

    /// Makes `to` a column as it stands in a file; returns what the footer says of it.
    fn chunk(
        &mut self,
        column: &Column,
        description: &ColumnDescPtr,
        properties: &Arc<WriterProperties>,
        to: &mut Vec<u8>,
    ) -> Result<ColumnCloseResult, ParquetError> {
        to.clear();
        let mut sink = TrackedWrite::new(to);
        let mut closed = None;
        let pages = Box::new(SerializedPageWriter::new(&mut sink));
        let encoder = get_column_writer(description.clone(), properties.clone(), pages);
        let on_close = Box::new(|result| {
            closed = Some(result);
            Ok(())
        });
        let mut encoder = SerializedColumnWriter::new(encoder, Some(on_close));
        self.write(&column.values, &mut encoder)?;
        encoder.close()?;
        sink.into_inner()?;
        closed.ok_or_else(|| ParquetError::General("a column was not closed".into()))
    }

    fn write(&mut self, values: &Values, encoder: &mut SerializedColumnWriter) -> Result<(), ParquetError> {
        match values {
            Values::Index(values) => {
                // The same bits; the logical type says that they are unsigned.
                encoder.typed::<Int64Type>().write_batch(cast_slice(values), None, None)?;
            }
            Values::Double(values) => {
                let levels = Levels { ones: self.ones, mixed: &mut self.levels };
                levels.write::<DoubleType>(values, &mut self.doubles, |x| x.is_nan(), encoder)?;
            }
            Values::Single(values) => {
                let levels = Levels { ones: self.ones, mixed: &mut self.levels };
                levels.write::<FloatType>(values, &mut self.singles, |x| x.is_nan(), encoder)?;
            }
            Values::Flag(values) => {
                let known: Vec<bool> = values.iter().flatten().copied().collect();
                self.levels.clear();
                self.levels.extend(values.iter().map(|flag| i16::from(flag.is_some())));
                encoder.typed::<BoolType>().write_batch(&known, Some(&self.levels), None)?;
            }
            Values::Status(values) => {
                let words = Status::ALL.map(|status| ByteArray::from(status.name()));
                write_words(values, |status| words[usize::from(status.code())].clone(), encoder)?;
            }
            Values::Text(values) => write_words(values, |word| ByteArray::from(word.as_str()), encoder)?,
        }
        Ok(())
    }
}

struct Levels<'a> {
    ones: &'a [i16],
    mixed: &'a mut Vec<i16>,
}

impl Levels<'_> {
    /// Writes the numbers that there are, and where they stand. `known` is memory for them.
    fn write<T: DataType<T: Copy>>(
        self,
        values: &[T::T],
        known: &mut Vec<T::T>,
        is_none: impl Fn(&T::T) -> bool,
        encoder: &mut SerializedColumnWriter,
    ) -> Result<(), ParquetError> {
        let encoder = encoder.typed::<T>();
        if !values.iter().any(&is_none) {
            encoder.write_batch(values, Some(self.ones), None)?;
            return Ok(());
        }
        self.mixed.clear();
        self.mixed.extend(values.iter().map(|value| i16::from(!is_none(value))));
        known.clear();
        known.extend(values.iter().filter(|value| !is_none(value)));
        encoder.write_batch(known, Some(self.mixed), None)?;
        Ok(())
    }
}

fn write_words<T>(
    values: &[T],
    word: impl Fn(&T) -> ByteArray,
    encoder: &mut SerializedColumnWriter,
) -> Result<(), ParquetError> {
    let encoder = encoder.typed::<ByteArrayType>();
    let mut words = Vec::with_capacity(values.len().min(WORDS));
    for block in values.chunks(WORDS) {
        words.clear();
        words.extend(block.iter().map(&word));
        encoder.write_batch(&words, None, None)?;
    }
    Ok(())
}
