//! Better solutions of reached voxels: where there are more inputs than the tip needs, a neighbour's may be the more
//! stable one.

use super::growth::Grown;
use super::lattice::neighbours;
use super::search::{Aim, End, Search, Source, run_searches};
use super::tip_map::{Branch, Inputs, TipMap, padded};
use crate::backend::BackendError;
use std::sync::Arc;

/// A neighbour's solution is tried where its margin is larger by so much.
const WORTH: f64 = 0.1;
/// How often solutions are handed on.
const ROUNDS: usize = 2;

impl Grown {
    /// Reaches voxels once more from the neighbour with the largest margin, and keeps the more stable solution. What is
    /// reached does not change.
    ///
    /// # Errors
    ///
    /// An engine that fails.
    pub(super) fn improve(&mut self, map: &mut dyn TipMap) -> Result<(), BackendError> {
        if self.dimension != 3 || self.input_count <= self.dimension || self.branch != Branch::FromRest {
            return Ok(());
        }
        let aim = Aim::voxels(map, 3, self.lattice.spacing, self.branch, self.minimum_margin);
        for _ in 0..ROUNDS {
            let better = |at: usize| {
                let beside = neighbours(self.voxels[at].cell).into_iter().filter_map(|cell| self.place(cell));
                let reached = beside.filter(|other| self.voxels[*other].is_reached());
                reached
                    .max_by(|a, b| self.voxels[*a].margin.total_cmp(&self.voxels[*b].margin))
                    .filter(|best| self.voxels[*best].margin > self.voxels[at].margin + WORTH)
            };
            let pairs: Vec<(usize, usize)> =
                self.reached().filter_map(|at| better(at).map(|other| (at, other))).collect();
            let starts: Vec<Inputs> = pairs.iter().map(|(_, other)| padded(self.inputs_of(*other))).collect();
            let tips = map.solve_from_rest(&starts)?;
            let active: Vec<(usize, Search)> = pairs
                .iter()
                .zip(starts.iter().zip(tips))
                .filter(|(_, (_, tip))| tip.counts(self.minimum_margin))
                .map(|((at, _), (start, tip))| {
                    let cell = self.voxels[*at].cell;
                    (*at, Search::new(&aim, cell, self.lattice.centre(cell), &Arc::new(Source { at: *start, tip })))
                })
                .collect();
            let mut changed = 0;
            for (at, search) in run_searches(map, &aim, active, &|_, _| {})? {
                if search.end == Some(End::Reached) && search.tip.margin > self.voxels[at].margin {
                    changed += 1;
                    self.replace(at, &search);
                }
            }
            if changed == 0 {
                break;
            }
        }
        Ok(())
    }
}
