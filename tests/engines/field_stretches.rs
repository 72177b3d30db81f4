//! Paths from rest in fields that vary: across a stretch that is not stable, into a magnet, past one, on a limp rod. The engines
//! say what the reference says.

use crate::stretches::{distance, file, loaded, plan, solve};
use rodsweep::backend::Precision;
use rodsweep::cpu::Cpu;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::input::read_scene;
use rodsweep::model::{Quantity, Scene, Solutions, Status};
use rodsweep::reference::Reference;

fn scene(name: &str) -> Scene {
    read_scene(&file(name)).expect("the scene reads")
}

/// The CPU engine in f64 with 24 steps a segment, the reference, and how far their tips are apart, over the length.
fn both(scene: &Scene) -> ([Solutions; 2], f64) {
    let plan = plan(scene, Precision::F64, 24);
    let found = solve(&plan, &mut Cpu::new(&plan, Precision::F64).expect("supported"));
    let truth = solve(&plan, &mut Reference::new(&plan));
    let apart = distance(&found, &truth, scene.total_length());
    ([found, truth], apart)
}

/// Under the tip moment the symmetric part of the stiffness is not positive from 0.4410 of the load to 0.4436, while the margin stays
/// above 0.07: the rod does not diverge.
#[test]
fn paths_lead_across_a_short_stretch_without_divergence() {
    let scene = scene("field_stretch.toml");
    for share in [0.44, 0.441, 0.442, 0.444, 0.446, 0.45, 0.5, 0.8, 1.0] {
        let ([found, truth], apart) = both(&loaded(&scene, share));
        assert_eq!([found.status(0), truth.status(0)], [Status::Ramped; 2], "{share}");
        assert!(apart < 1e-8, "{share}: {apart:.1e}");
        for (found, name) in [(found, "cpu"), (truth, "reference")] {
            let is_definite = found.get(0, Quantity::StabilityIndex) == 0.0;
            assert_eq!(is_definite, share != 0.442, "{name} at {share}");
            assert!(found.get(0, Quantity::StabilityMargin) > 0.07, "{name} at {share}");
        }
    }
}

/// A shader leaves the stretch to the CPU.
#[test]
fn single_precision_crosses_it_on_the_cpu() {
    let scene = scene("field_stretch.toml");
    let plan = plan(&scene, Precision::F32, 24);
    let found = solve(&plan, &mut Cpu::new(&plan, Precision::F32).expect("supported"));
    let truth = solve(&plan, &mut Reference::new(&plan));
    assert_eq!([found.status(0), truth.status(0)], [Status::Ramped; 2]);
    assert!(distance(&found, &truth, scene.total_length()) < 1e-3);
    let Some(device) = device_or_skip("an unstable stretch in a varying field on the GPU") else { return };
    let found = solve(&plan, &mut Gpu::new(device, &plan, Precision::F32).expect("supported"));
    assert_eq!(found.status(0), Status::Fold);
}

/// Under its full load the rod lies beyond the magnet, with 18 % of it at it.
#[test]
fn no_rod_passes_through_a_magnet() {
    let ([found, truth], _) = both(&scene("field_contact.toml"));
    assert_eq!([found.status(0), truth.status(0)], [Status::TooNearMagnet; 2]);
    for found in [found, truth] {
        assert!((found.get(0, Quantity::LoadFraction) - 0.17963).abs() < 1e-4);
    }
}

/// The clamped end lies beside a magnet, so that the tip is free to go where it will.
#[test]
fn a_magnet_beside_the_base_does_not_hold_the_tip() {
    let ([found, truth], apart) = both(&scene("field_passage.toml"));
    assert_eq!([found.status(0), truth.status(0)], [Status::Ramped; 2]);
    assert!(apart < 1e-9, "{apart:.1e}");
}

/// The grid of the path is too coarse for this rod; the path is followed again on that of the answer.
#[test]
fn a_limp_rod_is_followed_on_the_grid_of_the_answer() {
    let ([found, truth], apart) = both(&scene("field_limp.toml"));
    assert_eq!([found.status(0), truth.status(0)], [Status::Ramped; 2]);
    assert!(apart < 1e-6, "{apart:.1e}");
}
