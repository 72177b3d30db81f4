//! Parquet files as other programs write them: every kind of number is read, everything else is called what it is.

use crate::common::root;
use parquet::basic::Compression;
use parquet::data_type::{
    BoolType, ByteArrayType, DataType, DoubleType, FixedLenByteArrayType, FloatType, Int32Type, Int64Type,
};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use rodsweep::input::{read_input_table, read_scene};
use rodsweep::table;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of one column, in two row groups; a row is missing where its level is 0.
fn file<T: DataType>(dir: &Path, kind: &str, values: &[T::T], levels: Option<&[i16]>) -> PathBuf {
    compressed::<T>(dir, kind, values, levels, Compression::SNAPPY)
}

fn compressed<T: DataType>(
    dir: &Path,
    kind: &str,
    values: &[T::T],
    levels: Option<&[i16]>,
    codec: Compression,
) -> PathBuf {
    let needed = if levels.is_some() { "optional" } else { "required" };
    let (physical, logical) = kind.split_once(' ').unwrap_or((kind, ""));
    let schema = parse_message_type(&format!("message m {{ {needed} {physical} coil.current.x {logical}; }}")).unwrap();
    let properties = Arc::new(WriterProperties::builder().set_compression(codec).build());
    let path = dir.join("t.parquet");
    let mut writer =
        SerializedFileWriter::new(std::fs::File::create(&path).unwrap(), Arc::new(schema), properties).unwrap();
    for _ in 0..2 {
        let mut group = writer.next_row_group().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<T>().write_batch(values, levels, None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
    }
    writer.close().unwrap();
    path
}

/// Bits of the rows of the first group; the second must hold the same.
fn numbers(path: &Path) -> Vec<u64> {
    let table = table::parquet::read(path, &[]).unwrap();
    let numbers = table.columns[0].values.numbers();
    let bits: Vec<u64> = numbers.iter().map(|x| if x.is_nan() { 0 } else { x.to_bits() }).collect();
    assert_eq!(bits[..bits.len() / 2], bits[bits.len() / 2..]);
    bits[..bits.len() / 2].to_vec()
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|x| if x.is_nan() { 0 } else { x.to_bits() }).collect()
}

#[test]
fn every_kind_of_number_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    for width in [8, 16, 32] {
        let signed = format!("int32 (INTEGER({width},true))");
        assert_eq!(numbers(&file::<Int32Type>(dir, &signed, &[1, -2, 100], None)), bits(&[1.0, -2.0, 100.0]));
        let unsigned = format!("int32 (INTEGER({width},false))");
        assert_eq!(numbers(&file::<Int32Type>(dir, &unsigned, &[1, 2, 200], None)), bits(&[1.0, 2.0, 200.0]));
    }
    let largest = "int32 (INTEGER(32,false))";
    assert_eq!(numbers(&file::<Int32Type>(dir, largest, &[-1], None)), bits(&[4294967295.0]));
    assert_eq!(numbers(&file::<Int32Type>(dir, "int32 (UINT_32)", &[-1], None)), bits(&[4294967295.0]));
    assert_eq!(numbers(&file::<Int32Type>(dir, "int32", &[-1], None)), bits(&[-1.0]));
    assert_eq!(numbers(&file::<Int64Type>(dir, "int64", &[-1, i64::MAX], None)), bits(&[-1.0, i64::MAX as f64]));
    assert_eq!(numbers(&file::<FloatType>(dir, "float", &[0.5, f32::MAX], None)), bits(&[0.5, f32::MAX.into()]));
    assert_eq!(numbers(&file::<DoubleType>(dir, "double", &[0.1, 5e-324], None)), bits(&[0.1, 5e-324]));
    let halves = [0x3c00_u16, 0xc000, 0x0001, 0x7bff, 0x7c00].map(|x| x.to_le_bytes().to_vec().into());
    let half = file::<FixedLenByteArrayType>(dir, "fixed_len_byte_array(2) (FLOAT16)", &halves, None);
    assert_eq!(numbers(&half), bits(&[1.0, -2.0, 2f64.powi(-24), 65504.0, f64::INFINITY]));
    let unsigned = file::<Int64Type>(dir, "int64 (INTEGER(64,false))", &[-1, 1 << 53 | 1], None);
    let table = table::parquet::read(&unsigned, &[]).unwrap();
    assert_eq!(table.columns[0].values, vec![u64::MAX, 1 << 53 | 1, u64::MAX, 1 << 53 | 1].into());
}

#[test]
fn what_is_missing_is_nan() {
    let dir = tempfile::tempdir().unwrap();
    let (dir, levels) = (dir.path(), Some(&[1_i16, 0, 1, 0][..]));
    let expected = bits(&[3.0, f64::NAN, 4.0, f64::NAN]);
    assert_eq!(numbers(&file::<DoubleType>(dir, "double", &[3.0, 4.0], levels)), expected);
    assert_eq!(numbers(&file::<FloatType>(dir, "float", &[3.0, 4.0], levels)), expected);
    assert_eq!(numbers(&file::<Int32Type>(dir, "int32", &[3, 4], levels)), expected);
    assert_eq!(numbers(&file::<Int64Type>(dir, "int64", &[3, 4], levels)), expected);
    assert_eq!(numbers(&file::<Int64Type>(dir, "int64 (INTEGER(64,false))", &[3, 4], levels)), expected);
}

#[test]
fn every_codec_but_brotli_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let codecs = ["UNCOMPRESSED", "SNAPPY", "GZIP(6)", "LZ4", "LZ4_RAW", "ZSTD(3)"].map(|codec| codec.parse().unwrap());
    let values: Vec<f64> = (0..5000).map(f64::from).collect();
    for codec in codecs {
        assert_eq!(numbers(&compressed::<DoubleType>(dir.path(), "double", &values, None, codec)), bits(&values));
    }
}

#[test]
fn a_column_without_numbers_is_called_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let scene = read_scene(&root().join("sweeps/scenes/p6.toml")).unwrap();
    let refused = |path: PathBuf| {
        let message = read_input_table(&path, &scene).unwrap_err().to_string();
        message.strip_prefix(&format!("{}: ", path.display())).expect("the path").to_owned()
    };
    let of = |what: &str| format!("`coil.current.x`: is {what}; give numbers");
    let word = [b"a".to_vec().into()];
    assert_eq!(refused(file::<ByteArrayType>(dir, "byte_array (UTF8)", &word, None)), of("text"));
    assert_eq!(refused(file::<ByteArrayType>(dir, "byte_array", &word, None)), of("bytes"));
    assert_eq!(refused(file::<BoolType>(dir, "boolean", &[true], None)), of("true or false"));
    assert_eq!(refused(file::<Int32Type>(dir, "int32 (DATE)", &[1], None)), of("a date or time"));
    assert_eq!(refused(file::<Int64Type>(dir, "int64 (TIMESTAMP(MICROS,true))", &[1], None)), of("a date or time"));
    assert_eq!(refused(file::<Int32Type>(dir, "int32 (DECIMAL(9,2))", &[1], None)), of("decimal"));
    let cut = file::<DoubleType>(dir, "double", &[0.1], None);
    std::fs::write(&cut, &std::fs::read(&cut).unwrap()[..50]).unwrap();
    let message = refused(cut);
    assert!(message.starts_with("is no whole Parquet file: ") && !message.contains("--resume"), "{message}");
    let whole = file::<DoubleType>(dir, "double", &[0.1], None);
    assert_eq!(read_input_table(&whole, &scene).unwrap().row_count(), 2);
}

#[test]
fn a_small_file_of_too_many_numbers_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = file::<DoubleType>(dir.path(), "double", &[0.1; 3], None);
    assert_eq!(table::parquet::read_numbers(&path, 6).unwrap().row_count(), 6);
    let message = table::parquet::read_numbers(&path, 5).unwrap_err().to_string();
    assert!(message.contains("6 rows of 1 columns") && message.contains("split it"), "{message}");
}
