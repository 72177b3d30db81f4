//! `import`: every public parameter set comes out as known, play files become tables, mistakes are named.

use crate::common::root;
use crate::sandbox::{Output, Sandbox};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::input::{Import, ImportOptions, import, parse_scene, read_scene};
use rodsweep::model::{
    CoilWinding, Density, Flexible, Plan, PlanOptions, Profile, Scene, SegmentKind, ShearElasticity, Stiffness, Vector,
};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// The nearest double of a decimal against one that was scaled after reading, and numbers rounded to 15 digits.
const DIGITS: f64 = 2e-14;
/// The files of the baselines have twelve digits of rest curvatures that are known to sixteen.
const CURVATURE_DIGITS: f64 = 1e-12;

fn data(name: &str) -> PathBuf {
    root().join("tests/data/import").join(name)
}

fn text(name: &str) -> String {
    fs::read_to_string(data(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn imported(name: &str) -> Import {
    import(&data(name), &ImportOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn scene(name: &str) -> Scene {
    parse_scene(Path::new(name), &imported(name).text).unwrap_or_else(|error| panic!("{error}"))
}

fn close(found: f64, expected: f64, size: f64, what: &str) {
    assert!((found - expected).abs() <= DIGITS * expected.abs().max(size), "{what}: {found:e}, not {expected:e}");
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
}

/// Sets that a scene can be made of and solved: a zero-length coil with a mass is a point, and one has no rod.
fn solvable() -> Vec<Value> {
    let all: Value = serde_json::from_str(&text("parameter_sets.json")).expect("JSON");
    let all = all["sets"].as_array().expect("a list").clone();
    assert_eq!(all.len(), 12);
    all.into_iter().filter(|set| set["name"] != "baseline_A").collect()
}

#[test]
fn every_parameter_set_comes_out_in_si() {
    for set in solvable() {
        let name = set["name"].as_str().unwrap();
        let scene = scene(&format!("{name}.txt"));
        assert_eq!(scene.name, name);
        assert_eq!((scene.flux_density, scene.loads.gravity), ([0.0, 3.0, 0.0], Some([0.0, 0.0, 9.81])));
        assert_eq!((scene.base.position, scene.base.rotation), ([0.0; 3], [0.0; 3]));
        assert!(scene.rigid_force_arm && scene.loads.fluid_density.is_none());
        let lengths = numbers(&set["segment_lengths_m"]);
        let densities = numbers(&set["linear_density_kg_per_m"]);
        assert_eq!(scene.segments.len(), lengths.len(), "{name}");
        let (mut flexible, mut actuator) = (0, 0);
        for (index, segment) in scene.segments.iter().enumerate() {
            let what = format!("{name}, {}", segment.name);
            close(segment.length, lengths[index], 0.0, &what);
            match &segment.kind {
                SegmentKind::Flexible(tube) => {
                    assert_eq!(set["segment_types"][index], "F", "{what}");
                    check_tube(tube, &set, flexible, densities[index], &what);
                    flexible += 1;
                }
                SegmentKind::Rigid(rigid) => {
                    assert_eq!(set["segment_types"][index], "A", "{what}");
                    let expected = &set["actuators"][actuator];
                    let mass = expected["mass_kg"].as_f64().unwrap() + densities[index] * lengths[index];
                    close(rigid.mass.expect("a mass"), mass, 0.0, &what);
                    let coil = rigid.coil.expect("a coil");
                    assert_eq!((coil.current, coil.alignment), ([0.0; 3], [0.0; 3]));
                    let CoilWinding::Matrix(rows) = coil.winding else { panic!("{what}: no matrix") };
                    check_winding(&rows, expected, &what);
                    actuator += 1;
                }
            }
        }
    }
}

fn check_tube(tube: &Flexible, set: &Value, index: usize, density: f64, what: &str) {
    let number = |key: &str| set[key][index].as_f64().unwrap();
    let Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear: ShearElasticity::Modulus(shear) } =
        tube.stiffness
    else {
        panic!("{what}: no tube with moduli")
    };
    close(inner_radius, number("inner_radius_m"), 0.0, what);
    close(outer_radius, number("outer_radius_m"), 0.0, what);
    close(youngs_modulus, number("youngs_modulus_Pa"), 0.0, what);
    close(shear, number("shear_modulus_Pa"), 0.0, what);
    let Profile::Constant(rest_curvature) = tube.rest_curvature else { panic!("{what}: nodes") };
    for (found, expected) in rest_curvature.iter().zip(numbers(&set["u_star_per_m"][index])) {
        assert!((found - expected).abs() <= CURVATURE_DIGITS * expected.abs(), "{what}: {found:e}, not {expected:e}");
    }
    let Some(Density::Linear(found)) = tube.density else { panic!("{what}: no linear density") };
    close(found, density, 0.0, what);
}

/// Columns turned by the alignment of the side coils: the product written out.
fn check_winding(rows: &[Vector; 3], expected: &Value, what: &str) {
    let source = numbers(&expected["NA_m2_rowmajor"]);
    let angles = numbers(&expected["alignment_angles_rad"]);
    let alignment =
        [[angles[0].cos(), -angles[1].sin(), 0.0], [angles[0].sin(), angles[1].cos(), 0.0], [0.0, 0.0, 1.0]];
    let size = source.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    for (row, found) in rows.iter().enumerate() {
        for (col, found) in found.iter().enumerate() {
            let product = (0..3).map(|k| alignment[row][k] * source[3 * k + col]).sum();
            close(*found, product, size, what);
        }
    }
}

#[test]
fn the_two_coil_set_is_the_shipped_scene() {
    let root = root();
    let (found, shipped) = (scene("set_2.txt"), read_scene(&root.join("sweeps/scenes/two_coil.toml")).unwrap());
    let names: Vec<&str> = found.segments.iter().map(|segment| segment.name.as_str()).collect();
    assert_eq!(names, ["segment_1", "coil_1", "segment_2", "coil_2", "segment_3"]);
    for (found, shipped) in found.segments.iter().zip(&shipped.segments) {
        assert_eq!(found.length, shipped.length);
        match (&found.kind, &shipped.kind) {
            (SegmentKind::Rigid(a), SegmentKind::Rigid(b)) => {
                assert_eq!(a.mass, b.mass);
                assert_eq!(a.coil.unwrap().dipole_per_ampere(), b.coil.unwrap().dipole_per_ampere());
            }
            (a, b) => assert_eq!(a, b),
        }
    }
}

#[test]
fn imported_scenes_have_an_equilibrium() {
    for set in solvable() {
        let name = set["name"].as_str().unwrap();
        let plan = Plan::single(&scene(&format!("{name}.txt")), &[], PlanOptions::default()).unwrap();
        let solutions = Cpu::new(&plan, Precision::F64).unwrap().solve(&plan.batch(1, |_, _| {})).unwrap();
        assert!(solutions.status(0).is_success(), "{name}: {:?}", solutions.status(0));
    }
}

#[test]
fn what_the_file_does_not_say_is_marked() {
    let text = imported("set_1.txt").text;
    for line in ["position = ", "rotation = ", "flux_density = ", "gravity = ", "# insertion = \"97.95 mm\""] {
        let line = text.lines().find(|found| found.starts_with(line)).unwrap_or_else(|| panic!("{line}: {text}"));
        assert!(line.contains("# not stated"), "{line}");
    }
    assert!(
        text.contains("rest_curvature = [\"0.0007399849479553773 1/mm\", \"-0.0002292201697658481 1/mm\""),
        "{text}"
    );
    assert!(text.contains("# ActMass 5.7736e-5 kg + rho 2.8814e-7 kg/mm x 18.3 mm of tube"), "{text}");
    assert!(text.contains("# false reproduces the published code"), "{text}");
}

#[test]
fn notes_say_what_is_left_out_or_unusual() {
    let notes = |name: &str| imported(name).notes.join("\n");
    let plain = notes("set_1.txt");
    assert!(plain.contains("states neither field, gravity nor base pose"), "{plain}");
    assert!(plain.contains("not used, kept as comments: NumLocalizationMarkers, MarkerLoc"), "{plain}");
    assert!(!plain.contains("Poisson"), "{plain}");
    let damped = notes("set_1_damped.txt");
    assert!(damped.contains("NumLocalizationMarkers, ActDamping, MarkerLoc"), "{damped}");
    assert!(damped.contains("`proximal`: YoungModlist and ShearModlist imply a Poisson ratio of 1.34"), "{damped}");
    let text = imported("set_1_damped.txt").text;
    assert!(text.contains("# ActDamping 12.1761626666366 12.1761626666366 284.429938756989 0.0304"), "{text}");
    let fitted = imported("P11.P35.1.a_fit.txt").text;
    assert!(fitted.contains("# The file says: prototype 11.P35.1.a\n"), "{fitted}");
    assert!(fitted.contains("# a, b = -3.6869, -3.1412 rad (CoilAlignmentAngles)"), "{fitted}");
}

#[test]
fn a_coil_of_no_length_keeps_its_mass() {
    let text = imported("baseline_AF0.txt").text;
    let coil = text.split("[[segment]]").nth(2).expect("two segments");
    assert!(coil.contains("name = \"coil\"") && coil.contains("length = \"0 mm\""), "{coil}");
    assert!(coil.contains("mass = \"8.2859 mg\""), "{coil}");
}

#[test]
fn rigid_segments_and_other_orders_get_names() {
    let sandbox = Sandbox::new();
    let file = "CatheterConfig A R F\noRlist 1\niRlist 0\nYoungModlist 5\nShearModlist 2\nSegmentLengths 10 20 30\n\
        rho 1e-7 2e-7 3e-7 # tip to base\nActMass 0\nCoilTurnAreaMat 1 0 0 0 1 0 0 0 1\nCoilAlignmentAngles 0 0\n\
        ustarlist 0 0 0\n";
    // As some editors on Windows write it.
    sandbox.write("odd.txt", &format!("\u{feff}{}", file.replace('\n', "\r\n")));
    sandbox.ok(&["import", "odd.txt"]);
    let scene = read_scene(&sandbox.path("odd.toml")).unwrap();
    let found: Vec<(&str, f64)> = scene.segments.iter().map(|s| (s.name.as_str(), s.length)).collect();
    assert_eq!(found, [("segment_1", 0.03), ("rigid_1", 0.02), ("coil", 0.01)]);
    let SegmentKind::Rigid(rigid) = &scene.segments[1].kind else { panic!("not rigid") };
    assert_eq!((rigid.mass, rigid.coil), (Some(4e-6), None));
}

fn with_spatial(spatial: &str) -> Output {
    let sandbox = Sandbox::new();
    sandbox.write("set.txt", &text("set_1.txt"));
    sandbox.write("space.txt", spatial);
    let mut output = sandbox.run(&["import", "set.txt", "--spatial", "space.txt"]);
    output.stdout += &fs::read_to_string(sandbox.path("set.toml")).unwrap_or_default();
    output
}

#[test]
fn spatial_configurations() {
    let output = with_spatial(&text("spatial.txt"));
    assert!(!output.stderr.contains("states neither"), "{}", output.stderr);
    assert!(!output.stdout.contains("not stated by the file"), "{}", output.stdout);
    let scene = parse_scene(Path::new("set.toml"), &output.stdout).unwrap();
    assert_eq!((scene.flux_density, scene.loads.gravity), ([0.0, 3.0, 0.0], Some([0.0; 3])));
    let turned = "# turned by 90 degrees about x\np0 1 2 -3\nR0 1 0 0 0 0 -1 0 1 0\nB0 0 0 1.5\ngravity 0 -9.81 0\n";
    let scene = parse_scene(Path::new("set.toml"), &with_spatial(turned).stdout).unwrap();
    assert_eq!(scene.base.position, [1e-3, 2e-3, -3e-3]);
    close(scene.base.rotation[0], std::f64::consts::FRAC_PI_2, 0.0, "rotation");
    assert_eq!((scene.base.rotation[1], scene.base.rotation[2]), (0.0, 0.0));
    assert_eq!((scene.flux_density, scene.loads.gravity), ([0.0, 0.0, 1.5], Some([0.0, -9.81, 0.0])));
    for (from, to, line, words) in [
        ("R0 1 0 0 0 0 -1 0 1 0", "R0 1 0 0 0 1 0 0 0 -1", ":3: `R0`:", "is no rotation"),
        ("R0 1 0 0 0 0 -1 0 1 0", "R0 1 0 0 0 0 -1 0 1", ":3: `R0`:", "is a list of 8; give 9 numbers"),
        ("p0 1 2 -3\n", "", ": `p0`:", "add a line `p0` with 3 numbers [mm]"),
        ("B0 ", "b0 ", ":4: `b0`:", "did you mean `B0`?"),
        ("gravity 0 -9.81", "gravity 0 down", ":5: `gravity`:", "\"down\"; give a number [m/s^2]"),
    ] {
        let output = with_spatial(&turned.replace(from, to));
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{to}");
        assert!(output.stderr.starts_with(&format!("error: space.txt{line}")), "{}", output.stderr);
        assert!(output.stderr.contains(words), "{}", output.stderr);
    }
}

fn rows(text: &str) -> Vec<&str> {
    text.lines().filter(|line| !line.starts_with('#')).collect()
}

#[test]
fn play_files_become_tables() {
    let circle = imported("circle.play");
    let expected = [
        "coil.current.x,coil.current.y,coil.current.z",
        "0.0,0.0,0.0",
        "0.0,0.0,0.2",
        "-0.085207,-0.022261,0.20324",
        "-0.086227,-0.02245,0.20258",
        "-0.087174,-0.020426,0.2012",
    ];
    assert_eq!(rows(&circle.text), expected);
    assert_eq!(circle.text.matches("# each held").count(), 3, "{}", circle.text);
    let notes = circle.notes.join("\n");
    assert!(notes.contains("first 2 rows have no current in the side coils"), "{notes}");
    assert!(notes.contains("--negate-axial"), "{notes}");
    // A channel keeps its current; channel 0 sets all.
    let kept = ["0.0,0.0,0.0", "0.15,0.0,0.0", "0.15,-0.15,0.0", "0.0,-0.15,0.0", "0.0,0.0,0.0"];
    assert_eq!(rows(&imported("one_by_one.play").text)[1..], kept);
    let six = imported("six_channels.play");
    let head = "coil_1.current.x,coil_1.current.y,coil_1.current.z,coil_2.current.x,coil_2.current.y,coil_2.current.z";
    assert_eq!(rows(&six.text), [head, "-0.2,0.0,0.0,0.0,0.0,0.0", "-0.1,0.1,0.05,0.05,0.01,0.02"]);
    assert!(six.notes.join("\n").contains("does not say which is nearer the base"));
    let options = ImportOptions { coils: vec!["b".into(), "a".into()], negate_axial: true, spatial: None };
    let other = import(&data("six_channels.play"), &options).unwrap();
    assert!(rows(&other.text)[0].starts_with("b.current.x") && rows(&other.text)[0].ends_with("a.current.z"));
    assert_eq!(rows(&other.text)[2], "-0.1,0.1,-0.05,0.05,0.01,-0.02");
    assert!(other.notes.is_empty(), "{:?}", other.notes);
}

#[test]
fn an_imported_scene_is_swept_by_an_imported_table() {
    let sandbox = Sandbox::new();
    let scene = sandbox.ok(&["import", data("set_1.txt").to_str().unwrap()]);
    assert_eq!(scene.stdout, "");
    assert!(scene.stderr.starts_with("wrote set_1.toml: 97.95 mm, 1 coil set; base to tip: proximal, coil, distal\n"));
    assert!(scene.stderr.ends_with("go on with: rodsweep solve set_1.toml\n"), "{}", scene.stderr);
    sandbox.ok(&["solve", "set_1.toml"]);
    let table = sandbox.ok(&["import", data("circle.play").to_str().unwrap(), "--negate-axial", "--out", "lap.csv"]);
    assert!(table.stderr.starts_with("wrote lap.csv: 5 rows: currents of coil [A]\n"), "{}", table.stderr);
    assert!(table.stderr.ends_with("method = \"table\", file = \"lap.csv\"\n"), "{}", table.stderr);
    let sweep =
        "scene = \"set_1.toml\"\n[sampling]\nmethod = \"table\"\nfile = \"lap.csv\"\n[output]\nformat = \"csv\"\n";
    sandbox.write("lap.toml", sweep);
    sandbox.ok(&["run", "lap.toml", "--backend", "cpu", "--no-figures", "--max-failures", "0", "--out", "out"]);
    let part = fs::read_to_string(sandbox.path("out/part-0000000000.csv")).unwrap();
    assert!(part.contains("-0.085207,-0.022261,-0.20324"), "{part}");
}

/// What to replace in `set_1.txt` by what; place and words of the message.
type Mistake = (&'static str, &'static str, &'static str, &'static str);

#[rustfmt::skip]
const PARAMETERS: &[Mistake] = &[
    ("oRlist", "oRlst", ":3: `oRlst`:", "is not a key here: did you mean `oRlist`?"),
    ("oRlist 1.5875 1.5875", "oRlist 1.5875", ":3: `oRlist`:", "is a list of 1; give 2 numbers [mm], one for each flexible segment (F) of F A F"),
    ("ustarlist 0.0000148626102272827", "ustarlist", ":13: `ustarlist`:", "is a list of 5; give 6 numbers [1/mm], three for each"),
    ("CoilTurnAreaMat 1.3851", "CoilTurnAreaMat", ":8: `CoilTurnAreaMat`:", "give 9 numbers [1000 mm^2], nine, row by row, for each actuator (A)"),
    ("CoilAlignmentAngles 0.0 0.0", "CoilAlignmentAngles 0.0 0.0 0.0", ":7: `CoilAlignmentAngles`:", "is a list of 3; give 2 numbers [rad], two for each"),
    ("rho 2.8814e-7", "rho", ":12: `rho`:", "one for each segment of F A F"),
    ("CatheterConfig F A F", "CatheterConfig F A F A F", ":3: `oRlist`:", "is a list of 2; give 3 numbers"),
    ("YoungModlist 5.3948", "YoungModlist 5,3948", ":5: `YoungModlist`:", "is \"5,3948\"; give a number [MPa]"),
    ("YoungModlist 5.3948", "YoungModlist -5.3948", ":5: `YoungModlist`:", "give a number [MPa], greater than zero"),
    ("SegmentLengths 19.85", "SegmentLengths -19.85", ":9: `SegmentLengths`:", "give a number [mm], not negative"),
    ("ActMass 5.7736e-5", "ActMass nan", ":10: `ActMass`:", "is \"nan\"; give a number [kg]"),
    ("ActMass 5.7736e-5", "ActMass 1e999", ":10: `ActMass`:", "is \"1e999\"; give a number [kg]"),
    ("ActMass 5.7736e-5", "ActMass 1e70", ":10: `ActMass`:", "is \"1e70\"; give a number [kg] of at most 1e60 in size"),
    ("YoungModlist 5.3948", "YoungModlist 1e58", ": makes no scene: `segment[", "is too large; give a pressure or modulus of at most 1e60 in size"),
    ("iRlist 0.9906", "iRlist 1.9906", ":4: `iRlist`:", "is 1.9906; give a number [mm] below oRlist of the segment, 1.5875"),
    ("ShearModlist 2.3881 2.3881 \n", "", ": `ShearModlist`:", "is missing: add a line `ShearModlist` with 2 numbers [MPa]"),
    ("CatheterConfig F A F\n", "", ": `CatheterConfig`:", "is missing: add a line `CatheterConfig` with a letter for each segment"),
    ("CatheterConfig F A F", "CatheterConfig F B F", ":1: `CatheterConfig`:", "\"B\" is not known; use one of: F (flexible)"),
    ("CatheterConfig F A F", "CatheterConfig", ":1: `CatheterConfig`:", "such as F A F"),
    ("MarkerLoc", "rho 1 2 3\nMarkerLoc", ":13: `rho`:", "cannot stand beside `line 11`; keep one of the two"),
];

#[rustfmt::skip]
const PLAYS: &[Mistake] = &[
    ("2,0,0", "7,0,0", ":2: `channel`:", "is \"7\"; give 1 to 6, or 0 for all of them"),
    ("2,0,0", "2.5,0,0", ":2: `channel`:", "is \"2.5\""),
    ("2,0,0", "2,0", ":2:", "is a list of 2; give three values: channel, mA, ms"),
    ("2,0,0", "2,0,0,0", ":2:", "is a list of 4"),
    ("2,0,0", "2,much,0", ":2: `current`:", "is \"much\"; give a number [mA]"),
    ("3,200,3000", "3,200 mA,3000", ":6: `current`:", "is \"200 mA\"; give a number [mA]"),
    ("3,200,3000", "3,1e70,3000", ":6: `current`:", "is \"1e70\"; give a number [mA] of at most 1e60 in size"),
    ("3,200,3000", "3,200,-3000", ":6: `dwell`:", "give a number [ms], not negative"),
];

/// Exit code 2 and one line that starts with the place; nothing is written.
fn refused(sandbox: &Sandbox, file: &str, more: &[&str], place: &str, words: &str) {
    let output = sandbox.run(&[&["import", file], more].concat());
    assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{}", output.stderr);
    assert_eq!(output.stderr.lines().count(), 1, "{}", output.stderr);
    assert!(output.stderr.starts_with(&format!("error: {place}")), "{place}: {}", output.stderr);
    assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    assert_eq!(fs::read_dir(sandbox.path(".")).unwrap().count(), 3, "{place}");
}

#[test]
fn mistakes_are_named() {
    let sandbox = Sandbox::new();
    for (name, mistakes) in [("set_1.txt", PARAMETERS), ("circle.play", PLAYS)] {
        for (from, to, place, words) in mistakes {
            let source = text(name);
            assert!(source.contains(from), "{from}");
            sandbox.write("file", &source.replacen(from, to, 1));
            refused(&sandbox, "file", &[], &format!("file{place}"), words);
        }
    }
    sandbox.write("file", "1,0,0\n2,0,0\n");
    refused(&sandbox, "file", &[], "file: `dwell`:", "is above zero");
    sandbox.write("file", &text("circle.play"));
    refused(&sandbox, "file", &["--coil", "a,b"], "file: `--coil`:", "is a list of 2; give one");
    refused(&sandbox, "file", &["--spatial", "space.txt"], "`--spatial` is for parameter files", "leave it out");
    sandbox.write("file", &text("baseline_A.txt"));
    refused(&sandbox, "file", &[], "file:1: `CatheterConfig`:", "a rod needs at least one flexible segment");
    sandbox.write("file", &text("spatial.txt"));
    refused(&sandbox, "file", &[], "file:", "give this one as `--spatial FILE`");
    for other in ["", "\n# nothing\n", "Dear all,\nhello, hello\n", "x,y,z\n1,2,3\n"] {
        sandbox.write("file", other);
        refused(&sandbox, "file", &[], "file:", "neither a parameter file (lines such as `CatheterConfig F A F`)");
    }
    refused(&sandbox, "scene.toml", &[], "scene.toml:", "neither a parameter file");
    refused(&sandbox, "none.txt", &[], "none.txt:", "cannot be read");
    fs::write(sandbox.path("file"), [0xff, 0xfe, 0x00]).unwrap();
    refused(&sandbox, "file", &[], "file:", "it is not UTF-8 text");
    sandbox.write("file", &text("set_1.txt"));
    refused(&sandbox, "file", &["--spatial", "none.txt"], "none.txt:", "cannot be read");
    refused(&sandbox, "file", &["--coil", "coil"], "`--coil` is for play files", "leave it out");
    refused(&sandbox, "file", &["--negate-axial"], "`--negate-axial` is for play files", "leave it out");
    refused(&sandbox, "file", &["--out", "scene.toml"], "scene.toml is already there", "`--force`");
    refused(&sandbox, "file", &["--out", "./file", "--force"], "./file is the file to import", "`--out`");
    assert_eq!(fs::read_to_string(sandbox.path("file")).unwrap(), text("set_1.txt"));
    sandbox.ok(&["import", "file", "--out", "scene.toml", "--force"]);
    assert_eq!(read_scene(&sandbox.path("scene.toml")).unwrap().name, "file");
    let output = sandbox.run(&["import", "file", "--out", "none/scene.toml"]);
    assert_eq!((output.code, output.errors().len()), (1, 1), "{}", output.stderr);
}

#[test]
fn lines_without_dwell_time_at_the_end_are_no_state() {
    let sandbox = Sandbox::new();
    sandbox.write("end.play", "1, 100, 0 # side\n3, 200, 50\n1, 0, 0\n2, 0, 0\n");
    let output = sandbox.ok(&["import", "end.play"]);
    assert!(
        output.stderr.contains("note: the last 2 lines have no dwell time: no state, left out"),
        "{}",
        output.stderr
    );
    assert_eq!(rows(&fs::read_to_string(sandbox.path("end.csv")).unwrap())[1..], ["0.1,0.0,0.2"]);
}
