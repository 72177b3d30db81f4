//! What a run says about itself: time by stage, the pilot's choice, the spot check, where samples were made.

use crate::model::{DerivativeScale, Plan, PlanOptions, Stepper};
use crate::spec::{ScaleNumbers, stepper_name};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Busy time of each stage (s); stages overlap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Timings {
    /// Inputs of batches.
    pub build: f64,
    /// The engine.
    pub solve: f64,
    /// Second attempts.
    pub refine: f64,
    /// Searches for equilibria beside those from rest.
    pub search: f64,
    /// Tables of rows.
    pub rows: f64,
    /// Encoding and disk.
    pub write: f64,
    /// The spot check.
    pub check: f64,
    /// From start to end.
    pub total: f64,
}

/// Quantiles of an error over samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ErrorDistribution {
    /// Half of the samples are below.
    #[serde(deserialize_with = "number_or_null")]
    pub median: f64,
    /// 95 % of the samples are below.
    #[serde(deserialize_with = "number_or_null")]
    pub p95: f64,
    /// The largest.
    #[serde(deserialize_with = "number_or_null")]
    pub max: f64,
}

/// Differences between a run and the trusted backend.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SpotCheck {
    /// Samples solved twice.
    pub checked: u64,
    /// Of these, samples that both solved.
    pub compared: u64,
    /// Solved by the run, not by the trusted backend.
    pub only_run: u64,
    /// The first sample of these.
    #[serde(default)]
    pub only_run_sample: Option<u64>,
    /// Its swept parameters by name, SI.
    #[serde(default, deserialize_with = "values_or_null")]
    pub only_run_values: Vec<(String, f64)>,
    /// Solved by the trusted backend, not by the run.
    pub only_trusted: u64,
    /// Compared successes whose position or rotation is off by more than ten times the tolerance and than ten times their
    /// own error estimate.
    pub wrong: u64,
    /// |dp| / rod length.
    pub position: ErrorDistribution,
    /// Angle between tip frames (rad).
    pub rotation: ErrorDistribution,
    /// Worst derivative column of each sample: |d(dp/L, w)| over the column's norm, at least 1 % of its typical norm.
    pub derivative: ErrorDistribution,
    /// Samples whose derivatives are off by more than their row says.
    #[serde(default)]
    pub derivatives_beyond: u64,
    /// Sample with the largest position or rotation error.
    pub worst_sample: Option<u64>,
    /// Its swept parameters by name, SI.
    #[serde(deserialize_with = "values_or_null")]
    pub worst_values: Vec<(String, f64)>,
    /// Parameter of the worst derivative column.
    pub worst_derivative: Option<String>,
}

/// Rows whose path from rest was followed a second time, by other steps, and what the reference said where the ends differed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PathCheck {
    /// Whether every row that is called solved was followed; else a fixed choice.
    pub all: bool,
    /// Rows that were followed.
    pub followed: u64,
    /// Rows that were right: the second path had not arrived, or elsewhere.
    pub confirmed: u64,
    /// Rows of another equilibrium than the one from rest. They were replaced.
    pub elsewhere: u64,
    /// Rows of an equilibrium beyond the fold where the path from rest ends. They were replaced.
    pub past_fold: u64,
    /// Rows on which the reference had no sure answer; their status is `doubtful`.
    pub doubtful: u64,
    /// The first sample whose row was not confirmed.
    #[serde(default)]
    pub sample: Option<u64>,
    /// Its swept parameters by name, SI.
    #[serde(default, deserialize_with = "values_or_null")]
    pub values: Vec<(String, f64)>,
}

impl PathCheck {
    /// Rows that were wrong, or may have been.
    pub fn wrong(&self) -> u64 {
        self.elsewhere + self.past_fold + self.doubtful
    }
}

/// Anchors of a run: equilibria on a grid over the axes, from which samples start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct AnchorAccount {
    /// Points of each axis.
    pub points: Vec<usize>,
    /// Share of the cells between them from which samples may start; in the others they start from rest.
    #[serde(deserialize_with = "number_or_null")]
    pub usable_share: f64,
}

impl AnchorAccount {
    /// Those of a plan.
    pub fn of(plan: &Plan) -> Option<AnchorAccount> {
        let grid = &plan.anchors.as_ref()?.grid;
        let points = grid.axes().iter().map(|axis| axis.points).collect();
        Some(AnchorAccount { points, usable_share: grid.usable_share() })
    }

    /// One line.
    pub fn explain(&self) -> String {
        let points: Vec<String> = self.points.iter().map(usize::to_string).collect();
        let share = 100.0 * self.usable_share;
        format!("{}; samples of {share:.1} % of the cells start from them, others from rest", points.join(" x "))
    }
}

/// The method of integration and the resolution that a pilot found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PilotChoice {
    /// The method.
    #[serde(with = "stepper_name")]
    pub stepper: Stepper,
    /// Steps over the whole rod.
    pub steps: usize,
    /// Stages of a pass over the rod.
    #[serde(default)]
    pub stages: usize,
    /// The same with the share of second attempts that the pilot expects.
    #[serde(default, deserialize_with = "number_or_null")]
    pub work: f64,
    /// Largest error, against grids that are refined until they agree: tip position over length, or tip rotation (rad).
    #[serde(deserialize_with = "number_or_null")]
    pub error: f64,
    /// What was asked for, in the same measure.
    pub tolerance: f64,
    /// Error of derivatives, the worst column of a sample over its norm: 95 % are below. `None`:
    /// there are no derivatives.
    #[serde(default)]
    pub derivative_error: Option<f64>,
    /// What was asked for, in the same measure.
    #[serde(default)]
    pub derivative_tolerance: f64,
    /// Error of an answer over its difference to the grid of the derivatives, with a reserve: what error estimates use.
    #[serde(default, deserialize_with = "number_or_null")]
    pub error_share: f64,
    /// Which error estimate a row carries at least.
    #[serde(default, deserialize_with = "number_or_null")]
    pub error_floor: f64,
    /// What error estimates of derivatives are made of, with a reserve.
    #[serde(default, with = "ScaleNumbers")]
    pub derivative_scale: DerivativeScale,
    /// Whether `error` is below half the tolerance.
    pub reached: bool,
    /// Samples that converged at both resolutions.
    pub compared: usize,
    /// Steps and error of every resolution tried: of a few samples where these were off by too much.
    #[serde(deserialize_with = "values_or_null")]
    pub tried: Vec<(usize, f64)>,
}

impl PilotChoice {
    /// The plan's options with what was chosen.
    pub fn options(&self, plan: &Plan) -> PlanOptions {
        let PilotChoice { stepper, steps, error_share, error_floor, derivative_scale, .. } = *self;
        PlanOptions { stepper, steps, error_share, error_floor, derivative_scale, ..plan.options }
    }

    /// One line that says what was picked and why.
    pub fn explain(&self) -> String {
        let PilotChoice { stepper, steps, error, tolerance, compared, .. } = self;
        let method = format!("{}, {steps} steps", stepper.name());
        if *compared == 0 {
            format!("{method}: no pilot sample converged, so the error is unknown")
        } else if self.reached {
            format!("{method}: {compared} pilot samples are off by at most {error:.1e} (tolerance {tolerance:.0e})")
        } else {
            format!(
                "{method}: {compared} pilot samples are still off by {error:.1e}; tolerance {tolerance:.0e} is not reached"
            )
        }
    }
}

/// What is known of samples with several equilibria.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BranchCounts {
    /// Equilibria of one sample.
    pub most: u64,
    /// Samples whose signs do not add up to one, so that an equilibrium is missing.
    pub unbalanced: u64,
}

/// Where the samples of a run were made.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SampleOrigin {
    /// By the program, and uploaded.
    Host,
    /// On the device that solved them; only rows that were asked for came back.
    Device,
    /// On the host although the device could make samples, for this reason.
    HostBecause(String),
}

impl fmt::Display for SampleOrigin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SampleOrigin::Host => f.write_str("host"),
            SampleOrigin::Device => f.write_str("device"),
            SampleOrigin::HostBecause(reason) => write!(f, "host: {reason}"),
        }
    }
}

impl Serialize for SampleOrigin {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for SampleOrigin {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<SampleOrigin, D::Error> {
        let text = String::deserialize(deserializer)?;
        Ok(match text.split_once(": ") {
            Some(("host", reason)) => SampleOrigin::HostBecause(reason.into()),
            _ if text == "device" => SampleOrigin::Device,
            _ => SampleOrigin::Host,
        })
    }
}

/// JSON has no NaN; where a number is none, it has null.
pub(crate) fn number_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Numbers beside their names or steps, of which some may be none.
pub(crate) fn values_or_null<'de, D, K>(deserializer: D) -> Result<Vec<(K, f64)>, D::Error>
where
    D: Deserializer<'de>,
    K: Deserialize<'de>,
{
    let values = Vec::<(K, Option<f64>)>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|(name, value)| (name, value.unwrap_or(f64::NAN))).collect())
}
