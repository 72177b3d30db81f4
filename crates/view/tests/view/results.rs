//! A result directory on the wire: points, columns, rows, what a workspace left; and nothing else of the directory.

use super::client::{Running, shipped};
use rodsweep::draw::ColourRange;
use rodsweep::results::{Results, write_table};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{ResultDirectory, SweepJob};
use rodsweep::table::{Column, Table, Triangles, ply};
use serde_json::Value;
use std::path::Path;
use std::sync::OnceLock;
use tempfile::TempDir;

/// The first samples of the workspace map, run once.
pub fn directory() -> &'static Path {
    static RUN: OnceLock<TempDir> = OnceLock::new();
    let run = RUN.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let spec = SweepSpec::read(&shipped("sweeps/workspace.toml")).expect("a sweep");
        let mut sink = ResultDirectory::new(folder.path());
        SweepJob::new(spec).limit(Some(3000)).run(&mut sink).expect("a run");
        std::fs::write(folder.path().join("secret.txt"), "secret").expect("a file");
        std::fs::write(folder.path().join("figure.png"), b"\x89PNG").expect("a file");
        #[cfg(unix)]
        std::os::unix::fs::symlink("/etc/hostname", folder.path().join("link.png")).expect("a link");
        folder
    });
    run.path()
}

/// Typed columns by name, read as `docs/view.md` tells.
fn singles(bytes: &[u8]) -> Vec<(String, Vec<f64>)> {
    let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).expect("four bytes");
    let mut at = 4 + u32::from_le_bytes(word(0)) as usize;
    let head: serde_json::Value = serde_json::from_slice(&bytes[4..at]).expect("a head");
    let rows = head["rows"].as_u64().expect("rows") as usize;
    let mut column = |described: &serde_json::Value| {
        let (from, name) = (at, described["name"].as_str().expect("a name").to_owned());
        let width = if described["kind"] == "u8" { 1 } else { 4 };
        at = (from + width * rows).next_multiple_of(4);
        let value = |row: usize| match described["kind"].as_str() {
            Some("f32") => f64::from(f32::from_le_bytes(word(from + 4 * row))),
            Some("u32") => f64::from(u32::from_le_bytes(word(from + 4 * row))),
            Some("u8") => f64::from(bytes[from + row]),
            other => panic!("a column of kind {other:?}"),
        };
        (name, (0..rows).map(value).collect())
    };
    let columns = head["columns"].as_array().expect("columns").iter().map(&mut column).collect();
    assert_eq!(at, bytes.len(), "nothing stands behind the last column");
    columns
}

#[test]
fn points_are_the_rows_in_a_fair_order() {
    let server = Running::new(directory());
    let rows = Results::open(directory()).expect("results").read(&[]).expect("rows");
    let mut seen = Vec::new();
    for from in [0, 1000, 2500] {
        let path = format!(
            "api/points?columns=row&columns=status&columns=tip.position.x&columns=stability.margin&from={from}&count=1500"
        );
        let columns = singles(&server.get(&path).1);
        assert_eq!(
            columns.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
            ["row", "status", "tip.position.x", "stability.margin"]
        );
        assert_eq!(columns[0].1.len(), if from == 2500 { 500 } else { 1500 });
        for (k, row) in columns[0].1.iter().enumerate() {
            let row = *row as usize;
            let x = rows.column("tip.position.x").expect("a column").values.number(row);
            assert!((columns[2].1[k] - x).abs() <= 1e-7 * x.abs(), "row {row}");
            assert_eq!(columns[1].1[k], f64::from(rows.statuses()[row].code()));
        }
        if from != 1000 {
            seen.extend(columns[0].1.iter().map(|row| *row as u64));
        }
    }
    // The first of the order come from everywhere: each tenth of the rows has its share.
    for tenth in 0..10 {
        let count = seen[..1500].iter().filter(|row| **row / 300 == tenth).count();
        assert!((100..200).contains(&count), "{count} of 150 in tenth {tenth}");
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 2000, "no row comes twice");
}

#[test]
fn a_row_has_every_digit() {
    let server = Running::new(directory());
    let rows = Results::open(directory()).expect("results").read(&[]).expect("rows");
    let row = server.json("api/row?row=1234", None);
    for cell in row["cells"].as_array().expect("cells") {
        let column = rows.column(cell["name"].as_str().expect("a name")).expect("a column");
        let expected = column.values.number(1234);
        match &cell["value"] {
            Value::Number(number) => assert_eq!(number.as_f64(), Some(expected), "{cell}"),
            Value::Bool(flag) => assert_eq!(f64::from(*flag), expected, "{cell}"),
            other => assert_eq!(other, rows.statuses()[1234].name(), "{cell}"),
        }
    }
    assert_eq!(row["cells"].as_array().map(Vec::len), Some(rows.columns.len()));
    assert_eq!(server.get("api/row?row=3000").0, 404);
    assert_eq!(server.get("api/row?row=-1").0, 400);
}

#[test]
fn colours_span_what_the_figures_span() {
    let server = Running::new(directory());
    let rows = Results::open(directory()).expect("results").read(&["stability.margin", "status"]).expect("rows");
    let values = rows.column("stability.margin").expect("a column").values.numbers();
    let usable = values.iter().zip(rows.statuses()).filter(|(x, status)| status.is_success() && x.is_finite());
    let range = ColourRange::of(usable.map(|(x, _)| *x)).expect("values");
    let told = server.json("api/column?name=stability.margin", None);
    for (key, expected) in [("low", range.low), ("high", range.high)] {
        let found = told[key].as_f64().expect("a number");
        assert!((found - expected).abs() < 1e-6 * expected.abs(), "{key}: {found} {expected}");
    }
    assert_eq!(server.get("api/column?name=no.such").0, 404);
}

/// A copy of the run with what `workspace` writes: a tetrahedron and two voxels, one of them outside.
fn with_workspace() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in std::fs::read_dir(directory()).expect("a folder").flatten() {
        if entry.file_name().to_string_lossy().ends_with(".png") {
            continue;
        }
        std::fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("a copy");
    }
    let points = [[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.03]];
    let data = Table::new(vec![Column::new("stability.margin", "", vec![0.1, 0.2, 0.3, 0.4])]);
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let surface = Triangles { points: &points, normals: &[], triangles: &triangles, data: &data, mark: None };
    std::fs::write(folder.path().join("boundary.ply"), ply::encode(&surface).expect("a surface")).expect("a file");
    let voxels = Table::new(vec![
        Column::new("voxel.x", "m", vec![0.001, 0.003]),
        Column::new("voxel.y", "m", vec![0.001, 0.001]),
        Column::new("voxel.z", "m", vec![0.001, 0.001]),
        Column::new("reached", "", vec![true, false]),
        Column::new("isotropy", "", vec![0.5, f64::NAN]),
    ]);
    write_table(&folder.path().join("workspace.parquet"), &voxels, &[]).expect("a file");
    folder
}

#[test]
fn a_workspace_brings_its_boundary_and_voxels() {
    let folder = with_workspace();
    let server = Running::new(folder.path());
    let points = singles(&server.get("api/surface/points").1);
    assert_eq!(points[2], ("z".to_owned(), vec![0.0, 0.0, 0.0, f64::from(0.03f32)]));
    let corners = singles(&server.get("api/surface/triangles").1);
    assert_eq!(corners[1], ("b".to_owned(), vec![2.0, 1.0, 3.0, 2.0]));
    let voxels = singles(&server.get("api/voxels?column=isotropy").1);
    assert_eq!(voxels[3], ("isotropy".to_owned(), vec![0.5]));
    assert_eq!(server.json("api/view", None)["map"]["voxel"], 0.002);
    let told = server.json("api/voxels/column?name=isotropy", None);
    assert_eq!((&told["count"], &told["map"]), (&Value::from(1), &Value::from("sequential")));
    assert_eq!(server.get("api/voxels/column?name=no.such").0, 404);
    // A file that is cut short shows nothing.
    let path = folder.path().join("boundary.ply");
    let whole = std::fs::read(&path).expect("a file");
    for length in [0, 10, 100, whole.len() - 1] {
        std::fs::write(&path, &whole[..length]).expect("a file");
        assert_eq!(Running::new(folder.path()).json("api/view", None)["map"]["surface"], false, "{length} bytes");
    }
}

#[test]
fn nothing_else_of_the_directory_can_be_read() {
    let server = Running::new(directory());
    assert_eq!(server.get("stills/figure.png").0, 200);
    for name in ["secret.txt", "link.png", "manifest.json", "part-0000000000.parquet", "../secret.txt"] {
        assert_eq!(server.get(&format!("stills/{name}")).0, 404, "{name}");
    }
    let names = server.json("api/view", None)["stills"].clone();
    assert!(!names.to_string().contains("link.png") && !names.to_string().contains("secret"), "{names}");
    assert_eq!(server.get("api/surface/points").0, 404);
    assert_eq!(server.get("api/voxels?column=margin").0, 404);
}
