//! Tables to Parquet, columns side by side, straight from their memory.

use super::{FORMAT, seal};
use crate::clock::Busy;
use crate::model::Status;
use crate::table::{Column, Table, TableError, Values, arrow_schema};
use bytemuck::cast_slice;
use bytes::Bytes;
use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::writer::{ColumnCloseResult, ColumnWriterImpl, get_column_writer, get_typed_column_writer};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedPageWriter, TrackedWrite};
use parquet::schema::types::{ColumnDescPtr, ColumnPath, Type, TypePtr};
use rayon::prelude::*;
use std::sync::Arc;

/// Words that are made at a time.
const WORDS: usize = 4096;
/// Of zstd: the fastest that takes what there is to take.
const LEVEL: i32 = 1;
/// Rows of a page. zstd takes 128 KiB at a time: so many rows fill two planes of it, and the low bytes of a mantissa, which do not
/// shrink, stand apart from signs and exponents, which do.
const PAGE_ROWS: usize = 1 << 16;

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
        let chunks =
            table.columns.par_iter().zip(&described).zip(columns.par_iter_mut()).map(|((column, description), to)| {
                let _busy = busy.enter();
                write_column(&column.values, (description, &properties), to)
            });
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
        .set_data_page_row_count_limit(PAGE_ROWS)
        .set_write_batch_size(PAGE_ROWS)
        .set_created_by(concat!("rodsweep ", env!("CARGO_PKG_VERSION")).into())
        .set_key_value_metadata(Some(vec![schema]));
    for column in &table.columns {
        let encoding = match column.values {
            Values::Index(_) => Encoding::DELTA_BINARY_PACKED,
            Values::Double(_) | Values::Single(_) => Encoding::BYTE_STREAM_SPLIT,
            Values::Flag(_) | Values::Status(_) | Values::Text(_) => continue,
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

/// Makes `to` a column as it stands in a file; returns what the footer says of it.
fn write_column(
    values: &Values,
    (description, properties): (&ColumnDescPtr, &Arc<WriterProperties>),
    to: &mut Vec<u8>,
) -> Result<ColumnCloseResult, ParquetError> {
    to.clear();
    let mut encoder = ColumnEncoder { description, properties, to };
    match values {
        Values::Double(values) => encoder.write_numbers::<DoubleType>(values, |number| !number.is_nan()),
        Values::Single(values) => encoder.write_numbers::<FloatType>(values, |number| !number.is_nan()),
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

    /// Numbers, of which those that are not known are nulls.
    fn write_numbers<T: DataType>(
        &mut self,
        values: &[T::T],
        is_known: impl Fn(&T::T) -> bool,
    ) -> Result<ColumnCloseResult, ParquetError> {
        self.write::<T>(|to| {
            let mut known = Vec::new();
            let mut levels = Vec::with_capacity(values.len().min(PAGE_ROWS));
            for page in values.chunks(PAGE_ROWS) {
                levels.clear();
                levels.extend(page.iter().map(|number| i16::from(is_known(number))));
                if levels.iter().all(|level| *level == 1) {
                    to.write_batch(page, Some(&levels), None)?;
                    continue;
                }
                known.clear();
                known.extend(page.iter().filter(|number| is_known(number)).cloned());
                to.write_batch(&known, Some(&levels), None)?;
            }
            Ok(values.len())
        })
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

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::file::statistics::Statistics;

    #[test]
    fn footers_tell_extremes_and_gaps() {
        let count = PAGE_ROWS + 1001;
        let column = |name: &str, number: &dyn Fn(usize) -> f64| {
            Column::new(name, "", (0..count).map(number).collect::<Vec<f64>>())
        };
        let whole = column("whole", &|row| row as f64 - 70.0);
        let singles = Column::new("singles", "", whole.values.numbers().iter().map(|x| *x as f32).collect::<Vec<_>>());
        let gap_in_front = column("gap", &|row| if row < PAGE_ROWS + 1 { f64::NAN } else { -(row as f64) });
        let table = Table::new(vec![whole, singles, gap_in_front, column("none", &|_| f64::NAN)]);
        let file = SerializedFileReader::new(Bytes::from(encode(&table, &[]).expect("numbers"))).expect("a file");
        let group = file.metadata().row_group(0);
        let said = |at: usize| match group.column(at).statistics().expect("statistics") {
            Statistics::Double(of) => (of.min_opt().copied(), of.max_opt().copied(), of.null_count_opt()),
            Statistics::Float(of) => {
                (of.min_opt().copied().map(f64::from), of.max_opt().copied().map(f64::from), of.null_count_opt())
            }
            other => panic!("{other:?}"),
        };
        let most = (count - 1) as f64;
        assert_eq!(said(0), (Some(-70.0), Some(most - 70.0), Some(0)));
        assert_eq!(said(1), said(0));
        assert_eq!(said(2), (Some(-most), Some(-(PAGE_ROWS as f64) - 1.0), Some(PAGE_ROWS as u64 + 1)));
        assert_eq!(said(3), (None, None, Some(count as u64)));
    }
}
