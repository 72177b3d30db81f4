//! From rest to the full load with nodes along the rod: as `ramp`, for rods on which a base moment says too little.

use super::chain::Chain;
use super::extrapolation::{Extrapolation, RunAway};
use super::multiple::{Passages, along, carried, columns_size, size};
use super::places::{Node, Place, march, mesh};
use super::ramp::{ALIKE, ARRIVED, CORRECTION_TURN, Evidence, LITTLE_LOAD, Regular, TOLERANCE, twice};
use super::state::Column;
use super::{places, stability};
use nalgebra::Vector3;

/// Each of Newton's steps must be shorter than the last by this factor.
const CONTRACTION: f64 = 0.4;
/// The predictor may turn a node by this much in the first step (rad).
const FIRST_TURN: f64 = 0.5;
/// Corrections may be this large against the predicted change of the nodes, ...
const CORRECTION: f64 = 0.3;
/// ... or against this change, where hardly any is predicted.
const SMALL_CHANGE: f64 = 0.1;
/// The next load step aims at this share of the correction allowed, ...
const AIM: f64 = 0.35;
/// ... and is between these times the last one.
const RATIOS: (f64, f64) = (0.5, 4.0);
/// A rejected load step is shortened so.
const RETREAT: f64 = 0.4;
/// Load steps below this share of the load reached mean that the path ends.
const SMALLEST_STEP: f64 = 1e-6;
/// Newton's steps before giving up.
const MOST_PASSES: usize = 1000;

/// Where the path from rest leads.
pub(super) struct NodePath {
    pub nodes: Vec<Node>,
    /// Share of the load reached.
    pub lambda: f64,
    pub steps: usize,
    pub passes: usize,
    /// Ended by a bound on passages or nodes, not by the path.
    pub gave_up: bool,
}

/// An equilibrium on the path.
struct Step {
    nodes: Vec<Node>,
    /// d(nodes)/d(lambda)
    tangent: Vec<Column>,
    regular: Regular,
    /// The first correction over what was allowed.
    share: f64,
}

/// Follows the equilibrium from the unloaded rod as far as it stays stable, and whether two paths ended alike; intervals are at
/// most `longest` long, in units of the growth. The first path may be there already.
pub(super) fn from_rest(chain: &Chain, longest: f64, first: Option<NodePath>) -> (NodePath, bool) {
    twice(first, |pace| follow(chain, longest, pace), are_alike)
}

/// Whether two paths end under the same share of the load, and, where that is all of it, in the same place on the same mesh.
pub(super) fn are_alike(a: &NodePath, b: &NodePath) -> bool {
    let same_load = (a.lambda - b.lambda).abs() <= ALIKE * b.lambda && a.gave_up == b.gave_up;
    let largest = b.nodes.iter().map(|node| node.m_body.norm()).fold(1.0, f64::max);
    let is_near =
        |(a, b): (&Node, &Node)| (a.R - b.R).norm() <= ALIKE && (a.m_body - b.m_body).norm() <= ALIKE * largest;
    let same_end = || a.nodes.len() == b.nodes.len() && a.nodes.iter().zip(&b.nodes).all(is_near);
    same_load && (b.lambda < 1.0 || same_end())
}

/// Follows it by steps and corrections of a share of the usual size.
pub(super) fn follow(chain: &Chain, longest: f64, pace: f64) -> NodePath {
    let mut path = NodePath { nodes: Vec::new(), lambda: 0.0, steps: 0, passes: 1, gave_up: false };
    let mut integrator = Extrapolation::on_the_way(TOLERANCE);
    let Some(mut last) = at_rest(chain, longest, &mut integrator) else { return path };
    let mut step = (pace * FIRST_TURN / columns_size(chain, &last.nodes, &last.tangent)).min(1.0);
    let first_step = step;
    while path.lambda < 1.0 {
        if path.passes >= MOST_PASSES {
            path.gave_up = true;
            break;
        }
        let lambda = if path.lambda + step >= 1.0 { 1.0 } else { path.lambda + step };
        let Some(places) = mesh(&chain.loaded(lambda), longest) else {
            path.gave_up = true;
            break;
        };
        let ahead = lambda - path.lambda;
        match advance(chain, &last, (path.lambda, ahead, pace), &places, &mut integrator, &mut path.passes) {
            Some(next) if last.regular.continues(&next.regular) => {
                step = ahead * (AIM / next.share).sqrt().clamp(RATIOS.0, RATIOS.1);
                (path.lambda, last) = (lambda, next);
                path.steps += 1;
            }
            _ => {
                step = RETREAT * ahead;
                if step < pace * SMALLEST_STEP * path.lambda.max(first_step.min(LITTLE_LOAD)) {
                    break;
                }
            }
        }
    }
    path.nodes = last.nodes;
    path
}

/// The unloaded rod.
fn at_rest(chain: &Chain, longest: f64, integrator: &mut Extrapolation) -> Option<Step> {
    let rest = chain.loaded(0.0);
    let places = mesh(&rest, longest)?;
    let flexible = places::all_flexible(&rest, &[]);
    let base = Node::base(&rest, Vector3::zeros());
    let (mut state, mut at) = (base.state(Vec::new()), Place::BASE);
    let mut nodes = Vec::new();
    for place in places {
        march(&rest, &flexible, &[], (at, place), &mut state, integrator).ok()?;
        at = place;
        nodes.push(Node { place, p: state.p, R: state.R, m_body: state.m_body });
    }
    let passages = Passages::new(&rest, &nodes, &[chain.load_variation(0.0)], integrator)?;
    Some(Step {
        tangent: passages.tangent_columns(&passages.response(0)),
        regular: regular(chain, &passages, true),
        nodes,
        share: 0.0,
    })
}

/// One load step: prediction along the tangent on a mesh that suits the new load, correction there.
fn advance(
    chain: &Chain,
    last: &Step,
    (lambda, ahead, pace): (f64, f64, f64),
    places: &[Place],
    integrator: &mut Extrapolation,
    passes: &mut usize,
) -> Option<Step> {
    let loaded = chain.loaded(lambda);
    *passes += 1;
    let carried: Result<_, RunAway> =
        carried(&loaded, (&last.nodes, &last.tangent), &chain.load_variation(lambda), places, integrator);
    let (nodes, tangent) = carried.ok()?;
    let chain_ahead = chain.loaded(lambda + ahead);
    let predicted = ahead * columns_size(&chain_ahead, &nodes, &tangent);
    let allowed = pace * (CORRECTION * predicted.max(SMALL_CHANGE)).min(CORRECTION_TURN);
    correct(chain, lambda + ahead, along(&nodes, &tangent, ahead), allowed, integrator, passes)
}

/// Newton's iteration from the predicted nodes: the equilibrium it contracts to, by corrections of at most `allowed`.
fn correct(
    chain: &Chain,
    lambda: f64,
    mut nodes: Vec<Node>,
    mut allowed: f64,
    integrator: &mut Extrapolation,
    passes: &mut usize,
) -> Option<Step> {
    let loaded = chain.loaded(lambda);
    let mut share = None;
    loop {
        let passages = Passages::new(&loaded, &nodes, &[chain.load_variation(lambda)], integrator)?;
        *passes += 1;
        let changes = passages.newton_step();
        let correction = size(&changes);
        let share = *share.get_or_insert(correction / allowed);
        if correction <= ARRIVED {
            *passes += 1;
            let is_definite = stability::index(&loaded, &nodes, integrator) == Some(0);
            let regular = regular(chain, &passages, is_definite);
            if !(is_definite || regular.is_dead) {
                return None;
            }
            let tangent = passages.tangent_columns(&passages.response(0));
            let nodes = passages.moved(&nodes, &changes);
            return Some(Step { nodes, tangent, regular, share });
        }
        // Also false for NaN.
        let contracts = correction <= allowed;
        if !contracts {
            return None;
        }
        allowed = CONTRACTION * correction;
        nodes = passages.moved(&nodes, &changes);
    }
}

/// Evidence of the branch from these passages.
fn regular(chain: &Chain, passages: &Passages, is_definite: bool) -> Regular {
    let (sign, size) = passages.determinant();
    let evidence = Evidence::Determinant { sign, size };
    Regular { is_dead: chain.has_no_energy(), is_definite, margin: margin(chain, passages), evidence }
}

/// sqrt(3) / |W_s^-1|. `None` without a tip moment, where a loss of stability is a singular W.
fn margin(chain: &Chain, passages: &Passages) -> Option<f64> {
    if chain.numbers.l_tip == Vector3::zeros() {
        return None;
    }
    Some(passages.symmetric_inverse().map_or(0.0, |inverse| 3.0_f64.sqrt() / inverse.norm()))
}
