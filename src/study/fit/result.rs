//! What a fit gives.

use crate::model::{Scene, Vector};
use crate::results::Contact;
use crate::study::witness::WitnessCheck;
use serde_json::{Value, json};

/// One fitted number, SI.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FittedParameter {
    /// Such as `tube.youngs_modulus`; joined by `+` where parameters keep their ratio.
    pub name: String,
    /// SI; empty for none.
    pub unit: &'static str,
    /// In the scene.
    pub start: f64,
    /// Fitted; of the first of several parameters.
    pub value: f64,
    /// Standard deviation; infinite where the observations do not determine it.
    pub deviation: f64,
    /// 95 % of such intervals cover the truth: low, high.
    pub interval: [f64; 2],
}

/// A direction of the parameters and what the observations say about it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Direction {
    /// Of the scaled sensitivities, over the noise.
    pub singular_value: f64,
    /// Unit vector of the parameters' weights: relative changes, or changes of curvature times length.
    pub weights: Vec<f64>,
    /// Whether the observations determine it.
    pub strength: Strength,
}

/// How well a direction is determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Strength {
    /// The observations tell it.
    Determined,
    /// The noise hides changes of half the value.
    Weak,
    /// Nothing changes along it.
    Ridge,
}

/// Fitted numbers, how sure they are, and what the observations cannot tell.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Fit {
    /// In the order in which they were named.
    pub parameters: Vec<FittedParameter>,
    /// The scene with the fitted values.
    pub scene: Scene,
    /// Row by column as [`Fit::parameters`], SI; without what no observation determines.
    pub covariance: Vec<Vec<f64>>,
    /// Strongest first.
    pub directions: Vec<Direction>,
    /// What the directions mean, in words.
    pub findings: Vec<String>,
    /// Root mean square of the distances between points and model (m).
    pub rms: f64,
    /// Root mean square of the differences between measured forces and model (N); `None` where none were measured.
    pub force_rms: Option<f64>,
    /// Standard deviation of a coordinate: as given, or estimated (m).
    pub noise: f64,
    /// Standard deviation of a coordinate as the points' own smoothness along the rod tells it (m); `None`: too few points.
    pub noise_of_points: Option<f64>,
    /// Why the points lie too far off the fitted rod, in a sentence; `None`: they do not.
    pub misfit: Option<String>,
    /// Observed coordinates and forces.
    pub observations: usize,
    /// Solutions of all shapes that it took.
    pub evaluations: usize,
    /// Whether the method came to an end.
    pub converged: bool,
    /// Model positions by shape and point, world frame (m).
    pub positions: Vec<Vec<Vector>>,
    /// Internal moments at the base by shape (N·m).
    pub base_moments: Vec<Vector>,
    /// Contact with the wall by shape; `None` without a wall.
    pub contacts: Vec<Option<Contact>>,
    /// The fitted rods, solved again by the reference.
    pub check: WitnessCheck,
    pub(super) mark: Option<String>,
}

impl Strength {
    /// The word written to files.
    pub fn name(self) -> &'static str {
        match self {
            Strength::Determined => "determined",
            Strength::Weak => "weak",
            Strength::Ridge => "ridge",
        }
    }
}

impl Fit {
    /// Doubt about the fit, in a sentence: the reference contradicts it, or the points lie too far off. `None`: there is none.
    pub fn mark(&self) -> Option<&str> {
        self.mark.as_deref()
    }

    /// Everything but the scene and the points, as JSON, SI. What is not finite is `null`.
    pub fn to_json(&self) -> Value {
        let number = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
        let parameter = |fitted: &FittedParameter| {
            json!({
                "name": fitted.name, "unit": fitted.unit, "start": fitted.start, "value": fitted.value,
                "deviation": number(fitted.deviation), "interval_95": fitted.interval.map(number),
            })
        };
        let direction = |direction: &Direction| {
            json!({
                "singular_value": number(direction.singular_value), "weights": direction.weights,
                "strength": direction.strength.name(),
            })
        };
        json!({
            "converged": self.converged,
            "parameters": self.parameters.iter().map(parameter).collect::<Vec<_>>(),
            "covariance": self.covariance,
            "directions": self.directions.iter().map(direction).collect::<Vec<_>>(),
            "findings": self.findings,
            "rms": self.rms,
            "force_rms": self.force_rms,
            "noise": self.noise,
            "noise_of_points": self.noise_of_points,
            "misfit": self.misfit,
            "observations": self.observations,
            "evaluations": self.evaluations,
            "check": self.check,
            "distrusted": self.mark(),
        })
    }
}
