//! The wall beside the rod, for the page to draw. What it does to the tip stands in the solution.

use rodsweep::model::{RodWall, Scene, Surface};
use serde_json::{Value, json};

/// The wall of a scene; null without one.
pub fn wall(scene: &Scene) -> Value {
    let Some(wall) = scene.wall else { return Value::Null };
    let RodWall { kind, position, axis, radius, tip_radius, .. } = wall.rod_wall();
    let surface = match kind.surface {
        Surface::Plane => "plane",
        Surface::Sphere => "sphere",
        Surface::Cylinder => "cylinder",
    };
    json!({
        "kind": surface,
        "position": position,
        "axis": axis,
        "radius": radius,
        "outside": kind.outside,
        "tip_radius": tip_radius,
        "friction": wall.friction.filter(|_| kind.sticks),
    })
}
