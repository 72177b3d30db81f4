//! By what a run is solved: part of its identity.

use crate::backend::{BackendInfo, BackendKind, Precision};
use crate::model::{DerivativeScale, Plan, PlanOptions, Stepper};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Engine, precision, stepper, steps and tolerance of a run: what its numbers depend on beside the sweep.
///
/// A run settles it once, in `run.json`; its other shards and whoever resumes it do as it says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolutionMethod {
    /// Which engine.
    #[serde(with = "engine_name")]
    pub engine: BackendKind,
    /// Its arithmetic.
    #[serde(with = "precision_name")]
    pub precision: Precision,
    /// How the engine integrates; the reference integrates in its own way.
    #[serde(with = "stepper_name")]
    pub stepper: Stepper,
    /// Steps over the whole rod.
    pub steps: usize,
    /// Target error of tip position over rod length and of tip rotation (rad).
    pub tolerance: f64,
    /// Error of an answer over its difference to the grid of the derivatives, which error estimates use; half in what earlier
    /// versions began.
    #[serde(default = "usual_error_share")]
    pub error_share: f64,
    /// Which error estimate a row carries at least; none in what earlier versions began.
    #[serde(default)]
    pub error_floor: f64,
    /// What error estimates of derivatives are made of; nothing is known of it in what earlier versions began.
    #[serde(default, with = "ScaleNumbers")]
    pub derivative_scale: DerivativeScale,
    /// Whether samples start from anchors where they may; what earlier versions began starts from rest.
    #[serde(default)]
    pub anchors: bool,
}

impl SolutionMethod {
    /// That of an engine for a plan.
    pub fn of(info: &BackendInfo, plan: &Plan) -> SolutionMethod {
        SolutionMethod::by(info.kind, info.precision, plan)
    }

    /// The same for an engine that is not made yet.
    pub fn by(engine: BackendKind, precision: Precision, plan: &Plan) -> SolutionMethod {
        let PlanOptions { stepper, steps, tolerance, error_share, error_floor, derivative_scale, .. } = plan.options;
        let anchors = plan.anchors.is_some();
        SolutionMethod {
            engine,
            precision,
            stepper,
            steps,
            tolerance,
            error_share,
            error_floor,
            derivative_scale,
            anchors,
        }
    }

    /// The options of a plan that follow from it.
    pub fn apply(&self, options: PlanOptions) -> PlanOptions {
        let SolutionMethod { stepper, steps, tolerance, error_share, error_floor, derivative_scale, .. } = *self;
        PlanOptions { stepper, steps, tolerance, error_share, error_floor, derivative_scale, ..options }
    }

    /// What differs first between two methods: its name, this one's value, the other's.
    pub fn difference(&self, other: &SolutionMethod) -> Option<(&'static str, String, String)> {
        let fields = |method: &SolutionMethod| {
            [
                ("engine", method.engine.to_string()),
                ("precision", method.precision.to_string()),
                ("stepper", method.stepper.name().to_owned()),
                ("number of steps", method.steps.to_string()),
                ("tolerance", format!("{:e}", method.tolerance)),
                ("error share", format!("{:e}", method.error_share)),
                ("error floor", format!("{:e}", method.error_floor)),
                ("derivative scale", format!("{:?}", method.derivative_scale)),
                ("use of anchors", if method.anchors { "auto" } else { "off" }.to_owned()),
            ]
        };
        let pairs = fields(self).into_iter().zip(fields(other));
        pairs.filter(|(ours, theirs)| ours != theirs).map(|((name, ours), (_, theirs))| (name, ours, theirs)).next()
    }
}

impl fmt::Display for SolutionMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SolutionMethod { engine, precision, stepper, steps, tolerance, anchors, .. } = self;
        let anchors = if *anchors { ", from anchors" } else { "" };
        write!(f, "{engine} {precision}, {steps} steps of {}, tolerance {tolerance:.0e}{anchors}", stepper.name())
    }
}

/// How a [`DerivativeScale`] is written.
#[derive(Serialize, Deserialize)]
#[serde(remote = "DerivativeScale")]
pub(crate) struct ScaleNumbers {
    share: f64,
    floor: f64,
}

fn usual_error_share() -> f64 {
    PlanOptions::default().error_share
}

/// A value written as one of some names.
macro_rules! by_name {
    ($module:ident, $type:ty, $what:literal) => {
        pub(crate) mod $module {
            use super::*;

            pub fn serialize<S: Serializer>(value: &$type, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(value.name())
            }

            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<$type, D::Error> {
                let name = String::deserialize(deserializer)?;
                let known = <$type>::ALL.into_iter().find(|value| value.name() == name);
                known.ok_or_else(|| serde::de::Error::custom(format!(concat!("no ", $what, " is named {}"), name)))
            }
        }
    };
}
by_name!(engine_name, BackendKind, "engine");
by_name!(precision_name, Precision, "precision");
by_name!(stepper_name, Stepper, "stepper");
