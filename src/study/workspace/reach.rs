//! Can the tip be there, with which inputs, how surely?

use super::engine_map::EngineMap;
use super::error::WorkspaceError;
use super::inputs::{WorkspaceInput, current_effort, reserve};
use super::lattice::{Cell, neighbours};
use super::search::{Aim, End, Search, Source, run_searches};
use super::tip_map::{Branch, Inputs, Tip, TipMap, distance, dot, norm, padded};
use super::workspace::Workspace;
use crate::model::Vector;
use crate::spec::Target;
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;
use std::sync::Arc;

/// Reached voxels from which a point is looked for, and how many of the nearest they are chosen from.
const STARTS: usize = 8;
const NEAREST: usize = 64;
/// Steps along a fibre in each direction, over half the range of the inputs.
const WALK: usize = 24;
const STRIDE: f64 = 0.08;
/// A point is reached within this share of a voxel, unless said otherwise.
const USUAL_TOLERANCE: f64 = 1e-4;
/// A tangent is turned to by so many steps of least squares.
const TURNS: usize = 40;

/// Which of several solutions is wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preference {
    /// The largest stability margin.
    #[default]
    Margin,
    /// The farthest from the limits of the inputs.
    Reserve,
    /// The smallest currents.
    LeastCurrent,
}

impl Preference {
    /// Every choice.
    pub const ALL: [Preference; 3] = [Preference::Margin, Preference::Reserve, Preference::LeastCurrent];

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Preference::Margin => "margin",
            Preference::Reserve => "reserve",
            Preference::LeastCurrent => "least-current",
        }
    }

    fn value(self, inputs: &[WorkspaceInput], at: &Inputs, tip: &Tip) -> f64 {
        match self {
            Preference::Margin => tip.margin,
            Preference::Reserve => reserve(at, inputs.len()),
            Preference::LeastCurrent => -current_effort(inputs, at),
        }
    }
}

/// What came of one query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// What was asked for.
    pub target: Target,
    /// How the search ended, in the words of control: `reached`, `at-limit`, `unreachable` or `stuck`.
    pub status: &'static str,
    /// Inputs of the solution, or of the nearest tip, over half their ranges.
    pub inputs: Inputs,
    /// Tip there (m).
    pub tip: Vector,
    /// Its stability margin.
    pub margin: f64,
    /// Least distance of an input to a limit over half its range.
    pub reserve: f64,
    /// Signed distance to the boundary of the workspace (m), positive inside.
    pub boundary_distance: f64,
    /// Angle between the tip's tangent and the one asked for (rad); NaN where none was.
    pub tangent_error: f64,
    /// Share of the designs of a robust workspace that reach it; NaN where there are none.
    pub probability: f64,
}

#[derive(Clone)]
struct Solution {
    end: End,
    at: Inputs,
    tip: Tip,
    missing: f64,
}

impl Workspace {
    /// How near to a point the tip has to be, unless said otherwise (m): a small share of a voxel.
    pub fn usual_tolerance(&self) -> f64 {
        USUAL_TOLERANCE * self.grown.lattice.spacing
    }

    /// Answers queries: starts at the nearest reached voxels whose inputs are farthest apart. A point is reached where
    /// the tip is within `tolerance` (m).
    ///
    /// # Errors
    ///
    /// Targets that are no numbers, or an engine that fails.
    pub fn reach(
        &self,
        map: &mut EngineMap,
        targets: &[Target],
        preference: Preference,
        tolerance: f64,
    ) -> Result<Vec<Reach>, WorkspaceError> {
        for (row, target) in targets.iter().enumerate() {
            let numbers = target.position.into_iter().chain(target.tangent.into_iter().flatten());
            if numbers.clone().any(|x| !x.is_finite()) {
                let problem = "a target needs finite numbers x, y and z: remove the row or fill it in".into();
                return Err(WorkspaceError::Query { place: format!("target {row}"), problem });
            }
        }
        let aim =
            Aim::voxels(map, 3, self.grown.lattice.spacing, Branch::FromRest, self.minimum_margin).points(tolerance);
        let places: Vec<usize> = self.grown.reached().collect();
        let starts: Vec<Vec<Inputs>> = targets.par_iter().map(|target| self.starts(&places, target.position)).collect();
        let mut solutions = self.solve_starts(map, &aim, targets, &starts)?;
        self.walk_fibres(map, &aim, targets, preference, &mut solutions)?;
        let mut best: Vec<Option<Solution>> = solutions.iter().map(|found| self.choose(found, preference)).collect();
        for (solution, target) in best.iter_mut().zip(targets) {
            if let (Some(found), Some(tangent)) = (solution.as_mut(), target.tangent)
                && found.end == End::Reached
            {
                self.turn(map, &aim, target.position, tangent, found)?;
            }
        }
        Ok(targets.iter().zip(best).map(|(target, solution)| self.answer(target, solution)).collect())
    }

    /// Inputs of reached voxels near a point that differ most.
    fn starts(&self, places: &[usize], point: Vector) -> Vec<Inputs> {
        let grown = &self.grown;
        let mut near: Vec<(f64, usize)> =
            places.iter().map(|at| (distance(grown.lattice.centre(grown.voxels[*at].cell), point), *at)).collect();
        let count = NEAREST.min(near.len());
        if count == 0 {
            return Vec::new();
        }
        near.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(count);
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let inputs: Vec<Inputs> = near.iter().map(|(_, at)| padded(grown.inputs_of(*at))).collect();
        let apart = |a: &Inputs, b: &Inputs| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let mut chosen = vec![inputs[0]];
        while chosen.len() < STARTS.min(inputs.len()) {
            let least = |at: &Inputs| chosen.iter().map(|other| apart(at, other)).fold(f64::INFINITY, f64::min);
            let Some(next) = inputs.iter().max_by(|a, b| least(a).total_cmp(&least(b))) else { break };
            chosen.push(*next);
        }
        chosen
    }

    fn solve_starts(
        &self,
        map: &mut EngineMap,
        aim: &Aim,
        targets: &[Target],
        starts: &[Vec<Inputs>],
    ) -> Result<Vec<Vec<Solution>>, WorkspaceError> {
        let flat: Vec<(usize, Inputs)> =
            starts.iter().enumerate().flat_map(|(row, starts)| starts.iter().map(move |at| (row, *at))).collect();
        let tips = map.solve_from_rest(&flat.iter().map(|(_, at)| *at).collect::<Vec<_>>())?;
        let searches =
            flat.iter().zip(tips).filter(|(_, tip)| tip.counts(self.minimum_margin)).map(|((row, at), tip)| {
                (*row, Search::new(aim, [0; 3], targets[*row].position, &Arc::new(Source { at: *at, tip })))
            });
        let mut found = vec![Vec::new(); targets.len()];
        for (row, search) in run(map, aim, searches.collect())? {
            found[row].push(search);
        }
        Ok(found)
    }

    /// Goes along the fibres of solutions, where there are more inputs than the tip needs.
    fn walk_fibres(
        &self,
        map: &mut EngineMap,
        aim: &Aim,
        targets: &[Target],
        preference: Preference,
        solutions: &mut [Vec<Solution>],
    ) -> Result<(), WorkspaceError> {
        let spare = self.inputs.len().saturating_sub(self.dimension.rank);
        let mut walks: Vec<(usize, Solution, usize, f64)> = Vec::new();
        for (row, found) in solutions.iter().enumerate() {
            if let Some(best) = self.choose(found, preference).filter(|best| best.end == End::Reached) {
                walks.extend((0..spare).flat_map(|k| [1.0, -1.0].map(|sign| (row, best.clone(), k, sign))));
            }
        }
        let mut last: Vec<Option<Inputs>> = vec![None; walks.len()];
        for _ in 0..WALK {
            let mut searches = Vec::new();
            let mut tries = Vec::new();
            for (number, (row, from, k, sign)) in walks.iter().enumerate() {
                let along = self.fibre(from, *k, last[number].as_ref(), *sign);
                let mut at = from.at;
                at.iter_mut().zip(along).for_each(|(t, step)| *t = (*t + STRIDE * step).clamp(-1.0, 1.0));
                if at != from.at {
                    tries.push(at);
                    searches.push((number, *row, along));
                }
            }
            if tries.is_empty() {
                break;
            }
            let tips = map.solve_from_rest(&tries)?;
            let begun = searches.iter().zip(tries).zip(tips).filter(|(_, tip)| tip.counts(self.minimum_margin));
            let begun = begun.map(|(((number, row, _), at), tip)| {
                (*number, Search::new(aim, [0; 3], targets[*row].position, &Arc::new(Source { at, tip })))
            });
            let mut went = vec![None; walks.len()];
            for (number, solution) in run(map, aim, begun.collect())? {
                if solution.end == End::Reached {
                    went[number] = Some(solution);
                }
            }
            let mut next = (Vec::new(), Vec::new());
            for (number, (row, from, k, sign)) in walks.into_iter().enumerate() {
                if let Some(solution) = went[number].take() {
                    let step: Inputs = std::array::from_fn(|i| solution.at[i] - from.at[i]);
                    // A walk that is pushed back by a limit has come to its end.
                    if step.iter().map(|x| x * x).sum::<f64>().sqrt() > 0.1 * STRIDE {
                        solutions[row].push(solution.clone());
                        next.0.push((row, solution, k, sign));
                        next.1.push(Some(step));
                    }
                }
            }
            (walks, last) = next;
        }
        Ok(())
    }

    /// A unit direction of the inputs in which the tip stays, number `k`; that of the last step is kept to.
    fn fibre(&self, from: &Solution, k: usize, last: Option<&Inputs>, sign: f64) -> Inputs {
        let count = self.inputs.len();
        let gram = DMatrix::from_fn(count, count, |a, b| dot(from.tip.jacobian[a], from.tip.jacobian[b]));
        let eigen = SymmetricEigen::new(gram);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let spare = &order[..count - self.dimension.rank.min(count)];
        let mut along = [0.0; super::MOST_INPUTS];
        match last {
            // Inside the space of all such directions, the nearest to the last step.
            Some(last) => {
                for column in spare {
                    let share: f64 = (0..count).map(|i| last[i] * eigen.eigenvectors[(i, *column)]).sum();
                    (0..count).for_each(|i| along[i] += share * eigen.eigenvectors[(i, *column)]);
                }
            }
            None => (0..count).for_each(|i| along[i] = sign * eigen.eigenvectors[(i, spare[k])]),
        }
        let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
        along.map(|x| x / length.max(f64::MIN_POSITIVE))
    }

    /// The preferred of the solutions that reach; else the one that comes nearest.
    fn choose(&self, found: &[Solution], preference: Preference) -> Option<Solution> {
        let value = |s: &&Solution| preference.value(&self.inputs, &s.at, &s.tip);
        let reached = found.iter().filter(|solution| solution.end == End::Reached);
        let preferred = reached.max_by(|a, b| value(a).total_cmp(&value(b)));
        preferred.or_else(|| found.iter().min_by(|a, b| a.missing.total_cmp(&b.missing))).cloned()
    }

    /// Turns the tangent towards the one asked for along the fibre, by trial of directions in which the tip stays.
    fn turn(
        &self,
        map: &mut EngineMap,
        aim: &Aim,
        target: Vector,
        tangent: Vector,
        found: &mut Solution,
    ) -> Result<(), WorkspaceError> {
        let spare = self.inputs.len().saturating_sub(self.dimension.rank);
        let mut stride = 2.0 * STRIDE;
        for _ in 0..TURNS {
            let tries: Vec<Inputs> = (0..spare)
                .flat_map(|k| [1.0, -1.0].map(|sign| self.fibre(found, k, None, sign)))
                .map(|along| std::array::from_fn(|i| (found.at[i] + stride * along[i]).clamp(-1.0, 1.0)))
                .collect();
            let tips = map.solve_from_rest(&tries)?;
            let begun = tries.iter().zip(tips).filter(|(_, tip)| tip.counts(self.minimum_margin));
            let begun =
                begun.map(|(at, tip)| (0, Search::new(aim, [0; 3], target, &Arc::new(Source { at: *at, tip }))));
            let error = |solution: &Solution| angle(solution.tip.tangent, tangent);
            let better = run(map, aim, begun.collect())?
                .into_iter()
                .map(|(_, solution)| solution)
                .filter(|solution| solution.end == End::Reached && error(solution) < error(found) - 1e-9)
                .min_by(|a, b| error(a).total_cmp(&error(b)));
            match better {
                Some(solution) => *found = solution,
                None if stride < 1e-4 => break,
                None => stride *= 0.4,
            }
        }
        Ok(())
    }

    fn answer(&self, target: &Target, solution: Option<Solution>) -> Reach {
        let count = self.inputs.len();
        let Some(solution) = solution else {
            return Reach {
                target: *target,
                status: "stuck",
                inputs: [f64::NAN; super::MOST_INPUTS],
                tip: [f64::NAN; 3],
                margin: f64::NAN,
                reserve: f64::NAN,
                boundary_distance: f64::NAN,
                tangent_error: f64::NAN,
                probability: f64::NAN,
            };
        };
        let cell = self.grown.lattice.cell(target.position);
        let status = match solution.end {
            End::Reached => "reached",
            End::AtLimit => "at-limit",
            End::Singular | End::Beside => "unreachable",
            // No stable equilibrium from rest lies further on.
            End::OffBranch | End::Stuck => "stuck",
        };
        let boundary_distance = match solution.end {
            End::Reached => self.depth(cell, target.position),
            _ => -solution.missing,
        };
        Reach {
            target: *target,
            status,
            inputs: solution.at,
            tip: solution.tip.position,
            margin: solution.tip.margin,
            reserve: reserve(&solution.at, count),
            boundary_distance,
            tangent_error: target.tangent.map_or(f64::NAN, |tangent| angle(solution.tip.tangent, tangent)),
            probability: f64::NAN,
        }
    }

    /// Distance to the boundary of a point inside, by the voxels around it.
    fn depth(&self, cell: Cell, point: Vector) -> f64 {
        let known = |cell: Cell| {
            let at = self.grown.place(cell)?;
            let distance = *self.distances.get(at)?;
            distance.is_finite().then(|| distance + super::tip_map::distance(self.grown.lattice.centre(cell), point))
        };
        let around = neighbours(cell).into_iter().filter_map(known);
        known(cell).into_iter().chain(around).fold(f64::NAN, f64::min).max(0.0)
    }
}

fn angle(a: Vector, b: Vector) -> f64 {
    let cross: Vector = std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
    norm(cross).atan2(dot(a, b))
}

/// Runs searches to their ends.
fn run(map: &mut EngineMap, aim: &Aim, active: Vec<(usize, Search)>) -> Result<Vec<(usize, Solution)>, WorkspaceError> {
    let ended = run_searches(map, aim, active, &|_, _| {})?;
    let solution = |search: &Search| Solution {
        end: search.end.unwrap_or(End::Stuck),
        at: search.at,
        tip: search.tip,
        missing: search.missing(),
    };
    // In the order of the searches' numbers, whatever round they ended in.
    let mut all: Vec<(usize, Solution)> = ended.iter().map(|(number, search)| (*number, solution(search))).collect();
    all.sort_by_key(|(number, _)| *number);
    Ok(all)
}
