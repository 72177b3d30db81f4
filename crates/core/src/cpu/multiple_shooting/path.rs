//! The path from rest by nodes: load steps on all of them together, each on the stable branch. N4
//!
//! A rod's steps depend on that rod alone: a lane that has finished is frozen while its neighbours go on.

use super::elimination::rotate;
use super::interval::{Node, turn};
use super::state::{Nodes, Purpose};
use crate::cpu::algebra::{affordable, axpy, differs_widely, length as length_of};
use crate::cpu::rod::problem::{Problem, Workspace};
use crate::cpu::rod::stability::has_no_energy;
use crate::cpu::simd::lane::Lane;
use crate::model::tolerances::{
    CORRECTIONS, NODE_AIM, NODE_CONTRACTION, NODE_FIRST_STEP, NODE_FOLD_PIVOT, NODE_HALFWAY, NODE_LEAST_RATIO,
    NODE_MOST_RATIO, NODE_NEAR_PIVOT, NODE_PASS_LIMIT, NODE_RETREAT, NODE_SMALLEST_FIRST_STEP, NODE_SMALLEST_STEP,
    NODE_TRUST, NODE_WARY, NodePace, SPENT, WIDENING,
};

/// Where the paths of a register ended.
pub struct NodePath<L: Lane> {
    pub reached: L::Mask,
    /// Not reached, and near a fold or a bifurcation.
    pub fold: L::Mask,
    pub exhausted: L::Mask,
    pub lambda: L,
    pub passes: L,
}

/// Leads `wanted` lanes from rest to their full load; their nodes are then those of the equilibrium there.
#[inline(always)]
pub fn follow_nodes<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    pace: NodePace,
    wanted: L::Mask,
    workspace: &mut Workspace<L>,
) -> NodePath<L> {
    let zero = problem.rod.t.x.constant(0.0);
    let one = zero.constant(1.0);
    let nobody = one.lt(zero);
    nodes.rest(problem, workspace);
    nodes.accepted.clone_from(&nodes.nodes);
    nodes.before.clone_from(&nodes.nodes);
    nodes.earlier.clone_from(&nodes.nodes);
    let (mut lambda, mut lambda_before, mut lambda_earlier) = (zero, zero, zero);
    let mut step = one.constant(NODE_FIRST_STEP);
    let mut target = step;
    let trust = NODE_TRUST * problem.program.pace;
    let first_bound = one.constant(trust / NODE_CONTRACTION);
    // The least pivot on the last accepted step, and on all of them.
    let (mut last_least, mut weakest) = (one, one);
    let (mut last_size, mut first_size) = (first_bound, zero);
    let (mut corrections, mut passes) = (zero, zero);
    let (mut reached, mut failed, mut exhausted, mut unstable) = (nobody, !wanted, nobody, nobody);
    // Lanes whose load step has arrived and is looked at halfway; its least pivot, and how far it leads.
    let (mut checking, mut least_at_end, mut length) = (nobody, one, one);
    loop {
        let active = !(reached | failed);
        if !L::any(active) {
            break;
        }
        let load = L::select(checking, (lambda + target) * one.constant(0.5), target);
        nodes.pass(problem, load, Purpose::Transfers, workspace);
        let size = nodes.newton_step(problem, load);
        let mut least = nodes.elimination.least;
        // Newton's method leads to other branches from where the energy is not convex.
        let mut convex = nodes.elimination.index.lt(one.constant(0.5));
        let contracting =
            size.lt(last_size * one.constant(NODE_CONTRACTION)) & corrections.lt(one.constant(CORRECTIONS));
        let (mut arrives, mut tolerance, mut dead) = (active, one.constant(pace.tolerance), nobody);
        if problem.program.load_without_energy {
            // A dead moment has no energy: pivots count as they are.
            let whole = nodes.elimination.least_whole(&nodes.transfers);
            dead = has_no_energy(problem.rod);
            least = L::select(dead, whole, least);
            convex = (convex & !dead) | (dead & zero.lt(whole));
            // Beyond a fold Newton's steps shrink by half for a while, and lead through the gap to another branch.
            arrives = active & (contracting | !dead);
            tolerance = L::select(dead, one.constant(pace.tolerance * NODE_WARY), tolerance);
        }
        let near = least.lt(one.constant(pace.least_pivot));
        let stable = convex & !near & !leaps(least, last_least);
        let partial = target.lt(one);
        let converged = size.lt(narrowed(least) * tolerance);
        let ends = arrives & converged & stable & !checking;
        // Both ends of a load step may be stable, and a gap lie between them.
        let passes_between = checking & zero.lt(least) & size.lt(length * one.constant(NODE_HALFWAY));
        let begins_check = ends & dead;
        let accept = (ends & !dead) | passes_between;
        let go_on = active & !converged & contracting & convex & !checking;
        let reject = active & !(accept | go_on | begins_check);
        unstable = (unstable & !active) | (reject & (converged | checking));
        least = L::select(checking, least_at_end, least);
        let used = target - lambda;
        let most = affordable(least, last_least, used, NODE_NEAR_PIVOT, SPENT);
        last_least = L::select(accept, least, last_least);
        weakest = L::select(accept, weakest.min(least), weakest);

        nodes.take_step((accept & !checking) | go_on | begins_check);
        nodes.end_check(checking);
        nodes.keep(accept);
        lambda_earlier = L::select(accept, lambda_before, lambda_earlier);
        lambda_before = L::select(accept, lambda, lambda_before);
        lambda = L::select(accept, target, lambda);
        reached = reached | (accept & !partial);
        first_size = L::select(corrections.lt(one.constant(0.5)), size, first_size);
        let ratio = (narrowed(last_least) * one.constant(NODE_AIM * trust) / first_size.max(one.constant(1e-6))).sqrt();
        let ratio = ratio.max(one.constant(NODE_LEAST_RATIO)).min(one.constant(NODE_MOST_RATIO));
        // From rest the first correction is as the load.
        let is_first = corrections.lt(one.constant(0.5)) & lambda.lt(one.constant(NODE_SMALLEST_FIRST_STEP));
        let back = one.constant(NODE_AIM * trust) / size;
        let back = L::select(is_first & back.lt(one.constant(NODE_RETREAT)), back, one.constant(NODE_RETREAT));
        step = L::select(accept, (used * ratio).min(most), L::select(reject, used * back, step));
        let smallest = (lambda * one.constant(NODE_SMALLEST_STEP)).max(one.constant(NODE_SMALLEST_FIRST_STEP));
        failed = failed | (reject & step.lt(smallest));
        let restart = (accept | reject) & !reached;
        target = L::select(restart, (lambda + step).min(one), target);
        let earlier = if pace.is_quick() { lambda_earlier } else { lambda_before };
        let equilibria = [on_path(pace, earlier), on_path(pace, lambda_before), on_path(pace, lambda)];
        predict(nodes, restart, equilibria, on_path(pace, target));
        nodes.hold_base(problem);
        if L::any(begins_check) {
            let end = begin_check(nodes, begins_check, [lambda_before, lambda, target]);
            length = L::select(begins_check, end, length);
            least_at_end = L::select(begins_check, least, least_at_end);
        }
        checking = begins_check;
        last_size = L::select(go_on, size, narrowed(last_least) * first_bound);
        corrections = L::select(go_on | begins_check, corrections + one, zero);
        passes = L::select(active, passes + one, passes);
        let over = active & !reached & !passes.lt(one.constant(NODE_PASS_LIMIT));
        exhausted = exhausted | over;
        failed = failed | over;
    }
    let fold = wanted & !(reached | exhausted) & (unstable | weakest.lt(one.constant(NODE_FOLD_PIVOT)));
    NodePath { reached: reached & wanted, fold, exhausted, lambda, passes }
}

/// The share of a correction's bounds that holds at a least pivot: next to a bifurcation other branches are as near as its
/// root.
#[inline(always)]
fn narrowed<L: Lane>(least: L) -> L {
    (least * least.constant(1.0 / NODE_NEAR_PIVOT)).max(least.constant(0.0)).min(least.constant(1.0)).sqrt()
}

/// Whether a load step changes the least pivot so much, where it is small, that stability may be lost and won again between.
#[inline(always)]
fn leaps<L: Lane>(least: L, last: L) -> L::Mask {
    differs_widely(least, last, NODE_NEAR_PIVOT, WIDENING)
}

/// Puts the nodes of lanes that start a load step where the last equilibria point to: three, or two where two are one.
#[inline(always)]
fn predict<L: Lane>(nodes: &mut Nodes<L>, restart: L::Mask, [earlier, before, last]: [L; 3], target: L) {
    let zero = last.constant(0.0);
    let (ahead, secant, secant_before) = (target - last, last - before, before - earlier);
    // Newton's form of the parabola: the last secant, and the change from the one before it.
    let bend = over(ahead * (ahead + secant), secant + secant_before);
    let bend = L::select(zero.lt(secant_before), bend, zero);
    let by_last = over(ahead, secant) + over(bend, secant);
    let by_before = over(bend, secant_before);
    let equilibria = nodes.accepted.iter().zip(&nodes.before).zip(&nodes.earlier);
    for (trial, ((accepted, before), earlier)) in nodes.nodes.iter_mut().zip(equilibria) {
        let w = turn(before, accepted) * by_last - turn(earlier, before) * by_before;
        let m = axpy(-by_before, before.m - earlier.m, axpy(by_last, accepted.m - before.m, accepted.m));
        let predicted = Node { d1: rotate(w, accepted.d1), t: rotate(w, accepted.t), m };
        *trial = Node::select(restart, predicted, *trial);
    }
}

/// Puts the nodes of lanes that look at a load step halfway along it: on the parabola through its ends and the equilibrium before it,
/// or on a line. Returns how far the step leads: radians, or moment relative to 1 plus the largest.
#[inline(always)]
fn begin_check<L: Lane>(nodes: &mut Nodes<L>, lanes: L::Mask, [before, last, end]: [L; 3]) -> L {
    let zero = last.constant(0.0);
    let (secant, step) = (last - before, end - last);
    let bend = over(step * step * zero.constant(0.25), step + secant);
    let bend = L::select(zero.lt(secant), bend, zero);
    let by_step = zero.constant(0.5) - over(bend, step);
    let by_secant = over(bend, secant);
    let (mut turned, mut changed, mut largest) = (zero, zero, zero);
    nodes.at_end.clone_from(&nodes.nodes);
    let equilibria = nodes.accepted.iter().zip(&nodes.before);
    for (trial, (accepted, before)) in nodes.nodes.iter_mut().zip(equilibria) {
        let (w, dm) = (turn(accepted, trial), trial.m - accepted.m);
        turned = turned.max(length_of(w));
        changed = changed.max(length_of(dm));
        largest = largest.max(length_of(trial.m));
        let w = w * by_step + turn(before, accepted) * by_secant;
        let m = axpy(by_secant, accepted.m - before.m, axpy(by_step, dm, accepted.m));
        let halfway = Node { d1: rotate(w, accepted.d1), t: rotate(w, accepted.t), m };
        *trial = Node::select(lanes, halfway, *trial);
    }
    turned.max(changed / (zero.constant(1.0) + largest))
}

/// What a path goes along: the load, quickly its square root.
#[inline(always)]
fn on_path<L: Lane>(pace: NodePace, lambda: L) -> L {
    if pace.is_quick() { lambda.sqrt() } else { lambda }
}

/// A share of a load step; none of one that has not been.
#[inline(always)]
fn over<L: Lane>(span: L, step: L) -> L {
    let zero = span.constant(0.0);
    L::select(zero.lt(step), span / step, zero)
}
