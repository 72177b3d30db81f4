//! Tables from Parquet, our own and those of other programs.

use super::FORMAT;
use super::ranges::{ByteSource, LocalFile, Ranges};
use super::thrift;
use crate::model::Status;
use crate::table::error::damaged;
use crate::table::{Column, Table, TableError, Values, arrow_schema};
use bytes::Bytes;
use parquet::basic::{Compression, ConvertedType, LogicalType, Type as Physical};
use parquet::column::reader::{ColumnReaderImpl, get_column_reader, get_typed_column_reader};
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FixedLenByteArrayType, FloatType, Int32Type, Int64Type,
};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ColumnChunkMetaData, FileMetaData, FooterTail, ParquetMetaData, ParquetMetaDataReader};
use parquet::file::serialized_reader::SerializedPageReader;
use parquet::schema::types::ColumnDescriptor;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// Rows for which memory is taken on a file's word alone.
const TRUSTED_ROWS: usize = 1 << 20;
/// Rows of a column that are asked for at once.
const AT_A_TIME: usize = 1 << 20;
/// Of an eight-byte end: the length of the footer and `PAR1`.
const TAIL: usize = 8;

/// What a file says about itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Footer {
    /// Rows of each column.
    pub row_count: u64,
    /// Keys and values in the order of the file.
    pub metadata: Vec<(String, String)>,
}

impl Footer {
    /// The first value of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.metadata.iter().find(|(other, _)| other == key).map(|(_, value)| value.as_str())
    }

    fn of(metadata: &FileMetaData) -> Footer {
        let pairs = metadata.key_value_metadata().into_iter().flatten();
        Footer {
            row_count: metadata.num_rows().try_into().unwrap_or(0),
            metadata: pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect(),
        }
    }
}

/// The footer of a file that is in memory.
///
/// # Errors
///
/// Bytes that are no whole Parquet file.
pub fn footer(bytes: &[u8]) -> Result<Footer, TableError> {
    let end = |length| bytes.len().checked_sub(length).map(|start| Bytes::copy_from_slice(&bytes[start..]));
    metadata(|length| end(length).ok_or_else(|| ParquetError::EOF("it ends before".into())))
        .map(|metadata| Footer::of(metadata.file_metadata()))
        .map_err(|error| damaged(FORMAT, error))
}

/// What the end of a file says, of which bytes are asked for by their number.
fn metadata(end: impl Fn(usize) -> Result<Bytes, ParquetError>) -> Result<ParquetMetaData, ParquetError> {
    let general = |reason: String| ParquetError::General(reason);
    let tail = end(TAIL)?;
    let tail = FooterTail::try_new(tail.first_chunk().ok_or_else(|| general("it is too short".into()))?)?;
    if tail.is_encrypted_footer() {
        return Err(general("its footer is encrypted".into()));
    }
    let bytes = end(tail.metadata_length() + TAIL)?;
    let bytes = &bytes[..tail.metadata_length()];
    thrift::check_footer(bytes).map_err(|reason| general(format!("in its footer, {reason}")))?;
    ParquetMetaDataReader::decode_metadata(bytes)
}

/// Bytes of the footer and of what follows it, by the end of a file; `None`: it is no end of such a file.
pub fn footer_length(end: &[u8]) -> Option<u64> {
    let tail = FooterTail::try_new(end.last_chunk::<TAIL>()?).ok()?;
    Some((tail.metadata_length() + TAIL) as u64)
}

/// The named columns of a file, in its order; all of them if no name is given.
///
/// Signed integers become [`Values::Double`], and so do unsigned ones where some are missing. Text is
/// [`Values::Status`] in a column `status` that holds no other words.
///
/// # Errors
///
/// A file that cannot be read or is damaged, or a column of a kind that tables do not hold.
pub fn read(path: &Path, names: &[&str]) -> Result<Table, TableError> {
    read_from(Arc::new(LocalFile::open(path)?), names)
}

/// The same of a file that may be far away: only the footer and the named columns are fetched.
///
/// # Errors
///
/// As [`read`].
pub fn read_from(source: Arc<dyn ByteSource>, names: &[&str]) -> Result<Table, TableError> {
    let is_wanted = |name: &str| names.is_empty() || names.contains(&name);
    read_wanted(source, &is_wanted, &|_| Ok(()), &Ok)
}

/// Every column of a file of numbers. A small file may stand for very many of them: at most so many are read.
///
/// # Errors
///
/// As [`read`], a column of anything but numbers, or more numbers.
pub fn read_numbers(path: &Path, most: u64) -> Result<Table, TableError> {
    let of_numbers = |kind| match kind {
        Kind::Text => Err("text"),
        Kind::Flag => Err("true or false"),
        kind => Ok(kind),
    };
    let is_moderate = |metadata: &FileMetaData| {
        let (rows, columns) = (Footer::of(metadata).row_count, metadata.schema_descr().num_columns() as u64);
        if rows.saturating_mul(columns) > most { Err(TableError::TooLarge { rows, columns, most }) } else { Ok(()) }
    };
    read_wanted(Arc::new(LocalFile::open(path)?), &|_| true, &is_moderate, &of_numbers)
}

/// Columns by name, of kinds that are allowed, of a file that is.
fn read_wanted(
    source: Arc<dyn ByteSource>,
    is_wanted: &dyn Fn(&str) -> bool,
    check: &dyn Fn(&FileMetaData) -> Result<(), TableError>,
    allowed: &dyn Fn(Kind) -> Result<Kind, &'static str>,
) -> Result<Table, TableError> {
    let ranges = Ranges::new(source);
    let table = read_ranges(&ranges, is_wanted, check, allowed);
    // What the system refuses is no fault of the file.
    match ranges.failure() {
        Some(error) => Err(error.into()),
        None => table,
    }
}

fn read_ranges(
    ranges: &Ranges,
    is_wanted: &dyn Fn(&str) -> bool,
    check: &dyn Fn(&FileMetaData) -> Result<(), TableError>,
    allowed: &dyn Fn(Kind) -> Result<Kind, &'static str>,
) -> Result<Table, TableError> {
    let metadata = metadata(|length| ranges.end(length)).map_err(|error| damaged(FORMAT, error))?;
    check(metadata.file_metadata())?;
    ranges.fetch(wanted_ranges(&metadata, is_wanted));
    let footer = Footer::of(metadata.file_metadata());
    let units = footer.get(arrow_schema::KEY).map(arrow_schema::units).unwrap_or_default();
    let mut table = Table::default();
    for (index, column) in metadata.file_metadata().schema_descr().columns().iter().enumerate() {
        let name = column.path().parts().first().map_or("", String::as_str);
        if !is_wanted(name) {
            continue;
        }
        let kind = Kind::of(column).and_then(allowed);
        let expected = "numbers, flags or text";
        let kind = kind.map_err(|found| TableError::Kind { column: name.into(), found, expected })?;
        let reader = Reader { ranges, metadata: &metadata, column: index, rows: footer.row_count as usize };
        reader.check_codec()?;
        // The crate trusts some lengths within pages, and panics where they are damaged.
        let values = catch_unwind(AssertUnwindSafe(|| reader.values(kind, name)))
            .map_err(|_| damaged(FORMAT, format!("column `{name}` has a damaged page")))?
            .map_err(|error| damaged(FORMAT, error))?;
        if values.len() as u64 != footer.row_count {
            return Err(damaged(FORMAT, format!("column `{name}` has {} of {} rows", values.len(), footer.row_count)));
        }
        table.columns.push(Column::new(name, units.get(name).map_or("", String::as_str), values));
    }
    Ok(table)
}

/// Where the named columns lie.
fn wanted_ranges(metadata: &ParquetMetaData, is_wanted: &dyn Fn(&str) -> bool) -> Vec<Range<u64>> {
    let columns = metadata.row_groups().iter().flat_map(|group| group.columns());
    let is_wanted =
        |column: &&ColumnChunkMetaData| is_wanted(column.column_path().parts().first().map_or("", String::as_str));
    let range = |column: &ColumnChunkMetaData| {
        // A damaged footer may have any number.
        let first = column.dictionary_page_offset().unwrap_or(i64::MAX).min(column.data_page_offset());
        let start = u64::try_from(first).unwrap_or(0);
        start..start.saturating_add(u64::try_from(column.compressed_size()).unwrap_or(0))
    };
    columns.filter(is_wanted).map(range).collect()
}

/// How a column is stored, as far as tables hold it.
#[derive(Clone, Copy)]
enum Kind {
    Unsigned,
    Signed,
    Double,
    Single,
    Half,
    Flag,
    Text,
}

impl Kind {
    /// Else what it is instead.
    fn of(column: &ColumnDescriptor) -> Result<Kind, &'static str> {
        if column.path().parts().len() > 1 || column.max_rep_level() > 0 {
            return Err("nested");
        }
        match column.logical_type_ref() {
            Some(LogicalType::Date | LogicalType::Time(_) | LogicalType::Timestamp(_)) => return Err(TIME),
            Some(LogicalType::Decimal(_)) => return Err(DECIMAL),
            Some(LogicalType::Unknown) => return Err("empty"),
            _ => {}
        }
        match (column.physical_type(), column.logical_type_ref(), column.converted_type()) {
            (Physical::INT96, ..) => Err(TIME),
            (Physical::DOUBLE, ..) => Ok(Kind::Double),
            (Physical::FLOAT, ..) => Ok(Kind::Single),
            (Physical::BOOLEAN, ..) => Ok(Kind::Flag),
            (Physical::FIXED_LEN_BYTE_ARRAY, Some(LogicalType::Float16), _) => Ok(Kind::Half),
            (Physical::INT32 | Physical::INT64, Some(LogicalType::Integer(kind)), _) => {
                Ok(if kind.is_signed { Kind::Signed } else { Kind::Unsigned })
            }
            (Physical::INT32 | Physical::INT64, None, converted) => of_integer(converted),
            (Physical::BYTE_ARRAY, None, ConvertedType::NONE) => Err("bytes"),
            (Physical::BYTE_ARRAY, Some(LogicalType::String | LogicalType::Enum | LogicalType::Json), _)
            | (Physical::BYTE_ARRAY, None, ConvertedType::UTF8 | ConvertedType::ENUM | ConvertedType::JSON) => {
                Ok(Kind::Text)
            }
            _ => Err("of a kind that is not read"),
        }
    }
}

const TIME: &str = "a date or time";
const DECIMAL: &str = "decimal";

/// Integers of files that know converted types only.
fn of_integer(converted: ConvertedType) -> Result<Kind, &'static str> {
    match converted {
        ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64 => {
            Ok(Kind::Unsigned)
        }
        ConvertedType::DECIMAL => Err(DECIMAL),
        ConvertedType::DATE
        | ConvertedType::TIME_MILLIS
        | ConvertedType::TIME_MICROS
        | ConvertedType::TIMESTAMP_MILLIS
        | ConvertedType::TIMESTAMP_MICROS => Err(TIME),
        _ => Ok(Kind::Signed),
    }
}

/// One column of a file.
struct Reader<'a> {
    ranges: &'a Ranges,
    metadata: &'a ParquetMetaData,
    column: usize,
    rows: usize,
}

/// What a column holds: the values that there are, and for each row whether it has one (nothing where all have).
struct Stored<T> {
    known: Vec<T>,
    levels: Vec<i16>,
}

impl Reader<'_> {
    fn check_codec(&self) -> Result<(), TableError> {
        for group in self.metadata.row_groups() {
            let codec = match group.column(self.column).compression() {
                Compression::BROTLI(_) => "brotli",
                Compression::LZO => "lzo",
                _ => continue,
            };
            return Err(TableError::Codec { codec });
        }
        Ok(())
    }

    fn values(&self, kind: Kind, name: &str) -> Result<Values, ParquetError> {
        let descriptor = self.metadata.file_metadata().schema_descr().column(self.column);
        let is_long = descriptor.physical_type() == Physical::INT64;
        Ok(match kind {
            Kind::Unsigned if is_long => self.stored::<Int64Type>()?.map(|x| x as u64).unsigned(),
            Kind::Unsigned => self.stored::<Int32Type>()?.map(|x| u64::from(x as u32)).unsigned(),
            Kind::Signed if is_long => self.stored::<Int64Type>()?.map(|x| x as f64).rows(f64::NAN).into(),
            Kind::Signed => self.stored::<Int32Type>()?.map(f64::from).rows(f64::NAN).into(),
            Kind::Double => self.stored::<DoubleType>()?.rows(f64::NAN).into(),
            Kind::Single => self.stored::<FloatType>()?.rows(f32::NAN).into(),
            Kind::Half => self.stored::<FixedLenByteArrayType>()?.map(|x| half(x.data())).rows(f64::NAN).into(),
            Kind::Flag => self.stored::<BoolType>()?.map(Some).rows(None).into(),
            Kind::Text => words(name, &self.stored::<ByteArrayType>()?.rows(ByteArray::from("")))?,
        })
    }

    /// All row groups one after another.
    fn stored<T: DataType>(&self) -> Result<Stored<T::T>, ParquetError> {
        let (mut known, mut levels) = (Vec::with_capacity(self.rows.min(TRUSTED_ROWS)), Vec::new());
        let mut rows = 0;
        let descriptor = self.metadata.file_metadata().schema_descr().column(self.column);
        for group in self.metadata.row_groups() {
            let (chunk, group_rows) = (group.column(self.column), usize::try_from(group.num_rows())?);
            let pages = SerializedPageReader::new(Arc::new(self.ranges.clone()), chunk, group_rows, None)?;
            let mut reader: ColumnReaderImpl<T> =
                get_typed_column_reader(get_column_reader(descriptor.clone(), Box::new(pages)));
            loop {
                // A page of a few bytes may claim to hold billions of rows.
                let wanted = (self.rows - rows).saturating_add(1).min(AT_A_TIME);
                let read = reader.read_records(wanted, Some(&mut levels), None, &mut known)?.0;
                rows += read;
                if rows > self.rows {
                    return Err(ParquetError::General(format!("a column has more than {} rows", self.rows)));
                }
                if read == 0 {
                    break;
                }
            }
        }
        Ok(Stored { known, levels })
    }
}

impl<T: Clone> Stored<T> {
    fn map<U>(self, of: impl Fn(T) -> U) -> Stored<U> {
        Stored { known: self.known.into_iter().map(of).collect(), levels: self.levels }
    }

    /// One value a row.
    fn rows(self, none: T) -> Vec<T> {
        if self.levels.len() <= self.known.len() {
            return self.known;
        }
        let mut known = self.known.into_iter();
        let row = |level: &i16| if *level > 0 { known.next() } else { None };
        self.levels.iter().map(row).map(|value| value.unwrap_or_else(|| none.clone())).collect()
    }
}

impl Stored<u64> {
    /// Exact where every row has a value.
    fn unsigned(self) -> Values {
        if self.levels.len() <= self.known.len() {
            return self.known.into();
        }
        self.map(|x| x as f64).rows(f64::NAN).into()
    }
}

fn words(name: &str, words: &[ByteArray]) -> Result<Values, ParquetError> {
    if name == "status" {
        let status = |word: &ByteArray| Status::ALL.into_iter().find(|status| status.name().as_bytes() == word.data());
        if let Some(statuses) = words.iter().map(status).collect::<Option<Vec<Status>>>() {
            return Ok(statuses.into());
        }
    }
    let words: Result<Vec<String>, ParquetError> = words.iter().map(|word| word.as_utf8().map(str::to_owned)).collect();
    Ok(words?.into())
}

/// A number of half precision; little-endian.
fn half(bytes: &[u8]) -> f64 {
    let bits = bytes.first_chunk().map_or(0, |bytes| u16::from_le_bytes(*bytes));
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    let magnitude = match exponent {
        0 => fraction * 2f64.powi(-24),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -magnitude } else { magnitude }
}
