//! Hard cases constructed here. The reference says where their tips are, save where that is known in closed form.

use super::case::{Case, Truth};
use rodsweep::input::parse_scene;
use rodsweep::model::{
    Base, Coil, CoilWinding, Density, Flexible, Loads, Node, Parameter, Profile, Rigid, STANDARD_GRAVITY, Scene,
    Segment, SegmentKind, Stiffness, Vector,
};
use rodsweep::shipped::{self, ShippedFile};
use std::f64::consts::PI;
use std::path::Path;

/// Of a catheter: EI and GJ (N·m²), length (m).
const EI: f64 = 6e-5;
const GJ: f64 = 3.1e-5;
const LENGTH: f64 = 0.146;
/// Dipole per ampere of a coil set (m²).
const TURNS_AREA: Vector = [1.4e-3, 1.4e-3, 1.6e-3];
const FIELD: Vector = [0.0, 0.0, 3.0];

pub fn constructed_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    sizes(&mut cases);
    materials(&mut cases);
    limp_and_taut(&mut cases);
    degenerate(&mut cases);
    shapes(&mut cases);
    currents(&mut cases);
    cases
}

/// Extreme units.
fn sizes(cases: &mut Vec<Case>) {
    // Nylon, 2 GPa and 1150 kg/m³, held at one end; a pull of 0.1 mN.
    let (radius, modulus): (f64, f64) = (1e-4, 2e9);
    let second_moment = PI / 4.0 * radius.powi(4);
    let bending = modulus * second_moment;
    let suture = weighing(
        uniform("suture", 0.1, [bending, bending, bending / 1.4], [3.0, 0.0, 0.0]),
        1150.0 * PI * radius.powi(2),
    );
    let loads =
        Loads { tip_force: Some([1e-4, 0.0, 0.0]), gravity: Some([0.0, -STANDARD_GRAVITY, 0.0]), ..Loads::default() };
    push(cases, "RS01_suture", "0.2 mm thick, 10 cm long", loads, vec![suture]);

    // Steel, 5 inches outside, 4.276 inches inside, in mud of 1200 kg/m³, a bit that turns and drifts.
    let (outer, inner): (f64, f64) = (0.0635, 0.0543);
    let second_moment = PI / 4.0 * (outer.powi(4) - inner.powi(4));
    let stiffness = [2.1e11 * second_moment, 2.1e11 * second_moment, 1.6e11 * second_moment];
    let pipe =
        weighing(uniform("pipe", 100.0, stiffness, [0.0; 3]), (7850.0 - 1200.0) * PI * (outer.powi(2) - inner.powi(2)));
    let loads = Loads {
        tip_force: Some([500.0, 200.0, -5000.0]),
        tip_moment: Some([0.0, 0.0, 3000.0]),
        gravity: Some([0.0, 0.0, STANDARD_GRAVITY]),
        ..Loads::default()
    };
    push(cases, "RS02_drill_string", "100 m of steel pipe, hanging, with a bit", loads, vec![pipe]);

    // Persistence length 50 nm at 300 K.
    let filament = uniform("filament", 1e-7, [2.1e-28, 2.1e-28, 3e-28], [0.0; 3]);
    let loads = Loads { tip_force: Some([3e-14, 1e-14, 2e-14]), ..Loads::default() };
    push(cases, "RS03_dna", "0.1 µm of DNA: EI = 2e-28 N·m²", loads, vec![filament]);
}

/// Stiffness far from uniform or isotropic.
fn materials(cases: &mut Vec<Case>) {
    let loads = Loads { tip_force: Some([2e-4, 3e-4, 1e-4]), ..Loads::default() };
    let soft = uniform("rod", LENGTH, [EI, EI, EI / 1e3], [4.0, 0.0, 0.0]);
    push(cases, "RS04_torsion_1e3", "EI / GJ = 1e3 on a curved rod", loads, vec![soft]);

    let ribbon = uniform("ribbon", LENGTH, [1e3 * EI, EI, GJ], [0.0, 2.0, 3.0]);
    let loads = Loads { tip_force: Some([1e-3, 2e-2, 1e-3]), ..Loads::default() };
    push(cases, "RS05_ribbon_1e3", "EIx / EIy = 1e3, twisted at rest", loads, vec![ribbon]);

    let stiff = [1e4 * EI, 1e4 * EI, 1e4 * GJ];
    let loads = Loads { tip_force: Some([1e-2, 0.0, 5e-3]), ..Loads::default() };
    let segments = vec![
        uniform("soft", 0.02, [EI, EI, GJ], [5.0, 0.0, 0.0]),
        uniform("stiff", 0.1, stiff, [5.0, 0.0, 0.0]),
        uniform("soft2", 0.02, [EI, EI, GJ], [0.0, 5.0, 0.0]),
    ];
    push(cases, "RS06_jump_1e4", "stiffness jumps up and down by 1e4", loads, segments);

    let thick = [EI, EI, GJ];
    let nodes = vec![Node { at: 0.0, value: thick }, Node { at: LENGTH, value: thick.map(|k| 1e-3 * k) }];
    let taper = with(uniform("taper", LENGTH, thick, [2.0, 0.0, 0.0]), |of| of.stiffness = Stiffness::Nodes(nodes));
    let loads = Loads { tip_force: Some([1e-5, 2e-5, 0.0]), ..Loads::default() };
    push(cases, "RS07_taper_1e3", "tapers to a thousandth of its stiffness", loads, vec![taper]);

    let soft = with(uniform("rod", LENGTH, [EI, EI, GJ], [3.0, 0.0, 0.0]), |of| {
        (of.stiffness_shear, of.stiffness_axial) = (Some([0.01, 0.01]), Some(0.02));
    });
    let loads = Loads { tip_force: Some([2e-3, 1e-3, 3e-3]), ..Loads::default() };
    push(cases, "RS08_soft_shear", "shears by a fifth, stretches by a seventh", loads, vec![soft]);
}

/// Columns that grow along the rod. Planar; tips by finite differences of second order on up to 8000 intervals,
/// extrapolated to 1e-14 of the length.
fn limp_and_taut(cases: &mut Vec<Case>) {
    let mut planar = |name: String, why: String, rest: f64, loads: Loads, [y, z]: [f64; 2]| {
        let scene = scene(&name, loads, vec![uniform("rod", LENGTH, [EI, EI, GJ], [rest, 0.0, 0.0])]);
        cases.push(Case { truth: Truth::Tip([0.0, y, z]), ..Case::new(scene, &why) });
    };
    let limp = [
        (50.0, [-0.13265336427452895, 0.03376314663908391]),
        (200.0, [-0.1396811867374412, 0.014880728596490735]),
        (500.0, [-0.14207197181336184, 0.009184169940598615]),
        (2000.0, [-0.14406281250532388, 0.004533761453583184]),
    ];
    for (limpness, tip) in limp {
        let weight = limpness * EI / LENGTH.powi(3);
        let loads = Loads { distributed_force: Some([0.0, -weight, 0.0]), ..Loads::default() };
        planar(format!("RS09_limp_{limpness}"), format!("horizontal, w L^3 / EI = {limpness}"), 1.0, loads, tip);
    }
    let taut = [
        (5.0_f64, [-0.12894893382949685, 0.039611523138093845]),
        (10.0, [-0.1374447256253693, 0.020221243247321264]),
        (20.0, [-0.14172336999042087, 0.01021717900583843]),
        (30.0, [-0.1431490574052386, 0.00683513711466026]),
    ];
    for (tautness, tip) in taut {
        let pull = tautness.powi(2) * EI / LENGTH.powi(2);
        let loads = Loads { tip_force: Some([0.0, -pull, 0.0]), ..Loads::default() };
        planar(
            format!("RS10_taut_{tautness}"),
            format!("pulled sideways, sqrt(f / EI) L = {tautness}"),
            2.0,
            loads,
            tip,
        );
    }
}

/// Nothing there, or nothing of it.
fn degenerate(cases: &mut Vec<Case>) {
    let segments = vec![uniform("rod", 0.1, [EI, EI, GJ], [0.0; 3]), coil("coil", 0.013, [0.0; 3])];
    let loads = Loads {
        tip_force: Some([0.0; 3]),
        tip_moment: Some([0.0; 3]),
        gravity: None,
        distributed_force: Some([0.0; 3]),
        fluid_density: None,
    };
    let scene = Scene { flux_density: [0.0; 3], ..scene("RS11_zero", loads, segments) };
    let truth = Truth::Tip([0.0, 0.0, 0.113]);
    cases.push(Case { truth, ..Case::new(scene, "no field, every load modelled and zero") });

    let segments = vec![
        uniform("none", 0.0, [EI, EI, GJ], [9.0, 0.0, 0.0]),
        coil("coil1", 0.0, [0.02, 0.0, 0.05]),
        uniform("rod", 0.1, [EI, EI, GJ], [2.0, 0.0, 0.0]),
        coil("coil2", 0.0, [-0.03, 0.05, 0.02]),
        uniform("nothing", 0.0, [1e-9, 1e-9, 1e-9], [0.0, 9.0, 0.0]),
    ];
    let loads = Loads { tip_force: Some([1e-3, 0.0, -5e-4]), ..Loads::default() };
    push(cases, "RS12_zero_lengths", "a rod between segments of no length, base and tip among them", loads, segments);

    let mass = |name: &str, mass| Segment {
        name: name.into(),
        length: 0.0,
        kind: SegmentKind::Rigid(Rigid { mass: Some(mass), ..Rigid::default() }),
    };
    let half = |name: &str| uniform(name, 0.07, [EI, EI, GJ], [0.0; 3]);
    let segments = vec![half("proximal"), mass("middle", 1e-4), half("distal"), mass("tip", 2e-4)];
    let loads = Loads { gravity: Some([0.0, -STANDARD_GRAVITY, 0.0]), ..Loads::default() };
    push(cases, "RS13_point_masses", "two masses of no length on a rod without weight", loads, segments);
}

/// Far from straight.
fn shapes(cases: &mut Vec<Case>) {
    let loops = uniform("rod", LENGTH, [EI, EI, GJ], [20.0 * PI / LENGTH, 0.0, 10.0]);
    let loads = Loads { tip_force: Some([0.1, 0.05, 0.2]), ..Loads::default() };
    push(cases, "RS14_ten_loops", "ten loops at rest, pulled", loads, vec![loops]);

    let (bend, twist) = (30.0 * PI / LENGTH, 8.0 * PI / LENGTH);
    let helix =
        scene("RS15_free_helix", Loads::default(), vec![uniform("rod", LENGTH, [EI, EI, GJ], [bend, 0.0, twist])]);
    let truth = Truth::Tip(constant_curvature([bend, 0.0, twist], LENGTH));
    cases.push(Case { truth, ..Case::new(helix, "a helix of 15 turns, no load") });

    let segments = vec![uniform("rod", 0.104, [EI, EI, GJ], [0.0; 3]), coil("coil", 0.013, [0.0, 0.0, -0.36])];
    let scene = Scene { flux_density: [3.0 * 1e-3, 0.0, 3.0], ..scene("RS16_flip_by_3", Loads::default(), segments) };
    cases.push(Case::new(scene, "three times the flip current, field off by 1e-3 rad"));
}

/// Catheters at the ends of their currents.
fn currents(cases: &mut Vec<Case>) {
    for insertion in [0.094, 0.148] {
        for signs in 0..8 {
            let current: Vector = std::array::from_fn(|k| if signs >> k & 1 == 0 { 0.3 } else { -0.3 });
            let word: String = current.iter().map(|i| if *i > 0.0 { '+' } else { '-' }).collect();
            let name = format!("RS17_p6_{:.0}mm_{word}", 1e3 * insertion);
            let scene = shipped_scene(&name, shipped::P6, &[("insertion", &[insertion]), ("coil.current", &current)]);
            cases.push(Case::new(scene, "P6 with 0.3 A in every coil"));
        }
    }
    // Samples of a Sobol' sweep: current, insertion, tip force; and where on the way the margin is least.
    let near: [(Vector, f64, Vector, f64); 3] = [
        (
            [0.2560134195489809, 0.05476148540619763, 0.20059034039732065],
            0.11376832597295289,
            [0.0018111761391628534, 0.0028513337124604727, -0.004878669910831377],
            0.973,
        ),
        (
            [-0.1855091402074322, -0.26371832268778234, 0.24711519868578763],
            0.10035955382406246,
            [-0.001956346008228138, -0.0020517149998340754, -0.0030481960612814872],
            0.947,
        ),
        (
            [0.09580808209720998, -0.1870599793503061, 0.18556474770884962],
            0.1287658975092927,
            [0.004510173295857386, 0.004449718926334753, 0.00029369843075983254],
            0.605,
        ),
    ];
    for (k, (current, insertion, force, share)) in near.into_iter().enumerate() {
        for (kind, share, why) in [
            ("passed", 1.0, "a bifurcation passed nearby: a coarse path takes the other branch"),
            ("near", share, "the same at its least margin, below 0.01"),
        ] {
            let name = format!("RS18_p6_{kind}_{}", k + 1);
            let [current, force] = [current, force].map(|v| v.map(|x| share * x));
            let gravity = [9.81 * share];
            let values: &[(&str, &[f64])] = &[
                ("insertion", &[insertion]),
                ("coil.current", &current),
                ("loads.tip_force", &force),
                ("loads.gravity.z", &gravity),
            ];
            cases.push(Case::new(shipped_scene(&name, shipped::P6, values), why));
        }
    }
    for (k, current) in [[0.3, 0.0, 0.0], [0.0, 0.0, 0.3], [0.3, -0.3, 0.3]].iter().enumerate() {
        let name = format!("RS19_opposed_{}", k + 1);
        let opposed = current.map(|i| -i);
        let scene = shipped_scene(&name, shipped::TWO_COIL, &[("coil1.current", current), ("coil2.current", &opposed)]);
        cases.push(Case::new(scene, "two coil sets against each other"));
    }
}

/// Tip of a rod of constant curvature from the origin along z (Rodrigues' integral).
fn constant_curvature(u: Vector, length: f64) -> Vector {
    let size = u.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z] = u.map(|x| x / size);
    let angle = size * length;
    let (sine, versine) = (angle.sin() / size, (1.0 - angle.cos()) / size);
    // integral of exp(s hat(u)) e3
    let along = z * (length - sine);
    [y * versine + x * along, -x * versine + y * along, sine + z * along]
}

fn push(cases: &mut Vec<Case>, name: &str, why: &str, loads: Loads, segments: Vec<Segment>) {
    cases.push(Case::new(scene(name, loads, segments), why));
}

fn scene(name: &str, loads: Loads, segments: Vec<Segment>) -> Scene {
    Scene {
        name: name.into(),
        base: Base::default(),
        flux_density: FIELD,
        sources: Default::default(),
        loads,
        segments,
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

/// A shipped scene with other values.
fn shipped_scene(name: &str, (_, text): ShippedFile, values: &[(&str, &[f64])]) -> Scene {
    let mut scene = parse_scene(Path::new(name), text).expect("the shipped scenes read");
    for (group, values) in values {
        let parameters = Parameter::parse(&scene, group).expect("the shipped scenes have these parameters");
        let values = parameters.into_iter().zip(values.iter().copied());
        Parameter::set_all(&mut scene, values).expect("values that make a rod");
    }
    scene.name = name.into();
    scene
}

fn uniform(name: &str, length: f64, stiffness: Vector, rest_curvature: Vector) -> Segment {
    let [bending_x, bending_y, torsion] = stiffness;
    let flexible = Flexible {
        stiffness: Stiffness::Direct { bending_x, bending_y, torsion },
        rest_curvature: Profile::Constant(rest_curvature),
        stiffness_shear: None,
        stiffness_axial: None,
        density: None,
        dipole_per_length: None,
        magnet: None,
    };
    Segment { name: name.into(), length, kind: SegmentKind::Flexible(flexible) }
}

/// A flexible segment, changed.
fn with(mut segment: Segment, change: impl FnOnce(&mut Flexible)) -> Segment {
    if let SegmentKind::Flexible(flexible) = &mut segment.kind {
        change(flexible);
    }
    segment
}

/// A flexible segment with a mass per length (kg/m).
fn weighing(segment: Segment, linear_density: f64) -> Segment {
    with(segment, |flexible| flexible.density = Some(Density::Linear(linear_density)))
}

fn coil(name: &str, length: f64, current: Vector) -> Segment {
    let winding = CoilWinding::Axes { turns: [1.0; 3], area: TURNS_AREA };
    let coil = Some(Coil { winding, current, alignment: [0.0; 3] });
    Segment { name: name.into(), length, kind: SegmentKind::Rigid(Rigid { coil, ..Rigid::default() }) }
}
