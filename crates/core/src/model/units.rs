//! Consistent units that make the numbers of a scene of order one, so that f32 neither overflows nor drowns.

use super::MU0_OVER_4PI;

/// One unit of each base quantity, in SI. Equations keep their form in any consistent set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// In m
    pub length: f64,
    /// In N
    pub force: f64,
    /// In T
    pub field: f64,
}

impl Units {
    /// In N·m
    pub fn moment(&self) -> f64 {
        self.force * self.length
    }

    /// In N·m²
    pub fn stiffness(&self) -> f64 {
        self.force * self.length * self.length
    }

    /// In 1/m
    pub fn curvature(&self) -> f64 {
        1.0 / self.length
    }

    /// Force per length (N/m)
    pub fn load(&self) -> f64 {
        self.force / self.length
    }

    /// Gradient of the field (T/m)
    pub fn gradient(&self) -> f64 {
        self.field / self.length
    }

    /// Moment of a dipole outside of the rod, whose field at one unit of length is one unit of field (A·m²)
    pub fn source_moment(&self) -> f64 {
        self.field * self.length.powi(3) / MU0_OVER_4PI
    }

    /// Magnetic dipole moment (A·m²)
    pub fn dipole(&self) -> f64 {
        self.moment() / self.field
    }
}
