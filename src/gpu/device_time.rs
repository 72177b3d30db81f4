//! The device's time of the kernels of one dispatch, and how many samples its lists had.

/// Lists of samples: what anchors leave to the way from rest, then what each round leaves to the next. Each round takes Newton's
/// method one pass further.
pub(super) const LISTS: usize = 4;

/// Kernels of a dispatch that are timed together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Makes samples.
    Generate,
    /// Solves from anchors, or checks what they predict.
    Anchored,
    /// Follows paths from rest.
    Path,
    /// Chord steps and the check.
    Check,
    /// The pass with columns, and the rows.
    Columns,
    /// The rounds after the first: guarded paths, further steps of Newton's method, check and columns.
    Left,
    /// All in one kernel.
    Whole,
    /// Counts samples in voxels.
    Reduce,
}

impl Stage {
    /// How many there are.
    pub const COUNT: usize = 8;
    /// All, in the order of a dispatch, as manifests name them.
    pub const ALL: [(Stage, &'static str); Self::COUNT] = [
        (Stage::Generate, "kernel_generate"),
        (Stage::Anchored, "kernel_anchored"),
        (Stage::Path, "kernel_path"),
        (Stage::Check, "kernel_check"),
        (Stage::Columns, "kernel_columns"),
        (Stage::Left, "kernel_left"),
        (Stage::Whole, "kernel_whole"),
        (Stage::Reduce, "kernel_reduce"),
    ];

    /// As manifests have it.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }
}

/// Time by the device's own clock (s); `None` where the device does not tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DeviceTime {
    /// From the start of the first kernel to the end of the last.
    pub kernels: Option<f64>,
    /// Of each kernel.
    pub stages: Vec<(Stage, f64)>,
    pub copies: Option<f64>,
    /// Samples of each list, and how many of them to be followed with care.
    pub left: [[u32; 2]; LISTS],
}
