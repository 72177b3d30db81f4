//! A job under way: seeds, growth, the independent value.

use super::check::Family;
use super::dimension::Dimension;
use super::error::WorkspaceError;
use super::growth::Grown;
use super::lattice::CellMap;
use super::measures::{Ends, Estimate, extrapolated, sections, volume};
use super::paint::paint;
use super::stage::WorkspaceStage;
use super::tip_map::{Branch, Inputs, MOST_INPUTS, Tip, TipMap, padded};
use super::voxel_values::Seen;
use super::workspace::Check;
use crate::table::Lattice;
use std::collections::HashMap;

/// What was found of a workspace.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Point, curve, surface, body.
    pub dimension: Dimension,
    /// Its voxels.
    pub grown: Grown,
    /// Of a thin body: its middle.
    pub surface: Option<Grown>,
    /// Of a body (m³).
    pub volume: Option<Estimate>,
    /// Of a surface, or of the middle of a thin body (m²).
    pub area: Option<Estimate>,
    /// Of a curve (m).
    pub length: Option<Estimate>,
    /// The independent value, where it means something.
    pub check: Option<Check>,
    /// Remarks for the user.
    pub notes: Vec<String>,
    pub(super) seen: Seen,
    pub(super) seed_count: usize,
}

/// What is asked of the measurement of a map.
#[derive(Clone, Copy)]
pub struct MeasureOptions<'a> {
    /// Least stability margin that counts.
    pub minimum_margin: f64,
    /// Whether every stable equilibrium counts that continues one from rest.
    pub any_stable: bool,
    /// Of all nets.
    pub seed: u64,
    /// Whether voxels take over their neighbours' more stable solutions.
    pub improves: bool,
    /// Hears what is done, and ends it with false.
    pub watch: &'a dyn Fn(WorkspaceStage) -> bool,
}

impl Default for MeasureOptions<'_> {
    fn default() -> Self {
        MeasureOptions { minimum_margin: 0.0, any_stable: false, seed: 0, improves: false, watch: &|_| true }
    }
}

/// Measures where a map takes the tip, beginning from these inputs.
///
/// # Errors
///
/// An engine that fails, starts without a usable equilibrium, or the caller's interruption.
pub fn measure(
    map: &mut dyn TipMap,
    lattice: Lattice,
    starts: &[Inputs],
    options: MeasureOptions<'_>,
) -> Result<Measured, WorkspaceError> {
    let mut work = Work::new(options, map, lattice);
    let dimension = work.seed(starts)?;
    work.measured(dimension)
}

/// A job under way.
pub(super) struct Work<'a> {
    job: MeasureOptions<'a>,
    map: &'a mut dyn TipMap,
    lattice: Lattice,
    rows: Vec<(Inputs, Tip)>,
    pub tips: Vec<Tip>,
    /// Place of each start among `tips`, by the bits of its inputs.
    starts: HashMap<[u64; MOST_INPUTS], u32>,
    seen: Seen,
    /// One of many designs: neither checked nor decided, so that it is quick.
    pub is_design: bool,
}

impl<'a> Work<'a> {
    pub(super) fn new(job: MeasureOptions<'a>, map: &'a mut dyn TipMap, lattice: Lattice) -> Work<'a> {
        Work {
            job,
            map,
            lattice,
            rows: Vec::new(),
            tips: Vec::new(),
            starts: HashMap::new(),
            seen: Seen::default(),
            is_design: false,
        }
    }

    /// Solves where growth is to begin, and tells the dimension.
    pub(super) fn seed(&mut self, starts: &[Inputs]) -> Result<Dimension, WorkspaceError> {
        self.tips = self.map.solve_from_rest(starts)?;
        self.starts = starts.iter().zip(0..).map(|(at, place)| (at.map(f64::to_bits), place)).collect();
        let pairs = starts.iter().copied().zip(self.tips.iter().copied());
        self.rows = pairs.filter(|(_, tip)| tip.counts(self.job.minimum_margin)).collect();
        self.rows.iter().for_each(|(at, tip)| self.seen.add(&self.lattice, at, tip));
        let usable: Vec<Tip> = self.rows.iter().map(|(_, tip)| *tip).collect();
        if usable.is_empty() {
            let (samples, minimum_margin) = (starts.len(), self.job.minimum_margin);
            return Err(WorkspaceError::NoUsableRows { samples, minimum_margin });
        }
        Ok(Dimension::of(&usable, self.map.input_count(), self.lattice.spacing))
    }

    pub(super) fn painted(self, dimension: Dimension) -> Measured {
        let (count, least) = (self.map.input_count(), self.job.minimum_margin);
        let grown = paint(self.lattice, count, least, &self.rows, self.tips.len());
        // Nothing is proven, and what no row came near is missing: no interval holds.
        let volume = Some(Estimate::without_bounds(volume(&grown, &Ends::of(&grown)).value));
        Measured {
            dimension,
            grown,
            surface: None,
            volume,
            area: None,
            length: None,
            check: None,
            notes: Vec::new(),
            seen: self.seen,
            seed_count: self.rows.len(),
        }
    }

    pub(super) fn measured(mut self, dimension: Dimension) -> Result<Measured, WorkspaceError> {
        let (seed_count, edge) = (self.rows.len(), self.lattice.spacing);
        let least = self.job.minimum_margin;
        (self.job.watch)(WorkspaceStage::Checking);
        let family = match (self.job.any_stable || self.is_design, dimension.rank) {
            (true, _) | (_, 0) => None,
            (false, rank) => {
                let (starts, tips) = (&self.starts, &self.tips);
                let known = |at: &Inputs| starts.get(&at.map(f64::to_bits)).map(|place| tips[*place as usize]);
                Family::solve(self.map, rank, least, self.job.seed, &known)?
            }
        };
        if let Some(family) = &family {
            // Further places to begin from; the integral itself knows nothing of growth.
            let cells = self.cells();
            for (at, tip) in family.seeds().filter(|(_, tip)| tip.counts(least)) {
                self.seen.add(&self.lattice, &at, tip);
                if !cells.contains_key(&self.lattice.cell(tip.position)) {
                    self.rows.push((at, *tip));
                }
            }
        }
        let (mut volume_of, mut area_of, mut length_of, mut surface) = (None, None, None, None);
        let rank = dimension.rank;
        if dimension.is_thin {
            let (sheet, area) = self.sectioned(2, rank)?;
            let feet: Vec<Inputs> = sheet.reached().map(|at| padded(sheet.inputs_of(at))).collect();
            let tips = self.map.solve_from_rest(&feet)?;
            self.rows.extend(feet.into_iter().zip(tips));
            (surface, area_of) = (Some(sheet), Some(area));
        }
        let grown = match rank {
            0 => self.grow(self.lattice, 3, rank)?,
            1 | 2 => {
                let (grown, size) = self.sectioned(rank, rank)?;
                if rank == 2 {
                    area_of = Some(size)
                } else {
                    length_of = Some(size)
                }
                grown
            }
            _ => {
                let mut grown = self.grow(self.lattice, 3, rank)?;
                if self.job.improves {
                    grown.improve(self.map)?;
                }
                volume_of = Some(volume(&grown, &Ends::of(&grown)));
                grown
            }
        };
        (self.job.watch)(WorkspaceStage::Checking);
        let (mut check, mut notes) = (None, Vec::new());
        let size = if rank == 3 { volume_of } else { area_of.or(length_of) };
        if let (Some(family), Some(size)) = (family, size) {
            let integral = family.measure(self.map, edge, least, self.job.seed)?;
            match integral.misses_some_of(&size) {
                true => notes.push(UNCHECKED.into()),
                false => check = Some(Check::new(integral, &size)),
            }
        }
        let (volume, area, length) = (volume_of, area_of, length_of);
        Ok(Measured { dimension, grown, surface, volume, area, length, check, notes, seen: self.seen, seed_count })
    }

    fn cells(&self) -> CellMap<()> {
        self.rows.iter().map(|(_, tip)| (self.lattice.cell(tip.position), ())).collect()
    }

    /// A surface or curve, and its size by voxels of this edge and of twice as much.
    fn sectioned(&mut self, dimension: usize, rank: usize) -> Result<(Grown, Estimate), WorkspaceError> {
        let fine = self.grow(self.lattice, dimension, rank)?;
        let coarse = self.grow(Lattice { spacing: 2.0 * self.lattice.spacing, ..self.lattice }, dimension, rank)?;
        let size = extrapolated(&fine, sections(&fine), sections(&coarse));
        Ok((fine, size))
    }

    /// Of a thin body, a surface is its middle.
    fn grow(&mut self, lattice: Lattice, dimension: usize, rank: usize) -> Result<Grown, WorkspaceError> {
        let branch = if self.job.any_stable { Branch::Neighbour } else { Branch::FromRest };
        let mut grown = Grown::new(lattice, dimension, self.map.input_count(), branch, self.job.minimum_margin);
        grown.is_middle = dimension < rank;
        let mut rows = std::mem::take(&mut self.rows);
        for round in 0.. {
            let mut reached = 0;
            let job = self.job;
            let mut watch = |grown: &Grown| {
                let now = grown.reached_count();
                let goes_on = now == reached || (job.watch)(WorkspaceStage::Growing(now));
                reached = now;
                goes_on
            };
            if !grown.grow(self.map, &rows, &mut watch)? {
                return Err(WorkspaceError::Interrupted);
            }
            if round == 0 {
                self.rows = std::mem::take(&mut rows);
            }
            if round == MOST_ROUNDS || branch == Branch::Neighbour || self.is_design {
                break;
            }
            let further = grown.decide(self.map)?;
            if further.is_empty() {
                break;
            }
            let tips = self.map.solve_from_rest(&further)?;
            rows = further.into_iter().zip(tips).collect();
        }
        Ok(grown)
    }
}

/// Why there is no independent value.
const UNCHECKED: &str = "no independent value: its samples miss places where the tip moves far for little, since they count \
    every point at least once and still find less than what is reached";

/// How often growth goes on from voxels that turn out to be reached from rest after all.
const MOST_ROUNDS: usize = 3;
