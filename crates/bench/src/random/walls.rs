//! Random scenes whose tip may touch a wall: about half of them do.

use super::any_scene::any_scene;
use super::designs::design;
use super::numbers::Random;
use rodsweep::model::{Scene, Side, TipOnWall, Vector, Wall, WallShape};

/// Least and largest stiffness of a wall's tissue (N/m).
const TISSUE: (f64, f64) = (1.0, 1e4);

/// A random rod of any kind, or a catheter that people build, beside a wall in its way.
pub fn walled_scene(seed: u64, number: u64, varying: impl Fn(&Scene, &mut Random) -> Scene) -> Scene {
    let mut random = Random(seed ^ number.wrapping_mul(0xc2b2_ae3d_27d4_eb4f));
    let mut scene = match number % 3 {
        0 => design(seed, number).scene,
        // Without a tip moment, with the arms of forces: else stability beside a wall is not known.
        _ => any_scene(seed, number & !(1 << 1) & !(1 << 12)),
    };
    if number % 3 == 2 {
        scene = varying(&scene, &mut random);
    }
    scene.loads.tip_moment = None;
    scene.rigid_force_arm = true;
    scene.name = format!("Wall {number}");
    scene.wall = Some(wall(&scene, &mut random));
    scene
}

fn wall(scene: &Scene, random: &mut Random) -> Wall {
    let length = scene.total_length();
    let rod = scene.rod();
    let along: Vector = std::array::from_fn(|k| rod.base_rotation[k][2]);
    let base = scene.base.position;
    let on_the_way = |share: f64, aside: Vector| -> Vector {
        std::array::from_fn(|k| base[k] + length * (share * along[k] + aside[k]))
    };
    let against = |random: &mut Random| -> Vector { std::array::from_fn(|k| -along[k] + random.within(-1.0, 1.0)) };
    let side = if random.chance(0.5) { Side::Inside } else { Side::Outside };
    let (shape, position) = match (random.unit() * 3.0) as usize {
        0 => (WallShape::Plane { normal: against(random) }, on_the_way(random.between(0.4, 1.0), random.vector(0.2))),
        kind => {
            let (radius, position) = match side {
                Side::Inside => (random.between(0.2, 0.8), on_the_way(random.between(0.2, 0.6), random.vector(0.2))),
                Side::Outside => (random.between(0.05, 0.4), on_the_way(random.between(0.7, 1.1), random.vector(0.4))),
            };
            let radius = radius * length;
            match kind {
                1 => (WallShape::Sphere { radius, side }, position),
                _ => (WallShape::Cylinder { axis: against(random), radius, side }, position),
            }
        }
    };
    let tip = match random.chance(0.35) {
        true => TipOnWall::Sticks(on_the_way(random.between(0.5, 1.0), random.vector(0.5))),
        false => TipOnWall::Slides,
    };
    Wall {
        shape,
        position,
        rotation: if random.chance(0.3) { random.vector(0.5) } else { [0.0; 3] },
        tip_radius: if random.chance(0.3) { random.between(1e-3, 0.02) * length } else { 0.0 },
        stiffness: random.chance(0.4).then(|| random.between(TISSUE.0, TISSUE.1)),
        friction: random.chance(0.5).then(|| random.between(0.05, 1.0)),
        tip,
    }
}
