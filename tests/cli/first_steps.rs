//! The first hour: `new`, `examples`, `check`, `parameters`, and a run that is changed and run again.

use crate::sandbox::{Sandbox, json};
use rodsweep::results::Results;
use std::fs;

const KINDS: [&str; 6] = ["catheter", "two-coils", "guidewire", "weight", "coil-array", "field-map"];
/// Of the rows of a file to begin with, at least.
const USABLE: f64 = 0.95;

#[test]
fn every_kind_runs_at_once_and_nearly_all_rows_are_usable() {
    for kind in KINDS {
        let sandbox = Sandbox::new();
        sandbox.ok(&["new", kind, "--out", "mine.toml"]);
        sandbox.ok(&["run", "mine.toml", "--backend", "cpu", "--no-figures", "--quiet"]);
        let results = Results::open(sandbox.path("results/mine")).expect("results");
        let status = results.status().expect("a status");
        let all: u64 = status.counts.iter().sum();
        assert!(status.is_complete() && all >= 32, "{kind}: {all}");
        assert!(status.failed() as f64 <= (1.0 - USABLE) * all as f64, "{kind}: {} of {all} failed", status.failed());
    }
}

#[test]
fn what_new_writes_is_checked_and_tried() {
    for kind in KINDS {
        let sandbox = Sandbox::new();
        let written = sandbox.ok(&["new", kind]);
        let file = format!("{kind}.toml");
        assert!(written.stderr.contains(&format!("rodsweep run {file}")), "{}", written.stderr);
        let told = json(&sandbox.ok(&["check", &file, "--json", "--no-cost"]).stdout);
        assert_eq!((&told["sound"], &told["kind"]), (&true.into(), &"a sweep".into()), "{kind}");
        sandbox.ok(&["run", &file, "--limit", "4", "--backend", "cpu", "--no-figures", "--out", "few"]);
        let text = fs::read_to_string(sandbox.path(&file)).expect("a file");
        // What comments offer is true: commands, methods, formats.
        let comments = || text.lines().filter_map(|line| line.split_once("# ").map(|(_, comment)| comment));
        for command in comments().filter_map(|line| line.trim().strip_prefix("rodsweep ")) {
            let words: Vec<&str> = command.split_whitespace().take(2).collect();
            assert_eq!(words[1], file, "{kind}: {command}");
            sandbox.ok(&[words[0], "--help"]);
        }
        let format = comments().find(|line| line.contains("\"npz\"")).expect("formats");
        for other in format.split('"').skip(1).step_by(2) {
            let used = text.lines().map(|line| match line.starts_with("format = ") {
                true => format!("format = \"{other}\"\n"),
                false => format!("{line}\n"),
            });
            sandbox.write("other.toml", &used.collect::<String>());
            sandbox.ok(&["check", "other.toml", "--no-cost"]);
        }
    }
}

#[test]
fn new_never_overwrites_and_lists_its_kinds() {
    let sandbox = Sandbox::new();
    let listed = sandbox.ok(&["new"]).stdout;
    assert!(KINDS.iter().all(|kind| listed.contains(kind)), "{listed}");
    let wrong = sandbox.run(&["new", "cathter"]);
    assert_eq!(wrong.code, 2);
    assert!(KINDS.iter().all(|kind| wrong.stderr.contains(kind)), "{}", wrong.stderr);
    sandbox.write("field-map.csv", "mine");
    let refused = sandbox.run(&["new", "field-map"]);
    assert_eq!((refused.code, refused.errors().len()), (2, 1), "{}", refused.stderr);
    assert!(!sandbox.path("field-map.toml").exists());
    assert_eq!(fs::read_to_string(sandbox.path("field-map.csv")).expect("a file"), "mine");
    sandbox.ok(&["new", "field-map", "--force"]);
    assert!(fs::read_to_string(sandbox.path("field-map.csv")).expect("a file").starts_with("x [mm]"));
    let twice = sandbox.run(&["new", "field-map"]);
    assert!(twice.code == 2 && twice.stderr.contains("--force"), "{}", twice.stderr);
}

#[test]
fn the_map_of_new_is_a_magnetic_field() {
    let sandbox = Sandbox::new();
    sandbox.ok(&["new", "field-map"]);
    let told = json(&sandbox.ok(&["check", "field-map.toml", "--json", "--no-cost"]).stdout);
    let notes = told["notes"].to_string();
    assert!(notes.contains("div B is 0.00 %") && notes.contains("0.00 % of B has no potential"), "{notes}");
}

#[test]
fn parameters_are_listed_with_values_and_groups() {
    let sandbox = Sandbox::new();
    let text = sandbox.ok(&["parameters", "scene.toml"]).stdout;
    let line = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap_or_default().to_owned();
    assert!(line("tube.length ").contains("80 mm"), "{text}");
    assert!(line("tube.youngs_modulus").contains("5 MPa"), "{text}");
    assert!(line("coil.current ").contains("coil.current.x, coil.current.y, coil.current.z"), "{text}");
    assert!(line("tube.stiffness.bending ").contains(" *"), "{text}");
    let told = json(&sandbox.ok(&["parameters", "sweep.toml", "--json"]).stdout);
    let rows = told["parameters"].as_array().expect("rows");
    for row in rows.iter().filter(|row| row["can_be_set"] == true) {
        // Whatever the list says can be set is taken.
        let (name, value) = (row["name"].as_str().expect("a name"), &row["value"]);
        if name == "insertion" {
            assert!((value.as_f64().expect("a number") - 0.093).abs() < 1e-12);
        }
        assert!(row["meaning"].as_str().is_some_and(|meaning| meaning.len() > 4), "{row}");
    }
    let axis = rows.iter().find(|row| row["name"] == "coil.turns.z").expect("turns");
    assert_eq!((axis["value"].as_f64(), &axis["unit"]), (Some(100.0), &"".into()));
    sandbox.ok(&["run", "sweep.toml", "--backend", "cpu", "--no-figures", "--quiet"]);
    let of_directory = sandbox.ok(&["parameters", "results/sweep"]).stdout;
    assert_eq!(of_directory, text);
}

#[test]
fn check_tells_every_mistake_at_once() {
    let sandbox = Sandbox::new();
    let scene = fs::read_to_string(sandbox.path("scene.toml")).expect("a scene");
    sandbox.write("scene.toml", &scene.replace("length = \"80 mm\"", "length = \"80 mA\""));
    let sweep = fs::read_to_string(sandbox.path("sweep.toml")).expect("a sweep");
    let broken = sweep.replace("method = \"grid\"", "method = \"gird\"").replace("tolerance", "tolerence");
    sandbox.write("sweep.toml", &broken.replace("\"coil.current\"", "\"coil.curent\""));
    let output = sandbox.run(&["check", "sweep.toml"]);
    assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{}", output.stderr);
    for words in [
        "scene.toml:11: `segment[0].length`",
        "sweep.toml:3: `sampling.method`: \"gird\" is not known: did you mean `grid`?",
        "did you mean `tolerance`?",
        "did you mean `coil.current`?",
    ] {
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    assert_eq!(output.errors().len(), 4, "{}", output.stderr);
    let told = json(&sandbox.run(&["check", "sweep.toml", "--json"]).stdout);
    assert_eq!((&told["sound"], told["errors"].as_array().expect("errors").len()), (&false.into(), 4));
    let missing = sandbox.run(&["check", "none.toml"]);
    assert_eq!((missing.code, missing.errors().len()), (2, 1), "{}", missing.stderr);
}

#[test]
fn check_tells_what_a_sound_file_is_and_costs() {
    let sandbox = Sandbox::new();
    let told = json(&sandbox.ok(&["check", "sweep.toml", "--json"]).stdout);
    assert_eq!((&told["kind"], &told["samples"], &told["samples_tried"]), (&"a sweep".into(), &5.into(), &5.into()));
    assert!(told["seconds"].as_f64().is_some_and(|seconds| seconds > 0.0), "{told}");
    assert_eq!(told["usable_share"].as_f64(), Some(1.0));
    let scene = sandbox.ok(&["check", "scene.toml"]).stdout;
    assert!(scene.contains("a scene, nothing is wrong") && scene.contains("segments: 2, 93.00 mm"), "{scene}");
    sandbox.write("circle.toml", "shape = \"circle\"\nsize = \"10 mm\"\ncentre = [0, 0, \"90 mm\"]\npoints = 8\n");
    let without = sandbox.run(&["check", "circle.toml"]);
    assert!(without.code == 2 && without.stderr.contains("name the scene"), "{}", without.stderr);
    let with = sandbox.run(&["check", "circle.toml", "--scene", "scene.toml"]);
    assert!(with.stdout.contains("a trajectory") || with.code == 2, "{}", with.stderr);
    assert!(!sandbox.path("results").exists());
}

#[test]
fn every_example_is_listed_and_sound_where_it_is_written() {
    let sandbox = Sandbox::new();
    let listed = sandbox.ok(&["examples"]).stdout;
    let names: Vec<&str> =
        listed.lines().take_while(|line| !line.is_empty()).filter_map(|line| line.split(' ').next()).collect();
    assert!(names.contains(&"workspace") && names.contains(&"scenes/p6") && names.len() > 20, "{listed}");
    assert!(
        listed
            .lines()
            .take(names.len())
            .all(|line| line.split_once(' ').is_some_and(|(_, what)| what.trim().len() > 3))
    );
    for name in &names {
        sandbox.ok(&["examples", name, "--out", name]);
        let file = format!("{name}/{name}.toml");
        let scene = if name.starts_with("trajectories") { &["--scene", "scene.toml"][..] } else { &[] };
        sandbox.ok(&[&["check", &file, "--no-cost"], scene].concat());
    }
    // What is there and the same stays; what differs is kept.
    sandbox.ok(&["examples", "lap", "--out", "lap"]);
    sandbox.write("lap/lap.csv", "mine");
    assert_eq!(sandbox.run(&["examples", "lap", "--out", "lap"]).code, 2);
    sandbox.ok(&["examples", "lap", "--out", "lap", "--force"]);
    let wrong = sandbox.run(&["examples", "wrkspace"]);
    assert!(wrong.code == 2 && wrong.stderr.contains("workspace"), "{}", wrong.stderr);
}

const RUN: [&str; 6] = ["run", "sweep.toml", "--backend", "cpu", "--out", "out"];

#[test]
fn force_replaces_a_run_and_spares_what_is_not_ours() {
    let sandbox = Sandbox::new();
    let sweep = fs::read_to_string(sandbox.path("sweep.toml")).expect("a sweep");
    let sweep = sweep.replace("coil.current.x", "coil.current.z").replace("points = 5", "points = 9");
    sandbox.write("sweep.toml", &sweep);
    sandbox.ok(&RUN);
    sandbox.ok(&["sensitivity", "sweep.toml", "--backend", "cpu", "--out", "study"]);
    sandbox.ok(&["workspace", "out", "--voxel", "20mm", "--backend", "cpu", "--fast"]);
    sandbox.write("sweep.toml", &sweep.replace("to = \"0.1 A\"", "to = \"0.05 A\""));
    let refused = sandbox.run(&RUN);
    let words = "`[[axis]] coil.current.z.to`: 50 mA, was 0.1 A; `--force` replaces it, `--out DIR` keeps both";
    assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
    sandbox.write("out/notes.txt", "mine");
    let spared = sandbox.run(&[&RUN[..], &["--force"]].concat());
    assert!(spared.code == 2 && spared.stderr.contains("notes.txt"), "{}", spared.stderr);
    assert!(sandbox.path("out/part-0000000000.parquet").exists());
    fs::remove_file(sandbox.path("out/notes.txt")).expect("removed");
    sandbox.ok(&[&RUN[..], &["--force"]].concat());
    let spec = Results::open(sandbox.path("out")).expect("results").spec().to_toml();
    assert!(spec.contains("to = 0.05"), "{spec}");
    assert!(!sandbox.path("out/workspace.json").exists());
    let study = ["sensitivity", "sweep.toml", "--backend", "cpu", "--out", "study"];
    assert_eq!(sandbox.run(&study).code, 2);
    sandbox.ok(&[&study[..], &["--force"]].concat());
    // A directory without a run is never emptied.
    fs::create_dir(sandbox.path("other")).expect("a folder");
    sandbox.write("other/inputs.csv", "mine");
    let other = sandbox.run(&["run", "sweep.toml", "--backend", "cpu", "--out", "other", "--force"]);
    assert!(other.code == 2 && sandbox.path("other/inputs.csv").exists(), "{}", other.stderr);
}

#[test]
fn a_study_takes_the_rows_of_the_run() {
    let sandbox = Sandbox::new();
    let sweep = |derivatives: &str| {
        let text = "scene = \"scene.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = 64\nseed = 1\n[[axis]]\n\
                    parameter = \"coil.current.z\"\nfrom = \"20 mA\"\nto = \"60 mA\"\n[[axis]]\n\
                    parameter = \"tube.youngs_modulus\"\nrelative = \"10 %\"\n[output]\n";
        format!("{text}derivatives = [{derivatives}]\n")
    };
    sandbox.write("few.toml", &sweep("\"coil.current\""));
    sandbox.write("enough.toml", &sweep("\"coil.current\", \"tube.youngs_modulus\""));
    let more = ["--backend", "cpu", "--no-figures"];
    for name in ["few.toml", "enough.toml"] {
        sandbox.ok(&[&["run", name][..], &more].concat());
    }
    let enough = sandbox.ok(&[&["sensitivity", "enough.toml"][..], &more].concat());
    assert!(enough.stderr.contains("rows: those of results/enough"), "{}", enough.stderr);
    assert!(!enough.stderr.contains("solved "), "{}", enough.stderr);
    let few = sandbox.ok(&[&["sensitivity", "few.toml"][..], &more].concat());
    assert!(few.stderr.contains("results/few lacks derivatives by tube.youngs_modulus"), "{}", few.stderr);
    assert!(sandbox.path("results/few-sensitivity/indices.csv").is_file());
    // The answer comes first, and alone where quiet is asked for.
    let first = enough.stdout.lines().next().unwrap_or_default().to_owned();
    assert!(
        first.starts_with("the tip is off by ") && first.contains("(median)") && first.contains("(95 %)"),
        "{first}"
    );
    assert!(first.contains("by share of its variance: coil.current.z ("), "{first}");
    assert!(enough.stdout.contains("S1 ±") && enough.stdout.contains("ST bound"), "{}", enough.stdout);
    let quiet = sandbox.ok(&[&["sensitivity", "enough.toml", "--quiet"][..], &more].concat());
    assert_eq!(quiet.stdout, first + "\n");
}
