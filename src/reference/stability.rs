//! Elastic stability: the index of the second variation of the energy, and the distance to a fold.
//!
//! The rod is cut into intervals too short to buckle between clamped ends. Minimised over the inside of each interval,
//! the second variation is a quadratic form in the rotations of the cuts, block tridiagonal; eliminating cut by cut
//! from the tip, its index is the number of negative eigenvalues of the pivots. Integration starts anew at every node.

use super::chain::Chain;
use super::extrapolation::Extrapolation;
use super::flexible::Flexible;
use super::places::{Node, all_flexible, ends, sections};
use super::rigid;
use super::state::{Column, State};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use std::f64::consts::PI;

/// Share of the buckling bound that an interval may reach.
const SAFETY: f64 = 0.7;
/// More intervals than this mean that no bending stiffness is left to speak of.
const MOST_INTERVALS: usize = 50_000;

/// Second variation over one interval, by the rotations of its proximal (0) and distal (1) end.
pub(super) struct Interval {
    pub h00: Matrix3<f64>,
    pub h01: Matrix3<f64>,
    pub h11: Matrix3<f64>,
    /// Of the rigid segments that follow.
    pub h_rigid: Matrix3<f64>,
    /// What a moment would turn without loads: the integral of R K^-1 R^T.
    pub give: Matrix3<f64>,
}

/// sqrt(3) / |W^-1| of W = dr/dm0, negative when unstable.
pub(super) fn margin(inverse: Option<Matrix3<f64>>, is_unstable: bool) -> f64 {
    let size = inverse.map_or(0.0, |inverse| 3.0_f64.sqrt() / inverse.norm());
    if is_unstable { -size } else { size }
}

/// Whether an equilibrium with this det W and stability index is unstable. Under a dead tip moment the index bounds stability from
/// one side only, and det W tells divergence. S6
pub(super) fn is_unstable(chain: &Chain, determinant: f64, index: usize) -> bool {
    let is_undiverged = chain.has_no_energy() && determinant > 0.0;
    index > 0 && !is_undiverged
}

/// Negative eigenvalues of the second variation at the equilibrium with these nodes.
///
/// `None` where the rod cannot be integrated.
pub(super) fn index(chain: &Chain, nodes: &[Node], integrator: &mut Extrapolation) -> Option<usize> {
    index_beyond(chain, nodes, integrator, 0.0)
}

/// Eigenvalues of the pivots below zero by more than this share of the largest.
pub(super) fn index_beyond(chain: &Chain, nodes: &[Node], integrator: &mut Extrapolation, share: f64) -> Option<usize> {
    let mut index = 0;
    let mut beyond = Matrix3::zeros();
    for interval in intervals(chain, nodes, integrator, 0)?.iter().rev() {
        let pivot = interval.h11 + interval.h_rigid + beyond;
        index += negative_eigenvalues(pivot, share)?;
        beyond = interval.h00 - interval.h01 * pivot.try_inverse()? * interval.h01.transpose();
    }
    Some(index)
}

/// `None` for a matrix that is not finite, on which the decomposition would not end.
fn negative_eigenvalues(matrix: Matrix3<f64>, share: f64) -> Option<usize> {
    const MOST_ITERATIONS: usize = 200;
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_ITERATIONS)?;
    let least = -share * eigen.eigenvalues.amax();
    Some(eigen.eigenvalues.iter().filter(|value| **value < least).count())
}

/// The intervals of a rod; what they would give without loads, by so many panels, or not at all.
pub(super) fn intervals(
    chain: &Chain,
    nodes: &[Node],
    integrator: &mut Extrapolation,
    panels: usize,
) -> Option<Vec<Interval>> {
    let mut intervals: Vec<Interval> = Vec::new();
    let flexible = all_flexible(chain, &vec![chain.no_variation(); 6]);
    for (node, end) in nodes.iter().zip(ends(chain, nodes)) {
        let mut state = node.state(Vec::new());
        for section in sections(chain, node.place, end) {
            let j = section.segment;
            if !chain.is_flexible[j] {
                if let Some(interval) = intervals.last_mut() {
                    interval.h_rigid += rigid_form(chain, j, &state.R);
                }
                rigid::cross(chain, j, &[], &mut state);
                continue;
            }
            let mut s = section.start;
            while s < section.end {
                let K = flexible[j].K(s).min().min(flexible[j].K(section.end).min());
                let longest = interval_length(K, state.m_body.norm(), flexible[j].softening(s));
                // Equal pieces rather than long ones and a tiny one.
                let pieces = ((section.end - s) / longest).ceil();
                let end = if pieces > 1.0 { s + (section.end - s) / pieces } else { section.end };
                intervals.push(interval(&flexible[j], s, end, &mut state, integrator, panels)?);
                if intervals.len() > MOST_INTERVALS {
                    return None;
                }
                s = end;
            }
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
    panels: usize,
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
    // A moment that turns the interval's end by about one radian.
    let moment = flexible.K(start).min() / (end - start);
    let by_moment = (0..3).map(|k| column(zero, moment * unit(k)));
    state.columns = (0..3).map(|k| column(unit(k), zero)).chain(by_moment).collect();
    let give =
        |s: f64, state: &State| state.R * Matrix3::from_diagonal(&flexible.K(s).map(|K| 1.0 / K)) * state.R.transpose();
    // Simpson's rule.
    let half = 0.5 * (end - start) / panels.max(1) as f64;
    let mut total = Matrix3::zeros();
    if panels == 0 {
        flexible.advance(integrator, start, end, state).ok()?;
    }
    for panel in 0..panels {
        let at = |k: usize| if panel + 1 == panels && k == 2 { end } else { start + (2 * panel + k) as f64 * half };
        total += give(at(0), state);
        flexible.advance(integrator, at(0), at(1), state).ok()?;
        total += 4.0 * give(at(1), state);
        flexible.advance(integrator, at(1), at(2), state).ok()?;
        total += give(at(2), state);
    }
    let columns = std::mem::take(&mut state.columns);
    let m = state.R * state.m_body;
    let q = |column: &Column| 0.5 * column.w.cross(&m) + state.R * column.dm_body;
    // w1 = a w0 + b q0, q1 = c w0 + d q0
    let [a, b] = [(0, 1.0), (3, moment)].map(|(at, by)| Matrix3::from_fn(|row, col| columns[at + col].w[row] / by));
    let d = Matrix3::from_columns(&[3, 4, 5].map(|k| q(&columns[k]) / moment));
    let b_inverse = b.try_inverse()?;
    let symmetric = |h: Matrix3<f64>| 0.5 * (h + h.transpose());
    Some(Interval {
        h00: symmetric(b_inverse * a),
        h01: -b_inverse,
        h11: symmetric(d * b_inverse),
        h_rigid: Matrix3::zeros(),
        give: total * (half / 3.0),
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
