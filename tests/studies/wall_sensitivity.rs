//! Which number a force at a wall depends on.

use crate::common::walls::{EI, LENGTH, wire};
use crate::sensitivity::{index, with_rows};
use rodsweep::spec::SweepSpec;
use rodsweep::study::sensitivity::{Order, Sensitivity, SensitivityJob};

const TISSUE: f64 = 120.0;

fn spec(output: &str) -> SweepSpec {
    let scene = rodsweep::input::write_scene(&wire(&format!("position = [\"-2 mm\", 0, 0]\nstiffness = {TISSUE}")));
    let inline = scene.replace("\n[", "\n[scene.").replace("[scene.[", "[[scene.");
    let text = format!(
        "[sampling]\nmethod = \"sobol\"\nsamples = 256\nseed = 5\n\
         [[axis]]\nparameter = \"wall.stiffness\"\nrelative = \"10 %\"\n\
         [[axis]]\nparameter = \"wall.position.x\"\nfrom = \"-2.2 mm\"\nto = \"-1.8 mm\"\n\
         {output}[scene]\n{inline}"
    );
    SweepSpec::parse("wall.toml".as_ref(), &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn outputs(names: &[&str]) -> Sensitivity {
    let job = SensitivityJob::of_sweep(spec("")).outputs(names);
    with_rows(job).run().unwrap_or_else(|error| panic!("{error}"))
}

/// Two springs in a row: shares of the variance of d / (1/k + 1/c) by c and d.
#[test]
fn the_force_depends_on_tissue_and_place_as_springs_do() {
    let found = outputs(&["contact.normal_force", "contact.force"]);
    let of_wire = 3.0 * EI / LENGTH.powi(3);
    // To first order: relative changes of the force by those of stiffness and place, uniform within 10 %.
    let by_stiffness = of_wire / (of_wire + TISSUE);
    let share = by_stiffness.powi(2) / (by_stiffness.powi(2) + 1.0);
    let told = index(&found, "contact.normal_force", "wall.stiffness", Order::First, "chaos").estimate.value;
    assert!((told - share).abs() < 0.02 * share + 1e-4, "{told}, of springs {share}");
    let place = index(&found, "contact.normal_force", "wall.position.x", Order::First, "chaos").estimate.value;
    assert!((place + told - 1.0).abs() < 1e-2, "{place} + {told}");
    let vector = index(&found, "contact.force", "wall.position.x", Order::First, "chaos").estimate.value;
    assert!((vector - place).abs() < 1e-3, "a force along the normal: {vector}, {place}");
}
