//! Derivatives of the base moment are taken where they are wanted; nothing else changes with them.

use crate::common::strategy::some_scenes;
use rayon::prelude::*;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Solutions, Status};

const SCENES: usize = 1500;

/// Of the first segment, so that every scene has them.
fn parameters(scene: &Scene) -> Vec<Parameter> {
    let first = &scene.segments[0].name;
    let names = ["loads.tip_force".to_string(), "base.rotation".into(), format!("{first}.length")];
    names.iter().flat_map(|name| Parameter::parse(scene, name).expect("a parameter")).collect()
}

fn solve(scene: &Scene, precision: Precision, base_moment_rows: bool) -> Solutions {
    let options = PlanOptions { base_moment_rows, ..PlanOptions::default() };
    let plan = Plan::single(scene, &parameters(scene), options).expect("a plan");
    let mut lanes = Cpu::new(&plan, precision).expect("the CPU engine");
    lanes.solve(&plan.batch(1, |_, _| {})).expect("solutions")
}

#[test]
fn rows_are_the_same_without_derivatives_of_the_base_moment() {
    let compare = |scene: &Scene| {
        for precision in [Precision::F64, Precision::F32] {
            let [with, without] = [true, false].map(|rows| solve(scene, precision, rows));
            let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
            for column in 0..Quantity::COUNT {
                // Numbers of a failed sample mean nothing.
                if with.status(0).is_success() || column == Quantity::Status.column() {
                    let [a, b] = [&with, &without].map(|solutions| solutions.values.get(0, column));
                    assert!(same(a, b), "{} {precision:?} column {column}: {a:e} {b:e}", scene.name);
                }
            }
            for derivative in (0..parameters(scene).len()).filter(|_| with.status(0).is_success()) {
                for row in 0..6 {
                    let [a, b] = [&with, &without].map(|solutions| solutions.derivative(0, derivative, row));
                    let size = (0..6).map(|row| with.derivative(0, derivative, row).abs()).fold(0.0, f64::max);
                    let close = (a - b).abs() <= 64.0 * precision.epsilon() * size;
                    assert!(close, "{} {precision:?} derivative {derivative}, row {row}: {a:e} {b:e}", scene.name);
                }
            }
        }
        solve(scene, Precision::F64, false).status(0)
    };
    let found: Vec<Status> = some_scenes(SCENES).par_iter().map(compare).collect();
    let solved = found.iter().filter(|status| status.is_success()).count();
    assert!(solved > SCENES * 9 / 10, "{solved} of {SCENES} were solved");
}
