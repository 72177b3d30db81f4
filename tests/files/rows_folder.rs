//! Rows in a folder of their own, which readers of tables open whole.

use super::common::root;
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::results::{Results, ResultsError, RunRecord, merge, remove_run};
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::{ResultDirectory, SweepJob};
use rodsweep::table::Table;
use std::fs;
use std::path::Path;

fn spec(output: &str) -> Result<SweepSpec, String> {
    let text = format!(
        "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 130\nseed = 5\n\
         [[axis]]\nparameter = \"coil.current.x\"\nfrom = \"-0.3 A\"\nto = \"0.3 A\"\n\
         [output]\nderivatives = [\"coil.current.x\"]\n{output}\n"
    );
    SweepSpec::parse(&root().join("sweeps/rows_folder.toml"), &text).map_err(|error| error.to_string())
}

fn in_folder(format: &str) -> SweepSpec {
    spec(&format!("format = \"{format}\"\nrows_in_folder = true")).expect("a sweep")
}

fn run(spec: SweepSpec, out: &Path, shard: Shard, resume: bool) -> Table {
    let job = SweepJob::new(spec).engine(EngineRequest::of(BackendKind::Cpu)).part_size(Some(32)).shard(shard);
    job.spot_check(None).run(&mut ResultDirectory::new(out).resume(resume)).expect("a run");
    Results::open(out).expect("results").read(&[]).expect("rows")
}

fn names(dir: &Path) -> Vec<String> {
    let names = fs::read_dir(dir).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    names.map(|name| name.to_string_lossy().into_owned()).collect()
}

#[test]
fn rows_are_those_of_a_flat_directory() {
    let dir = tempfile::tempdir().expect("a folder");
    let flat = run(spec("").expect("a sweep"), &dir.path().join("flat"), Shard::WHOLE, false);
    assert_eq!(flat.row_count(), 130);
    for format in ["parquet", "csv", "npz"] {
        let out = dir.path().join(format);
        let spec = in_folder(format);
        let again = SweepSpec::parse(Path::new("again.toml"), &spec.to_toml()).expect("its own text");
        assert!(again.rows_in_folder);
        assert_eq!(run(spec, &out, Shard::WHOLE, false), flat, "{format}");
        assert!(!names(&out).iter().any(|name| name.starts_with("part-")), "{:?}", names(&out));
        let rows = names(&out.join("rows"));
        assert_eq!(rows.iter().filter(|name| name.ends_with(&format!(".{format}"))).count(), 5, "{rows:?}");
    }
    // Readers of a folder take every file there for rows.
    assert_eq!(names(&dir.path().join("parquet/rows")).len(), 5);
}

#[test]
fn what_is_damaged_leaves_the_folder_of_rows_and_is_made_again() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let whole = run(in_folder("parquet"), &out, Shard::WHOLE, false);
    fs::remove_file(out.join("rows/part-0000000001.parquet")).expect("a part");
    fs::write(out.join("rows/part-0000000003.parquet"), b"PAR1").expect("damage");
    let status = Results::open(&out).expect("results").status().expect("a status");
    assert_eq!((status.parts_done, status.damaged.len()), (3, 1));
    assert!(status.damaged[0].0.ends_with("rows/part-0000000003.parquet"), "{:?}", status.damaged);
    assert_eq!(run(in_folder("parquet"), &out, Shard::WHOLE, true), whole);
    assert!(out.join("part-0000000003.parquet.bad-0").exists(), "{:?}", names(&out));
    assert_eq!(names(&out.join("rows")).len(), 5);
    fs::write(out.join("rows/.part-0000000003.parquet.0123456789abcdef0123456789abcdef.writing"), b"P")
        .expect("a file");
    fs::write(out.join("rows/notes.txt"), b"mine").expect("a file");
    let refused = remove_run(&out, &["tips.png", "tips.svg", "statuses.png"]).expect_err("a foreign file").to_string();
    assert!(refused.contains("rows/notes.txt") && !refused.contains("part-"), "{refused}");
    fs::remove_file(out.join("rows/notes.txt")).expect("removed");
    remove_run(&out, &["tips.png", "tips.svg", "statuses.png"]).expect("removed");
    assert_eq!(names(&out), Vec::<String>::new());
}

#[test]
fn shards_meet_in_one_folder_and_merge_into_another() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = |name: &str| dir.path().join(name);
    let whole = run(in_folder("csv"), &at("whole"), Shard::WHOLE, false);
    for index in [1, 2] {
        run(in_folder("csv"), &at("one place"), Shard { index, count: 2 }, index == 2);
        run(in_folder("csv"), &at(&index.to_string()), Shard { index, count: 2 }, false);
    }
    assert_eq!(Results::open(at("one place")).expect("results").read(&[]).expect("rows"), whole);
    merge(&[at("1"), at("2")], &at("merged")).expect("a merge");
    assert!(at("merged/rows/part-0000000004.csv").exists());
    assert_eq!(Results::open(at("merged")).expect("results").read(&[]).expect("rows"), whole);
    fs::remove_file(at("2/rows/part-0000000001.csv")).expect("a part");
    assert!(matches!(merge(&[at("1"), at("2")], &at("again")), Err(ResultsError::MissingParts { first: 1, .. })));
    fs::write(at("2/rows/part-0000000001.csv"), b"sample\n").expect("damage");
    let damaged = merge(&[at("1"), at("2")], &at("again")).expect_err("a damaged part").to_string();
    assert!(damaged.contains("part-0000000001.csv"), "{damaged}");
}

#[test]
fn a_folder_for_no_rows_is_refused() {
    let refused = spec("format = \"none\"\nrows_in_folder = true").expect_err("no rows");
    assert!(refused.contains("rows_in_folder") && refused.contains("no rows are written"), "{refused}");
    let refused = spec("rows_in_folder = \"rows\"").expect_err("a text");
    assert!(refused.contains("rows_in_folder"), "{refused}");
}

/// `run.json` as version 0.3.0 wrote it before there was a folder for rows.
const BEFORE: &str = r#"{"run_id": "4848bf13a0fcbc72aa4ff7c118da8418", "version": "0.3.0", "sample_count": 5,
    "chunk": 65536, "format": "parquet", "precision": "f64", "method": {"engine": "cpu", "precision": "f64",
    "stepper": "tp6", "steps": 2, "tolerance": 1e-6, "error_share": 0.015625, "error_floor": 5.391113959688513e-10,
    "derivative_scale": {"share": 1.0, "floor": 1.0}, "anchors": false}, "input": "cca2ed6b692489c6dabe596092f6c5dd",
    "columns": "702811fedafa917cdba194544781d388"}"#;

#[test]
fn earlier_runs_keep_their_ids() {
    let dir = tempfile::tempdir().expect("a folder");
    let sweep = spec("").expect("a sweep");
    let opens = |record: &str| {
        fs::write(dir.path().join("run.json"), record).expect("a file");
        fs::write(dir.path().join("sweep.toml"), sweep.to_toml()).expect("a file");
        Results::open(dir.path()).map(|_| ()).map_err(|error| error.to_string())
    };
    let record: RunRecord = serde_json::from_str(BEFORE).expect("a record");
    assert!(!record.rows_in_folder);
    // The sweep is another one: that is said, and nothing of the id.
    let other = opens(BEFORE).expect_err("another sweep");
    assert!(other.contains("sweep.toml") && !other.contains("run id"), "{other}");
    let changed = opens(&BEFORE.replace("\"columns\"", "\"rows_in_folder\": true, \"columns\"")).expect_err("changed");
    assert!(changed.contains("run id"), "{changed}");
}
