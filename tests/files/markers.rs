//! Markers as trackers and spreadsheets write them: units, decimal commas, points that were not seen.

use crate::common::root;
use rodsweep::input::{InputError, read_scene, read_shapes_with};
use rodsweep::spec::{ObservedPoint, ObservedShapes};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn data(name: &str) -> PathBuf {
    root().join("tests/data/reports/markers").join(name)
}

fn read(file: &Path) -> Result<(ObservedShapes, Vec<String>), InputError> {
    let scene = read_scene(&data("tube.toml")).unwrap_or_else(|error| panic!("{error}"));
    let mut notes = Vec::new();
    read_shapes_with(file, &scene, &mut notes).map(|observed| (observed, notes))
}

fn points(file: &Path) -> (Vec<ObservedPoint>, Vec<String>) {
    let (observed, notes) = read(file).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(observed.shapes.len(), 1);
    (observed.shapes[0].points.clone(), notes)
}

#[test]
fn one_shape_in_many_layouts() {
    let (plain, notes) = points(&data("noisy_m.csv"));
    assert_eq!((plain.len(), notes.len()), (8, 0));
    for file in ["excel_de.csv", "units_header.csv", "units_cells.csv", "mocap_frame.csv"] {
        let (found, notes) = points(&data(file));
        assert_eq!((found.len(), notes.len()), (8, 0), "{file}");
        for (found, plain) in found.iter().zip(&plain) {
            let off = (found.arc_length.expect("s") - plain.arc_length.expect("s")).abs();
            let most = (0..3).map(|k| (found.position[k] - plain.position[k]).abs()).fold(off, f64::max);
            assert!(most < 1e-15, "{file}: {found:?} {plain:?}");
        }
    }
}

#[test]
fn points_that_were_not_seen_are_left_out() {
    let (plain, _) = points(&data("noisy_m.csv"));
    for file in ["occluded_empty.csv", "occluded_nan.csv"] {
        let (found, notes) = points(&data(file));
        assert_eq!(found, [&plain[..3], &plain[4..]].concat(), "{file}");
        assert!(notes.len() == 1 && notes[0].starts_with("1 of 8 points of "), "{notes:?}");
    }
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("a.csv");
    std::fs::write(&file, "s [mm];x [mm];y [mm];z [mm]\n22,5;21,4;-0,1;-6,2\n45,0;;;\n67,5;NaN;NaN;NaN\n")
        .expect("a file");
    let (found, notes) = points(&file);
    assert_eq!(found.len(), 1);
    assert!(notes[0].starts_with("2 of 3 points"), "{notes:?}");
    // One coordinate alone is missing by mistake.
    std::fs::write(&file, "s [mm];x [mm];y [mm];z [mm]\n22,5;21,4;-0,1;-6,2\n45,0;38,0;;-20,3\n").expect("a file");
    let error = read(&file).expect_err("no y").to_string();
    assert!(error.contains("`y`: is missing: row 1 has no y"), "{error}");
    std::fs::write(&file, "s,x,y,z\n0.01,,,\n0.02,nan,nan,nan\n").expect("a file");
    let error = read(&file).expect_err("no point").to_string();
    assert!(error.contains("no row has a place"), "{error}");
}

#[test]
fn forgotten_units_are_named() {
    let error = read(&data("forgot_mm.csv")).expect_err("22 m").to_string();
    assert!(error.contains("`s`: is 22.5 in row 0") && error.contains("`s [mm]`"), "{error}");
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("a.csv");
    std::fs::write(&file, "x,y,z\n21.4,-0.1,-6.2\n").expect("a file");
    let error = read(&file).expect_err("21 m").to_string();
    assert!(error.contains("`x`: is 21.4 m in row 0") && error.contains("`x [mm]`"), "{error}");
    std::fs::write(&file, "s,x,y,z,tracker\n0.01,0,0,0.01,3\n").expect("a file");
    let error = read(&file).expect_err("no parameter").to_string();
    assert!(error.contains("`tracker`"), "{error}");
}
