//! A random scene for every combination of terms.

use super::numbers::Random;
use rodsweep::model::{
    Base, Coil, CoilWinding, Density, Flexible, Frame, InnerLoad, LoadPlace, Loads, Node, Profile, Rigid,
    STANDARD_GRAVITY, Scene, Segment, SegmentKind, Stiffness, Vector,
};

/// One bit of a scene's number each: 8192 scenes in a row have every combination once.
const TERMS: [&str; 13] = [
    "tip_force",
    "tip_moment",
    "gravity",
    "distributed_force",
    "coil",
    "rigid_magnet",
    "flexible_magnet",
    "shear",
    "stretch",
    "taper",
    "curved",
    "anisotropic",
    "armless",
];

/// How far a scene's loads bend it, all of them together (rad): anything between.
const LEAST_BEND: f64 = 0.3;
const MOST_BEND: f64 = 10.0;
/// Largest component of the field (T).
pub(super) const FIELD: f64 = 2.0;
/// Largest current (A).
const CURRENT: f64 = 0.1;

/// What a scene's numbers are drawn around.
struct Draw<'a> {
    number: u64,
    random: &'a mut Random,
    /// In m
    length: f64,
    /// In N·m²
    stiffness: f64,
    /// In rad
    bend: f64,
}

/// Scene `number` of the scenes of `seed`: it depends on these two alone.
pub fn any_scene(seed: u64, number: u64) -> Scene {
    // Numbers next to each other share no random numbers.
    let mut random = Random(seed);
    let key = random.bits();
    let mut random = Random(key ^ number.wrapping_mul(0xd6e8_feb8_6659_fd93));
    let (length, stiffness) = (random.between(5e-3, 1.0), random.between(1e-8, 1e-3));
    let bend = random.between(LEAST_BEND, MOST_BEND);
    Draw { number, random: &mut random, length, stiffness, bend }.scene()
}

impl Draw<'_> {
    fn has(&self, term: &str) -> bool {
        TERMS.iter().position(|name| *name == term).is_some_and(|bit| (self.number >> bit) & 1 == 1)
    }

    /// In N·m, a share of what bends the rod.
    fn moment(&mut self) -> f64 {
        self.random.within(0.1, 1.0) * self.bend * self.stiffness / self.length
    }

    /// A vector of this size, now and then along the unbent rod of a base that is not turned.
    fn vector(&mut self, size: f64) -> Vector {
        if self.random.chance(0.1) {
            return [0.0, 0.0, self.random.within(-size, size)];
        }
        self.random.vector(size)
    }

    fn scene(mut self) -> Scene {
        let mut kinds = self.kinds();
        let count = kinds.len() as f64;
        let segments: Vec<Segment> = kinds
            .drain(..)
            .enumerate()
            .map(|(k, flexible)| {
                let share = if flexible { self.random.within(0.4, 1.6) } else { self.random.within(0.1, 0.8) };
                let length = share * self.length / count;
                let kind = if flexible { self.flexible(length) } else { self.rigid(length) };
                Segment { name: format!("{}{}", if flexible { "tube" } else { "coil" }, k + 1), length, kind }
            })
            .collect();
        let force = self.moment() / self.length;
        let load = self.moment() / self.length.powi(2);
        let loads = Loads {
            tip_force: self.has("tip_force").then(|| self.vector(force)),
            tip_moment: if self.has("tip_moment") { Some(self.tip_moment()) } else { None },
            gravity: self.has("gravity").then(|| self.vector(STANDARD_GRAVITY)),
            distributed_force: self.has("distributed_force").then(|| self.vector(load)),
            fluid_density: None,
        };
        let turned = self.random.chance(0.7);
        let base = match turned {
            true => Base { position: self.random.vector(0.5), rotation: self.random.vector(2.0) },
            false => Base::default(),
        };
        let flux_density = self.vector(FIELD);
        let inner_loads = self.inner_loads(&segments);
        Scene {
            name: format!("Random {}", self.number),
            base,
            flux_density,
            sources: Default::default(),
            loads,
            segments,
            inner_loads,
            wall: None,
            inserted: 0.0,
            rigid_force_arm: !self.has("armless"),
        }
    }

    /// Half of the scenes with a force per length have a force on one segment, too.
    fn inner_loads(&mut self, segments: &[Segment]) -> Vec<InnerLoad> {
        if !self.has("distributed_force") || self.random.chance(0.5) {
            return Vec::new();
        }
        let index = (self.random.unit() * segments.len() as f64) as usize;
        let segment = &segments[index.min(segments.len() - 1)];
        let force = self.moment() / self.length;
        let (place, size) = match segment.kind {
            _ if self.random.chance(0.3) => (LoadPlace::Along, force / segment.length),
            SegmentKind::Flexible(_) => (LoadPlace::At(self.random.unit() * segment.length), force),
            SegmentKind::Rigid(_) => (LoadPlace::Middle, force),
        };
        vec![InnerLoad {
            name: "push".into(),
            segment: index,
            place,
            force: self.vector(size),
            moment: None,
            frame: Frame::World,
        }]
    }

    /// Whether each segment is flexible; some are, and some are rigid where the terms ask for it.
    fn kinds(&mut self) -> Vec<bool> {
        let starts_rigid = self.random.chance(0.25);
        let count = 1 + (self.random.unit() * 4.999) as usize;
        let mut kinds: Vec<bool> =
            (0..count).map(|k| (k % 2 == 0) != starts_rigid || self.random.chance(0.2)).collect();
        if kinds.iter().all(|flexible| !flexible) {
            kinds.push(true);
        }
        let wants_rigid = self.has("coil") || self.has("rigid_magnet") || self.has("armless");
        if wants_rigid && kinds.iter().all(|flexible| *flexible) {
            kinds.push(false);
        }
        kinds
    }

    fn tip_moment(&mut self) -> Vector {
        let moment = self.moment();
        self.vector(moment)
    }

    /// In kg/m, such that gravity bends the rod.
    fn linear_density(&mut self) -> f64 {
        self.moment() / self.length.powi(2) / STANDARD_GRAVITY
    }

    /// In A·m, of a magnet or of a coil spread over the rod.
    fn dipole_per_length(&mut self) -> Vector {
        let size = self.moment() / (FIELD * self.length);
        self.vector(size)
    }

    fn rigid(&mut self, length: f64) -> SegmentKind {
        let mass = self.has("gravity").then(|| self.linear_density() * length);
        let dipole_per_length = if self.has("rigid_magnet") { Some(self.dipole_per_length()) } else { None };
        let coil = self.has("coil").then(|| {
            let winding = self.moment() / (CURRENT * FIELD);
            Coil {
                winding: CoilWinding::Matrix(std::array::from_fn(|_| self.random.vector(winding))),
                current: self.vector(CURRENT),
                alignment: self.random.vector(0.3),
            }
        });
        SegmentKind::Rigid(Rigid { mass, coil, dipole_per_length, ..Rigid::default() })
    }

    fn flexible(&mut self, length: f64) -> SegmentKind {
        let bending_x = self.stiffness * self.random.between(0.3, 3.0);
        let bending_y = bending_x * if self.has("anisotropic") { self.random.between(0.2, 5.0) } else { 1.0 };
        let torsion = bending_x * self.random.between(0.3, 1.5);
        let value = [bending_x, bending_y, torsion];
        let stiffness = match self.has("taper") {
            true => Stiffness::Nodes(self.nodes(length, |random| value.map(|k| k * random.between(0.4, 2.5)))),
            false => Stiffness::Direct { bending_x, bending_y, torsion },
        };
        // Some rods are straight.
        let curvature = if self.random.chance(0.3) { 0.0 } else { self.random.within(0.0, 3.0) / self.length };
        let rest_curvature = match self.has("curved") {
            true => Profile::Nodes(self.nodes(length, |random| random.vector(curvature))),
            false => Profile::Constant(self.random.vector(curvature)),
        };
        // Strains of up to a tenth.
        let strained = self.bend * self.stiffness / self.length.powi(2);
        SegmentKind::Flexible(Flexible {
            stiffness,
            rest_curvature,
            stiffness_shear: self
                .has("shear")
                .then(|| std::array::from_fn(|_| strained * self.random.between(10.0, 1e3))),
            stiffness_axial: self.has("stretch").then(|| strained * self.random.between(10.0, 1e3)),
            density: self.has("gravity").then(|| Density::Linear(self.linear_density())),
            dipole_per_length: if self.has("flexible_magnet") { Some(self.dipole_per_length()) } else { None },
            magnet: None,
        })
    }

    /// One to three nodes on a segment.
    fn nodes(&mut self, length: f64, value: impl Fn(&mut Random) -> Vector) -> Vec<Node> {
        let count = 1 + (self.random.unit() * 2.999) as usize;
        let node = |k: usize| {
            let at = length * (k as f64 + self.random.within(0.1, 0.9)) / count as f64;
            Node { at, value: value(self.random) }
        };
        (0..count).map(node).collect()
    }
}
