//! Cables that are moderately limp, held at one end and drawn by a force at the other.

use crate::common::root;
use rodsweep::input::read_scene;
use rodsweep::model::Parameter;
use rodsweep::spec::{Target, Trajectory};
use rodsweep::study::{ControlJob, Outcome};

/// A cable clamped at its base is drawn to a place before it, moderately limp: errors grow by e^6 and more. The forces are those of
/// a chain of 160 links whose energy was minimised with its tip held.
#[test]
fn moderately_limp_cables_are_drawn_to_their_targets() {
    const FORCES: [(f64, [f64; 2]); 5] = [
        (1e6, [0.757796, 1.445044]),
        (2e6, [0.565116, 1.394974]),
        (3e6, [0.382952, 1.349822]),
        (4e6, [0.205234, 1.306512]),
        (5e6, [0.029866, 1.264102]),
    ];
    let cable = read_scene(&root().join("tests/data/reports/06-both-ends-held/cable4.toml")).expect("the scene");
    for (modulus, force) in FORCES {
        let mut scene = cable.clone();
        Parameter::parse(&scene, "cable.youngs_modulus").expect("a name")[0].set(&mut scene, modulus).expect("a value");
        let trajectory = Trajectory::new("one", vec![Target::at([0.8, 0.0, 0.0])]);
        let job = ControlJob::new(scene).input("loads.tip_force=20").expect("an input");
        let runs = [job.reach(&trajectory), job.follow(&trajectory)].map(|run| run.expect("a run"));
        for (how, run) in ["targets", "trajectory"].into_iter().zip(&runs) {
            let result = &run.results()[0];
            assert_eq!(result.outcome, Outcome::Reached, "{modulus} Pa, {how}: {result:?}");
            assert!(result.error_estimate <= run.options().tolerance, "{modulus} Pa, {how}: {result:?}");
            let [x, z] = force;
            let off = (result.inputs[0] - x).hypot(result.inputs[2] - z).max(result.inputs[1].abs());
            assert!(off < 2e-3, "{modulus} Pa, {how}: {result:?}");
            assert_eq!(run.mark(), None, "{modulus} Pa, {how}");
        }
    }
}
