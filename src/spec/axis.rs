//! What varies and by which law: an axis of a sweep, or an uncertain number of its scene.

use super::normal;
use crate::model::{Parameter, Scene};

/// By which law a number varies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Equally likely between two ends; `from` may be the larger one.
    Uniform {
        /// Where it begins.
        from: f64,
        /// Where it ends.
        to: f64,
    },
    /// Normally distributed, without limits.
    Normal {
        /// Mean and median.
        mean: f64,
        /// Greater than zero.
        standard_deviation: f64,
    },
}

/// One swept direction; it may drive several parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisSpec {
    /// What it drives; all of one unit, unless it scales them.
    pub parameters: Vec<Parameter>,
    /// Of its value: SI, given to every parameter; or a factor, where it scales them.
    pub distribution: Distribution,
    /// Whether its value multiplies the scene's values of its parameters, so that they keep their ratio.
    pub scales: bool,
    /// Grid points; 0 for other methods.
    pub points: u64,
}

impl Distribution {
    /// The value that a share `unit` of all values lies below (from the side of `from`): maps [0, 1] to the law.
    ///
    /// A normal law takes the ends 0 and 1 as the nearest numbers inside.
    pub fn value(&self, unit: f64) -> f64 {
        match *self {
            Distribution::Uniform { from, to } => from + (to - from) * unit,
            Distribution::Normal { mean, standard_deviation } => mean + standard_deviation * normal::quantile(unit),
        }
    }

    /// The inverse of [`Distribution::value`].
    pub fn unit(&self, value: f64) -> f64 {
        match *self {
            Distribution::Uniform { from, to } => (value - from) / (to - from),
            Distribution::Normal { mean, standard_deviation } => {
                normal::share_below((value - mean) / standard_deviation)
            }
        }
    }

    /// Derivative of [`Distribution::value`] by the share; negative where `from` is the larger end.
    pub fn rate(&self, unit: f64) -> f64 {
        match *self {
            Distribution::Uniform { from, to } => to - from,
            Distribution::Normal { standard_deviation, .. } => {
                standard_deviation / normal::density(normal::quantile(unit))
            }
        }
    }

    /// Probability per unit of the value.
    pub fn density(&self, value: f64) -> f64 {
        match *self {
            Distribution::Uniform { from, to } if (from.min(to)..=from.max(to)).contains(&value) => {
                1.0 / (to - from).abs()
            }
            Distribution::Uniform { .. } => 0.0,
            Distribution::Normal { mean, standard_deviation } => {
                normal::density((value - mean) / standard_deviation) / standard_deviation
            }
        }
    }

    /// Mean of all values.
    pub fn mean(&self) -> f64 {
        match *self {
            Distribution::Uniform { from, to } => 0.5 * (from + to),
            Distribution::Normal { mean, .. } => mean,
        }
    }

    /// Standard deviation of all values.
    pub fn standard_deviation(&self) -> f64 {
        match *self {
            Distribution::Uniform { .. } => self.half_range() / 3f64.sqrt(),
            Distribution::Normal { standard_deviation, .. } => standard_deviation,
        }
    }

    /// Half the distance of the ends; for a normal law that of the uniform law with the same standard deviation.
    pub fn half_range(&self) -> f64 {
        match *self {
            Distribution::Uniform { from, to } => 0.5 * (to - from).abs(),
            Distribution::Normal { standard_deviation, .. } => 3f64.sqrt() * standard_deviation,
        }
    }

    /// From and to, where the law has ends.
    pub fn limits(&self) -> Option<(f64, f64)> {
        match *self {
            Distribution::Uniform { from, to } => Some((from, to)),
            Distribution::Normal { .. } => None,
        }
    }
}

impl AxisSpec {
    /// Rate of each parameter by the axis's value: 1, or the scene's value where the axis scales it.
    pub fn rates(&self, scene: &Scene) -> Vec<f64> {
        let rate = |parameter: &Parameter| if self.scales { parameter.get(scene) } else { 1.0 };
        self.parameters.iter().map(rate).collect()
    }

    /// The names of what it drives, joined by `+`.
    pub fn name(&self, scene: &Scene) -> String {
        self.parameters.iter().map(|parameter| parameter.name(scene)).collect::<Vec<_>>().join("+")
    }

    /// SI unit of its value; empty for a factor and for a pure number.
    pub fn unit(&self) -> &'static str {
        match self.parameters.first() {
            Some(parameter) if !self.scales => parameter.unit(),
            _ => "",
        }
    }

    /// Its value in a scene: that of its first parameter (SI), or the factor 1.
    pub fn nominal(&self, scene: &Scene) -> f64 {
        match self.parameters.first() {
            Some(parameter) if !self.scales => parameter.get(scene),
            _ => 1.0,
        }
    }

    /// What each sample of a sweep sets for this axis: all parameters at once, or each its own value.
    pub(super) fn groups(&self) -> Vec<Vec<Parameter>> {
        match self.scales {
            true => self.parameters.iter().map(|parameter| vec![*parameter]).collect(),
            false => vec![self.parameters.clone()],
        }
    }
}
