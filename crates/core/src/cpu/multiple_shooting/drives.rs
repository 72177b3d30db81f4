//! Drives of the intervals: unit tip forces, or the parameters of forward columns.

use crate::cpu::algebra::Mat3;
use crate::cpu::rod::problem::Workspace;
use crate::cpu::rod::program::Program;
use crate::cpu::simd::lane::Lane;

/// What three loads or parameters do over an interval whose start is held.
#[derive(Clone, Copy, Debug)]
pub struct Drive<L> {
    pub w: Mat3<L>,
    pub mu: Mat3<L>,
    pub dp: Mat3<L>,
}

/// Changes of the force at the base, by threes: of unit tip forces, or of the parameters of forward columns.
#[inline(always)]
pub fn driving_forces<L: Lane>(program: &Program, workspace: &Workspace<L>, one: L) -> Vec<Mat3<L>> {
    if program.forward {
        workspace.sources.iter().map(|sources| sources.dn0).collect()
    } else if program.derivatives.is_empty() {
        Vec::new()
    } else {
        vec![Mat3::identity(one)]
    }
}
