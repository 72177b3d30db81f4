//! Magnets by their data sheet: material and cross-section tell dipole and mass.

use super::{Axis, MU0_OVER_4PI, Vector};
use std::f64::consts::PI;

/// A number of a data sheet that tells how strongly a material is magnetised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MagnetQuantity {
    /// Remanence (T)
    Remanence,
    /// Magnetisation (A/m)
    Magnetization,
}

/// A permanently magnetic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetMaterial {
    /// Remanence or magnetization.
    pub quantity: MagnetQuantity,
    /// Body frame, in the unit of the quantity.
    pub value: Vector,
    /// Whether it was given as one number, along the tangent.
    pub is_along: bool,
    /// Share of a composite's volume that is magnetic; `None`: all of it.
    pub volume_fraction: Option<f64>,
}

/// Cross-section and material of a rigid segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// 0 for a solid cylinder (m)
    pub inner_radius: f64,
    /// In m
    pub outer_radius: f64,
    /// For weight (kg/m³); `None`: by `mass`, or it weighs nothing.
    pub density: Option<f64>,
}

impl MagnetQuantity {
    /// Magnetisation (A/m) for each unit of the quantity.
    pub fn magnetization(self) -> f64 {
        match self {
            MagnetQuantity::Remanence => 1.0 / (4.0 * PI * MU0_OVER_4PI),
            MagnetQuantity::Magnetization => 1.0,
        }
    }

    /// The key of scene files, which begins the parameters' paths.
    pub fn name(self) -> &'static str {
        match self {
            MagnetQuantity::Remanence => "remanence",
            MagnetQuantity::Magnetization => "magnetization",
        }
    }

    /// SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            MagnetQuantity::Remanence => "T",
            MagnetQuantity::Magnetization => "A/m",
        }
    }
}

impl MagnetMaterial {
    /// Dipole per volume, body frame (A/m)
    pub fn magnetization(&self) -> Vector {
        let factor = self.quantity.magnetization() * self.volume_fraction.unwrap_or(1.0);
        self.value.map(|x| x * factor)
    }

    /// A number of it; `None` is the one along the tangent.
    pub(super) fn number(&mut self, axis: Option<Axis>) -> &mut f64 {
        &mut self.value[axis.unwrap_or(Axis::Z).index()]
    }
}

impl Body {
    /// Area (m²)
    pub fn cross_section(&self) -> f64 {
        PI * (self.outer_radius.powi(2) - self.inner_radius.powi(2))
    }
}
