//! Samples made on the device are those of the host; a sweep without rows leaves what its rows would leave.

use crate::common::day::is_of_today;
use crate::common::root;
use crate::common::runs::run_into;
use rodsweep::backend::{Backend, BackendError, BackendInfo, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::shader::Generator;
use rodsweep::gpu::testing::{device_or_skip, generate_inputs};
use rodsweep::model::{Batch, Entry, Plan, PlanOptions, Quantity, Solutions, Status, Stepper};
use rodsweep::results::{SampleOrigin, TIPS_FILE, WORKSPACE_FILE};
use rodsweep::spec::{AxisSpec, Shard, SweepSpec};
use rodsweep::sweep::{RunOptions, Summary};
use std::fs;
use std::path::PathBuf;

/// Currents of both signs, one pair coupled, the insertion, and a force.
const AXES: [(&str, &str, &str, u64); 4] = [
    ("\"coil.current.x\"", "-0.3 A", "0.3 A", 19),
    ("\"insertion\"", "90 mm", "130 mm", 4),
    ("\"coil.current.y\", \"coil.current.z\"", "-0.25 A", "0.1 A", 13),
    ("\"loads.tip_force.x\", \"loads.tip_force.z\"", "-0.12 N", "0.04 N", 3),
];

fn spec(method: &str, samples: u64, seed: u64) -> SweepSpec {
    let mut text = format!("scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"{method}\"\nseed = {seed}\n");
    if method != "grid" {
        text += &format!("samples = {samples}\n");
    }
    for (names, from, to, points) in AXES {
        text += &format!("[[axis]]\nparameters = [{names}]\nfrom = \"{from}\"\nto = \"{to}\"\n");
        if method == "grid" {
            text += &format!("points = {points}\n");
        }
    }
    text += "[output]\nformat = \"none\"\n[workspace]\nvoxel = \"2 mm\"\n";
    let file = root().join("sweeps/reduced.toml");
    SweepSpec::parse(&file, &text).unwrap()
}

/// A plan that meets the tolerance in all but a few samples.
pub fn plan_of(spec: &mut SweepSpec, precision: Precision) -> Plan {
    let (stepper, steps, tolerance) = match precision {
        Precision::F32 => (Stepper::Rk4, 16, 1e-4),
        Precision::F64 => (Stepper::Dop853, 6, 1e-6),
    };
    spec.tolerance = tolerance;
    spec.plan(PlanOptions { stepper, steps, ..PlanOptions::default() }).unwrap()
}

/// Inputs as the host would upload them.
fn uploaded(plan: &Plan, batch: &Batch, precision: Precision, sample: usize, column: usize) -> f64 {
    let units = plan.entry_units();
    let entry = plan.entries.iter().position(|entry| *entry == Entry::Varying(column)).unwrap();
    let value = batch.inputs.get(sample, column) / units[entry];
    if precision == Precision::F32 { f64::from(value as f32) } else { value }
}

#[test]
fn samples_made_on_the_device_are_those_of_the_host() {
    let many = 1 << 40;
    let cases = [
        ("grid", 0, vec![0, 2500]),
        ("uniform", many, vec![0, (1 << 32) - 500, many - 6000]),
        ("sobol", 1 << 32, vec![0, 1 << 31, (1 << 32) - 6000]),
        ("latin_hypercube", 1, vec![0]),
        ("latin_hypercube", 20_001, vec![0, 14_001]),
        ("latin_hypercube", 1 << 20, vec![(1 << 20) - 6000]),
        ("latin_hypercube", many, vec![0, many - 6000]),
    ];
    let Some(device) = device_or_skip("samples_made_on_the_device") else { return };
    for precision in [Precision::F32, Precision::F64] {
        // Every method varies the same inputs.
        let plan = plan_of(&mut spec("grid", 0, 7), precision);
        let mut gpu = Gpu::new(device.clone(), &plan, precision).unwrap();
        for (method, samples, firsts) in &cases {
            let spec = spec(method, *samples, 7);
            let sampler = spec.sampler();
            let generator = Generator::new(&plan, &sampler.recipe().unwrap()).unwrap();
            let ends = plan.batch(2, |at, row| {
                let end = |axis: &AxisSpec| {
                    axis.distribution.limits().map_or(0.0, |(from, to)| if at == 0 { from } else { to })
                };
                row.iter_mut().zip(&spec.axes).for_each(|(value, axis)| *value = end(axis));
            });
            for first in firsts {
                let count = (spec.sample_count - first).min(6000) as usize;
                let made = generate_inputs(&mut gpu, &generator, *first, count).unwrap();
                let batch = plan.batch(count, |at, row| sampler.values(first + (at % count) as u64, row));
                for column in 0..plan.input_count {
                    let at_end = |at: usize| uploaded(&plan, &ends, Precision::F64, at, column).abs();
                    let (largest, mut differing) = (at_end(0) + at_end(1), Vec::new());
                    for sample in 0..count {
                        let expected = uploaded(&plan, &batch, precision, sample, column);
                        if made.get(sample, column).to_bits() != expected.to_bits() {
                            differing.push((sample, made.get(sample, column), expected));
                        }
                    }
                    let name = format!("{precision} {method} of {samples} from {first}, column {column}");
                    match (precision, *method) {
                        (Precision::F32, _) | (_, "grid") => assert!(differing.is_empty(), "{name}: {differing:?}"),
                        // The host rounds after each step of its formula.
                        _ => {
                            let far = |(_, a, b): &&(usize, f64, f64)| (a - b).abs() > 4.0 * f64::EPSILON * largest;
                            assert_eq!(differing.iter().find(far), None, "{name}");
                        }
                    }
                }
            }
        }
    }
}

/// The same engine without its own way to reduce.
pub struct Rows(pub Gpu);

impl Backend for Rows {
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
        self.0.solve(batch)
    }
}

fn second(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::new(plan, Precision::F64)?))
}

/// What came of a run, and where its files lie.
pub type Run = (Summary, PathBuf);

/// The same to the last bit, or where samples are made in f64 but for rounding [m].
pub fn expect_same(name: &str, (found, in_found): &Run, (expected, in_expected): &Run, rounding: f64) {
    assert_eq!((&found.origin, &expected.origin), (&SampleOrigin::Device, &SampleOrigin::Host), "{name}");
    let (a, b) = (&found.reduction, &expected.reduction);
    assert_eq!(a.counts, b.counts, "{name}");
    let [a_ends, b_ends] = [a, b].map(|reduction| reduction.extents.unwrap().concat());
    let differs = |(a, b): &(&f64, &f64)| (**a - **b).abs() > rounding;
    assert_eq!(a_ends.iter().zip(&b_ends).find(differs), None, "{name}");
    assert!(a.voxels == b.voxels, "{name}: {} and {} voxels", a.voxels.len(), b.voxels.len());
    assert_eq!((a.sample_count, found.solved), (b.sample_count, expected.solved), "{name}");
    if rounding != 0.0 {
        return;
    }
    assert_eq!(
        (found.worst_residual, found.worst_error_estimate, found.above_tolerance, found.attempts, found.refined),
        (
            expected.worst_residual,
            expected.worst_error_estimate,
            expected.above_tolerance,
            expected.attempts,
            expected.refined
        ),
        "{name}"
    );
    for file in [WORKSPACE_FILE, TIPS_FILE] {
        assert!(fs::read(in_found.join(file)).unwrap() == fs::read(in_expected.join(file)).unwrap(), "{name}: {file}");
    }
}

/// One of three methods each day.
#[test]
fn a_reduced_sweep_leaves_what_its_rows_would_leave() {
    let Some(device) = device_or_skip("a_reduced_sweep") else { return };
    let dir = tempfile::tempdir().unwrap();
    // Of a large sweep few tips are kept, so that most samples are counted without a row; its last part is cut short.
    let (large, last) = (1 << 24, Shard { index: 512, count: 512 });
    let methods = [
        ("grid", 0, None, Shard::WHOLE, Precision::F32),
        ("sobol", large, Some(large - 1000), last, Precision::F32),
        ("latin_hypercube", 4000, None, Shard::WHOLE, Precision::F64),
    ];
    for (number, (method, samples, limit, shard, precision)) in methods.into_iter().enumerate() {
        if !is_of_today(number, 3) {
            continue;
        }
        let mut spec = spec(method, samples, 3);
        let plan = plan_of(&mut spec, precision);
        let one = |name: &str, shard: Shard, limit: Option<u64>| {
            let mut gpu =
                Gpu::new(device.clone(), &plan, precision).unwrap().with_stages(true).unwrap().with_counting(true);
            let out = dir.path().join(format!("{method}-{name}-{}", shard.index));
            let mut options = RunOptions { chunk: 2048, shard, limit, ..RunOptions::new() };
            if method == "grid" {
                options.refiners = vec![&second];
            }
            let summary = match name {
                "rows" => run_into(&out, &spec, &mut Rows(gpu), &options),
                _ => run_into(&out, &spec, &mut gpu, &options),
            };
            (summary.unwrap(), out)
        };
        let found = one("reduced", shard, limit);
        let expected = one("rows", shard, limit);
        expect_same(method, &found, &expected, if precision == Precision::F32 { 0.0 } else { 1e-12 });
        if method == "sobol" {
            let (kept, all) = (found.0.reduction.tips.row_count() as u64, found.0.solved);
            assert!(found.0.failed() > 0 && 0 < kept && kept < all / 10, "{kept} of {all} kept");
        }
        eprintln!("{method}: {:?}, {} again", found.0.reduction.counts, found.0.attempts);
        if method == "grid" {
            let shard = Shard { index: 2, count: 2 };
            let (found, expected) = (one("reduced", shard, Some(3001)), one("rows", shard, Some(3001)));
            expect_same("a shard", &found, &expected, 0.0);
            assert!(found.0.count(Status::Ramped) > 0);
        }
    }
}

#[test]
fn samples_that_cannot_be_made_on_the_device_are_uploaded_and_that_is_said() {
    let Some(device) = device_or_skip("samples_that_cannot_be_made") else { return };
    let text = "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 500\n[[axis]]\n\
                parameter = \"base.rotation.x\"\nfrom = 0\nto = 1\n[output]\nformat = \"none\"\n";
    let file = root().join("sweeps/reduced.toml");
    let mut spec = SweepSpec::parse(&file, text).unwrap();
    let plan = plan_of(&mut spec, Precision::F32);
    let dir = tempfile::tempdir().unwrap();
    let mut gpu = Gpu::new(device, &plan, Precision::F32).unwrap().with_counting(true);
    let summary = run_into(&dir.path().join("out"), &spec, &mut gpu, &RunOptions::new()).unwrap();
    let reason = "an input is no linear function of the axes".to_owned();
    assert_eq!(summary.origin, SampleOrigin::HostBecause(reason.clone()));
    assert_eq!(summary.solved, 500);
    let manifest = fs::read_to_string(dir.path().join("out/manifest.json")).unwrap();
    assert!(manifest.contains(&format!("\"samples_made\": \"host: {reason}\"")), "{manifest}");
}

/// Two coils, whose loads have folds: many samples need the guarded ramp, some fail.
#[test]
fn stragglers_have_the_rows_they_would_have_among_others() {
    for precision in [Precision::F32, Precision::F64] {
        let file = root().join("tests/data/jumps/two_coil_six.toml");
        let mut spec = SweepSpec::parse(&file, &fs::read_to_string(&file).unwrap()).unwrap();
        let plan = plan_of(&mut spec, precision);
        let sampler = spec.sampler();
        let Some(device) = device_or_skip("stragglers_have_the_rows") else { return };
        if precision == Precision::F64 && !device.adapter().has_f64 {
            continue;
        }
        let batch = plan.batch(3000, |at, row| sampler.values(at as u64 % spec.sample_count, row));
        let mut in_stages = Gpu::new(device.clone(), &plan, precision).unwrap().with_stages(true).unwrap();
        let whole = in_stages.solve(&batch).unwrap();
        let rungs = in_stages.rungs();
        let [load_steps, guarded] = &rungs[..] else { panic!("{rungs:?}") };
        assert_eq!((load_steps.samples, load_steps.left), (3000, guarded.samples));
        assert!(0 < guarded.samples && guarded.samples < 3000, "{rungs:?}");
        assert!((0..3000).all(|sample| whole.status(sample) != Status::Pending));
        let mut in_one_stage = Gpu::new(device, &plan, precision).unwrap().with_stages(false).unwrap();
        let together = in_one_stage.solve(&batch).unwrap();
        // Another kernel rounds differently: beside a fold that may decide what becomes of a sample.
        let same = (0..3000).filter(|sample| whole.status(*sample) == together.status(*sample));
        let same = same.inspect(|sample| {
            let tip = |solutions: &Solutions| solutions.vector(*sample, Quantity::TipPosition);
            let apart = (0..3).map(|k| (tip(&whole)[k] - tip(&together)[k]).abs()).fold(0.0, f64::max);
            let near = together.get(*sample, Quantity::StabilityMargin).abs() < 0.03;
            let is_success = whole.status(*sample).is_success();
            let estimate = |solutions: &Solutions| solutions.get(*sample, Quantity::ErrorEstimate);
            let bound = match precision {
                Precision::F32 => 1e-4,
                Precision::F64 => estimate(&whole) + estimate(&together),
            };
            let is_bounded = apart <= bound * plan.units.length;
            assert!(!is_success || near || is_bounded, "{precision}: sample {sample}: {apart:.1e} m");
        });
        assert!(same.count() >= 2970, "{precision}");
        let count = |status: Status| (0..3000).filter(|sample| whole.status(*sample) == status).count();
        let solved = count(Status::Ok) + count(Status::Ramped);
        assert!(solved > 0 && solved < 3000, "{precision}: {:?}", Status::ALL.map(count));
    }
}
