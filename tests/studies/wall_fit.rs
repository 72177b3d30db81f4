//! Numbers of a wall from measured forces.

use crate::common::walls::{EI, LENGTH, wire};
use rodsweep::input::{assign, read_shapes};
use rodsweep::model::{Parameter, Scene};
use rodsweep::spec::{ObservedPoint, ObservedShape, ObservedShapes};
use rodsweep::study::{FitJob, Solve};

const TISSUE: f64 = 120.0;
const PLACES: [f64; 3] = [-1e-3, -2e-3, -3.5e-3];

fn beside(stiffness: f64) -> Scene {
    wire(&format!("position = [0, 0, 0]\nstiffness = {stiffness}"))
}

/// What a wall at these places would be measured to press with; `with_tips` adds where the tip was seen.
fn measured(truth: &Scene, with_tips: bool) -> ObservedShapes {
    let of = |place: &f64| {
        let mut scene = truth.clone();
        assign(&mut scene, &[format!("wall.position.x={place}")]).expect("a place");
        let solved = Solve::new(scene).run().expect("an answer");
        let force = solved.contact().expect("a wall").normal_force;
        // The spring of the wire behind that of the tissue.
        let of_wire = 3.0 * EI / LENGTH.powi(3);
        let in_a_row = -place / (1.0 / of_wire + 1.0 / TISSUE);
        assert!((force / in_a_row - 1.0).abs() < 2e-3, "{force} N, of two springs {in_a_row} N");
        let tip = ObservedPoint { arc_length: None, position: solved.tip_position() };
        let points = if with_tips { vec![tip] } else { Vec::new() };
        ObservedShape { known: vec![*place], points, normal_forces: vec![force] }
    };
    let known = Parameter::parse(truth, "wall.position.x").expect("a name");
    ObservedShapes { known, shapes: PLACES.iter().map(of).collect() }
}

#[test]
fn stiffness_is_found_from_forces() {
    let observed = measured(&beside(TISSUE), false);
    assert_eq!((observed.coordinate_count(), observed.force_count()), (0, 3));
    let job = FitJob::new(beside(60.0), observed).free(&["wall.stiffness"]).expect("a name");
    for job in [job.clone(), job.force_noise(1e-5)] {
        let fit = job.run().expect("a fit");
        let found = &fit.parameters[0];
        assert!((found.value / TISSUE - 1.0).abs() < 1e-6, "{found:?}");
        assert!(fit.force_rms.is_some_and(|rms| rms < 1e-9) && fit.mark().is_none(), "{fit:?}");
        let text = fit.text(&job);
        assert!(text.contains("3 forces") && text.contains("normal forces off the model"), "{text}");
    }
}

/// The force tells the wire's stiffness, the tip how far the tissue yields.
#[test]
fn forces_and_tips_tell_wire_and_tissue_apart() {
    let observed = measured(&beside(TISSUE), true);
    let mut start = beside(80.0);
    assign(&mut start, &["wire.stiffness.bending=5e-4"]).expect("a stiffness");
    let names = ["wall.stiffness", "wire.stiffness.bending_x+wire.stiffness.bending_y"];
    let fit = FitJob::new(start, observed).free(&names).expect("names").run().expect("a fit");
    for (found, truth) in fit.parameters.iter().zip([TISSUE, EI]) {
        assert!((found.value / truth - 1.0).abs() < 1e-6, "{found:?} of {truth}");
    }
    assert!(fit.rms < 1e-9, "{} m", fit.rms);
}

#[test]
fn forces_are_read_with_their_units() {
    let folder = tempfile::tempdir().expect("a folder");
    let read = |text: &str, scene: &Scene| {
        let file = folder.path().join("measured.csv");
        std::fs::write(&file, text).expect("written");
        read_shapes(&file, scene)
    };
    let scene = beside(TISSUE);
    let forces = "wall.position.x [mm],normal_force [mN]\n-1,1.2\n-1,1.3\n-2,2.4\n";
    let observed = read(forces, &scene).unwrap_or_else(|error| panic!("{error}"));
    let found: Vec<_> = observed.shapes.iter().map(|shape| (shape.known[0], shape.normal_forces.clone())).collect();
    assert_eq!(found, [(-1e-3, vec![1.2e-3, 1.3e-3]), (-2e-3, vec![2.4e-3])]);
    let both = read("x,y,z,normal_force\n-0.001,0,0.0999,\n-0.002,0,0.0999,0.003\n", &scene).expect("a table");
    assert_eq!((both.coordinate_count(), both.shapes[0].normal_forces.len()), (6, 1));
    let mut without = scene;
    without.wall = None;
    let told = read("x,y,z,normal_force\n-0.001,0,0.0999,0.001\n", &without).expect_err("no wall").to_string();
    assert!(told.contains("normal_force") && told.contains("add [wall]"), "{told}");
}
