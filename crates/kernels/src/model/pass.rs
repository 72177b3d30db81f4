//! Where one pass over a rod comes to: the state at the tip, and how it moves with the base moment.

use super::rotation::orthonormal;
use super::{Blocks, Matrix, Vector};

/// The tip after one pass from a base moment, whether it is that of an equilibrium or not; SI units, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassEnd {
    /// Of the tip (m)
    pub position: Vector,
    /// Body to world, by rows.
    pub rotation: Matrix,
    /// Internal moment there (N·m)
    pub moment: Vector,
    /// By each component of the base moment.
    pub columns: [PassColumn; 3],
}

/// How the tip moves with one component of the base moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassColumn {
    /// Virtual rotation (rad/(N·m))
    pub w: Vector,
    /// Of the position (m/(N·m))
    pub dp: Vector,
    /// Of the internal moment.
    pub dm: Vector,
}

/// Passes over the rods of a batch, column by column: position, first director, tangent, moment, then w, dp and dm of each
/// component of the base moment.
#[derive(Clone, Debug, PartialEq)]
pub struct PassEnds(pub Blocks<f64>);

impl PassEnds {
    /// Numbers of one pass.
    pub const COLUMNS: usize = 3 * (4 + 9);

    /// Of so many samples.
    pub fn new(sample_count: usize) -> PassEnds {
        PassEnds(Blocks::new(Self::COLUMNS, sample_count))
    }

    /// Of one sample.
    pub fn end(&self, sample: usize) -> PassEnd {
        let vector = |at: usize| [0, 1, 2].map(|axis| self.0.get(sample, 3 * at + axis));
        let column = |k: usize| PassColumn { w: vector(4 + 3 * k), dp: vector(5 + 3 * k), dm: vector(6 + 3 * k) };
        PassEnd {
            position: vector(0),
            rotation: orthonormal(vector(1), vector(2)),
            moment: vector(3),
            columns: [0, 1, 2].map(column),
        }
    }
}
