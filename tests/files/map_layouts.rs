//! Sampled fields as other programs write them: one field in many layouts, what is supposed, and what is refused.

use crate::common::root;
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::input::{InputError, parse_scene, scene_notes};
use rodsweep::model::{Scene, Status, Vector};
use rodsweep::study::Solve;
use std::path::Path;
use tempfile::TempDir;

const ROD: &str = r#"
[[segment]]
name = "wire"
kind = "flexible"
length = "60 mm"
stiffness = { bending = "2e-5 N·m²", torsion = "1.5e-5 N·m²" }
[[segment]]
name = "tip"
kind = "rigid"
length = "6 mm"
dipole_per_length = [0, 0, "5 A·m"]
"#;

fn read_in(folder: &Path, file: &str, more: &str) -> Result<Scene, InputError> {
    let text = format!("[[field_map]]\nname = \"scan\"\nfile = \"{file}\"\n{more}\n{ROD}");
    parse_scene(&folder.join("scene.toml"), &text)
}

fn shipped(file: &str, more: &str) -> Scene {
    let folder = root().join("tests/data/reports/field_maps");
    read_in(&folder, file, more).unwrap_or_else(|error| panic!("{error}"))
}

/// The largest difference of two fields inside of the grid, over the largest field.
fn difference(one: &Scene, other: &Scene) -> f64 {
    let (one, other) = (one.rod().field.expect("a field"), other.rod().field.expect("a field"));
    let (mut most, mut largest) = (0.0_f64, 0.0_f64);
    for k in 0..60 {
        let share = |by: f64| (0.5 + f64::from(k) * by).fract();
        let at = [-0.03 + 0.04 * share(0.618), -0.03 + 0.06 * share(0.755), -0.01 + 0.09 * share(0.57)];
        let (a, b): (Vector, Vector) = (one.flux_density(at), other.flux_density(at));
        (0..3).for_each(|k| (most, largest) = (most.max((a[k] - b[k]).abs()), largest.max(a[k].abs())));
    }
    most / largest
}

const MILLIMETRES: &str = "length_unit = \"mm\"";

/// Files of one field and what the scene has to say of them.
const LAYOUTS: [(&str, &str); 20] = [
    ("comsol.txt", ""),
    ("comsol.txt", MILLIMETRES),
    ("comsol.csv", MILLIMETRES),
    ("comsol_headless.csv", MILLIMETRES),
    ("topas.csv", ""),
    ("gauss.csv", ""),
    ("paren.csv", ""),
    ("norm.csv", MILLIMETRES),
    ("pandas_index.csv", MILLIMETRES),
    ("excel_de.csv", MILLIMETRES),
    ("tabs.csv", MILLIMETRES),
    ("headerless.csv", MILLIMETRES),
    ("hash.csv", "length_unit = \"mm\"\nfield_unit = \"mT\""),
    ("magpylib.npz", ""),
    ("flat.npz", ""),
    ("axes.npz", ""),
    ("axes_c3.npz", ""),
    ("map.mat", MILLIMETRES),
    ("rounded.csv", MILLIMETRES),
    ("jitter.csv", MILLIMETRES),
];

#[test]
fn one_field_in_many_layouts() {
    let plain = shipped("bom_crlf.csv", MILLIMETRES);
    for (file, more) in LAYOUTS {
        // Five digits of B; and 0.02 mm of 20 mm, of which the second order is left.
        let tolerance = match file {
            "rounded.csv" => 3e-4,
            "jitter.csv" => 2e-3,
            _ => 1e-9,
        };
        let off = difference(&plain, &shipped(file, more));
        assert!(off < tolerance, "{file}: {off:e}");
    }
}

#[test]
fn what_was_supposed_is_said() {
    let note = |file: &str| scene_notes(&shipped(file, MILLIMETRES)).join("\n");
    assert!(note("headerless.csv").contains("no line names the columns, which are taken as x, y, z, Bx, By, Bz"));
    let jitter = note("jitter.csv");
    assert!(jitter.contains("points miss an even grid by up to") && jitter.contains("B is corrected"), "{jitter}");
    assert!(note("nan.csv").contains("1 of 64 nodes have no value"));
    assert!(!note("bom_crlf.csv").contains("taken as"));
}

#[test]
fn nodes_without_a_value_close_the_cells_beside_them() {
    // A value is missing at (30, -10, 20) mm.
    let scene = shipped("nan.csv", MILLIMETRES);
    let map = &scene.sources.maps[0];
    assert!(map.grid.has_gaps());
    let is_closed = |x: f64, y: f64, z: f64| map.grid.is_gap([1e-3 * x, 1e-3 * y, 1e-3 * z]);
    assert!(is_closed(29.0, -9.0, 21.0) && is_closed(11.0, -29.0, -9.0) && is_closed(11.0, 9.0, 49.0));
    assert!(!is_closed(9.0, -10.0, 20.0) && !is_closed(29.0, 11.0, 20.0) && !is_closed(29.0, -9.0, 51.0));
    let engine = EngineRequest::of(BackendKind::Cpu).choose_for(&scene, 1e-6).expect("an engine");
    assert_eq!(engine.kind(), BackendKind::Reference);
    // The rod stays away from it: the field of the other cells is that without the gap.
    let off = difference(&shipped("bom_crlf.csv", MILLIMETRES), &scene);
    assert!(off < 0.05, "{off}");
    let away = Solve::new(scene.clone()).run().expect("a run");
    assert!(away.is_converged());
    let mut beside = scene;
    // The dipole at the tip begins its way in a closed cell.
    beside.base.position = [0.030, -0.010, -0.045];
    let solved = Solve::new(beside).run().expect("a run");
    assert_eq!(solved.status(), Status::OutsideMap);
}

#[test]
fn a_bore_keeps_its_field() {
    // A dipole 90 mm away, on a grid of 5 mm; without values outside of a bore.
    let moment = [0.0, 0.0, 30.0];
    let field = |at: [f64; 3]| -> [f64; 3] {
        let r = [at[0] - 0.09, at[1], at[2] - 0.02];
        let size = r.iter().map(|r| r * r).sum::<f64>().sqrt();
        let along: f64 = (0..3).map(|k| r[k] * moment[k]).sum();
        std::array::from_fn(|k| 1e-7 * (3.0 * r[k] * along / size.powi(5) - moment[k] / size.powi(3)))
    };
    let folder = TempDir::new().expect("a folder");
    let read = |name: &str, radius: f64| {
        let mut text = String::from("x,y,z,Bx,By,Bz\n");
        for node in 0..13 * 13 * 19 {
            let step = |k: i32, from: f64| from + 0.005 * f64::from(k);
            let at = [step(node % 13, -0.03), step(node / 13 % 13, -0.03), step(node / 169, -0.01)];
            let [x, y, z] = field(at).map(|b| if at[0].hypot(at[1]) > radius { f64::NAN } else { b });
            text += &format!("{},{},{},{x},{y},{z}\n", at[0], at[1], at[2]);
        }
        std::fs::write(folder.path().join(name), text).expect("a file");
        read_in(folder.path(), name, "").unwrap_or_else(|error| panic!("{error}"))
    };
    let tip = |scene: &Scene| Solve::new(scene.clone()).run().expect("a run").tip_position();
    let whole = tip(&read("whole.csv", 1.0));
    // The share of the deflection, which is 7.5 mm.
    for (radius, share) in [(0.0255, 1e-3), (0.0205, 3e-3)] {
        let bored = tip(&read("bore.csv", radius));
        let off = (0..3).map(|k| (bored[k] - whole[k]).abs()).fold(0.0, f64::max);
        assert!(off < share * 7.5e-3, "{radius}: {off:e}");
    }
}

#[test]
fn what_is_refused_is_named() {
    let refused = |file: &str, more: &str| {
        let folder = root().join("tests/data/reports/field_maps");
        read_in(&folder, file, more).expect_err(file).to_string()
    };
    let plane = refused("plane.csv", MILLIMETRES);
    assert!(plane.contains("one plane, y = -0.01 m") && plane.contains("at least 4 planes"), "{plane}");
    let other = refused("comsol.txt", "length_unit = \"cm\"");
    assert!(other.contains("Length unit: mm") && other.contains("length_unit = \"cm\""), "{other}");
    let folder = TempDir::new().expect("a folder");
    let wrong = |text: &str| {
        std::fs::write(folder.path().join("a.csv"), text).expect("a file");
        read_in(folder.path(), "a.csv", "").expect_err(text).to_string()
    };
    let five = wrong("0,0,0,1,1\n1,0,0,1,1\n");
    assert!(five.contains("a.csv:1") && five.contains("no line names the columns"), "{five}");
    let missing = wrong("x,y,z,Hx,Hy,Hz\n0,0,0,1,1,1\n");
    assert!(missing.contains("`Bx`: is missing") && missing.contains("line 1 names `x`, `y`, `z`, `Hx`"), "{missing}");
    let twice = wrong("x,y,z,mf.Bx,mf2.Bx,By,Bz\n0,0,0,1,1,1,1\n");
    assert!(twice.contains("`mf2.Bx`") && twice.contains("`mf.Bx`") && twice.contains("rename"), "{twice}");
    std::fs::write(folder.path().join("hdf5.mat"), b"MATLAB 7.3 MAT-file, Platform: GLNXA64").expect("a file");
    let hdf5 = read_in(folder.path(), "hdf5.mat", "").expect_err("HDF5").to_string();
    assert!(hdf5.contains("HDF5") && hdf5.contains("-v7"), "{hdf5}");
    let matlab = |file: &str| read_in(&root().join("tests/data/matlab"), file, "").expect_err(file).to_string();
    let square = matlab("square.mat");
    assert!(square.contains("`Bx`") && square.contains("ndgrid") && square.contains("as many places"), "{square}");
    let complex = matlab("complex.mat");
    assert!(complex.contains("`Bx`") && complex.contains("complex numbers"), "{complex}");
    let no_place = wrong("x,y,z,Bx,By,Bz\nnan,0,0,1,1,1\n");
    assert!(no_place.contains("a.csv:2") && no_place.contains("is no place"), "{no_place}");
}

/// A linear field on 5 x 4 x 6 nodes as text: a head, how a number is written, what stands between.
fn table(head: &str, number: impl Fn(f64) -> String, between: &str, lengths: f64) -> String {
    let mut text = head.to_owned();
    for node in 0..120 {
        let [i, j, k] = [node % 5, node / 5 % 4, node / 20];
        let at = [-20.0 + 10.0 * f64::from(i), -15.0 + 10.0 * f64::from(j), 10.0 * f64::from(k)];
        let b = [0.3 * at[0] + 0.1 * at[2], -0.5 * at[1], 0.2 * at[2] + 0.1 * at[0]];
        let cells: Vec<String> = at.map(|x| number(lengths * x)).into_iter().chain(b.map(&number)).collect();
        text += &(cells.join(between) + "\n");
    }
    text
}

#[test]
fn heads_in_many_ways() {
    let folder = TempDir::new().expect("a folder");
    let read = |name: &str, text: String, more: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
        read_in(folder.path(), name, more).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let plain = |x: f64| format!("{x:?}");
    let both = "length_unit = \"mm\"\nfield_unit = \"mT\"";
    let first = read("a.csv", table("x,y,z,Bx,By,Bz\n", plain, ",", 1.0), both);
    let cases = [
        (
            "b.csv",
            table("X (mm);Y (mm);Z (mm);B_x (mT);B_y (mT);B_z (mT)\n", |x| plain(x).replace('.', ","), ";", 1.0),
            "",
        ),
        ("c.txt", table("# x y z Bx By Bz\n", plain, "  ", 1.0), both),
        ("d.dat", table("x_mm y_mm z_mm Bx_mT By_mT Bz_mT\n", plain, " ", 1.0), ""),
        ("e.tsv", table("x / cm\ty / cm\tz / cm\tbx / mT\tby / mT\tbz / mT\n", plain, "\t", 0.1), ""),
        ("f.csv", table("x(mm),y(mm),z(mm),Bx(mT),By(mT),Bz(mT)\n", plain, ",", 1.0), ""),
        (
            "g.csv",
            table(
                "% Model,a.mph\n% Length unit,mm\n% x,y,z,comp1.mf.Bx (mT),comp1.mf.By (mT),comp1.mf.Bz (mT)\n",
                plain,
                ",",
                1.0,
            ),
            "",
        ),
        ("h.txt", table("", plain, " ", 1.0), both),
    ];
    for (name, text, more) in cases {
        let off = difference(&first, &read(name, text, more));
        assert!(off < 1e-9, "{name}: {off:e}");
    }
    // Written by SciPy: arrays by axes in either order, deflated, and with the coordinates of each node, Bx in single precision.
    for (name, tolerance) in [("ndgrid.mat", 1e-9), ("meshgrid.mat", 1e-9), ("nodes.mat", 1e-6)] {
        let matlab = read_in(&root().join("tests/data/matlab"), name, both).unwrap_or_else(|error| panic!("{error}"));
        let off = difference(&first, &matlab);
        assert!(off < tolerance, "{name}: {off:e}");
    }
}
