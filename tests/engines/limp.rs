//! Limp and taut rods, on which errors grow beyond all digits from base to tip: the reference by multiple shooting.

use crate::common::limp::{LimpErrors, cases, measure};
use rayon::prelude::*;
use rodsweep::model::{Plan, PlanOptions};
use rodsweep::reference::Reference;
use std::time::Instant;

/// Tip position over the length, tip rotation (rad).
const POSE: f64 = 1e-9;
/// The golden margins have six digits.
const MARGIN: f64 = 1e-5;

#[test]
fn golden_scenes() {
    let cases = cases();
    assert_eq!(cases.len(), 36);
    let make = |plan: &Plan| Box::new(Reference::new(plan)) as Box<_>;
    let one = |case| {
        let start = Instant::now();
        (measure(case, PlanOptions::default(), make), start.elapsed().as_secs_f64())
    };
    let mut all: Vec<(LimpErrors, f64)> = cases.par_iter().map(one).collect();
    let mut offenders = Vec::new();
    for ((errors, seconds), case) in all.iter_mut().zip(&cases) {
        println!(
            "{:28} {:8} {:6.1e} est {:6.1e} m0 {:6.1e} J {:6.1e} {} J_m0 {:6.1e} {} margin {:6.1e} passes {} {seconds:.2} s",
            errors.name,
            errors.status.name(),
            errors.pose,
            errors.estimate,
            errors.moment,
            errors.J.0,
            errors.J.1,
            errors.J_m0.0,
            errors.J_m0.1,
            errors.margin,
            errors.passes
        );
        let stated = case.stated;
        let is_good = errors.status.is_success()
            && errors.index == 0.0
            && errors.pose <= POSE
            && errors.J.0 <= stated.J
            && errors.J_m0.0 <= stated.J_m0
            && errors.moment <= 1e-9
            && errors.margin <= MARGIN
            && errors.pose <= errors.estimate + stated.pose;
        if !is_good {
            offenders.push(format!("{errors:?}, {stated:?}"));
        }
    }
    assert!(offenders.is_empty(), "\n{}", offenders.join("\n"));
}
