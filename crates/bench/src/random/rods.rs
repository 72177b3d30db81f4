//! Random rods with every term at once: for what is checked below the level of scenes.
#![allow(non_snake_case)]

use super::numbers::Random;
use nalgebra::Rotation3;
use rodsweep::model::{FlexibleRod, Matrix, RigidRod, Rod, RodSegment};

impl Random {
    /// A rotation, by rows.
    pub fn rotation(&mut self) -> Matrix {
        let R = Rotation3::new(self.vector(1.7).into());
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
        if !segments.iter().any(RodSegment::is_flexible) {
            segments.push(self.segment(true));
        }
        Rod {
            base_position: self.vector(0.05),
            base_rotation: self.rotation(),
            flux_density: self.vector(2.0),
            field: None,
            wall: None,
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
            let length = self.within(0.02, 0.05);
            RodSegment::Flexible(FlexibleRod {
                length,
                stiffness,
                stiffness_rise: stiffness.map(|k: f64| k * self.within(-0.5, 1.0)),
                rest_curvature,
                rest_curvature_rise: self.vector(5.0),
                load,
                dipole: self.vector(1e-3),
                shear_compliance: std::array::from_fn(|_| self.within(1.0, 10.0)),
            })
        } else {
            let length = self.within(0.005, 0.02);
            RodSegment::Rigid(RigidRod {
                length,
                dipole: self.vector(1e-4),
                weight: load.map(|x| x * length),
                ..RigidRod::default()
            })
        }
    }
}
