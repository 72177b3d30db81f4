//! Micro-benchmarks of the CPU engine on the benchmark scene: `cargo bench`. For speed against error: `rodsweep bench`.

use divan::Bencher;
use divan::counter::ItemsCount;
use rodsweep::backend::{Backend, BackendError, BackendInfo, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Solutions, Start, Stepper};
use rodsweep::spec::{Format, SweepSpec};
use rodsweep::sweep::{ResultDirectory, RunOptions, run};
use rodsweep_bench::BenchSpec;
use rodsweep_bench::measure::built_in;

const SAMPLES: usize = 256;
/// Of each stepper, for tips good to about 1e-6.
const STEPS: [(u32, usize); 2] = [(4, 16), (u32::MAX, 3)];

fn main() {
    // One thread: what is compared is work, not cores.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("a pool");
    divan::main();
}

/// The scene that targets are stated for.
fn spec() -> BenchSpec {
    built_in().expect("bench files").swap_remove(0)
}

fn options(stepper: Stepper) -> PlanOptions {
    let (_, steps) = *STEPS.iter().find(|(order, _)| stepper.order() <= *order).expect("steps for every order");
    PlanOptions { stepper, steps, ..PlanOptions::default() }
}

fn batch(spec: &SweepSpec, plan: &Plan) -> Batch {
    let sampler = spec.sampler();
    plan.batch(SAMPLES, |sample, row| sampler.values(sample as u64, row))
}

fn time(bencher: Bencher, engine: &mut Cpu, batch: &Batch) {
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| engine.solve(batch).expect("solved"));
}

/// From rest, no derivatives.
#[divan::bench(args = Stepper::ALL, consts = [32, 64])]
fn equilibrium<const BITS: usize>(bencher: Bencher, stepper: Stepper) {
    let spec = spec().sweep;
    let plan = Plan::new(&spec.scene, &spec.axis_parameters(), &[], options(stepper)).expect("a plan");
    time(bencher, &mut Cpu::new(&plan, precision(BITS)).expect("an engine"), &batch(&spec, &plan));
}

/// From rest, with the 6 x 17 Jacobian.
#[divan::bench(args = Stepper::ALL, consts = [32, 64])]
fn jacobian<const BITS: usize>(bencher: Bencher, stepper: Stepper) {
    let spec = spec().sweep;
    let plan = spec.plan(options(stepper)).expect("a plan");
    time(bencher, &mut Cpu::new(&plan, precision(BITS)).expect("an engine"), &batch(&spec, &plan));
}

/// From the equilibrium itself, with the Jacobian: little more than the last passes.
#[divan::bench(args = Stepper::ALL, consts = [32, 64])]
fn last_passes<const BITS: usize>(bencher: Bencher, stepper: Stepper) {
    let spec = spec().sweep;
    let plan = spec.plan(options(stepper)).expect("a plan");
    let rods = batch(&spec, &plan);
    let found = Cpu::new(&plan, Precision::F64).expect("an engine").solve(&rods).expect("solved");
    let start = |sample| Start { sample, m0: found.vector(sample, Quantity::BaseMoment), n0: None, known: &[] };
    let starts = plan.start_batch(&rods, &(0..SAMPLES).map(start).collect::<Vec<_>>());
    time(bencher, &mut Cpu::new(&plan.with_starts(), precision(BITS)).expect("an engine"), &starts);
}

fn precision(bits: usize) -> Precision {
    if bits == 32 { Precision::F32 } else { Precision::F64 }
}

/// Answers known before, so that only inputs, rows and files are left.
struct Known(Plan, Solutions);

impl Backend for Known {
    fn info(&self) -> BackendInfo {
        Cpu::new(&self.0, Precision::F64).expect("an engine").info()
    }

    fn plan(&self) -> &Plan {
        &self.0
    }

    fn batch_size(&self) -> usize {
        SAMPLES
    }

    fn solve(&mut self, _: &Batch) -> Result<Solutions, BackendError> {
        Ok(self.1.clone())
    }
}

/// Everything of a run but the solving.
#[divan::bench(args = [Format::Parquet, Format::Csv, Format::Npz], sample_count = 20)]
fn rows(bencher: Bencher, format: Format) {
    let spec = SweepSpec { format, sample_count: SAMPLES as u64, ..spec().sweep };
    let plan = spec.plan(options(Stepper::Dop853)).expect("a plan");
    let solutions = Cpu::new(&plan, Precision::F64).expect("an engine").solve(&batch(&spec, &plan)).expect("solved");
    bencher
        .counter(ItemsCount::new(SAMPLES))
        .with_inputs(|| tempfile::tempdir().expect("a folder"))
        .bench_local_values(|folder| {
            let mut known = Known(plan.clone(), solutions.clone());
            let mut files = ResultDirectory::new(folder.path().join("out"));
            run(&spec, &mut known, &RunOptions::new(), &mut files).expect("a run");
            folder
        });
}
