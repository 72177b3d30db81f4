//! Newton's step and the tangent of the path, by elimination of the Hessian from the tip; its pivots tell stability.

use super::chain::{Chain, Element};
use super::load::{Arms, potential};
use super::turn::{hat, matrix_of};
use super::varying;
use nalgebra::{Matrix3, Quaternion, Vector3};

/// An element that bends so far that the cosine of half the angle is less: there are too few elements.
const LEAST_COSINE: f64 = 0.5;

/// How nodes turn (rad, world frame) and what elements bear beside (N, body frame), which strains them.
#[derive(Clone)]
pub struct Move {
    pub w: Vec<Vector3<f64>>,
    pub y: Vec<Vector3<f64>>,
}

/// What one look at a state gives.
pub struct Look {
    /// Newton's step.
    pub step: Move,
    /// How the state moves as the load grows.
    pub tangent: Move,
    /// The least pivot, as a share of what the element alone would have: 1 at rest, 0 where stability is lost. Negative where a
    /// pivot is not positive definite.
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

/// Looks at a state under a share of the full load. `None` where an element bends too far, or a pivot has no inverse.
pub fn look(chain: &Chain, state: &State, share: f64) -> Option<Look> {
    let arms = Arms { work: chain.arm, motion: chain.arm };
    let eliminate = |arms, with_moment| match chain.field {
        Some(_) => varying::eliminate(chain, state, share, arms, with_moment),
        None => eliminate(chain, state, share, with_moment),
    };
    let stable = eliminate(arms, false)?;
    let is_unsymmetric = chain.tip_moment.is_some() || chain.field.is_some() && chain.arm == 0.0;
    match is_unsymmetric {
        // Stability is a matter of the symmetric part.
        true => Some(Look { softest: stable.softest, ..eliminate(Arms { motion: 1.0, ..arms }, true)? }),
        false => Some(stable),
    }
}

/// What elimination keeps of a node: its w is -step - by_w w_before.
#[derive(Clone, Copy, Default)]
struct Kept {
    step: Vector3<f64>,
    slope: Vector3<f64>,
    by_w: Matrix3<f64>,
}

/// In a uniform field places play no part.
fn eliminate(chain: &Chain, state: &State, share: f64, with_moment: bool) -> Option<Look> {
    let last = chain.elements.len();
    let mut kept = vec![Kept::default(); last + 1];
    let mut softest = f64::INFINITY;
    let arms = Arms { work: 1.0, motion: 1.0 };
    let loads = |i: usize| potential(chain, i, (&state.p[i], &state.R[i]), share, arms);
    let mut ahead = loads(last);
    if let Some(moment) = chain.tip_moment.filter(|_| with_moment) {
        ahead.ww -= 0.5 * share * hat(&moment);
    }
    for i in (0..last).rev() {
        let bend = bend(&chain.elements[i], &state.q[i], &state.q[i + 1], &state.R[i])?;
        let twist = 0.5 * hat(&bend.m);
        let pivot = ahead.ww + bend.H;
        softest = softest.min(softness(&pivot, &bend.H));
        let inverse = pivot.try_inverse()?;
        let (step, slope) = (inverse * (ahead.w + bend.m), inverse * ahead.w_slope);
        let (by_w, to_w) = (inverse * (-bend.H - twist), -bend.H + twist);
        let mut before = loads(i);
        before.w -= bend.m + to_w * step;
        before.w_slope -= to_w * slope;
        before.ww += bend.H - to_w * by_w;
        kept[i + 1] = Kept { step, slope, by_w };
        ahead = before;
    }
    let nothing = Move { w: vec![Vector3::zeros()], y: vec![Vector3::zeros(); last] };
    let mut found = Look { step: nothing.clone(), tangent: nothing, softest };
    for i in 0..last {
        let of = &kept[i + 1];
        found.step.w.push(-of.step - of.by_w * found.step.w[i]);
        found.tangent.w.push(-of.slope - of.by_w * found.tangent.w[i]);
    }
    Some(found)
}

/// The determinant of a pivot's symmetric part over that of what it would be at rest; negative where it is not positive definite.
pub fn softness(pivot: &Matrix3<f64>, at_rest: &Matrix3<f64>) -> f64 {
    let s = 0.5 * (pivot + pivot.transpose());
    let is_positive = s[(0, 0)] > 0.0 && s[(0, 0)] * s[(1, 1)] - s[(0, 1)] * s[(0, 1)] > 0.0 && s.determinant() > 0.0;
    if is_positive { s.determinant() / at_rest.determinant().abs() } else { -1.0 }
}
