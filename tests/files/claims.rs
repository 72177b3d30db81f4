//! Workers that share a run: nothing is lost, nothing is there twice, whoever dies.

use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::results::{Results, ResultsError, store_at};
use rodsweep::spec::{SolutionMethod, SweepSpec};
use rodsweep::sweep::{Memory, ResultDirectory, Summary, SweepError, SweepJob};
use rodsweep::table::Table;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tempfile::TempDir;

/// A worker that is silent for so long is taken for dead.
const SILENCE: Duration = Duration::from_millis(1500);

fn places(name: &str, dir: &TempDir) -> Vec<PathBuf> {
    std::iter::once(dir.path().join("run")).chain(crate::in_memory(&format!("claims/{name}"))).collect()
}

fn spec(format: &str) -> SweepSpec {
    let text = format!(
        "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 1000\nseed = 5\n\
         [[axis]]\nparameter = \"coil.current.x\"\nfrom = \"-0.3 A\"\nto = \"0.3 A\"\n\
         [output]\nquantities = [\"tip_position\"]\nderivatives = []\nformat = \"{format}\"\n"
    );
    SweepSpec::parse(&crate::root().join("sweeps/claims.toml"), &text).expect("a sweep")
}

fn job<'a>(format: &str) -> SweepJob<'a> {
    let job = SweepJob::new(spec(format)).engine(EngineRequest::of(BackendKind::Cpu));
    job.part_size(Some(16)).spot_check(None)
}

fn work(place: &Path, format: &str) -> Summary {
    job(format).run(&mut ResultDirectory::new(place).join(SILENCE)).expect("a worker")
}

/// One of several that live, however slow the machine is.
fn work_along(place: &Path, format: &str) -> Summary {
    job(format).run(&mut ResultDirectory::new(place).join(8 * SILENCE)).expect("a worker")
}

fn rows_alone(format: &str) -> Table {
    let mut memory = Memory::new();
    job(format).run(&mut memory).expect("a run");
    memory.into_table()
}

fn check_whole(place: &Path, rows: &Table, workers: usize) {
    let results = Results::open(place).expect("results");
    let status = results.status().expect("a status");
    assert!(status.is_complete() && status.damaged.is_empty());
    assert!(results.read(&[]).expect("rows") == *rows, "{}: the rows are those of one run alone", place.display());
    let manifest = results.manifest().expect("a manifest");
    assert!(manifest.complete);
    assert_eq!(manifest.workers.len(), workers);
    assert_eq!(manifest.counts.values().sum::<u64>(), 1000);
    assert_eq!(manifest.engines.values().sum::<u64>(), 1000, "{:?}", manifest.engines);
}

#[test]
fn workers_share_a_run_and_end_together() {
    let dir = tempfile::tempdir().expect("a folder");
    for format in ["parquet", "csv"] {
        let rows = rows_alone(format);
        for place in places(&format!("together-{format}"), &dir) {
            let place = place.join(format);
            let summaries: Vec<Summary> = std::thread::scope(|scope| {
                let workers: Vec<_> = (0..3).map(|_| scope.spawn(|| work_along(&place, format))).collect();
                workers.into_iter().map(|worker| worker.join().expect("no panic")).collect()
            });
            assert_eq!(summaries.iter().map(|summary| summary.solved).sum::<u64>(), 1000, "each sample is solved once");
            assert_eq!(summaries.iter().filter(|summary| summary.finished_run).count(), 1);
            assert!(summaries.iter().all(|summary| !summary.interrupted));
            check_whole(&place, &rows, 3);
            let workers = Results::open(&place).expect("results").workers().expect("workers");
            assert_eq!(workers.iter().map(|worker| worker.report.samples).sum::<u64>(), 1000);
            assert!(workers.iter().all(|worker| !worker.is_alive && worker.report.has_left));
            // Whoever comes later finds nothing to do.
            let late = work(&place, format);
            assert_eq!((late.solved, late.interrupted, late.finished_run), (0, false, false));
        }
    }
}

#[test]
fn a_worker_that_leaves_gives_back_what_it_has_claimed() {
    let dir = tempfile::tempdir().expect("a folder");
    let rows = rows_alone("parquet");
    for place in places("leaves", &dir) {
        let drain = AtomicBool::new(false);
        let seen = |_: &rodsweep::sweep::Progress| drain.store(true, Ordering::Relaxed);
        let first = job("parquet").drain(&drain).progress(Some(&seen));
        let first = first.run(&mut ResultDirectory::new(&place).join(SILENCE)).expect("a worker");
        assert!(first.interrupted && first.drained && first.solved > 0 && first.solved < 1000, "{}", first.solved);
        let results = Results::open(&place).expect("results");
        assert_eq!(results.status().expect("a status").samples_done, first.solved, "what was begun is there");
        let second = work(&place, "parquet");
        assert_eq!(first.solved + second.solved, 1000);
        check_whole(&place, &rows, 2);
    }
}

#[test]
fn claims_of_a_dead_worker_are_taken_over() {
    let dir = tempfile::tempdir().expect("a folder");
    let rows = rows_alone("parquet");
    for place in places("dead", &dir) {
        job("parquet").limit(None).run(&mut ResultDirectory::new(&place)).expect("a run");
        let store = store_at(&place).expect("a store");
        // A worker that claimed three units, one of them after another, and was never heard of again.
        let dead = "0123456789abcdef0123456789abcdef";
        store.put("workers/plan.json", b"{\"silence\":1.5,\"unit\":1}").expect("a plan");
        store.put(&format!("workers/{dead}.json"), b"{}").expect("a worker");
        for (unit, turn) in [(3, 0), (4, 0), (4, 1), (9, 0)] {
            store.put(&format!("claims/{unit:010}-{turn}"), dead.as_bytes()).expect("a claim");
            store.remove(&format!("part-{unit:010}.parquet")).expect("removed");
        }
        let before = std::time::Instant::now();
        let summary = work(&place, "parquet");
        assert!(before.elapsed() >= SILENCE, "it might have been alive");
        assert_eq!((summary.solved, summary.finished_run), (48, true));
        let claims: Vec<String> = store.list("claims").expect("a list").into_iter().map(|entry| entry.name).collect();
        assert!(claims.contains(&"0000000004-2".to_owned()), "{claims:?}");
        let results = Results::open(&place).expect("results");
        assert!(results.read(&[]).expect("rows") == rows);
    }
}

#[test]
fn the_one_that_ends_a_run_looks_into_the_parts() {
    let dir = tempfile::tempdir().expect("a folder");
    let rows = rows_alone("csv");
    for place in places("damaged", &dir) {
        job("csv").run(&mut ResultDirectory::new(&place)).expect("a run");
        let store = store_at(&place).expect("a store");
        store.put("part-0000000007.csv", b"sample,status\n").expect("damage");
        let summary = work(&place, "csv");
        assert_eq!((summary.solved, summary.finished_run), (16, true));
        assert!(store.get("part-0000000007.csv.bad-0").expect("an answer").is_some());
        check_whole(&place, &rows, 1);
    }
}

#[test]
fn a_run_without_rows_is_not_shared() {
    let dir = tempfile::tempdir().expect("a folder");
    let result = job("none").run(&mut ResultDirectory::new(dir.path()).join(SILENCE));
    let Err(SweepError::Results(error @ ResultsError::SharedWithoutRows { .. })) = result else { panic!("refused") };
    assert!(error.is_usage());
}

#[test]
fn a_method_is_fixed_unless_the_run_says_otherwise() {
    let dir = tempfile::tempdir().expect("a folder");
    let (fixed, free) = (dir.path().join("fixed"), dir.path().join("free"));
    let reference = || {
        SweepJob::new(spec("parquet"))
            .engine(EngineRequest::of(BackendKind::Reference))
            .part_size(Some(16))
            .spot_check(None)
    };
    let stop = AtomicBool::new(false);
    let seen = |_: &rodsweep::sweep::Progress| stop.store(true, Ordering::Relaxed);
    let begin = |out: &Path, mixed: bool| {
        stop.store(false, Ordering::Relaxed);
        let job = job("parquet").mixed_methods(mixed).drain(&stop).progress(Some(&seen));
        job.run(&mut ResultDirectory::new(out).join(SILENCE)).expect("a worker")
    };
    assert!(begin(&fixed, false).drained);
    let refused = reference().run(&mut ResultDirectory::new(&fixed).join(SILENCE)).map(|_| ());
    assert!(matches!(refused, Err(SweepError::OtherMethod { what: "engine", .. })), "{refused:?}");
    let refused = reference().mixed_methods(true).run(&mut ResultDirectory::new(&free));
    drop(refused.expect("another run"));
    std::fs::remove_dir_all(&free).expect("removed");
    let first = begin(&free, true);
    assert!(first.drained);
    let second = reference().mixed_methods(true).run(&mut ResultDirectory::new(&free).join(SILENCE)).expect("a worker");
    assert_eq!(first.solved + second.solved, 1000);
    let results = Results::open(&free).expect("results");
    assert_eq!((results.method(), results.record().mixed), (None, true));
    let status = results.status().expect("a status");
    assert!(status.is_complete());
    assert_eq!(
        status.methods.values().copied().collect::<std::collections::BTreeSet<u64>>(),
        [first.solved, second.solved].into()
    );
    assert!(status.methods.keys().any(|method| method.starts_with("reference f64")), "{:?}", status.methods);
    assert_eq!(results.manifest().expect("a manifest").methods, status.methods);
    // Without being told so, a worker does not join a run of free methods, nor the other way round.
    let refused = job("parquet").run(&mut ResultDirectory::new(&free).join(SILENCE)).map(|_| ());
    assert!(refused.expect_err("refused").to_string().contains("choice of methods"));
}

#[test]
fn of_two_first_workers_the_later_takes_the_method_of_the_other() {
    let dir = tempfile::tempdir().expect("a folder");
    for place in places("first", &dir) {
        let sink = || ResultDirectory::new(&place).join(SILENCE);
        // Both look before either has begun, on machines that choose differently.
        let late = job("parquet").prepare(&sink()).expect("a sweep");
        let stop = AtomicBool::new(true);
        let other = SolutionMethod { steps: late.method().steps + 4, ..late.method() };
        let early = job("parquet").method(Some(other)).drain(&stop).run(&mut sink()).expect("a worker");
        assert!(early.solved < 1000 && !late.is_settled());
        let late = late.run(&mut sink()).expect("a worker");
        assert_eq!(early.solved + late.solved, 1000);
        assert_eq!(Results::open(&place).expect("results").method(), Some(other), "one method solved all");
        // What differs otherwise is refused, as before.
        let begun = job("parquet").part_size(Some(8)).method(Some(other)).run(&mut sink()).map(|_| ());
        assert!(
            matches!(begun, Err(SweepError::Results(ResultsError::Mismatch { what: "chunk size", .. }))),
            "{begun:?}"
        );
    }
}

#[test]
fn no_clock_of_a_machine_is_asked_for_the_time() {
    let results = ["claims", "workers", "store/mod", "store/local"].map(|file| format!("src/results/{file}.rs"));
    for file in results.into_iter().chain(["crates/stores/src/objects.rs".into()]) {
        let path = crate::root().join(&file);
        let text = std::fs::read_to_string(path).expect("a file");
        assert!(text.len() > 2000 && !text.contains("SystemTime::now") && !text.contains("Utc::now"), "{file}");
    }
}
