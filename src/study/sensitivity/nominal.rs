//! The nominal sample: every input at the mean of its law. Its tip, its margin, its slopes.

use super::SensitivityError;
use super::inputs::{Input, Law};
use super::outputs::{Kind, MARGIN, Scalar};
use super::shapes::place;
use crate::model::{Parameter, Scene, Vector};
use crate::reference::Pose;
use crate::spec::SweepSpec;
use crate::study::rod_points::RodPoints;
use crate::study::{Solve, Solved};

/// Target error of the nominal sample.
const TOLERANCE: f64 = 1e-9;

const TIP: [&str; 3] = ["tip.position.x", "tip.position.y", "tip.position.z"];

/// The nominal sample.
pub(super) struct Nominal {
    solved: Solved,
    /// Parameters that it is differentiated by.
    names: Vec<String>,
    /// Points along the rod, where they are asked for.
    points: Vec<Pose>,
}

impl Nominal {
    /// Solves the scene at the means of the inputs; `None` where a table's inputs have no law, or the scene has no
    /// equilibrium there.
    pub fn solve(
        spec: &SweepSpec,
        inputs: &[Input],
        uncertain: &[Input],
        points: Option<usize>,
    ) -> Result<Option<Nominal>, SensitivityError> {
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
        if !solved.is_equilibrium() {
            return Ok(None);
        }
        let points = match points {
            Some(count) => points_of(&solved, count)?,
            None => Vec::new(),
        };
        Ok(Some(Nominal { solved, names, points }))
    }

    /// Position of the tip (m).
    pub fn tip(&self) -> Vector {
        self.solved.tip_position()
    }

    pub fn margin(&self) -> f64 {
        self.solved.stability_margin()
    }

    /// Position of a component of the tip, or of a point along the rod, and its slopes by `names`.
    fn component(&self, scalar: &Scalar) -> Option<(f64, Vec<f64>)> {
        if let Some((point, axis)) = place(&scalar.name) {
            let point = self.points.get(point)?;
            return Some((point.position[axis], point.derivatives.iter().map(|by| by.dp[axis]).collect()));
        }
        let axis = TIP.iter().position(|name| *name == scalar.name)?;
        Some((self.tip()[axis], self.solved.jacobian().position()[axis].clone()))
    }

    /// Value of a scalar; NaN for what is no position and no margin.
    pub fn value(&self, scalar: &Scalar) -> f64 {
        match scalar.kind {
            Kind::Distance => 0.0,
            _ if scalar.name == MARGIN => self.margin(),
            _ => self.component(scalar).map_or(f64::NAN, |(value, _)| value),
        }
    }

    /// Slope of a position by an input; NaN for any other scalar.
    pub fn slope(&self, scalar: &Scalar, input: &Input) -> f64 {
        self.component(scalar).map_or(f64::NAN, |(_, slopes)| self.along(input, &slopes))
    }

    /// Slopes of the tip's position by an input.
    pub fn tip_slope(&self, input: &Input) -> Vector {
        let rows = self.solved.jacobian().position();
        std::array::from_fn(|axis| self.along(input, &rows[axis]))
    }

    /// The sum of slopes by `names`, as the input drives them.
    fn along(&self, input: &Input, slopes: &[f64]) -> f64 {
        let column = |name: &String| self.names.iter().position(|other| other == name);
        let parts = input.parameters.iter().zip(&input.rates);
        parts.map(|(name, rate)| column(name).map_or(f64::NAN, |k| rate * slopes[k])).sum()
    }
}

/// Points along the nominal rod, with slopes by what it was differentiated by.
fn points_of(solved: &Solved, count: usize) -> Result<Vec<Pose>, SensitivityError> {
    let wrt: Vec<Parameter> = solved.plan().derivatives.iter().map(|derivative| derivative.parameter).collect();
    let points = RodPoints::new(solved.scene(), &[], &wrt, count)?;
    Ok(points.of(&points.batch(1, |_, _| {}), 0, solved.base_moment()).unwrap_or_default())
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
