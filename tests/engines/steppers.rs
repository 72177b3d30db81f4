//! The methods of integration converge with their order, in every engine's hands the same tableau.

use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::input::read_scene;
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Stepper};
use rodsweep::reference::Reference;

const SAMPLES: usize = 64;
/// One segment, so that twice the steps are twice as many everywhere.
const SCENE: &str = r#"
name = "one segment"
[loads]
tip_force = ["0 N", "0 N", "0 N"]
[[segment]]
name = "rod"
kind = "flexible"
length = "100 mm"
stiffness = { bending = "2.5e-5 N*m^2", torsion = "2.2e-5 N*m^2" }
rest_curvature = [8, -5, 3]
"#;

/// Steps at which errors are well above round-off and fall as the order says.
fn steps(stepper: Stepper) -> usize {
    match stepper {
        Stepper::Rk4 => 12,
        Stepper::Tp6 => 3,
        Stepper::Tp7 => 3,
        Stepper::Dop853 => 2,
    }
}

#[test]
fn errors_fall_with_the_order() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("scene.toml");
    std::fs::write(&file, SCENE).expect("written");
    let scene = read_scene(&file).expect("a scene");
    let axes: Vec<Vec<Parameter>> =
        Parameter::parse(&scene, "loads.tip_force").expect("forces").into_iter().map(|axis| vec![axis]).collect();
    for stepper in Stepper::ALL {
        let mean_error = |steps: usize| {
            let options = PlanOptions { stepper, steps, tolerance: 1e-13, ..PlanOptions::default() };
            let plan = Plan::new(&scene, &axes, &[], options).expect("a plan");
            let batch = plan.batch(SAMPLES, |sample, row| {
                (0..3).for_each(|axis| row[axis] = 3e-3 * ((sample * (axis + 3) + 7 * axis) as f64).sin());
            });
            let truth = Reference::new(&plan).solve(&batch).expect("solved");
            let found = Cpu::new(&plan, Precision::F64).expect("supported").solve(&batch).expect("solved");
            let mut sum = 0.0;
            for at in 0..SAMPLES {
                assert!(found.status(at).is_success() && truth.status(at).is_success(), "{at}");
                let [a, b] = [&found, &truth].map(|solutions| solutions.vector(at, Quantity::TipPosition));
                sum += crate::common::check::difference(&a, &b);
            }
            sum / SAMPLES as f64 / scene.total_length()
        };
        let [coarse, fine] = [1, 2].map(|times| mean_error(times * steps(stepper)));
        let order = (coarse / fine).log2();
        println!("{}: {coarse:.1e}, {fine:.1e}, order {order:.2}", stepper.name());
        assert!(fine > 1e-13, "{}: {fine:e} is round-off", stepper.name());
        assert!((order - f64::from(stepper.order())).abs() < 0.8, "{}: order {order}", stepper.name());
    }
}

/// A sum of products of these rounds to a few units of the last place.
#[test]
fn tableaux_are_consistent() {
    for stepper in Stepper::ALL {
        let tableau = stepper.tableau();
        let name = stepper.name();
        assert_eq!([tableau.a.len(), tableau.b.len(), tableau.c.len()], [stepper.stage_count(); 3], "{name}");
        for (row, c) in tableau.a.iter().zip(tableau.c) {
            assert!((row.iter().sum::<f64>() - c).abs() < 1e-13, "{name}");
        }
        // Quadrature: as exact as the method.
        for power in 0..stepper.order() as i32 {
            let sum: f64 = tableau.b.iter().zip(tableau.c).map(|(b, c)| b * c.powi(power)).sum();
            assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-13, "{name} {power}");
        }
    }
}
