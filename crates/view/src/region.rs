//! The part of space that the page shows of a scene.

use rodsweep::draw::Surroundings;
use rodsweep::model::{Scene, Vector};

/// Sideways, below and above the base, over the rod's length: room for a rod that bends to all sides.
const SIDEWAYS: f64 = 0.6;
const BELOW: f64 = -0.15;
const ABOVE: f64 = 1.05;
/// A side is no shorter than this share of the longest, as in the figures.
const NARROWEST: f64 = 0.6;
/// Wider than what it holds.
const RIM: f64 = 1.1;

/// Limits of x, y and z (m): of the rod wherever it bends to, and of the sources that leave it a third of them.
pub fn region(scene: &Scene) -> [[f64; 2]; 3] {
    let length = scene.total_length();
    let sides = match is_turned(scene.base.rotation) {
        true => [[-1.0, 1.0]; 3],
        false => [[-SIDEWAYS, SIDEWAYS], [-SIDEWAYS, SIDEWAYS], [BELOW, ABOVE]],
    };
    let base = scene.base.position;
    let rod = std::array::from_fn(|k| sides[k].map(|side| base[k] + side * length));
    framed(Surroundings::of(scene).map_or(rod, |around| around.widened(rod)))
}

fn is_turned(rotation: Vector) -> bool {
    rotation.iter().any(|x| *x != 0.0)
}

fn framed(limits: [[f64; 2]; 3]) -> [[f64; 2]; 3] {
    let widest = limits.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    limits.map(|[low, high]| {
        let (middle, half) = (0.5 * (low + high), 0.5 * RIM * (high - low).max(NARROWEST * widest));
        [middle - half, middle + half]
    })
}
