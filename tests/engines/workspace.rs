//! The shipped workspace map: right branch, right numbers, and the same rows however the work is cut.

use crate::common::root;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{Plan, PlanOptions, Quantity, Solutions};
use rodsweep::reference::Reference;
use rodsweep::spec::SweepSpec;
use std::sync::LazyLock;

/// Coprime to 61: the chosen samples run through every value of every current.
const STRIDE: u64 = 97;
/// Coprime to the number of samples: so many apart they come in another order.
const SHUFFLE: usize = 1009;
/// The sweep's own tolerance.
const TOLERANCE: f64 = 1e-6;
/// Round-off of f32 along the rod, amplified near folds.
const TOLERANCE_F32: f64 = 2e-5;

struct Map {
    spec: SweepSpec,
    plan: Plan,
    indices: Vec<u64>,
}

fn map() -> Map {
    let path = root().join("sweeps/workspace.toml");
    let spec = SweepSpec::read(&path).expect("the shipped sweep reads");
    assert_eq!(spec.sample_count, 61 * 61 * 61);
    let plan = spec.plan(PlanOptions { steps: 6, ..PlanOptions::default() }).expect("the shipped sweep plans");
    Map { indices: (0..spec.sample_count).step_by(STRIDE as usize).collect(), plan, spec }
}

fn solve(map: &Map, backend: &mut dyn Backend, indices: &[u64]) -> Solutions {
    let sampler = map.spec.sampler();
    let batch = map.plan.batch(indices.len(), |i, row| sampler.values(indices[i], row));
    backend.solve(&batch).expect("solved")
}

/// By the reference, once for all tests.
static TRUTH: LazyLock<Solutions> = LazyLock::new(|| {
    let map = map();
    solve(&map, &mut Reference::new(&map.plan), &map.indices)
});

fn tip_difference(map: &Map, a: &Solutions, b: &Solutions, sample: usize) -> f64 {
    let (p, q) = (a.vector(sample, Quantity::TipPosition), b.vector(sample, Quantity::TipPosition));
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / map.plan.units.length
}

/// Compares tips of samples solved by both; returns how many one of them gave up.
fn compare(map: &Map, name: &str, found: &Solutions, truth: &Solutions, tolerance: f64) -> usize {
    let (mut worst, mut given_up) = ((0.0, 0), 0);
    for sample in 0..map.indices.len() {
        if !(found.status(sample).is_success() && truth.status(sample).is_success()) {
            given_up += 1;
            continue;
        }
        let error = tip_difference(map, found, truth, sample);
        if error.is_nan() || error > worst.0 {
            worst = (error, map.indices[sample]);
        }
    }
    println!("{name}: {} samples, worst tip {:.1e} at {}, {given_up} given up", map.indices.len(), worst.0, worst.1);
    assert!(worst.0 <= tolerance, "{name}: sample {} is off by {:e}", worst.1, worst.0);
    given_up
}

#[test]
fn right_branch() {
    let map = map();
    for (precision, tolerance) in [(Precision::F64, TOLERANCE), (Precision::F32, TOLERANCE_F32)] {
        let mut lanes = Cpu::new(&map.plan, precision).expect("supported");
        let found = solve(&map, &mut lanes, &map.indices);
        let given_up = compare(&map, &precision.to_string(), &found, &TRUTH, tolerance);
        // Before any second attempt: fewer than one in a thousand.
        assert!(given_up * 1000 <= map.indices.len(), "{given_up} given up in {precision}");
    }
}

#[test]
fn error_estimates_bound_errors() {
    let map = map();
    let truth = &*TRUTH;
    let mut lanes = Cpu::new(&map.plan, Precision::F64).expect("supported");
    let found = solve(&map, &mut lanes, &map.indices);
    let mut beyond = 0;
    for sample in (0..map.indices.len()).filter(|sample| found.status(*sample).is_success()) {
        let estimate = found.get(sample, Quantity::ErrorEstimate) + truth.get(sample, Quantity::ErrorEstimate);
        beyond += usize::from(tip_difference(&map, &found, truth, sample) > estimate);
    }
    println!("{beyond} of {} errors beyond their estimate", map.indices.len());
    assert!(beyond * 1000 <= map.indices.len());
}

/// Bits of a row, so that NaN equals NaN.
fn row(solutions: &Solutions, sample: usize) -> Vec<u64> {
    (0..solutions.values.column_count()).map(|column| solutions.values.get(sample, column).to_bits()).collect()
}

#[test]
fn rows_do_not_depend_on_order_batches_or_threads() {
    let map = map();
    for precision in [Precision::F64, Precision::F32] {
        let mut lanes = Cpu::new(&map.plan, precision).expect("supported");
        let whole = solve(&map, &mut lanes, &map.indices);
        let reversed: Vec<u64> = map.indices.iter().rev().copied().collect();
        let backwards = solve(&map, &mut lanes, &reversed);
        let last = map.indices.len() - 1;
        for sample in 0..=last {
            assert_eq!(row(&whole, sample), row(&backwards, last - sample), "{precision}: sample {sample} reversed");
        }
        let shuffled: Vec<usize> = (0..=last).map(|k| k * SHUFFLE % (last + 1)).collect();
        let other = solve(&map, &mut lanes, &shuffled.iter().map(|k| map.indices[*k]).collect::<Vec<_>>());
        for (at, sample) in shuffled.iter().enumerate() {
            assert_eq!(row(&whole, *sample), row(&other, at), "{precision}: sample {sample} shuffled");
        }
        for (chunk, indices) in map.indices.chunks(313).enumerate() {
            let part = solve(&map, &mut lanes, indices);
            for sample in 0..indices.len() {
                assert_eq!(row(&whole, chunk * 313 + sample), row(&part, sample), "{precision}: batch {chunk}");
            }
        }
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let other = pool.install(|| solve(&map, &mut lanes, &map.indices));
            for sample in 0..=last {
                assert_eq!(row(&whole, sample), row(&other, sample), "{precision}: {threads} threads, {sample}");
            }
        }
    }
}
