//! How near the rod comes to a wall along its whole length.

use super::contact::Contact;
use super::flexible::Flexible;
use super::rigid;
use super::state::{BaseLoad, Varying};
use crate::reference::extrapolation::{Extrapolation, RunAway};
use nalgebra::Vector3;

/// Points on each segment; between three the gap is a parabola.
const POINTS: usize = 100;

/// Least gap of the rod beyond where it first is before the wall; infinite where that is nowhere.
pub(super) fn least_gap(
    rod: &Varying,
    contact: &Contact,
    base: &BaseLoad,
    integrator: &mut Extrapolation,
) -> Result<f64, RunAway> {
    let mut least = f64::INFINITY;
    let mut is_beyond = false;
    let mut state = rod.base_state(base, &[]);
    for (j, segment) in rod.chain.numbers.segments.iter().enumerate() {
        let mut gaps = vec![contact.gap(state.p).g];
        let place = |k: usize| segment.length * k as f64 / POINTS as f64;
        if rod.chain.is_flexible[j] {
            let flexible = Flexible::new(rod, j, &[]);
            for k in 0..POINTS {
                flexible.advance(integrator, place(k), place(k + 1), &mut state)?;
                gaps.push(contact.gap(state.p).g);
            }
        } else {
            let t: Vector3<f64> = state.R.column(2).into();
            gaps.extend((1..=POINTS).map(|k| contact.gap(state.p + place(k) * t).g));
            rigid::cross(rod, j, &[], &mut state);
        }
        let beyond = if is_beyond { Some(0) } else { gaps.iter().position(|g| *g >= 0.0) };
        if let Some(first) = beyond {
            is_beyond = true;
            least = least.min(least_of(&gaps[first..]));
        }
    }
    Ok(least)
}

/// Least value of points equally far from each other and of the parabolas through three of them.
fn least_of(values: &[f64]) -> f64 {
    let of_parabola = |v: &[f64]| {
        let (slope, bend) = (0.5 * (v[2] - v[0]), v[0] - 2.0 * v[1] + v[2]);
        // Only where it is least within.
        if bend > slope.abs() { v[1] - 0.5 * slope * slope / bend } else { v[1] }
    };
    let at_points = values.iter().copied().fold(f64::INFINITY, f64::min);
    values.windows(3).map(of_parabola).fold(at_points, f64::min)
}
