//! A sample alone, whose columns lie side by side in the lanes of a register, against the same among others: to the last bit.

use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::{Cpu, InstructionSet};
use rodsweep::model::{
    Coil, CoilWinding, Flexible, Loads, Node, Parameter, Plan, PlanOptions, Profile, Rigid, Scene, Segment,
    SegmentKind, Sensitivity, Solutions, Stiffness, Vector,
};

/// More than a register of any width holds.
const SAMPLES: usize = 19;

/// In A
fn currents(sample: usize) -> Vector {
    [0.11, -0.07, 0.05].map(|current| current * (1.0 + sample as f64 % 7.0) / 7.0 - 0.01 * sample as f64 / 7.0)
}

/// A catheter with a coil before its tip.
fn scene(loads: Loads, flexible: impl Fn(&mut Flexible)) -> Scene {
    let mut tube = Flexible {
        stiffness: Stiffness::Direct { bending_x: 6e-5, bending_y: 6e-5, torsion: 5e-5 },
        rest_curvature: Profile::Constant([3.0, -1.0, 0.5]),
        stiffness_shear: None,
        stiffness_axial: None,
        density: None,
        dipole_per_length: None,
        magnet: None,
    };
    flexible(&mut tube);
    let winding = CoilWinding::Axes { turns: [100.0; 3], area: [1e-5; 3] };
    let coil = Some(Coil { winding, current: [0.0; 3], alignment: [0.0; 3] });
    let segment = |name: &str, length: f64, kind: SegmentKind| Segment { name: name.into(), length, kind };
    Scene {
        name: String::new(),
        base: Default::default(),
        flux_density: [0.0, 1.0, 3.0],
        sources: Default::default(),
        loads,
        segments: vec![
            segment("tube", 0.07, SegmentKind::Flexible(tube.clone())),
            segment("coil", 0.01, SegmentKind::Rigid(Rigid { coil, ..Rigid::default() })),
            segment("tip", 0.02, SegmentKind::Flexible(tube)),
        ],
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

/// Plans with derivatives by every number of the scene: every term that has a kernel of its own, and columns by both ways.
fn plans() -> Vec<Plan> {
    let none = Loads::default();
    let force = Loads { tip_force: Some([1e-3, -2e-3, 1e-3]), ..none };
    let load = Loads { distributed_force: Some([0.0, 0.02, -0.03]), ..none };
    let anisotropic =
        |tube: &mut Flexible| tube.stiffness = Stiffness::Direct { bending_x: 6e-5, bending_y: 8e-5, torsion: 5e-5 };
    let general = |tube: &mut Flexible| {
        let node = |at: f64, share: f64| Node { at, value: [6e-5 * share, 8e-5 * share, 5e-5 * share] };
        tube.stiffness = Stiffness::Nodes(vec![node(0.0, 1.2), node(0.02, 0.9)]);
        tube.rest_curvature =
            Profile::Nodes(vec![Node { at: 0.0, value: [3.0, -1.0, 0.5] }, Node { at: 0.02, value: [1.0, 2.0, 0.0] }]);
        (tube.stiffness_shear, tube.stiffness_axial) = (Some([20.0, 30.0]), Some(100.0));
        tube.dipole_per_length = Some([0.0, 0.001, 0.01]);
    };
    let plain = |_: &mut Flexible| {};
    let plan = |scene: Scene, sensitivity: Sensitivity| {
        let axes: Vec<_> =
            Parameter::parse(&scene, "coil.current").expect("currents").iter().map(|p| vec![*p]).collect();
        let options = PlanOptions { sensitivity, steps: 3, ..PlanOptions::default() };
        Plan::new(&scene, &axes, &Parameter::all(&scene), options).expect("a plan")
    };
    let (reciprocity, forward) = (Sensitivity::Reciprocity, Sensitivity::Forward);
    vec![
        plan(scene(none, plain), reciprocity),
        plan(scene(force, plain), reciprocity),
        plan(scene(load, plain), reciprocity),
        plan(scene(none, anisotropic), reciprocity),
        plan(scene(force, anisotropic), reciprocity),
        plan(scene(load, anisotropic), reciprocity),
        plan(scene(load, general), reciprocity),
        plan(scene(load, general), forward),
    ]
}

fn solve(lanes: &mut Cpu, plan: &Plan, first: usize, count: usize) -> Solutions {
    lanes.solve(&plan.batch(count, |sample, row| row.copy_from_slice(&currents(first + sample)))).expect("solved")
}

#[test]
fn a_sample_alone_is_that_among_others() {
    for set in InstructionSet::available() {
        for precision in [Precision::F64, Precision::F32] {
            for (at, plan) in plans().into_iter().enumerate() {
                let mut lanes = Cpu::with_instruction_set(&plan, precision, set).expect("available");
                let all = solve(&mut lanes, &plan, 0, SAMPLES);
                let success = (0..SAMPLES).filter(|sample| all.status(*sample).is_success()).count();
                assert!(success > SAMPLES / 2, "{}, plan {at}: {success} solved", set.name());
                for sample in 0..SAMPLES {
                    let alone = solve(&mut lanes, &plan, sample, 1);
                    for column in 0..plan.output_count() {
                        let (alone, among) = (alone.values.get(0, column), all.values.get(sample, column));
                        let same = alone == among || alone.is_nan() && among.is_nan();
                        assert!(same, "{} {precision}, plan {at}, column {column}: {alone} {among}", set.name());
                    }
                }
            }
        }
    }
}

#[test]
fn a_batch_made_again_and_again_is_a_new_one() {
    for plan in plans() {
        let plan = plan.with_lone_starts();
        let mut one = plan.one_sample();
        assert_eq!(one.batch().bad, [true]);
        for sample in 0..3 {
            let m0 = [1e-4, -2e-4, 1e-5 * sample as f64];
            let mut batch = plan.batch(1, |_, row| row.copy_from_slice(&currents(sample)));
            plan.set_lone_start(&mut batch, 0, m0);
            one.set(|row| row.copy_from_slice(&currents(sample)));
            one.start_at(m0);
            assert_eq!(one.batch(), &batch);
        }
    }
}

/// Where no register holds several samples, f32 is not quicker: such machines compute in f64, and say so.
#[test]
fn machines_without_vector_units_compute_in_f64() {
    let plan = &plans()[0];
    let [f32, f64] = [Precision::F32, Precision::F64].map(|asked| {
        let mut lanes = Cpu::with_instruction_set(plan, asked, InstructionSet::Scalar).expect("available");
        assert_eq!(lanes.info().precision, Precision::F64, "{asked} was asked for");
        solve(&mut lanes, plan, 0, SAMPLES)
    });
    for (sample, column) in (0..SAMPLES).flat_map(|at| (0..plan.output_count()).map(move |column| (at, column))) {
        let bits = [&f32, &f64].map(|rows| rows.values.get(sample, column).to_bits());
        assert_eq!(bits[0], bits[1], "sample {sample}, column {column}");
    }
}
