//! The nominal sample: every input at the mean of its law. Its tip, its margin, its slopes.

use super::SensitivityError;
use super::inputs::{Input, Law};
use super::outputs::{Kind, MARGIN, Scalar};
use crate::model::{Parameter, Scene, Vector};
use crate::spec::SweepSpec;
use crate::study::{Solve, Solved};

/// Target error of the nominal sample.
const TOLERANCE: f64 = 1e-9;

/// The nominal sample.
pub(super) struct Nominal {
    solved: Solved,
    /// Parameters that it is differentiated by.
    names: Vec<String>,
}

impl Nominal {
    /// Solves the scene at the means of the inputs; `None` where a table's inputs have no law, or the scene has no
    /// equilibrium there.
    pub fn solve(spec: &SweepSpec, inputs: &[Input], uncertain: &[Input]) -> Result<Option<Nominal>, SensitivityError> {
        if inputs.iter().any(|input| matches!(input.law, Law::Ranks(_))) {
            return Ok(None);
        }
        let mut names: Vec<String> = Vec::new();
        for name in inputs.iter().chain(uncertain).flat_map(|input| &input.parameters) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        let scene = scene_at(spec, inputs)?;
        let solved = Solve::new(scene).tolerance(TOLERANCE).wrt(&names).run()?;
        Ok(solved.is_equilibrium().then_some(Nominal { solved, names }))
    }

    /// Position of the tip (m).
    pub fn tip(&self) -> Vector {
        self.solved.tip_position()
    }

    pub fn margin(&self) -> f64 {
        self.solved.stability_margin()
    }

    /// Value of a scalar; NaN for what is no position and no margin.
    pub fn value(&self, scalar: &Scalar) -> f64 {
        match scalar.kind {
            Kind::Distance => 0.0,
            _ if scalar.name == MARGIN => self.margin(),
            _ => self.axis(scalar).map_or(f64::NAN, |axis| self.tip()[axis]),
        }
    }

    /// Slope of a component of the tip's position by an input; NaN for any other scalar.
    pub fn slope(&self, scalar: &Scalar, input: &Input) -> f64 {
        let Some(axis) = self.axis(scalar) else { return f64::NAN };
        self.tip_slope(input)[axis]
    }

    /// Slopes of the tip's position by an input.
    pub fn tip_slope(&self, input: &Input) -> Vector {
        let rows = self.solved.jacobian().position();
        let column = |name: &String| self.names.iter().position(|other| other == name);
        std::array::from_fn(|axis| {
            let parts = input.parameters.iter().zip(&input.rates);
            parts.map(|(name, rate)| column(name).map_or(f64::NAN, |k| rate * rows[axis][k])).sum()
        })
    }

    fn axis(&self, scalar: &Scalar) -> Option<usize> {
        ["tip.position.x", "tip.position.y", "tip.position.z"].iter().position(|name| *name == scalar.name)
    }
}

/// The scene with every input at its mean.
fn scene_at(spec: &SweepSpec, inputs: &[Input]) -> Result<Scene, SensitivityError> {
    let mut scene = spec.scene.clone();
    let mut values = Vec::new();
    for (axis, input) in spec.axes.iter().zip(inputs) {
        let mean = input.law.mean();
        values.extend(axis.parameters.iter().zip(&input.rates).map(|(parameter, rate)| (*parameter, rate * mean)));
    }
    Parameter::set_all(&mut scene, values.into_iter())?;
    Ok(scene)
}
