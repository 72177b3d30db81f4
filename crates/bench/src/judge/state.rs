//! States of a chain, what one look at a state gives, and how an element bends.

use super::chain::{Chain, Element};
use super::turn::{hat, matrix_of};
use nalgebra::{Matrix3, Quaternion, Vector3};

/// An element that bends so far that the cosine of half the angle is less: there are too few elements.
const LEAST_COSINE: f64 = 0.5;

/// How nodes turn (rad, world frame) and what elements bear beside (N, body frame), which strains them.
#[derive(Clone)]
pub struct Move {
    pub w: Vec<Vector3<f64>>,
    pub y: Vec<Vector3<f64>>,
}

/// Newton step, tangent and stability of a state.
pub struct Look {
    /// Newton's step.
    pub step: Move,
    /// How the state moves as the load grows.
    pub tangent: Move,
    /// The least pivot, as a share of what the element alone would have: 1 at rest, 0 where stability is lost. Negative where a
    /// pivot is not positive definite. Under a dead tip moment the product of all determinants in its place.
    pub softest: f64,
}

/// Bending of an element: gradients by the rotations of its ends are -m and m.
pub struct Bend {
    pub m: Vector3<f64>,
    /// Second order in w_b - w_a
    pub H: Matrix3<f64>,
}

/// Strain of an element is twice the vector part of the quaternion from one end to the other, less h u*.
pub fn bend(element: &Element, a: &Quaternion<f64>, b: &Quaternion<f64>, R: &Matrix3<f64>) -> Option<Bend> {
    let mut q = a.conjugate() * b;
    if q.w < 0.0 {
        q = -q;
    }
    let (v, stiffness) = (q.imag(), element.K / element.h);
    let moment = stiffness.component_mul(&(2.0 * v - element.rest));
    let T = (Matrix3::from_diagonal_element(q.w) - hat(&v)) * R.transpose();
    let turned = Matrix3::from_diagonal_element(0.5 * moment.dot(&v));
    let H = T.transpose() * Matrix3::from_diagonal(&stiffness) * T - turned;
    (q.w >= LEAST_COSINE).then(|| Bend { m: T.transpose() * moment, H })
}

/// Where nodes are, how they are turned, and what elements bear.
#[derive(Clone)]
pub struct State {
    pub q: Vec<Quaternion<f64>>,
    pub R: Vec<Matrix3<f64>>,
    pub p: Vec<Vector3<f64>>,
    pub y: Vec<Vector3<f64>>,
}

impl State {
    pub fn new(chain: &Chain, q: Vec<Quaternion<f64>>, y: Vec<Vector3<f64>>) -> State {
        let R: Vec<Matrix3<f64>> = q.iter().map(matrix_of).collect();
        let mut p = vec![chain.base];
        for (i, element) in chain.elements.iter().enumerate() {
            let along = Vector3::z() + element.compliance.component_mul(&y[i]);
            let step = 0.5 * element.h * (R[i] + R[i + 1]) * along;
            p.push(p[i] + chain.nodes[i].jump * R[i].column(2) + step);
        }
        State { q, R, p, y }
    }
}

/// The determinant of a pivot over what it would be at rest. The product of all is 0 where equilibria cease to be isolated: under a
/// dead moment, which has no energy, that alone ends a path.
pub fn firmness(pivot: &Matrix3<f64>, at_rest: &Matrix3<f64>) -> f64 {
    pivot.determinant() / at_rest.determinant().abs()
}

/// The determinant of a pivot's symmetric part over that of what it would be at rest; negative where it is not positive definite.
pub fn softness(pivot: &Matrix3<f64>, at_rest: &Matrix3<f64>) -> f64 {
    let s = 0.5 * (pivot + pivot.transpose());
    let is_positive = s[(0, 0)] > 0.0 && s[(0, 0)] * s[(1, 1)] - s[(0, 1)] * s[(0, 1)] > 0.0 && s.determinant() > 0.0;
    if is_positive { s.determinant() / at_rest.determinant().abs() } else { -1.0 }
}
