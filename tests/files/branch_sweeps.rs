//! Sweeps with `branch = "all"`: a row for each equilibrium, whatever the work is cut into.

use crate::common::golden;
use crate::common::root;
use crate::common::runs::{manifest_of, read_columns, reduced, resume_in, run_into, spec_of, status_of};
use rodsweep::backend::BackendFactory;
use rodsweep::backend::{Backend, BackendError, BackendInfo, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::input::write_scene;
use rodsweep::model::{Batch, Plan, PlanOptions, Solutions, Status, Stepper};
use rodsweep::reference::{Reference, energy};
use rodsweep::results::merge;
use rodsweep::spec::{BranchChoice, Shard, SweepSpec};
use rodsweep::sweep::{BranchTools, RunOptions, Summary, SweepError};
use rodsweep::table::{Column, Table};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

fn lanes(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::new(plan, Precision::F64)?))
}

fn gpu(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    let device = device_or_skip("branches on the GPU").expect("it was there before");
    Ok(Box::new(Gpu::new(device, plan, Precision::F32)?))
}

fn reference(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Reference::new(plan)))
}

fn tools<'a>(engine: BackendFactory<'a>) -> BranchTools<'a> {
    BranchTools { engine, finisher: &lanes, energy: &|rod, base| energy(rod, base) }
}

fn options<'a>() -> RunOptions<'a> {
    RunOptions { search: Some(tools(&lanes)), ..RunOptions::new() }
}

/// A shipped scene with several equilibria over one current.
const SWEEP: &str = r#"scene = "scenes/two_coil.toml"
[sampling]
method = "grid"
[[axis]]
parameter = "coil1.current.z"
from = "-0.4 A"
to = "0.3 A"
points = 7
[solver]
branch = "all"
[output]
quantities = ["tip_position", "tip_rotation", "stability", "error_estimate", "base_moment"]
derivatives = ["coil1.current.z", "insertion"]
"#;

fn shipped(text: &str) -> SweepSpec {
    let file = root().join("sweeps/test.toml");
    SweepSpec::parse(&file, text).unwrap_or_else(|error| panic!("{error}"))
}

fn cpu_plan(spec: &SweepSpec) -> Plan {
    spec.plan(PlanOptions { steps: 16, ..PlanOptions::default() }).unwrap()
}

fn run_on_cpu(out: &Path, spec: &SweepSpec, options: &RunOptions) -> Summary {
    run_into(out, spec, lanes(&cpu_plan(spec)).unwrap().as_mut(), options).unwrap()
}

/// Every number of every column, by its bits.
fn bits(table: &Table) -> Vec<(String, Vec<u64>)> {
    let column = |column: &Column| {
        let numbers = (0..column.values.len()).map(|row| column.values.number(row));
        (column.name.clone(), numbers.map(|x| if x.is_nan() { 0 } else { x.to_bits() }).collect())
    };
    table.columns.iter().map(column).collect()
}

fn rows(dir: &Path) -> Vec<(String, Vec<u64>)> {
    bits(&read_columns(dir, &[]).unwrap())
}

/// Rows of each sample, in order.
fn by_sample(table: &Table) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (row, sample) in table.samples().iter().enumerate() {
        match groups.last_mut() {
            Some(group) if table.samples()[group[0]] == *sample => group.push(row),
            _ => groups.push(vec![row]),
        }
    }
    groups
}

/// What holds of every result: branches counted from 0 by rising energy, one of them from rest, every number there.
fn check_rows(table: &Table) {
    let column = |name: &str| table.numbers(name).unwrap_or_else(|| panic!("{name}"));
    let (branch, energy, from_rest) = (column("branch"), column("energy"), column("from_rest"));
    let (balanced, stable) = (column("balanced"), column("stable"));
    for group in by_sample(table) {
        let of = |values: &[f64]| group.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        assert_eq!(of(&branch), (0..group.len()).map(|k| k as f64).collect::<Vec<f64>>());
        assert!(of(&energy).is_sorted(), "{:?}", of(&energy));
        assert_eq!(of(&from_rest).iter().sum::<f64>(), 1.0);
        assert!(of(&balanced).iter().all(|x| *x == balanced[group[0]]));
        for row in group {
            let status = table.statuses()[row];
            assert_eq!(status == Status::Unstable, stable[row] == 0.0, "{status:?}");
            assert!(status.is_converged());
        }
    }
    for column in &table.columns {
        assert!((0..table.row_count()).all(|row| column.values.number(row).is_finite()), "{}", column.name);
    }
}

#[test]
fn golden_lists_are_rows() {
    for case in golden::stability().iter().filter(|case| ["03", "13"].iter().any(|n| case.scene.name.contains(n))) {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("scene.toml"), write_scene(&case.scene)).unwrap();
        let force = case.scene.loads.tip_force.unwrap_or_default()[0];
        let text = SWEEP.replace("scenes/two_coil.toml", "scene.toml").replace("\"coil1.current.z\", ", "");
        let text =
            text.replace("coil1.current.z", "loads.tip_force.x").replace("\"insertion\"", "\"loads.tip_force.y\"");
        let text =
            text.replace("\"-0.4 A\"", &format!("{}", force - 1e-3)).replace("\"0.3 A\"", &format!("{}", force + 1e-3));
        let spec = SweepSpec::parse(&dir.path().join("sweep.toml"), &text.replace("points = 7", "points = 3")).unwrap();
        let out = dir.path().join("out");
        let summary = run_on_cpu(&out, &spec, &options());
        let table = read_columns(&out, &[]).unwrap();
        check_rows(&table);
        let groups = by_sample(&table);
        assert_eq!((groups.len(), summary.solved, summary.failed()), (3, 3, 0));
        let vector = |name: &str, row: usize| table.vector_columns(name).unwrap().map(|values| values.number(row));
        let stable = table.numbers("stable").unwrap();
        // The middle of the grid is the golden scene.
        assert_eq!(groups[1].len(), case.equilibria.len(), "{}", case.scene.name);
        for (m0, _, p_tip, index) in &case.equilibria {
            let close = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
            let size = close(*m0, [0.0; 3]);
            let found = groups[1].iter().find(|row| close(vector("base_moment", **row), *m0) < 1e-5 * size);
            let row = *found.unwrap_or_else(|| panic!("{}: no row for index {index}", case.scene.name));
            assert!(close(vector("tip.position", row), *p_tip) < 1e-5 * case.scene.total_length());
            assert_eq!(stable[row] == 1.0, *index == 0);
        }
    }
}

/// The rows of `SWEEP` as a whole.
static WHOLE: LazyLock<Table> = LazyLock::new(|| {
    let dir = tempfile::tempdir().unwrap();
    run_on_cpu(dir.path(), &shipped(SWEEP), &options());
    read_columns(dir.path(), &[]).unwrap()
});

#[test]
fn rows_and_counts_are_those_of_the_samples() {
    let (dir, spec) = (tempfile::tempdir().unwrap(), shipped(SWEEP));
    let out = dir.path().join("whole");
    run_on_cpu(&out, &spec, &options());
    let table = read_columns(&out, &[]).unwrap();
    check_rows(&table);
    let names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
    let head = ["sample", "coil1.current.z", "status", "branch", "energy", "from_rest", "balanced", "tip.position.x"];
    assert_eq!(&names[..head.len()], head);
    assert_eq!(table.column("energy").unwrap().unit, "J");
    let groups = by_sample(&table);
    assert_eq!(groups.len(), 7);
    assert!(table.row_count() > 12, "{} rows", table.row_count());

    // The row from rest is that of a sweep that asks for no other.
    let one = shipped(&SWEEP.replace("\"all\"", "\"from_rest\""));
    let from_rest = dir.path().join("from-rest");
    run_on_cpu(&from_rest, &one, &options());
    let expected = read_columns(&from_rest, &[]).unwrap();
    assert!(expected.column("branch").is_none() && expected.row_count() == 7);
    let chosen = table.numbers("from_rest").unwrap();
    for (sample, group) in groups.iter().enumerate() {
        let row = *group.iter().find(|row| chosen[**row] == 1.0).unwrap();
        for column in &expected.columns {
            let of_all = table.column(&column.name).unwrap();
            assert_eq!(of_all.values.number(row).to_bits(), column.values.number(sample).to_bits(), "{}", column.name);
        }
    }

    let status = status_of(&out).unwrap();
    assert_eq!((status.samples_done, status.failed(), status.every_branch), (7, 0, true));
    assert_eq!(status.counts.iter().sum::<u64>(), table.row_count() as u64);
    let reduction = reduced(&out, spec.workspace.voxel).unwrap();
    assert_eq!((reduction.sample_count, reduction.row_count()), (7, table.row_count() as u64));
    let most = groups.iter().map(Vec::len).max().unwrap() as u64;
    let counts = reduction.branches.unwrap();
    assert_eq!((counts.most, counts.unbalanced), (most, 0));
    let manifest = manifest_of(&out);
    assert_eq!((&manifest["branch"], &manifest["samples_of_shard"]), (&"all".into(), &7.into()));
    assert_eq!((&manifest["rows"], &manifest["failed"]), (&table.row_count().into(), &0.into()));
    assert_eq!(spec_of(&out).unwrap().branch, BranchChoice::All);
}

#[test]
fn rows_do_not_depend_on_how_the_work_is_cut() {
    let (dir, spec) = (tempfile::tempdir().unwrap(), shipped(SWEEP));
    let expected = bits(&WHOLE);
    for chunk in [1, 3] {
        let out = dir.path().join(format!("chunk-{chunk}"));
        run_on_cpu(&out, &spec, &RunOptions { chunk, ..options() });
        assert_eq!(rows(&out), expected, "{chunk} samples a part");
    }
    for threads in [1, 3] {
        let out = dir.path().join(format!("threads-{threads}"));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| run_on_cpu(&out, &spec, &options()));
        assert_eq!(rows(&out), expected, "{threads} threads");
    }
    let shards: Vec<PathBuf> = (1..=3).map(|k| dir.path().join(format!("shard-{k}"))).collect();
    for (k, out) in shards.iter().enumerate() {
        let shard = Shard::parse(&format!("{}/3", k + 1)).unwrap();
        run_on_cpu(out, &spec, &RunOptions { shard, chunk: 1, ..options() });
    }
    let merged = dir.path().join("merged");
    let status = merge(&shards, &merged).unwrap();
    assert!(status.is_complete() && status.samples_done == 7 && status.failed() == 0);
    assert_eq!(rows(&merged), expected, "shards");

    for format in ["csv", "npz"] {
        let spec = shipped(&format!("{SWEEP}format = \"{format}\"\n"));
        let out = dir.path().join(format);
        run_on_cpu(&out, &spec, &RunOptions { limit: Some(3), ..options() });
        let found = read_columns(&out, &[]).unwrap();
        assert_eq!(found.sample_count(), 3, "{format}");
        for (found, expected) in bits(&found).iter().zip(&expected) {
            assert_eq!(found.1, expected.1[..found.1.len()], "{format}: {}", expected.0);
        }
    }
}

/// An engine that raises the interrupt flag at its second call: in the middle of a search.
struct Interrupting(Box<dyn Backend>, usize);

static INTERRUPT: AtomicBool = AtomicBool::new(false);

impl Backend for Interrupting {
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
        self.1 += 1;
        if self.1 == 2 {
            INTERRUPT.store(true, Ordering::Relaxed);
        }
        self.0.solve(batch)
    }
}

#[test]
fn what_is_missing_or_damaged_is_searched_again() {
    let (dir, spec) = (tempfile::tempdir().unwrap(), shipped(SWEEP));
    let expected = bits(&WHOLE);
    let out = dir.path().join("cut");
    let interrupting =
        |plan: &Plan| -> Result<Box<dyn Backend>, BackendError> { Ok(Box::new(Interrupting(lanes(plan)?, 0))) };
    let cut = RunOptions { chunk: 2, interrupt: Some(&INTERRUPT), search: Some(tools(&interrupting)), ..options() };
    let summary = run_on_cpu(&out, &spec, &cut);
    assert!(summary.interrupted && summary.solved == 0, "a search that is cut short leaves no rows");
    assert_eq!(status_of(&out).unwrap().samples_done, 0);
    let resume = || {
        let options = RunOptions { chunk: 2, ..options() };
        resume_in(&out, &spec, lanes(&cpu_plan(&spec)).unwrap().as_mut(), &options).unwrap()
    };
    assert_eq!(resume().solved, 7);
    assert_eq!(rows(&out), expected);

    let part = |k: usize| out.join(format!("part-{k:010}.parquet"));
    fs::remove_file(part(0)).unwrap();
    let bytes = fs::read(part(2)).unwrap();
    fs::write(part(2), &bytes[..bytes.len() / 2]).unwrap();
    let status = status_of(&out).unwrap();
    assert_eq!((status.samples_done, status.missing, status.damaged.len()), (3, vec![0, 2], 1));
    let summary = resume();
    assert_eq!((summary.resumed, summary.solved, summary.quarantined.len()), (3, 4, 1));
    assert_eq!((summary.reduction.sample_count, summary.failed()), (7, 0));
    assert_eq!(rows(&out), expected);
}

#[test]
fn a_sample_without_an_equilibrium_is_one_row() {
    let text = SWEEP.replace("coil1.current.z", "proximal.length").replace("\"-0.4 A\"", "\"-10 mm\"");
    let text = text.replace("\"0.3 A\"", "\"60 mm\"").replace("points = 7", "points = 2");
    let spec =
        shipped(&text.replace("\"insertion\"", "\"proximal.length\"").replace("\"proximal.length\", \"p", "\"p"));
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let summary = run_on_cpu(&out, &spec, &options());
    assert_eq!((summary.solved, summary.failed(), summary.count(Status::BadParameter)), (2, 1, 1));
    assert_eq!(summary.reduction.branches.map(|counts| counts.unbalanced), Some(1));
    let table = read_columns(&out, &[]).unwrap();
    assert_eq!(by_sample(&table)[0], [0]);
    for name in ["energy", "tip.position.x", "stable", "d(tip.position.x)/d(proximal.length)"] {
        assert!(table.numbers(name).unwrap()[0].is_nan(), "{name}");
    }
    for name in ["branch", "from_rest", "balanced"] {
        assert_eq!(table.numbers(name).unwrap()[0], 0.0, "{name}");
    }
    assert!(table.row_count() >= 2 && table.statuses()[1].is_converged());
}

/// Where the path from rest ends before the full load, the rod has other equilibria.
#[test]
fn a_sample_is_searched_without_its_equilibrium_from_rest() {
    let dir = tempfile::tempdir().unwrap();
    let currents = "coil1.current.x,coil1.current.y,coil1.current.z,coil2.current.x,coil2.current.y,coil2.current.z\n-0.4316,-0.7856,0.5241,0.6666,-0.0136,-0.5515\n";
    fs::write(dir.path().join("currents.csv"), currents).unwrap();
    let scene = root().join("sweeps/scenes/two_coil.toml");
    let text = format!(
        "scene = {:?}\n[sampling]\nmethod = \"table\"\nfile = \"currents.csv\"\n[solver]\nbranch = \"all\"\n",
        scene.to_str().unwrap()
    );
    let spec = SweepSpec::parse(&dir.path().join("sweep.toml"), &text).unwrap_or_else(|error| panic!("{error}"));
    let plan = cpu_plan(&spec);
    let batch = plan.batch(1, |at, row| spec.sampler().values(at as u64, row));
    let from_rest = lanes(&plan).unwrap().solve(&batch).unwrap().status(0);
    let out = dir.path().join("out");
    let summary = run_on_cpu(&out, &spec, &options());
    assert_eq!((summary.solved, summary.failed()), (1, 0));
    let table = read_columns(&out, &[]).unwrap();
    assert!(table.row_count() >= 5 && table.statuses().iter().all(|status| status.is_converged()));
    assert!(table.statuses()[0].is_success(), "the lowest energy is stable");
    let marked = table.numbers("from_rest").unwrap().iter().sum::<f64>();
    assert_eq!(marked, f64::from(from_rest.is_converged()), "{from_rest:?}");
}

/// Loads with a tip moment have no potential: no energies, stable equilibria first.
#[test]
fn without_a_potential_stable_ones_come_first() {
    let text = SWEEP.replace("coil1.current.z", "loads.tip_moment.x").replace("points = 7", "points = 2");
    let text =
        text.replace("\"-0.4 A\"", "1e-5").replace("\"0.3 A\"", "2e-5").replace("\"insertion\"", "\"coil1.current.z\"");
    let file = root().join("sweeps/scenes/two_coil.toml");
    let scene = fs::read_to_string(file).unwrap();
    let scene = scene.replacen("current = [0, 0, 0]", "current = [0, 0, -0.4]", 1);
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("scene.toml"), scene).unwrap();
    let text = text.replace("scenes/two_coil.toml", "scene.toml");
    let spec = SweepSpec::parse(&dir.path().join("sweep.toml"), &text).unwrap_or_else(|error| panic!("{error}"));
    let out = dir.path().join("out");
    run_on_cpu(&out, &spec, &options());
    let table = read_columns(&out, &[]).unwrap();
    assert!(table.numbers("energy").unwrap().iter().all(|energy| energy.is_nan()));
    let stable = table.numbers("stable").unwrap();
    for group in by_sample(&table) {
        assert!(group.len() > 1 && group.iter().map(|row| -stable[*row]).is_sorted());
    }
}

#[test]
fn a_gpu_finds_as_many() {
    let Some(_) = device_or_skip("a_gpu_finds_as_many") else { return };
    let (dir, mut spec) = (tempfile::tempdir().unwrap(), shipped(SWEEP));
    let out = dir.path().join("gpu");
    spec.tolerance = 2e-5;
    let plan = spec.plan(PlanOptions { steps: 16, stepper: Stepper::Rk4, ..PlanOptions::default() }).unwrap();
    let options = RunOptions { search: Some(tools(&gpu)), ..options() };
    let summary = run_into(&out, &spec, gpu(&plan).unwrap().as_mut(), &options);
    assert_eq!(summary.unwrap().failed(), 0);
    let (expected, found) = (&*WHOLE, read_columns(&out, &[]).unwrap());
    check_rows(&found);
    assert_eq!(expected.samples(), found.samples());
    let stable = |table: &Table| table.statuses().iter().map(|status| status.is_success()).collect::<Vec<_>>();
    assert_eq!(stable(expected), stable(&found));
    assert_eq!(expected.numbers("from_rest"), found.numbers("from_rest"));
    let tips = |table: &Table| table.numbers("tip.position.y").unwrap();
    for (a, b) in tips(expected).iter().zip(tips(&found)) {
        assert!((a - b).abs() < 1e-4 * spec.scene.total_length(), "{a} {b}");
    }
}

#[test]
fn what_cannot_search_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let (out, spec) = (dir.path().join("out"), shipped(SWEEP));
    let mut backend = lanes(&cpu_plan(&spec)).unwrap();
    let none = RunOptions { search: None, ..options() };
    assert!(matches!(run_into(&out, &spec, backend.as_mut(), &none), Err(SweepError::NoSearch)));
    let by_reference = RunOptions { search: Some(tools(&reference)), ..options() };
    let error = run_into(&out, &spec, backend.as_mut(), &by_reference).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("use the CPU engine"), "{error}");
    assert!(!out.exists());
}

/// A sample that is too limp for a search has its equilibrium from rest alone, and its list is not called balanced.
#[test]
fn limp_samples_are_not_searched() {
    let text = r#"[sampling]
method = "grid"
[[axis]]
parameter = "loads.tip_force.z"
from = "0 N"
to = "2 N"
points = 2
[solver]
branch = "all"
[output]
quantities = ["tip_position", "stability"]
[scene]
name = "taut"
[scene.loads]
tip_force = ["1 mN", 0, 0]
[[scene.segment]]
name = "rod"
kind = "flexible"
length = "300 mm"
stiffness = { bending = "6e-5 N·m²", torsion = "4.6e-5 N·m²" }
"#;
    let folder = tempfile::tempdir().unwrap();
    let spec = shipped(text);
    run_on_cpu(&folder.path().join("out"), &spec, &options());
    let table = read_columns(&folder.path().join("out"), &["sample", "balanced"]).unwrap();
    let column = table.column("balanced").unwrap();
    let balanced: Vec<f64> = (0..table.row_count()).map(|row| column.values.number(row)).collect();
    let (table, rows) = (&table, balanced.len());
    let of = |sample: u64| (0..rows).filter(move |row| table.samples()[*row] == sample);
    assert_eq!(of(1).count(), 1);
    assert!(of(1).all(|row| balanced[row] == 0.0) && of(0).all(|row| balanced[row] == 1.0), "{balanced:?}");
}

/// In a field that varies in space a list has as many rows, in parts of any size.
#[test]
fn beside_a_magnet_every_equilibrium_is_a_row() {
    let text = SWEEP.replace("two_coil", "arm_magnet").replace("coil1.current.z", "magnets.arm.rotation.y");
    let spec = shipped(&text.replace("-0.4 A", "0 rad").replace("0.3 A", "3 rad"));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let summary = run_on_cpu(&out, &spec, &options());
    let table = read_columns(&out, &[]).unwrap();
    check_rows(&table);
    let groups = by_sample(&table);
    assert_eq!((groups.len(), summary.failed()), (7, 0));
    assert_eq!(groups.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1, 1, 1, 3, 3, 3]);
    assert!(table.numbers("balanced").unwrap().iter().all(|balanced| *balanced == 1.0));
    let parts = folder.path().join("parts");
    run_on_cpu(&parts, &spec, &RunOptions { chunk: 2, ..options() });
    assert_eq!(rows(&out), rows(&parts));
}
