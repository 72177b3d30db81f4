//! Shipped sweeps, and runs that are cut short, resumed, damaged, sharded: with a small analytic backend.

use rodsweep::backend::{Backend, BackendError, BackendInfo, BackendKind, Precision};
use rodsweep::model::{
    Batch, FlexibleRod, Plan, PlanOptions, Quantity, RigidRod, RodSegment, Solutions, Status, base_curvature,
};
use rodsweep::sweep::*;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The tip of a circular arc whose bend follows the coils' dipoles; every 97th dipole pattern fails.
struct Arc {
    plan: Plan,
    batch_size: usize,
    precision: Precision,
    /// Added to the tip along x [m].
    offset: f64,
    fails: bool,
}

impl Arc {
    fn new(plan: &Plan) -> Arc {
        Arc { plan: plan.clone(), batch_size: 700, precision: Precision::F64, offset: 0.0, fails: true }
    }
}

impl Backend for Arc {
    fn info(&self) -> BackendInfo {
        let device = "arc".into();
        BackendInfo { kind: BackendKind::Cpu, precision: self.precision, device, driver: String::new() }
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn batch_size(&self) -> usize {
        self.batch_size
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let mut solutions = Solutions::new(&self.plan, batch.sample_count());
        for at in 0..batch.sample_count() {
            let rod = self.plan.sample_rod(batch, at);
            let mut bend = [0.0; 2];
            for segment in &rod.segments {
                match segment {
                    RodSegment::Rigid(rigid) => {
                        let dipole = rigid.dipole;
                        bend = [bend[0] + 2e3 * dipole[2], bend[1] + 2e3 * dipole[0]];
                    }
                    RodSegment::Flexible(flexible) => bend[0] += 1e-3 / flexible.stiffness[0].max(1e-9) * 1e-3,
                }
            }
            let angle = (bend[0] * bend[0] + bend[1] * bend[1]).sqrt().max(1e-12);
            let (length, error) = (rod.total_length(), 1.0 / (self.plan.options.steps as f64).powi(8));
            let (sine, cosine) = angle.sin_cos();
            let [x, y] = bend.map(|b| b / angle);
            let out = length * (1.0 - cosine) / angle;
            let tip = [x * out + self.offset, y * out, length * (sine / angle + error)];
            solutions.set_vector(at, Quantity::TipPosition, tip);
            solutions.set_vector(at, Quantity::TipD1, [cosine * x * x + y * y, (cosine - 1.0) * x * y, -sine * x]);
            solutions.set_vector(at, Quantity::TipTangent, [x * sine, y * sine, cosine]);
            solutions.set_vector(at, Quantity::BaseMoment, [bend[0] * 1e-6, bend[1] * 1e-6, 0.0]);
            solutions.set(at, Quantity::StabilityMargin, 0.5);
            solutions.set(at, Quantity::ErrorEstimate, error);
            for derivative in 0..self.plan.derivatives.len() {
                for row in 0..self.plan.rows() {
                    let column = solutions.derivative_column(derivative, row);
                    solutions.values.set(at, column, tip[row % 3] * (1.0 + row as f64));
                }
            }
            let fails = self.fails && ((tip[0] * 1e9).abs() as u64).is_multiple_of(97);
            solutions.set_status(at, if fails { Status::NotConverged } else { Status::Ok });
        }
        Ok(solutions)
    }
}

fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("sweeps")
}

const SMALL: &str = r#"
scene = "scenes/p6.toml"
[sampling]
method = "uniform"
samples = 5000
seed = 3
[[axis]]
parameter = "coil.current.x"
from = -0.1
to = 0.1
[[axis]]
parameters = ["proximal.youngs_modulus", "distal.youngs_modulus"]
from = "5 MPa"
to = "6 MPa"
[output]
derivatives = ["coil.current"]
"#;

fn small(format: &str) -> SweepSpec {
    let text = format!("{SMALL}format = \"{format}\"\n");
    SweepSpec::parse(&shipped().join("small.toml"), &text).unwrap()
}

fn arc(spec: &SweepSpec) -> Arc {
    Arc::new(&spec.plan(PlanOptions::default()).unwrap())
}

fn options<'a>(dir: &Path) -> RunOptions<'a> {
    RunOptions { chunk: 1000, ..RunOptions::new(dir) }
}

fn parts(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with("part-") && !name.ends_with(".json") && !name.contains(".bad"))
        .collect();
    names.sort();
    names
}

/// Every part's bytes.
fn contents(dir: &Path) -> Vec<(String, Vec<u8>)> {
    parts(dir).into_iter().map(|name| (name.clone(), fs::read(dir.join(name)).unwrap())).collect()
}

#[test]
fn shipped_sweeps_have_their_counts_and_run_limited() {
    let declared = [
        ("workspace", 226_981),
        ("stiffness", 16_384),
        ("insertion", 20_000),
        ("ten_million", 10_000_000),
        ("billion", 1_000_000_000),
        ("two_coil", 65_536),
        ("branches", 81),
        ("lap", 8),
    ];
    let mut files: Vec<String> = fs::read_dir(shipped())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    files.sort();
    let mut names: Vec<&str> = declared.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    assert_eq!(files, names, "every shipped sweep declares its count here");
    for (name, count) in declared {
        let spec = SweepSpec::read(&shipped().join(format!("{name}.toml"))).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(spec.sample_count, count, "{name}");
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let make = |plan: &Plan| -> Result<Box<dyn Backend>, BackendError> { Ok(Box::new(Arc::new(plan))) };
        let search = Some(BranchTools { engine: &make, finisher: &make, energy: &|_, _| None });
        let limited = RunOptions { limit: Some(2000), search, ..options(&out) };
        let summary = run(&spec, &mut arc(&spec), &limited).unwrap();
        assert_eq!(summary.solved, count.min(2000), "{name}");
        assert_eq!(read_spec(&out).unwrap().to_toml(), spec.to_toml(), "{name}");
    }
}

#[test]
fn shipped_scenes_read_and_round_trip() {
    for entry in fs::read_dir(shipped().join("scenes")).unwrap() {
        let path = entry.unwrap().path();
        let scene = read_scene(&path).unwrap_or_else(|error| panic!("{error}"));
        let text = write_scene(&scene);
        assert_eq!(parse_scene(Path::new("again.toml"), &text).as_ref(), Ok(&scene), "{}\n{text}", path.display());
    }
}

#[test]
fn p6_is_the_prototype() {
    let scene = read_scene(&shipped().join("scenes/p6.toml")).unwrap();
    assert!((scene.total_length() - 0.0943).abs() < 1e-15);
    assert!((scene.segments[0].length - 0.0575).abs() < 1e-15);
    let rod = scene.rod();
    let RodSegment::Flexible(FlexibleRod { stiffness, .. }) = rod.segments[0] else { panic!() };
    assert!((stiffness[0] - 2.28299e-5).abs() < 1e-9, "{stiffness:?}");
    assert!(scene.rigid_force_arm);
}

#[test]
fn columns_are_those_of_the_interface() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    run(&spec, &mut arc(&spec), &options(dir.path())).unwrap();
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
    assert_eq!(names.len(), 17 + 18);
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
                run(&spec, &mut Arc { precision, ..arc(&spec) }, &options(&out)).unwrap();
                assert!(directory_status(&out).unwrap().is_complete());
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
    run(&spec, &mut arc(&spec), &options(&whole)).unwrap();
    for batch_size in [1, 999, 2500, 100_000] {
        let out = dir.path().join(format!("batch-{batch_size}"));
        run(&spec, &mut Arc { batch_size, ..arc(&spec) }, &options(&out)).unwrap();
        assert_eq!(contents(&whole), contents(&out), "{batch_size}");
    }
    let shards: Vec<PathBuf> = (1..=3).map(|k| dir.path().join(format!("shard-{k}"))).collect();
    let mut solved = 0;
    for (k, out) in shards.iter().enumerate().rev() {
        let shard = Shard::parse(&format!("{}/3", k + 1)).unwrap();
        solved += run(&spec, &mut arc(&spec), &RunOptions { shard, ..options(out) }).unwrap().solved;
    }
    assert_eq!(solved, 5000);
    assert!(matches!(merge(&shards[1..], &dir.path().join("part")), Err(SweepError::MissingParts { .. })));
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
    run(&spec, &mut arc(&spec), &options(&whole)).unwrap();
    let flag = AtomicBool::new(false);
    let mut backend = Interrupting { arc: arc(&spec), flag: &flag, left: AtomicUsize::new(4) };
    let summary = run(&spec, &mut backend, &RunOptions { interrupt: Some(&flag), ..options(&cut) }).unwrap();
    assert!(summary.interrupted && summary.solved < 5000 && summary.solved.is_multiple_of(1000));
    let status = directory_status(&cut).unwrap();
    assert_eq!(status.samples_done, summary.solved);
    assert!(!status.is_complete());
    assert!(matches!(run(&spec, &mut arc(&spec), &options(&cut)), Err(SweepError::Exists { .. })));
    let resumed = run(&spec, &mut arc(&spec), &RunOptions { resume: true, ..options(&cut) }).unwrap();
    assert_eq!((resumed.resumed, resumed.solved), (summary.solved, 5000 - summary.solved));
    assert_eq!(resumed.reduction.sample_count, 5000);
    assert_eq!(contents(&whole), contents(&cut));
    let again = run(&spec, &mut arc(&spec), &RunOptions { resume: true, ..options(&cut) }).unwrap();
    assert_eq!((again.resumed, again.solved), (5000, 0));
}

const KILLED: &str = "RODSWEEP_TEST_KILLED_RUN";

/// Not a test of its own: the process that the next test kills.
#[test]
fn child_that_is_killed() {
    let Ok(dir) = std::env::var(KILLED) else { return };
    let spec = small("parquet");
    let mut backend = Arc { batch_size: 50, ..arc(&spec) };
    let slow = |_: &Progress| std::thread::sleep(std::time::Duration::from_millis(1));
    let options = RunOptions { resume: true, chunk: 100, progress: Some(&slow), ..options(Path::new(&dir)) };
    run(&spec, &mut backend, &options).unwrap();
}

#[test]
fn killed_runs_leave_whole_parts_and_resume() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let (whole, cut) = (dir.path().join("whole"), dir.path().join("cut"));
    run(&spec, &mut arc(&spec), &RunOptions { chunk: 100, ..options(&whole) }).unwrap();
    for wait in [5, 20, 35, 50, 65] {
        let mut child = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["child_that_is_killed", "--exact"])
            .env(KILLED, &cut)
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(wait));
        child.kill().unwrap();
        child.wait().unwrap();
        if cut.join("run.json").exists() {
            let status = directory_status(&cut).unwrap();
            assert!(status.damaged.is_empty(), "{:?}", status.damaged);
        }
    }
    run(&spec, &mut arc(&spec), &RunOptions { resume: true, chunk: 100, ..options(&cut) }).unwrap();
    assert_eq!(contents(&whole), contents(&cut));
}

#[test]
fn damaged_parts_are_moved_away_and_solved_again() {
    for format in ["parquet", "csv", "npz"] {
        let spec = small(format);
        let dir = tempfile::tempdir().unwrap();
        run(&spec, &mut arc(&spec), &options(dir.path())).unwrap();
        let before = contents(dir.path());
        let path = |k: usize| dir.path().join(&before[k].0);
        let mut bytes = before[1].1.clone();
        bytes[before[1].1.len() / 3] ^= 4;
        fs::write(path(1), &bytes).unwrap();
        fs::write(path(2), &before[2].1[..before[2].1.len() / 2]).unwrap();
        fs::copy(path(0), path(3)).unwrap();
        fs::remove_file(path(4)).unwrap();
        let status = directory_status(dir.path()).unwrap();
        assert_eq!((status.damaged.len(), status.missing.len()), (3, 4), "{format}: {:?}", status.damaged);
        let summary = run(&spec, &mut arc(&spec), &RunOptions { resume: true, ..options(dir.path()) }).unwrap();
        assert_eq!((summary.quarantined.len(), summary.solved), (3, 4000));
        assert_eq!(before, contents(dir.path()), "{format}");
    }
}

#[test]
fn other_runs_and_foreign_directories_are_refused() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    run(&spec, &mut arc(&spec), &options(&out)).unwrap();
    let resume = RunOptions { resume: true, ..options(&out) };
    let mismatch = |spec: &SweepSpec, backend: &mut Arc, options: &RunOptions| match run(spec, backend, options) {
        Err(error @ SweepError::Mismatch { what, .. }) => {
            assert!(error.is_usage());
            what
        }
        other => panic!("{other:?}"),
    };
    let other = SweepSpec { seed: 4, ..spec.clone() };
    assert_eq!(mismatch(&other, &mut arc(&other), &resume), "scene or sweep");
    let limited = RunOptions { limit: Some(10), ..resume.clone() };
    assert_eq!(mismatch(&spec, &mut arc(&spec), &limited), "number of samples");
    assert_eq!(mismatch(&spec, &mut arc(&spec), &RunOptions { chunk: 7, ..resume.clone() }), "chunk size");
    let mut single = Arc { precision: Precision::F32, ..arc(&spec) };
    assert_eq!(mismatch(&spec, &mut single, &resume), "precision");
    let foreign = dir.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.tex"), "x").unwrap();
    let error = run(&spec, &mut arc(&spec), &options(&foreign)).unwrap_err();
    assert!(matches!(error, SweepError::Foreign { .. }) && error.is_usage(), "{error}");
    assert!(matches!(directory_status(&foreign), Err(SweepError::NoRun { .. })));
    let plan = small("parquet").plan(PlanOptions::default()).unwrap();
    let wider = SweepSpec { wrt: Vec::new(), ..spec };
    assert!(matches!(run(&wider, &mut Arc::new(&plan), &options(&out)), Err(SweepError::WrongPlan { .. })));
}

#[test]
fn spot_check_finds_the_size_of_an_error() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let trusted = |plan: &Plan| Ok(Box::new(Arc::new(plan)) as Box<dyn Backend>);
    let with = |out: &str| RunOptions { trusted: Some(&trusted), ..options(&dir.path().join(out)) };
    let same = run(&spec, &mut arc(&spec), &with("same")).unwrap().spot_check.unwrap();
    assert_eq!((same.checked, same.position.max, same.rotation.max), (64, 0.0, 0.0));
    let mut off = Arc { offset: 0.943e-3, ..arc(&spec) };
    let check = run(&spec, &mut off, &with("off")).unwrap().spot_check.unwrap();
    assert!((check.position.max - 0.01).abs() < 1e-12 && (check.position.median - 0.01).abs() < 1e-12, "{check:?}");
    assert!(check.derivative.max > 0.0 && check.worst_sample.is_some());
    assert_eq!(check.worst_values.len(), 3);
    let worst = read_scene(&dir.path().join("off").join(WORST_FILE)).unwrap();
    assert_eq!(worst, spec.sample_scene(check.worst_sample.unwrap()));
    let manifest = read_manifest(&dir.path().join("off")).unwrap();
    assert!(manifest["spot_check"]["position"]["max"].as_f64().unwrap() > 0.0);
}

#[test]
fn spot_check_counts_what_only_the_run_solves() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let trusted = |plan: &Plan| Ok(Box::new(Folding(Arc::new(plan))) as Box<dyn Backend>);
    let options = RunOptions { trusted: Some(&trusted), ..options(&dir.path().join("out")) };
    let check = run(&spec, &mut arc(&spec), &options).unwrap().spot_check.unwrap();
    assert!(check.only_run > 0 && check.only_run + check.compared <= check.checked, "{check:?}");
    assert_eq!((check.compared, check.only_trusted, check.wrong), (0, 0, 0));
    assert!(check.only_run_sample.is_some());
    assert_eq!(check.only_run_values.len(), 3);
}

#[test]
fn failed_samples_get_a_second_attempt() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let failed = run(&spec, &mut arc(&spec), &options(&dir.path().join("one"))).unwrap().failed();
    assert!(failed > 10);
    let refiner = |plan: &Plan| Ok(Box::new(Arc { fails: false, ..Arc::new(plan) }) as Box<dyn Backend>);
    let options = RunOptions { refiners: vec![&refiner], ..options(&dir.path().join("two")) };
    let summary = run(&spec, &mut arc(&spec), &options).unwrap();
    assert_eq!((summary.failed(), summary.count(Status::Refined)), (0, failed));
    let table = read_columns(&dir.path().join("two"), &["tip.position.x"]).unwrap();
    assert!(table.numbers("tip.position.x").unwrap().iter().all(|x| x.is_finite()));
}

#[test]
fn a_run_without_rows_leaves_its_workspace() {
    let (rows, none) = (small("parquet"), small("none"));
    let dir = tempfile::tempdir().unwrap();
    let (with, without) = (dir.path().join("rows"), dir.path().join("none"));
    run(&rows, &mut arc(&rows), &options(&with)).unwrap();
    let summary = run(&none, &mut arc(&none), &options(&without)).unwrap();
    assert!(parts(&without).is_empty());
    let again = reduce_directory(&with, 1e-3).unwrap();
    assert_eq!(summary.reduction.voxels, again.voxels);
    assert_eq!(summary.reduction.extents, again.extents);
    assert_eq!(summary.reduction.counts, again.counts);
    let voxels = read_parquet_table(&without.join(WORKSPACE_FILE)).unwrap();
    let total: f64 = voxels.numbers("count").unwrap().iter().sum();
    assert_eq!(total as u64, 5000 - summary.failed());
    assert_eq!(read_parquet_table(&without.join(TIPS_FILE)).unwrap().row_count(), 5000);
    let shards: Vec<PathBuf> = (1..=2).map(|k| dir.path().join(format!("none-{k}"))).collect();
    for (index, out) in (1..).zip(&shards) {
        run(&none, &mut arc(&none), &RunOptions { shard: Shard { index, count: 2 }, ..options(out) }).unwrap();
    }
    let merged = dir.path().join("merged");
    assert!(matches!(merge(&shards[..1], &merged), Err(SweepError::MissingParts { first: 2, .. })));
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
fn inputs_from_parquet_and_csv_agree() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    run(&spec, &mut arc(&spec), &RunOptions { limit: Some(50), ..options(&out) }).unwrap();
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
    run(&table, &mut arc(&table), &options(&resolved)).unwrap();
    assert_eq!(read_spec(&resolved).unwrap().table, table.table);
}

#[test]
fn rotation_vectors_survive_small_and_half_turns() {
    let mut scene = read_scene(&shipped().join("scenes/cantilever.toml")).unwrap();
    let pi = std::f64::consts::PI;
    for angle in [0.0, 1e-12, 1e-7, 1e-3, 1.0, pi - 1e-3, pi - 1e-7, pi - 1e-12] {
        for axis in [[1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0]] {
            scene.base.rotation = axis.map(|a| a * angle);
            let v = rotation_vector(&scene.rod().base_rotation);
            for k in 0..3 {
                assert!((v[k] - axis[k] * angle).abs() < 1e-14 + 1e-15 * angle, "{angle} {axis:?}: {v:?}");
            }
        }
    }
}

#[test]
fn base_curvature_takes_leading_rigid_segments_into_account() {
    let mut rod = read_scene(&shipped().join("scenes/cantilever.toml")).unwrap().rod();
    rod.base_rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    rod.flux_density = [0.0, 3.0, 0.0];
    rod.tip_force = [1.0, 0.0, 0.0];
    let (dipole, weight) = ([1e-3, 0.0, 0.0], [0.0, 0.2, 0.0]);
    rod.segments.insert(0, RodSegment::Rigid(RigidRod { length: 0.1, dipole, weight }));
    let RodSegment::Flexible(FlexibleRod { stiffness, .. }) = rod.segments[1] else { panic!() };
    // m - mu x B - L t x n - L/2 t x w; t x (1, 0, 0) = (0, 1, 0), t x (0, 0.2, 0) = (-0.2, 0, 0).
    let m = [0.5 + 0.01, 0.6 - 0.1, 0.7 - 3e-3];
    let u = base_curvature(&rod, [0.5, 0.6, 0.7]);
    for k in 0..3 {
        assert!((u[k] * stiffness[k] - m[k]).abs() < 1e-14, "{u:?}");
    }
    rod.rigid_force_arm = false;
    let u = base_curvature(&rod, [0.5, 0.6, 0.7]);
    assert!((u[1] * stiffness[1] - 0.6).abs() < 1e-14 && (u[2] * stiffness[2] - 0.697).abs() < 1e-14);
}

#[test]
fn assignments_set_scenes() {
    let mut scene = read_scene(&shipped().join("scenes/p6.toml")).unwrap();
    assign(&mut scene, &["insertion=90 mm", "coil.current.x=20 mA", "distal.length=0.02", "base.position=1 mm"])
        .unwrap();
    assert!((scene.total_length() - 0.09).abs() < 1e-15 && scene.segments[2].length == 0.02);
    assert_eq!(scene.base.position, [1e-3; 3]);
    let mut refused = |text: &str| assign(&mut scene, &[text]).unwrap_err().to_string();
    assert!(refused("coil.current.x").contains("write NAME=VALUE"));
    assert!(refused("coil.curent.x=1").contains("did you mean `coil.current.x`?"));
    assert!(refused("coil.current.x=1 m").contains("`coil.current.x`: \"1 m\" is a length"));
    assert!(refused("proximal.stiffness.torsion=1").contains("follows from `tube`"));
    assert!(refused("insertion=1 mm").contains("must be finite and not negative"));
}

/// Ten million samples in bounded memory.
#[test]
fn ten_million_samples_stay_below_one_gibibyte() {
    let spec = SweepSpec::read(&shipped().join("ten_million.toml")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let mut backend = Arc { batch_size: 1 << 16, fails: false, ..arc(&spec) };
    let summary = run(&spec, &mut backend, &RunOptions::new(dir.path())).unwrap();
    assert_eq!(summary.count(Status::Ok), 10_000_000);
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|text| text.split_whitespace().next()).and_then(|number| number.parse::<u64>().ok());
    if let Some(peak) = peak {
        assert!(peak < 1 << 20, "{peak} kB");
        eprintln!("peak {} MiB, {:.0} samples a second, {:?}", peak >> 10, summary.rate, summary.timings);
    }
}
