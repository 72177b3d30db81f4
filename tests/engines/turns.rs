//! Folds that are seen as turns of the load along the curve of equilibria: where they lie, and that nobody else is asked.

use crate::common::root;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{PlanOptions, Quantity, Solutions, Status, Stepper};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{Memory, SweepJob};
use rodsweep::table::Values;

/// Two coils on a rod, 1.5 T across.
const TWO_COILS: &str = r#"
[field]
flux_density = [0, "1.5 T", 0]
[[segment]]
name = "body"
kind = "flexible"
length = "60 mm"
tube = { inner_radius = "0.5 mm", outer_radius = "0.8 mm" }
youngs_modulus = "8 MPa"
poisson_ratio = 0.48
[[segment]]
name = "coilA"
kind = "rigid"
length = "10 mm"
coil = { turns = [50, 50, 100], area = ["20 mm^2", "20 mm^2", "3 mm^2"], current = [0, 0, 0] }
[[segment]]
name = "neck"
kind = "flexible"
length = "25 mm"
tube = { inner_radius = "0.5 mm", outer_radius = "0.8 mm" }
youngs_modulus = "8 MPa"
poisson_ratio = 0.48
[[segment]]
name = "coilB"
kind = "rigid"
length = "10 mm"
coil = { turns = [50, 50, 100], area = ["20 mm^2", "20 mm^2", "3 mm^2"], current = [0, 0, 0] }
"#;

/// Currents of both coils (mA) and the load of the fold, by a program that shares nothing with this one: single shooting by RK4 in
/// 96 steps a tube, load steps down to 1e-10, each with a first correction below 0.01 rad.
const JUDGED: [([f64; 6], f64); 8] = [
    ([-52.9, -36.0, 60.0, 69.8, -35.4, 53.6], 0.5639895351),
    ([69.5, -19.8, 10.7, -59.5, -35.7, -50.5], 0.4031436656),
    ([-77.8, -88.7, 50.3, 97.4, 8.8, -81.1], 0.4114815810),
    ([-87.8, -50.3, -92.3, 78.6, -98.8, -31.1], 0.2282804815),
    ([-84.9, -27.9, 90.4, 95.1, -14.5, 61.5], 0.7682512842),
    ([82.9, 1.9, 83.3, -57.0, -36.1, 6.5], 0.4726965166),
    ([-65.9, -47.8, 18.6, 71.7, -1.5, 52.8], 0.6493388817),
    ([98.9, -24.0, -43.6, -80.1, -91.4, 15.0], 0.2655231498),
];

/// Of the judge's load.
const LOAD: f64 = 1e-6;

fn sweep(scene: &str, axes: &[(&str, f64, f64)], samples: u64, output: &str) -> SweepSpec {
    let axis =
        |(name, from, to): &(&str, f64, f64)| format!("[[axis]]\nparameter = \"{name}\"\nfrom = {from}\nto = {to}\n");
    let axes: String = axes.iter().map(axis).collect();
    let text = format!(
        "scene = \"<scene>\"\n[sampling]\nmethod = \"sobol\"\nsamples = {samples}\n{axes}\n[output]\n{output}\n"
    );
    SweepSpec::parse_with(&root().join("sweeps/s.toml"), &text, &[("<scene>", scene)]).expect("a sweep")
}

fn two_coils(samples: u64, output: &str) -> SweepSpec {
    let names = ["coilA.current.x", "coilA.current.y", "coilA.current.z"];
    let others = ["coilB.current.x", "coilB.current.y", "coilB.current.z"];
    let axes: Vec<_> = names.into_iter().chain(others).map(|name| (name, -0.1, 0.1)).collect();
    sweep(TWO_COILS, &axes, samples, output)
}

/// Each sample of the judge's, this many times as large, by the CPU engine.
fn judged(precision: Precision, share: f64) -> Solutions {
    let options = PlanOptions { tolerance: 1e-9, stepper: Stepper::Dop853, steps: 12, ..PlanOptions::default() };
    let plan = two_coils(JUDGED.len() as u64, "").plan(options).expect("a plan");
    let batch = plan.batch(JUDGED.len(), |at, row| {
        row.iter_mut().zip(JUDGED[at].0).for_each(|(to, current)| *to = 1e-3 * share * current);
    });
    Cpu::new(&plan, precision).expect("available").solve(&batch).expect("solved")
}

#[test]
fn loads_of_turns_are_those_of_the_judge() {
    let found = judged(Precision::F64, 1.0);
    for (at, (_, load)) in JUDGED.iter().enumerate() {
        assert_eq!(found.status(at), Status::Fold, "sample {at}");
        assert!(found.is_seen_fold(at), "sample {at}");
        let (got, error) = (found.get(at, Quantity::LoadFraction), found.get(at, Quantity::LoadFractionError));
        assert!((got - load).abs() <= LOAD * load, "sample {at}: {got} against {load}");
        assert!((got - load).abs() <= error.max(1e-9), "sample {at}: {got} against {load}, said to err by {error}");
    }
}

/// Just below its fold a rod is solved, just above it is not: by bisection the fold is where the turn was seen.
#[test]
fn what_is_below_a_turn_is_solved_and_what_is_above_is_not() {
    let whole = judged(Precision::F64, 1.0);
    for (at, (_, load)) in JUDGED.iter().enumerate() {
        for (share, solved) in [(1.0 - 1e-4, true), (1.0 + 1e-4, false)] {
            let found = judged(Precision::F64, share * whole.get(at, Quantity::LoadFraction));
            assert_eq!(found.status(at).is_success(), solved, "sample {at} at {share} of {load}");
        }
    }
}

#[test]
fn in_single_precision_turns_are_seen_too() {
    let found = judged(Precision::F32, 1.0);
    for (at, (_, load)) in JUDGED.iter().enumerate() {
        assert_eq!(found.status(at), Status::Fold, "sample {at}");
        let (got, error) = (found.get(at, Quantity::LoadFraction), found.get(at, Quantity::LoadFractionError));
        assert!((got - load).abs() <= error, "sample {at}: {got} against {load}, said to err by {error}");
    }
}

/// Euler's load of a rod by a magnet at its tip that points against the field: its curve crosses another there and goes on
/// unstable. The crossing is seen where Euler's formula has it. That of a round rod, which may buckle to any side, is crossed by
/// two at once, and remains a doubt.
#[test]
fn a_straight_rod_buckles_and_does_not_turn() {
    const SCENE: &str = r#"
[field]
flux_density = [0, 0, "-0.5 T"]
[[segment]]
name = "rod"
kind = "flexible"
length = "0.1 m"
stiffness = { bending_x = 1e-4, bending_y = BENDING_Y, torsion = 1e-4 }
[[segment]]
name = "magnet"
kind = "rigid"
length = "5 mm"
dipole_per_length = [0, 0, 1.0]
"#;
    // A constant curvature u at the end turns the magnet by u L: EI u = mu B u L.
    let critical = |dipole: f64| 1e-4 / (0.1 * 0.5 * dipole);
    for (bending, is_round) in [("1e-4", true), ("2e-4", false)] {
        let scene = SCENE.replace("BENDING_Y", bending);
        let spec = sweep(&scene, &[("magnet.dipole_per_length.z", 0.3, 0.9)], 16, "");
        let plan = spec.plan(PlanOptions { tolerance: 1e-9, ..PlanOptions::default() }).expect("a plan");
        for at in 0..16 {
            let per_length = 0.3 + 0.04 * f64::from(at);
            let batch = plan.batch(1, |_, row| row[0] = per_length);
            let found = Cpu::new(&plan, Precision::F64).expect("available").solve(&batch).expect("solved");
            let load = critical(5e-3 * per_length);
            if load > 1.0 {
                assert!(found.status(0).is_success(), "sample {at}: load {load}");
                continue;
            }
            assert_eq!(found.status(0), Status::Fold, "sample {at}: load {load}");
            assert_eq!(found.is_seen_fold(0), !is_round, "sample {at}: load {load}");
            let (got, error) = (found.get(0, Quantity::LoadFraction), found.get(0, Quantity::LoadFractionError));
            let most = if found.is_seen_fold(0) { LOAD } else { 1e-4 };
            assert!((got - load).abs() <= most * load, "sample {at}: {got} against {load}");
            assert!((got - load).abs() <= error, "sample {at}: {got} against {load}, said to err by {error}");
        }
    }
}

/// Second attempts are for doubt alone, and the row of every fold has its load.
#[test]
fn seen_folds_are_not_solved_again() {
    let spec = two_coils(2048, "quantities = [\"tip_position\", \"load_fraction\"]\nformat = \"csv\"");
    let mut rows = Memory::new();
    let summary = SweepJob::new(spec).spot_check(None).run(&mut rows).expect("solved");
    let table = rows.into_table();
    let column = table.columns.iter().find(|column| column.name == "status").expect("statuses");
    let Values::Status(statuses) = &column.values else { panic!("no statuses") };
    let loads = table.numbers("load_fraction").expect("load fractions");
    let folds = statuses.iter().filter(|status| **status == Status::Fold).count();
    assert!(folds > 10, "{folds} folds");
    for (at, (status, load)) in statuses.iter().zip(&loads).enumerate() {
        let is_there = *load > 0.0 && *load <= 1.0;
        assert!(is_there, "sample {at} {}: load fraction {load}", status.name());
        assert_eq!(*status == Status::Fold, *load < 1.0, "sample {at} {}: load fraction {load}", status.name());
    }
    // Rows whose error estimate is in doubt are solved again, too.
    let for_folds = summary.attempts - summary.refined;
    assert!(for_folds < folds as u64 / 2, "{for_folds} second attempts for {folds} folds");
}
