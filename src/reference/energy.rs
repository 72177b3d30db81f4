//! Potential energy of a state: what is stored in the rod, less the work of the loads.

use super::chain::{self, Chain, nu};
use super::equilibrium::TOLERANCE;
use super::extrapolation::{Extrapolation, RunAway};
use super::flexible::Flexible;
use super::rigid;
use super::state::{State, base_state};
use crate::model::{Rod, Vector};
use nalgebra::Vector3;

/// Gauss and Legendre's points and weights on [0, 1].
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
/// Intervals of a segment: the rule's error, of order eight, stays below 1e-10 for a bend of a few radians.
const INTERVALS: usize = 8;

/// Energy of the state with base moment `m0` (N·m, world frame), against loads as they stand (J).
///
/// Equilibria of one rod can be compared by it. `None` where the rod cannot be integrated, and with a tip moment,
/// which has no potential.
pub fn energy(rod: &Rod, m0: Vector) -> Option<f64> {
    if rod.tip_moment != [0.0; 3] {
        return None;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let mut integrator = Extrapolation::new(TOLERANCE);
    let mut state = base_state(&chain, m0_body, &[]);
    let mut energy = 0.0;
    for (j, segment) in chain.numbers.segments.iter().enumerate() {
        if chain.is_flexible[j] {
            energy += of_flexible(&chain, j, &mut state, &mut integrator).ok()?;
        } else {
            let middle = state.p + 0.5 * segment.length * state.R.column(2);
            energy -= segment.load.dot(&middle) + (state.R * segment.mu).dot(&chain.numbers.B);
            rigid::cross(&chain, j, &[], &mut state);
        }
    }
    energy -= chain.numbers.f_tip.dot(&state.p);
    Some(energy * units.moment())
}

/// Takes the state over flexible segment j; its energy.
fn of_flexible(chain: &Chain, j: usize, state: &mut State, integrator: &mut Extrapolation) -> Result<f64, RunAway> {
    let segment = chain.numbers.segments[j];
    let flexible = Flexible::new(chain, j, &[]);
    let h = segment.length / INTERVALS as f64;
    let (mut s, mut energy) = (0.0, 0.0);
    for interval in 0..INTERVALS {
        for (place, weight) in GAUSS {
            let target = (interval as f64 + place) * h;
            flexible.advance(integrator, s, target, state)?;
            s = target;
            let v = state.m_body.component_div(&flexible.K(s));
            let n_body = state.R.tr_mul(&flexible.n(s));
            let strain = nu(segment.C_se, n_body) - Vector3::z();
            let stored = 0.5 * (state.m_body.dot(&v) + n_body.dot(&strain));
            let work = segment.load.dot(&state.p) + (state.R * segment.mu).dot(&chain.numbers.B);
            energy += weight * h * (stored - work);
        }
    }
    flexible.advance(integrator, s, segment.length, state)?;
    Ok(energy)
}
