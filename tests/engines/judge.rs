//! The third judge against closed forms, against numbers of a judge in another language, and what it does not know.

use crate::common::root;
use rodsweep::input::read_scene;
use rodsweep::model::{
    Axis, Base, Flexible, Loads, Parameter, Profile, Scene, Segment, SegmentKind, SegmentParameter, Stiffness,
    TipOnWall, Vector, Wall, WallShape, rotation_angle, rotation_matrix,
};
use rodsweep_bench::judge::{Word, judge};

const LENGTH: f64 = 0.1;
const EI: f64 = 2e-5;

/// A straight rod along z.
fn rod(loads: Loads) -> Scene {
    let flexible = Flexible {
        stiffness: Stiffness::Direct { bending_x: EI, bending_y: EI, torsion: 1.5e-5 },
        rest_curvature: Profile::Constant([0.0; 3]),
        stiffness_shear: None,
        stiffness_axial: None,
        density: None,
        dipole_per_length: None,
        magnet: None,
    };
    Scene {
        name: "Rod".into(),
        base: Base::default(),
        flux_density: [0.0; 3],
        sources: Default::default(),
        loads,
        segments: vec![Segment { name: "rod".into(), length: LENGTH, kind: SegmentKind::Flexible(flexible) }],
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

fn two_coils(a: Vector, b: Vector) -> Scene {
    let mut scene = read_scene(&root().join("tests/data/jumps/two_coil.scene.toml")).expect("the scene reads");
    for (segment, currents) in [(1, a), (3, b)] {
        for (axis, current) in Axis::ALL.into_iter().zip(currents) {
            let parameter = Parameter::Segment(segment, SegmentParameter::Current(axis));
            parameter.set(&mut scene, current).expect("a coil");
        }
    }
    scene
}

fn arrival(scene: &Scene) -> (Vector, rodsweep::model::Matrix) {
    match judge(&scene.rod()) {
        Word::Arrives { position, rotation, .. } => (position, rotation),
        word => panic!("{word:?}"),
    }
}

fn end(scene: &Scene) -> f64 {
    match judge(&scene.rod()) {
        Word::Ends { load } => load,
        word => panic!("{word:?}"),
    }
}

fn assert_near(found: Vector, expected: Vector, by: f64) {
    let apart = (0..3).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f64::max);
    assert!(apart <= by, "{found:?} for {expected:?}");
}

#[test]
fn a_moment_at_the_tip_bends_an_arc() {
    let turn = 1.2;
    let (position, rotation) =
        arrival(&rod(Loads { tip_moment: Some([turn * EI / LENGTH, 0.0, 0.0]), ..Loads::default() }));
    let radius = LENGTH / turn;
    assert_near(position, [0.0, -radius * (1.0 - turn.cos()), radius * turn.sin()], 1e-6);
    assert!(rotation_angle(&rotation, &rotation_matrix([turn, 0.0, 0.0])) < 1e-5);
}

#[test]
fn a_small_force_bends_a_cantilever() {
    let force = 1e-3 * EI / LENGTH.powi(2);
    let (position, _) = arrival(&rod(Loads { tip_force: Some([force, 0.0, 0.0]), ..Loads::default() }));
    assert_near(position, [force * LENGTH.powi(3) / (3.0 * EI), 0.0, LENGTH], 1e-7);
}

#[test]
fn a_wall_pushes_a_cantilever_aside() {
    let aside = 1e-3 * LENGTH;
    let (rigid, soft) = (3.0 * EI / LENGTH.powi(3), 0.5 * EI / LENGTH.powi(3));
    // Held aside, a rod that cannot stretch does not reach as far.
    let held = TipOnWall::Sticks([aside, 0.0, LENGTH]);
    let walls = [(None, TipOnWall::Slides), (Some(soft), TipOnWall::Slides), (Some(1e9 * soft), TipOnWall::Slides)];
    for (stiffness, tip) in walls.into_iter().chain([(Some(soft), held)]) {
        let mut scene = rod(Loads::default());
        scene.wall = Some(Wall {
            shape: WallShape::Plane { normal: [1.0, 0.0, 0.0] },
            position: [aside, 0.0, 0.0],
            rotation: [0.0; 3],
            tip_radius: 0.0,
            stiffness,
            friction: None,
            tip,
        });
        let Word::Arrives { position, force, .. } = judge(&scene.rod()) else { panic!("{stiffness:?}, {tip:?}") };
        let expected = aside / (1.0 / rigid + stiffness.map_or(0.0, |stiffness| 1.0 / stiffness));
        assert!((force[0] / expected - 1.0).abs() < 1e-4, "{stiffness:?}, {tip:?}: {force:?} for {expected}");
        assert!((position[0] - expected / rigid).abs() < 1e-4 * aside, "{stiffness:?}, {tip:?}: {position:?}");
    }
}

#[test]
fn a_column_ends_at_the_load_of_euler() {
    let buckling = (std::f64::consts::FRAC_PI_2 / LENGTH).powi(2) * EI;
    let pressed = |times: f64| rod(Loads { tip_force: Some([0.0, 0.0, -times * buckling]), ..Loads::default() });
    assert!((end(&pressed(1.6)) * 1.6 - 1.0).abs() < 1e-4);
    assert_near(arrival(&pressed(0.9)).0, [0.0, 0.0, LENGTH], 1e-9);
    // Pushed aside by a millionth of the load it bends away and goes on.
    let mut aside = pressed(1.6);
    aside.loads.tip_force = Some([1e-6 * buckling, 0.0, -1.6 * buckling]);
    assert!(arrival(&aside).0[0] > 0.5 * LENGTH);
}

#[test]
fn a_pulled_rod_stretches() {
    let mut scene = rod(Loads { tip_force: Some([0.0, 0.0, 0.02]), ..Loads::default() });
    let SegmentKind::Flexible(flexible) = &mut scene.segments[0].kind else { unreachable!() };
    flexible.stiffness_axial = Some(0.5);
    assert_near(arrival(&scene).0, [0.0, 0.0, 1.04 * LENGTH], 1e-9);
}

#[test]
fn pure_twist_is_two_angles() {
    for k in 0..200 {
        let (a, b) = (0.1 * (f64::from(k) * 0.7548776662).fract(), 0.1 * (f64::from(k) * 0.5698402910).fract());
        let (a, b) = (2.0 * a - 0.1, 2.0 * b - 0.1);
        let (_, rotation) = arrival(&two_coils([a, 0.0, 0.0], [b, 0.0, 0.0]));
        let truth = super::jumps::twist(a, b);
        assert!(rotation_angle(&rotation, &rotation_matrix([0.0, 0.0, truth])) < 2e-4, "{a} {b}: {truth}");
    }
}

/// By the judge of `tests/data/jumps`' authors: single shooting in small load steps, in C.
#[test]
fn another_judge_says_the_same() {
    let arrivals: [(Vector, Vector, Vector); 4] = [
        ([0.03, 0.03, 0.03], [0.05, 0.05, 0.05], [-0.00251839, 0.01276618, 0.10399499]),
        ([0.05, 0.0, 0.0], [-0.08, 0.0, 0.0], [0.0, 0.0, 0.105]),
        ([0.1, 0.02, -0.03], [-0.05, 0.08, 0.06], [0.00086956, 0.0026584, 0.10483069]),
        ([-0.09, -0.09, -0.09], [0.09, 0.09, 0.09], [-0.00421834, -0.00482697, 0.10441809]),
    ];
    for (a, b, tip) in arrivals {
        assert_near(arrival(&two_coils(a, b)).0, tip, 2e-6);
    }
    let ends: [(Vector, Vector, f64); 6] = [
        ([-0.1, -0.088, -0.057], [0.099, -0.002, 0.058], 0.394_772_5),
        ([-0.053, 0.006, 0.099], [0.067, -0.092, 0.01], 0.573_446_5),
        ([0.061, -0.018, 0.0], [-0.066, -0.053, -0.042], 0.507_239_1),
        ([0.068, -0.07, 0.078], [-0.062, -0.026, -0.001], 0.232_142_7),
        ([-0.035, -0.008, -0.091], [0.08, -0.09, -0.086], 0.920_112_1),
        ([-0.098, -0.048, 0.081], [0.099, -0.092, 0.081], 0.210_497_1),
    ];
    for (a, b, load) in ends {
        let found = end(&two_coils(a, b));
        assert!((found - load).abs() < 1e-3 * load, "{found} for {load}");
    }
}

/// By the same: rest curvature, weight, masses and a force at the tip.
#[test]
fn another_judge_says_the_same_of_every_load() {
    let cases: [(Vector, Vector, Vector); 4] = [
        ([0.061, 0.062, 0.003], [0.031, -0.07, -0.058], [0.046357485, -0.076778853, 0.003849612]),
        ([-0.043, -0.089, -0.023], [0.096, -0.061, -0.067], [0.042035682, -0.072976928, -0.011485213]),
        ([-0.018, -0.091, -0.09], [-0.097, -0.085, -0.02], [0.039714266, -0.071629081, -0.013425362]),
        ([-0.013, 0.095, 0.08], [-0.029, -0.001, -0.02], [0.015048225, -0.081996848, -0.01777838]),
    ];
    for (a, b, tip) in cases {
        let mut scene = two_coils(a, b);
        scene.loads.tip_force = Some([2e-3, 1e-3, -3e-3]);
        scene.loads.gravity = Some([0.0, -9.80665, 3.0]);
        for segment in &mut scene.segments {
            match &mut segment.kind {
                SegmentKind::Flexible(flexible) => {
                    flexible.density = Some(rodsweep::model::Density::Linear(0.002));
                    flexible.rest_curvature = Profile::Constant([10.0, -5.0, 8.0]);
                }
                SegmentKind::Rigid(rigid) => rigid.mass = Some(0.0004),
            }
        }
        assert_near(arrival(&scene).0, tip, 3e-5);
    }
}
