//! `rodsweep control --experiment` and `--replay`, and the rod in motion, as a user meets them.

use crate::common::root;
use crate::common::texts::SCENE;
use crate::sandbox::{Sandbox, json};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

static P6: LazyLock<String> =
    LazyLock::new(|| root().join("sweeps/scenes/p6.toml").to_str().expect("a path in UTF-8").to_owned());
const CURRENTS: &str = "coil.current.x,coil.current.y,coil.current.z\n\
    0.05 A,0,0.1 A\n0.1,0.02,0.15\n-0.1,0.05,0.12\n0.02,-0.1,-0.1\n0.15,0.1,-0.05\n";

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

fn is_png(path: &Path) -> bool {
    fs::read(path).unwrap().starts_with(b"\x89PNG")
}

#[test]
fn the_experiment_stands_beside_what_was_measured() {
    let sandbox = Sandbox::new();
    let arguments = ["control", &P6, "--experiment", "--catheters", "3"];
    let output = sandbox.ok(&arguments);
    let text = &output.stdout;
    assert!(text.starts_with("SIMULATION, no measurement: 3 catheters (seeds from 1), 10 trials each"), "{text}");
    for words in ["rest curvature is off by 0.5 1/m", "10 %", "drifting by 0.05 1/m", "0.3 mm of noise", "disagree"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let measured = [("circle", "4.34"), ("lemniscate", "6.49"), ("rectangle", "4.60"), ("butterfly", "3.66")];
    for (name, number) in measured {
        let line = text.lines().find(|line| line.starts_with(name)).expect("a row");
        assert!(line.contains("200 of 200") && line.contains(number), "{line}");
    }
    let dir = sandbox.path("results/control-experiment");
    assert!(is_png(&dir.join("experiment.png")));
    let page = fs::read_to_string(dir.join("experiment.md")).unwrap();
    assert_eq!(page.lines().filter(|line| line.starts_with("| ")).count(), 6, "{page}");
    let table = fs::read_to_string(dir.join("experiment.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 4 * 3, "{table}");
    // The catheter in the middle is drawn.
    let square = |seed: &str| -> f64 {
        let rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>()).filter(|cells| cells[1] == seed);
        rows.map(|cells| cells[2].parse::<f64>().unwrap().powi(2)).sum()
    };
    let mut seeds = ["1", "2", "3"];
    seeds.sort_by(|a, b| square(a).total_cmp(&square(b)));
    let words = format!("the catheter of seed {}, the median", seeds[1]);
    assert!(output.stderr.contains(&words), "{words}: {}", output.stderr);
    // The middle one of three catheters is the median.
    let value = json(&sandbox.ok(&[&arguments[..], &["--json", "--force", "--no-figures"]].concat()).stdout);
    assert_eq!(value["simulation"], true);
    for trajectory in value["trajectories"].as_array().unwrap() {
        let name = trajectory["name"].as_str().unwrap();
        let rows = table.lines().filter(|line| line.starts_with(name));
        let mut all: Vec<f64> = rows.map(|row| row.split(',').nth(2).unwrap().parse().unwrap()).collect();
        all.sort_by(f64::total_cmp);
        assert!((number(&trajectory["rmse"][1]) - all[1]).abs() < 1e-12, "{trajectory}");
        assert!(number(&trajectory["rmse"][0]) > all[0] && number(&trajectory["rmse"][2]) < all[2], "{trajectory}");
        assert!(number(&trajectory["aligned_rmse"][1]) < all[1]);
        // Three coordinates of noise, seen against the mean of ten trials, and some drift.
        assert!((4.9e-4..7e-4).contains(&number(&trajectory["repeatability"][1])), "{trajectory}");
    }
    let measured: Vec<&Value> =
        value["trajectories"].as_array().unwrap().iter().map(|t| &t["measured_aligned_rmse"]).collect();
    assert!(number(measured[0]) == 1.81e-3 && measured[1..].iter().all(|value| value.is_null()), "{measured:?}");
}

#[test]
fn an_experiment_that_cannot_be_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.write("bare.toml", &SCENE.replace("name = \"coil\"", "name = \"winding\""));
    for (arguments, words) in [
        (&["control", "bare.toml", "--experiment"][..], "circle.toml:14: `input[0].parameter`"),
        (&["control", &P6, "--experiment", "--catheters", "0"], "--catheters"),
        (&["control", &P6, "--experiment", "--simulate"], "cannot be used with"),
        (&["control", &P6, "--experiment", "--targets", "a.csv"], "cannot be used with"),
    ] {
        let output = sandbox.run(arguments);
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    assert!(!sandbox.path("results").exists());
}

/// Tips of the model at the currents above.
fn tips(sandbox: &Sandbox) -> Vec<[f64; 3]> {
    let value = json(&sandbox.ok(&["control", &P6, "--replay", "lap.csv", "--json", "--force", "--no-figures"]).stdout);
    assert_eq!((&value["states"], &value["lost"]), (&Value::from(5), &Value::from(0)));
    let tips = value["tips"].as_array().unwrap().iter();
    tips.map(|tip| [0, 1, 2].map(|a| number(&tip[a]))).collect()
}

fn table(rows: impl IntoIterator<Item = (usize, [f64; 3])>) -> String {
    let row = |(point, [x, y, z]): (usize, [f64; 3])| format!("{point},{x:?},{y:?},{z:?}\n");
    "point,x,y,z\n".to_owned() + &rows.into_iter().map(row).collect::<String>()
}

#[test]
fn recorded_currents_are_replayed() {
    let sandbox = Sandbox::new();
    sandbox.write("lap.csv", CURRENTS);
    let tips = tips(&sandbox);
    // What one state gives is what `solve` gives.
    let set = ["--set", "coil.current.x=0.1", "--set", "coil.current.y=0.02", "--set", "coil.current.z=0.15"];
    let solved = json(&sandbox.ok(&[&["solve", &P6, "--json"][..], &set].concat()).stdout);
    (0..3).for_each(|a| assert!((number(&solved["tip"]["position"][a]) - tips[1][a]).abs() < 1e-7, "{tips:?}"));

    let moved = |[x, y, z]: [f64; 3]| [x + 2e-3, y - 3e-3, z + 6e-3];
    let turned = |[x, y, z]: [f64; 3]| [-y + 0.01, x, z - 0.02];
    let arguments = ["control", &P6, "--replay", "lap.csv", "--observed", "seen.csv", "--json", "--force"];
    let compare = |rows: Vec<(usize, [f64; 3])>| {
        sandbox.write("seen.csv", &table(rows));
        json(&sandbox.ok(&arguments).stdout)["observed"].clone()
    };
    let rows = |of: &dyn Fn([f64; 3]) -> [f64; 3]| tips.iter().map(|tip| of(*tip)).enumerate().collect::<Vec<_>>();
    let found = compare(rows(&moved).into_iter().rev().take(4).collect());
    assert_eq!(found["count"], 4);
    assert!((number(&found["rmse"]) - 7e-3).abs() < 1e-9, "{found}");
    assert!(number(&found["rmse_without_offset"]) < 1e-9 && number(&found["aligned_rmse"]) < 1e-9, "{found}");
    assert!((number(&found["offset"][1]) + 3e-3).abs() < 1e-9, "{found}");
    let dir = sandbox.path("results/replay-lap");
    let residuals = fs::read_to_string(dir.join("residuals.csv")).unwrap();
    let line: Vec<f64> = residuals.lines().nth(1).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    assert!(line[0] == 4.0 && (line[4] - 2e-3).abs() < 1e-9 && (line[7] - 7e-3).abs() < 1e-9, "{residuals}");
    assert!(is_png(&dir.join("replay.png")));
    assert_eq!(fs::read_to_string(dir.join("replay.csv")).unwrap().lines().count(), 6);
    // A rotation is no offset.
    let found = compare(rows(&turned));
    assert!(number(&found["aligned_rmse"]) < 1e-9 && number(&found["rmse_without_offset"]) > 1e-3, "{found}");
}

#[test]
fn mistakes_in_a_replay_are_named() {
    let sandbox = Sandbox::new();
    sandbox.write("lap.csv", CURRENTS);
    sandbox.write("bad.csv", "coil.curent.x\n0\n");
    sandbox.write("long.csv", "insertion\n-1 m\n");
    for (observed, words) in [
        ("x,y\n0,0\n", "seen.csv: `x`: is missing"),
        ("x,y,z\n", "no rows"),
        ("x,y,z,pint\n0,0,0,0\n", "did you mean `point`?"),
        ("point,x,y,z\n5,0,0,0\n", "`point`: is 5 in row 0"),
        ("point,x,y,z\n0.5,0,0,0\n", "`point`: is 0.5 in row 0"),
        ("x,y,z\n0,1 A,0\n", "seen.csv:2: `y`"),
    ] {
        sandbox.write("seen.csv", observed);
        let output = sandbox.run(&["control", &P6, "--replay", "lap.csv", "--observed", "seen.csv"]);
        assert_eq!((output.code, output.errors().len()), (2, 1), "{observed:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    for (arguments, words) in [
        (&["--replay", "bad.csv"][..], "did you mean `coil.current.x`?"),
        (&["--replay", "long.csv"], "long.csv: no row gives a rod"),
        (&["--observed", "seen.csv", "lap.csv"], "cannot be used with"),
        (&["--observed", "seen.csv"], "--replay <FILE>"),
    ] {
        let output = sandbox.run(&[&["control", &P6][..], arguments].concat());
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    assert!(!sandbox.path("results").exists());
}

/// The value of an attribute in each element that has it.
fn attributes<'a>(text: &'a str, name: &str) -> Vec<&'a str> {
    text.split(&format!(" {name}=\"")).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn the_rod_moves_along_a_closed_path() {
    let sandbox = Sandbox::new();
    let lap = r#"shape = "circle"
size = "5 mm"
centre = [0, "20 mm", 0]
points = 12
coordinates = ["x", "y"]
duration = "6 s"
[[input]]
parameter = "coil.current"
from = "-1 A"
to = "1 A"
"#;
    sandbox.write("lap.toml", lap);
    sandbox.write("arc.csv", "x,y\n0,20 mm\n2 mm,20 mm\n4 mm,21 mm\n");
    sandbox.ok(&["control", "scene.toml", "lap.toml", "--out", "lap"]);
    let text = fs::read_to_string(sandbox.path("lap/motion.svg")).unwrap();
    assert!(text.len() < 500_000);
    assert!(attributes(&text, "dur").iter().all(|seconds| *seconds == "6s"));
    let values = attributes(&text, "values");
    // In each of four panels two segments move and the tip's path grows.
    assert_eq!(values.len(), 4 * 3);
    for values in values {
        let frames: Vec<&str> = values.split(';').collect();
        assert_eq!(frames.len(), 13);
        match frames[0].starts_with('M') {
            true => assert!(frames[0] == frames[12] && frames[0] != frames[3], "a lap ends where it began"),
            false => assert_eq!((frames[0], frames[12]), ("1", "0")),
        }
    }
    sandbox.ok(&["control", "scene.toml", "arc.csv", "--out", "arc", "--input", "coil.current=1"]);
    let text = fs::read_to_string(sandbox.path("arc/motion.svg")).unwrap();
    let ends = attributes(&text, "values").into_iter().find(|values| values.starts_with('M')).map(|values| {
        let frames: Vec<&str> = values.split(';').collect();
        (frames.len(), frames[0] == frames[frames.len() - 1])
    });
    assert_eq!(ends, Some((3, false)), "what is open stays open");
}
