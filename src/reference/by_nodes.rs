//! The equilibrium by rotation and moment at nodes: multiple shooting, for limp and taut rods.

use super::answer::{Equilibrium, SI, SlotDerivative, Stability, TOLERANCE, TotalChange, status};
use super::chain::{Chain, Variation, rows};
use super::compliance::node_margin;
use super::extrapolation::Extrapolation;
use super::multiple::{Passages, size};
use super::node_ramp::{NodePath, are_alike, follow, from_rest};
use super::places::{Node, first_curvature, growth, last_curvature, mesh};
use super::stability;
use super::state::Column;
use crate::model::{Rod, Slot, Status, Units};
use nalgebra::Vector3;

/// Above this growth exponent single shooting is not tried: it would lose five digits and more.
const LIMP: f64 = 12.0;
/// Longest interval, in units of the growth. MS2
const LONGEST: f64 = 1.0;
/// A last step of Newton's above this is no convergence.
const LEFT_OVER: f64 = 1e-7;
/// Round-off of one interval.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;
/// Base moments that differ by no more than this, against the larger of theirs and EI / L, are those of one equilibrium.
const SAME_MOMENT: f64 = 1e-3;
/// Most of Newton's steps after the path.
const MOST_STEPS: usize = 12;

/// Nodes in equilibrium.
struct Polished {
    nodes: Vec<Node>,
    passages: Passages,
    /// Newton's step that was not worth taking.
    left_over: f64,
    /// What it would do to the tip.
    tip_shift: f64,
    steps: usize,
}

/// Whether errors grow too much along the rod for its base moment to tell its state. MS1
pub(super) fn is_limp(chain: &Chain) -> bool {
    growth(chain) > LIMP
}

/// Solves the rod from rest and differentiates the solution by `slots`.
pub(super) fn solve(rod: &Rod, units: &Units, full: &Chain, slots: &[Slot]) -> Equilibrium {
    let without = |status| Equilibrium::without_solution(status, slots.len());
    let Some((path, is_sure)) = path(full) else { return without(Status::StepLimit) };
    let chain = full.loaded(path.lambda);
    let mut integrator = Extrapolation::new(TOLERANCE);
    let Some(found) = polish(&chain, path.nodes, &mut integrator) else { return without(Status::NonFinite) };
    let nodes = found.nodes;
    let index = stability::index(&chain, &nodes, &mut integrator);
    let is_unstable = index.map(|index| is_unstable(&chain, &found.passages, index));
    let status = status((path.lambda, path.gave_up, path.steps), (found.left_over, LEFT_OVER), is_unstable);
    let status = if is_sure { status } else { Status::Doubtful };
    let index = index.unwrap_or_default();
    let derivatives = differentiate(&chain, units, &nodes, slots, &mut integrator);
    let (u_first, _) = first_curvature(&chain, &[], nodes[0].state(Vec::new()));
    let u_last = last_curvature(&chain, &nodes, &mut integrator).unwrap_or_default();
    let passages = &found.passages;
    Equilibrium {
        n0: SI(chain.n_start(0), units.force),
        m0: SI(chain.R0 * nodes[0].m_body, units.moment()),
        u0: SI(u_first, units.curvature()),
        p_tip: SI(passages.tip_position() + Vector3::from(rod.base_position) / units.length, units.length),
        R_tip: rows(&passages.tip().R),
        u_tip: SI(u_last, units.curvature()),
        residual: passages.residual.norm() * units.moment(),
        error_estimate: passages.tip_error(ROUND_OFF) + found.tip_shift,
        index,
        margin: node_margin(
            &chain,
            &nodes,
            &mut integrator,
            passages.inverse(),
            (index, is_unstable.unwrap_or_default()),
        ),
        status,
        load_fraction: path.lambda,
        iterations: path.passes + found.steps,
        derivatives: derivatives.unwrap_or_else(|| vec![SlotDerivative::default(); slots.len()]),
        contact: None,
        nodes,
    }
}

/// From rest as far as it goes, and whether that is sure; a path that ends under part of the load is followed again on twice the mesh, and only
/// where that ends, too, it was a fold.
fn path(full: &Chain) -> Option<(NodePath, bool)> {
    mesh(full, LONGEST)?;
    let first = follow(full, LONGEST, 1.0);
    let path = if first.lambda < 1.0 && !first.gave_up {
        let finer = follow(full, 0.5 * LONGEST, 0.5);
        let is_end = finer.lambda < 1.0 && are_alike(&first, &finer);
        if is_end { (finer, true) } else { from_rest(full, 0.5 * LONGEST, None) }
    } else {
        from_rest(full, LONGEST, Some(first))
    };
    (!path.0.nodes.is_empty()).then_some(path)
}

/// Full steps of Newton's iteration until they get no smaller.
fn polish(chain: &Chain, mut nodes: Vec<Node>, integrator: &mut Extrapolation) -> Option<Polished> {
    let mut last = f64::INFINITY;
    let mut steps = 0;
    loop {
        let passages = Passages::new(chain, &nodes, &[], integrator)?;
        let changes = passages.newton_step();
        let left_over = size(&changes);
        steps += 1;
        // Also false for NaN.
        let shrinks = left_over < 0.5 * last;
        let ends = !shrinks || left_over <= f64::EPSILON || steps == MOST_STEPS;
        if ends {
            let (dp, w) = passages.tip_change(&changes, None);
            return Some(Polished { nodes, left_over, tip_shift: dp.norm().max(w.norm()), passages, steps });
        }
        last = left_over;
        nodes = passages.moved(&nodes, &changes);
    }
}

/// By det W, which has the sign of that of its inverse; passages give the inverse negated.
fn is_unstable(chain: &Chain, passages: &Passages, index: usize) -> bool {
    stability::is_unstable(chain, -passages.inverse().determinant(), index)
}

fn slot_variations(chain: &Chain, slots: &[Slot], nodes: &[Node]) -> Vec<Variation> {
    slots.iter().map(|slot| chain.slot_variation(*slot, nodes[0].m_body)).collect()
}

/// Total derivatives: a response of the nodes for each slot. MS5
fn differentiate(
    chain: &Chain,
    units: &Units,
    nodes: &[Node],
    slots: &[Slot],
    integrator: &mut Extrapolation,
) -> Option<Vec<SlotDerivative>> {
    if slots.is_empty() {
        return Some(Vec::new());
    }
    let variations = slot_variations(chain, slots, nodes);
    let passages = Passages::new(chain, nodes, &variations, integrator)?;
    let derivative = |(k, slot): (usize, &Slot)| {
        let variation = &variations[k];
        let (dp, w) = passages.tip_change(&passages.response(k), Some(k));
        let at_base = passages.node_columns(k, variation)[0];
        let (u_first, du_first) =
            first_curvature(chain, std::slice::from_ref(variation), nodes[0].state(vec![at_base]));
        let dm0_body = at_base.dm_body;
        let change = TotalChange { dp, w, dm0_body, du_first: du_first[0] };
        change.by_slot(chain, units, (*slot, variation), nodes[0].m_body, u_first)
    };
    Some(slots.iter().enumerate().map(derivative).collect())
}

/// Nodes, and how they change.
pub(super) struct MovingNodes {
    pub nodes: Vec<Node>,
    /// One for each slot.
    pub variations: Vec<Variation>,
    /// At each node its total change by each variation.
    pub columns: Vec<Vec<Column>>,
}

/// The equilibrium from rest if that has this base moment, with its changes by `slots`.
pub(super) fn from_rest_with(chain: &Chain, m0_body: Vector3<f64>, slots: &[Slot]) -> Option<MovingNodes> {
    let mut integrator = Extrapolation::new(TOLERANCE);
    let nodes = polished_from_rest(chain, m0_body, &mut integrator)?.nodes;
    let variations = slot_variations(chain, slots, &nodes);
    let passages = Passages::new(chain, &nodes, &variations, &mut integrator)?;
    let by_slot: Vec<Vec<Column>> =
        variations.iter().enumerate().map(|(k, variation)| passages.node_columns(k, variation)).collect();
    let columns = (0..nodes.len()).map(|i| by_slot.iter().map(|columns| columns[i]).collect()).collect();
    Some(MovingNodes { nodes, variations, columns })
}

/// Stability of the equilibrium from rest if that has this base moment.
pub(super) fn stability_from_rest(chain: &Chain, units: &Units, m0_body: Vector3<f64>) -> Option<Stability> {
    let mut integrator = Extrapolation::new(TOLERANCE);
    let found = polished_from_rest(chain, m0_body, &mut integrator)?;
    let index = stability::index(chain, &found.nodes, &mut integrator)?;
    let is_unstable = is_unstable(chain, &found.passages, index);
    let margin = node_margin(chain, &found.nodes, &mut integrator, found.passages.inverse(), (index, is_unstable));
    Some(Stability { index, margin, residual: found.passages.residual.norm() * units.moment() })
}

fn polished_from_rest(chain: &Chain, m0_body: Vector3<f64>, integrator: &mut Extrapolation) -> Option<Polished> {
    let (path, _) = path(chain).filter(|(path, _)| path.lambda >= 1.0)?;
    let found = polish(chain, path.nodes, integrator)?;
    let m0 = found.nodes[0].m_body;
    let is_same = (m0 - m0_body).norm() <= SAME_MOMENT * m0.norm().max(1.0);
    (is_same && found.left_over <= LEFT_OVER).then_some(found)
}
