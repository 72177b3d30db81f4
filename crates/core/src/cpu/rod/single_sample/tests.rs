use crate::cpu::algebra::Vec3;
use crate::cpu::equilibrium::solve::start_columns;
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Workspace};
use crate::cpu::rod::program::{Inputs, Program};
use crate::cpu::rod::segments::Rod;
use crate::cpu::rod::terms::ProgramTerms;
use crate::cpu::simd::lane::{F64, Lane};
use crate::model::{
    Flexible, Loads, Node, Parameter, Plan, PlanOptions, Profile, Scene, Segment, SegmentKind, Stiffness,
};

/// A bent tube; if `general`, its stiffness varies along it and it is magnetic.
fn plan(loads: Loads, bending: [f64; 2], general: bool) -> Plan {
    let [bending_x, bending_y] = bending;
    let node = |at: f64, share: f64| Node { at, value: [bending_x * share, bending_y * share, 5e-5 * share] };
    let stiffness = match general {
        true => Stiffness::Nodes(vec![node(0.0, 1.2), node(0.07, 0.9)]),
        false => Stiffness::Direct { bending_x, bending_y, torsion: 5e-5 },
    };
    let tube = Flexible {
        stiffness,
        rest_curvature: Profile::Constant([3.0, -1.0, 0.5]),
        stiffness_shear: None,
        stiffness_axial: None,
        density: None,
        dipole_per_length: general.then_some([0.0, 0.001, 0.01]),
        magnet: None,
    };
    let scene = Scene {
        name: String::new(),
        base: Default::default(),
        flux_density: [0.0, 1.0, 3.0],
        sources: Default::default(),
        loads,
        segments: vec![Segment { name: "tube".into(), length: 0.07, kind: SegmentKind::Flexible(tube) }],
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    };
    let options = PlanOptions { steps: 3, ..PlanOptions::default() };
    Plan::new(&scene, &[], &Parameter::all(&scene), options).expect("a plan")
}

/// One plan for each set of terms that has a kernel of its own.
fn plans() -> Vec<(ProgramTerms, Plan)> {
    let none = Loads::default();
    let force = Loads { tip_force: Some([1e-3, -2e-3, 1e-3]), ..none };
    let load = Loads { distributed_force: Some([0.0, 0.02, -0.03]), ..none };
    let by = |[force, load, anisotropic, general]: [bool; 4]| ProgramTerms { force, load, anisotropic, general };
    let (round, flat, o, i) = ([6e-5, 6e-5], [6e-5, 8e-5], false, true);
    vec![
        (by([o, o, o, o]), plan(none, round, false)),
        (by([i, o, o, o]), plan(force, round, false)),
        (by([i, i, o, o]), plan(load, round, false)),
        (by([o, o, i, o]), plan(none, flat, false)),
        (by([i, o, i, o]), plan(force, flat, false)),
        (by([i, i, i, o]), plan(load, flat, false)),
        (by([i, i, i, i]), plan(load, flat, true)),
    ]
}

/// A pass alone against the same in every lane; passes are named, no kernel is, since each takes a while to compile.
#[cfg(target_arch = "x86_64")]
#[test]
fn columns_of_a_sample_alone_lie_side_by_side() {
    type L = F64<pulp::x86::V3>;
    let Some(token) = pulp::x86::V3::try_new() else { return };
    let number = |x: f64| L::splat(token, x);
    let in_lanes = |x: L| {
        let mut lanes = [0.0; L::COUNT];
        x.store(&mut lanes);
        lanes
    };
    let in_vector = |v: Vec3<L>| [v.x, v.y, v.z].map(in_lanes);
    for (terms, plan) in plans() {
        let program = Program::new(&plan, f64::EPSILON);
        assert_eq!(program.terms, terms);
        let inputs = Inputs { data: &[], stride: 1, offset: 0 };
        let mut rod = Rod::new(token);
        rod.load(&program, token, &inputs);
        let problem = Problem { program: &program, inputs, rod: &rod };
        let m0 = Vec3 { x: number(0.2), y: number(-0.1), z: number(0.05) };
        let [alone, among] = [true, false].map(|alone| {
            let mut workspace = Workspace::<L>::new(token, &program);
            workspace.alone = alone;
            for k in 0..workspace.sources.len() {
                workspace.sources[k].load((problem.program, &problem.inputs), problem.rod, 3 * k, None);
            }
            let mut columns = Vec::new();
            start_columns(&problem, m0, &workspace, &mut columns);
            shoot(&problem, &program.fine, number(1.0), m0, &mut columns, Record::Traces, &mut workspace);
            let dp =
                columns.iter().map(|three| [three.dp.x, three.dp.y, three.dp.z].map(in_vector)).collect::<Vec<_>>();
            (in_vector(workspace.stages.column_slope[0].ddp), dp)
        });
        let differ = |slope: &[[f64; L::COUNT]; 3]| slope.iter().any(|lanes| lanes[..3].iter().any(|x| *x != lanes[0]));
        assert!(differ(&alone.0) && !differ(&among.0), "{terms:?}");
        for (alone, among) in alone.1.iter().flatten().flatten().zip(among.1.iter().flatten().flatten()) {
            assert_eq!(alone[0], among[0], "{terms:?}");
        }
    }
}
