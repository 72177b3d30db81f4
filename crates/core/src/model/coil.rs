//! Coils of a rigid segment.

use super::rotation::{multiply, rotation_matrix};
use super::{Matrix, Vector};

/// A set of three coils: dipole (body frame) = alignment x winding x current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coil {
    /// What the currents flow through.
    pub winding: CoilWinding,
    /// Of each coil (A)
    pub current: Vector,
    /// Rotation vector applied to the dipole (rad)
    pub alignment: Vector,
}

/// Dipole per ampere of a set of three coils.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CoilWinding {
    /// Coils about body x, y, z.
    Axes {
        /// Of each coil.
        turns: Vector,
        /// Of one turn of each coil (m²)
        area: Vector,
    },
    /// Columns: dipole per ampere of each current (m²)
    Matrix(Matrix),
}

impl Coil {
    /// Dipole moment, body frame (A·m²).
    pub fn dipole(&self) -> Vector {
        let per_ampere = self.dipole_per_ampere();
        std::array::from_fn(|row| (0..3).map(|k| per_ampere[row][k] * self.current[k]).sum())
    }

    /// Columns: dipole per ampere of each current, body frame (m²).
    pub fn dipole_per_ampere(&self) -> Matrix {
        let winding = match self.winding {
            CoilWinding::Axes { turns, area } => {
                let mut diagonal = [[0.0; 3]; 3];
                for axis in 0..3 {
                    diagonal[axis][axis] = turns[axis] * area[axis];
                }
                diagonal
            }
            CoilWinding::Matrix(matrix) => matrix,
        };
        multiply(&rotation_matrix(self.alignment), &winding)
    }
}
