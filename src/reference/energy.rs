//! Potential energy of a state: what is stored in the rod, less the work of the loads.

use super::answer::{Equilibrium, TOLERANCE};
use super::by_nodes;
use super::chain::{self, Chain, nu};
use super::extrapolation::{Extrapolation, RunAway};
use super::flexible::Flexible;
use super::places::{Node, Section, ends, sections};
use super::rigid;
use super::state::State;
use super::varying;
use crate::model::{BaseWrench, Rod, Units};
use nalgebra::Vector3;

/// Gauss and Legendre's points and weights on [0, 1].
pub(super) const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
/// Intervals of a segment: the rule's error, of order eight, stays below 1e-10 for a bend of a few radians.
pub(super) const INTERVALS: usize = 8;
/// The same between two nodes, which bends less.
const INTERVALS_AT_NODES: usize = 2;

/// Energy of the state with this moment (N·m, world frame), or moment and force, at the base, against loads as they stand (J).
///
/// Equilibria of one rod can be compared by it. `None` where the rod cannot be integrated, and under loads that have
/// none: moments, and forces that turn with the rod. A base moment does not tell the state of a limp rod: there it must be that of the
/// equilibrium from rest.
pub fn energy(rod: &Rod, base: impl Into<BaseWrench>) -> Option<f64> {
    let base = base.into();
    if !rod.has_energy() {
        return None;
    }
    if let Some(found) = varying::energy(rod, &varying::Of::Base(base)) {
        return found;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(base.moment)) / units.moment();
    if by_nodes::is_limp(&chain) {
        let found = by_nodes::from_rest_with(&chain, m0_body, &[])?;
        return by_sections(&chain, &units, &found.nodes);
    }
    by_sections(&chain, &units, &[Node::base(&chain, m0_body)])
}

/// Energy of an equilibrium of this rod (J), against the loads that it bears; `None` as for [`energy`].
pub fn energy_of(rod: &Rod, equilibrium: &Equilibrium) -> Option<f64> {
    if !rod.has_energy() {
        return None;
    }
    if let Some(found) = varying::energy(rod, &varying::Of::Equilibrium(equilibrium)) {
        return found;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units).loaded(equilibrium.load_fraction);
    if !equilibrium.nodes.is_empty() {
        return by_sections(&chain, &units, &equilibrium.nodes);
    }
    let m0_body = chain.R0.tr_mul(&Vector3::from(equilibrium.m0)) / units.moment();
    by_sections(&chain, &units, &[Node::base(&chain, m0_body)])
}

/// Energy of all sections between nodes, each integrated from its node (J).
fn by_sections(chain: &Chain, units: &Units, nodes: &[Node]) -> Option<f64> {
    let mut integrator = Extrapolation::new(TOLERANCE);
    let intervals = if nodes.len() == 1 { INTERVALS } else { INTERVALS_AT_NODES };
    let mut energy = 0.0;
    let mut tip = nodes.first()?.p;
    for (node, end) in nodes.iter().zip(ends(chain, nodes)) {
        let mut state = node.state(Vec::new());
        for section in sections(chain, node.place, end) {
            let segment = &chain.numbers.segments[section.segment];
            if chain.is_flexible[section.segment] {
                energy += of_flexible(chain, section, intervals, &mut state, &mut integrator).ok()?;
            } else {
                let middle = state.p + 0.5 * segment.length * state.R.column(2);
                energy -= segment.load.dot(&middle) + (state.R * segment.mu).dot(&chain.numbers.B);
                rigid::cross(chain, section.segment, &[], &mut state);
            }
        }
        tip = state.p;
    }
    energy -= chain.numbers.f_tip.dot(&tip);
    Some(energy * units.moment())
}

/// Takes the state over a flexible section; its energy.
fn of_flexible(
    chain: &Chain,
    section: Section,
    intervals: usize,
    state: &mut State,
    integrator: &mut Extrapolation,
) -> Result<f64, RunAway> {
    let segment = chain.numbers.segments[section.segment];
    let flexible = Flexible::new(chain, section.segment, &[]);
    let h = (section.end - section.start) / intervals as f64;
    let (mut s, mut energy) = (section.start, 0.0);
    for interval in 0..intervals {
        for (place, weight) in GAUSS {
            let target = section.start + (interval as f64 + place) * h;
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
    flexible.advance(integrator, s, section.end, state)?;
    Ok(energy)
}
