//! Several devices solve a sweep together: the rows are those of one, also where one of them fails.

use crate::common::root;
use rodsweep::backend::{Backend, Precision, ReduceJob, Reduced};
use rodsweep::gpu::testing::{Faults, device_or_skip};
use rodsweep::gpu::{Device, Fleet, Gpu};
use rodsweep::model::{Plan, PlanOptions, Quantity, Solutions, Stepper};
use rodsweep::spec::SweepSpec;
use std::collections::HashMap;

const SAMPLES: usize = 3000;
const TOLERANCE: f64 = 2e-5;

const SWEEP: &str = r#"
scene = "scenes/p6.toml"
[sampling]
method = "uniform"
samples = 3000
[[axis]]
parameter = "coil.current.x"
from = "-0.3 A"
to = "0.3 A"
[[axis]]
parameter = "loads.tip_force.x"
from = "-0.12 N"
to = "0.04 N"
[output]
format = "none"
derivatives = ["coil.current"]
[workspace]
voxel = "2 mm"
"#;

fn spec() -> SweepSpec {
    let file = root().join("sweeps/fleet.toml");
    SweepSpec::parse(&file, SWEEP).expect("the sweep reads")
}

fn plan(spec: &SweepSpec) -> Plan {
    let options = PlanOptions { stepper: Stepper::Rk4, steps: 16, tolerance: TOLERANCE, ..PlanOptions::default() };
    spec.plan(options).expect("it plans")
}

/// The same adapter opened several times, each failing as planned; `None` without a GPU.
fn gpus(plan: &Plan, faults: &[Faults]) -> Option<Vec<Gpu>> {
    device_or_skip("several GPUs")?;
    let open = |faults: &Faults| {
        let device = Device::open_with_faults(None, faults.clone()).expect("it was there before");
        Gpu::new(device, plan, Precision::F32).expect("starts").with_counting(true)
    };
    Some(faults.iter().map(open).collect())
}

/// Few workgroups, so that there are many dispatches.
fn losing(lost_at: &[u64]) -> Faults {
    Faults { lost_at: lost_at.into(), most_workgroups: Some(4), ..Faults::default() }
}

fn bits(solutions: &Solutions) -> Vec<u64> {
    solutions.values.data().iter().map(|x| x.to_bits()).collect()
}

#[test]
fn rows_are_those_of_one_device() {
    let spec = spec();
    let (plan, sampler) = (plan(&spec), spec.sampler());
    let batch = plan.batch(SAMPLES, |at, row| sampler.values(at as u64 % SAMPLES as u64, row));
    let Some(mut one) = gpus(&plan, &[losing(&[])]) else { return };
    let expected = bits(&one[0].solve(&batch).expect("solves"));
    // What fails, and how many devices are left.
    for (name, faults, left) in [
        ("none fails", [losing(&[]), losing(&[]), losing(&[])], 3),
        ("one is lost once", [losing(&[]), losing(&[2]), losing(&[])], 3),
        ("one is lost twice", [losing(&[]), losing(&[2, 5]), losing(&[])], 2),
        ("two are lost twice", [losing(&[3, 6]), losing(&[2, 5]), losing(&[])], 1),
    ] {
        let Some(gpus) = gpus(&plan, &faults) else { return };
        let mut fleet = Fleet::of(gpus).expect("some");
        assert_eq!(fleet.batch_size(), 3 * one[0].batch_size());
        // Once with equal shares, then by what each has shown.
        for round in 0..2 {
            assert!(bits(&fleet.solve(&batch).expect("solves")) == expected, "{name}, round {round}");
        }
        let notes = fleet.take_notes();
        assert_eq!(notes.iter().filter(|note| note.contains("drops out")).count(), 3 - left, "{notes:?}");
        let reopened = faults.iter().filter(|faults| !faults.lost_at.is_empty()).count();
        assert_eq!(notes.iter().filter(|note| note.contains("opened again")).count(), reopened, "{notes:?}");
        assert_eq!(fleet.info().device.starts_with(&format!("{left} x ")), left > 1, "{}", fleet.info());
        assert!(faults.iter().all(|faults| faults.counts.dispatches() > 2), "{name}: a device had nothing to do");
        assert!(fleet.timings().iter().any(|(name, seconds)| *name == "kernel" && *seconds > 0.0));
    }
    let faults = [losing(&[2, 5]), losing(&[2, 5])];
    let Some(gpus) = gpus(&plan, &faults) else { return };
    let error = Fleet::of(gpus).expect("some").solve(&batch).expect_err("none is left");
    assert!(error.to_string().contains("the device was lost"), "{error}");
}

#[test]
fn a_sweep_without_rows_is_shared_too() {
    let spec = spec();
    let (plan, sampler) = (plan(&spec), spec.sampler());
    let recipe = sampler.recipe();
    let job = ReduceJob {
        recipe: recipe.as_ref(),
        ranges: &[0..1250, 1350..SAMPLES as u64],
        voxel: spec.workspace.voxel,
        tolerance: TOLERANCE,
        wanted: &|range| range.filter(|index| index % 250 == 0).collect(),
        values: &|index, row| sampler.values(index, row),
    };
    // Successes by voxel, failures, and samples in all, whichever device counted them.
    let counted = |backend: &mut dyn Backend| {
        let (mut cells, mut statuses, mut on_device) = (HashMap::new(), HashMap::new(), 0);
        let reduced = backend.reduce(&job, &mut |rows| {
            on_device += rows.counted.iter().sum::<u64>();
            for row in 0..rows.indices.len() {
                let status = rows.solutions.status(row);
                *statuses.entry(status).or_insert(0) += 1;
                if status.is_success() {
                    let tip = rows.solutions.vector(row, Quantity::TipPosition);
                    *cells.entry(tip.map(|x| (x / spec.workspace.voxel).floor() as i32)).or_insert(0) += 1;
                }
            }
            true
        });
        let Ok(Some(Reduced::Voxels(voxels))) = reduced else { panic!("{reduced:?}") };
        voxels.into_iter().for_each(|(cell, count)| *cells.entry(cell).or_insert(0) += count);
        assert!(on_device > SAMPLES as u64 / 6, "{on_device}");
        let failed: u64 = statuses.iter().filter(|(status, _)| !status.is_success()).map(|(_, count)| count).sum();
        (cells, failed, statuses.values().sum::<u64>() + on_device)
    };
    let Some(mut one) = gpus(&plan, &[losing(&[])]) else { return };
    let expected = counted(&mut one[0]);
    assert_eq!(expected.2, SAMPLES as u64 - 100);
    for faults in [[losing(&[]), losing(&[])], [losing(&[]), losing(&[12])]] {
        let Some(gpus) = gpus(&plan, &faults) else { return };
        let mut fleet = Fleet::of(gpus).expect("some");
        assert!(counted(&mut fleet) == expected, "{faults:?}");
        assert!(faults.iter().all(|faults| faults.counts.dispatches() > 8), "{faults:?}");
        assert_eq!(fleet.take_notes().len() as u64, faults[1].counts.losses());
    }
}
