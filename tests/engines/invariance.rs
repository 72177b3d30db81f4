//! What must not change an answer: the frame of the world, the unit of length, a cut through a segment.

use crate::common::check::{difference, norm};
use crate::common::golden;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{
    Matrix, Plan, PlanOptions, Profile, Quantity, Scene, Segment, SegmentKind, Solutions, Stiffness, Vector,
};
use rodsweep_bench::random::Random;

/// Round-off of f64 over some hundred steps, amplified a hundredfold near folds.
const ROUND_OFF: f64 = 1e-11;
/// A cut moves the ends of the steps: what is left is the integration error at 64 steps.
const STEPS: f64 = 1e-10;

fn solve(scene: &Scene) -> (Solutions, f64) {
    let options = PlanOptions { tolerance: 1e-12, steps: 64, ..PlanOptions::default() };
    let plan = Plan::single(scene, &[], options).expect("a valid scene");
    let batch = plan.batch(1, |_, _| {});
    let mut lanes = Cpu::new(&plan, Precision::F64).expect("supported");
    let solutions = lanes.solve(&batch).expect("solved");
    assert!(solutions.status(0).is_success(), "{}: {:?}", scene.name, solutions.status(0));
    (solutions, plan.units.length)
}

fn times(a: &Matrix, v: Vector) -> Vector {
    std::array::from_fn(|row| (0..3).map(|k| a[row][k] * v[k]).sum())
}

/// Compares tip position over length and the tip's tangent; returns the larger difference.
fn tip_error(found: &Solutions, position: Vector, tangent: Vector, length: f64) -> f64 {
    let p = difference(&found.vector(0, Quantity::TipPosition), &position) / length;
    p.max(difference(&found.vector(0, Quantity::TipTangent), &tangent))
}

#[test]
fn rotating_the_world_rotates_the_tip() {
    let mut random = Random(11);
    let mut worst = (0.0, String::new());
    for case in golden::dev() {
        let turn = random.rotation();
        let mut scene = case.scene.clone();
        let rotated = |v: Option<Vector>| v.map(|v| times(&turn, v));
        let base = case.scene.rod().base_rotation;
        let product: Matrix =
            std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| turn[r][k] * base[k][c]).sum()));
        scene.base.rotation = golden::rotation_vector(&product);
        scene.base.position = times(&turn, scene.base.position);
        scene.flux_density = times(&turn, scene.flux_density);
        scene.loads.tip_force = rotated(scene.loads.tip_force);
        scene.loads.tip_moment = rotated(scene.loads.tip_moment);
        scene.loads.distributed_force = rotated(scene.loads.distributed_force);
        let (before, length) = solve(&case.scene);
        let (after, _) = solve(&scene);
        let position = times(&turn, before.vector(0, Quantity::TipPosition));
        let tangent = times(&turn, before.vector(0, Quantity::TipTangent));
        let error = tip_error(&after, position, tangent, length);
        let margin = |s: &Solutions| s.get(0, Quantity::StabilityMargin);
        assert!((margin(&before) / margin(&after) - 1.0).abs() < 1e-8, "{}", scene.name);
        if error.is_nan() || error > worst.0 {
            worst = (error, scene.name);
        }
    }
    println!("worst {worst:?}");
    assert!(worst.0 <= ROUND_OFF, "{worst:?}");
}

/// The same rod with lengths `factor` times larger, forces and fields so that the shape is similar.
fn scaled(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    let scale = |v: &mut Vector, by: f64| v.iter_mut().for_each(|x| *x *= by);
    scale(&mut scene.base.position, factor);
    // Stiffness is kept, so that curvatures and moments fall with length, and forces with its square.
    scene.loads.tip_force.iter_mut().for_each(|f| scale(f, factor.powi(-2)));
    scene.loads.tip_moment.iter_mut().for_each(|l| scale(l, 1.0 / factor));
    scene.loads.distributed_force.iter_mut().for_each(|w| scale(w, factor.powi(-3)));
    scale(&mut scene.flux_density, 1.0 / factor);
    for segment in &mut scene.segments {
        segment.length *= factor;
        if let SegmentKind::Flexible(flexible) = &mut segment.kind {
            let Profile::Constant(rest_curvature) = &mut flexible.rest_curvature else {
                panic!("no golden scene of these has nodes")
            };
            scale(rest_curvature, 1.0 / factor);
        }
    }
    scene
}

#[test]
fn scaling_lengths_scales_the_tip() {
    for factor in [1e-3, 1.0, 1e3] {
        let mut worst = (0.0, String::new());
        for case in golden::dev() {
            let (before, length) = solve(&case.scene);
            let (after, _) = solve(&scaled(&case.scene, factor));
            let position = before.vector(0, Quantity::TipPosition).map(|x| x * factor);
            let tangent = before.vector(0, Quantity::TipTangent);
            let error = tip_error(&after, position, tangent, length * factor);
            if error.is_nan() || error > worst.0 {
                worst = (error, case.scene.name.clone());
            }
        }
        println!("{factor}: worst {worst:?}");
        assert!(worst.0 <= ROUND_OFF, "{factor}: {worst:?}");
    }
}

#[test]
fn a_cut_through_a_segment_changes_nothing() {
    let mut worst = (0.0, String::new());
    for case in golden::dev() {
        let mut scene = case.scene.clone();
        let cut = scene.segments.iter().position(|s| matches!(s.kind, SegmentKind::Flexible(_))).expect("flexible");
        let first = scene.segments[cut].clone();
        assert!(matches!(&first.kind, SegmentKind::Flexible(f) if matches!(f.stiffness, Stiffness::Direct { .. })));
        scene.segments[cut].length = 0.3 * first.length;
        let rest = Segment { name: "rest".into(), length: 0.7 * first.length, kind: first.kind };
        scene.segments.insert(cut + 1, rest);
        let (before, length) = solve(&case.scene);
        let (after, _) = solve(&scene);
        let tangent = before.vector(0, Quantity::TipTangent);
        let error = tip_error(&after, before.vector(0, Quantity::TipPosition), tangent, length);
        let moment = before.vector(0, Quantity::BaseMoment);
        let change = difference(&after.vector(0, Quantity::BaseMoment), &moment);
        assert!(change <= STEPS * norm(&moment).max(1e-9), "{}: base moment by {change:e}", scene.name);
        if error.is_nan() || error > worst.0 {
            worst = (error, scene.name);
        }
    }
    println!("worst {worst:?}");
    assert!(worst.0 <= STEPS, "{worst:?}");
}
