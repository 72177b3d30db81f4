//! Reproducible random numbers and rods for tests.

use rodsweep::model::{Matrix, Rod, RodSegment, Vector};

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e3779b97f4a7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58476d1ce4e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d049bb133111eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Components uniform in [-size, size).
    pub fn vector(&mut self, size: f64) -> Vector {
        std::array::from_fn(|_| self.within(-size, size))
    }

    /// A rotation, by rows.
    pub fn rotation(&mut self) -> Matrix {
        let R = nalgebra::Rotation3::new(self.vector(1.7).into());
        std::array::from_fn(|row| std::array::from_fn(|col| R[(row, col)]))
    }

    /// A catheter-sized rod with all kinds of loads; every third starts with a rigid segment.
    pub fn rod(&mut self) -> Rod {
        let count = 2 + (self.unit() * 4.0) as usize;
        let starts_rigid = self.unit() < 1.0 / 3.0;
        let mut segments = Vec::new();
        for k in 0..count {
            let flexible = (k % 2 == 0) != starts_rigid || self.unit() < 0.2;
            segments.push(self.segment(flexible));
        }
        if !segments.iter().any(|s| matches!(s, RodSegment::Flexible { .. })) {
            segments.push(self.segment(true));
        }
        Rod {
            base_position: self.vector(0.05),
            base_rotation: self.rotation(),
            flux_density: self.vector(2.0),
            tip_force: self.vector(4e-3),
            tip_moment: self.vector(1e-4),
            rigid_force_arm: true,
            segments,
        }
    }

    fn segment(&mut self, flexible: bool) -> RodSegment {
        let load = self.vector(8e-3);
        if flexible {
            let stiffness = std::array::from_fn(|_| self.within(2e-5, 8e-5));
            let rest_curvature = self.vector(5.0);
            RodSegment::Flexible { length: self.within(0.02, 0.05), stiffness, rest_curvature, load }
        } else {
            RodSegment::Rigid { length: self.within(0.005, 0.02), dipole: self.vector(1e-4), load }
        }
    }
}
