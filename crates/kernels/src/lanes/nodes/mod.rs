//! Multiple shooting, for rods so limp or so taut that a single pass loses its digits. N1 to N4
//!
//! Orientation and moment are unknown at nodes all along the rod. Each interval between nodes is a pass of its own, and
//! block elimination from the tip joins them. Nothing grows along the whole rod.

mod answer;
mod drives;
mod elimination;
mod interval;
mod margin;
mod mesh;
mod newton;
mod path;
mod quick;
mod responses;
mod state;
#[cfg(test)]
mod tests;
mod traces;

pub use answer::solve_nodes;
pub use quick::{QuickEnd, follow_quickly};
pub use state::Nodes;

use super::algebra::Mat3;
use super::lane::{Lane, Scalar};
use super::stability::squared_norm;
use crate::model::path::growth_noise;

/// Whether errors grow so much along the rod, where dr/dm0 is `w`, that the columns of a single pass are not to be
/// trusted: what a pass multiplies by `w` and divides by it again is rounded.
#[inline(always)]
pub fn is_grown<L: Lane>(w: &Mat3<L>) -> L::Mask {
    let noise = squared_norm(w) * w.x.x.constant(L::Scalar::EPSILON);
    !noise.lt(noise.constant(growth_noise(L::Scalar::EPSILON)))
}
