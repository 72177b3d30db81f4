//! What host and kernels agree on: the workgroup size, the uniform that every kernel reads, how numbers are stored.

use crate::backend::Precision;
use crate::model::tolerances::{chord_tolerance, first_order_tolerance, newton_tolerance, turn_tolerance};
use crate::model::{Plan, PlanOptions};
use std::mem::offset_of;

/// Invocations of a workgroup; a block of samples is a multiple.
pub const WORKGROUP_SIZE: u32 = 64;

/// Invocations of a sample that is followed with care, as `shaders/lanes.wgsl` has them.
pub(crate) const LANES: u32 = 8;

/// Numbers that one kernel of a dispatch tells the next of a sample, as `shaders/handover.wgsl` places them.
pub(crate) const HANDOVER_COUNT: usize = 34;

/// Loop iterations of one invocation that every driver runs; software Vulkan stops silently at 65,535.
pub(super) const ITERATION_BUDGET: usize = 60_000;

/// The uniform that every kernel reads; `Settings` in `shaders/batch.wgsl`, with floats of the kernel's precision.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Settings<S> {
    /// Added to every status.
    pub mark: S,
    /// Newton's, in the plan's unit of moment.
    pub tolerance: S,
    /// Where chord steps end, in the same unit and over the stability margin.
    pub chord_tolerance: S,
    /// Up to where a step does to first order, in the same unit and over the stability margin.
    pub first_order_tolerance: S,
    /// How far Newton's last step may move the tip (radians, or over the rod's length).
    pub turn_tolerance: S,
    /// [`PlanOptions::error_share`](crate::model::PlanOptions::error_share).
    pub error_share: S,
    /// [`PlanOptions::derivative_scale`](crate::model::PlanOptions::derivative_scale).
    pub derivative_share: S,
    pub derivative_floor: S,
    pub sample_count: u32,
    /// Always zero.
    pub zero: u32,
}

impl Settings<f64> {
    /// Tolerances and error shares of a plan. Mark and number of samples are zero.
    pub fn of(plan: &Plan, precision: Precision) -> Self {
        let tolerance = newton_tolerance(plan.target(), precision.epsilon());
        let PlanOptions { error_share, derivative_scale, .. } = plan.options;
        Self {
            mark: 0.0,
            tolerance,
            chord_tolerance: chord_tolerance(tolerance),
            first_order_tolerance: first_order_tolerance(tolerance),
            turn_tolerance: turn_tolerance(tolerance, plan.column_tolerance()),
            error_share,
            derivative_share: derivative_scale.share,
            derivative_floor: derivative_scale.floor,
            sample_count: 0,
            zero: 0,
        }
    }

    /// As the kernels of a precision read them.
    pub fn bytes(&self, precision: Precision) -> Vec<u8> {
        let tolerances = [self.tolerance, self.chord_tolerance, self.first_order_tolerance, self.turn_tolerance];
        let shares = [self.error_share, self.derivative_share, self.derivative_floor];
        let floats = [&[self.mark][..], &tolerances, &shares].concat();
        let mut bytes = float_bytes(&floats, precision);
        bytes.extend_from_slice(bytemuck::bytes_of(&[self.sample_count, self.zero]));
        bytes
    }
}

/// Numbers as the kernels of a precision read them.
pub(crate) fn float_bytes(values: &[f64], precision: Precision) -> Vec<u8> {
    match precision {
        Precision::F32 => bytemuck::cast_slice(&values.iter().map(|x| *x as f32).collect::<Vec<_>>()).to_vec(),
        Precision::F64 => bytemuck::cast_slice(values).to_vec(),
    }
}

macro_rules! offsets {
    ($float:ty) => {
        [
            ("mark", offset_of!(Settings<$float>, mark)),
            ("tolerance", offset_of!(Settings<$float>, tolerance)),
            ("chord_tolerance", offset_of!(Settings<$float>, chord_tolerance)),
            ("first_order_tolerance", offset_of!(Settings<$float>, first_order_tolerance)),
            ("turn_tolerance", offset_of!(Settings<$float>, turn_tolerance)),
            ("error_share", offset_of!(Settings<$float>, error_share)),
            ("derivative_share", offset_of!(Settings<$float>, derivative_share)),
            ("derivative_floor", offset_of!(Settings<$float>, derivative_floor)),
            ("sample_count", offset_of!(Settings<$float>, sample_count)),
            ("zero", offset_of!(Settings<$float>, zero)),
        ]
    };
}

/// Members of `Settings` and their offsets, to compare with the shaders.
pub fn settings_members(precision: Precision) -> [(&'static str, usize); 10] {
    match precision {
        Precision::F32 => offsets!(f32),
        Precision::F64 => offsets!(f64),
    }
}
