//! Every equilibrium in fields that vary in space: uniform fields that are told as varying ones against complete lists, and
//! rods beside a magnet against the stationary points of an energy.

use super::branches::{branches, distance};
use super::common::{golden, root};
use super::field_energy::Chain;
use rodsweep::input::read_scene;
use rodsweep::model::{Quantity, Rod, Scene};
use rodsweep::reference::{shape_with_derivatives, stability_at};
use rodsweep_bench::random::Random;

/// The golden lists of uniform fields, a gradient of nothing added: six unknowns find what three do.
#[test]
fn the_golden_lists_are_found_with_a_gradient_of_nothing() {
    let (mut known, mut missing, mut more) = (0, Vec::new(), Vec::new());
    for case in golden::stability() {
        let mut scene = case.scene.clone();
        scene.sources.gradient = Some([0.0; 5]);
        let branches = branches(&scene);
        let solutions = &branches.solutions;
        let rows = || 0..solutions.sample_count();
        let moment = |row: usize| solutions.vector(row, Quantity::BaseMoment);
        let same = |a: [f64; 3], b: [f64; 3]| distance(a, b) < 1e-6 * distance(b, [0.0; 3]) + 1e-15;
        more.extend(
            rows()
                .filter(|row| !case.equilibria.iter().any(|(m0, ..)| same(moment(*row), *m0)))
                .map(|_| scene.name.clone()),
        );
        for (m0, _, p_tip, index) in &case.equilibria {
            known += 1;
            let Some(row) = rows().find(|row| same(moment(*row), *m0)) else {
                missing.push(format!("{} index {index}", scene.name));
                continue;
            };
            let error = distance(solutions.vector(row, Quantity::TipPosition), *p_tip);
            assert!(error < 1e-6 * scene.total_length(), "{}: {error:e}", scene.name);
            assert_eq!(solutions.get(row, Quantity::StabilityIndex) as usize, *index, "{}", scene.name);
        }
    }
    assert_eq!(missing, [""; 0], "of {known}");
    // As without the gradient.
    assert_eq!(more, ["stab_dev_10_FA", "stab_dev_10_FA"]);
}

/// A catheter beside an arm's magnet turned by `turn` about y and so many times as strong.
fn beside_a_magnet(turn: f64, strength: f64) -> Scene {
    let mut scene = read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("a good scene");
    scene.sources.magnets[0].rotation[1] = turn;
    scene.sources.magnets[0].strength = strength;
    scene
}

/// Tips and indices of the stationary points of a chain's energy to which Newton's method leads from many shapes.
fn stationary(rod: &Rod) -> Vec<([f64; 3], usize)> {
    const STARTS: usize = 150;
    let chain = Chain { rod, elements: 6 };
    let length = rod.total_length();
    let mut found: Vec<([f64; 3], usize)> = Vec::new();
    let mut random = Random(1);
    for _ in 0..STARTS {
        let (bend, slope) = (random.vector(6.0), random.vector(6.0));
        let mut u = chain.rest();
        let count = u.len() as f64;
        for (k, u) in u.iter_mut().enumerate() {
            let along = k as f64 / count;
            *u += (bend[k % 3] + slope[k % 3] * along) / length;
        }
        let mut size = f64::INFINITY;
        for _ in 0..40 {
            let step = chain.hessian(1.0, &u).lu().solve(&-chain.gradient(1.0, &u));
            let Some(step) = step else { break };
            size = step.amax() * length;
            if !size.is_finite() || size < 1e-6 {
                break;
            }
            let factor = (1.0 / size).min(1.0);
            u.iter_mut().zip(step.iter()).for_each(|(u, step)| *u += factor * step);
        }
        let tip = chain.tip(&u);
        let clear = rod.field.iter().flat_map(|field| &field.dipoles).all(|d| distance(d.position, tip) > d.clearance);
        if size < 1e-6 && clear && found.iter().all(|(other, _)| distance(*other, tip) > 1e-3 * length) {
            let values = chain.hessian(1.0, &u).symmetric_eigenvalues();
            found.push((tip, values.iter().filter(|value| **value < 0.0).count()));
        }
    }
    found
}

/// Beside a magnet the search finds what Newton's method on an energy finds, which knows neither force nor moment.
#[test]
fn lists_beside_a_magnet_are_those_of_the_energy() {
    for (turn, strength, count) in [(0.0, 1.0, 1), (2.5, 1.0, 3), (2.0, 2.0, 3), (-2.0, 4.0, 5)] {
        let scene = beside_a_magnet(turn, strength);
        let (rod, branches) = (scene.rod(), branches(&scene));
        let (solutions, length) = (&branches.solutions, rod.total_length());
        let of_energy = stationary(&rod);
        let what = format!("turned by {turn}, {strength} times as strong");
        assert_eq!((solutions.sample_count(), of_energy.len()), (count, count), "{what}");
        assert!(branches.samples[0].balanced, "{what}");
        assert_eq!(branches.branches.iter().filter(|branch| branch.from_rest).count(), 1, "{what}");
        assert!(branches.branches.is_sorted_by(|a, b| a.energy <= b.energy && b.energy.is_some()), "{what}");
        for (row, branch) in branches.branches.iter().enumerate() {
            let index = solutions.get(row, Quantity::StabilityIndex) as usize;
            let tip = solutions.vector(row, Quantity::TipPosition);
            // Six helices stand for the tube: they are off by a hundredth of its length.
            let is_there = |(other, of): &([f64; 3], usize)| distance(*other, tip) < 0.02 * length && *of == index;
            assert!(of_energy.iter().any(is_there), "{what}: {tip:?} with index {index}, not among {of_energy:?}");
            let by_reference = stability_at(&rod, branch.base).expect("an equilibrium");
            let margin = solutions.get(row, Quantity::StabilityMargin);
            assert_eq!(by_reference.index, index, "{what}");
            assert!((by_reference.margin - margin).abs() < 1e-7, "{what}: {margin}");
            let along = shape_with_derivatives(&rod, branch.base, &[length], &[]).expect("a shape");
            assert!(distance(along[0].position, tip) < 1e-9 * length, "{what}");
        }
    }
}

/// Where the path from rest is not the way to the least energy, the list says so.
#[test]
fn beside_a_strong_magnet_the_least_energy_is_elsewhere() {
    let branches = branches(&beside_a_magnet(-2.0, 4.0));
    let stable = |row: &usize| branches.solutions.get(*row, Quantity::StabilityIndex) == 0.0;
    let rows: Vec<usize> = (0..branches.solutions.sample_count()).filter(stable).collect();
    assert_eq!(rows.iter().map(|row| branches.branches[*row].from_rest).collect::<Vec<_>>(), [false, true]);
}
