//! Random scenes: chains of segments with coil sets, each sample with its own stiffness, shape, loads and pose.

use super::numbers::Random;
use rodsweep::model::{
    Axis, Base, Coil, CoilWinding, Density, Flexible, Loads, Node, Parameter, Profile, Rigid, STANDARD_GRAVITY, Scene,
    Segment, SegmentKind, SegmentParameter, ShearAxis, Stiffness, StiffnessAxis, Vector,
};

/// Each kind of load alone bends the rod by about so much, each component (rad).
const BEND: f64 = 0.6;
/// Largest current (A).
const CURRENT: f64 = 0.1;
/// Largest component of the field (T).
const FIELD: f64 = 2.0;

/// What a chain's numbers are drawn around.
#[derive(Clone, Copy)]
struct Sizes {
    /// In m
    length: f64,
    /// In N·m²
    stiffness: f64,
    coil_sets: usize,
}

impl Sizes {
    /// In N·m
    fn moment(&self) -> f64 {
        BEND * self.stiffness / self.length
    }

    /// In N
    fn force(&self) -> f64 {
        self.moment() / self.length
    }

    /// In N/m
    fn load(&self) -> f64 {
        self.force() / self.length
    }

    /// Dipole per ampere (m²)
    fn winding(&self) -> f64 {
        self.moment() / (CURRENT * FIELD * self.coil_sets.max(1) as f64)
    }
}

/// A random chain of segments. The first chains have few terms, so that every kind of kernel is met.
#[derive(Clone)]
pub struct Chain {
    number: usize,
    scene: Scene,
    sizes: Sizes,
}

impl Chain {
    /// Chain `number`, from 0: the number says which terms it has, the random numbers how large they are.
    pub fn new(number: usize, random: &mut Random) -> Chain {
        let (scene, sizes) = random_scene(number, random);
        Chain { number, scene, sizes }
    }

    /// Its scene, without loads and currents yet.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Every number in which its samples differ; every other chain is anisotropic.
    pub fn parameters(&self) -> Vec<Parameter> {
        swept(&self.scene, self.number)
    }

    /// The value of one of these for a sample, SI.
    pub fn value(&self, parameter: Parameter, random: &mut Random) -> f64 {
        value(&self.scene, self.sizes, parameter, random)
    }
}

/// Rigid and flexible segments, with the terms that a chain's number turns on.
fn random_scene(chain: usize, random: &mut Random) -> (Scene, Sizes) {
    let starts_rigid = chain % 4 == 3;
    let count = 1 + (random.unit() * 4.999) as usize + usize::from(starts_rigid);
    let kinds: Vec<bool> = (0..count).map(|k| (k % 2 == 0) != starts_rigid || random.chance(0.2)).collect();
    let lengths: Vec<f64> = kinds
        .iter()
        .map(|flexible| if *flexible { random.within(0.02, 0.06) } else { random.within(5e-3, 0.015) })
        .collect();
    let sizes = Sizes {
        length: lengths.iter().sum(),
        stiffness: random.within(2e-5, 8e-5),
        coil_sets: kinds.iter().filter(|flexible| !**flexible).count(),
    };
    let weighs = chain % 3 == 1;
    let linear_density = sizes.load() / STANDARD_GRAVITY;
    let segment = |(k, (flexible, length)): (usize, (&bool, &f64))| {
        let kind = if *flexible {
            SegmentKind::Flexible(flexible_kind(sizes, *length, chain % 5 == 4, weighs.then_some(linear_density)))
        } else {
            let winding = match k % 4 {
                1 => CoilWinding::Axes {
                    turns: [30.0, 30.0, 100.0],
                    area: [30.0, 30.0, 100.0].map(|n| sizes.winding() / n),
                },
                _ => CoilWinding::Matrix(std::array::from_fn(|_| random.vector(sizes.winding()))),
            };
            let alignment = if k % 4 == 1 { random.vector(0.3) } else { [0.0; 3] };
            let mass = weighs.then_some(linear_density * length);
            let coil = Some(Coil { winding, current: [0.0; 3], alignment });
            SegmentKind::Rigid(Rigid { mass, coil, ..Rigid::default() })
        };
        Segment { name: format!("{}{}", if *flexible { "tube" } else { "coil" }, k + 1), length: *length, kind }
    };
    let segments: Vec<Segment> = kinds.iter().zip(&lengths).enumerate().map(segment).collect();
    let loads = Loads {
        tip_force: (chain % 2 == 1 || chain % 8 == 6).then_some([0.0; 3]),
        tip_moment: (chain % 4 >= 2).then_some([0.0; 3]),
        gravity: weighs.then_some([0.0, 0.0, -STANDARD_GRAVITY]),
        distributed_force: (chain % 3 == 2).then_some([0.0; 3]),
        fluid_density: None,
    };
    let word: String = kinds.iter().map(|flexible| if *flexible { 'f' } else { 'c' }).collect();
    let scene = Scene {
        name: format!("Random {} ({word})", chain + 1),
        base: Base { position: random.vector(0.05), rotation: random.vector(1.0) },
        flux_density: [0.0, FIELD, 0.0],
        sources: Default::default(),
        loads,
        segments,
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    };
    (scene, sizes)
}

/// A flexible segment; a `general` one has every term that few scenes have.
fn flexible_kind(sizes: Sizes, length: f64, general: bool, linear_density: Option<f64>) -> Flexible {
    let value = [1.0, 1.0, 0.8].map(|factor| factor * sizes.stiffness);
    let [bending_x, bending_y, torsion] = value;
    let plain = Flexible {
        stiffness: Stiffness::Direct { bending_x, bending_y, torsion },
        rest_curvature: Profile::Constant([0.0; 3]),
        stiffness_shear: None,
        stiffness_axial: None,
        density: linear_density.map(Density::Linear),
        dipole_per_length: None,
        magnet: None,
    };
    if !general {
        return plain;
    }
    let node = |share: f64, value: Vector| Node { at: share * length, value };
    Flexible {
        stiffness: Stiffness::Nodes(vec![node(0.0, value), node(0.9, value.map(|k| 0.7 * k))]),
        rest_curvature: Profile::Nodes(vec![node(0.2, [0.0; 3]), node(0.9, [0.0; 3])]),
        // Strains of a few hundredths.
        stiffness_shear: Some([30.0, 40.0].map(|factor| factor * sizes.force())),
        stiffness_axial: Some(60.0 * sizes.force()),
        dipole_per_length: Some([0.0; 3]),
        ..plain
    }
}

/// Every number that makes a scene another; every other chain is anisotropic.
fn swept(scene: &Scene, chain: usize) -> Vec<Parameter> {
    use SegmentParameter as S;
    use StiffnessAxis as A;
    let anisotropic = chain % 2 == 1;
    let is_swept = |parameter: &Parameter| match parameter {
        Parameter::Insertion | Parameter::FluidDensity | Parameter::Wall(_) => false,
        Parameter::FieldGradient(_)
        | Parameter::FieldOrigin(_)
        | Parameter::Magnet(..)
        | Parameter::ArrayCurrent(..)
        | Parameter::MapScale(_)
        | Parameter::MapPosition(..)
        | Parameter::InnerForce(..)
        | Parameter::InnerMoment(..)
        | Parameter::ForceAlong(..) => true,
        Parameter::TipForce(_) => scene.loads.tip_force.is_some(),
        Parameter::TipMoment(_) => scene.loads.tip_moment.is_some(),
        Parameter::Gravity(_) => scene.loads.gravity.is_some(),
        Parameter::DistributedForce(_) => scene.loads.distributed_force.is_some(),
        Parameter::BasePosition(_) | Parameter::BaseRotation(_) | Parameter::FluxDensity(_) => true,
        Parameter::Segment(_, S::Stiffness(axis)) => match axis {
            A::Bending => !anisotropic,
            A::BendingX | A::BendingY => anisotropic,
            A::Torsion => true,
        },
        Parameter::Segment(_, S::StiffnessNode(_, axis)) => *axis == A::Bending || *axis == A::Torsion,
        Parameter::Segment(_, S::RestCurvature(_) | S::RestCurvatureNode(..) | S::DipolePerLength(_)) => true,
        Parameter::Segment(_, of) => matches!(of, S::Length | S::Current(_) | S::StiffnessShear(ShearAxis::Both)),
    };
    Parameter::all(scene).into_iter().filter(is_swept).collect()
}

fn value(scene: &Scene, sizes: Sizes, parameter: Parameter, random: &mut Random) -> f64 {
    use SegmentParameter as S;
    let around = |random: &mut Random| random.within(0.7, 1.4) * parameter.get(scene);
    let size = match parameter {
        Parameter::BasePosition(_) => 0.05,
        Parameter::BaseRotation(_) => 1.5,
        Parameter::FluxDensity(Axis::X | Axis::Y | Axis::Z) => FIELD,
        Parameter::TipForce(_) => sizes.force(),
        Parameter::TipMoment(_) => sizes.moment(),
        Parameter::Gravity(_) => STANDARD_GRAVITY,
        Parameter::DistributedForce(_) => sizes.load(),
        Parameter::Segment(_, S::Current(_)) => CURRENT,
        Parameter::Segment(_, S::RestCurvature(_) | S::RestCurvatureNode(..)) => BEND / sizes.length,
        Parameter::Segment(_, S::DipolePerLength(_)) => sizes.moment() / (FIELD * sizes.length),
        Parameter::Segment(..)
        | Parameter::Insertion
        | Parameter::FluidDensity
        | Parameter::FieldGradient(_)
        | Parameter::FieldOrigin(_)
        | Parameter::Magnet(..)
        | Parameter::ArrayCurrent(..)
        | Parameter::MapScale(_)
        | Parameter::MapPosition(..)
        | Parameter::Wall(_)
        | Parameter::InnerForce(..)
        | Parameter::InnerMoment(..)
        | Parameter::ForceAlong(..) => return around(random),
    };
    random.within(-size, size)
}
