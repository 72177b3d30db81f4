//! Rods that hang or are pulled so hard that what happens at the base hardly tells at the tip, and the other way about.

use super::any_scene::any_scene;
use super::numbers::Random;
use rodsweep::model::{Loads, Rod, RodSegment, Scene, Vector};

/// Growth exponents that are drawn. Single passes lose their digits from about 12 on.
const GROWTH: (f64, f64) = (4.0, 60.0);

/// A random scene whose weight, and whose pull at the tip, are scaled to a growth exponent.
pub fn limp_scene(seed: u64, number: u64) -> Scene {
    let mut random = Random(seed ^ number.wrapping_mul(0x8ebc_6af0_9c88_c6e3));
    // Both terms that make a rod limp or taut, and any of the others.
    let mut scene = any_scene(seed, number | 0b1001);
    scene.name = format!("Limp {number}");
    let is_taut = random.chance(0.4);
    if is_taut {
        let rod = scene.rod();
        let along: Vector = std::array::from_fn(|k| rod.base_rotation[k][2]);
        let size = random.between(1e-4, 1.0);
        scene.loads.tip_force = Some(std::array::from_fn(|k| size * (along[k] + random.within(-0.4, 0.4))));
    }
    let wanted = random.between(GROWTH.0, GROWTH.1);
    // The exponent goes with the root of the forces, unless shear and stretch make it steeper.
    for _ in 0..20 {
        let by = (wanted / pulled(scene.rod()).growth().max(1e-9)).powi(2);
        scale(&mut scene, by.clamp(0.1, 10.0));
    }
    scene
}

/// Without magnets, whose share does not grow with forces.
fn pulled(mut rod: Rod) -> Rod {
    for segment in &mut rod.segments {
        if let RodSegment::Flexible(flexible) = segment {
            flexible.dipole = [0.0; 3];
        }
    }
    rod
}

fn scale(scene: &mut Scene, by: f64) {
    let Loads { tip_force, gravity, distributed_force, .. } = &mut scene.loads;
    let inner = scene.inner_loads.iter_mut().flat_map(|force| &mut force.force);
    let whole = [tip_force, gravity, distributed_force].into_iter().flatten().flatten();
    whole.chain(inner).for_each(|x| *x *= by);
}
