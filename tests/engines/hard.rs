//! The cases of `verify --hard` on the engines that need no GPU: nothing wrong, and no surprise.

use rodsweep::model::RodSegment;
use rodsweep::reference::solve_rod;
use rodsweep_bench::hard::{Case, SHORTCOMINGS, Setup, Truth, Verdict, cases};
use serde_json::Value;

/// The golden tips agree with the reference to the amplified error of its integrator.
const GOLDEN: f64 = 1e-9;
/// Elastica's first integral along a rod, in units of moment squared over stiffness.
const FIRST_INTEGRAL: f64 = 1e-9;

#[test]
fn nothing_is_wrong_and_shortcomings_are_known() {
    let mut surprises = Vec::new();
    for case in cases() {
        let answer = case.answer();
        for setup in [Setup::REFERENCE, Setup::CPU_F64, Setup::CPU_F32] {
            let outcome = setup.solve(&case, &answer, |plan| setup.engine().make(plan)).expect("solved");
            let (name, status) = (setup.name(), outcome.status.name());
            let known = SHORTCOMINGS.iter().any(|known| known.case == case.name() && known.engine == name);
            let at = format!("{}, {name}: {status}, off by {:.1e}", case.name(), outcome.error);
            match outcome.verdict {
                Verdict::Wrong => surprises.push(format!("WRONG: {at}")),
                Verdict::GaveUp(None) => surprises.push(format!("new shortcoming: {at}")),
                Verdict::Ok | Verdict::NoAnswer(_) if known => surprises.push(format!("shortcoming gone: {at}")),
                Verdict::Ok | Verdict::NoAnswer(_) | Verdict::GaveUp(Some(_)) => {}
            }
        }
    }
    let list = "update the list in crates/bench/src/hard/documented.rs";
    assert!(surprises.is_empty(), "{list}:\n{}", surprises.join("\n"));
}

/// The built-in cases are the golden ones.
#[test]
fn built_in_cases_are_the_golden_ones() {
    // The file has NaN where another program found nothing.
    let text = include_str!("../data/hard_cases.json").replace("NaN", "null");
    let golden: Value = serde_json::from_str(&text).expect("valid JSON");
    let golden = golden["cases"].as_array().expect("a list");
    let cases = cases();
    assert!(cases.len() >= golden.len() + 10);
    for (golden, case) in golden.iter().zip(&cases) {
        assert_eq!(golden["name"], case.name());
        let natural = golden["equilibria"].as_array().expect("a list").iter().find(|e| e["natural"] == true);
        let tip = natural.expect("the branch from rest")["p_str"].as_array().expect("a vector");
        if let Truth::Tip(p) = case.truth {
            for (x, golden) in p.iter().zip(tip) {
                let golden: f64 = golden.as_str().expect("digits").parse().expect("a number");
                // Below the last digit, and what the list takes for zero.
                assert!((x - golden).abs() <= 1e-15 * golden.abs() + 1e-30, "{}: {x} is not {golden}", case.name());
            }
        }
        assert_eq!(golden["input"]["segments"].as_array().map(Vec::len), Some(case.scene.segments.len()));
        let length = |value: &Value| value["length"].as_f64().expect("a length");
        let total: f64 = golden["input"]["segments"].as_array().expect("a list").iter().map(length).sum();
        assert_eq!(total, case.scene.total_length(), "{}", case.name());
    }
}

/// Where the reference has an answer and another program or a closed form too, they agree.
#[test]
fn the_reference_agrees_with_other_truths() {
    let mut worst = (0.0, String::new());
    for case in cases() {
        let (Truth::Tip(tip), found) = (case.truth, solve_rod(&case.scene.rod(), &[])) else { continue };
        if !found.status.is_success() {
            continue;
        }
        let apart = (0..3).map(|k| (tip[k] - found.p_tip[k]).powi(2)).sum::<f64>().sqrt();
        let error = apart / case.scene.total_length();
        if error.is_nan() || error > worst.0 {
            worst = (error, case.name().to_owned());
        }
    }
    println!("{worst:?}");
    assert!(worst.0 <= GOLDEN, "{worst:?}");
}

/// Without load per length, m_b . K^-1 m_b / 2 + m_b . u* + n . t is the same at both ends of a uniform rod, and m is
/// zero at a free tip.
#[test]
fn a_first_integral_holds() {
    let mut checked = 0;
    for case in cases().iter().filter(|case| is_uniform(case)) {
        let found = solve_rod(&case.scene.rod(), &[]);
        if !found.status.is_success() {
            continue;
        }
        let rod = case.scene.rod();
        let RodSegment::Flexible(flexible) = rod.segments[0] else { unreachable!("one flexible segment") };
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let [base, tip] = [rod.base_rotation, found.R_tip].map(|rows| rows.map(|row| row[2]));
        let bend = std::array::from_fn(|k| found.m0[k] / flexible.stiffness[k]);
        let at_base = 0.5 * dot(found.m0, bend) + dot(found.m0, flexible.rest_curvature) + dot(rod.tip_force, base);
        let error = (at_base - dot(rod.tip_force, tip)) * rod.total_length().powi(2) / flexible.stiffness[0];
        let size = 1.0 + dot(found.m0, bend) * rod.total_length().powi(2) / flexible.stiffness[0];
        assert!(error.abs() <= FIRST_INTEGRAL * size, "{}: {error:e} of {size:e}", case.name());
        checked += 1;
    }
    assert!(checked >= 8, "{checked} cases");
}

/// One uniform flexible segment at an unturned base, under a tip force alone, that neither shears nor stretches.
fn is_uniform(case: &Case) -> bool {
    let rod = case.scene.rod();
    let [RodSegment::Flexible(flexible)] = rod.segments[..] else { return false };
    let zero = [0.0; 3];
    let nothing_else = rod.tip_moment == zero && flexible.load == zero && flexible.dipole == zero;
    let uniform = flexible.stiffness_rise == zero && flexible.rest_curvature_rise == zero;
    nothing_else && uniform && flexible.shear_compliance == zero && case.scene.base.rotation == zero
}
