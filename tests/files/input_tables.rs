//! Samples as a table, in the layouts that other programs write.

use crate::arc::shipped;
use rodsweep::model::{Parameter, Status};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{Memory, SweepJob};
use std::fs;
use std::path::Path;

const NAMES: [&str; 4] = ["coil.current.x", "coil.current.y", "coil.current.z", "insertion"];
const ROWS: [[f64; 4]; 3] =
    [[0.122, 0.1232, 0.0061, 0.09109], [-0.0857, -0.1784, -0.0467, 0.08555], [-0.0366, -0.1819, -0.1805, 0.09]];

fn sweep(folder: &Path, file: &str, more: &str) -> Result<SweepSpec, String> {
    let scene = shipped().join("scenes/p6.toml");
    let text =
        format!("scene = {:?}\n[sampling]\nmethod = \"table\"\nfile = \"{file}\"\n{more}", scene.display().to_string());
    SweepSpec::parse(&folder.join("sweep.toml"), &text).map_err(|error| error.to_string())
}

/// A line of names, then lines of numbers, each cell by a function of column and number.
fn table(head: &str, separator: &str, cell: impl Fn(usize, f64) -> String) -> String {
    let row = |row: &[f64; 4]| {
        let cells: Vec<String> = row.iter().enumerate().map(|(column, value)| cell(column, *value)).collect();
        cells.join(separator) + "\n"
    };
    head.to_owned() + "\n" + &ROWS.iter().map(row).collect::<String>()
}

fn expect_rows(spec: &SweepSpec, layout: &str) {
    let parameters: Vec<Parameter> = NAMES.iter().map(|name| Parameter::parse(&spec.scene, name).unwrap()[0]).collect();
    let table = spec.table.as_ref().unwrap();
    assert_eq!((table.parameters(), table.row_count()), (&parameters[..], 3), "{layout}");
    for (row, expected) in ROWS.iter().enumerate() {
        for (found, expected) in table.row(row).iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 4e-16, "{layout}: {found} {expected}");
        }
    }
}

#[test]
fn every_layout_of_the_guide_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let plain = |_: usize, value: f64| value.to_string();
    let head = NAMES.join(",");
    let milli = |_: usize, value: f64| ((value * 1e12).round() / 1e9).to_string();
    let csv = table(&head, ",", plain);
    let utf16 = |order: fn(u16) -> [u8; 2]| -> Vec<u8> {
        "\u{feff}".encode_utf16().chain(csv.encode_utf16()).flat_map(order).collect()
    };
    let layouts: Vec<(&str, Vec<u8>)> = vec![
        ("plain", csv.clone().into()),
        ("byte order mark, carriage returns", format!("\u{feff}{}", csv.replace('\n', "\r\n")).into()),
        ("carriage returns alone", csv.replace('\n', "\r").into()),
        ("UTF-16, little end first", utf16(u16::to_le_bytes)),
        ("UTF-16, big end first", utf16(u16::to_be_bytes)),
        ("blank lines and comments", format!("# made by hand\n\n% twice\n{}", csv.replace('\n', "\n\n")).into()),
        ("quotes", table(&NAMES.map(|name| format!("\"{name}\"")).join(","), ",", |_, x| format!("\"{x}\"")).into()),
        ("semicolons", table(&NAMES.join(";"), ";", plain).into()),
        ("decimal commas", table(&NAMES.join(";"), ";", |_, x| x.to_string().replace('.', ",")).into()),
        ("decimal commas, tabs", table(&NAMES.join("\t"), "\t", |_, x| x.to_string().replace('.', ",")).into()),
        ("tabs", table(&NAMES.join("\t"), "\t", plain).into()),
        ("blanks", table(&NAMES.join("  "), "   ", plain).into()),
        ("numpy.savetxt with a head", table(&format!("# {}", NAMES.join(" ")), " ", |_, x| format!("{x:.18e}")).into()),
        ("the same with commas", table(&format!("# {head}"), ",", |_, x| format!("{x:.18e}")).into()),
        ("a comment of other words above", format!("# a, b, c, d\n{}", table(&format!("#{head}"), ",", plain)).into()),
        ("commas at the ends", csv.replace('\n', ",\n").into()),
        ("Fortran", table(&head, ",", |_, x| format!("{x:e}").replace('e', "D")).into()),
        ("units in cells", table(&head, ",", |k, x| format!("{x} {}", ["A", "A", "A", "m"][k])).into()),
        ("units in heads", table(&NAMES.map(|name| unit(name, " [", "]")).join(","), ",", milli).into()),
        ("units in round brackets", table(&NAMES.map(|name| unit(name, " (", ")")).join(","), ",", milli).into()),
        ("units in heads between blanks", table(&NAMES.map(|name| unit(name, " [", "]")).join(" "), " ", milli).into()),
        ("units in heads, decimal commas", {
            table(&NAMES.map(|name| unit(name, " [", "]")).join(";"), ";", |k, x| milli(k, x).replace('.', ",")).into()
        }),
        ("a column without a name", {
            let rows = csv.lines().enumerate().map(|(k, line)| match k {
                0 => format!(",{line}\n"),
                k => format!("{},{line}\n", k - 1),
            });
            rows.collect::<String>().into()
        }),
    ];
    for (layout, bytes) in layouts {
        fs::write(folder.path().join("inputs.csv"), bytes).unwrap();
        let spec = sweep(folder.path(), "inputs.csv", "").unwrap_or_else(|error| panic!("{layout}: {error}"));
        expect_rows(&spec, layout);
    }
}

/// A head in thousandths.
fn unit(name: &str, open: &str, close: &str) -> String {
    let unit = if name == "insertion" { "mm" } else { "mA" };
    format!("{name}{open}{unit}{close}")
}

#[test]
fn other_columns_are_ignored_where_the_sweep_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let dakota = {
        let rows = ROWS.iter().enumerate().map(|(k, row)| {
            let cells: Vec<String> = row.iter().map(|value| format!("{value:.10e}")).collect();
            format!("{:<9}NO_ID {} 0.0\n", k + 1, cells.join(" "))
        });
        format!("%eval_id interface {} tip_x\n{}", NAMES.join(" "), rows.collect::<String>())
    };
    let notes = "run,coil.current.x,coil.current.y,coil.current.z,insertion,note\n1,0.122,0.1232,0.0061,0.09109,ok\n\
                 2,-0.0857,-0.1784,-0.0467,0.08555,\n3,-0.0366,-0.1819,-0.1805,0.09,as before\n";
    for (text, ignored) in
        [(dakota.as_str(), ["`eval_id`", "`interface`", "`tip_x`"].as_slice()), (notes, &["`run`", "`note`"])]
    {
        fs::write(folder.path().join("inputs.dat"), text).unwrap();
        let error = sweep(folder.path(), "inputs.dat", "").unwrap_err();
        assert!(error.contains("extra_columns = \"ignore\""), "{error}");
        let spec = sweep(folder.path(), "inputs.dat", "extra_columns = \"ignore\"\n").unwrap();
        expect_rows(&spec, ignored[0]);
        let told = format!("inputs.dat that are ignored: {}", ignored.join(", "));
        assert!(spec.notes.iter().any(|note| note.ends_with(&told)), "{:?}", spec.notes);
    }
    let grid = "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"grid\"\nextra_columns = \"ignore\"\n[[axis]]\n\
                parameter = \"insertion\"\nfrom = 0.07\nto = 0.08\npoints = 2\n";
    let error = SweepSpec::parse(&shipped().join("s.toml"), grid).unwrap_err();
    assert_eq!((error.line, error.key.as_str()), (Some(4), "sampling.extra_columns"), "{error}");
}

#[test]
fn a_missing_value_is_a_row_without_a_rod() {
    let folder = tempfile::tempdir().unwrap();
    for gap in ["", "nan", "NA"] {
        let text = format!("coil.current.x,insertion\n0.1,0.09\n{gap},0.09\n0.2,0.08\n0.1,{gap}\n");
        fs::write(folder.path().join("inputs.csv"), text).unwrap();
        let spec = sweep(folder.path(), "inputs.csv", "[output]\nformat = \"csv\"\n").unwrap();
        assert!(spec.notes.iter().any(|note| note.contains("2 of 4 rows") && note.contains("lack a value")));
        let mut rows = Memory::new();
        SweepJob::new(spec).run(&mut rows).unwrap();
        let table = rows.into_table();
        let statuses = table.statuses();
        assert!(statuses[0].is_success() && statuses[2].is_success(), "{statuses:?}");
        assert_eq!((statuses[1], statuses[3]), (Status::BadParameter, Status::BadParameter));
    }
}

#[test]
fn mistakes_in_layouts_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (text, words) in [
        ("0.1,0.09\n0.2,0.08\n", "no line names the columns: write their names above, such as coil.current.x"),
        ("# made by hand\n0.1,0.09\n", "no line names the columns"),
        ("coil.current.x;insertion\n0,1;0.09\n", "decimal"),
        ("coil.current.x [mT]\n1\n", "is a flux density"),
        ("coil.current.x [bananas]\n1\n", "bananas"),
        ("coil.current.x insertion\n1 2 3\n", "has 3 columns where the first line has 2"),
    ] {
        fs::write(folder.path().join("inputs.csv"), text).unwrap();
        let error = sweep(folder.path(), "inputs.csv", "").unwrap_err();
        assert!(error.contains(words) && error.contains("inputs.csv"), "{error}");
    }
    fs::write(folder.path().join("inputs.csv"), b"\xff\xfea").unwrap();
    assert!(sweep(folder.path(), "inputs.csv", "").unwrap_err().contains("UTF-16"));
}
