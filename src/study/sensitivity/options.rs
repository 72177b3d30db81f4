//! What a study is asked for.

use super::estimator::Estimator;

/// Which estimator is to be read first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum EstimatorChoice {
    /// What suits the design: Azzini's, exact sums on a grid; else a polynomial that predicts well, else cosines.
    #[default]
    Auto,
    /// A pick-freeze estimator; it needs its design.
    PickFreeze(Estimator),
    /// Polynomials.
    Chaos,
    /// Cosines of slopes and values: first order only.
    Slopes,
}

impl EstimatorChoice {
    pub(super) fn pick_freeze(self) -> Estimator {
        match self {
            EstimatorChoice::PickFreeze(estimator) => estimator,
            _ => Estimator::default(),
        }
    }
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Options {
    pub outputs: Vec<String>,
    pub inputs: Vec<String>,
    pub estimator: EstimatorChoice,
    pub confidence: f64,
    pub degree: usize,
    pub with_unstable: bool,
    /// Whether the spread of the outputs beside that of the first order is asked for by name.
    pub propagate: bool,
    /// Measurements to be chosen.
    pub choose: Option<usize>,
    /// Standard deviation of a measured coordinate (m).
    pub noise: Option<f64>,
    /// Standard deviation of a measured tangent (rad), where tangents are measured, too.
    pub tangent_noise: Option<f64>,
    pub minimum_margin: f64,
    /// Only the first samples.
    pub limit: Option<u64>,
    /// What speaks against the rows.
    pub mark: Option<String>,
    /// How many rows were checked, in a sentence.
    pub checked: Option<String>,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            outputs: Vec::new(),
            inputs: Vec::new(),
            estimator: EstimatorChoice::Auto,
            confidence: 0.95,
            degree: 4,
            with_unstable: false,
            propagate: false,
            choose: None,
            noise: None,
            tangent_noise: None,
            minimum_margin: 0.3,
            limit: None,
            mark: None,
            checked: None,
        }
    }
}

impl Options {
    /// Whether it is asked what measurements would tell.
    pub fn identifies(&self) -> bool {
        self.choose.is_some() || self.noise.is_some()
    }
}
