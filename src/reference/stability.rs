//! Elastic stability: the index of the second variation of the energy, and the distance to a fold.
//!
//! The rod is cut into intervals too short to buckle between clamped ends. Minimised over the inside of each interval,
//! the second variation is a quadratic form in the rotations of the cuts, block tridiagonal; eliminating cut by cut
//! from the tip, its index is the number of negative eigenvalues of the pivots.

use super::chain::Chain;
use super::extrapolation::Extrapolation;
use super::flexible::Flexible;
use super::rigid;
use super::shooting::Passage;
use super::state::{Column, State, base_state};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use std::f64::consts::PI;

/// Share of the buckling bound that an interval may reach.
const SAFETY: f64 = 0.7;
/// More intervals than this mean that no bending stiffness is left to speak of.
const MOST_INTERVALS: usize = 5000;

/// Second variation over one interval, by the rotations of its proximal (0) and distal (1) end.
struct Interval {
    h00: Matrix3<f64>,
    h01: Matrix3<f64>,
    h11: Matrix3<f64>,
    /// Of the rigid segments that follow.
    h_rigid: Matrix3<f64>,
}

/// sqrt(3) / |(dr/dm0)^-1|, negative when unstable.
pub(super) fn margin(passage: &Passage, index: usize) -> f64 {
    let size = passage.matrix().try_inverse().map_or(0.0, |inverse| 3.0_f64.sqrt() / inverse.norm());
    if index > 0 { -size } else { size }
}

/// Negative eigenvalues of the second variation at the equilibrium with this base moment.
///
/// `None` where the rod cannot be integrated.
pub(super) fn index(chain: &Chain, m0_body: Vector3<f64>, integrator: &mut Extrapolation) -> Option<usize> {
    let mut index = 0;
    let mut beyond = Matrix3::zeros();
    for interval in intervals(chain, m0_body, integrator)?.iter().rev() {
        let pivot = interval.h11 + interval.h_rigid + beyond;
        index += negative_eigenvalues(pivot)?;
        beyond = interval.h00 - interval.h01 * pivot.try_inverse()? * interval.h01.transpose();
    }
    Some(index)
}

/// `None` for a matrix that is not finite, on which the decomposition would not end.
fn negative_eigenvalues(matrix: Matrix3<f64>) -> Option<usize> {
    const MOST_ITERATIONS: usize = 200;
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_ITERATIONS)?;
    Some(eigen.eigenvalues.iter().filter(|value| **value < 0.0).count())
}

fn intervals(chain: &Chain, m0_body: Vector3<f64>, integrator: &mut Extrapolation) -> Option<Vec<Interval>> {
    let mut state = base_state(chain, m0_body, &[]);
    let mut intervals: Vec<Interval> = Vec::new();
    let none = chain.base_moment_variations().map(|mut v| {
        v.dm0_body.fill(0.0);
        v
    });
    let homogeneous = [none.as_slice(), none.as_slice()].concat();
    for (j, segment) in chain.numbers.segments.iter().enumerate() {
        if chain.is_flexible[j] {
            let flexible = Flexible::new(chain, j, &homogeneous);
            let mut s = 0.0;
            while s < segment.length {
                let K = flexible.K(s).min().min(flexible.K(segment.length).min());
                let longest = interval_length(K, state.m_body.norm(), flexible.softening(s));
                let end = if s + longest >= segment.length { segment.length } else { s + longest };
                intervals.push(interval(&flexible, s, end, &mut state, integrator)?);
                if intervals.len() > MOST_INTERVALS {
                    return None;
                }
                s = end;
            }
        } else {
            if let Some(interval) = intervals.last_mut() {
                interval.h_rigid += rigid_form(chain, j, &state.R);
            }
            rigid::cross(chain, j, &[], &mut state);
        }
    }
    Some(intervals)
}

/// An h such that K |w'|^2 > |m| |w| |w'| + |n| |w|^2 on the mean, for every w that vanishes at both ends.
///
/// There |w| <= (h / pi) |w'| on the mean, and |m| grows by at most |n| h.
fn interval_length(K: f64, m: f64, n: f64) -> f64 {
    let (a, b, c) = (n / PI + n / (PI * PI), m / PI, SAFETY * K);
    2.0 * c / (b + (b * b + 4.0 * a * c).sqrt())
}

/// Carries the state over an interval and returns its quadratic form.
fn interval(
    flexible: &Flexible,
    start: f64,
    end: f64,
    state: &mut State,
    integrator: &mut Extrapolation,
) -> Option<Interval> {
    // The conjugate of w is q = dm - (w x m) / 2 = (w x m) / 2 + R dm_body.
    let m = state.R * state.m_body;
    let column = |w: Vector3<f64>, q: Vector3<f64>| Column {
        w,
        dp: Vector3::zeros(),
        dm_body: state.R.tr_mul(&(q - 0.5 * w.cross(&m))),
    };
    let zero = Vector3::zeros();
    let unit = |k: usize| Vector3::ith(k, 1.0);
    let columns = (0..3).map(|k| column(unit(k), zero)).chain((0..3).map(|k| column(zero, unit(k)))).collect();
    state.columns = columns;
    flexible.advance(integrator, start, end, state).ok()?;
    let columns = std::mem::take(&mut state.columns);
    let m = state.R * state.m_body;
    let q = |column: &Column| 0.5 * column.w.cross(&m) + state.R * column.dm_body;
    // w1 = a w0 + b q0, q1 = c w0 + d q0
    let [a, b] = [0, 3].map(|at| Matrix3::from_fn(|row, col| columns[at + col].w[row]));
    let d = Matrix3::from_columns(&[3, 4, 5].map(|k| q(&columns[k])));
    let b_inverse = b.try_inverse()?;
    let symmetric = |h: Matrix3<f64>| 0.5 * (h + h.transpose());
    Some(Interval {
        h00: symmetric(b_inverse * a),
        h01: -b_inverse,
        h11: symmetric(d * b_inverse),
        h_rigid: Matrix3::zeros(),
    })
}

/// Second variation of the work done by the field, the force and the weight on rigid segment j.
fn rigid_form(chain: &Chain, j: usize, R: &Matrix3<f64>) -> Matrix3<f64> {
    // Of -(a . b) for a vector a that turns with the segment.
    let form = |a: Vector3<f64>, b: Vector3<f64>| {
        Matrix3::identity() * a.dot(&b) - 0.5 * (a * b.transpose() + b * a.transpose())
    };
    let segment = chain.numbers.segments[j];
    let mut h = form(R * segment.mu, chain.numbers.B);
    if chain.rigid_force_arm {
        let arm: Vector3<f64> = segment.length * R.column(2);
        h += form(arm, chain.n_end[j] + 0.5 * segment.load);
    }
    h
}
