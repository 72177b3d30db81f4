//! Elimination in a uniform field, where places play no part.

use super::chain::Chain;
use super::load::{Arms, potential};
use super::state::{Look, Move, State, bend, firmness, softness};
use super::turn::hat;
use nalgebra::{Matrix3, Vector3};

/// What elimination keeps of a node: its w is -step - by_w w_before.
#[derive(Clone, Copy, Default)]
struct Kept {
    step: Vector3<f64>,
    slope: Vector3<f64>,
    by_w: Matrix3<f64>,
}

/// Newton's step and the tangent of the path; with the moment at the tip as it is, or the symmetric part alone.
pub fn eliminate(chain: &Chain, state: &State, share: f64, with_moment: bool) -> Option<Look> {
    let last = chain.elements.len();
    let mut kept = vec![Kept::default(); last + 1];
    let (mut softest, mut whole) = (f64::INFINITY, 1.0);
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
        whole *= firmness(&pivot, &bend.H);
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
    let softest = if with_moment { whole } else { softest };
    let mut found = Look { step: nothing.clone(), tangent: nothing, softest };
    for i in 0..last {
        let of = &kept[i + 1];
        found.step.w.push(-of.step - of.by_w * found.step.w[i]);
        found.tangent.w.push(-of.slope - of.by_w * found.tangent.w[i]);
    }
    Some(found)
}
