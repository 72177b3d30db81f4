//! The 36 golden scenes of limp and taut rods, and how an engine's answers are measured against them.

use super::check::{SMALL_COLUMN, column_error, difference, natural_size, norm, pose_error};
use super::golden::{list, matrix, number, parameter, parse, scene, table, vector};
use rodsweep::backend::Backend;
use rodsweep::model::{Matrix, Parameter, Plan, PlanOptions, Quantity, Scene, Status, Vector};
use serde_json::Value;

/// A rod on which single shooting loses its digits, or nearly does.
pub struct LimpCase {
    pub scene: Scene,
    /// Parameters of the columns of `J` and `J_m0`, and what kind each is.
    pub parameters: Vec<Parameter>,
    pub kinds: Vec<String>,
    pub m0: Vector,
    /// Where it was written down.
    pub u0: Option<Vector>,
    pub p_tip: Vector,
    pub R_tip: Matrix,
    /// Six rows (tip position, tip rotation), a column for each parameter.
    pub J: Vec<Vec<f64>>,
    /// Three rows (base moment), a column for each parameter.
    pub J_m0: Vec<Vec<f64>>,
    pub margin: f64,
    pub growth_exponent: f64,
    pub stated: Stated,
}

/// How far the golden numbers can be trusted: pose over the length, moment over itself, columns.
#[derive(Clone, Copy, Debug)]
pub struct Stated {
    pub pose: f64,
    pub moment: f64,
    pub J: f64,
    pub J_m0: f64,
}

/// What an engine is off by on one scene.
#[derive(Clone, Debug)]
pub struct LimpErrors {
    pub name: String,
    pub status: Status,
    pub index: f64,
    /// Tip position over rod length, or tip rotation (rad).
    pub pose: f64,
    /// The first of them.
    pub position: f64,
    /// The engine's own estimate of that.
    pub estimate: f64,
    /// And of the columns.
    pub derivative_error: f64,
    /// Base moment over the larger of itself and the moment that bends the rod by one radian.
    pub moment: f64,
    /// Columns of (dp/L, w), relative, and the parameter of the worst.
    pub J: (f64, String),
    /// Columns of the base moment, likewise.
    pub J_m0: (f64, String),
    /// Stability margin, relative.
    pub margin: f64,
    pub passes: f64,
}

/// Tip position over the length, tip rotation (rad).
pub const POSE: f64 = 1e-9;
/// Base moment, relative.
const MOMENT: f64 = 1e-9;
/// The golden margins have six digits.
const MARGIN: f64 = 1e-5;

impl LimpErrors {
    /// Whether an engine in f64 is right: within what is stated, for columns so many times that, and its own estimate.
    pub fn are_small(&self, stated: Stated, columns: f64) -> bool {
        self.status.is_success()
            && self.index == 0.0
            && self.pose <= POSE
            && self.pose <= self.estimate + stated.pose
            && self.J.0 <= columns * stated.J
            && self.J.0 <= self.derivative_error + stated.J
            && self.J_m0.0 <= columns * stated.J_m0
            && self.moment <= MOMENT
            && self.margin <= MARGIN
    }
}

/// All of them.
pub fn cases() -> Vec<LimpCase> {
    list(&parse(include_str!("../data/golden_limp.json"))["scenes"]).iter().map(case).collect()
}

fn case(value: &Value) -> LimpCase {
    let output = &value["output"];
    let stated = &output["stated_accuracy"];
    LimpCase {
        scene: scene(&value["name"], &value["input"]),
        parameters: list(&output["params"]).iter().map(parameter).collect(),
        kinds: list(&output["params"]).iter().map(|of| of[0].as_str().expect("a kind").to_owned()).collect(),
        m0: vector(&output["m0"]),
        u0: output["u0"].is_array().then(|| vector(&output["u0"])),
        p_tip: vector(&output["p_tip"]),
        R_tip: matrix(&output["R_tip"]),
        J: table(&output["J"]),
        J_m0: table(&output["J_m0"]),
        margin: number(&output["margin_by_stable_product"]),
        growth_exponent: number(&output["growth_exponent"]),
        stated: Stated {
            pose: number(&stated["pose_over_L"]),
            moment: number(&stated["m0_relative"]),
            J: number(&stated["J"]),
            J_m0: number(&stated["J_m0"]),
        },
    }
}

/// Solves one case with its derivatives and measures the errors. Columns below a thousandth of the largest of their kind
/// are measured against that.
pub fn measure(case: &LimpCase, options: PlanOptions, make: impl Fn(&Plan) -> Box<dyn Backend>) -> LimpErrors {
    let plan = Plan::single(&case.scene, &case.parameters, options).expect("a valid plan");
    let solutions = make(&plan).solve(&plan.batch(1, |_, _| {})).expect("a solved batch");
    let units = plan.units;
    let (mut J, mut J_m0) = ((0.0, String::new()), (0.0, String::new()));
    let column = |table: &[Vec<f64>], k: usize| -> [f64; 6] {
        std::array::from_fn(|row| table.get(row).map_or(0.0, |row| row[k]))
    };
    let size = |of: [f64; 6], length: f64| {
        norm(&std::array::from_fn::<f64, 6, _>(|k| if k < 3 { of[k] / length } else { of[k] }))
    };
    for (k, parameter) in case.parameters.iter().enumerate() {
        let largest = |table: &[Vec<f64>], length: f64| {
            let of_kind = (0..case.kinds.len()).filter(|other| case.kinds[*other] == case.kinds[k]);
            of_kind.map(|other| size(column(table, other), length)).fold(0.0, f64::max)
        };
        let name = || parameter.name(&case.scene);
        let found: [f64; 6] = std::array::from_fn(|row| solutions.derivative(0, k, row));
        let natural = natural_size(&case.scene, *parameter, &units);
        // A coil at the clamp moves nothing.
        let floor = |largest: f64| SMALL_COLUMN * if largest > 0.0 { largest } else { natural };
        let small = floor(largest(&case.J, units.length));
        // Also takes NaN as the worst.
        let worse = |error: f64, worst: f64| error.is_nan() || error > worst;
        let error = column_error(&found, &column(&case.J, k), small, units.length);
        if worse(error, J.0) {
            J = (error, name());
        }
        // Loads at the tip of a taut rod move the base moment by e^-100 of what they are.
        let small = SMALL_COLUMN * largest(&case.J_m0, 1.0).max(units.moment() * natural);
        let found: [f64; 6] =
            std::array::from_fn(|row| if row < 3 { solutions.derivative(0, k, 6 + row) } else { 0.0 });
        let error = column_error(&found, &column(&case.J_m0, k), small, 1.0);
        if worse(error, J_m0.0) {
            J_m0 = (error, name());
        }
    }
    LimpErrors {
        name: case.scene.name.clone(),
        status: solutions.status(0),
        index: solutions.get(0, Quantity::StabilityIndex),
        pose: pose_error(&solutions, 0, &case.p_tip, &case.R_tip, units.length),
        position: difference(&solutions.vector(0, Quantity::TipPosition), &case.p_tip) / units.length,
        estimate: solutions.get(0, Quantity::ErrorEstimate),
        derivative_error: solutions.get(0, Quantity::DerivativeError),
        moment: difference(&solutions.vector(0, Quantity::BaseMoment), &case.m0) / norm(&case.m0).max(units.moment()),
        J,
        J_m0,
        margin: (solutions.get(0, Quantity::StabilityMargin) / case.margin - 1.0).abs(),
        passes: solutions.get(0, Quantity::Iterations),
    }
}
