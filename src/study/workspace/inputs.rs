//! What is commanded: the axes of a sweep that an operator can set, and their limits.

use super::error::WorkspaceError;
use super::tip_map::{Inputs, MOST_INPUTS};
use crate::model::{MagnetParameter, Parameter, Scene, SegmentParameter};
use crate::spec::{AxisSpec, Method, SweepSpec};

/// One input and its limits; it may drive several parameters at once.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkspaceInput {
    /// What it drives.
    pub parameters: Vec<Parameter>,
    /// What its value is multiplied by for each of them: 1, or the scene's value where it scales them.
    pub rates: Vec<f64>,
    /// Least value, SI.
    pub low: f64,
    /// Largest value, SI.
    pub high: f64,
}

impl WorkspaceInput {
    /// Its name in tables: that of the first parameter.
    pub fn name(&self, scene: &Scene) -> String {
        self.parameters.first().map_or_else(String::new, |parameter| parameter.name(scene))
    }

    /// SI unit of its value; empty where it scales several.
    pub fn unit(&self) -> &'static str {
        let scales = self.rates.iter().any(|rate| *rate != 1.0);
        self.parameters.first().filter(|_| !scales).map_or("", Parameter::unit)
    }

    /// Half the distance of its limits, SI.
    pub fn half_range(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    /// Its value (SI) at a scaled input; exactly a limit at 1 and -1.
    pub fn value(&self, scaled: f64) -> f64 {
        0.5 * (self.low * (1.0 - scaled) + self.high * (1.0 + scaled))
    }

    /// The scaled input of a value (SI).
    pub fn scaled(&self, value: f64) -> f64 {
        let middle = 0.5 * (self.low + self.high);
        ((value - middle) / self.half_range()).clamp(-1.0, 1.0)
    }

    fn is_current(&self) -> bool {
        self.parameters.iter().all(|p| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_))))
    }
}

/// Whether an operator can set it, as opposed to a number of the rod's design or of its surroundings.
fn is_commanded(parameter: &Parameter) -> bool {
    use Parameter::{
        ArrayCurrent, BasePosition, BaseRotation, FieldGradient, FieldOrigin, FluxDensity, Insertion, Magnet, Segment,
    };
    matches!(
        parameter,
        Insertion
            | BasePosition(_)
            | BaseRotation(_)
            | FluxDensity(_)
            | FieldGradient(_)
            | FieldOrigin(_)
            | ArrayCurrent(..)
            | Magnet(_, MagnetParameter::Position(_) | MagnetParameter::Rotation(_))
            | Segment(_, SegmentParameter::Current(_))
    )
}

/// The inputs among the axes of a sweep, and what is to be said of the other axes.
///
/// # Errors
///
/// No axis that can be commanded, or too many.
pub fn workspace_inputs(spec: &SweepSpec) -> Result<(Vec<WorkspaceInput>, Vec<String>), WorkspaceError> {
    let (mut inputs, mut notes) = (Vec::new(), Vec::new());
    for (number, axis) in spec.axes.iter().enumerate() {
        let [low, high] = limits(spec, number, axis);
        let name = axis.parameters.first().map_or_else(String::new, |parameter| parameter.name(&spec.scene));
        if !axis.parameters.iter().all(is_commanded) {
            notes.push(format!("`{name}` is no input that can be commanded: it stays at the scene's value"));
        } else if low < high {
            let (parameters, rates) = (axis.parameters.clone(), axis.rates(&spec.scene));
            inputs.push(WorkspaceInput { parameters, rates, low, high });
        } else {
            notes.push(format!("`{name}` has a single value: it is no input"));
        }
    }
    match inputs.len() {
        0 => Err(WorkspaceError::NoInputs { file: spec.file.clone() }),
        1..=MOST_INPUTS => Ok((inputs, notes)),
        count => Err(WorkspaceError::TooManyInputs { count }),
    }
}

/// Limits of an axis, of a normal law those of the uniform law that spreads as much; of a table, the least and the largest value of its column.
fn limits(spec: &SweepSpec, number: usize, axis: &AxisSpec) -> [f64; 2] {
    match (&spec.table, spec.method) {
        (Some(table), Method::Table) => (0..spec.sample_count)
            .map(|row| table.row(row as usize)[number])
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]),
        _ => {
            let (middle, half) = (axis.distribution.mean(), axis.distribution.half_range());
            axis.distribution.limits().map_or([middle - half, middle + half], |(a, b)| [a.min(b), a.max(b)])
        }
    }
}

/// The scene whose single-valued axes and others that are no inputs stand where the sweep has them.
pub fn base_scene(spec: &SweepSpec) -> Scene {
    let mut scene = spec.scene.clone();
    let fixed = spec.axes.iter().enumerate().filter_map(|(number, axis)| {
        let [low, high] = limits(spec, number, axis);
        (low == high && axis.parameters.iter().all(is_commanded)).then_some((axis, low))
    });
    let values = fixed.flat_map(|(axis, value)| {
        axis.parameters.iter().zip(axis.rates(&spec.scene)).map(move |(p, rate)| (*p, value * rate))
    });
    // Checked when the file was read.
    let _ = Parameter::set_all(&mut scene, values);
    scene
}

/// Sum of squares of the currents over half their ranges about zero.
pub(super) fn current_effort(inputs: &[WorkspaceInput], at: &Inputs) -> f64 {
    let effort = |(input, t): (&WorkspaceInput, &f64)| (input.value(*t) / input.half_range()).powi(2);
    inputs.iter().zip(at).filter(|(input, _)| input.is_current()).map(effort).sum()
}

/// Least distance of an input to its limits, over half its range: 0 at a limit, 1 in the middle.
pub fn reserve(at: &Inputs, count: usize) -> f64 {
    at[..count].iter().fold(1.0, |least: f64, t| least.min(1.0 - t.abs())).max(0.0)
}
