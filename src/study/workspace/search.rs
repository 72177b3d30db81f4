//! The search for one voxel, as a state machine: `propose` says where to solve next, `judge` takes what came back.
//!
//! In a workspace of three dimensions it looks for inputs whose tip is the voxel's centre. In a surface or a curve it
//! looks for the foot point, the tip nearest to the centre, along the strongest directions only.

use super::lattice::Cell;
use super::step::{Singular, Step, bounded_step};
use super::tip_map::{BaseLoad, Branch, Inputs, Tip, TipMap, difference, distance, dot, norm};
use crate::backend::BackendError;
use crate::model::Vector;
use rayon::prelude::*;
use std::sync::Arc;

/// Equilibria of one search for a voxel, at most.
const MOST_STEPS: usize = 8;
/// The same of a search for a point that somebody asked for.
const MOST_STEPS_OF_A_QUERY: usize = 40;
/// Of a step: how far the tip moves over the edge of a voxel, and an input over half its range.
const LONGEST_TRAVEL: f64 = 4.0;
const LONGEST_INPUT: f64 = 0.5;
/// A centre is reached within this share of an edge.
pub(super) const ARRIVED: f64 = 1e-3;
/// A foot point is found where the next step would move the tip by less than this share of an edge.
const SETTLED: f64 = 0.02;
/// Where a step promises less than this share of what is missing, the point is the nearest; the same of a query.
const HARDLY: f64 = 0.02;
const HARDLY_OF_A_QUERY: f64 = 1e-4;
/// What a step in vain makes of the next one's length, and the shortest.
const SHORTENED: f64 = 0.3;
const SHORTEST: f64 = 0.05;
/// Most steps of a search along stable neighbours that are quick to find: they are found by short steps alone.
const MOST_STEPS_ALONG: usize = 100;
/// The shortest of these steps, over the whole one.
const SHORTEST_ALONG: f64 = 0.005;
/// Searches that are done together on one thread.
pub(super) const GRAIN: usize = 64;
/// A tip this near to another, over the edge of a voxel, is the same.
pub(super) const THERE: f64 = 0.01;
/// A tip further from where it was predicted than this share of the step has jumped.
const JUMP: f64 = 1.0;

/// What all searches of a workspace share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    pub input_count: usize,
    /// Dimension of the workspace.
    pub dimension: usize,
    /// Of a voxel (m).
    pub edge: f64,
    pub branch: Branch,
    /// Equilibria of a smaller stability margin do not count.
    pub minimum_margin: f64,
    /// A point is reached where so much is missing (m).
    pub tolerance: f64,
    pub most_steps: usize,
    /// Over the whole step: a search ends where its steps would be shorter.
    pub shortest: f64,
    /// A step that promises less than this share of what is missing ends the search.
    pub hardly: f64,
    /// Whether inputs that the strongest directions leave open go towards their middle: of all parallel sheets of a
    /// thin body the middle one is meant.
    pub relaxes: bool,
    /// Whether searches for equilibria from rest go from neighbour to neighbour, and solve from rest where they end.
    pub walks: bool,
}

impl Aim {
    /// For the voxels of a workspace.
    pub(super) fn voxels(map: &dyn TipMap, dimension: usize, edge: f64, branch: Branch, minimum_margin: f64) -> Aim {
        let tolerance = ARRIVED * edge;
        let along = branch == Branch::Neighbour && map.near_is_quick();
        Aim {
            input_count: map.input_count(),
            dimension,
            edge,
            branch,
            minimum_margin,
            tolerance,
            most_steps: if along { MOST_STEPS_ALONG } else { MOST_STEPS },
            shortest: if along { SHORTEST_ALONG } else { SHORTEST },
            hardly: HARDLY,
            relaxes: false,
            walks: branch == Branch::FromRest && map.near_is_quick(),
        }
    }

    /// For points that are asked for; steps are as long as between voxels of this edge.
    pub(super) fn points(self, tolerance: f64) -> Aim {
        Aim { tolerance, dimension: 3, most_steps: MOST_STEPS_OF_A_QUERY, hardly: HARDLY_OF_A_QUERY, ..self }
    }
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum End {
    /// The centre is reached; of a surface or curve, the foot point lies inside.
    Reached,
    /// The nearest tip is held back by a limit of the inputs.
    AtLimit,
    /// A surface or curve passes by: its foot point is found, and it does not cut the voxel.
    Beside,
    /// The nearest tip is one where the Jacobian loses a direction.
    Singular,
    /// Reached only by an equilibrium that is not the one from rest, or whose margin is too small.
    OffBranch,
    /// Undecided.
    Stuck,
}

/// An equilibrium from which neighbours are looked for.
#[derive(Clone, Debug)]
pub(super) struct Source {
    pub at: Inputs,
    pub tip: Tip,
}

/// How the equilibrium of a trial is solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// From rest.
    Rest,
    /// From the equilibrium that a search has come to.
    Near,
    /// From rest, where a walk from neighbour to neighbour has ended.
    Certificate,
}

/// Where a search asks for an equilibrium.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial {
    pub at: Inputs,
    /// Predicted load at the base.
    pub base: BaseLoad,
    pub way: Way,
}

/// The way to one voxel.
#[derive(Clone, Debug)]
pub(super) struct Search {
    pub cell: Cell,
    pub at: Inputs,
    pub tip: Tip,
    pub end: Option<End>,
    /// Whether equilibria were missing or jumped on the way.
    pub is_broken: bool,
    centre: Vector,
    /// Where to solve next.
    pub trial: Trial,
    predicted: Vector,
    steps: usize,
    share: f64,
    way: Way,
    /// Whether the equilibrium that the search has come to was solved from rest, where that is asked for.
    is_certain: bool,
    /// Whether the trial stands, to be solved from rest after its neighbour led nowhere; this is done once.
    repeats: bool,
    has_repeated: bool,
    /// The best end of earlier searches for this voxel, and the distance that was missing (m). An end that is no better is not certified.
    pub known: Option<(End, f64)>,
}

impl Search {
    pub(super) fn new(aim: &Aim, cell: Cell, centre: Vector, source: &Arc<Source>) -> Search {
        let way = if aim.walks || aim.branch == Branch::Neighbour { Way::Near } else { Way::Rest };
        Search {
            cell,
            at: source.at,
            tip: source.tip,
            end: None,
            is_broken: false,
            centre,
            trial: Trial { at: source.at, base: source.tip.base, way },
            predicted: source.tip.position,
            steps: 0,
            share: 1.0,
            way,
            is_certain: true,
            repeats: false,
            has_repeated: false,
            known: None,
        }
    }

    /// What is missing to the centre (m).
    pub(super) fn missing(&self) -> f64 {
        distance(self.centre, self.tip.position)
    }

    /// Fills `trial`, or ends the search.
    pub(super) fn propose(&mut self, aim: &Aim) {
        if self.end.is_some() || std::mem::take(&mut self.repeats) {
            return;
        }
        let missing = difference(self.centre, self.tip.position);
        let mut step = bounded_step(&self.tip, &self.at, aim.input_count, missing, aim.dimension);
        if aim.relaxes {
            step.relax(&self.tip, &self.at, aim.input_count, aim.dimension);
        }
        let end = self.ended(aim, missing, &step);
        let is_news = |end: &End| self.known.is_none_or(|known| (*end, norm(missing)) < known);
        let is_claim = |end: &End| matches!(end, End::Reached | End::AtLimit | End::Singular);
        if !self.is_certain && end.as_ref().is_some_and(|end| is_claim(end) && is_news(end)) {
            self.trial = Trial { at: self.at, base: self.tip.base, way: Way::Certificate };
            return;
        }
        self.end = end;
        if self.end.is_some() {
            return;
        }
        let change = step.shortened(&self.tip, LONGEST_TRAVEL * aim.edge, LONGEST_INPUT).map(|x| self.share * x);
        let mut at = self.at;
        at.iter_mut().zip(change).for_each(|(t, change)| *t = (*t + change).clamp(-1.0, 1.0));
        let taken: Inputs = std::array::from_fn(|k| at[k] - self.at[k]);
        self.trial = Trial { at, base: self.tip.base_after(&taken), way: self.way };
        self.predicted = self.tip.position_after(&taken);
    }

    fn ended(&self, aim: &Aim, missing: Vector, step: &Step) -> Option<End> {
        let (far, left) = (norm(missing), norm(step.left));
        if aim.dimension == 3 && far <= aim.tolerance {
            return Some(End::Reached);
        }
        let nearest = match aim.dimension {
            3 => left > (1.0 - aim.hardly) * far,
            _ => norm(difference(missing, step.left)).max(step.relaxation) <= SETTLED * aim.edge,
        };
        let at_nearest = if step.is_held { End::AtLimit } else { End::Singular };
        match nearest {
            // Whether a foot point lies in the voxel is for the caller to say.
            true if aim.dimension < 3 => Some(if self.is_at_edge(aim, step) { End::AtLimit } else { End::Reached }),
            true => Some(at_nearest),
            false if self.steps >= aim.most_steps || self.share < aim.shortest => {
                Some(if self.is_broken { End::OffBranch } else { End::Stuck })
            }
            false => None,
        }
    }

    /// Whether the nearest tip lies on an edge of the surface or curve: something tangential is left.
    fn is_at_edge(&self, aim: &Aim, step: &Step) -> bool {
        let singular = Singular::new(&self.tip.jacobian[..aim.input_count]);
        let tangential = |k: usize| dot(singular.directions[k], step.left).powi(2);
        (0..aim.dimension).map(tangential).sum::<f64>().sqrt() > SETTLED * aim.edge
    }

    /// Takes the equilibrium at `trial`; goes there if it is nearer.
    pub(super) fn judge(&mut self, aim: &Aim, tip: Tip) {
        match self.trial.way {
            Way::Certificate => return self.certify(aim, tip),
            Way::Near if aim.walks && !tip.usable && !self.has_repeated => {
                (self.repeats, self.has_repeated, self.trial.way) = (true, true, Way::Rest);
                return;
            }
            // A rod that is not found near a neighbour but from rest is sought from rest.
            Way::Rest if tip.usable => self.way = Way::Rest,
            _ => {}
        }
        self.steps += 1;
        let moved = distance(self.predicted, self.tip.position);
        let counts = tip.counts(aim.minimum_margin);
        let jumped = !counts || distance(tip.position, self.predicted) > JUMP * moved + ARRIVED * aim.edge;
        // A foot point may be a little further away than the tip before it: the normal part is not sought.
        let slack = match aim.dimension {
            3 => 1.0,
            // Towards the middle of a thin body the tip may well go away from the centre.
            _ if aim.relaxes => f64::INFINITY,
            _ => 1.05,
        };
        let nearer = counts && distance(tip.position, self.centre) < slack * self.missing();
        // On another sheet the nearest point means nothing; an arrival counts wherever it came from.
        let arrived = aim.dimension == 3 && distance(tip.position, self.centre) <= aim.tolerance;
        if nearer && (!jumped || arrived || self.trial.way == Way::Rest) {
            (self.at, self.tip) = (self.trial.at, tip);
            self.is_certain = aim.branch == Branch::Neighbour || self.trial.way == Way::Rest;
            self.share = (self.share / SHORTENED).min(1.0);
        } else {
            self.share *= SHORTENED;
            self.is_broken |= jumped;
        }
    }

    /// Takes the equilibrium from rest where a walk has ended: the walk counts if it ended at this one.
    fn certify(&mut self, aim: &Aim, tip: Tip) {
        if tip.counts(aim.minimum_margin) && distance(tip.position, self.tip.position) < THERE * aim.edge {
            self.tip = tip;
            self.is_certain = true;
        } else {
            (self.end, self.is_broken) = (Some(End::OffBranch), true);
        }
    }
}

/// Runs searches to their ends, all that are under way in one batch, each with what the caller knows it by; in the order in
/// which they end. `adjust` may change an equilibrium before it is judged.
pub(super) fn run_searches<K: Send + Sync>(
    map: &mut dyn TipMap,
    aim: &Aim,
    mut active: Vec<(K, Search)>,
    adjust: &(dyn Fn(&K, &mut Tip) + Sync),
) -> Result<Vec<(K, Search)>, BackendError> {
    let mut ended = Vec::new();
    while !active.is_empty() {
        active.par_iter_mut().with_min_len(GRAIN).for_each(|(_, search)| search.propose(aim));
        let (done, mut going): (Vec<_>, Vec<_>) = active.into_iter().partition(|(_, search)| search.end.is_some());
        ended.extend(done);
        let trials: Vec<Trial> = going.iter().map(|(_, search)| search.trial).collect();
        let tips = solve_trials(map, &trials)?;
        going.par_iter_mut().zip(tips).with_min_len(GRAIN).for_each(|((key, search), mut tip)| {
            adjust(key, &mut tip);
            search.judge(aim, tip);
        });
        active = going;
    }
    Ok(ended)
}

/// The equilibria at trials, each by its way.
pub(super) fn solve_trials(map: &mut dyn TipMap, trials: &[Trial]) -> Result<Vec<Tip>, BackendError> {
    let (near, rest): (Vec<usize>, Vec<usize>) = (0..trials.len()).partition(|number| trials[*number].way == Way::Near);
    let at_rest: Vec<Inputs> = rest.iter().map(|number| trials[*number].at).collect();
    let beside: Vec<(Inputs, BaseLoad)> =
        near.iter().map(|number| (trials[*number].at, trials[*number].base)).collect();
    let mut tips = vec![Tip::NONE; trials.len()];
    rest.into_iter().zip(map.solve_from_rest(&at_rest)?).for_each(|(number, tip)| tips[number] = tip);
    if !beside.is_empty() {
        near.into_iter().zip(map.near(&beside)?).for_each(|(number, tip)| tips[number] = tip);
    }
    Ok(tips)
}
