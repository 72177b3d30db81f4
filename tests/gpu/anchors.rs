//! Samples that start from anchors on the device are those from rest, and depend on nothing but the sweep and their index.

use crate::common::boxes::{self, axis, bent, currents, torn};
use crate::common::runs::run_into;
use crate::reduce::{Rows, expect_same, plan_of};
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::{EngineRequest, witness};
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::gpu::{Device, Gpu};
use rodsweep::model::{Anchor, AnchorAxis, Anchors, Batch, Plan, PlanAnchors, Quantity, Solutions, Status};
use rodsweep::results::AnchorAccount;
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::{Memory, RunOptions, SweepJob, with_anchors};
use rodsweep::table::Table;
use std::sync::Arc;

fn sweep(samples: u64, axes: &str) -> SweepSpec {
    boxes::sweep(samples, axes, "[output]\nformat = \"none\"\n[workspace]\nvoxel = \"2 mm\"\n")
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

/// Below this stability margin round-off decides whether a sample is solved.
const NEAR_FOLD: f64 = 0.03;

/// What came of a comparison.
struct Compared {
    /// Samples that anchors led to their row.
    certified: usize,
    /// Passes of all samples, and what they were from rest.
    passes: [f64; 2],
}

/// Each row is that from rest to the last bit, or what the CPU finds from rest in f64, or the reference where that finds
/// nothing: beside a bifurcation some paths end that others pass.
fn compare(name: &str, samples: u64, axes: &str, count: u64, kind: (Precision, bool)) -> Option<Compared> {
    let device = device_or_skip(name)?;
    let (precision, in_stages) = kind;
    let mut spec = sweep(samples, axes);
    let plan = anchored(&mut spec, precision);
    let batch = batch(&plan, &spec, &(0..count).collect::<Vec<_>>());
    let begin = std::time::Instant::now();
    let from_rest = from_rest(&plan);
    let truth = Cpu::new(&from_rest, Precision::F64).unwrap().solve(&batch).unwrap();
    let expected = solve(&device, &from_rest, precision, in_stages, &batch);
    let found = solve(&device, &plan, precision, in_stages, &batch);
    let bits = |of: &Solutions, at: usize| -> Vec<u64> {
        (0..of.values.column_count()).map(|column| of.values.get(at, column).to_bits()).collect()
    };
    let started: Vec<usize> = (0..count as usize).filter(|at| bits(&found, *at) != bits(&expected, *at)).collect();
    for at in started.iter().copied() {
        let of = |quantity: Quantity| [&found, &truth, &expected].map(|of| of.get(at, quantity));
        let (margins, passes, estimates) =
            (of(Quantity::StabilityMargin), of(Quantity::Iterations), of(Quantity::ErrorEstimate));
        let label = format!("{name}, {precision}: sample {at}, margins {margins:?}, passes {passes:?}");
        assert_eq!(found.status(at), Status::Ok, "{label}");
        let is_near = margins.iter().any(|margin| margin.abs() < NEAR_FOLD);
        let again = match truth.status(at).is_success() {
            true => None,
            false => Some(witness(&from_rest).solve(&self::batch(&from_rest, &spec, &[at as u64])).unwrap()),
        };
        let (truth, place) = again.as_ref().map_or((&truth, at), |again| (again, 0));
        if !truth.status(place).is_success() {
            assert!(is_near, "{label}: {:?}", truth.status(place));
            continue;
        }
        let (p, q) = (found.vector(at, Quantity::TipPosition), truth.vector(place, Quantity::TipPosition));
        let off = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / plan.scene.total_length();
        // The reference has no estimate, and less error than the steps of this plan.
        let most = if again.is_some() { spec.tolerance } else { 2.0 * estimates[0].max(estimates[1]) };
        assert!(off <= most, "{label}: tips differ by {off:.1e}, {estimates:?}");
        assert!((margins[0] - margins[1]).abs() < 1e-3, "{label}");
        assert!(passes[0] < 10.0, "{label}");
    }
    let sum = |of: &Solutions| (0..count as usize).map(|at| of.get(at, Quantity::Iterations)).sum::<f64>();
    let compared = Compared { certified: started.len(), passes: [sum(&found), sum(&expected)] };
    let Compared { certified, passes: [passes, all] } = compared;
    let seconds = begin.elapsed().as_secs_f64();
    eprintln!(
        "{name}, {precision}: {certified} of {count} from anchors, {passes} instead of {all} passes, {seconds:.1} s"
    );
    Some(compared)
}

#[test]
fn samples_from_anchors_are_those_from_rest() {
    let (quick, whole) = ((Precision::F32, true), (Precision::F32, false));
    let Some(Compared { certified, passes }) = compare("the map", 200_000, &currents(0.3), 8_000, whole) else {
        return;
    };
    assert!(certified > 7_200, "{certified} of 8,000 from anchors");
    assert!(passes[0] < 0.4 * passes[1], "{passes:?}");
    let one = axis("coil.current.y", -0.2, 0.2);
    let two = axis("proximal.rest_curvature.x", -5.0, 5.0) + &axis("proximal.youngs_modulus", 5e6, 6e6);
    let four = currents(0.3) + &axis("insertion", 0.064, 0.137);
    for (name, samples, axes, least, kind) in [
        ("one axis", 20_000, one, 500, whole),
        ("two", 20_000, two, 950, whole),
        ("four", 400_000, four, 650, whole),
        ("the map again", 200_000, currents(0.3), 900, quick),
    ] {
        let certified = compare(name, samples, &axes, 1_000, kind).unwrap().certified;
        assert!((least..=1_000).contains(&certified), "{name}: {certified} from anchors");
    }
}

#[test]
fn so_they_are_in_f64() {
    let Some(device) = device_or_skip("so_they_are_in_f64") else { return };
    if !device.adapter().has_f64 {
        eprintln!("SKIPPED so_they_are_in_f64: {} has none", device.adapter().name);
        return;
    }
    let map = compare("the map in f64", 200_000, &currents(0.3), 2_000, (Precision::F64, true)).unwrap();
    assert!((1_800..2_000).contains(&map.certified), "{} from anchors", map.certified);
}

/// Wide boxes, where equilibria from rest are torn apart between the anchors.
#[test]
fn tears_lead_to_no_other_branch() {
    for (name, axes, count, share) in
        [("wide", currents(1.0), 5_000, 0.7), ("torn", torn(), 2_500, 0.4), ("bent", bent(), 2_500, 0.5)]
    {
        let Some(Compared { certified, .. }) = compare(name, 60_000, &axes, count, (Precision::F32, true)) else {
            return;
        };
        assert!((share..1.0).contains(&(certified as f64 / count as f64)), "{name}: {certified} from anchors");
    }
}

/// Batches of which every sample, or none, is left, and a last workgroup that is not full.
#[test]
fn all_samples_may_be_certified_or_none() {
    let Some(device) = device_or_skip("all_samples_may_be_certified") else { return };
    let mut spec = sweep(200_000, &currents(0.3));
    let plan = anchored(&mut spec, Precision::F32);
    let solve = |plan: &Plan, batch: &Batch| solve(&device, plan, Precision::F32, false, batch);
    let first = solve(&plan, &batch(&plan, &spec, &(0..500).collect::<Vec<_>>()));
    let is_certified =
        |at: &u64| first.status(*at as usize) == Status::Ok && first.get(*at as usize, Quantity::Iterations) < 4.0;
    let certified: Vec<u64> = (0..500).filter(is_certified).take(257).collect();
    assert_eq!(certified.len(), 257);
    let rows = |of: &Solutions, at: usize| {
        (0..of.values.column_count()).map(|column| of.values.get(at, column).to_bits()).collect::<Vec<_>>()
    };
    let some = solve(&plan, &batch(&plan, &spec, &certified));
    for (at, sample) in certified.iter().enumerate() {
        assert_eq!(rows(&some, at), rows(&first, *sample as usize), "{sample}");
    }
    // Anchors as far from the samples as their coordinates can say.
    let PlanAnchors { grid, entry } = plan.anchors.clone().unwrap();
    let axes = grid.axes().iter().map(|axis| AnchorAxis { from: 5.0, ..*axis }).collect();
    let none = Anchor { m0: [0.0; 3], slopes: vec![[0.0; 3]; 3], inverse: [[0.0; 3]; 3], margin: 1.0 };
    let grid = Arc::new(Anchors::new(axes, &vec![none; grid.len()]));
    let far = Plan { anchors: Some(PlanAnchors { grid, entry }), ..plan.clone() };
    let samples: Vec<u64> = (0..257).collect();
    let found = solve(&far, &batch(&far, &spec, &samples));
    let expected = solve(&from_rest(&plan), &batch(&plan, &spec, &samples));
    for at in 0..samples.len() {
        assert_eq!(rows(&found, at), rows(&expected, at), "{at}");
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
        let mut gpu = Gpu::new(device, &plan, Precision::F32).unwrap().with_stages(true).unwrap().with_counting(true);
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
    let many = 1 << 20;
    let job = |kind: BackendKind, samples: u64, solver: &str| {
        let precision = if kind == BackendKind::Reference { Precision::F64 } else { Precision::F32 };
        let request = EngineRequest::of(kind).precision(Some(precision));
        let columns = "[output]\nquantities = [\"tip_position\", \"iterations\"]\n";
        let spec = boxes::sweep(samples, &currents(0.3), &format!("[solver]\ntolerance = 2e-5\n{solver}{columns}"));
        SweepJob::new(spec).engine(request).spot_check(None)
    };
    let told = |job: SweepJob| {
        let prepared = job.prepare(&Memory::new()).unwrap();
        assert_eq!(prepared.method().anchors, prepared.plan().anchors.is_some());
        AnchorAccount::of(prepared.plan()).map(|account| account.points)
    };
    let grid = Some(vec![25, 25, 25]);
    for (kind, samples, solver, expected) in [
        (BackendKind::Gpu, many, "", &grid),
        (BackendKind::Gpu, many, "anchors = \"off\"\n", &None),
        // It would not save what it takes.
        (BackendKind::Gpu, many / 2, "", &None),
        (BackendKind::Cpu, many, "", &grid),
        (BackendKind::Reference, many, "", &None),
    ] {
        assert_eq!(&told(job(kind, samples, solver)), expected, "{kind}, {samples}, {solver}");
    }

    let by_gpu = |solver: &str, limit: u64| job(BackendKind::Gpu, many, solver).limit(Some(limit));
    let (whole, first) = (rows(by_gpu("", 1500)), rows(by_gpu("", 700)));
    assert_eq!(first, whole.select(&(0..700).collect::<Vec<_>>()));
    let shard = rows(by_gpu("", 1500).shard(Shard { index: 2, count: 2 }).part_size(Some(250)));
    let places: Vec<usize> = shard.numbers("sample").unwrap().iter().map(|at| *at as usize).collect();
    assert!((700..800).contains(&places.len()), "{places:?}");
    assert_eq!(shard, whole.select(&places));
    let passes = |table: &Table| table.numbers("iterations").unwrap().iter().sum::<f64>();
    let from_rest = rows(by_gpu("anchors = \"off\"\n", 700));
    assert!(passes(&first) < 0.6 * passes(&from_rest), "{} of {} passes", passes(&first), passes(&from_rest));
}
