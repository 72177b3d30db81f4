//! Consistent units that make the numbers of a scene of order one, so that f32 neither overflows nor drowns.

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

    /// Magnetic dipole moment (A·m²)
    pub fn dipole(&self) -> f64 {
        self.moment() / self.field
    }
}
