//! Catheters that people build: tubes of real materials with sets of three windings, magnets at the tip, magnets outside.

use super::numbers::Random;
use rodsweep::model::{
    Axis, Base, Coil, CoilLoad, CoilWinding, Density, FieldSources, Flexible, Loads, Magnet, MagnetBody, MagnetShape,
    Parameter, Profile, Rigid, STANDARD_GRAVITY, Scene, Segment, SegmentKind, SegmentParameter, ShearElasticity,
    Stiffness, Vector,
};
use rodsweep::spec::{AxisSpec, Distribution};
use std::f64::consts::PI;

/// Young's modulus from and to (Pa), Poisson's ratio, density (kg/m³), largest outer radius (m)
const MATERIALS: [(f64, f64, f64, f64, f64); 7] = [
    // Silicone, soft polyurethane, PEBAX, PTFE, nylon, nitinol, steel.
    (0.5e6, 8e6, 0.48, 1100.0, 2e-3),
    (5e6, 50e6, 0.47, 1150.0, 2e-3),
    (12e6, 500e6, 0.45, 1010.0, 1.5e-3),
    (400e6, 750e6, 0.46, 2200.0, 1.2e-3),
    (1e9, 3e9, 0.4, 1140.0, 1e-3),
    (28e9, 75e9, 0.33, 6450.0, 0.5e-3),
    (190e9, 200e9, 0.29, 7900.0, 0.4e-3),
];
/// How far the largest inputs bend a design, by the sum of all moments on the unbent rod (rad). Moments fall as a rod turns into
/// the field: most tips turn by 20 to 180 degrees.
const BEND: (f64, f64) = (1.5, 20.0);
/// Remanence of magnets (T), and mu0 (T·m/A)
const REMANENCE: f64 = 1.3;
const MU0: f64 = 4e-7 * PI;

/// How currents are driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drive {
    /// Each coil set has one current, the same in its three windings.
    Grouped,
    /// Each winding has its own.
    Free,
    /// The last set nearly cancels the others.
    Opposed,
    /// Windings across the rod in a field across it: the rod twists and does not bend.
    Twist,
    /// No coil: a magnet at the tip.
    Magnet,
}

const DRIVES: [Drive; 5] = [Drive::Grouped, Drive::Free, Drive::Opposed, Drive::Twist, Drive::Magnet];

/// A design: its scene under some currents, and the box of its inputs.
pub struct Design {
    pub scene: Scene,
    pub axes: Vec<AxisSpec>,
}

/// Design `number` of a seed: it depends on these two alone.
pub fn design(seed: u64, number: u64) -> Design {
    let mut random = Random(seed ^ number.wrapping_mul(0xa076_1d64_78bd_642f));
    let drive = DRIVES[(number % 5) as usize];
    let sets = match drive {
        Drive::Magnet => 1,
        Drive::Opposed => 2 + usize::from(random.chance(0.5)),
        _ => 1 + (random.unit() * 2.999) as usize,
    };
    let has_weight = random.chance(0.3);
    let segments = segments(&mut random, drive, sets, has_weight);
    let field = field(&mut random, drive);
    let turned = random.chance(0.4);
    let base = match turned {
        true => Base { position: random.vector(0.1), rotation: random.vector(2.0) },
        false => Base::default(),
    };
    // A coil set twists a rod whose base is not turned.
    let base = if drive == Drive::Twist { Base::default() } else { base };
    let bend = random.between(BEND.0, BEND.1);
    let most = most_current(&segments, field, bend);
    let mut scene = Scene {
        name: format!("Design {number}"),
        base,
        flux_density: field,
        sources: FieldSources::default(),
        loads: Loads { gravity: has_weight.then_some([0.0, 0.0, -STANDARD_GRAVITY]), ..Loads::default() },
        segments,
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    };
    if drive == Drive::Magnet && random.chance(0.6) {
        scene.flux_density = [0.0; 3];
        scene.sources = outside(&scene, &mut random);
    }
    if drive == Drive::Magnet {
        let rest = scene.rod();
        let tip = std::array::from_fn(|k| rest.base_position[k] + scene.total_length() * rest.base_rotation[k][2]);
        let field = rest.field.as_ref().map_or(field, |sources| sources.flux_density(tip));
        shrink_magnet(&mut scene.segments, field, bend);
    }
    let axes = inputs(&scene, drive, most);
    let values: Vec<f64> = axes.iter().map(|axis| axis.distribution.value(random.unit())).collect();
    for (axis, value) in axes.iter().zip(values) {
        let _ = Parameter::set_all(&mut scene, axis.parameters.iter().map(|parameter| (*parameter, value)));
    }
    if drive == Drive::Opposed {
        oppose(&mut scene, &mut random);
    }
    Design { scene, axes }
}

/// Tubes between coil sets; now and then one of another material, or curved at rest.
fn segments(random: &mut Random, drive: Drive, sets: usize, has_weight: bool) -> Vec<Segment> {
    let mut segments = Vec::new();
    let mut material = (random.unit() * MATERIALS.len() as f64) as usize;
    let outer = random.between(0.3e-3, MATERIALS[material].4);
    let inner = outer * random.within(0.0, 0.8);
    for set in 0..sets {
        if random.chance(0.15) {
            material = (random.unit() * MATERIALS.len() as f64) as usize;
        }
        let (low, high, poisson_ratio, density, largest) = MATERIALS[material];
        let shrunk = (largest / outer).min(1.0);
        let length = random.between(20e-3, 150e-3) / if set == 0 { 1.0 } else { 2.0 };
        let is_curved = random.chance(0.15);
        segments.push(Segment {
            name: ["body", "neck", "neck2"][set].into(),
            length,
            kind: SegmentKind::Flexible(Flexible {
                stiffness: Stiffness::Tube {
                    inner_radius: inner * shrunk,
                    outer_radius: outer * shrunk,
                    youngs_modulus: random.between(low, high),
                    shear: ShearElasticity::PoissonRatio(poisson_ratio),
                },
                rest_curvature: Profile::Constant(if is_curved { random.vector(1.0 / length) } else { [0.0; 3] }),
                stiffness_shear: None,
                stiffness_axial: None,
                density: has_weight.then_some(Density::Volume(density)),
                dipole_per_length: None,
                magnet: None,
            }),
        });
        segments.push(rigid(random, drive, set, outer));
    }
    if random.chance(0.3) {
        // A soft tip beyond the last coil.
        let last = segments[0].clone();
        segments.push(Segment { name: "tip".into(), length: random.between(5e-3, 30e-3), ..last });
    }
    segments
}

/// A coil set, or a magnet.
fn rigid(random: &mut Random, drive: Drive, set: usize, outer: f64) -> Segment {
    let length = random.between(3e-3, 15e-3);
    if drive == Drive::Magnet {
        let magnetisation = REMANENCE / MU0 * PI * outer * outer;
        let rigid = Rigid { dipole_per_length: Some([0.0, 0.0, magnetisation]), ..Rigid::default() };
        return Segment { name: "magnet".into(), length, kind: SegmentKind::Rigid(rigid) };
    }
    let turns: Vector = std::array::from_fn(|_| random.between(20.0, 150.0).round());
    let across = length * 2.0 * outer * 0.8;
    let area = [across, across, PI * (1.2 * outer).powi(2)];
    // Windings of a hand-made set are neither equal nor square.
    let winding = match random.chance(0.3) {
        true => CoilWinding::Matrix(std::array::from_fn(|row| {
            std::array::from_fn(|col| {
                let own = if row == col { 1.0 } else { random.within(-0.1, 0.1) };
                own * turns[col] * area[col]
            })
        })),
        false => CoilWinding::Axes { turns, area },
    };
    let alignment = if drive != Drive::Twist && random.chance(0.2) { random.vector(0.2) } else { [0.0; 3] };
    let coil = Coil { winding, current: [0.0; 3], alignment };
    let mass = random.chance(0.3).then(|| random.between(1e-5, 5e-4));
    let kind = SegmentKind::Rigid(Rigid { mass, coil: Some(coil), ..Rigid::default() });
    Segment { name: ["coilA", "coilB", "coilC"][set].into(), length, kind }
}

/// 0.5 to 7 T along one axis of the scanner, or, for magnets, some tens of mT in any direction.
fn field(random: &mut Random, drive: Drive) -> Vector {
    if drive == Drive::Magnet {
        return random.vector(1.0).map(|x| 0.1 * x);
    }
    let strength = random.between(0.5, 7.0);
    let axis = if drive == Drive::Twist { 1 } else { (random.unit() * 2.999) as usize };
    std::array::from_fn(|k| if k == axis { strength } else { 0.0 })
}

/// Bend of the unbent rod by so much moment on every rigid segment (rad), by a function of the segment.
fn bend_by(segments: &[Segment], moment: impl Fn(&Rigid, f64) -> f64) -> f64 {
    let (mut beyond, mut bend) = (0.0, 0.0);
    for segment in segments.iter().rev() {
        match &segment.kind {
            SegmentKind::Rigid(rigid) => beyond += moment(rigid, segment.length),
            SegmentKind::Flexible(flexible) => bend += beyond * segment.length / flexible.stiffness.principal()[0],
        }
    }
    bend
}

fn size(v: Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The current in every winding by which all moments together bend the rod so far (A).
fn most_current(segments: &[Segment], field: Vector, bend: f64) -> f64 {
    let by_ampere = bend_by(segments, |rigid, _| {
        let per_ampere = rigid.coil.map_or([[0.0; 3]; 3], |coil| coil.dipole_per_ampere());
        per_ampere.iter().flatten().map(|x| x * x).sum::<f64>().sqrt() * size(field)
    });
    bend / by_ampere.max(f64::MIN_POSITIVE)
}

/// Makes a magnet no larger than bends the rod so far.
fn shrink_magnet(segments: &mut [Segment], field: Vector, bend: f64) {
    let found =
        bend_by(segments, |rigid, length| size(rigid.dipole_per_length.unwrap_or_default()) * length * size(field));
    for segment in segments {
        if let SegmentKind::Rigid(Rigid { dipole_per_length: Some(magnet), .. }) = &mut segment.kind {
            *magnet = magnet.map(|x| x * (bend / found));
        }
    }
}

/// A cylinder that an arm holds beside the rod, whose field there is about that of the scene before.
fn outside(scene: &Scene, random: &mut Random) -> FieldSources {
    let length = scene.total_length();
    let distance = random.between(0.6, 2.0) * length.max(0.06);
    let angle = random.within(0.0, 2.0 * PI);
    let axis = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][(random.unit() * 2.999) as usize];
    let [length_of_magnet, diameter] = [0; 2].map(|_| distance * random.between(0.2, 0.5));
    let shape = MagnetShape::Cylinder { axis, length: length_of_magnet, diameter, bore: 0.0 };
    let place = [distance * angle.cos(), distance * angle.sin(), random.within(0.3, 1.3) * length];
    let rotation = rodsweep::model::rotation_matrix(scene.base.rotation);
    let position =
        std::array::from_fn(|row| scene.base.position[row] + (0..3).map(|k| rotation[row][k] * place[k]).sum::<f64>());
    let magnet = Magnet {
        name: "arm".into(),
        position,
        moment: shape.moment(REMANENCE, axis),
        rotation: [0.0; 3],
        strength: 1.0,
        body: Some(MagnetBody { shape, is_exact: false }),
        clearance: 0.5 * shape.extent(),
    };
    let coil_load = if random.chance(0.3) { CoilLoad::Middle } else { CoilLoad::Distributed };
    FieldSources { magnets: vec![magnet], coil_load, ..FieldSources::default() }
}

/// What is driven: currents, or where the magnet outside is, or the field.
fn inputs(scene: &Scene, drive: Drive, most: f64) -> Vec<AxisSpec> {
    let mut axes = Vec::new();
    let mut add = |parameters: Vec<Parameter>, from: f64, to: f64| {
        let distribution = Distribution::Uniform { from, to };
        axes.push(AxisSpec { parameters, distribution, scales: false, points: 0 });
    };
    let coils = scene.segments.iter().enumerate().filter(|(_, segment)| matches!(&segment.kind, SegmentKind::Rigid(_)));
    for (index, _) in coils {
        let current = |axis| Parameter::Segment(index, SegmentParameter::Current(axis));
        match drive {
            Drive::Grouped => add(Axis::ALL.map(current).to_vec(), -most, most),
            Drive::Twist => add(vec![current(Axis::X)], -most, most),
            Drive::Free | Drive::Opposed => {
                Axis::ALL.into_iter().for_each(|axis| add(vec![current(axis)], -most, most))
            }
            Drive::Magnet if scene.sources.magnets.is_empty() => {
                let size = size(scene.flux_density);
                Axis::ALL.into_iter().for_each(|axis| add(vec![Parameter::FluxDensity(axis)], -size, size));
            }
            Drive::Magnet => {
                let reach = 0.2 * scene.total_length();
                for axis in Axis::ALL {
                    let parameter = Parameter::Magnet(0, rodsweep::model::MagnetParameter::Position(axis));
                    let at = parameter.get(scene);
                    add(vec![parameter], at - reach, at + reach);
                }
            }
        }
    }
    axes
}

/// The currents of the last coil set cancel those of the others but for a few percent.
fn oppose(scene: &mut Scene, random: &mut Random) {
    let mut sum = [0.0; 3];
    let mut coils: Vec<&mut Coil> = scene
        .segments
        .iter_mut()
        .filter_map(|segment| match &mut segment.kind {
            SegmentKind::Rigid(rigid) => rigid.coil.as_mut(),
            SegmentKind::Flexible(_) => None,
        })
        .collect();
    let Some(last) = coils.pop() else { return };
    for coil in coils {
        (0..3).for_each(|k| sum[k] += coil.current[k]);
    }
    last.current = sum.map(|x| -x * (1.0 + random.within(-0.05, 0.05)));
}
