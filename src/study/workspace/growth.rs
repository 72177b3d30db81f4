//! Growth of the reached voxels from neighbour to neighbour.
//!
//! All searches that are under way are solved together, round by round. What follows from a round depends on its order
//! alone, which no thread changes.

use super::engine_map::Known;
use super::lattice::{Cell, CellMap, neighbours};
use super::search::{Aim, End, GRAIN, Search, Source, Trial, solve_trials};
use super::section::section;
use super::step::Singular;
use super::tip_map::{BaseLoad, Branch, Inputs, Tip, TipMap};
use crate::backend::BackendError;
use crate::model::Vector;
use crate::table::Lattice;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc;

/// Searches for one voxel, each from another neighbour.
const MOST_TRIES: u8 = 3;
/// Searches that are under way at once.
const AT_ONCE: usize = 16_384;

/// A voxel that was looked for.
#[derive(Clone, Copy, Debug)]
pub struct Voxel {
    /// Which.
    pub cell: Cell,
    /// How the best search for it ended; `None` before the first has.
    pub end: Option<End>,
    /// What was missing to the centre (m), of the search that came nearest.
    pub missing: f64,
    /// Stability margin there.
    pub margin: f64,
    /// Tangent at the tip there.
    pub tangent: [f32; 3],
    /// Load at the base there: the same equilibrium is found again from it.
    pub base: BaseLoad,
    /// Of a surface: the area inside (m²); of a curve, the length (m); 1 for a reached centre, else 0.
    pub measure: f64,
    /// The nearest tip that was found less the centre (m); of a surface or curve the foot point.
    pub offset: [f32; 3],
    /// Of a surface its unit normal, of a curve its direction.
    pub normal: [f32; 3],
    tries: u8,
    is_sought: bool,
}

impl Voxel {
    /// Whether some part of the workspace was found inside.
    pub fn is_reached(&self) -> bool {
        self.end == Some(End::Reached)
    }
}

/// The voxels of a workspace that were looked for, in the order in which they were met.
#[derive(Clone, Debug)]
pub struct Grown {
    /// Where they lie.
    pub lattice: Lattice,
    /// Dimension of the workspace.
    pub dimension: usize,
    /// Reached ones and those around them.
    pub voxels: Vec<Voxel>,
    /// Inputs over half their range of each, `input_count` a voxel: of the solution, or of where the search ended.
    pub inputs: Vec<f64>,
    /// Number of inputs.
    pub input_count: usize,
    /// Which equilibria count.
    pub branch: Branch,
    /// Least stability margin that counts.
    pub minimum_margin: f64,
    /// Whether the middle of a thin body is meant.
    pub is_middle: bool,
    index: CellMap<u32>,
    /// Counted as they come: growth asks after every round.
    reached_count: usize,
}

struct Task {
    voxel: u32,
    source: Arc<Source>,
}

impl Grown {
    /// No voxel yet.
    pub fn new(lattice: Lattice, dimension: usize, input_count: usize, branch: Branch, minimum_margin: f64) -> Grown {
        let (voxels, inputs, index) = (Vec::new(), Vec::new(), CellMap::default());
        Grown {
            lattice,
            dimension,
            voxels,
            inputs,
            input_count,
            branch,
            minimum_margin,
            is_middle: false,
            index,
            reached_count: 0,
        }
    }

    /// The voxel of a cell that was looked for.
    pub fn voxel(&self, cell: Cell) -> Option<&Voxel> {
        self.index.get(&cell).map(|at| &self.voxels[*at as usize])
    }

    /// The place of a cell among `voxels`.
    pub fn place(&self, cell: Cell) -> Option<usize> {
        self.index.get(&cell).map(|at| *at as usize)
    }

    /// Inputs over half their range of a voxel.
    pub fn inputs_of(&self, voxel: usize) -> &[f64] {
        &self.inputs[self.input_count * voxel..][..self.input_count]
    }

    /// Number of the reached voxels.
    pub fn reached_count(&self) -> usize {
        self.reached_count
    }

    /// Places of the reached voxels.
    pub fn reached(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.voxels.len()).filter(|at| self.voxels[*at].is_reached())
    }

    /// The equilibrium of a reached voxel, to be found again.
    pub(super) fn known(&self, voxel: usize, at: Inputs) -> Known {
        let Voxel { cell, offset, base, .. } = self.voxels[voxel];
        let centre = self.lattice.centre(cell);
        let position = std::array::from_fn(|axis| centre[axis] + f64::from(offset[axis]));
        Known { at, base, position }
    }

    fn aim(&self, map: &dyn TipMap) -> Aim {
        let edge = self.lattice.spacing;
        let aim = Aim::voxels(map, self.dimension, edge, self.branch, self.minimum_margin);
        Aim { relaxes: self.is_middle, ..aim }
    }

    /// Grows from known equilibria until no neighbour is left to be tried. `watch` hears after every round how many
    /// voxels are reached, and ends the growth with false.
    ///
    /// # Errors
    ///
    /// An engine that fails.
    pub fn grow(
        &mut self,
        map: &mut dyn TipMap,
        seeds: &[(Inputs, Tip)],
        watch: &mut dyn FnMut(&Grown) -> bool,
    ) -> Result<bool, BackendError> {
        let mut queue = VecDeque::new();
        let least = self.minimum_margin;
        for (at, tip) in seeds.iter().filter(|(_, tip)| tip.counts(least)) {
            let voxel = self.meet(self.lattice.cell(tip.position));
            if self.wants(voxel) {
                self.voxels[voxel as usize].tries += 1;
                queue.push_back(Task { voxel, source: Arc::new(Source { at: *at, tip: *tip }) });
            }
        }
        self.run(map, queue, watch)
    }

    fn wants(&self, voxel: u32) -> bool {
        let voxel = &self.voxels[voxel as usize];
        !voxel.is_reached() && voxel.tries < MOST_TRIES
    }

    fn run(
        &mut self,
        map: &mut dyn TipMap,
        mut queue: VecDeque<Task>,
        watch: &mut dyn FnMut(&Grown) -> bool,
    ) -> Result<bool, BackendError> {
        let aim = self.aim(map);
        let mut active: Vec<Search> = Vec::new();
        loop {
            self.start(&aim, &mut queue, &mut active);
            if active.is_empty() {
                return Ok(true);
            }
            active.par_iter_mut().with_min_len(GRAIN).for_each(|search| search.propose(&aim));
            let mut going = Vec::with_capacity(active.len());
            for search in active {
                match search.end {
                    Some(_) => self.settle(&search, &mut queue),
                    None => going.push(search),
                }
            }
            let trials: Vec<Trial> = going.iter().map(|search| search.trial).collect();
            let tips = solve_trials(map, &trials)?;
            going.par_iter_mut().zip(tips).with_min_len(GRAIN).for_each(|(search, tip)| search.judge(&aim, tip));
            active = going;
            if !watch(self) {
                return Ok(false);
            }
        }
    }

    /// Begins the next searches; one voxel has one search at a time.
    fn start(&mut self, aim: &Aim, queue: &mut VecDeque<Task>, active: &mut Vec<Search>) {
        for _ in 0..queue.len() {
            if active.len() >= AT_ONCE {
                return;
            }
            let Some(task) = queue.pop_front() else { return };
            let voxel = &mut self.voxels[task.voxel as usize];
            if voxel.is_reached() {
                continue;
            }
            if voxel.is_sought {
                queue.push_back(task);
                continue;
            }
            voxel.is_sought = true;
            let mut search = Search::new(aim, voxel.cell, self.lattice.centre(voxel.cell), &task.source);
            search.known = voxel.end.map(|end| (end, voxel.missing));
            active.push(search);
        }
    }

    /// Notes how a search ended; a reached voxel asks its neighbours.
    fn settle(&mut self, search: &Search, queue: &mut VecDeque<Task>) {
        let Some(at) = self.place(search.cell) else { return };
        let found = self.found(search);
        let voxel = &mut self.voxels[at];
        voxel.is_sought = false;
        let is_better = voxel.end.is_none_or(|end| (found.end, found.missing) < (Some(end), voxel.missing));
        if is_better {
            self.reached_count += usize::from(found.is_reached() && !voxel.is_reached());
            *voxel = Voxel { tries: voxel.tries, ..found };
            self.inputs[self.input_count * at..][..self.input_count].copy_from_slice(&search.at[..self.input_count]);
        }
        if found.end != Some(End::Reached) {
            return;
        }
        let source = Arc::new(Source { at: search.at, tip: search.tip });
        for cell in neighbours(search.cell) {
            let voxel = self.meet(cell);
            if self.wants(voxel) {
                self.voxels[voxel as usize].tries += 1;
                queue.push_back(Task { voxel, source: source.clone() });
            }
        }
    }

    /// Notes a voxel without a search.
    pub(super) fn put(&mut self, cell: Cell, at: &Inputs, tip: &Tip, end: End) {
        let place = self.meet(cell) as usize;
        let (end, tangent, base) = (Some(end), tip.tangent.map(|x| x as f32), tip.base);
        let measure = if end == Some(End::Reached) { 1.0 } else { 0.0 };
        self.reached_count += usize::from(end == Some(End::Reached) && !self.voxels[place].is_reached());
        self.voxels[place] =
            Voxel { end, missing: 0.0, margin: tip.margin, tangent, base, measure, ..Voxel::unknown(cell) };
        self.inputs[self.input_count * place..][..self.input_count].copy_from_slice(&at[..self.input_count]);
    }

    /// Takes another solution for a voxel.
    pub(super) fn replace(&mut self, at: usize, search: &Search) {
        self.voxels[at] = Voxel { tries: self.voxels[at].tries, ..self.found(search) };
        self.inputs[self.input_count * at..][..self.input_count].copy_from_slice(&search.at[..self.input_count]);
    }

    /// What a search has found out about its voxel.
    fn found(&self, search: &Search) -> Voxel {
        let mut voxel = Voxel {
            end: search.end,
            missing: search.missing(),
            margin: search.tip.margin,
            tangent: search.tip.tangent.map(|x| x as f32),
            base: search.tip.base,
            measure: if search.end == Some(End::Reached) { 1.0 } else { 0.0 },
            ..Voxel::unknown(search.cell)
        };
        voxel.set_offset(search, &self.lattice);
        if self.dimension < 3 && matches!(search.end, Some(End::Reached | End::AtLimit)) {
            let singular = Singular::new(&search.tip.jacobian[..self.input_count]);
            let normal = singular.directions[if self.dimension == 2 { 2 } else { 0 }];
            let edge = self.lattice.spacing;
            let centre = self.lattice.centre(search.cell);
            let offset: Vector = std::array::from_fn(|axis| search.tip.position[axis] - centre[axis]);
            if search.end == Some(End::Reached) {
                let cut = section(self.dimension, normal, offset.map(|x| x / edge));
                voxel.measure = cut * edge.powi(self.dimension as i32);
                voxel.end = Some(if cut > 0.0 { End::Reached } else { End::Beside });
            }
            voxel.normal = normal.map(|x| x as f32);
        }
        voxel
    }

    /// The voxel of a cell, which may be new.
    fn meet(&mut self, cell: Cell) -> u32 {
        let next = self.voxels.len() as u32;
        let at = *self.index.entry(cell).or_insert(next);
        if at == next {
            self.voxels.push(Voxel::unknown(cell));
            self.inputs.resize(self.inputs.len() + self.input_count, f64::NAN);
        }
        at
    }
}

impl Voxel {
    pub(super) fn set_offset(&mut self, search: &Search, lattice: &Lattice) {
        let centre = lattice.centre(search.cell);
        self.offset = std::array::from_fn(|axis| (search.tip.position[axis] - centre[axis]) as f32);
    }

    fn unknown(cell: Cell) -> Voxel {
        Voxel {
            cell,
            end: None,
            missing: f64::INFINITY,
            margin: f64::NAN,
            tangent: [f32::NAN; 3],
            base: BaseLoad::NONE,
            measure: 0.0,
            offset: [0.0; 3],
            normal: [0.0; 3],
            tries: 0,
            is_sought: false,
        }
    }
}
