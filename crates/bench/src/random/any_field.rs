//! Kinds of random scenes; those of every combination of terms again, in fields that vary in space.

use super::any_scene::{FIELD, any_scene};
use super::boxes::around;
use super::designs::design;
use super::limp::limp_scene;
use super::numbers::Random;
use super::sampled::{map_file, map_text, sampled_scene};
use super::walls::walled_scene;
use rodsweep::model::{
    CoilArray, CoilLoad, FieldSources, MU0_OVER_4PI, Magnet, MagnetBody, MagnetShape, Scene, UnitDipole, Vector,
};
use rodsweep::model::{DEFAULT_CLEARANCE, rotation_matrix};
use rodsweep::spec::AxisSpec;

/// Which random scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RandomScenes {
    /// Every combination of terms in a uniform field.
    Uniform,
    /// Gradients, magnets and coils around the rod are added to it.
    Varying,
    /// Catheters that people build: tubes of real materials, sets of three windings, magnets.
    Designs,
    /// Rods that are limp under their weight or taut under a pull.
    Limp,
    /// Every combination of terms in a field that is sampled on a grid.
    Sampled,
    /// Rods of the first three kinds beside a wall in the way of their tip.
    Walls,
}

impl RandomScenes {
    /// All kinds.
    pub const ALL: [RandomScenes; 6] = [
        RandomScenes::Uniform,
        RandomScenes::Varying,
        RandomScenes::Designs,
        RandomScenes::Limp,
        RandomScenes::Sampled,
        RandomScenes::Walls,
    ];

    /// Scene `number` of the scenes of `seed`: it depends on these alone.
    pub fn scene(self, seed: u64, number: u64) -> Scene {
        match self {
            RandomScenes::Uniform => any_scene(seed, number),
            RandomScenes::Varying => {
                let mut scene = any_scene(seed, number);
                // Numbers next to each other share no random numbers.
                let mut random = Random(seed ^ number.wrapping_mul(0x9fb2_1c65_1e98_df25));
                scene.sources = sources(&scene, &mut random);
                scene
            }
            RandomScenes::Designs => design(seed, number).scene,
            RandomScenes::Limp => limp_scene(seed, number),
            RandomScenes::Sampled => sampled_scene(seed, number),
            RandomScenes::Walls => {
                walled_scene(seed, number, |scene, random| Scene { sources: sources(scene, random), ..scene.clone() })
            }
        }
    }

    /// A box of inputs around scene `number`: the currents or the magnet of a design, some of its numbers otherwise. It depends
    /// on seed and number alone.
    pub fn inputs(self, seed: u64, number: u64) -> Vec<AxisSpec> {
        match self {
            RandomScenes::Designs => design(seed, number).axes,
            _ => around(&self.scene(seed, number), &mut Random(seed ^ number.wrapping_mul(0xe703_7ed1_a0b4_28db))),
        }
    }

    /// Files that scene `number` names, beside it: name and text.
    pub fn files(self, seed: u64, number: u64) -> Vec<(String, String)> {
        match self {
            RandomScenes::Sampled => vec![(map_file(seed, number), map_text(seed, number))],
            _ => Vec::new(),
        }
    }

    /// The option of `verify` that asks for it; empty for the usual one.
    pub fn option(self) -> &'static str {
        match self {
            RandomScenes::Uniform => "",
            RandomScenes::Varying => "--varying-fields",
            RandomScenes::Designs => "--designs",
            RandomScenes::Limp => "--limp",
            RandomScenes::Sampled => "--sampled-fields",
            RandomScenes::Walls => "--walls",
        }
    }
}

/// What lies around a rod: at least one of a gradient, magnets and an array, together about as strong as its uniform field.
fn sources(scene: &Scene, random: &mut Random) -> FieldSources {
    let length = scene.total_length();
    let rotation = rotation_matrix(scene.base.rotation);
    let middle: Vector = std::array::from_fn(|k| scene.base.position[k] + 0.5 * length * rotation[k][2]);
    let mut around = Around { random, length, middle };
    let kinds = 1 + (around.random.unit() * 6.999) as usize;
    let gradient = (kinds & 1 != 0).then(|| std::array::from_fn(|_| around.random.within(-FIELD, FIELD) / length));
    let magnets = if kinds & 2 != 0 { 1 + usize::from(around.random.chance(0.5)) } else { 0 };
    let arrays = if kinds & 4 != 0 { vec![around.array()] } else { Vec::new() };
    FieldSources {
        gradient,
        origin: around.place(length),
        magnets: (0..magnets).map(|number| around.magnet(number)).collect(),
        arrays,
        maps: Vec::new(),
        coil_load: if around.random.chance(0.3) { CoilLoad::Middle } else { CoilLoad::Distributed },
    }
}

/// What sources are drawn around.
struct Around<'a> {
    random: &'a mut Random,
    /// In m
    length: f64,
    middle: Vector,
}

impl Around<'_> {
    /// A place as far as this from the middle of the straight rod.
    fn place(&mut self, distance: f64) -> Vector {
        let direction = self.random.direction();
        std::array::from_fn(|k| self.middle[k] + distance * direction[k])
    }

    /// How far a source is from the middle (m), and its dipole (A·m²), whose field there is a share of the largest.
    fn source(&mut self) -> (f64, f64) {
        let distance = self.length * self.random.between(0.8, 4.0);
        (distance, self.random.within(0.1, 1.0) * FIELD * distance.powi(3) / (2.0 * MU0_OVER_4PI))
    }

    fn magnet(&mut self, number: usize) -> Magnet {
        let (distance, size) = self.source();
        let axis = self.random.direction();
        let is_body = self.random.chance(0.5);
        let shape = is_body.then(|| {
            let [length, diameter] = [0; 2].map(|_| distance * self.random.between(0.03, 0.3));
            MagnetShape::Cylinder { axis, length, diameter, bore: 0.0 }
        });
        let body = shape.map(|shape| MagnetBody { shape, is_exact: false });
        let clearance = shape.map_or(DEFAULT_CLEARANCE, |shape| 0.5 * shape.extent());
        Magnet {
            name: format!("magnet{}", number + 1),
            position: self.place(distance),
            moment: axis.map(|x| x * size),
            rotation: self.random.vector(2.0),
            strength: self.random.within(0.3, 1.5),
            body,
            clearance: clearance.min(0.1 * self.length),
        }
    }

    fn array(&mut self) -> CoilArray {
        let coils = 1 + (self.random.unit() * 3.999) as usize;
        let coil = |around: &mut Self| {
            let (distance, size) = around.source();
            let dipole = UnitDipole {
                position: around.place(distance),
                moment_per_ampere: around.random.direction().map(|x| x * size),
            };
            vec![dipole]
        };
        CoilArray {
            name: "array".into(),
            current: (0..coils).map(|_| self.random.within(-1.0, 1.0)).collect(),
            coils: (0..coils).map(|_| coil(self)).collect(),
            clearance: DEFAULT_CLEARANCE,
        }
    }
}
