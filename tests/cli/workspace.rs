//! `rodsweep workspace` as a user meets it: files, JSON, words, exit codes, mistakes.

use crate::common::root;
use crate::sandbox::{Sandbox, json};
use rodsweep::results::read_parquet_table;
use serde_json::Value;
use std::fs;

fn sweep(axes: &[(&str, &str, &str)], more: &str) -> String {
    let scene = root().join("sweeps/scenes/p6.toml");
    let mut text = format!("scene = \"{}\"\n[sampling]\nmethod = \"sobol\"\nsamples = 4096\n", scene.display());
    for (name, from, to) in axes {
        text += &format!("[[axis]]\nparameter = \"{name}\"\nfrom = \"{from}\"\nto = \"{to}\"\n");
    }
    text + more
}

const BODY: [(&str, &str, &str); 4] = [
    ("coil.current.x", "-0.3 A", "0.3 A"),
    ("coil.current.y", "-0.3 A", "0.3 A"),
    ("coil.current.z", "-0.3 A", "0.3 A"),
    ("insertion", "64.3 mm", "94.3 mm"),
];

fn account(sandbox: &Sandbox, dir: &str) -> Value {
    serde_json::from_slice(&fs::read(sandbox.path(dir).join("workspace.json")).unwrap()).unwrap()
}

#[test]
fn a_body_is_measured_from_a_sweep() {
    let sandbox = Sandbox::new();
    sandbox.write("body.toml", &sweep(&BODY, ""));
    let arguments = ["workspace", "body.toml", "--voxel", "4mm", "--out", "out", "--json", "--vtk", "--backend", "cpu"];
    let output = sandbox.ok(&arguments);
    // The first keys are those that scripts look for.
    let places = ["\"dimension\"", "\"volume\"", "\"area\"", "\"check\""].map(|key| output.stdout.find(key).unwrap());
    assert!(places.is_sorted() && output.stdout.trim_start().starts_with("{\n  \"dimension\": 3"), "{}", output.stdout);
    let told = json(&output.stdout);
    assert_eq!(told, account(&sandbox, "out"));
    let volume = told["volume"]["value"].as_f64().unwrap();
    assert!((volume * 1e6 - 281.5).abs() < 6.0, "{volume}");
    assert!(told["volume"]["low"].as_f64().unwrap() < volume && volume < told["volume"]["high"].as_f64().unwrap());
    assert!(told["area"].is_null());
    assert_eq!(told["check"]["agrees"], true);
    let table = read_parquet_table(&sandbox.path("out/workspace.parquet")).unwrap();
    let columns =
        ["voxel.x", "count", "reached", "cause", "coil.current.y", "insertion", "stability.margin", "sigma.3"];
    let more = ["manipulability", "isotropy", "compliance.most", "input_reserve", "boundary_distance", "solutions"];
    for name in columns.iter().chain(&more).chain(&["orientations", "density", "stability.margin.least"]) {
        assert!(table.column(name).is_some(), "{name}");
    }
    let reached: Vec<f64> = table.numbers("reached").unwrap();
    let inside = reached.iter().filter(|flag| **flag == 1.0).count();
    assert!((inside as f64 * 4e-3f64.powi(3) - volume).abs() < 1e-12);
    // Distances have the sign of their side.
    let distances = table.numbers("boundary_distance").unwrap();
    assert!(reached.iter().zip(&distances).all(|(flag, d)| d.is_nan() || (*d >= 0.0) == (*flag == 1.0)));
    for name in ["boundary.vtp", "boundary.ply", "workspace.vti", "workspace.png", "convergence.svg", "compliance.png"]
    {
        assert!(fs::metadata(sandbox.path("out").join(name)).unwrap().len() > 500, "{name}");
    }
    // The same again, whatever the number of threads.
    let again = sandbox.ok(&[
        "workspace",
        "body.toml",
        "--voxel",
        "4mm",
        "--out",
        "again",
        "--json",
        "--no-figures",
        "--quiet",
    ]);
    assert_eq!(json(&again.stdout)["volume"], told["volume"]);
    assert!(again.stderr.is_empty(), "{}", again.stderr);
    assert!(!sandbox.path("again/workspace.png").exists());
}

#[test]
fn a_run_is_measured_from_its_rows() {
    let sandbox = Sandbox::new();
    sandbox.write("body.toml", &sweep(&BODY, ""));
    sandbox.ok(&["run", "body.toml", "--out", "rows", "--backend", "cpu"]);
    let told = json(&sandbox.ok(&["workspace", "rows", "--voxel", "8mm", "--json", "--no-figures"]).stdout);
    assert!((told["volume"]["value"].as_f64().unwrap() * 1e6 - 281.5).abs() < 12.0);
    // A pattern for rows finds no voxels, and a table that an earlier version left beside them gives way.
    let tables = |folder: &str| {
        let names =
            fs::read_dir(sandbox.path(folder)).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.ends_with(".parquet")).collect::<Vec<_>>()
    };
    assert!(tables("rows").iter().all(|name| name.starts_with("part-")), "{:?}", tables("rows"));
    assert!(tables("rows/tables").contains(&"workspace.parquet".to_owned()), "{:?}", tables("rows/tables"));
    fs::rename(sandbox.path("rows/tables/workspace.parquet"), sandbox.path("rows/workspace.parquet")).unwrap();
    let again =
        ["workspace", "body.toml", "--voxel", "8mm", "--no-figures", "--json", "--out", "other", "--compare", "rows"];
    let before = json(&sandbox.ok(&again).stdout);
    sandbox.ok(&["workspace", "rows", "--voxel", "8mm", "--no-figures", "--quiet"]);
    assert!(!sandbox.path("rows/workspace.parquet").exists());
    assert_eq!(json(&sandbox.ok(&[&again[..], &["--force"]].concat()).stdout)["comparison"], before["comparison"]);
    fs::write(sandbox.path("rows/tables/mine.txt"), "mine").unwrap();
    let refused = sandbox.run(&["run", "body.toml", "--out", "rows", "--backend", "cpu", "--force"]);
    assert!(refused.code != 0 && refused.stderr.contains("tables/mine.txt"), "{}", refused.stderr);
    fs::remove_file(sandbox.path("rows/tables/mine.txt")).unwrap();
    sandbox.ok(&["run", "body.toml", "--out", "rows", "--backend", "cpu", "--force"]);
    assert!(!sandbox.path("rows/tables").exists());
    // A run without rows has kept tips; its own voxels go on to be found.
    sandbox.write("none.toml", &sweep(&BODY, "[output]\nformat = \"none\"\n[workspace]\nvoxel = \"8 mm\"\n"));
    sandbox.ok(&["run", "none.toml", "--out", "none", "--backend", "cpu"]);
    let before = fs::read(sandbox.path("none/workspace.parquet")).unwrap();
    sandbox.ok(&["workspace", "none", "--json", "--no-figures"]);
    assert_eq!(fs::read(sandbox.path("none/touched.parquet")).unwrap(), before);
    sandbox.ok(&["figures", "none"]);
}

#[test]
fn queries_designs_and_comparisons_are_answered() {
    let sandbox = Sandbox::new();
    let uncertain =
        "[[uncertain]]\nparameters = [\"proximal.youngs_modulus\", \"distal.youngs_modulus\"]\nrelative = \"10 %\"\n";
    sandbox.write("body.toml", &sweep(&BODY, uncertain));
    sandbox.write("targets.csv", "x,y,z\n0.01,-0.04,0.07\n0.2,0,0\n");
    let base = ["workspace", "body.toml", "--voxel", "8mm", "--no-figures", "--json", "--quiet"];
    let with = |more: &[&str]| json(&sandbox.ok(&[&base, more].concat()).stdout);
    let told = with(&["--out", "a", "--reach", "targets.csv", "--robust", "--designs", "4"]);
    assert_eq!(told["reach"][0]["status"], "reached");
    assert!(["at-limit", "stuck"].contains(&told["reach"][1]["status"].as_str().unwrap()), "{told}");
    assert!(told["reach"][1]["boundary_distance"].as_f64().unwrap() < -0.05);
    let sizes: Vec<f64> = told["robust"]["reached_by_share"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["size"].as_f64().unwrap())
        .collect();
    assert!(sizes.windows(2).all(|pair| pair[0] <= pair[1]) && sizes[0] > 1e-4, "{sizes:?}");
    for name in ["reach.csv", "robust.parquet", "robust_designs.csv"] {
        assert!(sandbox.path("a").join(name).is_file(), "{name}");
    }
    let told = with(&["--out", "b", "--reach", "10 mm,-40 mm,70 mm,0,-1,0"]);
    assert!(told["reach"][0]["tangent_error"].as_f64().is_some());
    let told = with(&["--out", "c", "--vary", "proximal.youngs_modulus+distal.youngs_modulus=-10%..10%:3"]);
    let volumes: Vec<f64> = (0..3).map(|k| told["study"]["designs"][k]["size"]["value"].as_f64().unwrap()).collect();
    assert!(volumes[0] > volumes[1] && volumes[1] > volumes[2], "{volumes:?}");
    let told = with(&["--out", "d", "--minimum-margin", "0.5", "--compare", "a"]);
    assert_eq!(told["comparison"]["gained"].as_f64(), Some(0.0));
    assert!(told["comparison"]["lost"].as_f64().unwrap() > 1e-5);
}

#[test]
fn where_nothing_is_reached_it_is_said_in_plain_words() {
    let sandbox = Sandbox::new();
    sandbox.write("body.toml", &sweep(&BODY, ""));
    let command = ["workspace", "body.toml", "--voxel", "150mm", "--no-figures", "--reach", "10 mm,-40 mm,70 mm"];
    let told = sandbox.run(&[&command[..], &["--out", "out"]].concat());
    assert_eq!(told.code, 3, "{}", told.stderr);
    let first = told.stdout.lines().next().unwrap_or_default();
    assert!(first.contains("no voxel's centre is reached, so there is no size, margin or pose to tell"), "{first}");
    assert!(told.stdout.contains("with nothing to compare it with"), "{}", told.stdout);
    for word in ["NaN", "inf ", "-0.00", "agrees", "margin: ", "pose: ", "volume = ", "area = "] {
        assert!(!told.stdout.contains(word), "{word}: {}", told.stdout);
    }
    let found = account(&sandbox, "out");
    assert_eq!((&found["check"]["agrees"], &found["multiplicity"]), (&Value::from(false), &Value::Null));
    assert_eq!(found["share_with_margin"], Value::Array(Vec::new()));
    let quiet = sandbox.run(&[&command[..], &["--out", "quiet", "--quiet"]].concat());
    assert_eq!(quiet.stdout.trim_end(), first);
}

#[test]
fn mistakes_are_named_and_nothing_is_written() {
    let sandbox = Sandbox::new();
    sandbox.write("body.toml", &sweep(&BODY, ""));
    sandbox.write("stiff.toml", &sweep(&[("distal.youngs_modulus", "1 MPa", "5 MPa")], ""));
    sandbox.write("nan.csv", "x,y,z\n0.01,nan,0.07\n");
    fs::create_dir(sandbox.path("foreign")).unwrap();
    sandbox.write("angles.toml", &sweep(&BODY, "[output]\nquantities = [\"stability\"]\n"));
    sandbox.ok(&["run", "angles.toml", "--out", "angles", "--backend", "cpu", "--limit", "64"]);
    let cases: [(&[&str], &str); 11] = [
        (&["workspace", "foreign"], "run.json"),
        (&["workspace", "angles", "--out", "out"], "quantities"),
        (&["workspace", "stiff.toml", "--out", "out"], "[[uncertain]]"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "0.05mm"], "take voxels of at least"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "0mm"], "greater than zero"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "8mm", "--minimum-margin", "1.5"], "--minimum-margin"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "8mm", "--reach", "nan.csv"], "nan.csv"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "8mm", "--reach", "1 mm,2 mm"], "--reach"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "8mm", "--robust"], "[[uncertain]]"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "8mm", "--vary", "nothing=1..2:3"], "nothing"),
        (&["workspace", "body.toml", "--out", "out", "--voxel", "8mm", "--compare", "foreign"], "same voxel and seed"),
    ];
    for (arguments, words) in cases {
        let output = sandbox.run(&[arguments, &["--quiet", "--no-figures"]].concat());
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{arguments:?}: {}", output.stderr);
        assert!(!sandbox.path("out").exists(), "{arguments:?} wrote something");
    }
}
