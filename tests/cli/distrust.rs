//! Rows that are not to be trusted: every command says so first. The rows are those of an engine that has been mended, two
//! coils whose currents go together: 135 of 8,192 samples lay on another branch.

use super::sandbox::{Output, Sandbox, json};
use crate::common::root;
use serde_json::Value;
use std::fs;

/// A directory with those rows, as they were written.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    let from = root().join("tests/data/two_coil_elsewhere");
    fs::create_dir(sandbox.path("coils")).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), sandbox.path("coils").join(entry.file_name())).unwrap();
    }
    sandbox
}

/// It ends with 4, and says which inputs and what helps.
fn is_told(output: &Output, what: &str) {
    assert_eq!(output.code, 4, "{what}: {}", output.stderr);
    let first = output.stderr.lines().next().unwrap_or_default();
    assert!(first.starts_with("error: do not trust these rows: "), "{what}: {first}");
    for words in ["coilA.current.x = ", "sample ", "rodsweep solve coils/", "--certain", "--accept-distrusted"] {
        let words = if what.contains("all") { words.replace("coils/", "all/") } else { words.to_owned() };
        assert!(output.stderr.contains(&words), "{what}: {words}: {}", output.stderr);
    }
    assert!(!output.stderr.contains("--backend cpu"), "{what}: {}", output.stderr);
}

#[test]
fn every_command_says_first_that_rows_are_elsewhere() {
    let sandbox = sandbox();
    let commands: [&[&str]; 6] = [
        &["status", "coils"],
        &["figures", "coils"],
        &["workspace", "coils", "--out", "w", "--voxel", "4mm", "--fast"],
        &["sensitivity", "coils", "--out", "s"],
        &["view", "coils", "--export", "page.html"],
        &["view", "coils", "--no-open"],
    ];
    for command in commands {
        is_told(&sandbox.run(command), &command.join(" "));
    }
    for file in ["w", "s", "page.html", "coils/tips.svg"] {
        assert!(!sandbox.path(file).exists(), "{file}");
    }
    is_told(&sandbox.run(&["merge", "coils", "--out", "all"]), "merge all");
    is_told(&sandbox.run(&["status", "all"]), "status all");
    let manifest = json(&fs::read_to_string(sandbox.path("all/manifest.json")).unwrap());
    assert_eq!(manifest["verdict"]["sound"], false);
    assert_eq!(manifest["verdict"]["doubts"][0]["kind"], "rows-elsewhere");
    assert!(sandbox.path("all/distrusted-rows-elsewhere.toml").exists());
}

#[test]
fn what_is_accepted_carries_the_mark() {
    let sandbox = sandbox();
    let accepted = |command: &[&str]| {
        let output = sandbox.ok(&[command, &["--accept-distrusted"]].concat());
        assert!(output.stderr.starts_with("warning: do not trust these rows: "), "{command:?}: {}", output.stderr);
        output
    };
    let has_mark = |file: &str| {
        let text = fs::read(sandbox.path(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(String::from_utf8_lossy(&text).contains("DISTRUSTED: "), "{file}");
    };
    accepted(&["status", "coils"]);
    accepted(&["figures", "coils"]);
    has_mark("coils/tips.svg");
    let output = accepted(&["workspace", "coils", "--out", "w", "--voxel", "4mm", "--fast", "--json"]);
    assert!(json(&output.stdout)["distrusted"].as_str().unwrap().starts_with("DISTRUSTED: "));
    has_mark("w/workspace.svg");
    has_mark("w/workspace.json");
    has_mark("w/workspace.parquet");
    accepted(&["view", "coils", "--export", "page.html"]);
    has_mark("page.html");
    let page = fs::read_to_string(sandbox.path("page.html")).unwrap();
    let data = page.split_once("id=\"data\">").unwrap().1.split_once("</script>").unwrap().0;
    let data = json(data);
    assert!(data["distrust"].as_str().unwrap().contains("coilA.current.x"));
    assert!(!data["map"]["wrong_rows"].as_array().unwrap().is_empty());
    assert!(page.contains("id=\"distrust\" role=\"alert\""));
}

#[test]
fn a_sound_run_is_called_sound() {
    let sandbox = Sandbox::new();
    sandbox.ok(&["run", "sweep.toml", "--out", "out", "--backend", "cpu"]);
    let status = sandbox.ok(&["status", "out"]);
    assert!(
        status.stdout.contains("nothing speaks against the rows; 5 of 5 samples were checked"),
        "{}",
        status.stdout
    );
    let manifest = fs::read_to_string(sandbox.path("out/manifest.json")).unwrap();
    assert_eq!(json(&manifest)["verdict"]["sound"], true);
    sandbox.ok(&["run", "sweep.toml", "--out", "out", "--backend", "cpu", "--resume"]);
    assert_eq!(fs::read_to_string(sandbox.path("out/manifest.json")).unwrap(), manifest);
    assert!(!fs::read_to_string(sandbox.path("out/tips.svg")).unwrap().contains("DISTRUSTED"));
}

#[test]
fn a_run_without_a_usable_row_ends_with_its_own_code() {
    let sandbox = Sandbox::new();
    // The rigid coil alone is 13 mm long: shorter insertions make no rod.
    sandbox.write("sweep.toml", &crate::common::texts::sweep("insertion", "\"5 mm\"", "\"12 mm\"", 8));
    let output = sandbox.run(&["run", "sweep.toml", "--out", "out", "--backend", "cpu"]);
    assert_eq!(output.code, 4, "{}", output.stderr);
    assert!(output.stderr.contains("none of 8 samples can be used"), "{}", output.stderr);
    assert!(output.stderr.contains("insertion from 0.005 to 0.012 m"), "{}", output.stderr);
    let verdict: Value = json(&fs::read_to_string(sandbox.path("out/manifest.json")).unwrap())["verdict"].clone();
    assert_eq!(verdict["doubts"][0]["kind"], "nothing-usable");
    assert_eq!(sandbox.run(&["status", "out"]).code, 4);
    assert!(output.stderr.contains("other ranges of these inputs"), "{}", output.stderr);
    // `solve` would refuse the scene of such a sample.
    assert!(!output.stderr.contains("see one") && !sandbox.path("out/distrusted-nothing-usable.toml").exists());
}

#[test]
fn a_missed_tolerance_ends_with_its_own_code() {
    let sandbox = Sandbox::new();
    let text = crate::common::texts::SWEEP.replace("tolerance = 1e-6", "tolerance = 1e-12\nsteps = 2");
    sandbox.write("sweep.toml", &text.replace("[\"tip_position\"]", "[\"tip_position\", \"error_estimate\"]"));
    let output = sandbox.run(&["run", "sweep.toml", "--out", "out", "--backend", "reference", "--no-figures"]);
    let verdict = json(&fs::read_to_string(sandbox.path("out/manifest.json")).unwrap())["verdict"].clone();
    let misses = verdict["doubts"].as_array().unwrap().iter().any(|doubt| doubt["kind"] == "tolerance-missed");
    assert_eq!(output.code, if misses { 4 } else { 0 }, "{}", output.stderr);
    assert!(!misses || output.stderr.contains("miss the tolerance"), "{}", output.stderr);
}

#[test]
fn a_fit_far_off_its_points_ends_with_4() {
    let sandbox = Sandbox::new();
    let from = root().join("tests/data/reports/16-fit-markers");
    for file in ["curved.toml", "centreline.csv"] {
        fs::copy(from.join(file), sandbox.path(file)).unwrap();
    }
    let command = ["fit", "curved.toml", "centreline.csv", "--free", "tube.rest_curvature.node_1"];
    let output = sandbox.run(&command);
    assert_eq!(output.code, 4, "{}", output.stderr);
    assert!(
        output.stderr.contains("error: DISTRUSTED: the points lie ") && output.stderr.contains("--noise"),
        "{}",
        output.stderr
    );
    let accepted = sandbox.run(&[&command[..], &["--accept-distrusted"]].concat());
    assert_eq!(accepted.code, 0, "{}", accepted.stderr);
    assert!(accepted.stdout.starts_with("DISTRUSTED: "), "{}", accepted.stdout);
}

#[test]
fn rows_of_a_lost_manifest_are_said_to_be_unchecked() {
    let sandbox = sandbox();
    fs::remove_file(sandbox.path("coils/manifest.json")).unwrap();
    let commands: [&[&str]; 5] = [
        &["status", "coils"],
        &["figures", "coils"],
        &["view", "coils", "--export", "page.html"],
        &["merge", "coils", "--out", "all"],
        &["status", "all"],
    ];
    for command in commands {
        let output = sandbox.ok(command);
        assert!(output.stderr.contains("512 of 512 samples were not checked"), "{command:?}: {}", output.stderr);
    }
}

#[test]
fn merge_refuses_a_manifest_that_it_cannot_read() {
    for text in ["{", "null", "[]", "{}"] {
        let sandbox = sandbox();
        sandbox.write("coils/manifest.json", text);
        let output = sandbox.run(&["merge", "coils", "--out", "all"]);
        assert_ne!(output.code, 0, "{text}: {}", output.stderr);
        assert!(output.stderr.contains("manifest.json"), "{text}: {}", output.stderr);
        assert!(!sandbox.path("all").exists(), "{text}");
    }
}

#[test]
fn a_cell_without_a_number_leaves_a_manifest_that_can_be_read() {
    for (cells, code) in [("0.05\n0.02\nnan\n", 0), ("nan\nnan\n", 4)] {
        let sandbox = Sandbox::new();
        sandbox.write("inputs.csv", &format!("coil.current.x\n{cells}"));
        let (before, after) = crate::common::texts::SWEEP.split_once("[[axis]]").unwrap();
        let (_, after) = after.split_once("[solver]").unwrap();
        let before = before.replace("method = \"grid\"\nseed = 7", "method = \"table\"\nfile = \"inputs.csv\"");
        sandbox.write("sweep.toml", &format!("{before}[solver]{after}"));
        let output = sandbox.run(&["run", "sweep.toml", "--out", "out", "--backend", "cpu"]);
        assert_eq!(output.code, code, "{}", output.stderr);
        for command in [&["status", "out"][..], &["figures", "out"]] {
            let again = sandbox.run(command);
            assert_eq!(again.code, code, "{command:?}: {}", again.stderr);
            assert!(!again.stderr.contains("damaged"), "{command:?}: {}", again.stderr);
        }
    }
}

#[test]
fn every_file_of_an_accepted_workspace_carries_the_mark() {
    let sandbox = sandbox();
    let command = ["workspace", "coils", "--voxel", "4mm", "--no-figures", "--accept-distrusted"];
    let more = ["--out", "w", "--vtk", "--reach", "10 mm,10 mm,80 mm", "--quiet"];
    let told = sandbox.run(&[&command[..], &more].concat());
    assert!(told.stdout.starts_with("DISTRUSTED: ") && told.stdout.contains("; volume = "), "{}", told.stdout);
    assert_eq!(told.stdout.lines().count(), 1, "{}", told.stdout);
    for file in ["boundary.ply", "boundary.vtp", "workspace.vti", "reach.csv", "workspace.json", "workspace.parquet"] {
        let bytes = fs::read(sandbox.path("w").join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(String::from_utf8_lossy(&bytes).contains("DISTRUSTED: "), "{file}");
    }
    let table = fs::read_to_string(sandbox.path("w/reach.csv")).unwrap();
    assert!(table.lines().next().is_some_and(|names| names.ends_with(",distrusted")), "{table}");
}

#[test]
fn a_workspace_beside_one_that_is_distrusted_is_refused_or_marked() {
    let sandbox = sandbox();
    sandbox.run(&[
        "workspace",
        "coils",
        "--voxel",
        "4mm",
        "--fast",
        "--out",
        "w",
        "--no-figures",
        "--accept-distrusted",
    ]);
    let command = ["workspace", "coils/sweep.toml", "--voxel", "4mm", "--fast", "--out", "a", "--no-figures"];
    let beside = [&command[..], &["--compare", "w"]].concat();
    let refused = sandbox.run(&beside);
    assert_eq!(refused.code, 4, "{}", refused.stderr);
    assert!(refused.stderr.starts_with("error: w: DISTRUSTED: "), "{}", refused.stderr);
    assert!(refused.stderr.contains("--accept-distrusted") && !sandbox.path("a").exists());
    let accepted = sandbox.ok(&[&beside[..], &["--accept-distrusted"]].concat());
    assert!(accepted.stderr.starts_with("warning: w: DISTRUSTED: "), "{}", accepted.stderr);
    let line = accepted.stdout.lines().find(|line| line.contains("beside the other: ")).unwrap_or_default();
    assert!(line.starts_with("DISTRUSTED: "), "{}", accepted.stdout);
    let account = json(&fs::read_to_string(sandbox.path("a/workspace.json")).unwrap());
    assert!(account["comparison"]["distrusted"].as_str().unwrap().starts_with("DISTRUSTED: "));
    // The workspace itself is sound.
    assert!(account["distrusted"].is_null() && !accepted.stdout.starts_with("DISTRUSTED"), "{}", accepted.stdout);
    let mark = |file: &str| rodsweep::results::read_mark(&sandbox.path(file)).unwrap();
    assert!(mark("a/comparison.parquet").is_some() && mark("a/workspace.parquet").is_none());
}

#[test]
fn every_table_of_an_accepted_sensitivity_carries_the_mark() {
    let sandbox = sandbox();
    let sweep = crate::common::texts::SWEEP.replace("points = 5\n", "").replace("current.x", "current.z");
    sandbox.write("sweep.toml", &sweep.replace("method = \"grid\"", "method = \"sobol\"\nsamples = 64"));
    sandbox.ok(&["run", "sweep.toml", "--out", "out", "--backend", "cpu", "--no-figures"]);
    let study = ["sensitivity", "out", "--outputs", "tip.position.y", "--no-figures", "--quiet"];
    let sound = sandbox.ok(&[&study[..], &["--out", "sound"]].concat());
    assert!(!sound.stdout.contains("DISTRUSTED"), "{}", sound.stdout);
    // The verdict of other rows.
    sandbox.run(&["merge", "coils", "--out", "all"]);
    let manifest = |dir: &str| json(&fs::read_to_string(sandbox.path(dir).join("manifest.json")).unwrap());
    let mut own = manifest("out");
    own["verdict"] = manifest("all")["verdict"].clone();
    sandbox.write("out/manifest.json", &own.to_string());
    let marked = sandbox.ok(&[&study[..], &["--out", "marked", "--accept-distrusted"]].concat());
    assert!(marked.stdout.starts_with("DISTRUSTED: ") && marked.stdout.lines().count() == 1, "{}", marked.stdout);
    let mut tables = 0;
    for entry in fs::read_dir(sandbox.path("marked")).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains("DISTRUSTED: "), "{}", path.display());
        if path.extension().is_some_and(|extension| extension == "csv") {
            tables += 1;
            let plain = fs::read_to_string(sandbox.path("sound").join(path.file_name().unwrap())).unwrap();
            let names = |text: &str| text.lines().next().unwrap_or_default().to_owned();
            assert_eq!(names(&text), names(&plain) + ",distrusted");
            assert!(text.lines().skip(1).all(|row| row.contains("DISTRUSTED: ")), "{text}");
        }
    }
    assert!(tables >= 3, "{tables}");
}
