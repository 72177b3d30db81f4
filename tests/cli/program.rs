//! The program as a user meets it: words, files, exit codes. Broken input files are in `cli_bad_input`.

use crate::common::texts::{SWEEP, sweep};
use crate::sandbox::{Sandbox, json};
use rodsweep::backend::Backend;
use rodsweep::input::read_scene;
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity};
use rodsweep::reference::Reference;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::io::Read;
use std::process::Stdio;
use std::time::{Duration, Instant};

const COMMANDS: [&str; 11] =
    ["run", "solve", "verify", "bench", "doctor", "status", "merge", "control", "fit", "import", "completions"];

fn keys(value: &Value) -> BTreeSet<String> {
    value.as_object().expect("an object").keys().cloned().collect()
}

#[test]
fn help_and_version() {
    let sandbox = Sandbox::new();
    let help = sandbox.ok(&["--help"]);
    assert!(COMMANDS.iter().all(|command| help.stdout.contains(command)), "{}", help.stdout);
    for command in COMMANDS {
        let help = sandbox.ok(&[command, "--help"]);
        assert!(help.stdout.contains("Usage: rodsweep"), "{}", help.stdout);
        assert_eq!(help.stderr, "");
        assert_eq!(
            sandbox.ok(&[command, "--version"]).stdout.split_whitespace().last(),
            Some(env!("CARGO_PKG_VERSION"))
        );
    }
    assert_eq!(sandbox.ok(&["--version"]).stdout, concat!("rodsweep ", env!("CARGO_PKG_VERSION"), "\n"));
    for wrong in
        [&["slove"][..], &[], &["solve"], &["run", "sweep.toml", "--bakend", "cpu"], &["run", "--backend", "tpu"]]
    {
        let output = sandbox.run(wrong);
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{wrong:?}: {}", output.stderr);
    }
}

#[test]
fn solve_json_is_as_documented_and_right() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&[
        "solve",
        "scene.toml",
        "--json",
        "--set",
        "coil.current.x=100 mA",
        "--wrt",
        "coil.current,insertion",
    ]);
    let value = json(&output.stdout);
    let documented = [
        "status",
        "converged",
        "stable",
        "iterations",
        "residual",
        "error_estimate",
        "base_curvature",
        "base_moment",
        "tip",
        "jacobian",
    ];
    let mut expected: BTreeSet<String> = documented.map(str::to_owned).into();
    expected.extend(["load_fraction", "stability_margin", "derivative_error"].map(str::to_owned));
    assert_eq!(keys(&value), expected);
    assert_eq!(keys(&value["tip"]), ["curvature", "position", "quaternion", "rotation"].map(str::to_owned).into());
    let jacobian = ["base_curvature", "parameters", "position", "residual", "rotation"].map(str::to_owned).into();
    assert_eq!(keys(&value["jacobian"]), jacobian);
    assert_eq!(value["converged"], true);
    let mut scene = read_scene(&sandbox.path("scene.toml")).unwrap();
    let currents = Parameter::parse(&scene, "coil.current").unwrap();
    currents[0].set(&mut scene, 0.1).unwrap();
    let wrt = [currents, vec![Parameter::Insertion]].concat();
    let plan = Plan::single(&scene, &wrt, PlanOptions::default()).unwrap();
    let truth = Reference::new(&plan).solve(&plan.batch(1, |_, _| {})).unwrap();
    let close = |found: &Value, expected: f64, size: f64| {
        let found = found.as_f64().expect("a number");
        assert!((found - expected).abs() <= 1e-8 * size.max(expected.abs()), "{found} {expected}");
    };
    let rotation = truth.tip_rotation(0);
    for row in 0..3 {
        close(&value["tip"]["position"][row], truth.vector(0, Quantity::TipPosition)[row], 0.1);
        close(&value["base_moment"][row], truth.vector(0, Quantity::BaseMoment)[row], 1e-3);
        for (column, expected) in rotation[row].iter().enumerate() {
            close(&value["tip"]["rotation"][row][column], *expected, 1.0);
        }
        for (k, parameter) in wrt.iter().enumerate() {
            assert_eq!(value["jacobian"]["parameters"][k], parameter.name(&scene).as_str());
            close(&value["jacobian"]["position"][row][k], truth.derivative(0, k, row), 0.1);
            close(&value["jacobian"]["rotation"][row][k], truth.derivative(0, k, 3 + row), 1.0);
        }
    }
    let norm: f64 = (0..4).map(|k| value["tip"]["quaternion"][k].as_f64().unwrap().powi(2)).sum();
    assert!((norm - 1.0).abs() < 1e-14);
}

#[test]
fn solve_in_words() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["solve", "scene.toml"]);
    for word in ["tip position", "base moment", "stability margin", "coil.current.x", "insertion", "loads.tip_force.z"]
    {
        assert!(output.stdout.contains(word), "{word}: {}", output.stdout);
    }
    assert_eq!(output.stderr, "");
    for backend in ["auto", "cpu", "reference"] {
        let again = sandbox.ok(&["solve", "scene.toml", "--backend", backend]).stdout;
        let line = |text: &str| text.lines().find(|line| line.starts_with("tip position")).map(str::to_owned);
        assert_eq!(line(&again), line(&output.stdout));
    }
    let group = sandbox.ok(&["solve", "scene.toml", "--wrt", "tube.stiffness, base.rotation"]).stdout;
    assert!(group.contains("tube.stiffness.bending_x") && group.contains("base.rotation.z"), "{group}");
    for (arguments, words) in [
        (&["--wrt", "coil.curent"][..], "did you mean `coil.current`?"),
        (&["--set", "coil.curent.x=1"], "did you mean `coil.current.x`?"),
        (&["--set", "coil.current.x=1 T"], "is a flux density"),
        (&["--set", "coil.current.x"], "write NAME=VALUE"),
        (&["--set", "tube.length=-1"], "finite and not negative"),
        (&["--tolerance", "0"], "between 0 and 1"),
        (&["--precision", "f32", "--backend", "reference"], "leave `--precision` out"),
        (&["--plot", "rod.gif"], ".png or .svg"),
    ] {
        let output = sandbox.run(&[&["solve", "scene.toml"], arguments].concat());
        assert_eq!((output.code, output.stdout.as_str()), (2, ""), "{arguments:?}: {}", output.stderr);
        assert_eq!(output.errors().len(), 1, "{}", output.stderr);
        assert!(output.stderr.contains(words), "{}", output.stderr);
    }
}

/// A word of earlier versions, which scripts may still say.
#[test]
fn the_word_mixed_means_f64() {
    let sandbox = Sandbox::new();
    let solve = ["solve", "scene.toml", "--backend", "cpu", "--json", "--precision"];
    let [mixed, double] = ["mixed", "f64"].map(|word| sandbox.ok(&[&solve[..], &[word]].concat()));
    assert!(mixed.stderr.contains("mixed precision was taken out: f64 takes its place"), "{}", mixed.stderr);
    assert_eq!(mixed.stdout, double.stdout);
}

#[test]
fn solve_draws() {
    let sandbox = Sandbox::new();
    for (name, start) in [("rod.png", &b"\x89PNG"[..]), ("rod.svg", b"<")] {
        let output = sandbox.ok(&["solve", "scene.toml", "--json", "--plot", name]);
        json(&output.stdout);
        assert!(fs::read(sandbox.path(name)).unwrap().starts_with(start));
        assert!(output.stderr.contains(name), "{}", output.stderr);
    }
}

#[test]
fn a_scene_without_answer() {
    let sandbox = Sandbox::new();
    let heavy = ["solve", "scene.toml", "--set", "loads.tip_force.z=-3", "--set", "coil.current.x=5"];
    let output = sandbox.run(&[&heavy[..], &["--json"]].concat());
    let value = json(&output.stdout);
    assert_eq!(output.code, 1);
    assert_eq!(value["converged"], false);
    assert_ne!(value["status"], "ok");
    assert!(!output.stdout.contains("NaN"));
    let output = sandbox.run(&heavy);
    assert_eq!(output.code, 1);
    assert!(output.stdout.contains("no equilibrium"), "{}", output.stdout);
}

#[test]
fn run_and_its_directory() {
    let sandbox = Sandbox::new();
    let dry = sandbox.ok(&["run", "sweep.toml", "--dry-run", "--limit", "3"]);
    assert!(dry.stderr.contains("samples: 3 by grid") && dry.stderr.contains("results/sweep"), "{}", dry.stderr);
    assert!(!sandbox.path("results").exists());
    assert_eq!(dry.stdout, "");
    let output = sandbox.ok(&["run", "sweep.toml", "--limit", "3"]);
    assert_eq!(output.stdout, "");
    assert!(output.stderr.contains("solved 3 samples"), "{}", output.stderr);
    let manifest = json(&fs::read_to_string(sandbox.path("results/sweep/manifest.json")).unwrap());
    assert_eq!((&manifest["sample_count"], &manifest["complete"]), (&Value::from(3), &Value::from(true)));
    assert!(sandbox.path("results/sweep/tips.png").exists());
    // Again: refused, unless to go on.
    let again = sandbox.run(&["run", "sweep.toml", "--limit", "3"]);
    assert_eq!(again.code, 2);
    assert!(again.stderr.contains("--resume"), "{}", again.stderr);
    let resumed = sandbox.ok(&["run", "sweep.toml", "--limit", "3", "--resume"]);
    assert!(resumed.stderr.contains("3 found done"), "{}", resumed.stderr);
    let status = sandbox.ok(&["status", "results/sweep"]);
    assert!(status.stdout.contains("1 of 1 parts done, 3 samples"), "{}", status.stdout);
    // A directory of something else.
    fs::create_dir(sandbox.path("letters")).unwrap();
    fs::write(sandbox.path("letters/letter.txt"), "Dear").unwrap();
    let foreign = sandbox.run(&["run", "sweep.toml", "--out", "letters"]);
    assert_eq!(foreign.code, 2);
    assert!(foreign.stderr.contains("letters is not empty"), "{}", foreign.stderr);
    assert_eq!(fs::read_dir(sandbox.path("letters")).unwrap().count(), 1);
    for command in [&["status", "letters"][..], &["merge", "letters", "--out", "all"]] {
        let output = sandbox.run(command);
        assert_eq!(output.code, 2, "{}", output.stderr);
        assert!(output.stderr.contains("holds no run of rodsweep"), "{}", output.stderr);
    }
}

#[test]
fn quiet_runs_are_silent() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["run", "sweep.toml", "--quiet", "--no-figures", "--out", "out"]);
    assert_eq!((output.stdout.as_str(), output.stderr.as_str()), ("", ""));
    assert!(!sandbox.path("out/tips.png").exists());
}

#[test]
fn messages_carry_no_colour_codes() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["run", "sweep.toml", "--no-figures", "--out", "out"]);
    assert!(!output.stderr.contains('\u{1b}'), "{}", output.stderr);
    let output = sandbox.command(&["--help"]).env("NO_COLOR", "1").env("CLICOLOR_FORCE", "1").output().unwrap();
    assert!(!output.stdout.contains(&0x1b));
}

#[test]
fn shards_merge_into_the_whole() {
    let sandbox = Sandbox::new();
    // More than one part, so that each shard has work.
    let text = SWEEP.replace("points = 5", "points = 140000").replace("[\"coil.current\"]", "[]");
    sandbox.write("sweep.toml", &text);
    let run = |more: &[&str]| {
        sandbox.ok(&[&["run", "sweep.toml", "--quiet", "--no-figures", "--backend", "cpu"], more].concat())
    };
    run(&["--out", "whole"]);
    run(&["--out", "a", "--shard", "1/2"]);
    let partial = sandbox.ok(&["status", "a"]);
    assert!(partial.stdout.contains("2 of 3 parts done"), "{}", partial.stdout);
    let missing = sandbox.run(&["merge", "a", "--out", "all"]);
    assert_ne!(missing.code, 0, "{}", missing.stderr);
    run(&["--out", "b", "--shard", "2/2"]);
    sandbox.ok(&["merge", "a", "b", "--out", "merged"]);
    for part in 0..3 {
        let bytes = |dir: &str| fs::read(sandbox.path(&format!("{dir}/part-{part:010}.parquet"))).unwrap();
        assert!(bytes("whole") == bytes("merged"), "part {part}");
    }
}

#[test]
fn too_many_failures() {
    let sandbox = Sandbox::new();
    // The rigid coil alone is 13 mm long: shorter insertions make no rod.
    sandbox.write("sweep.toml", &sweep("insertion", "\"5 mm\"", "\"90 mm\"", 18));
    let run = |more: &[&str]| sandbox.run(&[&["run", "sweep.toml", "--no-figures"], more].concat());
    let output = run(&["--out", "any"]);
    assert_eq!(output.code, 0, "{}", output.stderr);
    assert!(output.stderr.contains("2 bad-parameter"), "{}", output.stderr);
    assert_eq!(run(&["--out", "enough", "--max-failures", "2"]).code, 0);
    let output = run(&["--out", "strict", "--max-failures", "1", "--quiet"]);
    assert_eq!(output.code, 3);
    let told = output.stderr.split_once('\n');
    let (told, ranges) = told.expect("lines");
    assert_eq!(told, "error: 2 samples failed; --max-failures allows 1");
    assert!(ranges.contains("2 bad-parameter") && ranges.contains("insertion from 0.005 to 0.01 m"), "{ranges}");
    assert!(sandbox.path("strict/manifest.json").exists());
}

#[test]
fn the_manual_has_a_page_for_each_command() {
    let sandbox = Sandbox::new();
    sandbox.ok(&["manual", "man1"]);
    let page = |name: &str| fs::read_to_string(sandbox.path("man1").join(name)).expect("a page");
    for command in COMMANDS {
        let text = page(&format!("rodsweep-{command}.1"));
        assert!(text.contains(&format!(".TH rodsweep-{command} 1")) && text.contains("Examples:"), "{text}");
    }
    assert!(page("rodsweep.1").contains("Solve") && page("rodsweep-submit-slurm.1").contains("workers"));
    fs::write(sandbox.path("file"), "").expect("a file");
    let refused = sandbox.run(&["manual", "file/man1"]);
    assert!(refused.code == 2 && refused.stderr.contains("choose another folder"), "{}", refused.stderr);
}

#[test]
fn completions_and_closed_pipes() {
    let sandbox = Sandbox::new();
    for shell in ["bash", "zsh", "fish"] {
        assert!(sandbox.ok(&["completions", shell]).stdout.contains("rodsweep"));
    }
    assert_eq!(sandbox.run(&["completions", "teletype"]).code, 2);
    for arguments in [&["completions", "bash"][..], &["solve", "scene.toml"], &["--help"], &["doctor"]] {
        let mut child = sandbox.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        let status = child.wait().unwrap();
        assert!(!stderr.contains("panicked"), "{stderr}");
        assert_eq!(status.code(), Some(0), "{arguments:?}: {stderr}");
    }
}

#[cfg(unix)]
#[test]
fn interrupted_runs_go_on() {
    let sandbox = Sandbox::new();
    sandbox.write("sweep.toml", &SWEEP.replace("points = 5", "points = 500000"));
    let arguments = ["run", "sweep.toml", "--out", "out", "--quiet", "--no-figures", "--backend", "cpu"];
    let mut child = sandbox.command(&arguments).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while !sandbox.path("out/part-0000000000.parquet").exists() {
        assert!(start.elapsed() < Duration::from_secs(120), "no part");
        assert!(child.try_wait().unwrap().is_none(), "it ended");
        std::thread::sleep(Duration::from_millis(2));
    }
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--resume"));
    let left = sandbox.ok(&["status", "out"]).stdout;
    assert!(left.contains("--resume"), "{left}");
    sandbox.ok(&[&arguments[..], &["--resume"]].concat());
    let whole = sandbox.ok(&["status", "out"]).stdout;
    assert!(whole.contains("8 of 8 parts done, 500,000 samples"), "{whole}");
}

/// Without a GPU: kernels of so many derivatives compile for minutes on a software adapter, and `twins` tests them.
#[test]
fn verify_agrees_with_the_reference() {
    let sandbox = Sandbox::new();
    let verify = |arguments: &[&str], gpu: &str| {
        let mut command = sandbox.command(&[&["verify"], arguments].concat());
        let output = command.env("RODSWEEP_ADAPTER", "none such").env("RODSWEEP_GPU", gpu).output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, stdout, stderr) = verify(&["--samples", "40", "--json"], "");
    assert_eq!(code, Some(0), "{stderr}");
    let value = json(&stdout);
    assert_eq!(value["within_limits"], true);
    let rows = value["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    for row in rows {
        assert_eq!(row["within_limits"], true, "{row}");
        assert_eq!(row["samples"], row["converged"], "{row}");
        let measured = row["engine"] == "cpu";
        assert_eq!(row["samples"] == 232, row["engine"] != "gpu", "{row}");
        assert_eq!(row["skipped"].is_null(), row["engine"] != "gpu", "{row}");
        assert_eq!(row["position"].as_f64().is_some_and(|error| error > 0.0), measured, "{row}");
        assert_eq!(row["worst_parameter"].is_string(), measured, "{row}");
    }
    let (code, stdout, stderr) = verify(&["--samples", "0"], "require");
    assert_eq!(code, Some(1), "{stdout}");
    assert!(stderr.contains("RODSWEEP_GPU=require"), "{stderr}");
    for word in ["reference", "cpu f64", "cpu f32", "skipped: gpu f32: no usable GPU", "limits f32"] {
        assert!(stdout.contains(word), "{word}: {stdout}");
    }
    assert_eq!(fs::read_dir(sandbox.path(".")).unwrap().count(), 2);
}

#[test]
fn doctor_tells() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["doctor"]);
    let version = concat!("rodsweep ", env!("CARGO_PKG_VERSION"));
    for word in [version, "processor: ", "GPU adapters: ", "`--backend auto` takes: ", "`--backend gpu` "] {
        assert!(output.stdout.contains(word), "{word}: {}", output.stdout);
    }
}
