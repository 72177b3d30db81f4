//! `rodsweep control` and `rodsweep fit` as a user meets them: files, words, exit codes, mistakes.

use crate::sandbox::{Sandbox, json};
use serde_json::Value;
use std::fs;

const TRAJECTORY: &str = r#"name = "lap"
shape = "circle"
size = "5 mm"
plane = "xy"
centre = [0, "20 mm", 0]
points = 12
coordinates = ["x", "y"]
duration = "6 s"
[[input]]
parameter = "coil.current"
from = "-1 A"
to = "1 A"
[control]
tolerance = "0.1 um"
"#;

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("lap.toml", TRAJECTORY);
    sandbox
}

/// Column of a CSV file.
fn column(text: &str, name: &str) -> Vec<String> {
    let mut lines = text.lines();
    let at = lines.next().unwrap().split(',').position(|other| other == name).unwrap_or_else(|| panic!("{name}"));
    lines.map(|line| line.split(',').nth(at).unwrap().to_owned()).collect()
}

#[test]
fn a_trajectory_is_followed() {
    let sandbox = sandbox();
    let output = sandbox.ok(&["control", "scene.toml", "lap.toml", "--out", "out"]);
    assert_eq!(output.stdout, "");
    assert!(output.stderr.contains("12 reached"), "{}", output.stderr);
    for name in ["trajectory.png", "inputs.png", "rods.png"] {
        assert!(fs::read(sandbox.path("out").join(name)).unwrap().starts_with(b"\x89PNG"), "{name}");
    }
    let table = fs::read_to_string(sandbox.path("out/control.csv")).unwrap();
    assert!(column(&table, "status").iter().all(|word| word == "reached"), "{table}");
    assert!(column(&table, "from_rest").iter().all(|word| word == "true"));
    assert_eq!(column(&table, "time")[2], "1.0");
    for name in ["tip_error", "coil.current.x", "iterations", "stability.margin", "seconds", "tip.position.z"] {
        let values: Vec<f64> = column(&table, name).iter().map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(values.len(), 12);
        if name == "tip_error" {
            assert!(values.iter().all(|error| *error <= 1e-7), "{values:?}");
        }
    }
    // What is there is not overwritten unasked.
    let again = sandbox.run(&["control", "scene.toml", "lap.toml", "--out", "out"]);
    assert_eq!((again.code, again.errors().len()), (2, 1), "{}", again.stderr);
    assert!(again.stderr.contains("--force"), "{}", again.stderr);
    sandbox.ok(&["control", "scene.toml", "lap.toml", "--out", "out", "--force", "--no-figures"]);
}

#[test]
fn json_tables_and_targets() {
    let sandbox = sandbox();
    let arguments = ["control", "scene.toml", "lap.toml", "--json", "--no-figures", "--format", "parquet"];
    let value = json(&sandbox.ok(&arguments).stdout);
    assert!(fs::read(sandbox.path("results/control-lap/control.parquet")).unwrap().starts_with(b"PAR1"));
    assert_eq!((&value["counts"]["reached"], &value["coordinates"]), (&Value::from(12), &json(r#"["x","y"]"#)));
    assert_eq!(value["inputs"][2]["parameter"], "coil.current.z");
    let points = value["points"].as_array().unwrap();
    // The tips are targets that can be reached, in all coordinates and with their tangents.
    let mut rows = String::from("x,y,z,tx,ty,tz\n");
    for point in points {
        let numbers = ["position", "tangent"].map(|key| point["tip"][key].as_array().unwrap().clone()).concat();
        rows += &(numbers.iter().map(|x| x.to_string()).collect::<Vec<_>>().join(",") + "\n");
    }
    sandbox.write("tips.csv", &rows);
    let arguments = ["control", "scene.toml", "--targets", "tips.csv", "--input", "coil.current=1 A", "--json"];
    let value = json(&sandbox.ok(&[&arguments[..], &["--tolerance", "1 um", "--backend", "cpu"]].concat()).stdout);
    assert_eq!(value["counts"]["reached"], 12, "{value}");
    assert!(value["points"][3]["tangent_error"].as_f64().unwrap() < 1e-3);
    assert!(sandbox.path("results/control-tips/trajectory.png").exists());
    let value =
        json(&sandbox.ok(&[&arguments[..], &["--precision", "f32", "--force", "--no-figures"]].concat()).stdout);
    assert_eq!(value["counts"]["reached"], 12, "{value}");
    assert!(value["engine"].as_str().unwrap().contains("finished on cpu f64"), "{}", value["engine"]);
}

#[test]
fn a_simulated_experiment_is_labelled() {
    let sandbox = sandbox();
    let arguments = ["control", "scene.toml", "lap.toml", "--simulate", "--json", "--out", "out"];
    let output = sandbox.ok(&arguments);
    assert!(output.stderr.contains("SIMULATION, no measurement"), "{}", output.stderr);
    let simulation = &json(&output.stdout)["simulation"];
    let [all, aligned] = ["rmse", "aligned_rmse"].map(|key| simulation[key].as_f64().unwrap());
    assert!(all > aligned && aligned > 0.0, "{simulation}");
    let table = fs::read_to_string(sandbox.path("out/simulation.csv")).unwrap();
    assert_eq!(column(&table, "trial").len(), 120);
    assert!(fs::read(sandbox.path("out/simulation.png")).unwrap().starts_with(b"\x89PNG"));
    let other = json(&sandbox.ok(&[&arguments[..], &["--force", "--no-figures", "--seed", "2"]].concat()).stdout);
    assert_ne!(other["simulation"]["rmse"], simulation["rmse"]);
}

#[test]
fn what_is_out_of_reach_is_counted() {
    let sandbox = sandbox();
    sandbox.write("far.csv", "x,y\n0,20 mm\n0,150 mm\n");
    let run = |most: &str| sandbox.run(&["control", "scene.toml", "far.csv", "--force", "--max-failures", most]);
    let output = run("0");
    assert_eq!(output.code, 3, "{}", output.stderr);
    assert!(
        output.stderr.contains("1 reached") && output.stderr.contains("1 targets are not reached"),
        "{}",
        output.stderr
    );
    assert!(output.stderr.contains("within ±0.3 A"), "{}", output.stderr);
    let table = fs::read_to_string(sandbox.path("results/control-far/control.csv")).unwrap();
    assert_ne!(column(&table, "status")[1], "reached");
    assert!(column(&table, "residual")[1].parse::<f64>().unwrap() > 0.05);
    assert_eq!(run("1").code, 0);
}

/// A mistake in the trajectory: replaced text, its replacement, words of the message.
const BROKEN: &[(&str, &str, &str)] = &[
    (
        "shape = \"circle\"",
        "shape = \"cirkle\"",
        "lap.toml:2: `shape`: \"cirkle\" is not known: did you mean `circle`?",
    ),
    ("shape = \"circle\"\n", "", "`shape`: is missing"),
    ("size = \"5 mm\"", "size = \"5 mA\"", "lap.toml:3: `size`"),
    ("size = \"5 mm\"", "size = -5", "`size`: is -5"),
    ("size = \"5 mm\"\n", "", "`size`: is missing"),
    ("size =", "sise =", "did you mean `size`?"),
    ("plane = \"xy\"", "plane = \"xq\"", "`plane`: \"xq\" is not known"),
    ("centre = [0, \"20 mm\", 0]", "centre = [0, 1]", "`centre`"),
    ("points = 12", "points = 2", "`points`: is 2"),
    ("[\"x\", \"y\"]", "[\"x\", \"w\"]", "`coordinates`: \"w\" is not known"),
    ("[\"x\", \"y\"]", "[]", "`coordinates`: is missing"),
    ("duration = \"6 s\"", "duration = 0", "`duration`: is 0"),
    ("duration = \"6 s\"", "tangent = [0, 0, 0]", "`tangent`: is no direction"),
    ("duration = \"6 s\"", "file = \"a.csv\"", "`file`: cannot stand beside `shape`"),
    ("parameter = \"coil.current\"", "parameter = \"coil.curent\"", "did you mean `coil.current`?"),
    ("to = \"1 A\"", "to = \"-2 A\"", "`input[0].to`: is -2"),
    ("to = \"1 A\"\n", "", "`input[0].to`: is missing"),
    ("tolerance = \"0.1 um\"", "tolerance = \"0.1 A\"", "`control.tolerance`"),
    ("tolerance = \"0.1 um\"", "tolerence = \"0.1 um\"", "did you mean `tolerance`?"),
    ("tolerance = \"0.1 um\"", "redundancy = \"least\"", "`control.redundancy`"),
];

#[test]
fn mistakes_in_a_trajectory_are_named() {
    let sandbox = sandbox();
    for (from, to, words) in BROKEN {
        assert!(TRAJECTORY.contains(from), "{from}");
        sandbox.write("lap.toml", &TRAJECTORY.replacen(from, to, 1));
        let output = sandbox.run(&["control", "scene.toml", "lap.toml", "--out", "out"]);
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{to}: {}", output.stderr);
        assert_eq!(output.errors().len(), 1, "{to}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
        assert!(!sandbox.path("out").exists(), "{to}");
    }
}

#[test]
fn mistakes_in_tables_and_arguments_are_named() {
    let sandbox = sandbox();
    let tables = [
        ("x,y,w\n0,0,0\n", "\"w\" is not known"),
        ("x,y\n0\n", "bad.csv:2: has 1 columns"),
        ("x,y\n0,1 A\n", "bad.csv:2: `y`"),
        ("x,y,tx\n0,0,1\n", "all of tx, ty, tz"),
        ("x,x\n0,0\n", "cannot stand beside"),
        ("x,y\n", "names columns"),
        ("", "names columns"),
    ];
    for (text, words) in tables {
        sandbox.write("bad.csv", text);
        for arguments in [&["control", "scene.toml", "bad.csv"][..], &["control", "scene.toml", "--targets", "bad.csv"]]
        {
            let output = sandbox.run(arguments);
            assert_eq!((output.code, output.errors().len()), (2, 1), "{text:?}: {}", output.stderr);
            assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
        }
    }
    for (arguments, words) in [
        (&["--input", "coil.current"][..], "write NAME=LIMIT"),
        (&["--input", "coil.curent=1"], "did you mean `coil.current`?"),
        (&["--input", "coil.current=1 mm"], "give a current"),
        (&["--input", "coil.current=0.1..-0.1"], "below the upper"),
        (&["--input", "coil.current=1", "--input", "coil.current.x=1"], "input already"),
        (&["--coordinates", "x,q"], "--coordinates"),
        (&["--tolerance", "0 m"], "positive length"),
        (&["--backend", "reference"], "use `--backend cpu`"),
        (&["--targets", "bad.csv"], "cannot be used with"),
    ] {
        let output = sandbox.run(&[&["control", "scene.toml", "lap.toml"], arguments].concat());
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    assert_eq!(sandbox.run(&["control", "scene.toml"]).code, 2);
    assert!(!sandbox.path("results").exists());
}

/// Points of the sandbox's rod at two currents, bent at rest by 2 and -1 per metre.
fn shapes(sandbox: &Sandbox) -> String {
    let mut rows = String::from("s,x,y,z,coil.current.x\n");
    for current in ["0", "0.05"] {
        let set = format!("coil.current.x={current}");
        let bent = ["--set", "tube.rest_curvature.x=2", "--set", "tube.rest_curvature.y=-1", "--set", &set];
        let arguments =
            [&["solve", "scene.toml", "--json", "--tolerance", "1e-11", "--shape", "20 mm,50 mm,93 mm"], &bent[..]];
        let value = json(&sandbox.ok(&arguments.concat()).stdout);
        for (k, position) in value["shape"]["position"].as_array().unwrap().iter().enumerate() {
            let cells: Vec<String> = position.as_array().unwrap().iter().map(Value::to_string).collect();
            rows += &format!("{},{},{current}\n", ["20 mm", "50 mm", ""][k], cells.join(","));
        }
    }
    rows
}

#[test]
fn a_shape_is_fitted() {
    let sandbox = sandbox();
    sandbox.write("shapes.csv", &shapes(&sandbox));
    let arguments = ["fit", "scene.toml", "shapes.csv"];
    let output = sandbox.ok(&[&arguments[..], &["--out", "bent.toml", "--plot", "fit.svg"]].concat());
    assert!(output.stdout.contains("fitted: 2 shapes, 18 coordinates"), "{}", output.stdout);
    assert!(fs::read_to_string(sandbox.path("fit.svg")).unwrap().starts_with("<?xml"));
    let value = json(&sandbox.ok(&[&arguments[..], &["--json"]].concat()).stdout);
    for (k, truth) in [2.0, -1.0].into_iter().enumerate() {
        let fitted = value["parameters"][k]["value"].as_f64().unwrap();
        assert!((fitted - truth).abs() < 1e-8, "{value}");
    }
    assert_eq!((&value["converged"], &value["findings"]), (&Value::from(true), &json("[]")));
    // The scene that was written solves to what was seen.
    let solved = json(&sandbox.ok(&["solve", "bent.toml", "--json"]).stdout);
    let tip: Vec<f64> =
        shapes(&sandbox).lines().nth(3).unwrap().split(',').skip(1).take(3).map(|x| x.parse().unwrap()).collect();
    for (a, x) in tip.iter().enumerate() {
        assert!((solved["tip"]["position"][a].as_f64().unwrap() - x).abs() < 1e-9, "{solved}");
    }
    let again = sandbox.run(&[&arguments[..], &["--out", "bent.toml"]].concat());
    assert!(again.code == 2 && again.stderr.contains("--force"), "{}", again.stderr);
}

#[test]
fn ridges_are_named_on_the_command_line() {
    let sandbox = sandbox();
    sandbox.write("shapes.csv", &shapes(&sandbox));
    let free = "tube.rest_curvature.x,tube.youngs_modulus,tube.shear_modulus,coil.turns.x";
    let output = sandbox.ok(&["fit", "scene.toml", "shapes.csv", "--free", free]);
    assert!(output.stdout.contains("identifiability:") && output.stdout.contains("open"), "{}", output.stdout);
    let line = output.stdout.lines().find(|line| line.contains("scale together")).expect("a finding");
    assert!(line.contains("tube.youngs_modulus") && line.contains("coil.turns.x"), "{line}");
}

#[test]
fn mistakes_in_a_fit_are_named() {
    let sandbox = sandbox();
    let tables = [
        ("x,y\n0,0\n", "columns x, y, z"),
        ("x,y,z\n", "no rows"),
        ("x,y,z,coil.curent.x\n0,0,0,0\n", "did you mean `coil.current.x`?"),
        ("x,y,z,coil.current\n0,0,0,0\n", "a group of 3"),
        ("s,x,y,z\n1 m,0,0,0\n", "the length of the rod"),
        ("s,x,y,z\n1 mm,0,,0\n", "`y`: is missing: row 0 has no y"),
        ("s,x,y,z\n1 mm,,,\n", "no row has a place"),
        ("x,y,z\n0,0,0.09\n", ""),
    ];
    for (text, words) in tables {
        sandbox.write("bad.csv", text);
        let output = sandbox.run(&["fit", "scene.toml", "bad.csv"]);
        let expected = if words.is_empty() { 0 } else { 2 };
        assert_eq!(
            (output.code, output.errors().len()),
            (expected, expected as usize / 2),
            "{text:?}: {}",
            output.stderr
        );
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    for (arguments, words) in [
        (&["--free", "tube.rest_curvatur.x"][..], "did you mean `tube.rest_curvature.x`?"),
        (&["--free", "tube.youngs_modulus,tube.youngs_modulus"], "named twice"),
        (&["--free", "tube.rest_curvature,tube.youngs_modulus"], "3 observed numbers cannot determine 4 parameters"),
        (&["--free", "tube.rest_curvature.x+tube.rest_curvature.y"], "is zero and cannot be scaled"),
        (&["--noise", "2 A"], "--noise"),
        (&["--noise", "0 mm"], "positive length"),
        (&["--plot", "a.pdf"], ".png or .svg"),
    ] {
        let output = sandbox.run(&[&["fit", "scene.toml", "bad.csv"], arguments].concat());
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    sandbox.write("bad.csv", "x,y,z,coil.current.x\n0,0,0.09,0\n");
    let output = sandbox.run(&["fit", "scene.toml", "bad.csv", "--free", "coil.current.x"]);
    assert!(output.code == 2 && output.stderr.contains("column of known values"), "{}", output.stderr);
}
