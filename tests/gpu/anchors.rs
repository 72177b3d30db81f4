//! Samples that start from anchors on the device are those from rest, and depend on nothing but the sweep and their index.

use crate::common::root;
use crate::common::runs::run_into;
use crate::reduce::{Rows, expect_same, plan_of};
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::engines::EngineRequest;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::gpu::{Device, Gpu};
use rodsweep::model::{Batch, Plan, Quantity, Solutions, Status};
use rodsweep::results::AnchorAccount;
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::{Memory, RunOptions, SweepJob, with_anchors};
use rodsweep::table::Table;

fn axis(name: &str, from: f64, to: f64) -> String {
    format!("[[axis]]\nparameter = \"{name}\"\nfrom = {from}\nto = {to}\n")
}

/// The three currents, within these limits (A).
fn currents(limit: f64) -> String {
    ["x", "y", "z"].map(|letter| axis(&format!("coil.current.{letter}"), -limit, limit)).concat()
}

fn sweep(samples: u64, axes: &str) -> SweepSpec {
    sweep_with(samples, axes, "[output]\nformat = \"none\"\n[workspace]\nvoxel = \"2 mm\"\n")
}

fn sweep_with(samples: u64, axes: &str, more: &str) -> SweepSpec {
    let text = format!(
        "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = {samples}\nseed = 3\n{axes}{more}"
    );
    SweepSpec::parse(&root().join("sweeps/anchored.toml"), &text).unwrap()
}

fn anchored(spec: &mut SweepSpec, precision: Precision) -> Plan {
    let plan = plan_of(spec, precision);
    let plan = with_anchors(spec, plan).unwrap();
    assert!(plan.anchors.is_some(), "no anchors");
    plan
}

/// The same rods from rest: the inputs keep their columns.
fn from_rest(plan: &Plan) -> Plan {
    let entries = plan.entries[..plan.anchors.as_ref().unwrap().entry].to_vec();
    Plan { anchors: None, entries, ..plan.clone() }
}

fn batch(plan: &Plan, spec: &SweepSpec, samples: &[u64]) -> Batch {
    let sampler = spec.sampler();
    plan.batch(samples.len(), |at, row| sampler.values(samples[at.min(samples.len() - 1)], row))
}

fn solve(device: &Device, plan: &Plan, precision: Precision, in_stages: bool, batch: &Batch) -> Solutions {
    let gpu = Gpu::new(device.clone(), plan, precision).unwrap();
    gpu.with_stages(in_stages).unwrap().solve(batch).unwrap()
}

fn apart(plan: &Plan, a: &Solutions, b: &Solutions, at: usize) -> f64 {
    let [p, q] = [a, b].map(|of| of.vector(at, Quantity::TipPosition));
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / plan.scene.total_length()
}

/// Success against success but beside folds, tip against tip; returns passes of a sample from anchors and from rest.
fn compare(name: &str, spec: &mut SweepSpec, count: u64, precision: Precision) -> Option<[f64; 2]> {
    let device = device_or_skip(name)?;
    let plan = anchored(spec, precision);
    let samples: Vec<u64> = (0..count).collect();
    let batch = batch(&plan, spec, &samples);
    let expected = solve(&device, &from_rest(&plan), precision, true, &batch);
    let mut passes = [0.0; 2];
    for in_stages in [false, true] {
        let found = solve(&device, &plan, precision, in_stages, &batch);
        let mut differing = 0;
        for at in 0..samples.len() {
            assert_ne!(found.status(at), Status::Pending, "{name}: sample {at}");
            if found.status(at).is_success() != expected.status(at).is_success() {
                let margins = [&found, &expected].map(|of| of.get(at, Quantity::StabilityMargin).abs());
                assert!(margins.iter().any(|margin| *margin < NEAR_FOLD), "{name}: sample {at}: margins {margins:?}");
                differing += 1;
            } else if found.status(at).is_success() {
                let estimate = [&found, &expected].map(|of| of.get(at, Quantity::ErrorEstimate));
                let (off, estimate) = (apart(&plan, &found, &expected, at), estimate[0].max(estimate[1]));
                assert!(off <= 2.0 * estimate, "{name}: sample {at}: tips differ by {off:.1e}, estimate {estimate:.1e}");
            }
        }
        assert!(differing <= samples.len() / 1000, "{name}: {differing} statuses");
        let mean = |of: &Solutions| (0..samples.len()).map(|at| of.get(at, Quantity::Iterations)).sum::<f64>() / count as f64;
        passes = [mean(&found), mean(&expected)];
        let solved = (0..samples.len()).filter(|at| found.status(*at).is_success()).count();
        eprintln!("{name}, {precision}: {solved} solved, {differing} differ, passes {passes:?}");
    }
    Some(passes)
}

/// Below this stability margin round-off decides whether a sample is solved.
const NEAR_FOLD: f64 = 0.03;

#[test]
fn samples_from_anchors_are_those_from_rest() {
    let Some([found, expected]) = compare("the map", &mut sweep(200_000, &currents(0.3)), 20_000, Precision::F32)
    else {
        return;
    };
    assert!(found < 0.5 * expected, "{found} passes, {expected} from rest");
    let one = axis("coil.current.y", -0.2, 0.2);
    let two = axis("proximal.rest_curvature.x", -5.0, 5.0) + &axis("proximal.youngs_modulus", 5e6, 6e6);
    let four = currents(0.3) + &axis("insertion", 0.064, 0.137);
    for (name, samples, axes) in [("one axis", 20_000, one), ("two", 20_000, two), ("four", 400_000, four)] {
        compare(name, &mut sweep(samples, &axes), 2_000, Precision::F32);
    }
    compare("the map", &mut sweep(200_000, &currents(0.3)), 2_000, Precision::F64);
}

/// Wide boxes, where equilibria from rest are torn apart between the anchors.
#[test]
fn tears_lead_to_no_other_branch() {
    let tear = axis("coil.current.x", -0.002, 0.002)
        + &axis("coil.current.y", -0.2, 0.05)
        + &axis("coil.current.z", -0.06, 0.06);
    let bent = axis("proximal.rest_curvature.x", -30.0, 30.0)
        + &axis("coil.current.y", -0.3, 0.3)
        + &axis("loads.tip_force.z", -5e-3, 5e-3);
    for (name, axes) in [("wide", currents(1.0)), ("torn", tear), ("bent", bent)] {
        compare(name, &mut sweep(60_000, &axes), 20_000, Precision::F32);
    }
}

#[test]
fn order_and_batch_change_no_bit() {
    let Some(device) = device_or_skip("order_and_batch") else { return };
    let mut spec = sweep(60_000, &currents(1.0));
    let plan = anchored(&mut spec, Precision::F32);
    let mut gpu = Gpu::new(device, &plan, Precision::F32).unwrap().with_stages(true).unwrap();
    let samples: Vec<u64> = (0..3000).collect();
    let whole = gpu.solve(&batch(&plan, &spec, &samples)).unwrap();
    let backwards: Vec<u64> = samples.iter().rev().copied().collect();
    let (cuts, mut first) = ([1, 63, 65, 257, 1000, 1614], 0);
    for count in cuts {
        let part = &backwards[first..first + count];
        let found = gpu.solve(&batch(&plan, &spec, part)).unwrap();
        for (at, sample) in part.iter().enumerate() {
            for column in 0..found.values.column_count() {
                let (a, b) = (found.values.get(at, column), whole.values.get(*sample as usize, column));
                assert_eq!(a.to_bits(), b.to_bits(), "{sample} {column}: {a} {b}");
            }
        }
        first += count;
    }
    assert_eq!(first, samples.len());
}

/// Samples that the device makes, solves from anchors and counts; some of them go the way from rest there, some with care.
#[test]
fn a_sweep_without_rows_leaves_what_its_rows_would_leave() {
    let dir = tempfile::tempdir().unwrap();
    let mut spec = sweep(1 << 24, &currents(1.0));
    let plan = anchored(&mut spec, Precision::F32);
    let shard = Shard { index: 512, count: 512 };
    let options = RunOptions { chunk: 2048, shard, ..RunOptions::new() };
    let run = |name: &str| {
        let device = device_or_skip("a_sweep_without_rows")?;
        let mut gpu =
            Gpu::new(device, &plan, Precision::F32).unwrap().with_stages(true).unwrap().with_counting(true);
        let out = dir.path().join(name);
        let summary = match name {
            "rows" => run_into(&out, &spec, &mut Rows(gpu), &options),
            _ => run_into(&out, &spec, &mut gpu, &options),
        };
        Some((summary.unwrap(), out))
    };
    let (Some(found), Some(expected)) = (run("reduced"), run("rows")) else { return };
    expect_same("anchored", &found, &expected, 0.0);
    assert!(found.0.count(Status::Ramped) > 0, "{:?}", found.0.reduction.counts);
}

fn rows(job: SweepJob) -> Table {
    let mut rows = Memory::new();
    job.run(&mut rows).unwrap();
    rows.into_table()
}

#[test]
fn sweeps_take_anchors_whatever_part_of_them_is_run() {
    if device_or_skip("sweeps_take_anchors").is_none() {
        return;
    }
    let job = |kind: BackendKind, solver: &str| {
        let request = EngineRequest::of(kind).precision(Some(Precision::F32));
        let more = format!("[solver]\ntolerance = 2e-5\n{solver}[output]\nquantities = [\"tip_position\", \"iterations\"]\n");
        let spec = sweep_with(40_000, &currents(0.3), &more);
        SweepJob::new(spec).engine(request).spot_check(None)
    };
    let told = |job: SweepJob| {
        let prepared = job.prepare(&Memory::new()).unwrap();
        assert_eq!(prepared.method().anchors, prepared.plan().anchors.is_some());
        AnchorAccount::of(prepared.plan()).map(|account| (account.points, account.usable_share))
    };
    let by_gpu = told(job(BackendKind::Gpu, ""));
    assert_eq!(by_gpu, told(job(BackendKind::Cpu, "")));
    assert_eq!(by_gpu.unwrap().0, [10, 10, 10]);
    assert_eq!(told(job(BackendKind::Gpu, "anchors = \"off\"\n")), None);

    let whole = rows(job(BackendKind::Gpu, "").limit(Some(1500)));
    let first = rows(job(BackendKind::Gpu, "").limit(Some(700)));
    assert_eq!(first, whole.select(&(0..700).collect::<Vec<_>>()));
    let shard = rows(job(BackendKind::Gpu, "").shard(Shard { index: 2, count: 2 }).part_size(Some(250)).limit(Some(1500)));
    let places: Vec<usize> = shard.numbers("sample").unwrap().iter().map(|at| *at as usize).collect();
    assert!((700..800).contains(&places.len()), "{places:?}");
    assert_eq!(shard, whole.select(&places));
    let passes = |table: &Table| table.numbers("iterations").unwrap().iter().sum::<f64>();
    let from_rest = rows(job(BackendKind::Gpu, "anchors = \"off\"\n").limit(Some(700)));
    assert!(passes(&first) < 0.6 * passes(&from_rest), "{} of {} passes", passes(&first), passes(&from_rest));
}
