//! How the load of a fold follows parameters: against differences of fold loads, forward columns against reciprocity, and a rod
//! whose fold scales with its loads.

use crate::common::root;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Sensitivity, Solutions, Status};
use rodsweep::spec::SweepSpec;

/// Two coils on a soft catheter that something pulls at.
const TWO_COILS: &str = r#"
[field]
flux_density = [0, "1.5 T", "0.01 T"]
[base]
rotation = [0, 0, 0]
[loads]
tip_force = [0, "0.05 mN", 0]
gravity = [0, 0, -0.5]
[[segment]]
name = "body"
kind = "flexible"
length = "60 mm"
tube = { inner_radius = "0.5 mm", outer_radius = "0.8 mm" }
youngs_modulus = "8 MPa"
poisson_ratio = 0.48
density = "1200 kg/m^3"
rest_curvature = [0.2, 0, 0]
[[segment]]
name = "coilA"
kind = "rigid"
length = "10 mm"
mass = "0.3 g"
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

/// Currents whose path ends in a fold, and what else is differentiated by, with its value in the scene.
const TWO_COIL_INPUTS: [(&str, f64); 16] = [
    ("coilA.current.x", -0.07468),
    ("coilA.current.y", -0.00539),
    ("coilA.current.z", -0.03327),
    ("coilB.current.x", 0.06183),
    ("coilB.current.y", -0.07899),
    ("coilB.current.z", -0.03549),
    ("field.flux_density.y", 1.5),
    ("field.flux_density.z", 0.01),
    ("body.youngs_modulus", 8e6),
    ("neck.youngs_modulus", 8e6),
    ("body.rest_curvature.x", 0.2),
    ("insertion", 0.105),
    ("base.rotation.x", 0.0),
    ("loads.tip_force.y", 5e-5),
    ("loads.gravity.z", -0.5),
    ("coilA.mass", 3e-4),
];

/// The same currents, and lengths: an insertion among the inputs would hold the whole length.
const TWO_COIL_LENGTHS: [(&str, f64); 8] = [
    TWO_COIL_INPUTS[0],
    TWO_COIL_INPUTS[1],
    TWO_COIL_INPUTS[2],
    TWO_COIL_INPUTS[3],
    TWO_COIL_INPUTS[4],
    TWO_COIL_INPUTS[5],
    ("neck.length", 0.025),
    ("coilA.length", 0.01),
];

/// A guidewire with a magnet at its tip beside a larger one.
const GUIDEWIRE: &str = r#"
[field]
flux_density = [0, 0, "1 mT"]
gradient = { xx = 0.01 }
[[segment]]
name = "shaft"
kind = "flexible"
length = "60 mm"
tube = { inner_radius = "0 mm", outer_radius = "0.35 mm" }
youngs_modulus = "2 MPa"
poisson_ratio = 0.48
density = "1100 kg/m^3"
[[segment]]
name = "tip"
kind = "rigid"
length = "3 mm"
dipole_per_length = [0, 0, 0.52]
[loads]
gravity = [0, 0, -9.81]
tip_force = ["0.01 mN", 0, 0]
[[magnet]]
name = "arm"
position = ["30 mm", "120 mm", "60 mm"]
axis = [0, 0, 1]
remanence = "1.4 T"
diameter = "50 mm"
length = "50 mm"
"#;

const GUIDEWIRE_INPUTS: [(&str, f64); 9] = [
    ("magnets.arm.position.x", -0.0877),
    ("magnets.arm.position.z", 0.0241),
    ("magnets.arm.strength", 1.0),
    ("field.flux_density.z", 1e-3),
    ("field.gradient.xx", 0.01),
    ("shaft.youngs_modulus", 2e6),
    ("insertion", 0.06),
    ("loads.gravity.z", -9.81),
    ("tip.dipole_per_length.z", 0.52),
];

/// Every input an axis, and all of them differentiated by.
fn sweep(scene: &str, inputs: &[(&str, f64)], output: &str) -> SweepSpec {
    let axis = |(name, value): &(&str, f64)| {
        let (from, to) = (value - 0.01 * value.abs() - 1e-9, value + 0.01 * value.abs() + 1e-9);
        format!("[[axis]]\nparameter = \"{name}\"\nfrom = {from:e}\nto = {to:e}\n")
    };
    let axes: String = inputs.iter().map(axis).collect();
    let names: Vec<String> = inputs.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let text = format!(
        "scene = \"<scene>\"\n[sampling]\nmethod = \"sobol\"\nsamples = 16\n{axes}\n[output]\nderivatives = [{}]\n{output}\n",
        names.join(", ")
    );
    SweepSpec::parse_with(&root().join("sweeps/s.toml"), &text, &[("<scene>", scene)]).expect("a sweep")
}

fn plan(scene: &str, inputs: &[(&str, f64)], sensitivity: Sensitivity) -> Plan {
    let spec = sweep(scene, inputs, "quantities = [\"fold.load\"]");
    let options = PlanOptions { tolerance: 1e-10, steps: 16, sensitivity, ..PlanOptions::default() };
    spec.plan(options).expect("a plan")
}

fn solve(plan: &Plan, rows: &[Vec<f64>]) -> (Batch, Solutions) {
    let batch = plan.batch(rows.len(), |at, row| row.copy_from_slice(&rows[at]));
    let found = Cpu::new(plan, Precision::F64).expect("available").solve(&batch).expect("solved");
    (batch, found)
}

/// How the load of the fold follows each input, and how far that may be off.
fn slopes(plan: &Plan, inputs: &[(&str, f64)]) -> Vec<(f64, f64)> {
    let row: Vec<f64> = inputs.iter().map(|(_, value)| *value).collect();
    let (_, found) = solve(plan, &[row]);
    assert!(found.is_seen_fold(0), "{:?} at {}", found.status(0), found.get(0, Quantity::LoadFraction));
    let column = |k: usize| found.fold_derivative_column(k).expect("asked for");
    (0..inputs.len()).map(|k| (found.values.get(0, column(k)), found.values.get(0, column(k) + 1))).collect()
}

/// The same by differences of loads, by a rule of fourth order.
fn differences(plan: &Plan, inputs: &[(&str, f64)]) -> Vec<f64> {
    let base: Vec<f64> = inputs.iter().map(|(_, value)| *value).collect();
    let size = |value: f64| if value == 0.0 { 1.0 } else { value.abs() };
    const POINTS: [(f64, f64); 4] = [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)];
    let mut rows = Vec::new();
    for (k, value) in base.iter().enumerate() {
        for (at, _) in POINTS {
            let mut row = base.clone();
            row[k] += at * 2e-3 * size(*value);
            rows.push(row);
        }
    }
    let (_, found) = solve(plan, &rows);
    let load = |at: usize| {
        assert_eq!(found.status(at), Status::Fold, "{:?}", rows[at]);
        found.get(at, Quantity::LoadFraction)
    };
    let of = |k: usize| POINTS.iter().enumerate().map(|(at, (_, weight))| weight * load(4 * k + at)).sum::<f64>();
    base.iter().enumerate().map(|(k, value)| of(k) / (12.0 * 2e-3 * size(*value))).collect()
}

/// Slopes against differences: to 1e-5 of what the whole input does, and within the error that they carry.
fn hold(scene: &str, inputs: &[(&str, f64)], sensitivity: Sensitivity) -> Vec<(f64, f64)> {
    let plan = plan(scene, inputs, sensitivity);
    let (found, differences) = (slopes(&plan, inputs), differences(&plan, inputs));
    for (((name, value), (slope, error)), difference) in inputs.iter().zip(&found).zip(&differences) {
        let size = if *value == 0.0 { 1.0 } else { value.abs() };
        let noise = 2e-6 * (slope.abs() * size + 1.0) / size;
        assert!((slope - difference).abs() <= 1e-5 * slope.abs() + noise, "{name}: {slope} against {difference}");
        assert!(
            (slope - difference).abs() <= error + noise,
            "{name}: {slope} against {difference}, said to err by {error}"
        );
    }
    found
}

#[test]
fn slopes_of_fold_loads_are_their_differences() {
    let forward = hold(TWO_COILS, &TWO_COIL_INPUTS, Sensitivity::Forward);
    let reciprocity = hold(TWO_COILS, &TWO_COIL_INPUTS, Sensitivity::Reciprocity);
    for ((a, _), (b, _)) in forward.iter().zip(&reciprocity) {
        assert!((a - b).abs() <= 1e-7 * a.abs().max(b.abs()), "{a} against {b}");
    }
    hold(TWO_COILS, &TWO_COIL_LENGTHS, Sensitivity::Forward);
    hold(TWO_COILS, &TWO_COIL_LENGTHS, Sensitivity::Reciprocity);
}

#[test]
fn slopes_of_fold_loads_are_their_differences_beside_a_magnet() {
    hold(GUIDEWIRE, &GUIDEWIRE_INPUTS, Sensitivity::Auto);
}

/// Where every load grows by a share, the fold comes at a load fraction that is less by the same share.
#[test]
fn all_loads_together_move_a_fold_as_their_own_share() {
    for (scene, inputs, loads) in [
        (
            TWO_COILS,
            &TWO_COIL_INPUTS[..],
            &["field.flux_density.y", "field.flux_density.z", "loads.tip_force.y", "loads.gravity.z"][..],
        ),
        (
            GUIDEWIRE,
            &GUIDEWIRE_INPUTS[..],
            &["magnets.arm.strength", "field.flux_density.z", "field.gradient.xx", "loads.gravity.z"][..],
        ),
    ] {
        let scene = scene.replace("[\"0.01 mN\", 0, 0]", "[0, 0, 0]");
        let plan = plan(&scene, inputs, Sensitivity::Auto);
        let row: Vec<f64> = inputs.iter().map(|(_, value)| *value).collect();
        let (_, found) = solve(&plan, &[row]);
        let load = found.get(0, Quantity::LoadFraction);
        let slopes = slopes(&plan, inputs);
        let together: f64 = inputs
            .iter()
            .zip(&slopes)
            .filter(|((name, _), _)| loads.contains(name))
            .map(|((_, value), (slope, _))| value * slope)
            .sum();
        assert!((together + load).abs() < 1e-6 * load, "{together} against {load}");
    }
}
