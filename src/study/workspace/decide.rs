//! Voxels whose search met missing or jumping equilibria: is there a stable equilibrium that is not the one from rest?

use super::growth::Grown;
use super::lattice::neighbours;
use super::search::{Aim, End, Search, Source, THERE, run_searches};
use super::tip_map::{Branch, Inputs, TipMap, distance, padded};
use crate::backend::BackendError;
use std::sync::Arc;

impl Grown {
    /// Follows the neighbour's own equilibrium into every voxel that growth left because equilibria were missing.
    /// What is reached so is `OffBranch`, unless it is the equilibrium from rest after all; those voxels are returned
    /// with their inputs, to grow from. What is not reached is at a limit, singular, or stuck.
    ///
    /// # Errors
    ///
    /// An engine that fails.
    pub(super) fn decide(&mut self, map: &mut dyn TipMap) -> Result<Vec<Inputs>, BackendError> {
        let aim = Aim::voxels(map, self.dimension, self.lattice.spacing, Branch::Neighbour, 0.0);
        let doubtful = |at: &usize| matches!(self.voxels[*at].end, Some(End::OffBranch | End::Stuck));
        let pairs: Vec<(usize, usize)> = (0..self.voxels.len())
            .filter(doubtful)
            .filter_map(|at| {
                let beside = neighbours(self.voxels[at].cell).into_iter().filter_map(|cell| self.place(cell));
                beside.into_iter().find(|other| self.voxels[*other].is_reached()).map(|other| (at, other))
            })
            .collect();
        let starts: Vec<Inputs> = pairs.iter().map(|(_, other)| padded(self.inputs_of(*other))).collect();
        // First from rest, for the load at the base, then once on the spot, for its derivatives.
        let at_rest = map.solve_from_rest(&starts)?;
        let loads: Vec<_> = starts.iter().zip(&at_rest).map(|(at, tip)| (*at, tip.base)).collect();
        let tips = map.near(&loads)?;
        let mut active: Vec<(usize, Search)> = Vec::new();
        for (((at, _), start), tip) in pairs.iter().zip(&starts).zip(tips).filter(|(_, tip)| tip.usable) {
            let cell = self.voxels[*at].cell;
            let source = Arc::new(Source { at: *start, tip });
            active.push((*at, Search::new(&aim, cell, self.lattice.centre(cell), &source)));
        }
        let ended = run_searches(map, &aim, active, &|_, _| {})?;
        let at_end: Vec<Inputs> = ended.iter().map(|(_, search)| search.at).collect();
        let from_rest = map.solve_from_rest(&at_end)?;
        let mut found = Vec::new();
        for ((at, search), rest) in ended.into_iter().zip(from_rest) {
            let is_there = search.end == Some(End::Reached);
            let same = rest.counts(self.minimum_margin)
                && distance(rest.position, search.tip.position) < THERE * self.lattice.spacing;
            let voxel = &mut self.voxels[at];
            match search.end {
                Some(_) if is_there && same => found.push(search.at),
                Some(_) if is_there => voxel.end = Some(End::OffBranch),
                // A fold of the stable equilibria themselves ends the workspace, too.
                Some(End::OffBranch) => voxel.end = Some(End::OffBranch),
                Some(end) => {
                    (voxel.end, voxel.missing) = (Some(end), search.missing());
                    voxel.set_offset(&search, &self.lattice);
                }
                None => {}
            }
        }
        Ok(found)
    }
}
