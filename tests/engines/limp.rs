//! Limp and taut rods, on which errors grow beyond all digits from base to tip: the reference by multiple shooting.

use crate::common::limp::{LimpErrors, cases, measure};
use rayon::prelude::*;
use rodsweep::model::{Plan, PlanOptions, RodSegment, Status};
use rodsweep::reference::{Reference, solve_rod};
use std::time::Instant;

/// No estimate is larger; errors are 1e-11 at most.
const ESTIMATE: f64 = 2e-8;

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
        if !errors.are_small(stated, 1.0) || errors.estimate.is_nan() || errors.estimate > ESTIMATE {
            offenders.push(format!("{errors:?}, {stated:?}"));
        }
    }
    assert!(offenders.is_empty(), "\n{}", offenders.join("\n"));
}

/// Rods that are soft in torsion seem to fold on meshes that do not count it.
#[test]
fn soft_torsion_is_no_fold() {
    let cases: Vec<_> = cases().into_iter().filter(|case| case.scene.name.contains("soft_torsion")).collect();
    assert_eq!(cases.len(), 4);
    let shares = [0.05, 0.15, 0.19, 0.34, 0.5, 0.75];
    let all: Vec<_> = cases.iter().flat_map(|case| shares.map(|share| (case, share))).collect();
    all.par_iter().for_each(|(case, share)| {
        let mut rod = case.scene.rod();
        rod.tip_force = rod.tip_force.map(|x| share * x);
        for segment in &mut rod.segments {
            if let RodSegment::Flexible(flexible) = segment {
                flexible.load = flexible.load.map(|x| share * x);
            }
        }
        let found = solve_rod(&rod, &[]);
        assert_eq!(found.status, Status::Ramped, "{} at {share}", case.scene.name);
    });
}
