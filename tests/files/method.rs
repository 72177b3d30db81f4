//! The identity of a run includes its method: shards and whoever resumes it do as it did, or are refused.

use crate::common::root;
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::engines::EngineRequest;
use rodsweep::model::{DerivativeScale, Stepper};
use rodsweep::results::{Results, ResultsError, merge};
use rodsweep::spec::{Shard, SolutionMethod, SweepSpec};
use rodsweep::sweep::{Memory, ResultDirectory, SweepError, SweepJob};
use rodsweep::table::Table;
use std::path::{Path, PathBuf};

const TEXT: &str = "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 90\nseed = 3\n\
                [[axis]]\nparameter = \"coil.current.x\"\nfrom = \"-0.2 A\"\nto = \"0.2 A\"\n\
                [output]\nquantities = [\"tip_position\"]\n";

fn spec() -> SweepSpec {
    let file = root().join("sweeps/method.toml");
    SweepSpec::parse(&file, TEXT).expect("a sweep")
}

fn job<'a>() -> SweepJob<'a> {
    SweepJob::new(spec()).engine(EngineRequest::of(BackendKind::Cpu)).part_size(Some(20)).spot_check(None)
}

fn shard(index: u64) -> Shard {
    Shard { index, count: 2 }
}

/// Runs a shard into a folder of `dir`.
fn run_shard(dir: &Path, index: u64, job: SweepJob) -> PathBuf {
    let out = dir.join(format!("shard-{index}-of-{}", dir.read_dir().expect("a folder").count()));
    job.shard(shard(index)).run(&mut ResultDirectory::new(&out)).expect("a run");
    out
}

fn method_of(dir: &Path) -> SolutionMethod {
    Results::open(dir).expect("results").method().expect("a method")
}

fn rows(dir: &Path) -> Table {
    Results::open(dir).expect("results").read(&[]).expect("rows")
}

#[test]
fn run_json_tells_the_method_that_solved() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = run_shard(dir.path(), 1, job());
    let method = method_of(&out);
    let prepared = job().prepare(&Memory::new()).expect("prepared");
    assert_eq!(method, prepared.method());
    assert_eq!(
        (method.engine, method.precision, method.tolerance),
        (BackendKind::Cpu, Precision::F64, spec().tolerance)
    );
    assert!(method.steps >= 2);
    let text = std::fs::read_to_string(out.join("run.json")).expect("run.json");
    let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(record["method"]["engine"], "cpu");
    assert_eq!(record["method"]["stepper"], method.stepper.name());
    let manifest = Results::open(&out).expect("results").manifest().expect("a manifest");
    assert_eq!(manifest.solved_by, Some(method));
    // Each part says what solved it; the manifest counts rows by it.
    let [(engine, rows)] = &manifest.engines.iter().collect::<Vec<_>>()[..] else { panic!("one engine") };
    assert!(engine.starts_with("cpu f64"), "{engine}");
    assert_eq!(**rows, 50);
}

#[test]
fn who_resumes_does_as_the_run_was_begun() {
    let dir = tempfile::tempdir().expect("a folder");
    let settled = SolutionMethod {
        engine: BackendKind::Cpu,
        precision: Precision::F64,
        stepper: Stepper::Tp7,
        steps: 11,
        tolerance: spec().tolerance,
        error_share: 0.5,
        error_floor: 1e-8,
        derivative_scale: DerivativeScale { share: 10.0, floor: 1e-5 },
        anchors: false,
    };
    let out = dir.path().join("run");
    job().method(Some(settled)).run(&mut ResultDirectory::new(&out)).expect("a run");
    let whole = rows(&out);
    std::fs::remove_file(out.join("part-0000000002.parquet")).expect("a part");
    // Whatever engine this machine would take, and whatever a pilot would choose.
    let again = SweepJob::new(spec()).part_size(Some(20)).spot_check(None);
    let directory = ResultDirectory::new(&out).resume(true);
    let prepared = again.clone().prepare(&directory).expect("prepared");
    assert_eq!((prepared.method(), prepared.is_settled(), prepared.pilot()), (settled, true, None));
    let summary = again.run(&mut ResultDirectory::new(&out).resume(true)).expect("a run");
    assert_eq!((summary.solved, summary.resumed), (20, 70));
    assert_eq!(rows(&out), whole);
}

/// A sweep file may ask for its precision; the command line goes first. What it says belongs to the run.
#[test]
fn a_sweep_asks_for_its_precision() {
    let with = |word: &str| {
        let text = format!("{}[solver]\nprecision = \"{word}\"\n", TEXT);
        SweepSpec::parse(&root().join("sweeps/method.toml"), &text)
    };
    let on_cpu = |spec: SweepSpec| {
        SweepJob::new(spec).engine(EngineRequest::of(BackendKind::Cpu)).part_size(Some(20)).spot_check(None)
    };
    let precision = |job: SweepJob| job.prepare(&Memory::new()).expect("prepared").method().precision;
    let single = with("f32").expect("a sweep");
    assert_eq!(precision(on_cpu(single.clone())), Precision::F32);
    let double = EngineRequest::of(BackendKind::Cpu).precision(Some(Precision::F64));
    assert_eq!(precision(on_cpu(single.clone()).engine(double)), Precision::F64);
    assert_eq!(precision(on_cpu(with("auto").expect("a sweep"))), Precision::F64);
    assert_eq!(precision(job()), Precision::F64);
    assert!(with("half").is_err_and(|error| error.to_string().contains("auto, f32, f64")));
    // A word of earlier versions.
    let mixed = with("mixed").expect("a sweep");
    assert!(mixed.notes.iter().any(|note| note.contains("mixed precision was taken out")), "{:?}", mixed.notes);
    assert_eq!(precision(on_cpu(mixed)), Precision::F64);

    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("run");
    on_cpu(single.clone()).run(&mut ResultDirectory::new(&out)).expect("a run");
    let whole = rows(&out);
    assert_eq!(method_of(&out).precision, Precision::F32);
    assert_eq!(SweepSpec::read(&out.join("sweep.toml")).expect("a sweep").precision, single.precision);
    let text = std::fs::read_to_string(out.join("run.json")).expect("run.json");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&text).expect("JSON")["method"]["precision"], "f32");
    let manifest = Results::open(&out).expect("results").manifest().expect("a manifest");
    assert!(manifest.engines.keys().all(|engine| engine.starts_with("cpu f32")), "{:?}", manifest.engines);
    let error = on_cpu(single.clone()).engine(double).run(&mut ResultDirectory::new(&out).resume(true));
    assert!(matches!(error, Err(SweepError::OtherMethod { what: "precision", .. })), "{error:?}");
    std::fs::remove_file(out.join("part-0000000001.parquet")).expect("a part");
    on_cpu(single).run(&mut ResultDirectory::new(&out).resume(true)).expect("a run");
    assert_eq!(rows(&out), whole);
}

/// A run that an earlier version has solved in mixed precision is refused with the remedy, not misread.
#[test]
fn a_run_in_mixed_precision_is_named() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("run");
    job().run(&mut ResultDirectory::new(&out)).expect("a run");
    let file = out.join("run.json");
    let text = std::fs::read_to_string(&file).expect("run.json");
    std::fs::write(&file, text.replace("\"f64\"", "\"mixed\"")).expect("written");
    let error = job().run(&mut ResultDirectory::new(&out).resume(true)).expect_err("refused").to_string();
    assert!(error.contains("run.json") && error.contains("mixed"), "{error}");
}

#[test]
fn another_method_is_refused_and_named() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("run");
    job().run(&mut ResultDirectory::new(&out)).expect("a run");
    let before = rows(&out);
    let asked = [
        (EngineRequest::of(BackendKind::Reference), "engine", "cpu", "reference"),
        (EngineRequest::of(BackendKind::Cpu).precision(Some(Precision::F32)), "precision", "f64", "f32"),
    ];
    for (request, what, settled, asked) in asked {
        let error = job().engine(request).run(&mut ResultDirectory::new(&out).resume(true)).expect_err("refused");
        let SweepError::OtherMethod { what: w, settled: s, asked: a } = &error else { panic!("{error}") };
        assert_eq!((*w, s.as_str(), a.as_str()), (what, settled, asked));
        assert!(error.is_usage());
    }
    assert_eq!(rows(&out), before);
}

#[test]
fn shards_of_different_methods_do_not_merge() {
    let dir = tempfile::tempdir().expect("a folder");
    let first = run_shard(dir.path(), 1, job());
    let method = method_of(&first);
    let others = [
        ("engine", job().engine(EngineRequest::of(BackendKind::Reference))),
        ("stepper", job().method(Some(SolutionMethod { stepper: Stepper::Rk4, ..method }))),
        ("number of steps", job().method(Some(SolutionMethod { steps: method.steps + 1, ..method }))),
    ];
    for (expected, other) in others {
        let second = run_shard(dir.path(), 2, other);
        let out = dir.path().join(format!("merged {expected}"));
        let error = merge(&[first.clone(), second], &out).expect_err("refused");
        let ResultsError::Mismatch { what, .. } = &error else { panic!("{error}") };
        assert_eq!(*what, expected);
        assert!(!out.exists(), "nothing is written");
    }
}

#[test]
fn a_shard_by_the_method_of_another_merges_to_the_whole() {
    let dir = tempfile::tempdir().expect("a folder");
    let settled = SolutionMethod {
        engine: BackendKind::Cpu,
        precision: Precision::F32,
        stepper: Stepper::Tp6,
        steps: 9,
        tolerance: 2e-5,
        error_share: 0.5,
        error_floor: 1e-8,
        derivative_scale: DerivativeScale { share: 10.0, floor: 1e-5 },
        anchors: false,
    };
    let whole = dir.path().join("whole");
    job().engine(EngineRequest::any()).method(Some(settled)).run(&mut ResultDirectory::new(&whole)).expect("a run");
    let any = || job().engine(EngineRequest::any());
    let first = run_shard(dir.path(), 1, any().method(Some(settled)));
    let second = run_shard(dir.path(), 2, any().method(Some(method_of(&first))));
    let merged = dir.path().join("merged");
    let status = merge(&[second, first], &merged).expect("merged");
    assert!(status.is_complete());
    assert_eq!(rows(&merged), rows(&whole));
    let manifest = Results::open(&merged).expect("results").manifest().expect("a manifest");
    assert_eq!((manifest.solved_by, manifest.merged_from.len()), (Some(settled), 2));
    assert_eq!(manifest.engines.values().sum::<u64>(), 90);
}
