//! What varies and by which law: an axis of a sweep, or an uncertain number of its scene.

use super::distribution::Distribution;
use crate::model::{Parameter, Scene};

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
