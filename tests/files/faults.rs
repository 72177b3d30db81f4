//! What attacks on the program have found: long files, sweeps without end, damaged identities, strange things in the
//! place of files, positions far from the origin.

use crate::arc::{Arc, arc, contents, options, small};
use crate::common::root;
use crate::common::runs::{read_columns, resume_in, run_into, status_of};
use crate::common::texts::SCENE;
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::engines::EngineRequest;
use rodsweep::input::{parse_scene, parse_trajectory, read_scene};
use rodsweep::model::Plan;
use rodsweep::results::ResultsError;
use rodsweep::spec::{Format, MAX_SAMPLES, SweepSpec};
use rodsweep::sweep::{Memory, ResultDirectory, RunOptions, SweepJob, run};
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Quadratic work took a minute for 8,000 segments; this would take a quarter of an hour.
#[test]
fn long_scenes_are_read() {
    let (head, segments) = SCENE.split_once("[[segment]]").unwrap();
    let tube = segments.split("[[segment]]").next().unwrap();
    let many: String =
        (0..30_000).map(|k| format!("[[segment]]{}", tube.replace("\"tube\"", &format!("\"tube{k}\"")))).collect();
    let scene = parse_scene(Path::new("scene.toml"), &(head.to_owned() + &many)).unwrap();
    assert_eq!(scene.segments.len(), 30_000);
    let error = parse_scene(Path::new("scene.toml"), &(head.to_owned() + &many + "lenght = 3\n")).unwrap_err();
    assert_eq!(error.line, Some(head.lines().count() + 30_000 * 8 + 1), "{error}");
}

#[test]
fn a_trajectory_of_too_many_points_is_refused() {
    let scene = parse_scene(Path::new("scene.toml"), SCENE).unwrap();
    let text = |points: u64| format!("shape = \"circle\"\nsize = 0.01\ncentre = [0, 0, 0.08]\npoints = {points}\n");
    let error = parse_trajectory(Path::new("t.toml"), &text(i64::MAX as u64), &scene).unwrap_err();
    assert_eq!((error.line, error.key.as_str()), (Some(4), "points"));
    assert!(error.to_string().contains("at most 1,000,000 points"), "{error}");
    assert_eq!(parse_trajectory(Path::new("t.toml"), &text(1000), &scene).unwrap().targets.len(), 1000);
}

/// The most samples that there may be, stopped at once: a list of what is to be done would take some gigabytes.
#[test]
fn a_sweep_of_very_many_samples_is_not_listed() {
    const ALONE: &str = "RODSWEEP_TEST_ALONE";
    if std::env::var_os(ALONE).is_none() {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "faults::a_sweep_of_very_many_samples_is_not_listed", "--nocapture"]);
        return assert!(command.env(ALONE, "1").status().unwrap().success());
    }
    let spec = SweepSpec { format: Format::None, sample_count: MAX_SAMPLES, ..small("none") };
    let stop = AtomicBool::new(true);
    let options = RunOptions { interrupt: Some(&stop), ..RunOptions::new() };
    let summary = run(&spec, &mut arc(&spec), &options, &mut Memory::new()).unwrap();
    assert!(summary.interrupted && summary.total == MAX_SAMPLES, "{} of {}", summary.solved, summary.total);
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|text| text.split_whitespace().next()).and_then(|number| number.parse::<u64>().ok());
    assert!(peak.is_none_or(|peak| peak < 512 << 10), "{peak:?} kB");
}

#[test]
fn an_identity_that_was_changed_is_refused() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    run_into(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    let path = dir.path().join("run.json");
    let whole = fs::read_to_string(&path).unwrap();
    for (from, to, words) in [
        ("\"chunk\": 1000", "\"chunk\": 0", "in parts of 0"),
        ("\"chunk\": 1000", "\"chunk\": 500", "does not fit"),
        ("\"sample_count\": 5000", "\"sample_count\": 0", "0 samples"),
        ("\"sample_count\": 5000", "\"sample_count\": 4000", "does not fit"),
        ("\"sample_count\": 5000", "\"sample_count\": 18446744073709551000", "18446744073709551000 samples"),
        ("\"parquet\"", "\"parket\"", "no format is called"),
        ("\"parquet\"", "\"csv\"", "does not fit"),
        ("\"run_id\"", "\"run_di\"", "missing field"),
        ("{", "", "identity"),
    ] {
        assert!(whole.contains(from), "{from}: {whole}");
        fs::write(&path, whole.replacen(from, to, 1)).unwrap();
        let error = status_of(dir.path()).unwrap_err();
        assert!(matches!(error, ResultsError::Identity { .. }) && !error.is_usage(), "{error:?}");
        assert!(error.to_string().contains(words) && error.to_string().contains("run.json"), "{error}");
        resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap_err();
    }
    fs::write(&path, whole).unwrap();
    assert!(status_of(dir.path()).unwrap().is_complete());
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_named_and_moved_aside() {
    let spec = small("csv");
    let dir = tempfile::tempdir().unwrap();
    run_into(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    let whole = contents(dir.path());
    let part = |k: usize| dir.path().join(format!("part-{k:010}.csv"));
    let pipe = |path: &Path| assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
    for k in 1..4 {
        fs::remove_file(part(k)).unwrap();
    }
    fs::create_dir(part(1)).unwrap();
    std::os::unix::fs::symlink("nowhere", part(2)).unwrap();
    pipe(&part(3));
    let damaged = status_of(dir.path()).unwrap().damaged;
    let reasons: Vec<&str> = damaged.iter().map(|(_, reason)| reason.as_str()).collect();
    assert_eq!(reasons, ["it is a directory", "it is a link that leads nowhere", "it is a pipe or a device"]);
    let summary = resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    assert_eq!((summary.quarantined.len(), summary.solved), (3, 3000));
    assert!(contents(dir.path()) == whole, "solved again, the parts differ");
    for (name, words) in [("sweep.toml", "a pipe"), ("run.json", "a pipe"), ("manifest.json", "a pipe")] {
        let path = dir.path().join(name);
        fs::rename(&path, dir.path().join("kept")).unwrap();
        pipe(&path);
        let results = rodsweep::results::Results::open(dir.path()).and_then(|results| results.manifest());
        let message = results.unwrap_err().to_string();
        assert!(message.contains(name) && message.contains(words), "{message}");
        fs::rename(dir.path().join("kept"), &path).unwrap();
    }
}

/// A kilometre from the origin single precision tells 0.06 mm apart: too little for a catheter.
#[test]
fn positions_far_from_the_origin_keep_their_digits() {
    let mut scene = read_scene(&root().join("sweeps/scenes/p6.toml")).unwrap();
    let length = scene.total_length();
    let near = SweepSpec { sample_count: 500, ..small("parquet") };
    scene.base.position = [0.0, 0.0, 1000.0];
    let far = SweepSpec { scene, ..near.clone() };
    let heights = [&near, &far].map(|spec| {
        let dir = tempfile::tempdir().unwrap();
        let request = EngineRequest::of(BackendKind::Cpu).precision(Some(Precision::F32));
        let summary = SweepJob::new(spec.clone()).engine(request).run(&mut ResultDirectory::new(dir.path())).unwrap();
        assert_eq!(summary.spot_check.unwrap().wrong, 0);
        read_columns(dir.path(), &[]).unwrap().numbers("tip.position.z").unwrap()
    });
    for (near, far) in heights[0].iter().zip(&heights[1]) {
        assert!((far - 1000.0 - near).abs() < 1e-6 * length, "{near} {far}");
    }
}

/// What is written is what is checked: here a position that single precision spoils.
#[test]
fn the_spot_check_sees_what_is_written() {
    let spec = SweepSpec { tolerance: 1e-9, ..small("parquet") };
    let dir = tempfile::tempdir().unwrap();
    let mut single = Arc { precision: Precision::F32, fails: false, ..arc(&spec) };
    let exact = |plan: &Plan| Ok(Box::new(Arc { fails: false, ..Arc::new(plan) }) as Box<dyn Backend>);
    let options = RunOptions { trusted: Some(&exact), ..options() };
    let check = run_into(dir.path(), &spec, &mut single, &options).unwrap().spot_check.unwrap();
    assert!(check.position.max > 1e-9 && check.position.max < 1e-6, "{:?}", check.position);
}
