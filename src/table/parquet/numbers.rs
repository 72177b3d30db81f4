//! Columns of numbers as Parquet stores them: levels, bytes split into planes, zstd, and their extremes for the footer.
//!
//! Parquet's own encoder takes eight instructions for a byte, this one less than one.

use bytemuck::{Pod, bytes_of, cast_slice};
use bytes::Bytes;
use parquet::basic::{Compression, Encoding, PageType, ZstdLevel};
use parquet::column::page::{CompressedPage, Page, PageWriter};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::ParquetError;
use parquet::file::metadata::{ColumnChunkMetaData, PageEncodingStats};
use parquet::file::page_index::offset_index::{OffsetIndexMetaData, PageLocation};
use parquet::file::statistics::{Statistics, ValueStatistics};
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::ColumnDescPtr;
use zstd::bulk::Compressor;
use zstd::zstd_safe::compress_bound;

/// Of zstd: the fastest that takes what there is to take.
pub const LEVEL: i32 = 1;
/// Rows of a page, a whole part's. zstd takes 128 KiB at a time: so many rows fill two planes of it, and the low bytes of a
/// mantissa, which do not shrink, stand apart from signs and exponents, which do.
const PAGE_ROWS: usize = 1 << 16;
/// Bytes of numbers that are split at a time.
const BLOCK: usize = 128;
/// Extremes that are looked for side by side.
const LANES: usize = 8;

/// A floating-point number of a column; NaN is none.
pub trait Number: Pod + PartialOrd {
    const LEAST: Self;
    const MOST: Self;
    const ZERO: Self;
    const MINUS_ZERO: Self;
    fn statistics(extremes: Option<(Self, Self)>, none: u64) -> Statistics;
    /// See [`split`].
    fn split(numbers: &[u8], planes: &mut [u8]);
}

macro_rules! number {
    ($of:ty, $statistics:path) => {
        impl Number for $of {
            const LEAST: Self = Self::NEG_INFINITY;
            const MOST: Self = Self::INFINITY;
            const ZERO: Self = 0.0;
            const MINUS_ZERO: Self = -0.0;

            fn statistics(extremes: Option<(Self, Self)>, none: u64) -> Statistics {
                let (least, most) = extremes.unzip();
                let of = ValueStatistics::new(least, most, None, Some(none), false);
                $statistics(of.with_nan_count(extremes.map(|_| 0)).with_backwards_compatible_min_max(true))
            }

            fn split(numbers: &[u8], planes: &mut [u8]) {
                split::<{ size_of::<$of>() }>(numbers, planes);
            }
        }
    };
}

number!(f64, Statistics::Double);
number!(f32, Statistics::Float);

/// Makes one column of numbers after another in the same memory.
pub struct Pages {
    compressor: Compressor<'static>,
    /// Bytes of the numbers that there are, of a page where some are none.
    known: Vec<u8>,
    page: Vec<u8>,
    compressed: Vec<u8>,
}

impl Pages {
    /// # Errors
    ///
    /// No memory for zstd.
    pub fn new() -> Result<Self, ParquetError> {
        let (known, page, compressed) = Default::default();
        Ok(Self { compressor: Compressor::new(LEVEL)?, known, page, compressed })
    }

    /// Makes `to` a column of optional numbers as it stands in a file; returns what the footer says of it.
    pub fn write<N: Number>(
        &mut self,
        values: &[N],
        description: &ColumnDescPtr,
        to: &mut Vec<u8>,
    ) -> Result<ColumnCloseResult, ParquetError> {
        let mut sink = TrackedWrite::new(to);
        let mut writer = SerializedPageWriter::new(&mut sink);
        let (mut bytes, mut compressed_bytes, mut none) = (0, 0, 0);
        let mut extremes: Option<(N, N)> = None;
        let mut locations = Vec::new();
        for (page, rows) in values.chunks(PAGE_ROWS).enumerate() {
            let (of_page, has_none) = extremes_of(rows);
            let length = if has_none { self.fill_with_gaps(rows, &mut none) } else { self.fill(rows) };
            extremes = match (extremes, of_page) {
                (Some(a), Some(b)) => Some((lesser(a.0, b.0), larger(a.1, b.1))),
                (a, b) => a.or(b),
            };
            self.compressed.clear();
            self.compressed.reserve(compress_bound(length));
            self.compressor.compress_to_buffer(&self.page[..length], &mut self.compressed)?;
            let buffer = Bytes::from(std::mem::take(&mut self.compressed));
            let written = writer.write_page(CompressedPage::new(data_page(buffer.clone(), rows.len()), length))?;
            self.compressed = buffer.into();
            locations.push(PageLocation {
                offset: written.offset as i64,
                compressed_page_size: written.compressed_size as i32,
                first_row_index: (page * PAGE_ROWS) as i64,
            });
            bytes += written.uncompressed_size;
            compressed_bytes += written.compressed_size;
        }
        writer.close()?;
        sink.into_inner()?;
        let of_pages = |count| PageEncodingStats {
            page_type: PageType::DATA_PAGE,
            encoding: Encoding::BYTE_STREAM_SPLIT,
            count: count as i32,
        };
        let pages = Some(locations.len()).filter(|count| *count > 0).map(of_pages);
        let metadata = ColumnChunkMetaData::builder(description.clone())
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(LEVEL)?))
            .set_encodings(vec![Encoding::RLE, Encoding::BYTE_STREAM_SPLIT])
            .set_page_encoding_stats(Vec::from_iter(pages))
            .set_total_compressed_size(compressed_bytes as i64)
            .set_total_uncompressed_size(bytes as i64)
            .set_num_values(values.len() as i64)
            .set_data_page_offset(0)
            .set_statistics(N::statistics(extremes, none))
            .build()?;
        Ok(ColumnCloseResult {
            bytes_written: compressed_bytes as u64,
            rows_written: values.len() as u64,
            metadata,
            bloom_filter: None,
            column_index: None,
            offset_index: Some(OffsetIndexMetaData {
                page_locations: locations,
                unencoded_byte_array_data_bytes: None,
            }),
        })
    }

    /// Fills the page with rows that are all known; returns its length.
    fn fill<N: Number>(&mut self, rows: &[N]) -> usize {
        // One run of ones.
        let mut levels = varint(rows.len() << 1);
        levels.push(1);
        put::<N>(&mut self.page, &levels, cast_slice(rows))
    }

    /// The same where some are none; counts them.
    fn fill_with_gaps<N: Number>(&mut self, rows: &[N], none: &mut u64) -> usize {
        // A bit for each row, eight together.
        let mut levels = varint((rows.len().div_ceil(8) << 1) | 1);
        let bit = |(at, row): (usize, &N)| u8::from(is_known(row)) << at;
        levels.extend(rows.chunks(8).map(|rows| rows.iter().enumerate().map(bit).sum::<u8>()));
        self.known.clear();
        rows.iter().filter(|row| is_known(*row)).for_each(|row| self.known.extend(bytes_of(row)));
        *none += (rows.len() - self.known.len() / size_of::<N>()) as u64;
        put::<N>(&mut self.page, &levels, &self.known)
    }
}

fn is_known<N: Number>(number: &N) -> bool {
    number.partial_cmp(number).is_some()
}

/// Seven bits a byte, the lowest first.
fn varint(mut number: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// Puts levels and numbers into a page, whatever stood there; returns its length.
fn put<N: Number>(page: &mut Vec<u8>, levels: &[u8], numbers: &[u8]) -> usize {
    let head = size_of::<u32>() + levels.len();
    let length = head + numbers.len();
    if page.len() < length {
        page.resize(length, 0);
    }
    page[..size_of::<u32>()].copy_from_slice(&(levels.len() as u32).to_le_bytes());
    page[size_of::<u32>()..head].copy_from_slice(levels);
    N::split(numbers, &mut page[head..length]);
    length
}

/// Puts the first byte of every number in front, then every second one, and so on.
fn split<const BYTES: usize>(numbers: &[u8], planes: &mut [u8]) {
    let count = numbers.len() / BYTES;
    let together = BLOCK / BYTES;
    let (blocks, rest) = numbers.as_chunks::<BLOCK>();
    for (at, block) in blocks.iter().enumerate() {
        // Each time the lowest bit of a byte's place becomes the highest: in the end its place within a number.
        let split = (0..BYTES.ilog2()).fold(*block, |bytes, _| unzip(&bytes));
        for (plane, bytes) in split.chunks_exact(together).enumerate() {
            planes[plane * count + at * together..][..together].copy_from_slice(bytes);
        }
    }
    for (at, number) in (blocks.len() * together..).zip(rest.chunks_exact(BYTES)) {
        number.iter().enumerate().for_each(|(plane, byte)| planes[plane * count + at] = *byte);
    }
}

/// Bytes at even places, then those at odd ones.
#[inline(always)]
fn unzip(bytes: &[u8; BLOCK]) -> [u8; BLOCK] {
    let mut unzipped = [0; BLOCK];
    let (even, odd) = unzipped.split_at_mut(BLOCK / 2);
    for (k, pair) in bytes.as_chunks::<2>().0.iter().enumerate() {
        // As one number, which compilers turn into instructions for many at a time.
        let pair = u16::from_le_bytes(*pair);
        (even[k], odd[k]) = (pair as u8, (pair >> 8) as u8);
    }
    unzipped
}

/// The least and the largest that is known, and whether any is none. A zero is the lesser or the larger of both zeros, as
/// the format asks.
fn extremes_of<N: Number>(rows: &[N]) -> (Option<(N, N)>, bool) {
    let Some(first) = rows.first() else { return (None, false) };
    let (mut least, mut most, mut none) = ([N::MOST; LANES], [N::LEAST; LANES], [N::ZERO; LANES]);
    let mut see = |rows: &[N; LANES]| {
        for k in 0..LANES {
            least[k] = lesser(rows[k], least[k]);
            most[k] = larger(rows[k], most[k]);
            none[k] = if is_known(&rows[k]) { none[k] } else { rows[k] };
        }
    };
    let (together, rest) = rows.as_chunks::<LANES>();
    together.iter().for_each(&mut see);
    let mut last = [*first; LANES];
    last[..rest.len()].copy_from_slice(rest);
    see(&last);
    let has_none = none.iter().any(|row| !is_known(row));
    if has_none && !rows.iter().any(is_known) {
        return (None, true);
    }
    let (least, most) = (least.into_iter().fold(N::MOST, lesser), most.into_iter().fold(N::LEAST, larger));
    let least = if least == N::ZERO { N::MINUS_ZERO } else { least };
    (Some((least, if most == N::ZERO { N::ZERO } else { most })), has_none)
}

/// `b` where `a` is none.
#[inline(always)]
fn lesser<N: Number>(a: N, b: N) -> N {
    if a < b { a } else { b }
}

/// The same of the larger one.
#[inline(always)]
fn larger<N: Number>(a: N, b: N) -> N {
    if a > b { a } else { b }
}

fn data_page(buf: Bytes, rows: usize) -> Page {
    Page::DataPage {
        buf,
        num_values: rows as u32,
        encoding: Encoding::BYTE_STREAM_SPLIT,
        def_level_encoding: Encoding::RLE,
        rep_level_encoding: Encoding::RLE,
        statistics: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::parquet::encode;
    use crate::table::{Column, Table};
    use parquet::file::reader::{FileReader, SerializedFileReader};

    #[test]
    fn planes_hold_the_bytes_of_all_numbers() {
        for count in [0, 1, 15, 16, 17, 47, 300] {
            let doubles: Vec<f64> = (0..count).map(|k| 1.0 / f64::from(k)).collect();
            let singles: Vec<f32> = (0..count).map(|k| (k as f32).exp()).collect();
            let mut planes = vec![0; 8 * doubles.len()];
            split::<8>(cast_slice(&doubles), &mut planes);
            for (at, number) in doubles.iter().enumerate() {
                let of = |plane: usize| planes[plane * doubles.len() + at];
                assert_eq!(std::array::from_fn::<u8, 8, _>(of), number.to_ne_bytes(), "{at} of {count}");
            }
            split::<4>(cast_slice(&singles), &mut planes[..4 * singles.len()]);
            for (at, number) in singles.iter().enumerate() {
                let of = |plane: usize| planes[plane * singles.len() + at];
                assert_eq!(std::array::from_fn::<u8, 4, _>(of), number.to_ne_bytes(), "{at} of {count}");
            }
        }
    }

    #[test]
    fn extremes_are_those_of_what_is_known() {
        let (nan, infinite) = (f64::NAN, f64::INFINITY);
        assert_eq!(extremes_of::<f64>(&[]), (None, false));
        assert_eq!(extremes_of(&[nan; 20]), (None, true));
        assert_eq!(extremes_of(&[3.0_f32]), (Some((3.0, 3.0)), false));
        assert_eq!(extremes_of(&[infinite; 9]), (Some((infinite, infinite)), false));
        assert_eq!(extremes_of(&[-infinite, nan]), (Some((-infinite, -infinite)), true));
        // Wherever they stand, in whatever company.
        for count in 2..40 {
            for at in 0..count {
                let mut rows: Vec<f64> = (0..count).map(|k| 0.1 * f64::from(k - 7)).collect();
                let (least, most) = (rows[0], rows[rows.len() - 1]);
                assert_eq!(extremes_of(&rows), (Some((least, most)), false));
                rows[at as usize] = -9.0;
                assert_eq!(extremes_of(&rows).0.map(|of| of.0), Some(-9.0));
                rows[at as usize] = 9.0;
                assert_eq!(extremes_of(&rows).0.map(|of| of.1), Some(9.0));
                rows[at as usize] = nan;
                assert!(extremes_of(&rows).1);
            }
        }
        let zeros = extremes_of(&[0.0, -0.0, 0.0]).0.map(|(least, most)| [least, most].map(f64::is_sign_negative));
        assert_eq!(zeros, Some([true, false]));
    }

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
