//! The field of external dipoles and of a gradient: its value and what its energy with a dipole needs.

use nalgebra::{Matrix3, Vector3};
use rodsweep::model::{MU0_OVER_4PI, RodField, gradient_matrix};

/// A field that varies, without its uniform part.
#[derive(Clone)]
pub struct Field {
    gradient: Matrix3<f64>,
    origin: Vector3<f64>,
    /// Place, moment, least distance.
    dipoles: Vec<(Vector3<f64>, Vector3<f64>, f64)>,
}

/// At a point, with a dipole mu: B, its gradient, the second derivative of mu · B.
pub struct Local {
    pub B: Vector3<f64>,
    pub G: Matrix3<f64>,
    pub T: Matrix3<f64>,
}

impl Field {
    /// Nothing beside the uniform field.
    pub fn none() -> Field {
        Field { gradient: Matrix3::zeros(), origin: Vector3::zeros(), dipoles: Vec::new() }
    }

    pub fn new(field: &RodField) -> Field {
        let rows = gradient_matrix(field.gradient);
        Field {
            gradient: Matrix3::from_fn(|row, col| rows[row][col]),
            origin: field.origin.into(),
            dipoles: field.dipoles.iter().map(|of| (of.position.into(), of.moment.into(), of.clearance)).collect(),
        }
    }

    /// Whether a point keeps its distance from every dipole.
    pub fn is_clear(&self, x: &Vector3<f64>) -> bool {
        self.dipoles.iter().all(|(place, _, clearance)| (x - place).norm() > *clearance)
    }

    /// Field and derivatives at x, where a dipole mu (world frame) stands.
    pub fn at(&self, x: &Vector3<f64>, mu: &Vector3<f64>) -> Local {
        let mut local = Local { B: self.gradient * (x - self.origin), G: self.gradient, T: Matrix3::zeros() };
        for (place, m, _) in &self.dipoles {
            let r = x - place;
            let r2 = r.norm_squared();
            let k = MU0_OVER_4PI / (r2 * r2.sqrt());
            let (a, b, c) = (m.dot(&r), mu.dot(&r), m.dot(mu));
            local.B += k * (3.0 * a / r2 * r - m);
            let k = 3.0 * k / r2;
            let rt = r.transpose();
            let outer = m * rt;
            local.G += k * (Matrix3::from_diagonal_element(a) + outer + outer.transpose() - 5.0 * a / r2 * r * rt);
            let v = a * mu + b * m + c * r - 5.0 * a * b / r2 * r;
            let pair = mu * m.transpose();
            let bent = b * m + a * mu - 2.0 * a * b / r2 * r;
            let dv = pair + pair.transpose() + Matrix3::from_diagonal_element(c - 5.0 * a * b / r2)
                - 5.0 / r2 * r * bent.transpose();
            local.T += k * (dv - 5.0 / r2 * v * rt);
        }
        local
    }
}
