//! Triangles and grids of voxels as files for other programs. VTK itself reads them where `python3` has it.

use flate2::read::ZlibDecoder;
use rodsweep::table::{Column, Lattice, Table, TableError, Triangles, ply, vtk};
use std::io::Read;

/// A tetrahedron of four points.
const POINTS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.05]];
const TRIANGLES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
const LATTICE: Lattice = Lattice { origin: [-0.01, 0.0, 0.2], spacing: 0.002 };

/// Every kind of values.
fn table() -> Table {
    Table::new(vec![
        Column::new("count", "", vec![3u64, 0, 1 << 40, 7]),
        Column::new("stability.margin", "", vec![0.25, f64::NAN, 1.5, 0.125]),
        Column::new("sigma.1", "m", vec![0.5f32, 0.25, f32::NAN, 2.0]),
        Column::new("reached", "", vec![Some(true), Some(false), None, Some(true)]),
        Column::new("cause", "", ["inside", "branch", "", "inside"].map(str::to_owned).to_vec()),
        Column::new("\"a\" < b", "", vec![1u64, 2, 3, 4]),
    ])
}

/// The same rows in four voxels of a box of 2 x 1 x 3, the last twice.
fn voxels() -> Table {
    let at = [[0, 0, 0], [1, 0, 2], [1, 0, 0], [0, 0, 1]].map(|voxel| LATTICE.centre(voxel));
    let axis = |k: usize| at.iter().map(|point| point[k]).collect::<Vec<f64>>();
    let mut table = table();
    for (k, name) in ["voxel.x", "voxel.y", "voxel.z"].into_iter().enumerate() {
        table.columns.insert(k, Column::new(name, "m", axis(k)));
    }
    table.select(&[0, 1, 2, 3, 3])
}

fn tetrahedron<'a>(data: &'a Table, normals: &'a [[f64; 3]]) -> Triangles<'a> {
    Triangles { points: &POINTS, normals, triangles: &TRIANGLES, data, mark: None }
}

/// The XML of a file, and the bytes behind it.
fn split(file: &[u8]) -> (String, &[u8]) {
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let at = file.windows(mark.len()).position(|bytes| bytes == mark).expect("appended data");
    let data = &file[at + mark.len()..];
    assert!(data.ends_with(b"\n</AppendedData>\n</VTKFile>\n"));
    (String::from_utf8(file[..at].to_vec()).expect("XML"), data)
}

/// The bytes of one array after compression is undone.
fn array(file: &[u8], name: &str) -> Vec<u8> {
    let (xml, data) = split(file);
    let (_, rest) = xml.split_once(&format!("Name=\"{name}\"")).unwrap_or_else(|| panic!("no array {name} in {xml}"));
    let offset = rest.split_once("offset=\"").expect("an offset").1.split('"').next().expect("a number");
    let data = &data[offset.parse::<usize>().expect("a number")..];
    let number = |k: usize| u64::from_le_bytes(data[8 * k..8 * k + 8].try_into().unwrap()) as usize;
    let (count, whole, partial) = (number(0), number(1), number(2));
    let (mut at, mut bytes) = (8 * (3 + count), Vec::new());
    for block in 0..count {
        let size = number(3 + block);
        let before = bytes.len();
        ZlibDecoder::new(&data[at..at + size]).read_to_end(&mut bytes).expect("a block");
        let expected = if block + 1 == count && partial > 0 { partial } else { whole };
        assert_eq!(bytes.len() - before, expected, "{name}: block {block}");
        at += size;
    }
    bytes
}

fn doubles(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect()
}

#[test]
fn triangles_are_kept_with_their_columns() {
    let data = table();
    let file = vtk::poly_data(&tetrahedron(&data, &POINTS)).unwrap();
    let (xml, _) = split(&file);
    assert!(xml.contains("NumberOfPoints=\"4\"") && xml.contains("NumberOfPolys=\"4\""), "{xml}");
    assert!(xml.contains("Name=\"&quot;a&quot; &lt; b\"") && xml.contains(">m</InformationKey>"), "{xml}");
    assert_eq!(doubles(&array(&file, "Points")), POINTS.as_flattened());
    assert_eq!(doubles(&array(&file, "Normals")), POINTS.as_flattened());
    assert_eq!(array(&file, "stability.margin").len(), 32);
    assert_eq!(array(&file, "reached"), [1, 0, 255, 1]);
    assert_eq!(array(&file, "cause"), [1, 0, 0, 0, 255, 255, 1, 0]);
    let corners: Vec<u8> = TRIANGLES.as_flattened().iter().flat_map(|k| i64::from(*k).to_le_bytes()).collect();
    assert_eq!(array(&file, "connectivity"), corners);
    assert_eq!(array(&file, "offsets")[24..], 12i64.to_le_bytes());
}

#[test]
fn voxels_are_kept_as_a_dense_grid() {
    let file = vtk::image_data(&LATTICE, &voxels(), None).unwrap();
    let (xml, _) = split(&file);
    assert!(
        xml.contains("WholeExtent=\"0 2 0 1 0 3\" Origin=\"-0.01 0.0 0.2\" Spacing=\"0.002 0.002 0.002\""),
        "{xml}"
    );
    assert!(!xml.contains("Name=\"voxel.x\""), "{xml}");
    let margin = doubles(&array(&file, "stability.margin"));
    let bits = |x: &f64| if x.is_nan() { 0 } else { x.to_bits() };
    let expected = [0.25, 1.5, 0.125, f64::NAN, f64::NAN, f64::NAN];
    assert_eq!(margin.iter().map(bits).collect::<Vec<_>>(), expected.iter().map(bits).collect::<Vec<_>>());
    assert_eq!(array(&file, "reached"), [1, 255, 1, 255, 255, 0]);
    assert_eq!(array(&file, "cause"), [1i16, -1, 1, -1, -1, 0].map(i16::to_le_bytes).as_flattened());
    let counts = [3u64, 1 << 40, 7, 0, 0, 0];
    assert_eq!(array(&file, "count"), counts.map(u64::to_le_bytes).as_flattened());
}

#[test]
fn a_large_grid_is_mostly_empty_blocks() {
    let corner = |voxel: [i32; 3]| LATTICE.centre(voxel);
    let ends = [corner([-100, -100, -100]), corner([99, 99, 99])];
    let axis = |k: usize| ends.iter().map(|point| point[k]).collect::<Vec<f64>>();
    let mut columns: Vec<Column> = ["voxel.x", "voxel.y", "voxel.z"]
        .iter()
        .enumerate()
        .map(|(k, name)| Column::new(*name, "m", axis(k)))
        .collect();
    columns.push(Column::new("count", "", vec![5u64, 6]));
    let file = vtk::image_data(&LATTICE, &Table::new(columns.clone()), None).unwrap();
    let counts = array(&file, "count");
    assert_eq!(counts.len(), 8 * 200 * 200 * 200);
    assert_eq!((counts[0], counts[counts.len() - 8]), (5, 6));
    assert_eq!(counts.iter().filter(|byte| **byte != 0).count(), 2);
    // Too many cells are refused before anything is made of them.
    columns[0] = Column::new("voxel.x", "m", vec![0.0, 10.0]);
    let error = vtk::image_data(&LATTICE, &Table::new(columns), None).unwrap_err().to_string();
    assert!(error.contains("5001 x 200 x 200 cells are more than 64000000: choose larger voxels"), "{error}");
}

#[test]
fn properties_of_points_are_kept() {
    let data = table();
    let file = ply::encode(&tetrahedron(&data, &POINTS)).unwrap();
    let end = b"end_header\n";
    let at = file.windows(end.len()).position(|bytes| bytes == end).expect("a header") + end.len();
    let header = std::str::from_utf8(&file[..at]).unwrap();
    for line in [
        "format binary_little_endian 1.0",
        "comment unit of sigma.1: m",
        "comment cause 0: branch",
        "comment cause 1: inside",
        "element vertex 4",
        "property float nz",
        "property double count",
        "property float stability.margin",
        "property char reached",
        "property short cause",
        "property double \"a\"_<_b",
        "element face 4",
    ] {
        assert!(header.lines().any(|other| other == line), "`{line}` is missing from\n{header}");
    }
    let vertex = 6 * 4 + 8 + 4 + 4 + 1 + 2 + 8;
    assert_eq!(file.len() - at, 4 * vertex + 4 * 13);
    let y = &file[at + 2 * vertex + 4..][..4];
    assert_eq!(f32::from_le_bytes(y.try_into().unwrap()), 0.03);
    assert_eq!(file[at + 2 * vertex + 40..][..3], [255, 255, 255], "neither a flag nor a word");
    let last = &file[file.len() - 13..];
    assert_eq!((last[0], last[1], last[5], last[9]), (3, 0, 3, 2));
}

#[test]
fn what_speaks_against_data_is_kept() {
    let (mark, data) = ("DISTRUSTED: 1 of 2 -- <see>", table());
    let surface = Triangles { mark: Some(mark), ..tetrahedron(&data, &[]) };
    let ply = ply::encode(&surface).unwrap();
    let end = ply.windows(11).position(|bytes| bytes == b"end_header\n").expect("a header");
    let header = std::str::from_utf8(&ply[..end]).unwrap();
    assert!(header.lines().any(|line| line == format!("comment {mark}")), "{header}");
    let letters: Vec<String> = mark.bytes().chain([0]).map(|letter| letter.to_string()).collect();
    for file in [vtk::poly_data(&surface).unwrap(), vtk::image_data(&LATTICE, &voxels(), Some(mark)).unwrap()] {
        let (xml, _) = split(&file);
        assert!(xml.contains("<!-- DISTRUSTED: 1 of 2 - - &lt;see&gt; -->"), "{xml}");
        let (_, word) = xml.split_once("Name=\"distrusted\" NumberOfTuples=\"1\" format=\"ascii\">\n").expect("a word");
        assert_eq!(word.lines().next(), Some(letters.join(" ").as_str()));
        assert!(array(&file, "reached").starts_with(&[1]));
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let (data, nothing) = (table(), Table::default());
    let few = data.select(&[0, 1]);
    let corners = [[0, 1, 4]];
    for surface in [
        tetrahedron(&few, &[]),
        tetrahedron(&data, &POINTS[..2]),
        Triangles { triangles: &corners, ..tetrahedron(&data, &[]) },
    ] {
        assert!(matches!(vtk::poly_data(&surface), Err(TableError::Unwritable { .. })));
        assert!(matches!(ply::encode(&surface), Err(TableError::Unwritable { .. })));
    }
    let empty = Triangles { points: &[], normals: &[], triangles: &[], data: &nothing, mark: None };
    assert!(vtk::poly_data(&empty).is_ok() && ply::encode(&empty).is_ok());
    for table in [&nothing, &data, &voxels().empty()] {
        assert!(matches!(vtk::image_data(&LATTICE, table, None), Err(TableError::Unwritable { .. })));
    }
    let mut lost = voxels();
    lost.columns[0] = Column::new("voxel.x", "m", vec![f64::NAN; 5]);
    assert!(matches!(vtk::image_data(&LATTICE, &lost, None), Err(TableError::Unwritable { .. })));
}

/// What VTK reads from files; `None`, and a note, where `python3` has no VTK.
fn read_by_vtk(files: &[(&str, Vec<u8>)]) -> Option<String> {
    let python = |arguments: &[&std::ffi::OsStr]| std::process::Command::new("python3").args(arguments).output();
    if !python(&["-c".as_ref(), "import vtk".as_ref()]).is_ok_and(|run| run.status.success()) {
        eprintln!("skipped: python3 has no module vtk");
        return None;
    }
    let dir = tempfile::tempdir().unwrap();
    let script = crate::common::root().join("tests/files/read_vtk.py");
    let mut arguments = vec![script.into_os_string()];
    for (name, bytes) in files {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        arguments.push(path.into_os_string());
    }
    let run = python(&arguments.iter().map(AsRef::as_ref).collect::<Vec<_>>()).unwrap();
    let errors = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && errors.is_empty(), "{errors}");
    Some(String::from_utf8(run.stdout).unwrap())
}

#[test]
fn vtk_reads_the_files() {
    let (data, nothing) = (table(), Table::default());
    let empty = Triangles { points: &[], normals: &[], triangles: &[], data: &nothing, mark: None };
    let files = [
        ("a.vtp", vtk::poly_data(&tetrahedron(&data, &[])).unwrap()),
        ("b.vti", vtk::image_data(&LATTICE, &voxels(), None).unwrap()),
        ("c.ply", ply::encode(&tetrahedron(&data, &POINTS)).unwrap()),
        ("d.vtp", vtk::poly_data(&empty).unwrap()),
    ];
    let Some(read) = read_by_vtk(&files) else { return };
    let expected = "\
vtp: 4 points, 4 cells
bounds 0 0.02 0 0.03 0 0.05
volume 5e-06
count [] unsigned long long: 3 0 1.09951163e+12 7
stability.margin [] double: 0.25 nan 1.5 0.125
sigma.1 [m] float: 0.5 0.25 nan 2
reached [] signed char: 1 0 -1 1
cause [] short: 1 0 -1 1
\"a\" < b [] unsigned long long: 1 2 3 4
cause.words: branch inside
vti: 24 points, 6 cells
bounds -0.01 -0.006 0 0.002 0.2 0.206
count [] unsigned long long: 3 1.09951163e+12 7 0 0 0
stability.margin [] double: 0.25 1.5 0.125 nan nan nan
sigma.1 [m] float: 0.5 nan 2 nan nan 0.25
reached [] signed char: 1 -1 1 -1 -1 0
cause [] short: 1 -1 1 -1 -1 0
\"a\" < b [] unsigned long long: 1 3 4 0 0 2
cause.words: branch inside
ply: 4 points, 4 cells
bounds 0 0.0199999996 0 0.0299999993 0 0.0500000007
volume 5e-06
vtp: 0 points, 0 cells
";
    let read = read.replace("unsigned long:", "unsigned long long:");
    assert!(read.starts_with(expected), "{read}");
}
