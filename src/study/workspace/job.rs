//! One call for a workspace: from a sweep or a run to its size, its boundary, and what is known of every voxel.

use super::check::Family;
use super::dimension::Dimension;
use super::distances::boundary_distances;
use super::engine_map::{EngineMap, MapOptions};
use super::error::WorkspaceError;
use super::growth::Grown;
use super::inputs::{WorkspaceInput, base_scene, workspace_inputs};
use super::lattice::{CellMap, Lattice};
use super::measures::{Ends, Estimate, extrapolated, sections, volume};
use super::paint::paint;
use super::seeds::{Rows, count_tips, coverage, net_points};
use super::tip_map::{Branch, Inputs, Tip, TipMap};
use super::voxel_values::{Cause, Seen, VoxelValues};
use super::workspace::{Check, Workspace};
use crate::engines::EngineRequest;
use crate::model::Scene;
use crate::results::Results;
use crate::spec::SweepSpec;
use std::sync::atomic::{AtomicBool, Ordering};

/// Samples of a net where there are no rows, and rows that growth begins from at most.
const SEEDS: u64 = 65_536;
/// Equilibria of the nominal design that another one is grown from, at most.
const DESIGN_SEEDS: usize = 8192;
/// Cells within reach of the rod, at most.
const MOST_CELLS: f64 = 5e7;

/// What a job is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WorkspaceStage {
    /// Reads rows or solves a net.
    Seeds,
    /// Looks for voxels; so many are reached.
    Growing(usize),
    /// Computes the independent value.
    Checking,
    /// Solves every voxel for its Jacobian and compliance.
    Voxels(usize),
    /// Designs done and wanted.
    Designs(usize, usize),
}

enum Origin<'a> {
    Sweep(&'a SweepSpec),
    Rows(&'a Results),
}

/// Measures the workspace of a sweep or of a run.
///
/// ```no_run
/// use rodsweep::spec::SweepSpec;
/// use rodsweep::study::workspace::WorkspaceJob;
///
/// let spec = SweepSpec::read("sweeps/insertion.toml".as_ref())?;
/// let workspace = WorkspaceJob::of_sweep(&spec).voxel(2e-3).run()?;
/// if let Some(volume) = workspace.volume {
///     println!("{:.1} cm³, 95 %: {:.1} to {:.1}", 1e6 * volume.value, 1e6 * volume.low, 1e6 * volume.high);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct WorkspaceJob<'a> {
    origin: Origin<'a>,
    scene: Option<Scene>,
    request: EngineRequest,
    voxel: f64,
    minimum_margin: f64,
    seed: u64,
    any_stable: bool,
    fast: bool,
    with_values: bool,
    lattice: Option<Lattice>,
    interrupt: Option<&'a AtomicBool>,
    progress: Option<&'a dyn Fn(WorkspaceStage)>,
}

impl<'a> WorkspaceJob<'a> {
    /// Of the inputs of a sweep; nothing of it needs to have been run.
    pub fn of_sweep(spec: &'a SweepSpec) -> WorkspaceJob<'a> {
        WorkspaceJob::new(Origin::Sweep(spec), spec)
    }

    /// Of a run: its rows, or the tips that a run without rows has kept, tell where to begin.
    pub fn of_results(results: &'a Results) -> WorkspaceJob<'a> {
        WorkspaceJob::new(Origin::Rows(results), results.spec())
    }

    fn new(origin: Origin<'a>, spec: &SweepSpec) -> WorkspaceJob<'a> {
        WorkspaceJob {
            origin,
            scene: None,
            request: EngineRequest::any(),
            voxel: spec.workspace.voxel,
            minimum_margin: spec.workspace.minimum_margin,
            seed: spec.workspace.seed,
            any_stable: false,
            fast: false,
            with_values: true,
            lattice: None,
            interrupt: None,
            progress: None,
        }
    }

    /// What is asked of the engine.
    pub fn engine(self, request: EngineRequest) -> Self {
        WorkspaceJob { request, ..self }
    }

    /// Edge of a voxel (m).
    pub fn voxel(self, edge: f64) -> Self {
        WorkspaceJob { voxel: edge, ..self }
    }

    /// Least stability margin of an equilibrium that counts.
    pub fn minimum_margin(self, margin: f64) -> Self {
        WorkspaceJob { minimum_margin: margin, ..self }
    }

    /// Of the lattice and of all nets.
    pub fn seed(self, seed: u64) -> Self {
        WorkspaceJob { seed, ..self }
    }

    /// Whether every stable equilibrium counts that continues one from rest, not only those from rest.
    pub fn any_stable(self, any_stable: bool) -> Self {
        WorkspaceJob { any_stable, ..self }
    }

    /// Whether rows only paint the centres near them: quick, and no centre is proven.
    pub fn fast(self, fast: bool) -> Self {
        WorkspaceJob { fast, ..self }
    }

    /// Whether every voxel's dexterity, compliance and the like are wanted.
    pub fn voxel_values(self, wanted: bool) -> Self {
        WorkspaceJob { with_values: wanted, ..self }
    }

    /// A lattice of one's own; else one shifted by the seed.
    pub fn lattice(self, lattice: Option<Lattice>) -> Self {
        WorkspaceJob { lattice, ..self }
    }

    /// Another rod with the same inputs, for design studies.
    pub fn scene(self, scene: Option<Scene>) -> Self {
        WorkspaceJob { scene, ..self }
    }

    /// A flag that ends the job between batches.
    pub fn interrupt(self, flag: &'a AtomicBool) -> Self {
        WorkspaceJob { interrupt: Some(flag), ..self }
    }

    /// Who hears what the job is at.
    pub fn progress(self, progress: Option<&'a dyn Fn(WorkspaceStage)>) -> Self {
        WorkspaceJob { progress, ..self }
    }

    /// The sweep it is about.
    pub fn spec(&self) -> &SweepSpec {
        match self.origin {
            Origin::Sweep(spec) => spec,
            Origin::Rows(results) => results.spec(),
        }
    }

    /// The inputs, and what is to be said of axes that are none.
    ///
    /// # Errors
    ///
    /// As [`workspace_inputs`].
    pub fn inputs(&self) -> Result<(Vec<WorkspaceInput>, Vec<String>), WorkspaceError> {
        workspace_inputs(self.spec())
    }

    /// The rod: that of the sweep, where nothing else was said.
    pub fn rod_scene(&self) -> Scene {
        self.scene.clone().unwrap_or_else(|| base_scene(self.spec()))
    }

    /// The engine for the rod as a map from inputs to tips.
    ///
    /// # Errors
    ///
    /// As [`EngineMap::new`].
    pub fn map(&self, inputs: &[WorkspaceInput]) -> Result<EngineMap, WorkspaceError> {
        let spec = self.spec();
        let engine = self.request.choose(spec.tolerance)?;
        let options = MapOptions { engine, tolerance: spec.tolerance, steps: spec.steps };
        EngineMap::new(&self.rod_scene(), inputs, &options)
    }

    /// Measures.
    ///
    /// # Errors
    ///
    /// Options that make no sense, a directory that cannot be read, inputs that none can command, an engine that
    /// fails, or the caller's interruption.
    pub fn run(&self) -> Result<Workspace, WorkspaceError> {
        self.check_options()?;
        let (inputs, notes) = self.inputs()?;
        let scene = self.rod_scene();
        self.check_size(&scene, &inputs)?;
        let lattice = self.lattice.unwrap_or_else(|| Lattice::shifted(self.voxel, self.seed));
        self.tell(WorkspaceStage::Seeds);
        let rows = match self.origin {
            Origin::Rows(results) => Some(Rows::read(results, &inputs, &lattice, self.minimum_margin)?),
            Origin::Sweep(_) => None,
        };
        let starts = match &rows {
            Some(rows) if rows.usable == 0 => return Err(self.nothing_usable(rows.seen as usize)),
            Some(rows) => rows.starts(SEEDS as usize),
            None => net_points(inputs.len(), SEEDS, self.seed),
        };
        let mut map = self.map(&inputs)?;
        let mut work = Work::new(self, &mut map, lattice);
        work.seed(&starts)?;
        let counts = rows.as_ref().map_or_else(|| count_tips(&lattice, &work.tips), Rows::counts);
        let Some(dimension) = work.dimension else { return Err(self.nothing_usable(starts.len())) };
        let found = if self.fast && dimension.rank == 3 { work.painted() } else { work.measured(dimension)? };
        self.assemble(found, inputs, scene, notes, dimension, counts, &mut map)
    }

    #[allow(clippy::too_many_arguments)]
    fn assemble(
        &self,
        found: Found,
        inputs: Vec<WorkspaceInput>,
        scene: Scene,
        notes: Vec<String>,
        dimension: Dimension,
        counts: CellMap<u32>,
        map: &mut EngineMap,
    ) -> Result<Workspace, WorkspaceError> {
        let Found { grown, surface, volume, area, length, check, seen, seed_count } = found;
        let places: Vec<usize> = grown.reached().collect();
        self.tell(WorkspaceStage::Voxels(places.len()));
        let values = match self.with_values {
            true => VoxelValues::of(&grown, map, &seen, &counts)?,
            false => VoxelValues::default(),
        };
        let distances = if grown.dimension == 3 && !self.fast { boundary_distances(&grown) } else { Vec::new() };
        let causes = (0..grown.voxels.len()).map(|at| Cause::of(&grown, at)).collect();
        Ok(Workspace {
            dimension,
            volume,
            area,
            length,
            check,
            ends: Ends::of(&grown),
            coverage: coverage(&counts),
            seed_count,
            solves: map.solves(),
            method: map.method(),
            engine: map.engine(),
            minimum_margin: self.minimum_margin,
            any_stable: self.any_stable,
            is_painted: self.fast,
            seed: self.seed,
            scene,
            inputs,
            counts,
            grown,
            surface,
            values,
            distances,
            causes,
            notes,
        })
    }

    fn check_options(&self) -> Result<(), WorkspaceError> {
        if !(self.voxel > 0.0 && self.voxel.is_finite()) {
            return Err(WorkspaceError::Voxel(self.voxel));
        }
        if !(0.0..1.0).contains(&self.minimum_margin) {
            return Err(WorkspaceError::Margin(self.minimum_margin));
        }
        Ok(())
    }

    /// Refuses a lattice that would not fit into memory.
    fn check_size(&self, scene: &Scene, inputs: &[WorkspaceInput]) -> Result<(), WorkspaceError> {
        use crate::model::Parameter::{BasePosition, Insertion};
        let inserted = inputs.iter().filter(|input| input.parameters.contains(&Insertion)).map(|input| input.high);
        let length = inserted.fold(scene.total_length(), f64::max);
        let moves = |input: &WorkspaceInput| input.parameters.iter().any(|p| matches!(p, BasePosition(_)));
        let travel: f64 = inputs.iter().filter(|input| moves(input)).map(|input| 2.0 * input.half_range()).sum();
        let across = 2.0 * length + travel;
        let cells = (across / self.voxel).powi(3) * std::f64::consts::PI / 6.0;
        if cells > MOST_CELLS {
            let fits = self.voxel * (cells / MOST_CELLS).cbrt();
            return Err(WorkspaceError::TooManyVoxels { voxel: self.voxel, cells, most: MOST_CELLS, fits });
        }
        Ok(())
    }

    fn nothing_usable(&self, samples: usize) -> WorkspaceError {
        WorkspaceError::NoUsableRows { samples, minimum_margin: self.minimum_margin }
    }

    pub(super) fn lattice_seed(&self) -> u64 {
        self.seed
    }

    /// The workspace of another rod on the nominal one's lattice, grown from the nominal inputs.
    pub(super) fn of_design(&self, nominal: &Workspace, scene: Scene) -> Result<Workspace, WorkspaceError> {
        let reached: Vec<usize> = nominal.grown.reached().collect();
        let every = reached.len().div_ceil(DESIGN_SEEDS).max(1);
        let starts: Vec<Inputs> =
            reached.iter().step_by(every).map(|at| super::tip_map::padded(nominal.grown.inputs_of(*at))).collect();
        let inputs = nominal.inputs.clone();
        let job = WorkspaceJob {
            origin: match self.origin {
                Origin::Sweep(spec) => Origin::Sweep(spec),
                Origin::Rows(results) => Origin::Sweep(results.spec()),
            },
            scene: Some(scene.clone()),
            lattice: Some(nominal.grown.lattice),
            with_values: false,
            progress: None,
            ..*self
        };
        let mut map = job.map(&inputs)?;
        let mut work = Work::new(&job, &mut map, nominal.grown.lattice);
        work.is_design = true;
        work.seed(&starts)?;
        if work.dimension.is_none() {
            return Err(self.nothing_usable(starts.len()));
        }
        let counts = CellMap::default();
        // The dimension is the nominal one's: it decides what is counted.
        let found = work.measured(nominal.dimension)?;
        job.assemble(found, inputs, scene, Vec::new(), nominal.dimension, counts, &mut map)
    }

    pub(super) fn tell(&self, stage: WorkspaceStage) {
        if let Some(progress) = self.progress {
            progress(stage);
        }
    }

    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// What was found of a workspace.
struct Found {
    grown: Grown,
    surface: Option<Grown>,
    volume: Option<Estimate>,
    area: Option<Estimate>,
    length: Option<Estimate>,
    check: Option<Check>,
    seen: Seen,
    seed_count: usize,
}

/// A job under way.
struct Work<'a> {
    job: &'a WorkspaceJob<'a>,
    map: &'a mut EngineMap,
    lattice: Lattice,
    rows: Vec<(Inputs, Tip)>,
    tips: Vec<Tip>,
    dimension: Option<Dimension>,
    seen: Seen,
    /// One of many designs: neither checked nor decided, so that it is quick.
    is_design: bool,
}

impl<'a> Work<'a> {
    fn new(job: &'a WorkspaceJob<'a>, map: &'a mut EngineMap, lattice: Lattice) -> Work<'a> {
        Work {
            job,
            map,
            lattice,
            rows: Vec::new(),
            tips: Vec::new(),
            dimension: None,
            seen: Seen::default(),
            is_design: false,
        }
    }

    /// Solves where growth is to begin.
    fn seed(&mut self, starts: &[Inputs]) -> Result<(), WorkspaceError> {
        self.tips = self.map.from_rest(starts)?;
        let pairs = starts.iter().copied().zip(self.tips.iter().copied());
        self.rows = pairs.filter(|(_, tip)| tip.counts(self.job.minimum_margin)).collect();
        self.rows.iter().for_each(|(at, tip)| self.seen.add(&self.lattice, at, tip));
        let usable: Vec<Tip> = self.rows.iter().map(|(_, tip)| *tip).collect();
        let known = !usable.is_empty();
        self.dimension = known.then(|| Dimension::of(&usable, self.map.input_count(), self.lattice.edge));
        Ok(())
    }

    fn painted(self) -> Found {
        let (count, least) = (self.map.input_count(), self.job.minimum_margin);
        let grown = paint(self.lattice, count, least, &self.rows, self.tips.len());
        let painted = volume(&grown, &Ends::of(&grown));
        // Nothing is proven, and what no row came near is missing: no interval holds.
        let volume = Some(Estimate { low: f64::NAN, high: f64::NAN, ..painted });
        Found {
            grown,
            surface: None,
            volume,
            area: None,
            length: None,
            check: None,
            seen: self.seen,
            seed_count: self.rows.len(),
        }
    }

    fn measured(mut self, dimension: Dimension) -> Result<Found, WorkspaceError> {
        let (seed_count, edge) = (self.rows.len(), self.lattice.edge);
        let least = self.job.minimum_margin;
        self.job.tell(WorkspaceStage::Checking);
        let family = match (self.job.any_stable || self.is_design, dimension.rank) {
            (true, _) | (_, 0) => None,
            (false, rank) => Family::solve(self.map, rank, least, self.job.seed)?,
        };
        if let Some(family) = &family {
            // Further places to begin from; the integral itself knows nothing of growth.
            let counting = family.seeds().filter(|(_, tip)| tip.counts(least));
            let starts: Vec<Inputs> = counting.map(|(at, _)| at).collect();
            let (cells, mut fresh) = (self.cells(), Vec::new());
            for (at, tip) in starts.into_iter().zip(family.tips.iter().filter(|tip| tip.counts(least))) {
                self.seen.add(&self.lattice, &at, tip);
                if !cells.contains_key(&self.lattice.cell(tip.position)) {
                    fresh.push(at);
                }
            }
            // Once more with every derivative: those of the family are held at its limits.
            let tips = self.map.from_rest(&fresh)?;
            self.rows.extend(fresh.into_iter().zip(tips).filter(|(_, tip)| tip.counts(least)));
        }
        let (mut volume_of, mut area_of, mut length_of, mut surface) = (None, None, None, None);
        let rank = dimension.rank;
        if dimension.is_thin {
            let (sheet, area) = self.sectioned(2)?;
            let feet: Vec<Inputs> = sheet.reached().map(|at| super::tip_map::padded(sheet.inputs_of(at))).collect();
            let tips = self.map.from_rest(&feet)?;
            self.rows.extend(feet.into_iter().zip(tips));
            (surface, area_of) = (Some(sheet), Some(area));
        }
        let grown = match rank {
            0 => self.grow(self.lattice, 3)?,
            1 | 2 => {
                let (grown, size) = self.sectioned(rank)?;
                if rank == 2 {
                    area_of = Some(size)
                } else {
                    length_of = Some(size)
                }
                grown
            }
            _ => {
                let grown = self.grow(self.lattice, 3)?;
                volume_of = Some(volume(&grown, &Ends::of(&grown)));
                grown
            }
        };
        self.job.tell(WorkspaceStage::Checking);
        let check = match family {
            Some(family) => {
                let integral = family.measure(self.map, edge, least, self.job.seed)?;
                let size = if rank == 3 { volume_of } else { area_of.or(length_of) };
                size.map(|size| Check::new(integral, &size))
            }
            None => None,
        };
        let (volume, area, length) = (volume_of, area_of, length_of);
        Ok(Found { grown, surface, volume, area, length, check, seen: self.seen, seed_count })
    }

    fn cells(&self) -> CellMap<()> {
        self.rows.iter().map(|(_, tip)| (self.lattice.cell(tip.position), ())).collect()
    }

    /// A surface or curve, and its size by voxels of this edge and of twice as much.
    fn sectioned(&mut self, dimension: usize) -> Result<(Grown, Estimate), WorkspaceError> {
        let fine = self.grow(self.lattice, dimension)?;
        let coarse = self.grow(Lattice { edge: 2.0 * self.lattice.edge, ..self.lattice }, dimension)?;
        Ok((fine.clone(), extrapolated(&fine, sections(&fine), sections(&coarse))))
    }

    fn grow(&mut self, lattice: Lattice, dimension: usize) -> Result<Grown, WorkspaceError> {
        let branch = if self.job.any_stable { Branch::Neighbour } else { Branch::FromRest };
        let mut grown = Grown::new(lattice, dimension, self.map.input_count(), branch, self.job.minimum_margin);
        let mut rows = std::mem::take(&mut self.rows);
        for round in 0.. {
            let mut reached = 0;
            let mut watch = |grown: &Grown| {
                let now = grown.voxels.iter().filter(|voxel| voxel.is_reached()).count();
                if now != reached {
                    self.job.tell(WorkspaceStage::Growing(now));
                }
                reached = now;
                !self.job.is_interrupted()
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
            let tips = self.map.from_rest(&further)?;
            rows = further.into_iter().zip(tips).collect();
        }
        Ok(grown)
    }
}

/// How often growth goes on from voxels that turn out to be reached from rest after all.
const MOST_ROUNDS: usize = 3;
