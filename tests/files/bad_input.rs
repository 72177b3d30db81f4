//! Broken input files: each gives one message that names the file, the line, the key and what to do.

use crate::common::texts::{SCENE, SWEEP};
use rodsweep::input::{InputError, parse_scene};
use rodsweep::spec::SweepSpec;
use std::fs;
use std::path::Path;

/// One mistake: what to replace by what; line and key of the message, and words that must be in it.
type Case = (&'static str, &'static str, usize, &'static str, &'static str);

fn check(error: InputError, file: &str, (_, _, line, key, words): Case) {
    let message = error.to_string();
    assert_eq!(error.line, Some(line), "{message}");
    assert_eq!(error.key, key, "{message}");
    assert!(message.starts_with(&format!("{file}:{line}: `{key}`: ")), "{message}");
    assert!(message.contains(words), "{message}\n  has not: {words}");
    assert!(!message.contains('\n'), "{message}");
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

#[test]
fn the_unbroken_files_are_read() {
    parse_scene(Path::new("scene.toml"), SCENE).unwrap();
    sweep(SWEEP).unwrap();
}

#[test]
fn broken_scenes() {
    let cases: &[Case] = &[
        (
            "length = \"80 mm\"",
            "length = \"3 kg\"",
            11,
            "segment[0].length",
            "\"3 kg\" is a mass; give a length such as \"13 mm\"",
        ),
        ("length = \"80 mm\"", "length = \"3 parsec\"", 11, "segment[0].length", "\"parsec\" is no unit known here"),
        ("length = \"80 mm\"", "length = \"long\"", 11, "segment[0].length", "does not start with a number"),
        ("length = \"80 mm\"", "length = nan", 11, "segment[0].length", "give a finite number"),
        ("length = \"80 mm\"", "length = inf", 11, "segment[0].length", "give a finite number"),
        ("length = \"80 mm\"", "length = true", 11, "segment[0].length", "give a length such as"),
        ("length = \"80 mm\"", "length = \"-80 mm\"", 11, "segment[0].length", "finite and not negative"),
        ("length = \"80 mm\"\n", "", 8, "segment[0].length", "is missing: give the segment's length"),
        ("length = \"80 mm\"", "lenght = \"80 mm\"", 11, "segment[0].lenght", "did you mean `length`?"),
        ("name = \"coil\"", "name = \"tube\"", 17, "segment[1].name", "give each its own name"),
        ("name = \"coil\"", "name = \"my coil\"", 17, "segment[1].name", "letters, digits, _ and -"),
        ("name = \"coil\"", "name = \"loads\"", 17, "segment[1].name", "already starts other parameters"),
        ("name = \"coil\"\n", "", 16, "segment[1].name", "parameters of a segment start with its name"),
        (
            "kind = \"rigid\"",
            "kind = \"ridgid\"",
            18,
            "segment[1].kind",
            "did you mean `rigid`?; use one of: flexible, rigid",
        ),
        ("kind = \"rigid\"", "kind = 3", 18, "segment[1].kind", "give a text in quotes"),
        ("kind = \"rigid\"", "kind = \"flexible\"", 20, "segment[1].mass", "only a rigid segment has it"),
        ("youngs_modulus = \"5 MPa\"", "youngs_modulus = 0", 13, "segment[0].youngs_modulus", "greater than zero"),
        (
            "youngs_modulus = \"5 MPa\"",
            "youngs_modulus = \"5 MPa/m\"",
            13,
            "segment[0].youngs_modulus",
            "give a pressure or modulus such as \"31.03 MPa\"",
        ),
        (
            "shear_modulus = \"2 MPa\"\n",
            "",
            8,
            "segment[0].shear_modulus",
            "give shear_modulus, or poisson_ratio instead",
        ),
        (
            "shear_modulus = \"2 MPa\"",
            "shear_modulus = 2e6\npoisson_ratio = 0.4",
            14,
            "segment[0].shear_modulus",
            "keep one of the two",
        ),
        ("shear_modulus = \"2 MPa\"", "poisson_ratio = -1.5", 14, "segment[0].poisson_ratio", "greater than -1"),
        (
            "inner_radius = \"0.5 mm\"",
            "inner_radius = \"2 mm\"",
            12,
            "segment[0].tube.inner_radius",
            "below `tube.outer_radius`",
        ),
        (
            "tube = {",
            "stiffness = { bending = 1e-5, torsion = 1e-5 }\ntube = {",
            12,
            "segment[0].stiffness",
            "keep one of the two",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [0, 0]",
            15,
            "segment[0].rest_curvature",
            "is a list of 2; give three values",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [0, \"2 mm\", 0]",
            15,
            "segment[0].rest_curvature[1]",
            "give a curvature",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [{ value = [0, 0, 0] }]",
            15,
            "segment[0].rest_curvature[0].at",
            "is missing: give the distance from the segment's proximal end, such as \"10 mm\"",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [\n{ at = 0, value = [0, 0, 0] },\n{ at = \"5 mm\" }]",
            17,
            "segment[0].rest_curvature[1].value",
            "is missing: give the rest curvature there",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [{ at = \"5 mm\", value = [0, 0, 0] },\n{ at = \"4 mm\", value = [1, 0, 0] }]",
            16,
            "segment[0].rest_curvature[1].at",
            "greater than the `at` of the node before",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [{ at = 0, value = [0, 0, 0] }, { at = \"81 mm\", value = [1, 0, 0] }]",
            15,
            "segment[0].rest_curvature[1].at",
            "at most the segment's length",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [{ at = 0, value = [0, \"2 mm\", 0] }]",
            15,
            "segment[0].rest_curvature[0].value[1]",
            "\"2 mm\" is a length; give a curvature",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [{ at = \"3 kg\", value = [0, 0, 0] }]",
            15,
            "segment[0].rest_curvature[0].at",
            "\"3 kg\" is a mass; give a length",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [{ at = 0, valeu = [0, 0, 0] }]",
            15,
            "segment[0].rest_curvature[0].valeu",
            "did you mean `value`?",
        ),
        ("rest_curvature = [0, 0, 0]", "rest_curvature = []", 15, "segment[0].rest_curvature", "at least one node"),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [[0, 0, 0]]",
            15,
            "segment[0].rest_curvature",
            "three values along x, y, z",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "rest_curvature = [{ at = 0, value = [0, 0, 0] }, 3]",
            15,
            "segment[0].rest_curvature[1]",
            "is a number; give a node such as { at =",
        ),
        (
            "tube = {",
            "stiffness = [{ at = 0, bending = 1e-5, torsion = 1e-5 }]\ntube = {",
            12,
            "segment[0].stiffness",
            "keep one of the two",
        ),
        ("rest_curvature = [0, 0, 0]", "stiffness_axial = 0", 15, "segment[0].stiffness_axial", "greater than zero"),
        (
            "rest_curvature = [0, 0, 0]",
            "stiffness_shear = \"3 kPa\"",
            15,
            "segment[0].stiffness_shear",
            "\"3 kPa\" is a pressure or modulus; give a force",
        ),
        ("rest_curvature = [0, 0, 0]", "stiffness_shear = -2", 15, "segment[0].stiffness_shear", "greater than zero"),
        (
            "rest_curvature = [0, 0, 0]",
            "stiffness_shear = [\"3 N\", \"-2 N\"]",
            15,
            "segment[0].stiffness_shear[1]",
            "greater than zero",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "stiffness_shear = [1, 2, 3]",
            15,
            "segment[0].stiffness_shear",
            "is a list of 3; give two values along x, y",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "dipole_per_length = [\"1 A\", 0, 0]",
            15,
            "segment[0].dipole_per_length[0]",
            "\"1 A\" is a current; give a magnetic moment per length",
        ),
        (
            "rest_curvature = [0, 0, 0]",
            "density = 1000\nlinear_density = 1e-4",
            15,
            "segment[0].density",
            "keep one of the two",
        ),
        (
            "turns = [30, 30, 100]",
            "turns = [30, 30, \"100 m\"]",
            21,
            "segment[1].coil.turns[2]",
            "\"100 m\" is a length; give a pure number",
        ),
        (
            "turns = [30, 30, 100], area = [\"4.67 mm^2\", \"4.67 mm^2\", \"1.13 mm^2\"]",
            "turns_area = [[1e-4, 0, 0], [0, -1e308, 0], [0, 0, 1e-4]]",
            21,
            "segment[1].coil.turns_area[1]",
            "must be at most 1e60 in size",
        ),
        ("youngs_modulus = \"5 MPa\"", "youngs_modulus = 1e-70", 13, "segment[0].youngs_modulus", "at least 1e-60"),
        ("turns = [30, 30, 100], ", "", 21, "segment[1].coil.turns", "give turns and area, or turns_area instead"),
        (
            "turns = [30, 30, 100]",
            "turns_area = [[1, 0], [0, 1]]",
            21,
            "segment[1].coil.turns_area",
            "keep one of the two",
        ),
        ("current = [0, 0, 0]", "curent = [0, 0, 0]", 21, "segment[1].coil.curent", "did you mean `current`?"),
        (
            "flux_density = [0, \"3 T\", 0]",
            "flux_density = \"3 T\"",
            5,
            "field.flux_density",
            "give three values along x, y, z",
        ),
        (
            "tip_force = [0, 0, 0]",
            "gravity = [0, 0, 9.81]\nfluid_density = -1",
            8,
            "loads.fluid_density",
            "finite and not negative",
        ),
        ("tip_force = [0, 0, 0]", "tip_froce = [0, 0, 0]", 7, "loads.tip_froce", "did you mean `tip_force`?"),
        (
            "[base]",
            "insertion = \"10 mm\"\n[base]",
            2,
            "insertion",
            "the other segments alone are 0.013 m long; give more",
        ),
        ("[base]", "base2 = 3\n[base]", 2, "base2", "did you mean `base`?"),
        ("[base]\nposition = [0, 0, 0]", "base = 3\n", 2, "base", "give a table"),
    ];
    for case in cases {
        let text = replaced(SCENE, case.0, case.1);
        let error = parse_scene(Path::new("sweeps/x.toml"), &text).expect_err(case.1);
        check(error, "sweeps/x.toml", *case);
    }
}

#[test]
fn long_texts_are_quoted_without_their_middle() {
    let long = "x".repeat(1_000_000);
    let quoted = |text: &str| format!("\"{text}\"");
    for (from, to, words) in [
        ("\"coil\"", quoted(&long), "a name of at most 100 characters"),
        ("\"rigid\"", quoted(&long), "is not known; use one of: flexible, rigid"),
        ("\"80 mm\"", quoted(&long), "does not start with a number"),
        ("\"80 mm\"", quoted(&format!("80 {long}")), "is no unit known here"),
        ("mass", long.clone(), "is not a key here"),
    ] {
        let error = parse_scene(Path::new("x.toml"), &replaced(SCENE, from, &to)).expect_err(words);
        let message = error.to_string();
        assert!(message.contains(words) && message.contains('…'), "{} bytes", message.len());
        assert!(message.len() < 600, "{} bytes", message.len());
    }
}

/// Stiffness by nodes in place of the tube.
#[test]
fn broken_stiffness_nodes() {
    let tube = "tube = { inner_radius = \"0.5 mm\", outer_radius = \"1 mm\" }\nyoungs_modulus = \"5 MPa\"\n\
                shear_modulus = \"2 MPa\"\n";
    let cases: &[Case] = &[
        (tube, "stiffness = []\n", 12, "segment[0].stiffness", "at least one node"),
        (
            tube,
            "stiffness = [{ bending = 1e-5, torsion = 1e-5 }]\n",
            12,
            "segment[0].stiffness[0].at",
            "is missing: give the distance",
        ),
        (
            tube,
            "stiffness = [{ at = 0, bending = \"1e-5 N\", torsion = 1e-5 }]\n",
            12,
            "segment[0].stiffness[0].bending",
            "\"1e-5 N\" is a force; give a bending or torsional stiffness",
        ),
        (
            tube,
            "stiffness = [{ at = 0, bending = 1e-5 }]\n",
            12,
            "segment[0].stiffness[0].torsion",
            "is missing: give it in N·m²",
        ),
        (
            tube,
            "stiffness = [\n{ at = 0, bending = 1e-5, torsion = 1e-5 },\n\
             { at = 0.08, bending_x = 1e-5, bending_y = 0, torsion = 1e-5 }]\n",
            14,
            "segment[0].stiffness[1].bending_y",
            "greater than zero",
        ),
        (
            tube,
            "stiffness = [\n{ at = 0.09, bending = 1e-5, torsion = 1e-5 }]\n",
            13,
            "segment[0].stiffness[0].at",
            "at most the segment's length",
        ),
        (
            tube,
            "stiffness = [{ at = 0, bending = -1e-5, torsion = 1e-5 }]\n",
            12,
            "segment[0].stiffness[0].bending",
            "greater than zero",
        ),
        (
            tube,
            "stiffness = [{ at = 0, bending = 1e-5, torsion = 1e-5 }]\ndensity = 1000\n",
            13,
            "segment[0].density",
            "give `linear_density` instead",
        ),
    ];
    for case in cases {
        let text = replaced(SCENE, case.0, case.1);
        let error = parse_scene(Path::new("x.toml"), &text).expect_err(case.1);
        check(error, "x.toml", *case);
    }
}

#[test]
fn scenes_that_are_no_rod() {
    let parse = |text: &str| parse_scene(Path::new("x.toml"), text).unwrap_err();
    let massless = replaced(SCENE, "mass = \"58 mg\"\n", "").replace("tip_force = [0, 0, 0]", "gravity = [0, 0, 9.81]");
    let error = parse(&massless);
    assert_eq!((error.line, error.key.as_str()), (Some(7), "loads.gravity"));
    assert!(error.to_string().contains("or remove gravity"), "{error}");
    let error = parse("name = \"empty\"\n");
    assert!(error.to_string().contains("`segment`: is missing: add a [[segment]] block"), "{error}");
    let rigid = SCENE.split("[[segment]]").enumerate().filter(|(k, _)| *k != 1).map(|(_, s)| s).collect::<Vec<_>>();
    let error = parse(&rigid.join("[[segment]]"));
    assert!(error.to_string().contains("needs at least one flexible segment"), "{error}");
    assert_eq!(error.line, Some(8));
    let error = parse("name = \n");
    assert_eq!(error.line, Some(1));
    assert!(error.to_string().starts_with("x.toml:1: is not valid TOML"), "{error}");
    let error = parse("name = \"a\"\nname = \"b\"\n");
    assert_eq!(error.line, Some(2), "{error}");
}

fn sweep(text: &str) -> Result<SweepSpec, InputError> {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("scene.toml"), SCENE).unwrap();
    fs::write(dir.path().join("good.csv"), "coil.current.x\n0.1\n200 mA\n").unwrap();
    let result = SweepSpec::parse(&dir.path().join("sweep.toml"), text);
    result.map_err(|mut error| {
        error.file = error.file.file_name().unwrap_or_default().into();
        error
    })
}

#[test]
fn broken_sweeps() {
    let cases: &[Case] = &[
        ("scene.toml", "scenes/none.toml", 1, "scene", "is no file; the path starts from the folder of this file"),
        ("method = \"grid\"", "method = \"gird\"", 3, "sampling.method", "did you mean `grid`?"),
        ("method = \"grid\"\n", "", 2, "sampling.method", "write method = "),
        ("seed = 7", "seed = -7", 4, "sampling.seed", "a whole number of at least 0"),
        ("seed = 7", "seed = 7\nsamples = 9", 5, "sampling.samples", "remove it"),
        ("seed = 7", "sede = 7", 4, "sampling.sede", "did you mean `seed`?"),
        ("coil.current.x", "coil.curent.x", 6, "axis[0].parameter", "did you mean `coil.current.x`?"),
        ("coil.current.x", "spool.current", 6, "axis[0].parameter", "no parameter is named `spool.current`"),
        ("coil.current.x", "tube.stiffness.torsion", 7, "axis[0].from", "is a current"),
        ("parameter = \"coil.current.x\"\n", "", 5, "axis[0].parameter", "name what to sweep"),
        (
            "parameter = \"coil.current.x\"",
            "parameters = [\"coil.current.x\", \"tube.length\"]",
            6,
            "axis[0].parameters",
            "give each its own axis",
        ),
        ("parameter = \"coil.current.x\"", "parameters = []", 6, "axis[0].parameters", "at least one name"),
        (
            "from = \"-0.1 A\"",
            "from = \"-0.3 T\"",
            7,
            "axis[0].from",
            "is a flux density; give a current such as \"200 mA\"",
        ),
        ("from = \"-0.1 A\"", "from = -inf", 7, "axis[0].from", "give a finite number"),
        ("to = \"0.1 A\"\n", "", 5, "axis[0].to", "an axis runs from `from` to `to`"),
        ("points = 5", "points = 0", 9, "axis[0].points", "a whole number of at least 1"),
        ("points = 5", "points = 5.5", 9, "axis[0].points", "a whole number"),
        ("points = 5\n", "", 5, "axis[0].points", "a grid needs the number of points"),
        ("points = 5", "points = 1_000_000_000_000", 5, "axis", "1,000,000,000,000 samples; at most 1,000,000,000"),
        (
            "points = 5",
            "points = 9_000_000_000_000_000_000\n[[axis]]\nparameter = \"coil.current.y\"\nfrom = 0\nto = 1\npoints = 9_000_000_000_000_000_000",
            5,
            "axis",
            "more than 2^64",
        ),
        (
            "points = 5",
            "points = 5\n[[axis]]\nparameter = \"coil.current.x\"\nfrom = 0\nto = 1\npoints = 2",
            11,
            "axis[1].parameter",
            "both set `coil.current.x`: drop one",
        ),
        ("tolerance = 1e-6", "tolerance = 0", 11, "solver.tolerance", "a number between 0 and 1"),
        ("tolerance = 1e-6", "derivative_tolerance = 1", 11, "solver.derivative_tolerance", "such as 1e-3"),
        ("tolerance = 1e-6", "tolerance = \"1e-6 m\"", 11, "solver.tolerance", "is a length; give a pure number"),
        ("branch = \"from_rest\"", "branch = \"al\"", 12, "solver.branch", "did you mean `all`?"),
        ("branch = \"from_rest\"", "branch = 2", 12, "solver.branch", "give a text"),
        ("branch = \"from_rest\"", "branch = \"some\"", 12, "solver.branch", "use one of: from_rest, all"),
        ("\"tip_position\"", "\"tip_positon\"", 14, "output.quantities[0]", "did you mean `tip_position`?"),
        (
            "quantities = [\"tip_position\"]",
            "quantities = \"tip_position\"",
            14,
            "output.quantities",
            "give a list of texts",
        ),
        ("[\"coil.current\"]", "[\"coil.currents\"]", 15, "output.derivatives[0]", "did you mean `coil.current`?"),
        ("format = \"parquet\"", "format = \"parket\"", 16, "output.format", "did you mean `parquet`?"),
        ("voxel = \"1 mm\"", "voxel = 0", 18, "workspace.voxel", "a length greater than zero"),
        ("[workspace]", "[workspce]", 17, "workspce", "did you mean `workspace`?"),
    ];
    for case in cases {
        let error = sweep(&replaced(SWEEP, case.0, case.1)).expect_err(case.1);
        check(error, "sweep.toml", *case);
    }
}

#[test]
fn broken_laws() {
    const FROM_TO: &str = "from = \"-0.1 A\"\nto = \"0.1 A\"\n";
    const DRAWN: &str = "method = \"sobol\"\nsamples = 8\n";
    let modulus = |text: &str| text.replace("coil.current.x", "tube.youngs_modulus").replace("points = 5\n", "");
    let drawn = |text: &str| modulus(text).replace("method = \"grid\"\n", DRAWN);
    let cases: &[(&str, usize, &str, &str)] = &[
        ("relative = \"10 %\"\nfrom = 0\nto = 1\n", 9, "axis[0].from", "cannot stand beside `relative`"),
        ("relative = \"10 %\"\nmean = 1\n", 9, "axis[0].mean", "keep one of the two"),
        (
            "relative = 10\n",
            8,
            "axis[0].relative",
            "a share above 0 and up to 1, such as \"10 %\"; else write from and to",
        ),
        ("relative = \"-10 %\"\n", 8, "axis[0].relative", "is -0.1; give a share above 0"),
        ("relative = 3\ndistribution = \"normal\"\n", 8, "axis[0].relative", "else write mean and standard_deviation"),
        ("relative = \"10 mm\"\n", 8, "axis[0].relative", "is a length; give a pure number"),
        ("distribution = \"normal\"\n", 6, "axis[0].standard_deviation", "is missing: a normal distribution needs it"),
        (
            "distribution = \"normal\"\nstandard_deviation = 0\n",
            9,
            "axis[0].standard_deviation",
            "a value greater than zero",
        ),
        (
            "distribution = \"normal\"\nstandard_deviation = \"1 mm\"\n",
            9,
            "axis[0].standard_deviation",
            "is a length; give a pressure or modulus",
        ),
        (
            "distribution = \"normal\"\nfrom = 0\nto = 1\n",
            9,
            "axis[0].from",
            "cannot stand beside `distribution = normal`; a normal distribution has no ends",
        ),
        (
            "from = 0\nto = 1\nstandard_deviation = 1\n",
            10,
            "axis[0].standard_deviation",
            "write distribution = \"normal\"",
        ),
        (
            "distribution = \"gauss\"\n",
            8,
            "axis[0].distribution",
            "use one of: uniform, log-uniform, triangular, normal, truncated-normal, lognormal",
        ),
        (
            "distribution = \"log-uniform\"\nfrom = 0\nto = 1\n",
            9,
            "axis[0].from",
            "a value other than zero, which has no logarithm",
        ),
        ("spacing = \"log\"\nfrom = -1\nto = 1\n", 10, "axis[0].to", "no logarithm passes through zero"),
        ("spacing = \"logarithmic\"\n", 8, "axis[0].spacing", "use one of: linear, log"),
        (
            "distribution = \"normal\"\nspacing = \"log\"\nstandard_deviation = 1\n",
            9,
            "axis[0].spacing",
            "keep one of the two",
        ),
        ("distribution = \"triangular\"\nfrom = 1\nto = 0\n", 10, "axis[0].to", "a value above `from`"),
        ("distribution = \"triangular\"\nfrom = 1\nmode = 3\nto = 2\n", 10, "axis[0].mode", "a mode between the ends"),
        ("distribution = \"triangular\"\nfrom = 1\nto = 2\n", 9, "axis[0].from", "it is the scene's value"),
        (
            "distribution = \"triangular\"\nfrom = -1\nto = 2\nmean = 1\n",
            11,
            "axis[0].mean",
            "this law has from, mode, to: remove the other",
        ),
        (
            "distribution = \"truncated-normal\"\nstandard_deviation = 1\nfrom = 8\nto = 9\n",
            10,
            "axis[0].from",
            "at least 1e-9 of the normal law",
        ),
        (
            "distribution = \"truncated-normal\"\nrelative = \"10 %\"\n",
            9,
            "axis[0].relative",
            "a truncated law needs its ends",
        ),
        (
            "distribution = \"lognormal\"\nmean = 0\nstandard_deviation = 1\n",
            9,
            "axis[0].mean",
            "a mean other than zero",
        ),
        ("values = [1, 2]\nfrom = 0\n", 8, "axis[0].values", "cannot stand beside `from`; the list says every value"),
        ("values = []\n", 8, "axis[0].values", "at least one value"),
        ("values = 3\n", 8, "axis[0].values", "a list, each"),
        ("values = [\"1 mm\"]\n", 8, "axis[0].values[0]", "is a length"),
        ("scale = \"yes\"\nfrom = 0\nto = 1\n", 8, "axis[0].scale", "give true or false"),
        ("scale = true\nfrom = \"1 MPa\"\nto = 2\n", 9, "axis[0].from", "give a pure number"),
        ("relativ = 0.1\n", 8, "axis[0].relativ", "did you mean `relative`?"),
    ];
    for (law, line, key, words) in cases {
        let error = sweep(&replaced(&drawn(SWEEP), FROM_TO, law)).expect_err(law);
        check(error, "sweep.toml", ("", "", *line, key, words));
    }
    let fails = |text: &str, line: usize, key: &str, words: &str| {
        let error = sweep(text).expect_err(words);
        assert_eq!((error.line, error.key.as_str()), (Some(line), key), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    };
    let relative = |name: &str| replaced(SWEEP, FROM_TO, "relative = \"10 %\"\n").replace("coil.current.x", name);
    fails(&relative("coil.current.x"), 7, "axis[0].relative", "it is 0 in the scene: name others, or give from and to");
    fails(
        &relative("coil.turns.x\", \"coil.current.x")
            .replace("parameter =", "parameters = [")
            .replace("t.x\"", "t.x\"]"),
        7,
        "axis[0].relative",
        "cannot stand beside `coil.current.x`; it is 0",
    );
    let oval = SWEEP.replace("scene = \"scene.toml\"\n", "").replace(FROM_TO, "relative = 0.1\n");
    let oval = oval.replace("coil.current.x", "tube.stiffness.bending").replace("[\"coil.current\"]", "[]")
        + "[scene]\n[[scene.segment]]\nname = \"tube\"\nkind = \"flexible\"\nlength = 1\n\
           stiffness = { bending_x = 1, bending_y = 2, torsion = 1 }\n";
    fails(&oval, 6, "axis[0].relative", "it stands for several numbers that differ");
    assert!(sweep(&oval.replace("bending_y = 2", "bending_y = 1")).is_ok());
    let pair = relative("coil.turns.x\", \"coil.turns.z").replace("parameter = ", "parameters = [");
    let pair = pair.replace("turns.z\"", "turns.z\"]");
    assert!(sweep(&pair).unwrap().axes[0].scales);
    fails(&pair.replace("points", "scale = false\npoints"), 8, "axis[0].scale", "several parameters keep their ratio");
    let normal = replaced(SWEEP, FROM_TO, "distribution = \"normal\"\nstandard_deviation = 1\n");
    fails(&normal, 7, "axis[0].distribution", "a grid needs ends: give from and to, or draw samples");
    let faces = normal.replace("points = 5\n", "").replace("\"grid\"", "\"skeleton\"\nsamples = 8");
    fails(&faces, 8, "axis[0].distribution", "faces need ends: give from and to");
    let listed = replaced(SWEEP, FROM_TO, "values = [0.1, 0.2]\n");
    fails(&listed, 8, "axis[0].points", "the 2 values that are listed");
    let faces = listed.replace("points = 5\n", "").replace("\"grid\"", "\"skeleton\"\nsamples = 8");
    fails(&faces, 8, "axis[0].values", "faces need ends: give from and to");
}

#[test]
fn broken_designs() {
    let text = |method: &str, more: &str| {
        let sampling = format!("method = \"{method}\"\n{more}");
        SWEEP.replace("method = \"grid\"\n", &sampling).replace("points = 5\n", "")
    };
    let fails = |text: &str, line: usize, key: &str, words: &str| {
        let error = sweep(text).expect_err(words);
        assert_eq!((error.line, error.key.as_str()), (Some(line), key), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    };
    fails(&text("saltelli", ""), 2, "sampling.samples", "say how many samples to draw");
    fails(&text("saltelli", "samples = 300_000_000\n"), 4, "sampling.samples", "2,147,483,648 samples; at most");
    fails(
        &text("saltelli", "samples = 8\ndimension = 1\n"),
        5,
        "sampling.dimension",
        "only method = \"skeleton\" has it",
    );
    fails(&text("skeleton", "samples = 8\ndimension = 2\n"), 5, "sampling.dimension", "a whole number from 1 to 1");
    fails(&text("skeleton", "samples = 8\ndimension = 0\n"), 5, "sampling.dimension", "a whole number of at least 1");
    fails(&text("skeleton", "dimension = 1\n"), 2, "sampling.samples", "say how many samples to draw");
    fails(
        &text("skeleton", "samples = 900_000_000\n"),
        4,
        "sampling.samples",
        "900,000,000 samples on 1 face; at most 1,000,000,000 are possible: give a larger `dimension`",
    );
    // One axis more than there are directions for.
    let axes: String = (0..501).map(|k| format!("[[axis]]\nparameter = \"s{k}.length\"\nfrom = 0\nto = 1\n")).collect();
    let segments: String =
        (0..501).map(|k| format!("[[scene.segment]]\nname = \"s{k}\"\nkind = \"rigid\"\nlength = 1\n")).collect();
    let tube = "[[scene.segment]]\nname = \"tube\"\nkind = \"flexible\"\nlength = 1\n\
         stiffness = { bending_x = 1, bending_y = 1, torsion = 1 }\n";
    let wide = |axes: &str| format!("[sampling]\nmethod = \"saltelli\"\nsamples = 2\n{axes}[scene]\n{tube}{segments}");
    let error = sweep(&wide(&axes)).unwrap_err();
    assert!(error.to_string().contains("`axis`: has 501 axes; at most 500 are possible"), "{error}");
}

#[test]
fn broken_uncertain_numbers_and_workspaces() {
    let with = |block: &str| format!("{SWEEP}{block}");
    let fails = |text: &str, line: usize, key: &str, words: &str| {
        let error = sweep(text).expect_err(words);
        assert_eq!((error.line, error.key.as_str()), (Some(line), key), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    };
    let block = "[[uncertain]]\nparameter = \"tube.youngs_modulus\"\nrelative = \"5 %\"\n";
    assert_eq!(sweep(&with(block)).unwrap().uncertain.len(), 1);
    fails(&with(&format!("{block}points = 3\n")), 22, "uncertain[0].points", "points belong to an axis of a grid");
    fails(&with(&format!("{block}{block}")), 23, "uncertain[1].parameter", "both set `tube.youngs_modulus`: drop one");
    let current = "[[uncertain]]\nparameter = \"coil.current.x\"\nfrom = 0\nto = 1\n";
    fails(&with(current), 20, "uncertain[0].parameter", "both set `coil.current.x`: drop one");
    fails(&with(&block.replace("youngs", "yongs")), 20, "uncertain[0].parameter", "did you mean");
    fails(
        &with(&block.replace("youngs_modulus", "stiffness.torsion")),
        20,
        "uncertain[0].parameter",
        "follows from `tube`",
    );
    fails(&with(&block.replace("relative", "seed")), 21, "uncertain[0].seed", "is not a key here");
    for (key, value, words) in [
        ("minimum_margin", "1.5", "a number from 0 to 1"),
        ("minimum_margin", "-0.1", "a number from 0 to 1"),
        ("seed", "-1", "a whole number of at least 0"),
        ("length", "\"0 mm\"", "a length greater than zero, such as \"20 mm\""),
        ("length", "\"1 A\"", "give a length"),
        ("margin", "0", "is not a key here"),
    ] {
        fails(&with(&format!("{key} = {value}\n")), 19, &format!("workspace.{key}"), words);
    }
}

#[test]
fn sweeps_of_what_cannot_be_swept() {
    let stiffness = SWEEP
        .replace("coil.current.x", "tube.stiffness.bending")
        .replace("-0.1 A", "1e-5 N·m²")
        .replace("0.1 A", "2e-5 N·m²");
    let error = sweep(&stiffness).unwrap_err();
    assert_eq!((error.line, error.key.as_str()), (Some(6), "axis[0].parameter"), "{error}");
    assert!(error.to_string().contains("sweep `youngs_modulus`"), "{error}");
    let error = sweep(&SWEEP.replace("[sampling]", "samplng = 1\n[sampling]")).unwrap_err();
    assert!(error.to_string().contains("did you mean `sampling`?"), "{error}");
    let random = SWEEP.replace("\"grid\"", "\"sobol\"");
    let error = sweep(&random).unwrap_err();
    assert_eq!(error.key, "axis[0].points", "{error}");
    assert!(error.to_string().contains("give [sampling] samples instead"), "{error}");
    let random = random.replace("points = 5\n", "");
    let error = sweep(&random).unwrap_err();
    assert!(error.to_string().contains("`sampling.samples`: is missing: say how many"), "{error}");
    let error = sweep(&random.replace("seed = 7", "samples = 1e12")).unwrap_err();
    assert!(error.to_string().contains("write no rows with [output] format = \"none\""), "{error}");
    let many = random.replace("seed = 7", "samples = 5_000_000_000").replace("\"parquet\"", "\"none\"");
    let error = sweep(&many).unwrap_err();
    assert!(error.to_string().contains("at most 4,294,967,296"), "{error}");
    let rounded = sweep(&random.replace("seed = 7", "samples = 1000")).unwrap();
    assert_eq!(rounded.sample_count, 1024);
    assert!(rounded.notes.iter().any(|note| note.contains("rounded up to 1,024")), "{:?}", rounded.notes);
}

#[test]
fn insertion_needs_a_flexible_first_segment() {
    let head = SCENE.find("[[segment]]").unwrap();
    let coil = SCENE.rfind("[[segment]]").unwrap();
    let swapped = format!("{}{}{}", &SCENE[..head], &SCENE[coil..], &SCENE[head..coil]);
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("scene.toml"), swapped).unwrap();
    let text = SWEEP.replace("coil.current.x", "insertion").replace("-0.1 A", "50 mm").replace("0.1 A", "60 mm");
    let error = SweepSpec::parse(&dir.path().join("sweep.toml"), &text).unwrap_err();
    assert_eq!((error.line, error.key.as_str()), (Some(6), "axis[0].parameter"), "{error}");
    assert!(error.to_string().contains("`coil` is rigid"), "{error}");
    let text = SWEEP.replace("[\"coil.current\"]", "[\"insertion\"]");
    let error = SweepSpec::parse(&dir.path().join("sweep.toml"), &text).unwrap_err();
    assert_eq!((error.line, error.key.as_str()), (Some(15), "output.derivatives"), "{error}");
}

#[test]
fn broken_tables() {
    let head = "scene = \"scene.toml\"\n[sampling]\nmethod = \"table\"\nfile = \"inputs.csv\"\n";
    let read = |csv: &str| {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("scene.toml"), SCENE).unwrap();
        fs::write(dir.path().join("inputs.csv"), csv).unwrap();
        SweepSpec::parse(&dir.path().join("sweep.toml"), head).unwrap_err()
    };
    let expect = |csv: &str, line: Option<usize>, key: &str, words: &str| {
        let error = read(csv);
        assert!(error.file.ends_with("inputs.csv"), "{error}");
        assert_eq!((error.line, error.key.as_str()), (line, key), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    };
    expect("coil.curent.x\n1\n", Some(1), "coil.curent.x", "did you mean `coil.current.x`?");
    expect("coil.current\n1\n", Some(1), "coil.current", "one component");
    expect("coil.current.x\n1\n2 T\n", Some(3), "coil.current.x", "is a flux density; give a current");
    expect("coil.current.x,coil.current.y\n1,2\n\n3\n", Some(4), "", "has 1 columns where the first line has 2");
    expect("coil.current.x\n1\nword\n", Some(3), "coil.current.x", "does not start with a number");
    expect("coil.current.x\n1\ninf\n", Some(3), "coil.current.x", "does not start with a number");
    expect("coil.current.x,coil.current.x\n1,1\n", Some(1), "coil.current.x", "drop one of the two columns");
    expect("coil.current.x\n", None, "", "has no rows");
    expect("", None, "", "the first line must name parameters");
    let error = sweep(&head.replace("inputs.csv", "none.csv")).unwrap_err();
    assert_eq!((error.line, error.key.as_str()), (Some(4), "sampling.file"), "{error}");
    let both = head.replace("inputs.csv", "good.csv") + "[[axis]]\nparameter = \"coil.current.x\"\nfrom = 0\nto = 1\n";
    let error = sweep(&both).unwrap_err();
    assert_eq!((error.line, error.key.as_str()), (Some(5), "axis"), "{error}");
}

#[test]
fn nothing_panics_on_cut_or_garbled_files() {
    for text in [SCENE, SWEEP] {
        for end in (0..text.len()).filter(|end| text.is_char_boundary(*end)) {
            let _ = parse_scene(Path::new("x.toml"), &text[..end]);
            let _ = SweepSpec::parse(Path::new("x.toml"), &text[..end]);
        }
    }
    let inline = SWEEP.replace("scene = \"scene.toml\"\n", "") + "[scene]\n" + &SCENE.replace("[base]", "[scene.base]");
    for end in (0..inline.len()).filter(|end| inline.is_char_boundary(*end)) {
        let _ = SweepSpec::parse(Path::new("x.toml"), &inline[..end]);
    }
    assert!(SweepSpec::read(Path::new("/nonexistent/sweep.toml")).unwrap_err().to_string().contains("cannot be read"));
}
