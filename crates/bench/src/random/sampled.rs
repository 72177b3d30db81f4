//! Random scenes in fields that are sampled on a grid, as finite elements or a measurement give them.

use super::any_scene::{FIELD, any_scene};
use super::numbers::Random;
use rodsweep::model::{
    CoilLoad, FieldDipole, FieldMap, FieldSources, MU0_OVER_4PI, MapGrid, RodField, Scene, SourceForm, Vector,
};
use std::fmt::Write;
use std::sync::Arc;

/// Lengths of the rod from its base to the sides of the grid.
const REACH: f64 = 1.15;
/// Lengths of the rod from its base to what makes the field: near and far.
const DISTANCES: (f64, f64) = (2.2, 6.0);
/// Nodes along each axis.
const NODES: (f64, f64) = (8.0, 24.0);

/// A random scene in the field of dipoles outside of the grid, and a gradient sometimes, all of it sampled.
pub fn sampled_scene(seed: u64, number: u64) -> Scene {
    let mut random = random(seed, number);
    let mut scene = any_scene(seed, number);
    let nodes = Nodes::draw(&scene, &mut random);
    let [x, y, z] = [0, 1, 2].map(|k| nodes.values.iter().map(|b| b[k]).collect::<Vec<f64>>());
    let grid = MapGrid::from_flux_density(nodes.origin, nodes.steps, nodes.counts, [&x, &y, &z]);
    let map = grid.map(|grid| FieldMap {
        name: "sampled".into(),
        file: map_file(seed, number),
        digest: String::new(),
        scale: random.within(0.3, 1.5),
        position: [0.0; 3],
        units: [None, None],
        grid: Arc::new(grid),
        remarks: Vec::new(),
    });
    let coil_load = if random.chance(0.3) { CoilLoad::Middle } else { CoilLoad::Distributed };
    scene.sources = FieldSources { maps: map.into_iter().collect(), coil_load, ..FieldSources::default() };
    scene
}

/// The name of the file that holds the field of a scene.
pub fn map_file(seed: u64, number: u64) -> String {
    format!("sampled-{seed}-{number}.csv")
}

/// The field of a scene as a file.
pub fn map_text(seed: u64, number: u64) -> String {
    let nodes = Nodes::draw(&any_scene(seed, number), &mut random(seed, number));
    let mut text = String::from("x,y,z,Bx,By,Bz\n");
    for (at, b) in nodes.values.iter().enumerate() {
        let p = nodes.place(at);
        let _ = writeln!(text, "{:?},{:?},{:?},{:?},{:?},{:?}", p[0], p[1], p[2], b[0], b[1], b[2]);
    }
    text
}

fn random(seed: u64, number: u64) -> Random {
    Random(seed ^ number.wrapping_mul(0x8cb9_2ba7_2f3d_8dd7))
}

/// A grid, and the field at its nodes (T), x the fastest.
struct Nodes {
    origin: Vector,
    steps: Vector,
    counts: [usize; 3],
    values: Vec<Vector>,
}

impl Nodes {
    fn draw(scene: &Scene, random: &mut Random) -> Nodes {
        let (length, base) = (scene.total_length(), scene.base.position);
        let mut field = RodField::none();
        if random.chance(0.3) {
            field.gradient = std::array::from_fn(|_| random.within(-FIELD, FIELD) / length);
            field.origin = base;
        }
        for _ in 0..1 + (random.unit() * 2.999) as usize {
            let distance = length * random.between(DISTANCES.0, DISTANCES.1);
            let size = random.within(0.1, 1.0) * FIELD * distance.powi(3) / (2.0 * MU0_OVER_4PI);
            let (at, moment) = (random.direction(), random.direction());
            field.dipoles.push(FieldDipole {
                position: std::array::from_fn(|k| base[k] + distance * at[k]),
                moment: moment.map(|x| x * size),
                clearance: 0.0,
                form: SourceForm::Point,
            });
        }
        let counts = [0; 3].map(|_| random.between(NODES.0, NODES.1) as usize);
        let steps = counts.map(|count| 2.0 * REACH * length / (count - 1) as f64);
        let mut nodes = Nodes { origin: base.map(|x| x - REACH * length), steps, counts, values: Vec::new() };
        nodes.values = (0..counts.iter().product()).map(|at| field.flux_density(nodes.place(at))).collect();
        nodes
    }

    fn place(&self, at: usize) -> Vector {
        let [x, y, _] = self.counts;
        let index = [at % x, at / x % y, at / (x * y)];
        std::array::from_fn(|k| self.origin[k] + self.steps[k] * index[k] as f64)
    }
}
