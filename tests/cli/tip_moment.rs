//! A cantilever that an end moment rolls up, in the program.

use crate::common::root;
use crate::sandbox::Sandbox;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

fn report(name: &str) -> PathBuf {
    root().join("tests/data/reports/02-roll-up").join(name)
}

/// Rows of a CSV file as words, by the names in its head.
fn cells(text: &str, names: &[&str]) -> Vec<Vec<String>> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let at = |name: &&str| head.iter().position(|cell| cell == name).unwrap_or_else(|| panic!("no {name} in {head:?}"));
    let places: Vec<usize> = names.iter().map(at).collect();
    let words = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    lines.map(|line| places.iter().map(|place| words(line)[*place].clone()).collect()).collect()
}

#[test]
fn every_row_of_the_roll_up_is_solved() {
    let sandbox = Sandbox::new();
    let sweep = report("rollup_sweep.toml");
    let sweep = sweep.to_str().expect("a path of words");
    let output = sandbox.run(&["run", sweep, "--out", "out", "--backend", "cpu", "--no-figures"]);
    assert_eq!(output.code, 0, "{}", output.stderr);
    let expected: Value =
        serde_json::from_str(&fs::read_to_string(report("expected.json")).expect("there")).expect("JSON");
    let expected = expected["expected"]["rows"].as_array().expect("rows").clone();
    let part = fs::read_dir(sandbox.path("out"))
        .expect("a directory")
        .chain(fs::read_dir(sandbox.path("out/parts")).into_iter().flatten())
        .map(|entry| entry.expect("an entry").path())
        .find(|path| path.extension().is_some_and(|kind| kind == "csv") && path.to_string_lossy().contains("part"))
        .expect("a part");
    let names = [
        "status",
        "tip.position.x",
        "tip.position.y",
        "tip.position.z",
        "stability.margin",
        "stable",
        "stability.evidence",
        "load_fraction",
    ];
    let rows = cells(&fs::read_to_string(part).expect("text"), &names);
    assert_eq!(rows.len(), expected.len());
    for (k, (row, expected)) in rows.iter().zip(&expected).enumerate() {
        let number = |at: usize| row[at].parse::<f64>().unwrap_or(f64::NAN);
        let tip = expected["tip"].as_array().expect("a tip");
        let away = (0..3).map(|axis| (number(1 + axis) - tip[axis].as_f64().expect("a number")).powi(2)).sum::<f64>();
        assert!(away.sqrt() < 1e-5, "row {k}: {row:?}");
        assert!(["ok", "ramped", "refined"].contains(&row[0].as_str()), "row {k}: {row:?}");
        assert!((number(4) - 1.0).abs() < 1e-3 && number(7) == 1.0, "row {k}: {row:?}");
        let evidence = ["energy", "symmetric-part", "divergence"][usize::from(k > 0) + usize::from(k > 4)];
        // At half a turn the symmetric part is singular, and round-off decides.
        if k != 5 {
            assert_eq!((row[5].as_str(), row[6].as_str()), (if k < 5 { "true" } else { "false" }, evidence), "row {k}");
        }
    }
}

#[test]
fn one_rod_says_what_is_known_of_it() {
    let sandbox = Sandbox::new();
    let scene = report("rollup.toml");
    let scene = scene.to_str().expect("a path of words");
    let json = |arguments: &[&str]| -> Value {
        let output = sandbox.run(&[&["solve", scene, "--json"], arguments].concat());
        assert_eq!(output.code, 0, "{}", output.stderr);
        serde_json::from_str(&output.stdout).expect("JSON")
    };
    let straight = json(&["--set", "loads.tip_force.x=1"]);
    assert_eq!((straight["stable"].as_bool(), straight.get("stability_evidence")), (Some(true), None));
    let bent = json(&["--set", "loads.tip_moment.y=1000"]);
    assert_eq!((bent["stable"].as_bool(), bent["stability_evidence"].as_str()), (Some(true), Some("symmetric-part")));
    let circle = ["--set", "loads.tip_moment.y=6283.185307179587"];
    let found = json(&circle);
    assert_eq!((found["stable"].as_bool(), found["stability_evidence"].as_str()), (Some(false), Some("divergence")));
    assert!(found["converged"] == true && found["stability_margin"].as_f64() > Some(0.999), "{found}");
    assert!(found["tip"]["position"].as_array().expect("a tip").iter().all(|x| x.as_f64().expect("x").abs() < 1e-6));
    let twisted = json(&["--set", "loads.tip_moment.z=5000"]);
    let tip = &twisted["tip"];
    assert!((tip["position"][2].as_f64().expect("z") - 10.0).abs() < 1e-6, "{tip}");
    assert!((tip["rotation"][0][0].as_f64().expect("a number") - 5.0_f64.cos()).abs() < 1e-6, "{tip}");

    let all = json(&[&circle[..], &["--all-branches"]].concat());
    let branches = all["branches"].as_array().expect("branches");
    assert_eq!((branches.len(), all["balanced"].as_bool()), (1, Some(true)), "{all}");
    assert_ne!(branches[0]["status"], "unstable");
    assert_eq!(
        (&branches[0]["from_rest"], branches[0]["stability_evidence"].as_str()),
        (&true.into(), Some("divergence"))
    );
    let text = sandbox.run(&[&["solve", scene], &circle[..]].concat());
    assert!(text.stdout.contains("not diverged since rest"), "{}", text.stdout);
}
