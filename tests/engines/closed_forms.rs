//! The reference against closed forms: weight, taper, linear rest curvature, shear and stretch, permanent magnets,
//! insertion. Those of a plain rod are in `physics.rs`.

#![allow(non_snake_case)]

use crate::common::check::difference;
use crate::common::scenes::flexible;
use nalgebra::{Matrix3, Rotation3, Vector3};
use rodsweep::model::{
    Axis, Base, Density, Flexible, FlexibleRod, Loads, Node, Parameter, Profile, Rigid, RigidRod, Rod, RodSegment,
    Scene, Segment, SegmentKind, ShearElasticity, Slot, Status, Stiffness,
};
use rodsweep::reference::{Equilibrium, solve_rod, stability_at};
use std::f64::consts::PI;

/// A hundred integration tolerances (1e-13).
const CLOSED_FORM: f64 = 1e-11;
/// The ramp halves its step down to 1e-5 of the load before it reports a fold.
const FOLD: f64 = 2e-5;

const LENGTH: f64 = 0.12;
const EI: f64 = 5e-5;
const GJ: f64 = 4e-5;

fn piece() -> FlexibleRod {
    FlexibleRod { length: LENGTH, stiffness: [EI, EI, GJ], ..FlexibleRod::default() }
}

/// A rod along world z.
fn rod(segments: Vec<RodSegment>) -> Rod {
    Rod {
        base_position: [0.0; 3],
        base_rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        flux_density: [0.0; 3],
        field: None,
        wall: None,
        tip_force: [0.0; 3],
        tip_moment: [0.0; 3],
        rigid_force_arm: true,
        segments,
    }
}

fn of_one(piece: FlexibleRod) -> Rod {
    rod(vec![RodSegment::Flexible(piece)])
}

fn scene(segments: Vec<Segment>, loads: Loads) -> Scene {
    let base = Base { position: [0.01, -0.02, 0.03], rotation: [0.4, -0.3, 0.8] };
    Scene {
        name: "closed form".into(),
        base,
        flux_density: [0.3, 1.0, -0.5],
        sources: Default::default(),
        loads,
        segments,
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

fn segment(name: &str, length: f64, flexible: Flexible) -> Segment {
    Segment { name: name.into(), length, kind: SegmentKind::Flexible(flexible) }
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() <= tolerance, "{found} against {expected}");
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, col| rows[row][col])
}

/// Tip pose, base moment and margin agree.
fn assert_same(a: &Equilibrium, b: &Equilibrium, tolerance: f64) {
    assert!(a.status.is_success() && b.status.is_success(), "{:?} {:?}", a.status, b.status);
    let errors = [
        difference(&a.p_tip, &b.p_tip) / LENGTH,
        (matrix(&a.R_tip) - matrix(&b.R_tip)).norm(),
        difference(&a.m0, &b.m0) / (EI / LENGTH),
        (a.margin - b.margin).abs(),
    ];
    assert!(errors.iter().all(|error| *error <= tolerance), "position, rotation, moment, margin: {errors:?}");
}

/// Simpson's rule on so many panels that it is exact to rounding here.
fn integral(f: impl Fn(f64) -> f64, length: f64) -> f64 {
    let panels = 20_000;
    let h = length / panels as f64;
    let inner: f64 = (1..panels).map(|k| f(k as f64 * h) * if k % 2 == 0 { 2.0 } else { 4.0 }).sum();
    h / 3.0 * (f(0.0) + inner + f(length))
}

#[test]
fn own_weight_in_a_fluid() {
    let (inner_radius, outer_radius, youngs_modulus, density, fluid) = (0.4e-3, 0.6e-3, 30e6, 1200.0, 1060.0);
    let tube =
        Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear: ShearElasticity::PoissonRatio(0.4) };
    let bending = youngs_modulus * PI / 4.0 * (f64::powi(outer_radius, 4) - f64::powi(inner_radius, 4));
    let area = PI * (outer_radius * outer_radius - inner_radius * inner_radius);
    let heavy = Flexible { density: Some(Density::Volume(density)), ..flexible(tube, [0.0; 3]) };
    let small = 1e-3;
    let loads = Loads { gravity: Some([small, 0.0, 0.0]), fluid_density: Some(fluid), ..Loads::default() };
    let mut scene = scene(vec![segment("tube", LENGTH, heavy)], loads);
    scene.base = Base::default();
    let found = solve_rod(&scene.rod(), &[]);
    let load = (density - fluid) * area * small;
    let deflection = load * LENGTH.powi(4) / (8.0 * bending);
    assert!(deflection < 1e-3 * LENGTH);
    // The next term of the series is of relative order (deflection / length)^2.
    close(found.p_tip[0], deflection, (deflection / LENGTH).powi(2));
    close(found.m0[1], load * LENGTH * LENGTH / 2.0, (deflection / LENGTH).powi(2));
}

#[test]
fn linear_taper() {
    for share in [-0.7, 0.5, 3.0] {
        let stiffness_rise = [EI, EI, GJ].map(|k| share * k);
        let found = solve_rod(
            &of_one(FlexibleRod { stiffness_rise, ..piece() }),
            &[Slot::TipForce(Axis::X), Slot::TipMoment(Axis::Y), Slot::TipMoment(Axis::Z)],
        );
        let [force, moment, twist] = [0, 1, 2].map(|k| found.derivatives[k]);
        let end = 1.0 + share;
        // Integral of (1 - x)^2 / (1 + share x), of (1 - x) / (1 + share x) and of 1 / (1 + share x) from 0 to 1.
        let second = (end * end * end.ln() - 2.0 * end * share + (end * end - 1.0) / 2.0) / share.powi(3);
        let first = (end * end.ln() - share) / share.powi(2);
        let none = end.ln() / share;
        close(force.dp[0], LENGTH.powi(3) / EI * second, CLOSED_FORM);
        close(force.w[1], LENGTH.powi(2) / EI * first, CLOSED_FORM);
        close(moment.w[1], LENGTH / EI * none, CLOSED_FORM);
        close(twist.w[2], LENGTH / GJ * none, CLOSED_FORM);
    }
}

/// Rest curvature that grows with arc length: an Euler spiral, by Fresnel's integrals.
#[test]
fn euler_spiral() {
    for rise in [10.0, -60.0, 200.0] {
        let start = 5.0;
        let nodes = [(0.0, start), (LENGTH, start + rise)].map(|(at, y)| Node { at, value: [0.0, y, 0.0] });
        let stiffness = Stiffness::Direct { bending_x: EI, bending_y: 2.0 * EI, torsion: GJ };
        let spiral = Flexible { rest_curvature: Profile::Nodes(nodes.to_vec()), ..flexible(stiffness, [0.0; 3]) };
        let mut scene = scene(vec![segment("spiral", LENGTH, spiral)], Loads::default());
        scene.base = Base::default();
        let found = solve_rod(&scene.rod(), &[]);
        let angle = |s: f64| start * s + 0.5 * rise * s * s / LENGTH;
        let p = [integral(|s| angle(s).sin(), LENGTH), 0.0, integral(|s| angle(s).cos(), LENGTH)];
        assert!(difference(&found.p_tip, &p) <= CLOSED_FORM * LENGTH, "{rise}: {:?} against {p:?}", found.p_tip);
        let R = Rotation3::new(Vector3::y() * angle(LENGTH));
        assert!((matrix(&found.R_tip) - R.matrix()).norm() <= CLOSED_FORM, "{rise}");
        close(found.u0[1], start, CLOSED_FORM);
        close(found.u_tip[1], start + rise, CLOSED_FORM);
    }
}

#[test]
fn stretched_bar() {
    let stiffness_axial = 0.4;
    for force in [-1e-4, 3e-3, 0.05] {
        let mut rod = of_one(FlexibleRod { shear_compliance: [0.0, 0.0, 1.0 / stiffness_axial], ..piece() });
        rod.tip_force = [0.0, 0.0, force];
        let found = solve_rod(&rod, &[Slot::TipForce(Axis::Z), Slot::ShearCompliance(0, Axis::Z)]);
        let stretch = 1.0 + force / stiffness_axial;
        assert!(difference(&found.p_tip, &[0.0, 0.0, LENGTH * stretch]) <= CLOSED_FORM * LENGTH, "{:?}", found.p_tip);
        close(found.derivatives[0].dp[2], LENGTH / stiffness_axial, CLOSED_FORM);
        close(found.derivatives[1].dp[2], LENGTH * force, CLOSED_FORM);
    }
    // Under its own weight, hung up: w L^2 / (2 EA).
    let load = [0.0, 0.0, 0.2];
    let hung = FlexibleRod { load, shear_compliance: [0.0, 0.0, 1.0 / stiffness_axial], ..piece() };
    let found = solve_rod(&of_one(hung), &[]);
    close(found.p_tip[2] - LENGTH, load[2] * LENGTH * LENGTH / (2.0 * stiffness_axial), CLOSED_FORM * LENGTH / 1e-3);
}

#[test]
fn timoshenko_beam() {
    let (x, y) = (0.08, 0.3);
    let rod = of_one(FlexibleRod { shear_compliance: [1.0 / x, 1.0 / y, 0.0], ..piece() });
    let slots = [Slot::TipForce(Axis::X), Slot::TipForce(Axis::Y), Slot::Load(0, Axis::X), Slot::TipMoment(Axis::Y)];
    let found = solve_rod(&rod, &slots);
    let [by_x, by_y, by_load, by_moment] = [0, 1, 2, 3].map(|k| found.derivatives[k]);
    let bending = LENGTH.powi(3) / (3.0 * EI);
    close(by_x.dp[0], bending + LENGTH / x, CLOSED_FORM);
    close(by_y.dp[1], bending + LENGTH / y, CLOSED_FORM);
    close(by_x.w[1], LENGTH.powi(2) / (2.0 * EI), CLOSED_FORM);
    close(by_load.dp[0], LENGTH.powi(4) / (8.0 * EI) + LENGTH.powi(2) / (2.0 * x), CLOSED_FORM);
    close(by_moment.dp[0], LENGTH.powi(2) / (2.0 * EI), CLOSED_FORM);
}

/// Column that shears and shortens: EI theta'' = -F (1 + (1/GA - 1/EA) F) theta. Haringx's load where 1/EA is zero.
#[test]
fn buckling_with_shear_and_stretch() {
    let euler = PI * PI * EI / (4.0 * LENGTH * LENGTH);
    for (shear, axial) in [(0.0, 0.0), (20.0, 0.0), (0.0, 10.0), (30.0, 4.0)] {
        let difference = shear - axial;
        // The least root of F (1 + difference F) = euler.
        let critical = 2.0 * euler / (1.0 + f64::sqrt(1.0 + 4.0 * difference * euler));
        let compressed = |share: f64| {
            let mut rod = of_one(FlexibleRod { shear_compliance: [shear, shear, axial], ..piece() });
            rod.tip_force = [0.0, 0.0, -share * critical];
            rod
        };
        for (share, index) in [(0.5, 0), (0.9999, 0), (1.0001, 2), (1.2, 2)] {
            let found = stability_at(&compressed(share), [0.0; 3]).expect("integrable");
            assert_eq!(found.index, index, "at {share} of the critical load, compliances {shear} and {axial}");
            // dr/dm0 = diag(cos kL, cos kL, 1)
            let force = share * critical;
            let cos = (LENGTH * (force * (1.0 + difference * force) / EI).sqrt()).cos();
            let size = (3.0 / (2.0 / (cos * cos) + 1.0)).sqrt();
            let margin = if index > 0 { -size } else { size };
            assert!((found.margin - margin).abs() <= CLOSED_FORM, "{} against {margin} at {share}", found.margin);
        }
        let folded = solve_rod(&compressed(1.37), &[]);
        assert_eq!(folded.status, Status::Fold);
        assert!((folded.load_fraction - 1.0 / 1.37).abs() <= FOLD, "{}", folded.load_fraction);
    }
}

/// A rod magnetised along its tangent: m' = -(mu' t) x B, as if a force mu' B pulled at its end.
#[test]
fn magnetised_rod_bends_as_under_a_force() {
    let (mu, B) = (4e-3, [1.5, -0.7, 0.4]);
    let curved = FlexibleRod { rest_curvature: [4.0, -3.0, 2.0], rest_curvature_rise: [-2.0, 9.0, 5.0], ..piece() };
    let mut magnet = of_one(FlexibleRod { dipole: [0.0, 0.0, mu], ..curved });
    magnet.flux_density = B;
    let mut pulled = of_one(curved);
    pulled.tip_force = B.map(|b| mu * b);
    assert_same(&solve_rod(&magnet, &[]), &solve_rod(&pulled, &[]), CLOSED_FORM);
}

#[test]
fn small_deflection_of_a_magnet() {
    let mut rod = of_one(piece());
    rod.flux_density = [2.0, 0.0, 0.0];
    let slots = [Slot::DipolePerLength(0, Axis::Z), Slot::DipolePerLength(0, Axis::Y)];
    let [along, across] = [0, 1].map(|k| solve_rod(&rod, &slots).derivatives[k]);
    close(along.dp[0], 2.0 * LENGTH.powi(3) / (3.0 * EI), CLOSED_FORM);
    close(along.w[1], 2.0 * LENGTH.powi(2) / (2.0 * EI), CLOSED_FORM);
    close(across.w[2], -2.0 * LENGTH.powi(2) / (2.0 * GJ), CLOSED_FORM);
}

/// Dipoles at the middles of equal parts: the midpoint rule, of second order.
#[test]
fn many_dipoles_make_a_magnet() {
    let mu = [2e-3, -1e-3, 3e-3];
    let mut magnet = of_one(FlexibleRod { dipole: mu, ..piece() });
    magnet.flux_density = [1.0, 0.8, -1.2];
    magnet.tip_force = [1e-3, 0.0, -5e-4];
    let whole = solve_rod(&magnet, &[]);
    let error = |count: usize| {
        let part = LENGTH / count as f64;
        let bare = |length: f64| RodSegment::Flexible(FlexibleRod { length, ..piece() });
        let dipole = RodSegment::Rigid(RigidRod { dipole: mu.map(|x| x * part), ..RigidRod::default() });
        let segments = (0..count).flat_map(|_| [bare(0.5 * part), dipole, bare(0.5 * part)]).collect();
        let parts = solve_rod(&Rod { segments, ..magnet.clone() }, &[]);
        assert!(parts.status.is_success());
        difference(&parts.p_tip, &whole.p_tip) / LENGTH
    };
    let errors = [8, 16, 32, 64].map(error);
    assert!(errors[0] < 1e-2 && errors[3] > 0.0, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] / 4.0 - 1.0).abs() < 0.02, "{errors:?}");
    }
}

#[test]
fn point_mass_at_the_tip() {
    let (mass, gravity) = (2e-4, [3.0, -5.0, 7.0]);
    let stiffness = Stiffness::Direct { bending_x: EI, bending_y: 2.0 * EI, torsion: GJ };
    let bare = segment("rod", LENGTH, flexible(stiffness, [2.0, 5.0, -3.0]));
    let rigid = Rigid { mass: Some(mass), ..Rigid::default() };
    let point = Segment { name: "point".into(), length: 0.0, kind: SegmentKind::Rigid(rigid) };
    let weighed = Loads { gravity: Some(gravity), ..Loads::default() };
    let pulled = Loads { tip_force: Some(gravity.map(|g| mass * g)), ..Loads::default() };
    let (with_mass, with_force) = (scene(vec![bare.clone(), point], weighed), scene(vec![bare], pulled));
    let by = |scene: &Scene, parameter: Parameter| {
        let slots: Vec<Slot> = parameter.chain(scene).iter().map(|(slot, _)| *slot).collect();
        solve_rod(&scene.rod(), &slots)
    };
    let a = by(&with_mass, Parameter::Gravity(Axis::Y));
    let b = by(&with_force, Parameter::TipForce(Axis::Y));
    assert_same(&a, &b, CLOSED_FORM);
    let weight = solve_rod(&with_mass.rod(), &[Slot::Weight(1, Axis::Y)]).derivatives[0];
    assert!(difference(&weight.dp, &b.derivatives[0].dp) <= CLOSED_FORM * LENGTH.powi(3) / EI);
}

/// A segment with nodes of its own, under weight, magnetised, between two others.
fn with_nodes() -> Scene {
    let stiffness = |at: f64, share: f64| Node { at, value: [share * EI, 1.2 * share * EI, share * GJ] };
    let curvature = |at: f64, value: [f64; 3]| Node { at, value };
    let varied = Flexible {
        stiffness: Stiffness::Nodes(vec![stiffness(0.01, 1.0), stiffness(0.04, 0.5), stiffness(0.05, 0.8)]),
        rest_curvature: Profile::Nodes(vec![curvature(0.0, [4.0, 0.0, 2.0]), curvature(0.06, [-6.0, 9.0, 0.0])]),
        stiffness_shear: Some([0.5, 0.8]),
        stiffness_axial: Some(1.0),
        density: Some(Density::Linear(2e-4)),
        dipole_per_length: Some([1e-3, 0.0, 2e-3]),
        magnet: None,
    };
    let plain = Stiffness::Direct { bending_x: EI, bending_y: EI, torsion: GJ };
    let loads = Loads { tip_force: Some([1e-3, 5e-4, -1e-3]), gravity: Some([0.0, 0.0, -9.81]), ..Loads::default() };
    let rigid = SegmentKind::Rigid(Rigid { mass: Some(1e-4), ..Rigid::default() });
    let coil = Segment { name: "coil".into(), length: 0.01, kind: rigid };
    scene(vec![segment("varied", 0.06, varied), coil, segment("plain", 0.05, flexible(plain, [0.0; 3]))], loads)
}

/// Nodes further from the proximal end by `by`.
fn shifted(flexible: &Flexible, by: f64) -> Flexible {
    let shift = |nodes: &[Node]| nodes.iter().map(|node| Node { at: node.at + by, ..*node }).collect::<Vec<_>>();
    Flexible {
        stiffness: Stiffness::Nodes(shift(flexible.stiffness.profile().nodes())),
        rest_curvature: Profile::Nodes(shift(flexible.rest_curvature.nodes())),
        ..flexible.clone()
    }
}

#[test]
fn a_cut_between_nodes_changes_nothing() {
    let whole = with_nodes();
    let SegmentKind::Flexible(varied) = &whole.segments[0].kind else { panic!() };
    let expected = solve_rod(&whole.rod(), &[Slot::TipForce(Axis::X)]);
    for cut in [0.005, 0.02, 0.04, 0.045] {
        let mut parted = whole.clone();
        // The proximal part keeps the nodes, whose places beyond its end tell its slope; the distal part has them
        // behind its start.
        parted.segments[0].length = cut;
        parted.segments.insert(1, segment("rest", 0.06 - cut, shifted(varied, -cut)));
        let found = solve_rod(&parted.rod(), &[Slot::TipForce(Axis::X)]);
        assert_same(&found, &expected, CLOSED_FORM);
        let error = difference(&found.derivatives[0].dp, &expected.derivatives[0].dp);
        assert!(error <= CLOSED_FORM * LENGTH.powi(3) / EI, "{cut}: {error:e}");
    }
}

/// Nodes keep their distance from the distal end.
#[test]
fn insertion_moves_the_nodes() {
    let whole = with_nodes();
    let SegmentKind::Flexible(varied) = &whole.segments[0].kind else { panic!() };
    for by in [-0.055, -0.03, -0.005, 0.0, 0.02] {
        let mut inserted = whole.clone();
        Parameter::Insertion.set(&mut inserted, whole.total_length() + by).expect("settable");
        let mut moved = whole.clone();
        moved.segments[0] = segment("varied", 0.06 + by, shifted(varied, by));
        assert_same(&solve_rod(&inserted.rod(), &[]), &solve_rod(&moved.rod(), &[]), CLOSED_FORM);
    }
}
