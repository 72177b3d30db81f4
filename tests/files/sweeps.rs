//! Runs that are cut short, resumed, damaged, sharded: with a small analytic backend.

use crate::arc::{Arc, arc, contents, options, parts, shipped, small};
use crate::common::runs::{manifest_of, read_columns, reduced, resume_in, run_into, spec_of, status_of};
use rodsweep::backend::{Backend, BackendError, BackendInfo, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::cpu_f64;
use rodsweep::input::read_scene;
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Solutions, Status, Stepper};
use rodsweep::results::{ResultsError, TIPS_FILE, WORKSPACE_FILE, WORST_FILE, merge, read_parquet_table};
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::{Progress, RunOptions, SweepError, choose_steps};
use rodsweep::table::{Table, Values};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

#[test]
fn columns_are_those_of_the_interface() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    run_into(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    let table = read_columns(dir.path(), &[]).unwrap();
    let names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
    let head = [
        "sample",
        "coil.current.x",
        "proximal.youngs_modulus",
        "distal.youngs_modulus",
        "status",
        "tip.position.x",
        "tip.position.y",
        "tip.position.z",
        "tip.rotation.x",
        "tip.rotation.y",
        "tip.rotation.z",
        "base_curvature.x",
        "base_curvature.y",
        "base_curvature.z",
        "stability.margin",
        "stable",
        "error_estimate",
        "d(tip.position.x)/d(coil.current.x)",
    ];
    assert_eq!(&names[..head.len()], head);
    assert_eq!((names.len(), names[names.len() - 1]), (17 + 18 + 1, "derivative_error"));
    assert_eq!(table.column("tip.position.x").unwrap().unit, "m");
    assert_eq!(table.column("d(tip.rotation.x)/d(coil.current.z)").unwrap().unit, "rad/A");
    assert_eq!(table.samples(), (0..5000).collect::<Vec<u64>>());
    let (statuses, x) = (table.statuses(), table.numbers("tip.position.x").unwrap());
    assert!(statuses.contains(&Status::NotConverged));
    for (status, x) in statuses.iter().zip(x) {
        assert_eq!(status.is_converged(), x.is_finite());
    }
    let sampler = spec.sampler();
    let mut row = [0.0; 2];
    sampler.values(4321, &mut row);
    assert_eq!(table.numbers("coil.current.x").unwrap()[4321], row[0]);
    assert_eq!(table.numbers("distal.youngs_modulus").unwrap()[4321], row[1]);
}

#[test]
fn every_format_holds_the_same_rows() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    for precision in [Precision::F64, Precision::F32] {
        let tables: Vec<Table> = ["parquet", "csv", "npz"]
            .iter()
            .map(|format| {
                let (spec, out) = (small(format), dir.path().join(format!("{format}-{precision}")));
                run_into(&out, &spec, &mut Arc { precision, ..arc(&spec) }, &options()).unwrap();
                assert!(status_of(&out).unwrap().is_complete());
                read_columns(&out, &[]).unwrap()
            })
            .collect();
        for other in &tables[1..] {
            for (one, two) in tables[0].columns.iter().zip(&other.columns) {
                assert_eq!((&one.name, &one.unit), (&two.name, &two.unit));
                let numbers =
                    |values: &Values| (0..values.len()).map(|k| values.number(k).to_bits()).collect::<Vec<_>>();
                assert_eq!(numbers(&one.values), numbers(&two.values), "{}", one.name);
            }
        }
        let single = matches!(tables[0].column("tip.position.x").unwrap().values, Values::Single(_));
        assert_eq!(single, precision == Precision::F32);
    }
    assert_eq!(spec.format.name(), "parquet");
}

#[test]
fn batch_size_and_shards_change_nothing() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let whole = dir.path().join("whole");
    run_into(&whole, &spec, &mut arc(&spec), &options()).unwrap();
    for batch_size in [1, 999, 2500, 100_000] {
        let out = dir.path().join(format!("batch-{batch_size}"));
        run_into(&out, &spec, &mut Arc { batch_size, ..arc(&spec) }, &options()).unwrap();
        assert_eq!(contents(&whole), contents(&out), "{batch_size}");
    }
    let shards: Vec<PathBuf> = (1..=3).map(|k| dir.path().join(format!("shard-{k}"))).collect();
    let mut solved = 0;
    for (k, out) in shards.iter().enumerate().rev() {
        let shard = Shard::parse(&format!("{}/3", k + 1)).unwrap();
        solved += run_into(out, &spec, &mut arc(&spec), &RunOptions { shard, ..options() }).unwrap().solved;
    }
    assert_eq!(solved, 5000);
    assert!(matches!(merge(&shards[1..], &dir.path().join("part")), Err(ResultsError::MissingParts { .. })));
    let merged = dir.path().join("merged");
    assert!(merge(&shards, &merged).unwrap().is_complete());
    assert_eq!(contents(&whole), contents(&merged));
    assert_eq!(read_columns(&merged, &["sample"]).unwrap().samples(), (0..5000).collect::<Vec<u64>>());
}

/// Raises the interrupt flag when it has solved so many batches.
struct Interrupting<'a> {
    arc: Arc,
    flag: &'a AtomicBool,
    left: AtomicUsize,
}

impl Backend for Interrupting<'_> {
    fn info(&self) -> BackendInfo {
        self.arc.info()
    }
    fn plan(&self) -> &Plan {
        self.arc.plan()
    }
    fn batch_size(&self) -> usize {
        self.arc.batch_size()
    }
    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        if self.left.fetch_sub(1, Ordering::Relaxed) == 1 {
            self.flag.store(true, Ordering::Relaxed);
        }
        self.arc.solve(batch)
    }
}

#[test]
fn an_interrupted_run_keeps_whole_parts_and_resumes() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let (whole, cut) = (dir.path().join("whole"), dir.path().join("cut"));
    run_into(&whole, &spec, &mut arc(&spec), &options()).unwrap();
    let flag = AtomicBool::new(false);
    let mut backend = Interrupting { arc: arc(&spec), flag: &flag, left: AtomicUsize::new(4) };
    let summary = run_into(&cut, &spec, &mut backend, &RunOptions { interrupt: Some(&flag), ..options() }).unwrap();
    assert!(summary.interrupted && summary.solved < 5000 && summary.solved.is_multiple_of(1000));
    let status = status_of(&cut).unwrap();
    assert_eq!(status.samples_done, summary.solved);
    assert!(!status.is_complete());
    assert!(matches!(
        run_into(&cut, &spec, &mut arc(&spec), &options()),
        Err(SweepError::Results(ResultsError::Exists { .. }))
    ));
    let resumed = resume_in(&cut, &spec, &mut arc(&spec), &options()).unwrap();
    assert_eq!((resumed.resumed, resumed.solved), (summary.solved, 5000 - summary.solved));
    assert_eq!(resumed.reduction.sample_count, 5000);
    assert_eq!(contents(&whole), contents(&cut));
    let again = resume_in(&cut, &spec, &mut arc(&spec), &options()).unwrap();
    assert_eq!((again.resumed, again.solved), (5000, 0));
}

/// A directory to run into, and how many samples to stop at, for the process that is killed.
const KILLED: &str = "RODSWEEP_TEST_KILLED_RUN";
const STOP_AT: &str = "RODSWEEP_TEST_STOP_AT";
/// Nothing is waited for any longer.
const PATIENCE: Duration = Duration::from_secs(120);

/// Not a test of its own: the process that the next test kills.
#[test]
fn child_that_is_killed() {
    let Ok(dir) = std::env::var(KILLED) else { return };
    let stop_at: u64 = std::env::var(STOP_AT).unwrap().parse().unwrap();
    let spec = small("parquet");
    let mut backend = Arc { batch_size: 50, ..arc(&spec) };
    // In the midst of its work when it is killed, however late that comes.
    let wait = |progress: &Progress| match progress.done < stop_at {
        true => thread::sleep(Duration::from_millis(1)),
        false => thread::sleep(PATIENCE),
    };
    let options = RunOptions { chunk: 100, progress: Some(&wait), ..options() };
    resume_in(Path::new(&dir), &spec, &mut backend, &options).unwrap();
}

/// This program again, to run one test of this file.
fn this_program(test: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([&format!("{}::{test}", module_path!().split_once("::").unwrap().1), "--exact", "--nocapture"]);
    command
}

#[test]
fn killed_runs_leave_whole_parts_and_resume() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let (whole, cut) = (dir.path().join("whole"), dir.path().join("cut"));
    run_into(&whole, &spec, &mut arc(&spec), &RunOptions { chunk: 100, ..options() }).unwrap();
    let done = || parts(&cut).len();
    for wanted in [0, 1, 3, 10, 25] {
        let mut child = this_program("child_that_is_killed")
            .envs([(KILLED, cut.as_os_str()), (STOP_AT, format!("{}", 100 * (wanted + 10)).as_ref())])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let begin = Instant::now();
        while !cut.is_dir() || done() < wanted {
            assert!(
                begin.elapsed() < PATIENCE && child.try_wait().unwrap().is_none(),
                "{wanted} parts are not reached"
            );
            thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        match status_of(&cut) {
            Ok(status) => assert!(status.damaged.is_empty(), "{:?}", status.damaged),
            Err(ResultsError::NoRun { .. } | ResultsError::NotBegun { .. }) => assert_eq!(done(), 0),
            Err(error) => panic!("{error}"),
        }
    }
    assert!(done() >= 25 && done() < 50, "{} of 50 parts", done());
    resume_in(&cut, &spec, &mut arc(&spec), &RunOptions { chunk: 100, ..options() }).unwrap();
    assert_eq!(contents(&whole), contents(&cut));
}

#[test]
fn runs_killed_before_their_first_part_say_so_and_resume() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    run_into(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    let whole = contents(dir.path());
    for path in parts(dir.path()).iter().map(|name| dir.path().join(name)).chain([dir.path().join("sweep.toml")]) {
        fs::remove_file(path).unwrap();
    }
    assert!(matches!(status_of(dir.path()), Err(ResultsError::NotBegun { .. })));
    resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    assert_eq!(whole, contents(dir.path()));
    assert!(status_of(dir.path()).unwrap().is_complete());
}

#[test]
fn damaged_parts_are_moved_away_and_solved_again() {
    for format in ["parquet", "csv", "npz"] {
        let spec = small(format);
        let dir = tempfile::tempdir().unwrap();
        run_into(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
        let before = contents(dir.path());
        let path = |k: usize| dir.path().join(&before[k].0);
        let mut bytes = before[1].1.clone();
        bytes[before[1].1.len() / 3] ^= 4;
        fs::write(path(1), &bytes).unwrap();
        fs::write(path(2), &before[2].1[..before[2].1.len() / 2]).unwrap();
        fs::copy(path(0), path(3)).unwrap();
        fs::remove_file(path(4)).unwrap();
        let status = status_of(dir.path()).unwrap();
        assert_eq!((status.damaged.len(), status.missing.len()), (3, 4), "{format}: {:?}", status.damaged);
        let summary = resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
        assert_eq!((summary.quarantined.len(), summary.solved), (3, 4000));
        assert_eq!(before, contents(dir.path()), "{format}");
    }
}

#[test]
fn other_runs_and_foreign_directories_are_refused() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    run_into(&out, &spec, &mut arc(&spec), &options()).unwrap();
    let resume = options();
    let mismatch = |spec: &SweepSpec, backend: &mut Arc, options: &RunOptions| {
        let error = resume_in(&out, spec, backend, options).expect_err("another run");
        assert!(error.is_usage());
        match error {
            SweepError::Results(ResultsError::Mismatch { what, .. }) => what.to_owned(),
            SweepError::Results(ResultsError::Changed { changes, .. }) => changes.join("; "),
            other => panic!("{other:?}"),
        }
    };
    let other = SweepSpec { seed: 4, ..spec.clone() };
    assert_eq!(mismatch(&other, &mut arc(&other), &resume), "`[sampling] seed`: 4, was 3");
    let limited = RunOptions { limit: Some(10), ..resume.clone() };
    assert_eq!(mismatch(&spec, &mut arc(&spec), &limited), "number of samples");
    assert_eq!(mismatch(&spec, &mut arc(&spec), &RunOptions { chunk: 7, ..resume.clone() }), "chunk size");
    let mut single = Arc { precision: Precision::F32, ..arc(&spec) };
    assert_eq!(mismatch(&spec, &mut single, &resume), "precision");
    let foreign = dir.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.tex"), "x").unwrap();
    let error = run_into(&foreign, &spec, &mut arc(&spec), &options()).unwrap_err();
    assert!(matches!(error, SweepError::Results(ResultsError::Foreign { .. })) && error.is_usage(), "{error}");
    assert!(matches!(status_of(&foreign), Err(ResultsError::NoRun { .. })));
    let plan = small("parquet").plan(PlanOptions::default()).unwrap();
    let wider = SweepSpec { wrt: Vec::new(), ..spec };
    assert!(matches!(run_into(&out, &wider, &mut Arc::new(&plan), &options()), Err(SweepError::WrongPlan { .. })));
}

/// Meets a fold on the way to every sample.
struct Folding(Arc);

impl Backend for Folding {
    fn info(&self) -> BackendInfo {
        self.0.info()
    }
    fn plan(&self) -> &Plan {
        self.0.plan()
    }
    fn batch_size(&self) -> usize {
        self.0.batch_size()
    }
    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let mut solutions = self.0.solve(batch)?;
        (0..batch.sample_count()).for_each(|at| solutions.set_status(at, Status::Fold));
        Ok(solutions)
    }
}

#[test]
fn spot_check_counts_what_only_the_run_solves() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let trusted = |plan: &Plan| Ok(Box::new(Folding(Arc::new(plan))) as Box<dyn Backend>);
    let options = RunOptions { trusted: Some(&trusted), ..options() };
    let check = run_into(&dir.path().join("out"), &spec, &mut arc(&spec), &options).unwrap().spot_check.unwrap();
    assert!(check.only_run > 0 && check.only_run + check.compared <= check.checked, "{check:?}");
    assert_eq!((check.compared, check.only_trusted, check.wrong), (0, 0, 0));
    assert!(check.only_run_sample.is_some());
    assert_eq!(check.only_run_values.len(), 3);
}

#[test]
fn spot_check_finds_the_size_of_an_error() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let trusted = |plan: &Plan| Ok(Box::new(Arc::new(plan)) as Box<dyn Backend>);
    let options = RunOptions { trusted: Some(&trusted), ..options() };
    let same = run_into(&dir.path().join("same"), &spec, &mut arc(&spec), &options).unwrap().spot_check.unwrap();
    assert_eq!((same.checked, same.position.max, same.rotation.max), (256, 0.0, 0.0));
    let mut off = Arc { offset: 0.943e-3, ..arc(&spec) };
    let check = run_into(&dir.path().join("off"), &spec, &mut off, &options).unwrap().spot_check.unwrap();
    assert!((check.position.max - 0.01).abs() < 1e-12 && (check.position.median - 0.01).abs() < 1e-12, "{check:?}");
    assert!(check.derivative.max > 0.0 && check.worst_sample.is_some());
    assert_eq!(check.worst_values.len(), 3);
    let worst = read_scene(&dir.path().join("off").join(WORST_FILE)).unwrap();
    assert_eq!(worst, spec.sample_scene(check.worst_sample.unwrap()));
    let manifest = manifest_of(&dir.path().join("off"));
    assert!(manifest["spot_check"]["position"]["max"].as_f64().unwrap() > 0.0);
}

#[test]
fn failed_samples_get_a_second_attempt() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let failed = run_into(&dir.path().join("one"), &spec, &mut arc(&spec), &options()).unwrap().failed();
    assert!(failed > 10);
    let refiner = |plan: &Plan| Ok(Box::new(Arc { fails: false, ..Arc::new(plan) }) as Box<dyn Backend>);
    let options = RunOptions { refiners: vec![&refiner], ..options() };
    let summary = run_into(&dir.path().join("two"), &spec, &mut arc(&spec), &options).unwrap();
    assert_eq!((summary.failed(), summary.count(Status::Refined)), (0, failed));
    let table = read_columns(&dir.path().join("two"), &["tip.position.x"]).unwrap();
    assert!(table.numbers("tip.position.x").unwrap().iter().all(|x| x.is_finite()));
}

#[test]
fn doubt_is_settled_before_a_second_attempt() {
    let spec = small("parquet");
    let coarse = PlanOptions { stepper: Stepper::Rk4, steps: 4, tolerance: 1e-9, ..PlanOptions::default() };
    let plan = spec.plan(coarse).unwrap().with_options(coarse);
    let dir = tempfile::tempdir().unwrap();
    let settle = |plan: &Plan| {
        let finer = plan.with_options(PlanOptions { stepper: Stepper::Dop853, steps: 16, ..plan.options });
        Ok(Box::new(Cpu::new(&finer, Precision::F64)?) as Box<dyn Backend>)
    };
    // Nothing is left for it.
    let refiner = |_: &Plan| Err(BackendError::NoDevice { reason: "a second attempt was made".into() });
    let options = RunOptions { settle: Some(&settle), refiners: vec![&refiner], limit: Some(1000), ..options() };
    let mut engine = Cpu::new(&plan, Precision::F64).unwrap();
    let summary = run_into(dir.path(), &spec, &mut engine, &options).unwrap();
    assert_eq!(summary.failed(), 0);
    assert!(summary.count(Status::Refined) > 500, "{}", summary.count(Status::Refined));
    let estimates = read_columns(dir.path(), &["error_estimate"]).unwrap();
    let worst = estimates.numbers("error_estimate").unwrap().iter().fold(0.0, |a: f64, b| a.max(*b));
    assert!(worst <= plan.options.tolerance, "{worst}");
}

#[test]
fn a_run_without_rows_leaves_its_workspace() {
    let (rows, none) = (small("parquet"), small("none"));
    let dir = tempfile::tempdir().unwrap();
    let (with, without) = (dir.path().join("rows"), dir.path().join("none"));
    run_into(&with, &rows, &mut arc(&rows), &options()).unwrap();
    let summary = run_into(&without, &none, &mut arc(&none), &options()).unwrap();
    assert!(parts(&without).is_empty());
    let again = reduced(&with, 1e-3).unwrap();
    assert_eq!(summary.reduction.voxels, again.voxels);
    assert_eq!(summary.reduction.extents, again.extents);
    assert_eq!(summary.reduction.counts, again.counts);
    let voxels = read_parquet_table(&without.join(WORKSPACE_FILE)).unwrap();
    let total: f64 = voxels.numbers("count").unwrap().iter().sum();
    assert_eq!(total as u64, 5000 - summary.failed());
    assert_eq!(read_parquet_table(&without.join(TIPS_FILE)).unwrap().row_count(), 5000);
    let shards: Vec<PathBuf> = (1..=2).map(|k| dir.path().join(format!("none-{k}"))).collect();
    for (index, out) in (1..).zip(&shards) {
        run_into(out, &none, &mut arc(&none), &RunOptions { shard: Shard { index, count: 2 }, ..options() }).unwrap();
    }
    let merged = dir.path().join("merged");
    let error = merge(&shards[..1], &merged).unwrap_err();
    assert!(matches!(&error, ResultsError::Unmergeable { reason, .. } if reason.contains("shard 2/2 is missing")));
    assert_eq!(merge(&shards, &merged).unwrap().samples_done, 5000);
    let cells = |table: &Table| {
        let number = |row: usize| table.columns.iter().map(|c| c.values.number(row).to_bits()).collect::<Vec<_>>();
        (0..table.row_count()).map(number).collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(cells(&read_parquet_table(&merged.join(WORKSPACE_FILE)).unwrap()), cells(&voxels));
}

#[test]
fn the_pilot_takes_the_fewest_steps_that_are_enough() {
    let spec = small("parquet");
    let plan = spec.plan(PlanOptions::default()).unwrap();
    let factory = |plan: &Plan| Ok(Box::new(Arc::new(plan)) as Box<dyn Backend>);
    let choice = choose_steps(&plan, &spec.sampler(), &factory).unwrap();
    // The arc's error is steps^-8: 5.9e-8 at 8, 1.5e-5 at 4.
    assert_eq!((choice.steps, choice.reached), (8, true), "{}", choice.explain());
    let strict = plan.with_options(PlanOptions { tolerance: 0.0, ..plan.options });
    let choice = choose_steps(&strict, &spec.sampler(), &factory).unwrap();
    assert!(!choice.reached && choice.explain().contains("not reached"));
}

#[test]
fn the_pilot_keeps_what_derivatives_must() {
    let spec = SweepSpec::read(&crate::common::root().join("sweeps/workspace.toml")).unwrap();
    let plan = spec.plan(PlanOptions { stepper: Stepper::Tp6, ..PlanOptions::default() }).unwrap();
    let mut last = (0, f64::INFINITY);
    for derivative_tolerance in [1e-4, 1e-6, 1e-8] {
        let plan = plan.with_options(PlanOptions { derivative_tolerance, ..plan.options });
        let choice = choose_steps(&plan, &spec.sampler(), &cpu_f64).unwrap();
        let error = choice.derivative_error.unwrap();
        assert!(choice.reached && error <= derivative_tolerance, "{choice:?}");
        assert!(choice.steps > last.0 && error < last.1, "{choice:?} after {last:?}");
        last = (choice.steps, error);
    }
    let without = spec.plan(PlanOptions::default()).unwrap();
    let without = Plan::new(&without.scene, &without.axes, &[], without.options).unwrap();
    assert_eq!(choose_steps(&without, &spec.sampler(), &cpu_f64).unwrap().derivative_error, None);
}

/// Where a sweep lies past its folds, steps are enough that tell where the folds are; more would only take time.
#[test]
fn the_pilot_goes_by_folds_where_nothing_else_is_there() {
    let text = "scene = \"guidewire.scene.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 48\n\
        [[axis]]\nparameter = \"magnets.arm.position.x\"\nfrom = -0.057312\nto = -0.056312\n\
        [[axis]]\nparameter = \"magnets.arm.position.z\"\nfrom = 0.051598\nto = 0.051698\n\
        [[axis]]\nparameter = \"insertion\"\nfrom = 0.037887\nto = 0.037987\n";
    let spec = SweepSpec::parse(&crate::common::root().join("tests/data/jumps/folds.toml"), text).unwrap();
    let plan = spec.plan(PlanOptions::default()).unwrap();
    let choice = choose_steps(&plan, &spec.sampler(), &cpu_f64).unwrap();
    assert!(!choice.reached && choice.compared == 0 && choice.steps <= 32, "{choice:?}");
    let sampler = spec.sampler();
    let batch = plan.batch(48, |row, values| sampler.values(row as u64, values));
    let solve = |steps: usize| {
        let plan = plan.with_options(PlanOptions { steps, ..plan.options });
        cpu_f64(&plan).unwrap().solve(&batch).unwrap()
    };
    let (ours, finest) = (solve(choice.steps), solve(128));
    for row in 0..48 {
        assert_eq!((ours.status(row), finest.status(row)), (Status::Fold, Status::Fold), "row {row}");
        let [a, b] = [&ours, &finest].map(|of| of.get(row, Quantity::LoadFraction));
        assert!((a / b - 1.0).abs() < 5e-6, "row {row}: {a} {b}");
    }
}

#[test]
fn inputs_from_parquet_and_csv_agree() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    run_into(&out, &spec, &mut arc(&spec), &RunOptions { limit: Some(50), ..options() }).unwrap();
    let tips = read_columns(&out, &["sample", "coil.current.x"]).unwrap();
    let mut csv = String::from("sample,coil.current.x\n");
    for (row, value) in tips.numbers("coil.current.x").unwrap().iter().enumerate() {
        csv += &format!("{row},{value:?}\n");
    }
    fs::write(dir.path().join("inputs.csv"), csv).unwrap();
    let scene = fs::read_to_string(shipped().join("scenes/p6.toml")).unwrap();
    fs::write(dir.path().join("p6.toml"), scene).unwrap();
    let text = "scene = \"p6.toml\"\n[sampling]\nmethod = \"table\"\nfile = \"inputs.csv\"\n";
    let table = SweepSpec::parse(&dir.path().join("s.toml"), text).unwrap();
    assert_eq!(table.sample_count, 50);
    let mut row = [0.0];
    table.sampler().values(49, &mut row);
    assert_eq!(row[0], tips.numbers("coil.current.x").unwrap()[49]);
    let resolved = dir.path().join("resolved");
    run_into(&resolved, &table, &mut arc(&table), &options()).unwrap();
    assert_eq!(spec_of(&resolved).unwrap().table, table.table);
}

/// Set for the process whose memory is looked at: there other tests take none.
const ALONE: &str = "RODSWEEP_TEST_ALONE";

/// Ten million samples in bounded memory.
#[test]
fn ten_million_samples_stay_below_one_gibibyte() {
    if std::env::var_os(ALONE).is_none() {
        let status = this_program("ten_million_samples_stay_below_one_gibibyte").env(ALONE, "1").status().unwrap();
        return assert!(status.success(), "{status}");
    }
    let spec = SweepSpec::read(&shipped().join("ten_million.toml")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let mut backend = Arc { batch_size: 1 << 16, fails: false, ..arc(&spec) };
    let summary = run_into(dir.path(), &spec, &mut backend, &RunOptions::new()).unwrap();
    assert_eq!(summary.count(Status::Ok), 10_000_000);
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|text| text.split_whitespace().next()).and_then(|number| number.parse::<u64>().ok());
    if let Some(peak) = peak {
        assert!(peak < 1 << 20, "{peak} kB");
        eprintln!("peak {} MiB", peak >> 10);
    }
}
