//! Rows go to a directory, to memory or to a function, and a directory opened again gives what the run had.

use crate::common::root;
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::figures::{RunFigures, RunFiguresError};
use rodsweep::model::Status;
use rodsweep::results::{Reduction, Results, ResultsError};
use rodsweep::spec::{Format, SweepSpec};
use rodsweep::sweep::{Callback, Memory, ResultDirectory, SpotCheckOptions, SweepError, SweepJob};
use rodsweep::table::{Table, Values};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

fn spec(format: &str) -> SweepSpec {
    let text = format!(
        "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 130\nseed = 5\n\
         [[axis]]\nparameter = \"coil.current.x\"\nfrom = \"-0.3 A\"\nto = \"0.3 A\"\n\
         [[axis]]\nparameter = \"coil.current.y\"\nfrom = \"-0.3 A\"\nto = \"0.3 A\"\n\
         [output]\nquantities = [\"tip_position\", \"stability\", \"error_estimate\"]\n\
         derivatives = [\"coil.current\"]\nformat = \"{format}\"\n[workspace]\nvoxel = \"4 mm\"\n"
    );
    let file = root().join("sweeps/sinks.toml");
    SweepSpec::parse(&file, &text).expect("a sweep")
}

fn job<'a>(format: &str) -> SweepJob<'a> {
    let job = SweepJob::new(spec(format)).engine(EngineRequest::of(BackendKind::Cpu));
    job.part_size(Some(32)).spot_check(None)
}

#[test]
fn every_sink_gets_the_same_rows() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut memory = Memory::new();
    let summary = job("parquet").run(&mut memory).expect("a run");
    let rows = memory.into_table();
    assert_eq!((rows.row_count(), summary.solved), (130, 130));
    for format in ["parquet", "csv", "npz"] {
        let out = dir.path().join(format);
        job(format).run(&mut ResultDirectory::new(&out)).expect("a run");
        assert_eq!(Results::open(&out).expect("results").read(&[]).expect("rows"), rows, "{format}");
    }
    let (mut called, mut parts) = (Table::default(), Vec::new());
    let mut take = |part, rows: &Table| -> Result<(), SweepError> {
        parts.push((part, rows.row_count()));
        called.append(rows);
        Ok(())
    };
    job("parquet").run(&mut Callback(&mut take)).expect("a run");
    assert_eq!(parts, [(0, 32), (1, 32), (2, 32), (3, 32), (4, 2)]);
    assert_eq!(called, rows);
}

#[test]
fn derivatives_in_single_precision() {
    let single = SweepSpec { single_derivatives: true, ..spec("parquet") };
    let text = single.to_toml();
    assert_eq!(text.matches("derivative_precision = \"f32\"").count(), 1, "{text}");
    assert!(SweepSpec::parse(Path::new("again.toml"), &text).expect("a sweep").single_derivatives);
    let solve = |spec: SweepSpec| {
        let mut memory = Memory::new();
        let job = SweepJob::new(spec).engine(EngineRequest::of(BackendKind::Cpu)).spot_check(None);
        job.run(&mut memory).expect("a run");
        memory.into_table()
    };
    let (ours, full) = (solve(single.clone()), solve(spec("parquet")));
    for (ours, full) in ours.columns.iter().zip(&full.columns) {
        assert_eq!(ours.name, full.name);
        match (&ours.values, &full.values) {
            (Values::Single(ours), Values::Double(full)) if full.len() == 130 => {
                assert!(ours.iter().zip(full).all(|(a, b)| *a == *b as f32));
            }
            (ours, full) => assert_eq!(ours, full),
        }
        assert_eq!(matches!(ours.values, Values::Single(_)), ours.name.starts_with("d("), "{}", ours.name);
    }
    let dir = tempfile::tempdir().expect("a folder");
    for format in [Format::Parquet, Format::Csv, Format::Npz] {
        let out = dir.path().join(format.name());
        let job = SweepJob::new(SweepSpec { format, ..single.clone() }).engine(EngineRequest::of(BackendKind::Cpu));
        job.spot_check(None).run(&mut ResultDirectory::new(&out)).expect("a run");
        assert_eq!(Results::open(&out).expect("results").read(&[]).expect("rows"), ours, "{}", format.name());
    }
}

#[test]
fn an_error_of_a_sink_ends_the_run() {
    let mut parts = 0;
    let mut take = |part: u64, _: &Table| -> Result<(), SweepError> {
        parts += 1;
        if part == 1 { Err(ResultsError::NoRun { dir: "full".into() }.into()) } else { Ok(()) }
    };
    let error = job("parquet").run(&mut Callback(&mut take)).expect_err("the sink failed");
    assert!(error.to_string().starts_with("full"), "{error}");
    assert_eq!(parts, 2);
}

#[test]
fn a_directory_opened_again_gives_what_the_run_had() {
    let dir = tempfile::tempdir().expect("a folder");
    for format in ["parquet", "none"] {
        let out = dir.path().join(format);
        let summary = job(format).run(&mut ResultDirectory::new(&out)).expect("a run");
        let results = Results::open(&out).expect("results");
        assert_eq!(results.spec().sample_count, 130);
        assert_eq!(results.has_rows(), results.spec().format != Format::None);
        let again = results.reduce(results.spec().workspace.voxel).expect("statistics");
        let had = &summary.reduction;
        assert_eq!((again.counts, again.sample_count, again.extents), (had.counts, had.sample_count, had.extents));
        assert_eq!(again.tips, had.tips, "{format}");
        assert_eq!(results.tips().expect("tips"), had.tips);
        let voxels = results.voxels(results.spec().workspace.voxel).expect("voxels");
        assert_eq!(voxels, again.voxel_table());
        assert_eq!(
            voxels.numbers("count").expect("counts").iter().sum::<f64>(),
            summary.count(Status::Ok) as f64 + (summary.count(Status::Ramped) + summary.count(Status::Refined)) as f64
        );
        let manifest = results.manifest().expect("a manifest");
        let text = std::fs::read_to_string(out.join("manifest.json")).expect("a file");
        assert_eq!(text, serde_json::to_string_pretty(&manifest).expect("JSON") + "\n", "it reads back whole");
        let run = manifest.run.expect("the account of a run");
        assert_eq!((run.samples_of_shard, run.rows), (130, summary.reduction.row_count()));
    }
}

#[test]
fn rows_are_streamed_by_column() {
    let dir = tempfile::tempdir().expect("a folder");
    job("parquet").run(&mut ResultDirectory::new(dir.path())).expect("a run");
    let results = Results::open(dir.path()).expect("results");
    let names = ["tip.position.z", "sample"];
    let parts: Vec<Table> = results.parts(&names).expect("parts").map(|part| part.expect("a part")).collect();
    assert_eq!(parts.iter().map(Table::row_count).collect::<Vec<_>>(), [32, 32, 32, 32, 2]);
    assert!(parts.iter().all(|part| part.columns.len() == 2));
    let samples: Vec<u64> = parts.iter().flat_map(|part| part.samples().to_vec()).collect();
    assert_eq!(samples, (0..130).collect::<Vec<u64>>());
    assert!(results.columns().iter().any(|column| column.name == "d(tip.position.x)/d(coil.current.y)"));
    let Err(ResultsError::NoColumn { name, suggestion, .. }) = results.read(&["tip.position.w"]) else {
        panic!("no such column")
    };
    assert_eq!((name.as_str(), suggestion.is_some()), ("tip.position.w", true));
    let status = results.status().expect("a status");
    assert_eq!((status.parts_done, status.samples_done, status.is_complete()), (5, 130, true));
}

#[test]
fn figures_are_drawn_from_the_files() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("run");
    job("parquet").run(&mut ResultDirectory::new(&out)).expect("a run");
    let results = Results::open(&out).expect("results");
    let draw = |figures: &RunFigures, name: &str| {
        let folder = dir.path().join(name);
        std::fs::create_dir(&folder).expect("a folder");
        let files = figures.draw(&results, &folder).expect("figures");
        files
            .into_iter()
            .map(|file| (file.file_name().expect("a name").to_owned(), std::fs::read(file).expect("a file")))
            .collect::<Vec<_>>()
    };
    let by_margin = draw(&RunFigures::new(), "margin");
    let names: Vec<_> = by_margin.iter().map(|(name, _)| name.to_string_lossy().into_owned()).collect();
    assert_eq!(names, ["tips.png", "tips.svg", "statuses.png"]);
    assert!(by_margin == draw(&RunFigures::new(), "again"), "the same files give the same figures");
    let by_current = draw(&RunFigures::new().colour(Some("coil.current.y")), "current");
    assert!(by_current[1] != by_margin[1]);
    let error = RunFigures::new().colour(Some("margin")).draw(&results, &out).expect_err("no such column");
    assert!(matches!(&error, RunFiguresError::Colour { known, .. } if known.len() > 5), "{error}");
}

#[test]
fn what_a_run_tells_beside_its_spot_check_gives_the_figures_of_its_files() {
    let dir = tempfile::tempdir().expect("a folder");
    let drawn = |folder: &str, names: Vec<PathBuf>| -> Vec<Vec<u8>> {
        assert!(names.iter().all(|name| name.starts_with(dir.path().join(folder))));
        names.into_iter().map(|name| std::fs::read(name).expect("a file")).collect()
    };
    let told = Mutex::new(Vec::new());
    let tell = |spec: &SweepSpec, rows: &Reduction| {
        let folder = dir.path().join("told");
        std::fs::create_dir_all(&folder).expect("a folder");
        let files = RunFigures::new().draw_reduction(spec, rows, &folder).expect("figures");
        told.lock().expect("no panic").push(drawn("told", files));
    };
    let flag = AtomicBool::new(true);
    let out = dir.path().join("run");
    let job = |spot_check| job("parquet").spot_check(spot_check).rows_written(Some(&tell));
    let summary = job(None).interrupt(&flag).run(&mut ResultDirectory::new(&out)).expect("a run");
    assert!(summary.interrupted && told.lock().expect("no panic").is_empty(), "an interrupted run tells nothing");

    let out = dir.path().join("whole");
    let check = Some(SpotCheckOptions::default());
    let summary = job(check).run(&mut ResultDirectory::new(&out)).expect("a run");
    assert!(summary.spot_check.is_some_and(|check| check.checked > 0));
    // A run that goes on finds its parts in another order than it makes them.
    std::fs::remove_file(out.join("part-0000000001.parquet")).expect("a part");
    let summary = job(None).run(&mut ResultDirectory::new(&out).resume(true)).expect("a run");
    assert_eq!((summary.solved, summary.resumed), (32, 98));

    let files = RunFigures::new().draw(&Results::open(&out).expect("results"), &out).expect("figures");
    let files = drawn("whole", files);
    let told = told.into_inner().expect("no panic");
    assert_eq!(told.len(), 2, "once a run");
    assert!(told.iter().all(|told| *told == files));
}
