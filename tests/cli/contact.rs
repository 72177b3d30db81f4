//! `rodsweep contact` as a user meets it: files, JSON, words, mistakes.

use crate::sandbox::{Sandbox, json};
use rodsweep::results::read_parquet_table;
use std::fs;

const SWEEP: &str = "[sampling]
method = \"sobol\"
samples = 16
[[axis]]
parameter = \"base.position.x\"
from = \"-1 mm\"
to = \"1 mm\"
[[axis]]
parameter = \"base.position.z\"
from = \"-0.06 mm\"
to = \"0.06 mm\"
[scene]
name = \"wire\"
[scene.wall]
kind = \"plane\"
position = [\"2 mm\", 0, 0]
normal = [1, 0, 0]
friction = 0.1
stiffness = \"10 N/m\"
[[scene.segment]]
name = \"wire\"
kind = \"flexible\"
length = \"100 mm\"
stiffness = { bending = 2e-5, torsion = 1.5e-5 }
";

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("wall.toml", SWEEP);
    sandbox
}

#[test]
fn a_map_is_written_and_told() {
    let sandbox = sandbox();
    let told = sandbox.ok(&["contact", "wall.toml", "--extent", "3mm", "--out", "out"]);
    let first = told.stdout.lines().next().unwrap_or_default();
    assert!(first.starts_with("the tip can press on ") && first.contains("N at"), "{}", told.stdout);
    let account = json(&fs::read_to_string(sandbox.path("out/contact.json")).unwrap());
    assert!(account["points"].as_u64().unwrap() > 20);
    assert!(account["check"]["checked"].as_u64().unwrap() > 0 && account["distrusted"].is_null());
    assert!(told.stdout.contains("equilibria were checked against the reference"), "{}", told.stdout);
    assert!(account["area"].as_f64().unwrap() > 0.0 && account["best"]["force"].as_f64().unwrap() > 0.0);
    let table = read_parquet_table(&sandbox.path("out/contact.parquet")).unwrap();
    for name in [
        "point.x",
        "normal.z",
        "reached",
        "cause",
        "force.least",
        "force.most",
        "ratio",
        "angle",
        "margin",
        "least:base.position.x",
        "most:base.position.z",
    ] {
        assert!(table.column(name).is_some(), "{name}");
    }
    for name in ["force.png", "force.svg", "angle.png"] {
        assert!(fs::metadata(sandbox.path("out").join(name)).unwrap().len() > 500, "{name}");
    }
    let uncertain = "[[uncertain]]\nparameter = \"wire.stiffness.bending\"\nrelative = \"10 %\"\n";
    sandbox.write("uncertain.toml", &format!("{uncertain}{SWEEP}"));
    let arguments =
        ["contact", "uncertain.toml", "--extent", "3mm", "--robust", "--designs", "4", "--out", "robust", "--json"];
    let account = json(&sandbox.ok(&arguments).stdout);
    assert_eq!(account["robust"]["designs"], 4);
    let table = read_parquet_table(&sandbox.path("robust/contact.parquet")).unwrap();
    assert!(table.column("hold.probability").is_some() && sandbox.path("robust/robust_designs.csv").exists());
    let arguments = ["contact", "wall.toml", "--extent", "1mm", "--force", "0.1mN", "--out", "mu", "--json"];
    let account = json(&sandbox.ok(&arguments).stdout);
    assert_eq!(account["force"], 1e-4);
    assert!(fs::metadata(sandbox.path("mu/friction.png")).unwrap().len() > 500);
}

#[test]
fn mistakes_name_their_remedy() {
    let sandbox = sandbox();
    sandbox.write("slick.toml", &SWEEP.replace("friction = 0.1\n", ""));
    let cases: [(&[&str], &str); 7] = [
        (&["contact", "sweep.toml"], "[wall]"),
        (&["contact", "slick.toml"], "`--force"),
        (&["contact", "wall.toml", "--voxel", "1um"], "--voxel"),
        (&["contact", "wall.toml", "--force", "1mm"], "--force"),
        (&["contact", "wall.toml", "--extent", "1mm", "--robust"], "[[uncertain]]"),
        (&["contact", "wall.toml", "--minimum-margin", "1.5"], "--minimum-margin"),
        (&["contact", "wall.toml", "--backend", "gpu"], "walls are for the CPU"),
    ];
    for (arguments, word) in cases {
        let output = sandbox.run(arguments);
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(word), "{arguments:?}: {}", output.stderr);
    }
    assert!(!sandbox.path("results").exists());
}
