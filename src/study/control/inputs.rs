//! Inputs as a controller counts them: over half their range.

/// Most inputs of one controller: three coil sets and insertion.
pub const MOST_INPUTS: usize = 10;

/// Inputs over half their range.
pub(super) type Inputs = [f64; MOST_INPUTS];
