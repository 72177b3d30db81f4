//! A whole run, second attempts and all, gives the same rows however the work is cut: parts, threads, shards, engines.

use crate::common::runs::read_columns;
use crate::common::{root, runs};
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::gpu::{Device, Gpu};
use rodsweep::model::{Plan, PlanOptions, Status, Stepper};
use rodsweep::reference::Reference;
use rodsweep::results::merge;
use rodsweep::spec::{CHUNK, Shard, SweepSpec};
use rodsweep::sweep::RunOptions;
use rodsweep::table::Values;
use std::path::{Path, PathBuf};

/// So coarse that many rows need a second attempt; some insertions make no rod.
const STEPS: usize = 2;
const TOLERANCE: f64 = 2e-5;
/// Tips on a GPU, over the rod's length.
const ON_GPU: f64 = 2e-5;

const SWEEP: &str = r#"
scene = "scenes/p6.toml"
[sampling]
method = "sobol"
samples = 8192
seed = 5
[[axis]]
parameter = "coil.current.x"
from = "-0.3 A"
to = "0.3 A"
[[axis]]
parameter = "coil.current.y"
from = "-0.6 A"
to = "0.6 A"
[[axis]]
parameter = "coil.current.z"
from = "-0.3 A"
to = "0.3 A"
[[axis]]
parameter = "insertion"
from = "30 mm"
to = "137 mm"
[[axis]]
parameter = "loads.tip_force.z"
from = "-20 mN"
to = "0 mN"
[output]
quantities = ["tip_position", "tip_rotation", "stability", "error_estimate", "iterations", "load_fraction"]
derivatives = ["coil.current", "insertion"]
"#;

fn spec() -> SweepSpec {
    let file = root().join("sweeps/same_rows.toml");
    let mut spec = SweepSpec::parse(&file, SWEEP).expect("the sweep reads");
    spec.tolerance = TOLERANCE;
    spec
}

fn plan(stepper: Stepper, steps: usize) -> Plan {
    spec().plan(PlanOptions { stepper, steps, tolerance: TOLERANCE, ..PlanOptions::default() }).expect("it plans")
}

fn second(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    let plan = plan.with_options(PlanOptions { stepper: Stepper::Dop853, steps: 24, ..plan.options });
    Ok(Box::new(Cpu::new(&plan, Precision::F64)?))
}

fn third(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Reference::new(plan)))
}

/// Runs into a directory and returns it.
fn run_into(backend: &mut dyn Backend, out: PathBuf, chunk: u64, shard: &str) -> PathBuf {
    let options = RunOptions {
        chunk,
        shard: Shard::parse(shard).expect("a shard"),
        refiners: vec![&second, &third],
        ..RunOptions::new()
    };
    runs::run_into(&out, &spec(), backend, &options).expect("runs");
    out
}

/// Every column's bits by name, in the order of samples.
fn rows(dir: &Path) -> Vec<(String, Vec<u64>)> {
    let table = read_columns(dir, &[]).expect("reads");
    let bits = |values: &Values| match values {
        Values::Index(values) => values.clone(),
        Values::Status(values) => values.iter().map(|status| u64::from(status.code())).collect(),
        Values::Double(values) => values.iter().map(|x| x.to_bits()).collect(),
        Values::Single(values) => values.iter().map(|x| u64::from(x.to_bits())).collect(),
        Values::Flag(values) => values.iter().map(|x| x.map_or(2, u64::from)).collect(),
        values => panic!("a sweep has no {values:?}"),
    };
    table.columns.iter().map(|column| (column.name.clone(), bits(&column.values))).collect()
}

fn column<'a>(rows: &'a [(String, Vec<u64>)], name: &str) -> &'a [u64] {
    &rows.iter().find(|(of, _)| of == name).unwrap_or_else(|| panic!("no column {name}")).1
}

fn count(rows: &[(String, Vec<u64>)], status: Status) -> usize {
    column(rows, "status").iter().filter(|code| **code == u64::from(status.code())).count()
}

#[test]
fn on_the_cpu_bit_by_bit() {
    let dir = tempfile::tempdir().expect("a directory");
    for precision in [Precision::F64, Precision::F32] {
        let plan = plan(Stepper::Dop853, STEPS);
        let mut lanes = Cpu::new(&plan, precision).expect("supported");
        let mut go = |name: &str, chunk, shard: &str| {
            run_into(&mut lanes, dir.path().join(format!("{precision}-{}", name.replace('/', "-"))), chunk, shard)
        };
        let whole = rows(&go("whole", CHUNK, "1/1"));
        assert_eq!(column(&whole, "sample").len(), 8192);
        for status in [Status::Ok, Status::Ramped, Status::Refined, Status::BadParameter] {
            let found = count(&whole, status);
            println!("{precision}: {found} {}", status.name());
            assert!(found > 0, "{precision}: the sweep has no {}", status.name());
        }
        assert!(rows(&go("small parts", 777, "1/1")) == whole, "{precision}: other parts");
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let dir = pool.install(|| go(&format!("{threads} threads"), 1000, "1/1"));
            assert!(rows(&dir) == whole, "{precision}: {threads} threads");
        }
        let shards: Vec<PathBuf> = ["3/3", "1/3", "2/3"].iter().map(|shard| go(shard, 1000, shard)).collect();
        let merged = dir.path().join(format!("{precision}-merged"));
        assert!(merge(&shards, &merged).expect("merges").is_complete());
        assert!(rows(&merged) == whole, "{precision}: shards");
    }
}

/// The same statuses and rows on one GPU; against the CPU the same failures, and tips within the tolerance.
#[test]
fn on_a_gpu() {
    let Some(device) = device_or_skip("whole runs on the GPU") else { return };
    let dir = tempfile::tempdir().expect("a directory");
    let plan = plan(Stepper::Rk4, 16);
    let mut gpu = Gpu::new(device, &plan, Precision::F32).expect("supported");
    let whole = rows(&run_into(&mut gpu, dir.path().join("whole"), CHUNK, "1/1"));
    let parts = rows(&run_into(&mut gpu, dir.path().join("parts"), 1000, "1/1"));
    assert_eq!(column(&whole, "status"), column(&parts, "status"));
    assert!(whole == parts, "other parts, other rows");
    let mut again = Gpu::new(Device::open().expect("it was there before"), &plan, Precision::F32).expect("supported");
    let shards: Vec<PathBuf> =
        ["1/2", "2/2"].iter().map(|shard| run_into(&mut again, dir.path().join(&shard[..1]), 1000, shard)).collect();
    let merged = dir.path().join("merged");
    assert!(merge(&shards, &merged).expect("merges").is_complete());
    assert_eq!(column(&whole, "status"), column(&rows(&merged), "status"));

    let mut lanes = Cpu::new(&plan, Precision::F32).expect("supported");
    let cpu = rows(&run_into(&mut lanes, dir.path().join("cpu"), CHUNK, "1/1"));
    let (codes, other) = (column(&whole, "status"), column(&cpu, "status"));
    let status = |code: &u64| Status::from_code(*code as u8).expect("a status");
    let length = spec().scene.total_length();
    let tips = ["x", "y", "z"].map(|axis| format!("tip.position.{axis}"));
    let mut worst = 0.0f64;
    for sample in 0..codes.len() {
        let (a, b) = (status(&codes[sample]), status(&other[sample]));
        assert_eq!(a.is_success(), b.is_success(), "sample {sample}: {a:?} on the GPU, {b:?} on the CPU");
        if a.is_success() {
            for name in &tips {
                let [x, y] = [&whole, &cpu].map(|rows| f64::from(f32::from_bits(column(rows, name)[sample] as u32)));
                worst = worst.max((x - y).abs() / length);
            }
        }
    }
    println!("GPU against CPU, both f32: {worst:.1e} of the length");
    assert!(worst <= ON_GPU, "{worst:e}");
}
