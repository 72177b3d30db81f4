//! One contract for every store, and a run that lies in each of them.

use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::figures::RunFigures;
use rodsweep::results::{Results, ResultsError, Store, merge, store_at};
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::study::sensitivity::SensitivityJob;
use rodsweep::sweep::{Memory, ResultDirectory, SweepError, SweepJob};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// Empty places: a directory, its address, and memory where there are object stores.
fn places(name: &str, dir: &TempDir) -> Vec<PathBuf> {
    let mut places = vec![dir.path().join("plain")];
    places.push(format!("file://{}", dir.path().join("address").display()).into());
    places.extend(crate::in_memory(&format!("{name}/some/prefix")));
    places
}

fn names(store: &dyn Store, folder: &str) -> Vec<(String, u64, bool)> {
    let mut found: Vec<_> = store
        .list(folder)
        .expect("a list")
        .into_iter()
        .map(|entry| (entry.name, if entry.is_file { entry.size } else { 0 }, entry.is_file))
        .collect();
    found.sort();
    found
}

#[test]
fn every_store_keeps_the_contract() {
    let dir = tempfile::tempdir().expect("a folder");
    for place in places("contract", &dir) {
        let store = store_at(&place).expect("a store");
        store.prepare().expect("a place");
        assert_eq!(names(store.as_ref(), ""), []);
        assert_eq!(store.get("a").expect("an answer"), None);
        assert!(store.head("a").expect("an answer").is_none());
        assert!(store.create("a", b"first").expect("created"));
        assert!(!store.create("a", b"second").expect("an answer"), "{}: what is there stays", place.display());
        assert_eq!(store.get("a").expect("an answer").as_deref(), Some(&b"first"[..]));
        store.put("a", b"replaced").expect("replaced");
        assert_eq!(store.get_range("a", 2..5).expect("a range"), b"pla");
        assert_eq!(store.get_range("a", 5..99).expect("a range that ends early"), b"ced");
        assert!(store.get_range("b", 0..1).is_err());
        let before = store.head("a").expect("an answer").expect("a file");
        assert_eq!((before.size, before.is_file), (8, true));
        assert!(store.create("folder/b", b"below").expect("created"));
        assert!(!store.create("folder/b", b"again").expect("an answer"));
        assert_eq!(names(store.as_ref(), ""), [("a".into(), 8, true), ("folder".into(), 0, false)]);
        assert_eq!(names(store.as_ref(), "folder"), [("b".into(), 5, true)]);
        assert_eq!(names(store.as_ref(), "nothing"), []);
        let listed = store.list("folder").expect("a list");
        assert_eq!(Some(&listed[0].modified), store.head("folder/b").expect("an answer").map(|e| e.modified).as_ref());
        assert!(listed[0].modified >= before.modified, "times grow");
        assert!(store.create("c", b"").expect("an empty file is a file"));
        assert!(!store.rename("a", "c").expect("an answer"), "the name is taken");
        assert!(store.rename("a", "d").expect("moved"));
        assert_eq!((store.get("a").expect("an answer"), store.get("d").expect("an answer").is_some()), (None, true));
        store.remove("d").expect("removed");
        store.remove("d").expect("removed before");
        assert_eq!(names(store.as_ref(), ""), [("c".into(), 0, true), ("folder".into(), 0, false)]);
    }
}

#[test]
fn one_of_many_creates_a_file() {
    let dir = tempfile::tempdir().expect("a folder");
    for place in places("race", &dir) {
        let store = store_at(&place).expect("a store");
        store.prepare().expect("a place");
        for round in 0..20 {
            let name = format!("claim-{round}");
            let won = |who: usize| {
                let store: Arc<dyn Store> = store.clone();
                let name = name.clone();
                move || store.create(&name, format!("worker {who}").as_bytes()).expect("an answer").then_some(who)
            };
            let threads: Vec<_> = (0..4).map(|who| std::thread::spawn(won(who))).collect();
            let winners: Vec<usize> =
                threads.into_iter().filter_map(|thread| thread.join().expect("no panic")).collect();
            let [winner] = winners[..] else { panic!("{}: {winners:?} have created {name}", place.display()) };
            let there = store.get(&name).expect("an answer").expect("a file");
            assert_eq!(there, format!("worker {winner}").as_bytes());
        }
    }
}

#[test]
fn only_what_is_ours_is_cleared_away() {
    let dir = tempfile::tempdir().expect("a folder");
    let old = std::time::SystemTime::now() - std::time::Duration::from_secs(7200);
    let ours = ".part-0000000003.parquet.0123456789abcdef0123456789abcdef.writing";
    let theirs = [".notes.tmp-2024", ".notes.writing", ".a.0123456789abcdef0123456789abcdeg.writing", "part.writing"];
    for name in theirs.into_iter().chain([ours]) {
        let file = std::fs::File::create(dir.path().join(name)).expect("a file");
        file.set_modified(old).expect("a time");
    }
    let young = ".part-0000000004.parquet.0123456789abcdef0123456789abcdef.writing";
    std::fs::write(dir.path().join(young), "").expect("a file");
    store_at(dir.path()).expect("a store").prepare().expect("a place");
    for name in theirs.into_iter().chain([young]) {
        assert!(dir.path().join(name).exists(), "{name} is gone");
    }
    assert!(!dir.path().join(ours).exists());
}

#[test]
fn an_address_that_is_not_understood_is_refused() {
    let refused = |url: &str, part: &str| match store_at(Path::new(url)) {
        Err(error @ ResultsError::Address { .. }) => {
            assert!(error.to_string().contains(part) && error.is_usage(), "{error}");
        }
        other => panic!("{url}: {other:?}"),
    };
    refused("file://results", "a path starts with a slash");
    if crate::in_memory("known").is_none() {
        refused("s3://bucket/results", "--features stores");
    }
}

fn spec(format: &str) -> SweepSpec {
    let text = format!(
        "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 130\nseed = 5\n\
         [[axis]]\nparameter = \"coil.current.x\"\nfrom = \"-0.3 A\"\nto = \"0.3 A\"\n\
         [[axis]]\nparameter = \"coil.current.y\"\nfrom = \"-0.3 A\"\nto = \"0.3 A\"\n\
         [output]\nquantities = [\"tip_position\", \"stability\", \"error_estimate\"]\n\
         derivatives = [\"coil.current\"]\nformat = \"{format}\"\n[workspace]\nvoxel = \"4 mm\"\n"
    );
    SweepSpec::parse(&crate::root().join("sweeps/stores.toml"), &text).expect("a sweep")
}

fn job<'a>(format: &str) -> SweepJob<'a> {
    let job = SweepJob::new(spec(format)).engine(EngineRequest::of(BackendKind::Cpu));
    job.part_size(Some(32)).spot_check(None)
}

#[test]
fn a_run_is_the_same_in_every_store() {
    let mut memory = Memory::new();
    job("parquet").run(&mut memory).expect("a run");
    let rows = memory.into_table();
    let dir = tempfile::tempdir().expect("a folder");
    for format in ["parquet", "csv", "npz", "none"] {
        for place in places("runs", &dir) {
            let out = place.join(format);
            let here = format!("{format} in {}", place.display());
            let summary = job(format).run(&mut ResultDirectory::new(&out)).expect(&here);
            let results = Results::open(&out).expect(&here);
            let again = job(format).run(&mut ResultDirectory::new(&out));
            assert!(matches!(again, Err(SweepError::Results(ResultsError::Exists { .. }))), "{here}");
            assert!(results.tips().expect(&here) == summary.reduction.tips, "{here}");
            assert!(results.manifest().expect(&here).complete);
            let files = RunFigures::new().draw(&results, &out).expect(&here);
            let store = store_at(&out).expect(&here);
            assert!(store.get("tips.png").expect(&here).is_some_and(|bytes| bytes.starts_with(b"\x89PNG")));
            assert_eq!(files[0], out.join("tips.png"));
            if format == "none" {
                continue;
            }
            assert_eq!(results.read(&[]).expect(&here), rows, "{here}");
            let some = results.read(&["tip.position.y", "sample"]).expect(&here);
            assert_eq!(
                (some.columns.len(), some.column("tip.position.y")),
                (2, rows.column("tip.position.y")),
                "{here}"
            );
            let status = results.status().expect(&here);
            assert_eq!((status.parts_done, status.samples_done, status.is_complete()), (5, 130, true), "{here}");
        }
    }
}

#[test]
fn what_is_missing_or_damaged_is_solved_again_in_every_store() {
    let dir = tempfile::tempdir().expect("a folder");
    for format in ["parquet", "csv", "npz"] {
        for place in places("damage", &dir) {
            let out = place.join(format);
            let here = format!("{format} in {}", place.display());
            job(format).run(&mut ResultDirectory::new(&out)).expect(&here);
            let rows = Results::open(&out).expect(&here).read(&[]).expect(&here);
            let store = store_at(&out).expect(&here);
            store.remove(&format!("part-0000000001.{format}")).expect(&here);
            let name = format!("part-0000000003.{format}");
            let mut bytes = store.get(&name).expect(&here).expect(&here);
            bytes.truncate(bytes.len() - 9);
            store.put(&name, &bytes).expect(&here);
            let status = Results::open(&out).expect(&here).status().expect(&here);
            assert_eq!((status.missing, status.damaged.len()), (vec![1, 3], 1), "{here}");
            let summary = job(format).run(&mut ResultDirectory::new(&out).resume(true)).expect(&here);
            assert_eq!(
                (summary.solved, summary.quarantined),
                (64, vec![store.path(&format!("{name}.bad-0"))]),
                "{here}"
            );
            assert!(Results::open(&out).expect(&here).read(&[]).expect(&here) == rows, "{here}");
        }
    }
}

#[test]
fn shards_merge_from_one_store_into_another() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut memory = Memory::new();
    job("parquet").run(&mut memory).expect("a run");
    let rows = memory.into_table();
    for format in ["csv", "none"] {
        let places = places("shards", &dir);
        let shard = |index: u64| places[index as usize % places.len()].join(format!("{format}-{index}"));
        for index in 1..=3 {
            let job = job(format).shard(Shard::parse(&format!("{index}/3")).expect("a shard"));
            job.run(&mut ResultDirectory::new(shard(index))).expect("a run");
        }
        for place in &places {
            let out = place.join(format!("{format}-merged"));
            let status = merge(&[shard(1), shard(2), shard(3)], &out).expect("merged");
            assert_eq!(status.samples_done, 130);
            if format == "csv" {
                assert!(Results::open(&out).expect("results").read(&[]).expect("rows") == rows);
            }
        }
    }
}

#[test]
fn a_late_writer_of_other_bytes_changes_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    for place in places("late", &dir) {
        let out = place.join("csv");
        job("csv").run(&mut ResultDirectory::new(&out)).expect("a run");
        let store = store_at(&out).expect("a store");
        let before = names(store.as_ref(), "");
        // Another worker had begun the same part on another engine: its sidecar comes, its part is too late.
        let late = "part-0000000002.csv.00000000000000aa.json";
        assert!(store.create(late, b"{\"what it says\": \"of other bytes\"}").expect("created"));
        assert!(!store.create("part-0000000002.csv", b"other bytes").expect("an answer"));
        let status = Results::open(&out).expect("results").status().expect("a status");
        assert!(status.is_complete() && status.damaged.is_empty(), "{:?}", status.damaged);
        assert_eq!(names(store.as_ref(), "").len(), before.len() + 1);
    }
}

#[test]
fn a_sweep_over_a_table_and_its_study_lie_in_every_store() {
    let dir = tempfile::tempdir().expect("a folder");
    let table =
        "coil.current.x,coil.current.y\n0.1,0\n0.2,0.05\n-0.1,0.1\n0,0.2\n0.05,-0.2\n0.15,0.1\n0.2,0.2\n-0.2,0\n";
    std::fs::write(dir.path().join("values.csv"), table).expect("a file");
    let scene = crate::root().join("sweeps/scenes/p6.toml");
    let text = format!(
        "scene = {scene:?}\n[sampling]\nmethod = \"table\"\nfile = \"values.csv\"\n[output]\n\
         quantities = [\"tip_position\"]\nderivatives = [\"coil.current\"]\n"
    );
    let spec = SweepSpec::parse(&dir.path().join("sweep.toml"), &text).expect("a sweep");
    for place in places("tables", &dir) {
        let job = SweepJob::new(spec.clone()).engine(EngineRequest::of(BackendKind::Cpu)).spot_check(None);
        job.run(&mut ResultDirectory::new(&place)).expect("a run");
        let results = Results::open(&place).expect("results");
        assert_eq!(results.spec().sample_count, 8);
        let found = SensitivityJob::of_results(results).run().expect("a study");
        let files = found.write(&place).expect("files");
        let store = store_at(&place).expect("a store");
        assert!(files.contains(&place.join("sensitivity.json")), "{files:?}");
        assert!(store.get("sensitivity.json").expect("an answer").is_some());
    }
}
