//! The host side of the GPU engine, by kernels that write recognisable values.

use rodsweep::backend::{Backend, BackendError};
use rodsweep::gpu::shader::{Kernel, Piece};
use rodsweep::gpu::testing::{Faults, device_or_skip};
use rodsweep::gpu::{Device, Gpu, adapters, self_test};
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Solutions, Status, Stepper, Tableau};

/// Writes what it reads: tip force as position, flux density as moment, rates as derivatives.
const ECHO: &str = "
@compute @workgroup_size(WORKGROUP)
fn echo(@builtin(global_invocation_id) id: vec3<u32>) {
    if !select_sample(id.x) { return; }
    store_vector(0u, tip_force());
    store_vector(3u, base_d1());
    store_vector(6u, base_t());
    store_vector(9u, flux_density());
    store_vector(12u, dipole_1());
    store_vector(15u, rest_curvature_2());
    for (var row = 0u; row < 9u; row++) {
        store(LOAD_FRACTION_ERROR_COLUMN + 1u + row, rate_0_0());
        store(LOAD_FRACTION_ERROR_COLUMN + 10u + row, rate_1_0());
    }
    store_status(STATUS_RAMPED);
}
";

const TABLEAUX: &str = "
const STAGES: u32 = 1u; //@spec
const A: array<array<array<f32, 1>, 1>, 1> = array<array<array<f32, 1>, 1>, 1>(); //@spec
const B: array<array<f32, 1>, 1> = array<array<f32, 1>, 1>(); //@spec
";

/// One step of y' = y from 1 over a unit, by the plan's tableau.
const GROWTH: &str = "
@compute @workgroup_size(WORKGROUP)
fn growth(@builtin(global_invocation_id) id: vec3<u32>) {
    if !select_sample(id.x) { return; }
    var k: array<f32, STAGES>;
    var sum = 1.0 + f32(settings.zero);
    let start = sum;
    for (var r = LAST; r < TABLEAU_COUNT; r++) { //@unroll
        for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
            var y_i = start;
            for (var j = 0u; j < i; j++) { //@unroll
                //@if A[r][i][j]
                y_i += A[r][i][j] * k[j];
                //@end
            } //@end
            k[i] = y_i;
            //@if B[r][i]
            sum += B[r][i] * y_i;
            //@end
        } //@end
    } //@end
    store(12u, sum);
    store_status(STATUS_OK);
}
";

const NOT_ALL: &str = "
@compute @workgroup_size(WORKGROUP)
fn not_all(@builtin(global_invocation_id) id: vec3<u32>) {
    if !select_sample(id.x) { return; }
    if id.x != 77u { store_status(STATUS_OK); }
}
";

const ONLY_ONCE: &str = "
@compute @workgroup_size(WORKGROUP)
fn only_once(@builtin(global_invocation_id) id: vec3<u32>) {
    if !select_sample(id.x) { return; }
    if settings.mark == 16.0 { store_status(STATUS_OK); }
}
";

const BROKEN: &str = "
@compute @workgroup_size(WORKGROUP)
fn broken(@builtin(global_invocation_id) id: vec3<u32>) {
    let force: f32 = tip_force();
}
";

fn plan() -> Plan {
    let scene = crate::common::scenes::catheter();
    let axes = crate::common::scenes::parameters(
        &scene,
        &["base.position.y", "coil.current", "loads.tip_force", "distal.length"],
    );
    let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
    let wrt = crate::common::scenes::parameters(&scene, &["coil.current.x", "loads.tip_force.z"]);
    Plan::new(&scene, &axes, &wrt, PlanOptions::default()).unwrap()
}

fn kernel(entry_point: &'static str, text: &'static str, plan: &Plan) -> Kernel {
    let piece = Piece { name: format!("tests/{entry_point}.wgsl").into(), text: text.into() };
    Kernel::custom(entry_point, &[piece], plan).unwrap()
}

/// Every sample different, the same whichever batch it is in; the last axis is a length.
fn batch(plan: &Plan, first: usize, sample_count: usize) -> Batch {
    let length = |sample: usize| if sample % 1000 == 5 { -1.0 } else { 0.033 };
    plan.batch(sample_count, |sample, row| {
        let last = row.len() - 1;
        for (axis, value) in row.iter_mut().enumerate() {
            *value = 1e-3 * (((first + sample) * (axis + 3)) % 1999) as f64 - 0.7;
        }
        row[last] = length(first + sample);
    })
}

fn expect_echo(plan: &Plan, batch: &Batch, solutions: &Solutions) {
    let units = &plan.units;
    let close = |found: f64, expected: f64| (found - expected).abs() <= 2e-7 * expected.abs().max(1e-6);
    for sample in 0..batch.sample_count() {
        if batch.bad[sample] {
            assert_eq!(solutions.status(sample), Status::BadParameter);
            assert!(solutions.get(sample, Quantity::Residual).is_nan());
            continue;
        }
        let rod = plan.sample_rod(batch, sample);
        assert_eq!(solutions.status(sample), Status::Ramped);
        let position = solutions.vector(sample, Quantity::TipPosition);
        let moment = solutions.vector(sample, Quantity::BaseMoment);
        for axis in 0..3 {
            let base = rod.base_position[axis];
            let expected = rod.tip_force[axis] / units.force * units.length;
            assert!(close(position[axis] - base, expected), "{sample} {axis}: {} {expected}", position[axis] - base);
            assert!(close(moment[axis], rod.flux_density[axis] / units.field * units.moment()));
        }
        let rate = 30.0 * 7e-6 / units.dipole();
        for row in 0..9 {
            let unit = [units.length, 1.0, units.moment()][row / 3];
            assert!(close(solutions.derivative(sample, 0, row), rate * unit));
            assert!(close(solutions.derivative(sample, 1, row), unit / units.force));
        }
    }
}

fn gpu(device: Device, entry_point: &'static str, text: &'static str) -> Gpu {
    let plan = plan();
    Gpu::with_kernel(device, &plan, &kernel(entry_point, text, &plan)).unwrap()
}

#[test]
fn values_survive_the_round_trip() {
    let Some(device) = device_or_skip("values_survive_the_round_trip") else { return };
    let mut gpu = gpu(device, "echo", ECHO);
    for sample_count in [1, 255, 256, 257, 3000] {
        let batch = batch(gpu.plan(), 0, sample_count);
        let solutions = gpu.solve(&batch).unwrap();
        expect_echo(gpu.plan(), &batch, &solutions);
    }
    assert_eq!(gpu.solve(&batch(gpu.plan(), 0, 0)).unwrap().sample_count(), 0);
}

#[test]
fn a_large_batch_is_cut_into_dispatches_without_a_trace() {
    let Some(device) = device_or_skip("a_large_batch_is_cut_into_dispatches_without_a_trace") else { return };
    let mut gpu = gpu(device, "echo", ECHO);
    let sample_count = 150_000 + 13;
    let whole = gpu.solve(&batch(gpu.plan(), 0, sample_count)).unwrap();
    assert!(gpu.timings().dispatch_count > 2, "{:?}", gpu.timings());
    let first = 100_000;
    let part = gpu.solve(&batch(gpu.plan(), first, 1000)).unwrap();
    for sample in 0..1000 {
        for column in 0..whole.values.column_count() {
            let (a, b) = (whole.values.get(first + sample, column), part.values.get(sample, column));
            assert_eq!(a.to_bits(), b.to_bits(), "{sample} {column}");
        }
    }
    eprintln!("{} batch size {} {:?}", gpu.info(), gpu.batch_size(), gpu.timings());
    let timings = *gpu.timings();
    assert_eq!(timings.sample_count, sample_count as u64 + 1000);
    let named = Backend::timings(&gpu);
    assert_eq!(named.iter().find(|(name, _)| *name == "kernel"), Some(&("kernel", timings.kernel)));
    // Without timestamps copies are part of the kernel's time.
    let timed =
        |(name, seconds): &(&str, f64)| *seconds > 0.0 || *name == "copy" && !gpu.device().adapter().has_timestamps;
    let (of_kernels, others): (Vec<_>, Vec<_>) = named.into_iter().partition(|(name, _)| name.starts_with("kernel_"));
    assert!(others.iter().all(timed), "{others:?}");
    let of_kernels: Vec<_> =
        of_kernels.into_iter().filter(|(_, seconds)| *seconds > 0.0).map(|(name, _)| name).collect();
    assert!(!gpu.device().adapter().has_timestamps || of_kernels == ["kernel_whole"], "{of_kernels:?}");
}

/// What the kernel `growth` computes, in f64.
fn growth_of(tableau: &Tableau) -> f64 {
    let mut k: Vec<f64> = Vec::new();
    for i in 0..tableau.b.len() {
        k.push(1.0 + (0..i).map(|j| tableau.a[i][j] * k[j]).sum::<f64>());
    }
    1.0 + tableau.b.iter().zip(&k).map(|(b, k)| b * k).sum::<f64>()
}

#[test]
fn tableaux_reach_the_device() {
    for stepper in Stepper::ALL {
        let Some(device) = device_or_skip("tableaux_reach_the_device") else { return };
        let options = PlanOptions { stepper, ..PlanOptions::default() };
        let plan = plan().with_options(options);
        let step = Piece { name: "tests/tableaux.wgsl".into(), text: TABLEAUX.into() };
        let last = if stepper == Stepper::Rk4 { "0u" } else { "1u" };
        let growth = Piece { name: "tests/growth.wgsl".into(), text: GROWTH.replace("LAST", last).into() };
        let kernel = Kernel::custom("growth", &[step, growth], &plan).unwrap();
        let mut gpu = Gpu::with_kernel(device, &plan, &kernel).unwrap();
        let solutions = gpu.solve(&batch(&plan, 0, 300)).unwrap();
        let expected = growth_of(stepper.tableau());
        for sample in (0..300).filter(|sample| sample % 1000 != 5) {
            let found = solutions.get(sample, Quantity::Residual);
            // Stages with weights up to 43 round to 43 half-ulps: f32 by hand is off by 3.1e-6 as well.
            assert!((found - expected).abs() < 5e-6, "{stepper:?}: {found} instead of {expected}");
        }
    }
}

#[test]
fn samples_left_unwritten_are_noticed() {
    if device_or_skip("samples_left_unwritten_are_noticed").is_none() {
        return;
    }
    // One block a dispatch, whatever time that takes.
    let faults = Faults { most_workgroups: Some(4), ..Faults::default() };
    let device = Device::open_with_faults(None, faults).expect("it was there before");
    let mut gpu = gpu(device, "not_all", NOT_ALL);
    gpu.solve(&batch(gpu.plan(), 0, 77)).unwrap();
    let error = gpu.solve(&batch(gpu.plan(), 0, 9000)).unwrap_err();
    assert!(error.to_string().contains("left 1 of 256 samples unwritten"), "{error}");
    gpu.solve(&batch(gpu.plan(), 0, 77)).unwrap();
}

#[test]
fn rows_of_an_earlier_dispatch_are_noticed() {
    let Some(device) = device_or_skip("rows_of_an_earlier_dispatch_are_noticed") else { return };
    let mut gpu = gpu(device, "only_once", ONLY_ONCE);
    let batch = batch(gpu.plan(), 0, 100);
    gpu.solve(&batch).unwrap();
    let error = gpu.solve(&batch).unwrap_err();
    assert!(error.to_string().contains("left 100 of 100 samples unwritten"), "{error}");
}

#[test]
fn a_broken_kernel_is_reported_at_its_line() {
    let Some(device) = device_or_skip("a_broken_kernel_is_reported_at_its_line") else { return };
    let plan = plan();
    let error = Gpu::with_kernel(device, &plan, &kernel("broken", BROKEN, &plan)).err().unwrap();
    assert!(error.to_string().contains("tests/broken.wgsl:4: "), "{error}");
}

#[test]
fn a_lost_device_is_opened_again_once() {
    let Some(_) = device_or_skip("a_lost_device_is_opened_again_once") else { return };
    let device = Device::open().expect("it was there before");
    let mut gpu = gpu(device, "echo", ECHO);
    let samples = batch(gpu.plan(), 0, 5000);
    // Bad samples hold NaN.
    let bits = |s: &Solutions| s.values.data().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let before = gpu.solve(&samples).unwrap();
    gpu.device().destroy();
    assert_eq!(bits(&gpu.solve(&samples).unwrap()), bits(&before));
    let notes = gpu.take_notes();
    assert!(notes.len() == 1 && notes[0].contains("opened again"), "{notes:?}");
    gpu.device().destroy();
    let error = gpu.solve(&samples).unwrap_err();
    assert!(matches!(error, BackendError::DeviceFailed { .. }), "{error}");
    assert!(gpu.solve(&samples).is_err());
    assert_eq!(gpu.take_notes(), [""; 0]);
}

#[test]
fn clones_of_a_device_share_its_loss_and_are_opened_again_each() {
    if device_or_skip("clones_of_a_device").is_none() {
        return;
    }
    let device = Device::open().expect("it was there before");
    let (mut one, mut other) = (gpu(device.clone(), "echo", ECHO), gpu(device, "echo", ECHO));
    let samples = batch(one.plan(), 0, 500);
    let bits = |s: &Solutions| s.values.data().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let before = bits(&one.solve(&samples).unwrap());
    one.device().destroy();
    for engine in [&mut other, &mut one] {
        assert_eq!(bits(&engine.solve(&samples).unwrap()), before);
        assert_eq!(engine.take_notes().len(), 1);
    }
}

#[test]
fn an_adapter_can_be_named() {
    let Some(device) = device_or_skip("an_adapter_can_be_named") else { return };
    let name = device.adapter().name.to_uppercase();
    assert_eq!(Device::open_named(Some(&name)).unwrap().adapter().name, device.adapter().name);
    let error = Device::open_named(Some("no such adapter")).unwrap_err();
    assert!(matches!(error, BackendError::NoDevice { .. }));
    assert!(error.to_string().contains(&device.adapter().name), "{error}");
}

#[test]
fn the_self_test_passes() {
    let Some(device) = device_or_skip("the_self_test_passes") else { return };
    for adapter in adapters() {
        eprintln!("{adapter}\n{adapter:#?}");
    }
    let result = self_test(&device).unwrap();
    eprintln!("{result}");
    assert!(result.passed(), "{result}");
}
