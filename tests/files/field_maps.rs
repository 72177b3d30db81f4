//! Files of fields sampled on a grid: CSV, NPZ and VTK, their units and their mistakes.

use crate::common::texts::SCENE;
use rodsweep::input::{InputError, parse_scene, scene_notes, write_scene};
use rodsweep::model::{Parameter, Scene};
use rodsweep::table::{Column, Table, npz};
use std::fmt::Write;
use std::path::Path;
use tempfile::TempDir;

const COUNTS: [usize; 3] = [5, 4, 6];

/// A place and B there.
type Node = ([f64; 3], [f64; 3]);

/// B = (0.3 x + 0.1 z, -0.5 y, 0.2 z + 0.1 x), on a grid of 10 mm steps from (-20, -15, 0) mm.
fn nodes() -> Vec<Node> {
    let [nx, ny, nz] = COUNTS;
    let at = |k: usize| [k % nx, k / nx % ny, k / (nx * ny)];
    let node = |k: usize| {
        let [i, j, l] = at(k).map(|i| 0.01 * i as f64);
        let x = [i - 0.02, j - 0.015, l];
        (x, [0.3 * x[0] + 0.1 * x[2], -0.5 * x[1], 0.2 * x[2] + 0.1 * x[0]])
    };
    (0..nx * ny * nz).map(node).collect()
}

fn csv() -> String {
    let mut text = String::from("# a map\nx,y,z,Bx,By,Bz\n");
    for ([x, y, z], [a, b, c]) in nodes() {
        writeln!(text, "{x},{y},{z},{a},{b},{c}").expect("a line");
    }
    text
}

fn scene_text(file: &str, more: &str) -> String {
    format!("{SCENE}\n[[field_map]]\nname = \"coil1\"\nfile = \"{file}\"\n{more}\n")
}

fn read(folder: &Path, file: &str, more: &str) -> Result<Scene, InputError> {
    parse_scene(&folder.join("scene.toml"), &scene_text(file, more))
}

/// Whatever it was read from, the field is that of the nodes.
fn is_the_field(scene: &Scene, scale: f64) {
    let field = scene.rod().field.expect("a field that varies");
    for ([x, y, z], b) in nodes().into_iter().step_by(7) {
        let found = field.flux_density([x, y, z]);
        for k in 0..3 {
            assert!((found[k] - scale * b[k]).abs() < 1e-14, "{found:?} {b:?}");
        }
    }
    let map = &scene.sources.maps[0];
    assert_eq!(map.grid.counts, COUNTS);
    assert!(map.grid.fit.divergence < 1e-10, "{:?}", map.grid.fit);
}

#[test]
fn every_format_says_the_same() {
    let folder = TempDir::new().expect("a folder");
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("a file");
    put("a.csv", csv().as_bytes());
    is_the_field(&read(folder.path(), "a.csv", "").expect("a scene"), 1.0);
    is_the_field(&read(folder.path(), "a.csv", "scale = 2.5").expect("a scene"), 2.5);
    // In millimetres and millitesla, by the first line or by the scene, rows in any order.
    let mut lines: Vec<String> = nodes()
        .iter()
        .map(|(x, b)| x.iter().chain(b).map(|x| format!("{:.9}", 1e3 * x)).collect::<Vec<_>>().join(", "))
        .collect();
    lines.reverse();
    let body = lines.join("\n");
    put("b.csv", format!("x [mm], y [mm], z [mm], Bx [mT], By [mT], Bz [mT]\n{body}").as_bytes());
    is_the_field(&read(folder.path(), "b.csv", "").expect("a scene"), 1.0);
    put("c.csv", format!("x,y,z,Bx,By,Bz\n{body}").as_bytes());
    let units = "length_unit = \"mm\"\nfield_unit = \"mT\"";
    is_the_field(&read(folder.path(), "c.csv", units).expect("a scene"), 1.0);
    // The potential, -(0.15 x² + 0.1 x z - 0.25 y² + 0.1 z²).
    let mut potential = String::from("x,y,z,potential\n");
    for ([x, y, z], _) in nodes() {
        let phi = -(0.15 * x * x + 0.1 * x * z - 0.25 * y * y + 0.1 * z * z);
        writeln!(potential, "{x},{y},{z},{phi}").expect("a line");
    }
    put("d.csv", potential.as_bytes());
    let scene = read(folder.path(), "d.csv", "").expect("a scene");
    assert_eq!(scene.sources.maps[0].grid.fit.rotation, None);
    is_the_field(&scene, 1.0);
    // One array a column.
    let column =
        |name: &str, of: &dyn Fn(&Node) -> f64| Column::new(name, "", nodes().iter().map(of).collect::<Vec<f64>>());
    let mut columns: Vec<Column> = ["x", "y", "z"].iter().enumerate().map(|(k, n)| column(n, &|p| p.0[k])).collect();
    columns.extend(["Bx", "By", "Bz"].iter().enumerate().map(|(k, n)| column(n, &|p| p.1[k])));
    put("e.npz", &npz::encode(&Table::new(columns)).expect("an archive"));
    is_the_field(&read(folder.path(), "e.npz", "").expect("a scene"), 1.0);
    put("f.vtk", vtk(false).as_slice());
    is_the_field(&read(folder.path(), "f.vtk", "").expect("a scene"), 1.0);
    put("g.vtk", vtk(true).as_slice());
    is_the_field(&read(folder.path(), "g.vtk", "").expect("a scene"), 1.0);
    put("h.npz", &axes_npz());
    is_the_field(&read(folder.path(), "h.npz", "").expect("a scene"), 1.0);
}

fn vtk(is_binary: bool) -> Vec<u8> {
    let [nx, ny, nz] = COUNTS;
    let kind = if is_binary { "BINARY" } else { "ASCII" };
    let mut bytes = format!(
        "# vtk DataFile Version 3.0\na map\n{kind}\nDATASET STRUCTURED_POINTS\nDIMENSIONS {nx} {ny} {nz}\nORIGIN -0.02 -0.015 0\nSPACING 0.01 0.01 0.01\nPOINT_DATA {}\nVECTORS B double\n",
        nx * ny * nz
    )
    .into_bytes();
    for (_, b) in nodes() {
        match is_binary {
            true => b.iter().for_each(|x| bytes.extend(x.to_be_bytes())),
            false => bytes.extend(format!("{} {} {}\n", b[0], b[1], b[2]).into_bytes()),
        }
    }
    bytes
}

/// Axes x, y, z and B with an index for each of them, as `numpy.savez` writes them.
fn axes_npz() -> Vec<u8> {
    use std::io::{Cursor, Write};
    let [nx, ny, nz] = COUNTS;
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let mut put = |name: &str, shape: &str, values: &[f64]| {
        let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape}), }}\n");
        archive.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).expect("an entry");
        archive.write_all(b"\x93NUMPY\x01\x00").expect("bytes");
        archive.write_all(&(text.len() as u16).to_le_bytes()).expect("bytes");
        archive.write_all(text.as_bytes()).expect("bytes");
        values.iter().for_each(|x| archive.write_all(&x.to_le_bytes()).expect("bytes"));
    };
    let axis = |n: usize, from: f64| (0..n).map(|i| from + 0.01 * i as f64).collect::<Vec<f64>>();
    put("x", &format!("{nx},"), &axis(nx, -0.02));
    put("y", &format!("{ny},"), &axis(ny, -0.015));
    put("z", &format!("{nz},"), &axis(nz, 0.0));
    let all = nodes();
    let mut values = Vec::new();
    for i in 0..nx {
        for j in 0..ny {
            for k in 0..nz {
                values.extend(all[(k * ny + j) * nx + i].1);
            }
        }
    }
    put("B", &format!("{nx}, {ny}, {nz}, 3"), &values);
    archive.finish().expect("an archive").into_inner()
}

#[test]
fn maps_have_parameters_and_read_back() {
    let folder = TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("a.csv"), csv()).expect("a file");
    let scene = read(folder.path(), "a.csv", "scale = 2.5\nposition = [0, \"1 mm\", 0]").expect("a scene");
    let count = |name: &str| Parameter::parse(&scene, name).unwrap_or_else(|error| panic!("{error}")).len();
    assert_eq!((count("maps.coil1.scale"), count("maps.coil1.position")), (1, 3));
    let note = scene_notes(&scene).join("\n");
    assert!(note.contains("maps.coil1") && note.contains("5 x 4 x 6 nodes") && note.contains("div B"), "{note}");
    let text = write_scene(&scene);
    assert_eq!(parse_scene("elsewhere/scene.toml".as_ref(), &text).expect("what was written"), scene);
    // What was read is no longer there.
    std::fs::write(folder.path().join("a.csv"), csv().replace("# a map", "# another map")).expect("a file");
    let error = parse_scene("elsewhere/scene.toml".as_ref(), &text).expect_err("another file");
    assert_eq!(error.key, "field_map[0].digest");
    assert!(error.to_string().contains("bring that file back"), "{error}");
}

#[test]
fn mistakes_in_maps_are_named() {
    let folder = TempDir::new().expect("a folder");
    let good = csv();
    let irregular = good.lines().map(|line| line.replacen("0.02,", "0.027,", 1)).collect::<Vec<_>>().join("\n");
    let last = good.lines().last().expect("a line").to_owned();
    let cases = [
        (good.replace("Bz", "Bw"), "Bz", "is missing: give columns"),
        (good.replace("x,y,z", "x [mT],y,z"), "x", "a length"),
        (irregular, "", "irregular"),
        (good.replace(&last, ""), "", "119 points do not fill its 5 x 4 x 6 nodes"),
        (good.replace(&last, good.lines().nth(2).expect("a line")), "", "is given twice"),
        (good.replacen(",0.002", ",2 mT", 1), "", "write the unit once"),
        (good.replace(&last, &format!("{},inf", last.rsplit_once(',').expect("cells").0)), "", "is not finite"),
        (good.lines().take(2 + 40).collect::<Vec<_>>().join("\n"), "z", "2 places along z: give at least 4"),
        (String::new(), "", "must name x, y, z"),
    ];
    for (text, key, words) in cases {
        std::fs::write(folder.path().join("bad.csv"), &text).expect("a file");
        let error = read(folder.path(), "bad.csv", "").expect_err(words);
        let message = error.to_string();
        assert!(message.contains("bad.csv") && message.contains(words), "{message}\n  has not: {words}");
        assert!(key.is_empty() || error.key == key, "{message}");
    }
    let of_scene = [
        ("none.csv", "", "field_map[0].file", "starts from the folder of this file"),
        ("scene.toml", "", "", "is no format of samples"),
        ("good.csv", "field_unit = \"mm\"", "field_map[0].field_unit", "flux density"),
        ("good.csv", "scal = 1", "field_map[0].scal", "did you mean `scale`"),
    ];
    std::fs::write(folder.path().join("good.csv"), &good).expect("a file");
    std::fs::write(folder.path().join("scene.toml"), "name = \"no map\"").expect("a file");
    for (file, more, key, words) in of_scene {
        let error = read(folder.path(), file, more).expect_err(words);
        assert!(error.to_string().contains(words), "{error}\n  has not: {words}");
        assert_eq!(error.key, key, "{error}");
    }
    let magnetised = scene_text("good.csv", "").replacen(
        "kind = \"flexible\"\n",
        "kind = \"flexible\"\ndipole_per_length = [0, 0, 1]\n",
        1,
    );
    let error = parse_scene(&folder.path().join("scene.toml"), &magnetised).expect_err("a magnetised tube");
    assert!(error.key.ends_with("dipole_per_length") && error.to_string().contains("rigid segments"), "{error}");
    std::fs::write(folder.path().join("grid.vtk"), "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\n")
        .expect("a file");
    let error = read(folder.path(), "grid.vtk", "").expect_err("no grid").to_string();
    assert!(error.contains("irregular") && error.contains("STRUCTURED_POINTS"), "{error}");
    std::fs::write(folder.path().join("grid.vtk"), "<VTKFile type=\"ImageData\">").expect("a file");
    let error = read(folder.path(), "grid.vtk", "").expect_err("no legacy file").to_string();
    assert!(error.contains("name it .vti"), "{error}");
}

#[test]
fn places_have_bounds() {
    let folder = TempDir::new().expect("a folder");
    let grid = String::from_utf8(vtk(false)).expect("text");
    let image = String::from_utf8(vti("", "type=\"Float64\" format=\"ascii\"", "1 2", b"")).expect("text");
    let [nx, ny, nz] = COUNTS;
    let places = format!(
        "DATASET RECTILINEAR_GRID\nDIMENSIONS {nx} {ny} {nz}\nX_COORDINATES {nx} double\n0 1 nan 3 4\nY_COORDINATES {ny} \
         double\n0 1 2 3\nZ_COORDINATES {nz} double\n0 1 2 3 4 5\n"
    );
    let head = grid.find("DATASET").expect("a grid");
    let data = grid.find("POINT_DATA").expect("values");
    let bound = "give places of at most 1e60 in size";
    for (file, text, key, words) in [
        ("a.vtk", grid.replace("ORIGIN -0.02", "ORIGIN 1e300"), "x", bound),
        ("a.vtk", grid.replace("SPACING 0.01 0.01", "SPACING 0.01 1e61"), "y", bound),
        ("a.vtk", grid.replace("ORIGIN -0.02", "ORIGIN 0").replace("SPACING 0.01", "SPACING 1e-300"), "x", "1e-60 m"),
        ("a.vtk", format!("{}{places}{}", &grid[..head], &grid[data..]), "x", bound),
        ("a.vti", image.replace("Spacing=\"0.01", "Spacing=\"1e200"), "x", bound),
        ("a.csv", csv().replace("-0.02,", "-1e61,"), "x", "a node is at x = -1e61 m"),
    ] {
        let text = if file == "a.vti" {
            let values: String = nodes().iter().map(|(_, b)| format!("{} {} {}\n", b[0], b[1], b[2])).collect();
            text.replace("1 2<", &format!("{values}<"))
        } else {
            text
        };
        std::fs::write(folder.path().join(file), text).expect("a file");
        let error = read(folder.path(), file, "").expect_err(words);
        let message = error.to_string();
        assert!(message.contains(file) && message.contains(words), "{message}\n  has not: {words}");
        assert!(error.key == key && !message.contains("0000000000"), "{message}");
    }
    // A unit of the scene counts, too.
    std::fs::write(folder.path().join("a.csv"), csv().replace("-0.02,", "-1e65,")).expect("a file");
    let message = read(folder.path(), "a.csv", "length_unit = \"mm\"").expect_err("far away").to_string();
    assert!(message.contains(bound), "{message}");
}

#[test]
fn a_message_quotes_few_names_and_none_at_length() {
    let folder = TempDir::new().expect("a folder");
    let names: Vec<String> = (0..10_000).map(|k| format!("c{k}")).collect();
    let wide = format!("{}\n{}\n", names.join(","), vec!["0"; names.len()].join(","));
    for text in ["\0".repeat(1_000_000), wide, csv().replacen(",0.002", &format!(",{}", "x".repeat(1_000_000)), 1)] {
        std::fs::write(folder.path().join("bad.csv"), text).expect("a file");
        let message = read(folder.path(), "bad.csv", "").expect_err("no map").to_string();
        assert!(message.contains("bad.csv") && message.len() < 1000, "{} bytes", message.len());
    }
}

/// Standard base64, in an order of steps of its own.
fn base64(bytes: &[u8]) -> String {
    let letters: Vec<char> = ('A'..='Z').chain('a'..='z').chain('0'..='9').chain(['+', '/']).collect();
    let bits: String = bytes.iter().map(|byte| format!("{byte:08b}")).collect();
    let digit = |six: &[u8]| {
        let six = format!("{:0<6}", std::str::from_utf8(six).expect("digits"));
        letters[usize::from_str_radix(&six, 2).expect("six bits")]
    };
    let mut text: String = bits.as_bytes().chunks(6).map(digit).collect();
    while !text.len().is_multiple_of(4) {
        text.push('=');
    }
    text
}

/// An ImageData whose first array is not the field; `about` are attributes of the file, `values` those of the array.
fn vti(about: &str, values: &str, inline: &str, appended: &[u8]) -> Vec<u8> {
    let [nx, ny, nz] = COUNTS.map(|count| count - 1);
    let extent = format!("1 {} 0 {ny} -2 {}", nx + 1, nz as i64 - 2);
    let mut bytes = format!(
        "<?xml version=\"1.0\"?>\n<!-- <VTKFile type=\"PolyData\"> -->\n<VTKFile type=\"ImageData\" {about}>\n<ImageData \
         WholeExtent=\"{extent}\" Origin=\"-0.03 -0.015 0.02\" Spacing=\"0.01 0.01 0.01\">\n<Piece Extent=\"{extent}\">\n<CellData>\
         <DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3</DataArray></CellData>\n<PointData>\n\
         <DataArray type=\"Int8\" Name=\"mask\" format=\"ascii\">1</DataArray>\n<DataArray Name='B' NumberOfComponents=\"3\" {values}>\
         {inline}</DataArray>\n</PointData>\n</Piece>\n</ImageData>\n"
    )
    .into_bytes();
    bytes.extend_from_slice(appended);
    bytes
}

fn little(width: usize) -> Vec<u8> {
    let each = nodes().into_iter().flat_map(|(_, b)| b);
    each.flat_map(|x| if width == 8 { x.to_le_bytes().to_vec() } else { (x as f32).to_le_bytes().to_vec() }).collect()
}

#[test]
fn image_data_is_read_in_every_encoding() {
    let folder = TempDir::new().expect("a folder");
    let put = |name: &str, bytes: Vec<u8>| std::fs::write(folder.path().join(name), bytes).expect("a file");
    let text: String = nodes().iter().map(|(_, b)| format!("{} {} {}\n", b[0], b[1], b[2])).collect();
    put("a.vti", vti("", "type=\"Float64\" format=\"ascii\"", &text, b""));
    // A number before the block in the same base64, or in one of its own.
    let doubles = little(8);
    let whole = base64(&[&(doubles.len() as u32).to_le_bytes()[..], &doubles].concat());
    put("b.vti", vti("", "type=\"Float64\" format=\"binary\"", &whole, b""));
    let apart = format!("\n  {}{}\n", base64(&(doubles.len() as u64).to_le_bytes()), base64(&doubles));
    put("c.vti", vti("header_type=\"UInt64\"", "format=\"binary\" type=\"Float64\"", &apart, b""));
    let raw = |encoding: &str, junk: usize, block: &[u8]| {
        let head = format!("<AppendedData encoding=\"{encoding}\">\n  _{}", "x".repeat(junk)).into_bytes();
        [&head[..], block, b"\n</AppendedData>\n</VTKFile>\n"].concat()
    };
    let block = [&(doubles.len() as u64).to_le_bytes()[..], &doubles].concat();
    let values = "type=\"Float64\" format=\"appended\" offset=\"5\"";
    put("d.vti", vti("header_type=\"UInt64\" byte_order=\"LittleEndian\"", values, "", &raw("raw", 5, &block)));
    put("e.vti", vti("", &values.replace('5', "0"), "", &raw("base64", 0, whole.as_bytes())));
    let mut big = vec![0; 4];
    nodes().iter().flat_map(|(_, b)| *b).for_each(|x| big.extend(x.to_be_bytes()));
    big[..4].copy_from_slice(&(doubles.len() as u32).to_be_bytes());
    put("f.vti", vti("byte_order=\"BigEndian\"", values, "", &raw("raw", 5, &big)));
    for name in ["a.vti", "b.vti", "c.vti", "d.vti", "e.vti", "f.vti"] {
        is_the_field(&read(folder.path(), name, "").unwrap_or_else(|error| panic!("{name}: {error}")), 1.0);
    }
    let singles = little(4);
    let block = [&(singles.len() as u32).to_le_bytes()[..], &singles].concat();
    put("g.vti", vti("", "type=\"Float32\" format=\"appended\" offset=\"0\"", "", &raw("raw", 0, &block)));
    let [exact, single] = ["d.vti", "g.vti"].map(|name| read(folder.path(), name, "").expect("a scene"));
    let [exact, single] = [&exact, &single].map(|scene| scene.sources.maps[0].grid.coefficients.clone());
    let (mut off, mut size) = (0.0f64, 0.0f64);
    for (a, b) in exact.iter().zip(&single) {
        (off, size) = (off.max((a - b).abs()), size.max(a.abs()));
    }
    assert!(off > 0.0 && off < 1e-6 * size, "{off} of {size}");
}

#[test]
fn image_data_that_cannot_be_read_says_what_would_help() {
    let folder = TempDir::new().expect("a folder");
    let ascii = "type=\"Float64\" format=\"ascii\"";
    let good = String::from_utf8(vti("", ascii, "1 2", b"")).expect("text");
    let cases = [
        (good.clone(), "numbers in a <DataArray>"),
        (
            good.replace("type=\"ImageData\" ", "type=\"ImageData\" compressor=\"vtkZLibDataCompressor\""),
            "without compression",
        ),
        (good.replace("type=\"ImageData\"", "type=\"UnstructuredGrid\""), "save it as ImageData"),
        (good.replace("Spacing=", "Direction=\"0 1 0 1 0 0 0 0 1\" Spacing="), "turned"),
        (good.replace("<Piece", "<Piece Extent=\"0 1 0 1 0 1\"></Piece><Piece"), "several pieces"),
        (good.replace("WholeExtent=\"1", "WholeExtent=\"x"), "six whole numbers"),
        (good.replace("=\"1 ", "=\"-9223372036854775808 "), "no grid of at most"),
        (good.replace("format=\"ascii\">1 2<", "format=\"binary\">AAAA<"), "ends before"),
        (good.replace("format=\"ascii\">1 2<", "format=\"appended\" offset=\"99999\"><"), "beyond the file"),
        (
            good.replace("NumberOfComponents=\"3\" type", "NumberOfComponents=\"2\" type").replace("name=\"mask\"", ""),
            "numbers in a",
        ),
        ("<VTKFile type".into(), "<VTKFile> is missing"),
        ("".into(), "<VTKFile> is missing"),
    ];
    for (text, words) in cases {
        std::fs::write(folder.path().join("bad.vti"), &text).expect("a file");
        let error = read(folder.path(), "bad.vti", "").expect_err(words).to_string();
        assert!(error.contains(words), "{error}\n  has not: {words}");
    }
    // A file that ends before its last number does is refused.
    let text: String = nodes().iter().map(|(_, b)| format!("{} {} {}\n", b[0], b[1], b[2])).collect();
    let whole = vti("", ascii, text.trim_end(), b"");
    std::fs::write(folder.path().join("bad.vti"), &whole).expect("a file");
    read(folder.path(), "bad.vti", "").expect("a map");
    let last = whole.windows(12).rposition(|window| window == b"</DataArray>").expect("the end of the field");
    for end in (0..last).step_by(3).chain([last - 1, last]) {
        std::fs::write(folder.path().join("bad.vti"), &whole[..end]).expect("a file");
        assert!(read(folder.path(), "bad.vti", "").is_err(), "{end}");
    }
}
