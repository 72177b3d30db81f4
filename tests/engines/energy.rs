//! The potential energy: stationary at equilibria, with the loads' own derivatives, and least at stable ones.

use crate::common::golden;
use crate::common::strategy::some_scenes;
use rodsweep::input::write_scene;
use rodsweep::model::Axis;
use rodsweep::reference::{energy, solve_rod};

/// dE/d(load) at equilibrium is minus the displacement the load works on: the state itself does not matter (Hellmann
/// and Feynman's theorem).
#[test]
fn the_energy_falls_by_the_work_of_a_load() {
    for mut scene in some_scenes(20) {
        scene.loads.tip_moment = None;
        // Forces without their arm have no energy.
        scene.rigid_force_arm = true;
        let force = scene.loads.tip_force.unwrap_or_default();
        let rod = scene.rod();
        let here = solve_rod(&rod, &[]);
        let h = 1e-5;
        for axis in Axis::ALL {
            let at = |by: f64| {
                let mut rod = rod.clone();
                rod.tip_force[axis.index()] = force[axis.index()] + by;
                energy(&rod, solve_rod(&rod, &[]).m0).expect("an energy")
            };
            let found = (at(h) - at(-h)) / (2.0 * h);
            // The base may stand anywhere: energies count positions from it.
            let expected = -(here.p_tip[axis.index()] - rod.base_position[axis.index()]);
            // The third derivative of the energy by the force, times h².
            let is_right = (found - expected).abs() < 1e-5 * rod.total_length();
            assert!(is_right, "{found} {expected}\n{}", write_scene(&scene));
        }
    }
}

#[test]
fn the_least_energy_is_stable() {
    let mut compared = 0;
    for case in golden::stability() {
        let rod = case.scene.rod();
        let energies: Option<Vec<f64>> = case.equilibria.iter().map(|(m0, ..)| energy(&rod, *m0)).collect();
        let Some(energies) = energies else { continue };
        let least = (0..energies.len()).min_by(|a, b| energies[*a].total_cmp(&energies[*b])).expect("an equilibrium");
        assert_eq!(case.equilibria[least].3, 0, "{}: {energies:?}", case.scene.name);
        compared += 1;
    }
    assert!(compared > 5, "{compared}");
}
