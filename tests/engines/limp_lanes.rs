//! Limp and taut rods on the CPU: multiple shooting in lanes, in both precisions.

use crate::common::check::{SMALL_COLUMN, Tolerance, check_golden};
use crate::common::golden;
use crate::common::limp::{LimpCase, LimpErrors, POSE, cases, measure};
use crate::common::root;
use crate::false_folds::asked_scenes;
use rayon::prelude::*;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::{Cpu, InstructionSet};
use rodsweep::engines::{SECOND_DERIVATIVES, cpu_f64};
use rodsweep::model::{Axis, Parameter, Plan, PlanOptions, Quantity, Scene, Sensitivity, Status, Stepper};
use rodsweep::reference::solve_rod;
use rodsweep::sweep::choose_method;
use rodsweep_bench::BenchSpec;
use rodsweep_bench::random::any_scene;
use std::sync::Mutex;

/// Of the tip position in f32. Its rotation may be off by the largest moment's rounding, which the estimate tells.
const POSITION_F32: f64 = 1e-4;

fn options(sensitivity: Sensitivity) -> PlanOptions {
    let derivative_scale = SECOND_DERIVATIVES;
    PlanOptions {
        base_moment_rows: true,
        tolerance: 1e-9,
        steps: 32,
        sensitivity,
        derivative_scale,
        ..PlanOptions::default()
    }
}

fn golden_errors(precision: Precision, sensitivity: Sensitivity) -> Vec<(LimpErrors, LimpCase)> {
    let make = |plan: &Plan| Box::new(Cpu::new(plan, precision).expect("supported")) as Box<_>;
    let measured = |case: LimpCase| (measure(&case, options(sensitivity), make), case);
    cases().into_par_iter().map(measured).collect()
}

#[test]
fn golden_scenes_in_f64() {
    for sensitivity in [Sensitivity::Reciprocity, Sensitivity::Forward] {
        let mut offenders = Vec::new();
        for (errors, case) in golden_errors(Precision::F64, sensitivity) {
            println!("{errors:?}");
            let stated = case.stated;
            // Forward columns of the base moment are cancelled to their size where they are small.
            let columns = if sensitivity == Sensitivity::Forward { 10.0 } else { 1.0 };
            if !errors.are_small(stated, columns) {
                offenders.push(format!("{errors:?}, {stated:?}"));
            }
        }
        assert!(offenders.is_empty(), "{sensitivity:?}\n{}", offenders.join("\n"));
    }
}

#[test]
fn golden_scenes_in_f32() {
    let mut offenders = Vec::new();
    for (errors, _) in golden_errors(Precision::F32, Sensitivity::Reciprocity) {
        println!("{errors:?}");
        let is_good = errors.status.is_success() && errors.position <= POSITION_F32 && errors.pose <= errors.estimate;
        let is_good = is_good && errors.J.0 <= errors.derivative_error;
        if !is_good {
            offenders.push(format!("{errors:?}"));
        }
    }
    assert!(offenders.is_empty(), "\n{}", offenders.join("\n"));
}

/// A row costs what is asked for: where that is less than all digits, its estimates tell what is left.
#[test]
fn estimates_hold_at_every_tolerance() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let make = |plan: &Plan| Box::new(Cpu::new(plan, Precision::F64).expect("supported")) as Box<_>;
        let measured = |case: &LimpCase| {
            (measure(case, PlanOptions { tolerance, ..options(Sensitivity::Auto) }, make), case.stated)
        };
        let all: Vec<_> = cases().par_iter().map(measured).collect();
        let mut offenders = Vec::new();
        for (errors, stated) in &all {
            let holds = errors.status.is_success()
                && errors.pose <= errors.estimate + stated.pose
                && errors.J.0 <= errors.derivative_error + stated.J
                && errors.estimate <= tolerance.max(1e-9)
                && errors.derivative_error <= 1e-3;
            if !holds {
                offenders.push(format!("{errors:?}"));
            }
        }
        let largest = |of: &dyn Fn(&LimpErrors) -> f64| all.iter().map(|(errors, _)| of(errors)).fold(0.0, f64::max);
        println!("{tolerance:.0e}: pose {:.1e}, columns {:.1e}", largest(&|e| e.pose), largest(&|e| e.J.0));
        assert!(offenders.is_empty(), "{tolerance:.0e}\n{}", offenders.join("\n"));
    }
}

/// The ordinary golden scenes, all by nodes.
#[test]
fn nodes_alone_find_the_golden_scenes() {
    let tolerance = Tolerance { pose: 1e-11, moment: 1e-11, jacobian: 1e-9, small_column: SMALL_COLUMN };
    let make = |plan: &Plan| Box::new(Cpu::new(plan, Precision::F64).expect("supported").by_nodes()) as Box<_>;
    assert_eq!(check_golden(&golden::dev(), options(Sensitivity::Auto), make, tolerance).len(), 60);
}

/// A rod's mesh, path and answer depend on that rod alone, whatever stands beside it in the register.
#[test]
fn neighbours_change_no_bit() {
    let case = cases().into_iter().find(|case| case.scene.name == "anisotropic_segments_3e3").expect("a golden scene");
    let weight = Parameter::DistributedForce(Axis::Z);
    let load = weight.get(&case.scene);
    let plan = Plan::new(&case.scene, &[vec![weight]], &case.parameters, options(Sensitivity::Auto));
    let plan = plan.expect("a valid plan");
    let share = |sample: usize| load * 10f64.powf(sample as f64 / 7.0 - 2.0);
    for precision in Precision::ALL {
        let mut lanes = Cpu::new(&plan, precision).expect("supported");
        let together = lanes.solve(&plan.batch(21, |sample, row| row[0] = share(sample))).expect("solved");
        for sample in 0..21 {
            let alone = lanes.solve(&plan.batch(1, |_, row| row[0] = share(sample))).expect("solved");
            assert!(alone.status(0).is_success(), "{precision}, sample {sample}: {:?}", alone.status(0));
            for column in 0..plan.output_count() {
                let (a, b) = (together.values.get(sample, column), alone.values.get(0, column));
                assert_eq!(a.to_bits(), b.to_bits(), "{precision}, sample {sample}, column {column}: {a} {b}");
            }
        }
    }
}

/// Every kind of register comes to the same tip.
#[test]
fn instruction_sets_agree() {
    for case in cases().iter().filter(|case| case.scene.name.contains("taut_30") || case.scene.name.contains("1e4")) {
        let plan = Plan::single(&case.scene, &[], options(Sensitivity::Auto)).expect("a valid plan");
        for set in InstructionSet::available() {
            let mut lanes = Cpu::with_instruction_set(&plan, Precision::F64, set).expect("available");
            let found = lanes.solve(&plan.batch(1, |_, _| {})).expect("solved");
            let tip = found.vector(0, Quantity::TipPosition);
            let apart = (0..3).map(|k| (tip[k] - case.p_tip[k]).powi(2)).sum::<f64>().sqrt();
            assert!(apart <= POSE * plan.units.length, "{}, {}: {apart}", case.scene.name, set.name());
        }
    }
}

/// Nodes take steps of their own: a pilot whose samples are all solved so tries no other stepper.
#[test]
fn the_pilot_of_limp_rods_tries_one_stepper() {
    for (name, is_limp) in [("limp", true), ("taut", true), ("weight", false)] {
        let file = root().join(format!("sweeps/bench/{name}.toml"));
        let spec = BenchSpec::read(&file).expect("a bench file").sweep;
        let options = PlanOptions { stepper: Stepper::Tp6, tolerance: 1e-3, ..PlanOptions::default() };
        let plan = Plan::new(&spec.scene, &spec.axis_parameters(), &[], options).expect("a valid plan");
        let tried = Mutex::new(Vec::new());
        let factory = |plan: &Plan| {
            tried.lock().expect("no panic").push(plan.options.stepper);
            cpu_f64(plan)
        };
        choose_method(&plan, &spec.sampler(), &[Stepper::Rk4], &factory).expect("solved");
        let tried = tried.into_inner().expect("no panic");
        assert_eq!(tried.contains(&Stepper::Rk4), !is_limp, "{name}: {tried:?}");
    }
}

/// A random scene of any terms, its loads up to thousands of times what bends it by a radian.
pub fn from_stiff_to_limp(seed: u64, number: u64) -> Scene {
    let mut scene = any_scene(seed, number * 7919);
    let factor = 10f64.powf((number % 8) as f64 / 2.0);
    let scaled = |load: Option<[f64; 3]>| load.map(|v| v.map(|x| x * factor));
    scene.loads.tip_force = scaled(scene.loads.tip_force);
    scene.loads.gravity = scaled(scene.loads.gravity);
    scene.loads.distributed_force = scaled(scene.loads.distributed_force);
    scene
}

/// From stiff to limp: what the CPU answers is what the reference finds; no fold is said where the reference goes on.
fn disagreement(number: u64) -> Option<String> {
    let scene = from_stiff_to_limp(23, number);
    let plan = Plan::single(&scene, &[], options(Sensitivity::Auto)).ok()?;
    let mut lanes = Cpu::new(&plan, Precision::F64).expect("supported");
    let found = lanes.solve(&plan.batch(1, |_, _| {})).expect("solved");
    let truth = solve_rod(&scene.rod(), &[]);
    let tip = found.vector(0, Quantity::TipPosition);
    let apart = (0..3).map(|k| (tip[k] - truth.p_tip[k]).powi(2)).sum::<f64>().sqrt() / plan.units.length;
    let (status, estimate) = (found.status(0), found.get(0, Quantity::ErrorEstimate));
    let is_wrong = status.is_success() && truth.status.is_success() && apart > 1e-7 + estimate + truth.error_estimate;
    let is_false = status == Status::Fold && truth.status.is_success();
    (is_wrong || is_false).then(|| {
        let growth = scene.rod().growth();
        let load = found.get(0, Quantity::LoadFraction);
        format!(
            "scene {number}: {status:?} at {load}, reference {:?} margin {:.3}, apart {apart:.1e}, growth {growth:.1}",
            truth.status, truth.margin
        )
    })
}

#[test]
fn random_scenes_agree_with_the_reference() {
    let found: Vec<String> = (0..96u64).into_par_iter().filter_map(disagreement).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// Of the environment variable `RODSWEEP_SCENES`.
#[test]
#[ignore = "the reference takes a tenth of a second for a scene"]
fn many_random_scenes_agree_with_the_reference() {
    let (first, end) = asked_scenes("0..3000");
    let found: Vec<String> = (first..end).into_par_iter().filter_map(disagreement).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}
