//! Mixed precision: tips and base moments of f64, columns of f32, estimates that bound both.

use crate::common::root;
use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::engines::EngineRequest;
use rodsweep::lanes::{InstructionSet, Lanes};
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Solutions, Start, Stepper};
use rodsweep::spec::SweepSpec;

const SAMPLES: usize = 2000;
/// Of tips over the length: the last step in f64 is 1e-6 of a rod's moment, the columns it is made with are good to 1e-4.
const TIP: f64 = 1e-10;
/// Of columns, over the largest column of their derivative: round-off of f32, and of Newton's last step in it.
const COLUMNS: f64 = 1e-4;

fn sweep(file: &str) -> (SweepSpec, Plan, Batch) {
    let mut spec = SweepSpec::read(&root().join(file)).expect("a shipped sweep");
    spec.sample_count = spec.sample_count.max(SAMPLES as u64);
    let options = PlanOptions { stepper: Stepper::Tp7, steps: 4, ..PlanOptions::default() };
    let plan = spec.plan(options).expect("a plan");
    let batch = batch(&plan, &spec, &(0..SAMPLES).collect::<Vec<_>>());
    (spec, plan, batch)
}

fn batch(plan: &Plan, spec: &SweepSpec, samples: &[usize]) -> Batch {
    let sampler = spec.sampler();
    let stride = spec.sample_count / SAMPLES as u64;
    plan.batch(samples.len(), |at, row| sampler.values(samples[at.min(samples.len() - 1)] as u64 * stride, row))
}

fn solve(plan: &Plan, precision: Precision, batch: &Batch) -> Solutions {
    Lanes::new(plan, precision).expect("supported").solve(batch).expect("solved")
}

#[test]
fn tips_are_those_of_f64_and_columns_those_of_f32() {
    for file in ["sweeps/bench/benchmark.toml", "sweeps/workspace.toml"] {
        let (_, plan, batch) = sweep(file);
        // With the plan's own tolerance f64 ends where the square of a step is left, 2e-9 of a tip.
        let sharp = plan.with_options(PlanOptions { tolerance: 1e-12, ..plan.options });
        let (ours, theirs) = (solve(&plan, Precision::Mixed, &batch), solve(&sharp, Precision::F64, &batch));
        let length = plan.scene.total_length();
        let (mut tip, mut column, mut compared) = (0.0f64, 0.0f64, 0);
        for at in 0..SAMPLES {
            assert_eq!(ours.status(at).is_success(), theirs.status(at).is_success(), "{file} {at}");
            if !ours.status(at).is_success() {
                continue;
            }
            compared += 1;
            let apart = |quantity: Quantity| {
                crate::common::check::difference(&ours.vector(at, quantity), &theirs.vector(at, quantity))
            };
            let apart = (apart(Quantity::TipPosition) / length).max(apart(Quantity::TipTangent));
            assert!(apart < ours.get(at, Quantity::ErrorEstimate), "{file} {at}: {apart}");
            tip = tip.max(apart);
            for derivative in 0..plan.derivatives.len() {
                for row in 0..6 {
                    let difference = ours.derivative(at, derivative, row) - theirs.derivative(at, derivative, row);
                    let scale = |row: usize| if row < 3 { length } else { 1.0 };
                    let norm =
                        (0..6).map(|row| (theirs.derivative(at, derivative, row) / scale(row)).powi(2)).sum::<f64>();
                    let natural = crate::common::check::natural_size(
                        &plan.scene,
                        plan.derivatives[derivative].parameter,
                        &plan.units,
                    );
                    column = column.max(difference.abs() / scale(row) / norm.sqrt().max(0.1 * natural));
                }
            }
        }
        println!("{file}: {compared} compared, tips {tip:.1e}, columns {column:.1e}");
        assert!(compared > SAMPLES / 2 && tip < TIP && column < COLUMNS, "{file}");
    }
}

/// On every instruction set a sample's row depends on that sample alone.
#[test]
fn neighbours_change_nothing() {
    let (spec, plan, all) = sweep("sweeps/workspace.toml");
    let some: Vec<usize> = (0..SAMPLES).step_by(37).rev().collect();
    let few = batch(&plan, &spec, &some);
    for set in InstructionSet::available() {
        let mut engine = Lanes::with_instruction_set(&plan, Precision::Mixed, set).expect("available");
        let (whole, part) = (engine.solve(&all).expect("solved"), engine.solve(&few).expect("solved"));
        for (at, sample) in some.iter().enumerate() {
            for column in 0..plan.output_count() {
                let [a, b] = [whole.values.get(*sample, column), part.values.get(at, column)];
                assert_eq!(a.to_bits(), b.to_bits(), "{}: sample {sample}, column {column}", set.name());
            }
        }
    }
}

/// Rods that are solved by nodes, fields that vary and searches: the very bits of f64.
#[test]
fn what_it_is_not_for_is_f64() {
    for file in ["bench/limp", "arm_magnet", "coil_array", "workspace"] {
        let (_, plan, batch) = sweep(&format!("sweeps/{file}.toml"));
        let (plan, batch) = match file {
            "workspace" => {
                let starts = (0..SAMPLES).map(|sample| Start { sample, m0: [1e-4, 0.0, 0.0], n0: None, known: &[] });
                (plan.with_starts(), plan.start_batch(&batch, &starts.collect::<Vec<_>>()))
            }
            _ => (plan, batch),
        };
        let (ours, theirs) = (solve(&plan, Precision::Mixed, &batch), solve(&plan, Precision::F64, &batch));
        let solved: Vec<usize> = (0..SAMPLES).filter(|at| theirs.status(*at).is_converged()).collect();
        assert!(solved.len() > SAMPLES / 2, "{file}: {} solved", solved.len());
        for at in 0..SAMPLES {
            assert_eq!(ours.status(at), theirs.status(at), "{file} {at}");
        }
        for (at, column) in solved.iter().flat_map(|at| (0..plan.output_count()).map(move |column| (*at, column))) {
            let [a, b] = [&ours, &theirs].map(|rows| rows.values.get(at, column));
            assert_eq!(a.to_bits(), b.to_bits(), "{file} {at}, column {column}: {a} {b}");
        }
    }
}

#[test]
fn other_engines_refuse_it() {
    for kind in [BackendKind::Gpu, BackendKind::Reference] {
        let request = EngineRequest::of(kind).precision(Some(Precision::Mixed));
        let error = request.choose(1e-6).expect_err("refused");
        assert!(
            matches!(&error, BackendError::Unsupported { backend, what, .. } if *backend == kind && what == "mixed")
        );
    }
    let engine = EngineRequest::any().precision(Some(Precision::Mixed)).choose(1e-6).expect("an engine");
    assert_eq!((engine.kind(), engine.precision()), (BackendKind::Cpu, Precision::Mixed));
}
