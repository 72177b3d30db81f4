//! Workspaces in fields that vary: a search walks from neighbour to neighbour, and what counts is solved from rest.

use crate::common::root;
use rodsweep::spec::SweepSpec;
use rodsweep::study::workspace::{EngineMap, Inputs, MOST_INPUTS, Tip, TipMap, Workspace, WorkspaceJob};

/// A wire with a magnet at its tip, and a magnet that moves beside it.
fn guidewire() -> SweepSpec {
    let axis = |name: &str, from: &str, to: &str| {
        format!("[[axis]]\nparameter = \"{name}\"\nfrom = \"{from}\"\nto = \"{to}\"\n")
    };
    let axes = axis("magnets.arm.position.x", "-100 mm", "100 mm")
        + &axis("magnets.arm.position.z", "0 mm", "150 mm")
        + &axis("insertion", "33 mm", "63 mm");
    let text = format!("scene = \"guidewire.scene.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = 64\n{axes}");
    SweepSpec::parse(&root().join("tests/data/jumps/workspace.toml"), &text).expect("a sweep")
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

fn map_of(spec: &SweepSpec) -> EngineMap {
    let job = WorkspaceJob::of_sweep(spec);
    job.map(&job.inputs().expect("inputs").0).expect("a map")
}

fn inputs_of(found: &Workspace, place: usize) -> Inputs {
    let mut at = [0.0; MOST_INPUTS];
    at[..3].copy_from_slice(found.grown.inputs_of(place));
    at
}

/// Every voxel from rest is where the path from rest leads at its inputs. Stable equilibria that continue them reach further.
#[test]
fn voxels_from_rest_are_reached_from_rest() {
    let spec = guidewire();
    let job = WorkspaceJob::of_sweep(&spec).voxel(4e-3).voxel_values(false);
    let [rest, all] = [false, true].map(|any| job.clone().any_stable(any).run().expect("a workspace"));
    let size = |found: &Workspace| found.volume.expect("a body").value;
    assert!(size(&all) > 1.2 * size(&rest), "{} {}", size(&all), size(&rest));
    let mut map = map_of(&spec);
    let mut solved = |found: &Workspace| {
        let places: Vec<usize> = found.grown.reached().collect();
        let at: Vec<Inputs> = places.iter().map(|place| inputs_of(found, *place)).collect();
        let tips = map.solve_from_rest(&at).expect("tips");
        let is_there = |(place, tip): &(&usize, &Tip)| {
            let centre = found.grown.lattice.centre(found.grown.voxels[**place].cell);
            tip.usable && apart(tip.position, centre) < 0.01 * found.grown.lattice.spacing
        };
        (places.iter().zip(&tips).filter(is_there).count(), places.len())
    };
    let (there, reached) = solved(&rest);
    assert!(reached > 300 && there == reached, "{there} of {reached}");
    let (there, reached) = solved(&all);
    assert!(5 * there < 4 * reached, "{there} of {reached} are reached from rest");
}

/// A neighbour is found from the load at the base and its derivatives; the tip is the one from rest.
#[test]
fn neighbours_are_found_from_the_load_at_the_base() {
    let mut map = map_of(&guidewire());
    assert!(map.near_is_quick());
    let at = |k: usize, step: f64| -> Inputs {
        let angle = k as f64;
        let mut at = [0.0; MOST_INPUTS];
        at[..3].copy_from_slice(&[0.5 * angle.sin() + step, 0.3 + 0.2 * angle.cos(), 0.4 * (3.0 * angle).sin() + step]);
        at
    };
    let step = 0.004;
    let from: Vec<Inputs> = (0..64).map(|k| at(k, 0.0)).collect();
    let to: Vec<Inputs> = (0..64).map(|k| at(k, step)).collect();
    let here = map.solve_from_rest(&from).expect("tips");
    let taken: Inputs = std::array::from_fn(|k| if k == 0 || k == 2 { step } else { 0.0 });
    let trials: Vec<_> = to.iter().zip(&here).map(|(at, tip)| (*at, tip.base_after(&taken))).collect();
    let (near, there) = (map.near(&trials).expect("tips"), map.solve_from_rest(&to).expect("tips"));
    let both: Vec<usize> = (0..64).filter(|k| here[*k].usable && there[*k].usable).collect();
    let found = both.iter().filter(|k| near[**k].usable && apart(near[**k].position, there[**k].position) < 1e-7);
    let found = found.count();
    assert!(both.len() > 10 && 10 * found >= 9 * both.len(), "{found} of {}", both.len());
}
