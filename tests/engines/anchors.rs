//! Samples that start from anchors are those from rest, and depend on nothing but the sweep and their index.

use crate::common::boxes::{self, axis, bent, currents, torn};
use crate::common::root;
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::EngineRequest;
use rodsweep::model::{Batch, Plan, Quantity, Solutions, Status};
use rodsweep::results::AnchorAccount;
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::{Memory, SweepJob};
use rodsweep::table::Table;

/// With these lines in its table `solver`.
fn sweep(samples: u64, axes: &str, solver: &str) -> SweepSpec {
    boxes::sweep(samples, axes, &format!("[solver]\n{solver}"))
}

fn job(spec: SweepSpec) -> SweepJob<'static> {
    SweepJob::new(spec).engine(EngineRequest::of(BackendKind::Cpu)).spot_check(None)
}

fn plan_of(spec: &SweepSpec) -> Plan {
    job(spec.clone()).prepare(&Memory::new()).expect("a method").plan().clone()
}

/// The same rods from rest: the inputs keep their columns.
fn from_rest(plan: &Plan) -> Plan {
    Plan { anchors: None, ..plan.clone() }
}

fn batch(plan: &Plan, spec: &SweepSpec, count: usize) -> Batch {
    let sampler = spec.sampler();
    plan.batch(count, |at, row| sampler.values((at as u64).min(spec.sample_count - 1), row))
}

fn solve(plan: &Plan, batch: &Batch, precision: Precision) -> Solutions {
    Cpu::new(plan, precision).expect("an engine").solve(batch).expect("solved")
}

/// Success against success, tip against tip; returns the share that started from anchors.
fn compare(spec: &SweepSpec, count: usize, precision: Precision) -> f64 {
    let plan = plan_of(spec);
    assert!(plan.anchors.is_some(), "no anchors");
    let batch = batch(&plan, spec, count);
    let (found, expected) = (solve(&plan, &batch, precision), solve(&from_rest(&plan), &batch, precision));
    let length = plan.scene.total_length();
    for at in 0..count {
        let status = |of: &Solutions| of.status(at);
        assert_eq!(status(&found).is_success(), status(&expected).is_success(), "sample {at}");
        if !status(&found).is_success() {
            continue;
        }
        let [p, q] = [&found, &expected].map(|of| of.vector(at, Quantity::TipPosition));
        let off = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / length;
        let estimate = found.get(at, Quantity::ErrorEstimate).max(expected.get(at, Quantity::ErrorEstimate));
        assert!(off <= 2.0 * estimate.max(1e-7), "sample {at}: tips differ by {off}, estimate {estimate}");
        let margins = [&found, &expected].map(|of| of.get(at, Quantity::StabilityMargin));
        assert!((margins[0] - margins[1]).abs() < 1e-3, "sample {at}: margins {margins:?}");
    }
    (0..count).filter(|at| found.status(*at) == Status::Ok).count() as f64 / count as f64
}

#[test]
fn samples_from_anchors_are_those_from_rest() {
    let map = sweep(200_000, &currents(0.3), "");
    for precision in Precision::ALL {
        let share = compare(&map, 20_000, precision);
        assert!(share > 0.93, "{share} of the samples start from anchors");
    }
    let four = currents(0.3) + &axis("insertion", 0.064, 0.137);
    assert!(compare(&sweep(400_000, &four, ""), 20_000, Precision::F64) > 0.7);
    let two = axis("proximal.rest_curvature.x", -5.0, 5.0) + &axis("proximal.youngs_modulus", 5e6, 6e6);
    assert!(compare(&sweep(20_000, &two, ""), 20_000, Precision::F64) > 0.9);
}

/// Wide boxes, where equilibria from rest are torn apart between the anchors.
#[test]
fn tears_lead_to_no_other_branch() {
    for (axes, least) in [(currents(1.0), 0.7), (torn(), 0.4), (bent(), 0.5)] {
        let share = compare(&sweep(60_000, &axes, ""), 60_000, Precision::F64);
        assert!((least..1.0).contains(&share), "{share}");
    }
}

fn rows(job: SweepJob) -> Table {
    let mut rows = Memory::new();
    job.run(&mut rows).expect("a run");
    rows.into_table()
}

#[test]
fn shards_limits_and_threads_change_nothing() {
    let spec = sweep(40_000, &currents(0.3), "");
    let whole = rows(job(spec.clone()));
    let first = rows(job(spec.clone()).limit(Some(700)));
    assert_eq!(first, whole.select(&(0..700).collect::<Vec<_>>()));
    let mut joined = Table::default();
    for number in 1..=3 {
        joined.append(&rows(job(spec.clone()).shard(Shard::parse(&format!("{number}/3")).expect("a shard"))));
    }
    assert_eq!(joined, whole);
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    assert_eq!(
        alone.install(|| rows(job(spec.clone()).limit(Some(3000)))),
        whole.select(&(0..3000).collect::<Vec<_>>())
    );
}

#[test]
fn anchors_are_left_out_where_they_do_not_pay_or_are_not_wanted() {
    let told = |spec: &SweepSpec| AnchorAccount::of(&plan_of(spec)).map(|account| account.points);
    assert_eq!(told(&sweep(40_000, &currents(0.3), "")), Some(vec![10, 10, 10]));
    assert_eq!(told(&sweep(40_000, &currents(0.3), "anchors = \"off\"\n")), None);
    assert_eq!(told(&sweep(10_000, &currents(0.3), "")), None);
    let six =
        currents(0.1) + &["x", "y", "z"].map(|letter| axis(&format!("loads.tip_force.{letter}"), -1e-4, 1e-4)).concat();
    assert_eq!(told(&sweep(1_000_000, &six, "")), None);
    let wrong = SweepSpec::parse(
        &root().join("sweeps/s.toml"),
        &format!(
            "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = 8\n{}[solver]\nanchors = \"on\"\n",
            currents(0.1)
        ),
    );
    let text = wrong.expect_err("no such choice").to_string();
    assert!(text.contains("`solver.anchors`") && text.contains("auto") && text.contains("off"), "{text}");
}
