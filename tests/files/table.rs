//! One table in three formats: what is written is read again, bit for bit, and strange files are called what they are.

use crate::common::table::table;
use rodsweep::model::Status;
use rodsweep::table::{Column, Table, TableError, Values, csv, npz, parquet};
use std::fs;
use std::path::{Path, PathBuf};

/// Numbers by their bits, any NaN as one, text as it is.
fn cells(table: &Table) -> Vec<String> {
    let column = |column: &Column| {
        let rows = match &column.values {
            Values::Index(values) => format!("{values:?}"),
            Values::Text(words) => format!("{words:?}"),
            values => {
                let bits = |x: f64| if x.is_nan() { 0 } else { x.to_bits() };
                format!("{:?}", values.numbers().into_iter().map(bits).collect::<Vec<_>>())
            }
        };
        format!("{} [{}] {} {rows}", column.name, column.unit, column.values.kind())
    };
    table.columns.iter().map(column).collect()
}

fn written(dir: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn every_format_gives_back_what_it_was_given() {
    let dir = tempfile::tempdir().unwrap();
    for rows in [&[0, 1, 2, 3][..], &[2, 0], &[]] {
        let table = table().select(rows);
        let like = table.empty();
        let file = |name: &str, bytes: &[u8]| written(&dir, name, bytes);
        let read = [
            parquet::read(&file("t.parquet", &parquet::encode(&table, &[]).unwrap()), &[]).unwrap(),
            csv::read(&file("t.csv", &csv::encode(&table)), &[], &like).unwrap(),
            npz::read(&file("t.npz", &npz::encode(&table).unwrap()), &[], &like).unwrap(),
        ];
        for read in &read {
            assert_eq!(cells(read), cells(&table));
        }
    }
}

#[test]
fn many_rows_take_several_pages() {
    let dir = tempfile::tempdir().unwrap();
    let count = 150_000_u64;
    let number = |k: u64| if k.is_multiple_of(7) { f64::NAN } else { (k as f64).sin() };
    let table = Table::new(vec![
        Column::new("sample", "", (0..count).map(|k| k * k).collect::<Vec<u64>>()),
        Column::new("x", "m", (0..count).map(number).collect::<Vec<f64>>()),
        Column::new("y", "m", (0..count).map(|k| number(7 * k + 1) as f32).collect::<Vec<f32>>()),
        Column::new("status", "", vec![Status::Refined; count as usize]),
    ]);
    let path = written(&dir, "t.parquet", &parquet::encode(&table, &[]).unwrap());
    assert_eq!(cells(&parquet::read(&path, &[]).unwrap()), cells(&table));
    let one = parquet::read(&path, &["y", "sample"]).unwrap();
    assert_eq!(one.columns.iter().map(|column| column.name.as_str()).collect::<Vec<_>>(), ["sample", "y"]);
    assert_eq!(one.columns[1], table.columns[2]);
}

#[test]
fn a_footer_carries_metadata_and_sees_what_stands_before_it() {
    let (mut encoder, mut length) = (parquet::Encoder::default(), 0);
    // Nothing of the file before is left.
    encoder.encode(&table().select(&[0, 1, 2, 3, 3, 2, 1, 0]), |_| Vec::new()).unwrap();
    let written = encoder.encode(&table(), |data| {
        length = data.len();
        vec![("rodsweep.seed".into(), "7".into())]
    });
    written.unwrap();
    let bytes = encoder.bytes;
    let footer = parquet::footer(&bytes).unwrap();
    assert_eq!((footer.row_count, footer.get("rodsweep.seed"), footer.get("seed")), (4, Some("7"), None));
    assert!(bytes.starts_with(b"PAR1") && length > 4 && length < bytes.len());
    assert_eq!(parquet::encode(&table(), &[]).unwrap(), parquet::encode(&table(), &[]).unwrap());
}

#[test]
fn text_of_a_table_is_quoted_only_where_it_must_be() {
    let text = String::from_utf8(csv::encode(&table().select(&[0, 2]))).unwrap();
    let expected = "sample,coil.current.x,status,tip.position.x,d(tip.position.x)/d(proximal.stiffness.bending),stable,\
                    from_rest,trajectory\n0,0.1,ok,,0.1,true,true,a lap\n9007199254740993,2.2250738585072014e-308,fold,,\
                    3e38,false,true,\"commas, \"\"quotes\"\"\"\n";
    assert_eq!(text, expected);
    let error = csv::decode("sample\n1\nx\n", &[], &table().empty()).unwrap_err();
    assert_eq!(error.to_string(), "is no whole CSV file: `sample` is `x` in row 2");
}

#[test]
fn a_file_that_is_cut_or_foreign_is_damaged() {
    let dir = tempfile::tempdir().unwrap();
    let whole = parquet::encode(&table(), &[]).unwrap();
    for bytes in [&b""[..], b"PAR1", b"name,age\n", &whole[..whole.len() - 9], &whole[100..]] {
        let path = written(&dir, "t.parquet", bytes);
        assert!(matches!(parquet::read(&path, &[]), Err(TableError::Damaged { .. })), "{} bytes", bytes.len());
        assert!(matches!(npz::read(&path, &[], &table().empty()), Err(TableError::Damaged { .. })));
    }
    assert!(matches!(parquet::read(Path::new("nowhere.parquet"), &[]), Err(TableError::Io(_))));
    let archive = npz::encode(&table()).unwrap();
    let other = Table::new(vec![Column::new("sample", "", vec![0.0])]);
    assert!(matches!(npz::decode(&archive, &[], &other), Err(TableError::Damaged { .. })));
}

#[test]
fn no_flipped_bit_stops_the_reader() {
    let dir = tempfile::tempdir().unwrap();
    let (whole, archive) = (parquet::encode(&table(), &[]).unwrap(), npz::encode(&table()).unwrap());
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        let _ = parquet::footer(&bytes);
        let _ = parquet::read(&written(&dir, "t.parquet", &bytes), &[]);
    }
    for at in 0..archive.len() {
        let mut bytes = archive.clone();
        bytes[at] ^= 1 << (at % 8);
        let _ = npz::decode(&bytes, &[], &table().empty());
    }
}

#[test]
fn rows_are_selected_and_appended() {
    let all = table();
    let mut joined = all.select(&[3, 1]);
    joined.append(&all.select(&[0, 2]));
    assert_eq!(joined.samples(), [u64::MAX, 1, 0, (1 << 53) + 1]);
    assert_eq!(cells(&joined.select(&[2, 1, 3, 0])), cells(&all));
    let mut none = Table::default();
    none.append(&all);
    assert_eq!(cells(&none), cells(&all));
    assert_eq!((all.statuses().len(), all.sample_count()), (4, 4));
    assert!(all.vector_columns("tip.position").is_none());
}

#[test]
#[should_panic(expected = "differ in length")]
fn columns_of_one_table_are_of_equal_length() {
    let _ = Table::new(vec![Column::new("a", "", vec![1.0]), Column::new("b", "", vec![1.0, 2.0])]);
}
