//! What a controller is asked for, with inputs scaled by half their range.

use super::ControlOptions;
use super::inputs::{Inputs, MOST_INPUTS};
use crate::model::{Parameter, SegmentParameter, Wall};
use crate::spec::ControlInput;

/// What is commanded, and what for.
#[derive(Clone, Debug)]
pub(super) struct Task {
    pub inputs: Vec<ControlInput>,
    pub options: ControlOptions,
    /// Of moments (N·m)
    pub unit: f64,
    /// Of the rod (m)
    pub length: f64,
    /// The wall of the scene, if it has one.
    pub wall: Option<Wall>,
    /// How far a force of the wall bends the rod, about: by so much force counts beside lengths (m/N).
    pub yielding: f64,
}

impl Task {
    /// Half the range of an input.
    pub(crate) fn scale(&self, k: usize) -> f64 {
        0.5 * (self.inputs[k].high - self.inputs[k].low)
    }

    /// Values of the inputs, held within the limits; scaled.
    pub(crate) fn scaled(&self, values: &[f64]) -> Inputs {
        let mut scaled = [0.0; MOST_INPUTS];
        for (k, (value, input)) in values.iter().zip(&self.inputs).enumerate() {
            scaled[k] = value.clamp(input.low, input.high) / self.scale(k);
        }
        scaled
    }

    pub(crate) fn low(&self, k: usize) -> f64 {
        self.inputs[k].low / self.scale(k)
    }

    pub(crate) fn high(&self, k: usize) -> f64 {
        self.inputs[k].high / self.scale(k)
    }

    pub(crate) fn is_current(&self, k: usize) -> bool {
        matches!(self.inputs[k].parameter, Parameter::Segment(_, SegmentParameter::Current(_)))
    }

    /// The value of a scaled input, exactly on its limit where it is there.
    pub(crate) fn value(&self, k: usize, z: f64) -> f64 {
        (z * self.scale(k)).clamp(self.inputs[k].low, self.inputs[k].high)
    }

    /// Point k of a sequence that fills the permitted inputs evenly (Roberts' generalised golden ratio); scaled.
    pub(crate) fn lattice(&self, k: usize) -> Inputs {
        let count = self.inputs.len();
        let ratio = (0..60).fold(2.0f64, |x, _| (1.0 + x).powf(1.0 / (count + 1) as f64));
        std::array::from_fn(|axis| {
            if axis >= count {
                return 0.0;
            }
            let share = (0.5 + (k + 1) as f64 * ratio.powi(-(axis as i32 + 1))).fract();
            self.low(axis) + share * (self.high(axis) - self.low(axis))
        })
    }
}
