//! Targets that stand for a line, and searches that begin elsewhere than at rest.

use crate::controllers::{circle, cpu, inputs, p6};
use rodsweep::model::Stepper;
use rodsweep::spec::Target;
use rodsweep::study::{ControlOptions, Controller, Outcome};

#[test]
fn a_target_that_is_free_along_a_direction_stands_for_a_line() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -0.3, 0.3)]);
    let follow = |options: ControlOptions, targets: &[Target]| {
        let options = options.with_tolerance(1e-8);
        let mut control = Controller::new(&scene, &inputs, options, Stepper::Dop853, &mut cpu).expect("a controller");
        control.follow(targets).expect("points")
    };
    // Along z, as without that coordinate.
    let targets = circle([0.0, -0.04, 0.05], 0.008, 12);
    let of_plane = follow(ControlOptions::default().with_coordinates([true, true, false]), &targets);
    let of_lines = follow(ControlOptions::default().with_free_direction(Some([0.0, 0.0, 1.0])), &targets);
    for (a, b) in of_plane.iter().zip(&of_lines) {
        assert_eq!((a.outcome, b.outcome), (Outcome::Reached, Outcome::Reached));
        assert!(a.inputs.iter().zip(&b.inputs).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} {b:?}");
    }
    // Slanted: the tips lie on the lines, whatever the depth of the target.
    let along = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
    let slanted = ControlOptions::default().with_free_direction(Some(along));
    let moved: Vec<Target> = of_plane
        .iter()
        .enumerate()
        .map(|(k, point)| Target::at(std::array::from_fn(|a| point.tip[a] + 0.002 * k as f64 * along[a])))
        .collect();
    for (point, line) in follow(slanted, &moved).iter().zip(&of_plane) {
        assert_eq!(point.outcome, Outcome::Reached, "{point:?}");
        let way: Vec<f64> = (0..3).map(|a| point.tip[a] - line.tip[a]).collect();
        let depth: f64 = way.iter().zip(along).map(|(x, d)| x * d).sum();
        let beside = way.iter().zip(along).map(|(x, d)| (x - depth * d).powi(2)).sum::<f64>().sqrt();
        assert!(beside < 2e-8, "{beside} m beside the line");
    }
}

#[test]
fn a_search_begins_where_it_is_told() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -0.3, 0.3)]);
    let mut control =
        Controller::new(&scene, &inputs, ControlOptions::default(), Stepper::Dop853, &mut cpu).expect("a controller");
    let there = control.follow(&circle([0.0, -0.04, 0.05], 0.001, 1)).expect("points").remove(0);
    let target = Target::at(there.tip);
    control.begin_at(&there.inputs);
    let again = control.follow(&[target]).expect("points").remove(0);
    assert_eq!((again.outcome, again.iterations), (Outcome::Reached, 0), "{again:?}");
}
