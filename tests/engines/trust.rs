//! From rest, on a large sample: what the engines call solved against the reference, tip by tip.
//!
//! 2,000 samples of each sweep by default; `RODSWEEP_TRUST_SAMPLES=20000` takes more.

use crate::common::root;
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::model::{Plan, PlanOptions, Quantity, Solutions, Status, Stepper};
use rodsweep::reference::{Reference, stability_at};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::choose_steps;

/// Of the shipped map; prime, so that a stride runs through every value of every axis.
const STRIDE: u64 = 7_919;
/// Tip position over length, as both sweeps ask for.
const TOLERANCE: f64 = 1e-6;
/// F32 is held to 2e-5.
const ENGINES: [(BackendKind, Precision, Stepper, f64); 4] = [
    (BackendKind::Cpu, Precision::F64, Stepper::Dop853, TOLERANCE),
    (BackendKind::Cpu, Precision::F32, Stepper::Tp7, 2e-5),
    (BackendKind::Gpu, Precision::F64, Stepper::Dop853, TOLERANCE),
    (BackendKind::Gpu, Precision::F32, Stepper::Tp6, 2e-5),
];
/// Steps of the second attempt that `run` makes.
const SECOND_STEPS: usize = 24;
/// Samples of the Sobol' sweep that pass close by a bifurcation (least margin on the way below 0.03), which few steps
/// unfold the other way.
const NEAR_BIFURCATION: [u64; 6] = [334_616, 330_221, 341_797, 628_151, 474_934, 181_951];
/// Samples of it whose path from rest ends at a fold.
const FOLDS: [u64; 2] = [356_129, 442_776];
/// Folds are found on load steps of at least this share.
const FRACTION: f64 = 2e-3;
/// Rows printed.
const WORST: usize = 5;

/// Currents as on the map, insertion from 60 to 137 mm, tip force to 5 mN.
const SOBOL: &str = r#"
scene = "scenes/p6.toml"
[sampling]
method = "sobol"
samples = 1048576
seed = 11
[[axis]]
parameter = "coil.current.x"
from = "-0.3 A"
to = "0.3 A"
[[axis]]
parameter = "coil.current.y"
from = "-0.3 A"
to = "0.3 A"
[[axis]]
parameter = "coil.current.z"
from = "-0.3 A"
to = "0.3 A"
[[axis]]
parameter = "insertion"
from = "60 mm"
to = "137 mm"
[[axis]]
parameter = "loads.tip_force.x"
from = "-5 mN"
to = "5 mN"
[[axis]]
parameter = "loads.tip_force.y"
from = "-5 mN"
to = "5 mN"
[[axis]]
parameter = "loads.tip_force.z"
from = "-5 mN"
to = "5 mN"
[solver]
tolerance = 1e-6
"#;

#[test]
fn map() {
    let path = root().join("sweeps/workspace.toml");
    check(&SweepSpec::read(&path).expect("the shipped sweep reads"));
}

#[test]
fn sobol() {
    check(&sobol_sweep());
}

fn sample_count() -> usize {
    let asked = std::env::var("RODSWEEP_TRUST_SAMPLES").ok();
    asked.map_or(2_000, |count| count.parse().expect("a number of samples"))
}

fn sobol_sweep() -> SweepSpec {
    let path = root().join("sweeps/trust.toml");
    SweepSpec::parse(&path, SOBOL).expect("the sweep reads")
}

fn plan_without_derivatives(spec: &SweepSpec) -> Plan {
    Plan::new(&spec.scene, &spec.axis_parameters(), &[], PlanOptions::default()).expect("the sweep plans")
}

fn solve(spec: &SweepSpec, plan: &Plan, backend: &mut dyn Backend, indices: &[u64]) -> Solutions {
    let sampler = spec.sampler();
    let values = |i: usize, row: &mut [f64]| {
        if let Some(index) = indices.get(i) {
            sampler.values(*index, row);
        }
    };
    backend.solve(&plan.batch(indices.len(), values)).expect("solved")
}

/// On the CPU in f64.
fn solve_by_lanes(spec: &SweepSpec, plan: &Plan, steps: usize, indices: &[u64]) -> Solutions {
    let plan = plan.with_options(PlanOptions { steps, tolerance: TOLERANCE, ..plan.options });
    solve(spec, &plan, &mut Cpu::new(&plan, Precision::F64).expect("supported"), indices)
}

/// An engine as `run` takes it, or nothing where this machine lacks it.
fn engine(kind: BackendKind, precision: Precision, plan: &Plan) -> Option<Box<dyn Backend>> {
    if kind == BackendKind::Cpu {
        return Some(Box::new(Cpu::new(plan, precision).expect("supported")));
    }
    let device = device_or_skip("trust on the GPU")?;
    if precision == Precision::F64 && !device.adapter().has_f64 {
        println!("skipped: {} has no f64", device.adapter().name);
        return None;
    }
    Some(Box::new(Gpu::new(device, plan, precision).expect("supported")))
}

/// On every engine every success must be the tip of the reference; what only one of them solves must be rare.
fn check(spec: &SweepSpec) {
    let plan = plan_without_derivatives(spec);
    let indices: Vec<u64> = (0..sample_count() as u64).map(|k| k * STRIDE % spec.sample_count).collect();
    let truth = solve(spec, &plan, &mut Reference::new(&plan), &indices);
    for (kind, precision, stepper, tolerance) in ENGINES {
        let plan = plan.with_options(PlanOptions { stepper, tolerance, ..plan.options });
        let factory = |plan: &Plan| Ok(Box::new(Cpu::new(plan, Precision::F64)?) as Box<dyn Backend>);
        let steps = choose_steps(&plan, &spec.sampler(), &factory).expect("a resolution").steps;
        let plan = plan.with_options(PlanOptions { steps, ..plan.options });
        let Some(mut engine) = engine(kind, precision, &plan) else { continue };
        let mut found = solve(spec, &plan, engine.as_mut(), &indices);
        let doubtful: Vec<usize> = (0..indices.len())
            .filter(|at| !found.status(*at).is_success() || found.get(*at, Quantity::ErrorEstimate) > tolerance)
            .collect();
        let again: Vec<u64> = doubtful.iter().map(|at| indices[*at]).collect();
        let second = solve_by_lanes(spec, &plan, SECOND_STEPS.max(steps), &again);
        for (from, to) in doubtful.iter().enumerate() {
            if second.status(from).is_success() {
                found.copy_row(*to, &second, from);
                found.set_status(*to, Status::Refined);
            }
        }
        let (of, name) = (spec.sample_count, stepper.name());
        let again = doubtful.len();
        println!("{kind} {precision}: {} of {of} samples, {steps} steps of {name}, {again} tried again", indices.len());
        report(&plan, spec, &indices, &found, &truth);
    }
}

fn tip_difference(plan: &Plan, a: &Solutions, b: &Solutions, at: usize) -> f64 {
    let (p, q) = (a.vector(at, Quantity::TipPosition), b.vector(at, Quantity::TipPosition));
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / plan.units.length
}

#[test]
fn few_steps_keep_to_the_branch() {
    let spec = sobol_sweep();
    let plan = plan_without_derivatives(&spec);
    let truth = solve(&spec, &plan, &mut Reference::new(&plan), &NEAR_BIFURCATION);
    for steps in [4, 6, 8, 12, 24] {
        let found = solve_by_lanes(&spec, &plan, steps, &NEAR_BIFURCATION);
        for (at, index) in NEAR_BIFURCATION.iter().enumerate() {
            assert!(truth.status(at).is_success() && found.status(at).is_success(), "{steps} steps, {index}");
            let off = tip_difference(&plan, &found, &truth, at);
            assert!(off <= found.get(at, Quantity::ErrorEstimate).max(TOLERANCE), "{steps} steps, {index}: {off:e}");
        }
    }
}

/// Where the path ends at a fold the row says at which load, and holds a stable equilibrium under the full load.
#[test]
fn beyond_a_fold() {
    let spec = sobol_sweep();
    let plan = plan_without_derivatives(&spec);
    let sampler = spec.sampler();
    let batch = plan.batch(FOLDS.len(), |at, row| {
        if let Some(index) = FOLDS.get(at) {
            sampler.values(*index, row);
        }
    });
    let truth = solve(&spec, &plan, &mut Reference::new(&plan), &FOLDS);
    for steps in [16, 24] {
        let found = solve_by_lanes(&spec, &plan, steps, &FOLDS);
        for at in 0..FOLDS.len() {
            assert_eq!([found.status(at), truth.status(at)], [Status::Fold; 2]);
            let fractions = [&found, &truth].map(|solutions| solutions.get(at, Quantity::LoadFraction));
            assert!((fractions[0] - fractions[1]).abs() < FRACTION, "{fractions:?}");
            assert!(found.is_equilibrium(at) && !truth.is_equilibrium(at));
            let rod = plan.sample_rod(&batch, at);
            let there = stability_at(&rod, found.vector(at, Quantity::BaseMoment)).expect("integrated");
            assert_eq!(there.index, 0);
            assert!(there.residual < TOLERANCE * plan.units.moment(), "{:e}", there.residual);
            assert!((there.margin - found.get(at, Quantity::StabilityMargin)).abs() < TOLERANCE.sqrt());
        }
    }
}

fn report(plan: &Plan, spec: &SweepSpec, indices: &[u64], found: &Solutions, truth: &Solutions) {
    let sampler = spec.sampler();
    let mut row = vec![0.0; sampler.value_count()];
    let (mut errors, mut given_up, mut unproven) = (Vec::new(), Vec::new(), Vec::new());
    for at in 0..indices.len() {
        match (found.status(at).is_success(), truth.status(at).is_success()) {
            (true, true) => {
                errors.push((tip_difference(plan, found, truth, at), at));
            }
            (true, false) => unproven.push(at),
            (false, true) => given_up.push(at),
            (false, false) => {}
        }
    }
    // What is no number comes first.
    errors.sort_by(|a, b| b.0.total_cmp(&a.0));
    let count = |solutions: &Solutions, status| (0..indices.len()).filter(|at| solutions.status(*at) == status).count();
    for status in Status::ALL {
        let counts = (count(found, status), count(truth, status));
        if counts != (0, 0) {
            println!("  {}: {} (reference {})", status.name(), counts.0, counts.1);
        }
    }
    for (error, at) in errors.iter().take(WORST) {
        sampler.values(indices[*at], &mut row);
        let margin = truth.get(*at, Quantity::StabilityMargin);
        println!("  {error:.1e} at {}, margin {margin:.1e}: {row:?}", indices[*at]);
    }
    for (what, list) in [("reference only", &given_up), ("not by the reference", &unproven)] {
        println!("  {what}: {}", list.len());
        for at in list.iter().take(WORST) {
            sampler.values(indices[*at], &mut row);
            let (a, b) = (found.status(*at).name(), truth.status(*at).name());
            let fraction = found.get(*at, Quantity::LoadFraction);
            let margin = truth.get(*at, Quantity::StabilityMargin);
            println!(
                "    {}: {a} at {fraction:.4} of the load, reference {b}, margin {margin:.1e}: {row:?}",
                indices[*at]
            );
        }
    }
    let tolerance = plan.options.tolerance;
    let is_wrong = |error: f64| error.is_nan() || error > tolerance;
    let wrong: Vec<u64> = errors.iter().filter(|(error, _)| is_wrong(*error)).map(|(_, at)| indices[*at]).collect();
    println!("  off by more than {tolerance:e}: {wrong:?}");
    assert!(wrong.is_empty(), "successes off by more than {tolerance:e}: {wrong:?}");
    assert!(unproven.is_empty(), "{} successes that the reference does not have", unproven.len());
    assert!(1000 * given_up.len() <= indices.len(), "{} given up", given_up.len());
}
