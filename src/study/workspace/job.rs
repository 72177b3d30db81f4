//! One call for a workspace: from a sweep or a run to its size, its boundary, and what is known of every voxel.

use super::beside_wall::on_and_before;
use super::check::points_of_box;
use super::distances::boundary_distances;
use super::engine_map::{EngineMap, MapOptions};
use super::error::WorkspaceError;
use super::growth::Grown;
use super::inputs::{WorkspaceInput, base_scene, workspace_inputs};
use super::lattice::{CellMap, shifted_lattice};
use super::measures::Ends;
use super::pose::PoseRank;
use super::seeds::{Rows, count_tips, coverage, net_points};
use super::stage::WorkspaceStage;
use super::tip_map::{TipMap, padded};
use super::voxel_values::{Cause, VoxelValues};
use super::work::{MeasureOptions, Measured, Work};
use super::workspace::{Check, Workspace};
use crate::engines::EngineRequest;
use crate::model::{Parameter, Scene};
use crate::results::Results;
use crate::spec::SweepSpec;
use crate::study::witness::{CheckError, Claim, WitnessCheck};
use crate::table::Lattice;
use std::sync::atomic::{AtomicBool, Ordering};

/// Samples of a net where there are no rows, and rows that growth begins from at most.
const SEEDS: u64 = 32_768;
/// Cells within reach of the rod, at most.
const MOST_CELLS: f64 = 5e7;

#[derive(Clone, Copy)]
pub(super) enum Origin<'a> {
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
#[derive(Clone)]
pub struct WorkspaceJob<'a> {
    pub(super) origin: Origin<'a>,
    pub(super) scene: Option<Scene>,
    pub(super) request: EngineRequest,
    pub(super) voxel: f64,
    pub(super) minimum_margin: f64,
    pub(super) seed: u64,
    pub(super) any_stable: bool,
    pub(super) length: Option<f64>,
    pub(super) fast: bool,
    pub(super) with_values: bool,
    pub(super) lattice: Option<Lattice>,
    pub(super) interrupt: Option<&'a AtomicBool>,
    pub(super) progress: Option<&'a dyn Fn(WorkspaceStage)>,
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
            length: spec.workspace.length,
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

    /// What rotations are multiplied by beside positions (m); `None`: the length of the last flexible segment.
    pub fn length(self, length: Option<f64>) -> Self {
        WorkspaceJob { length, ..self }
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
        let scene = self.rod_scene();
        let engine = self.request.choose_for(&scene, spec.tolerance)?;
        let options = MapOptions { engine, tolerance: spec.tolerance, steps: spec.steps };
        EngineMap::new(&scene, inputs, &options)
    }

    /// Measures.
    ///
    /// # Errors
    ///
    /// Options that make no sense, a directory that cannot be read, inputs that none can command, an engine that
    /// fails, or the caller's interruption.
    pub fn run(&self) -> Result<Workspace, WorkspaceError> {
        self.check_options()?;
        let (inputs, mut notes) = self.inputs()?;
        self.check_size(&self.rod_scene(), &inputs)?;
        let lattice = self.lattice.unwrap_or_else(|| shifted_lattice(self.voxel, self.seed));
        self.tell(WorkspaceStage::Seeds);
        let rows = match self.origin {
            Origin::Rows(results) => Some(Rows::read(results, &inputs, &lattice, self.minimum_margin)?),
            Origin::Sweep(_) => None,
        };
        let starts = match &rows {
            Some(rows) if rows.usable == 0 => {
                let (samples, minimum_margin) = (rows.seen as usize, self.minimum_margin);
                return Err(WorkspaceError::NoUsableRows { samples, minimum_margin });
            }
            Some(rows) => rows.starts(SEEDS as usize),
            // Where the independent value takes the whole box of inputs, its first samples are where growth begins.
            None if inputs.len() <= 3 => points_of_box(inputs.len(), SEEDS, self.seed),
            None => net_points(inputs.len(), SEEDS, self.seed),
        };
        let mut map = self.map(&inputs)?;
        let watch = |stage| self.goes_on(stage);
        let mut work = Work::new(self.options(&watch), &mut map, lattice);
        let dimension = work.seed(&starts)?;
        notes.extend(on_and_before(&self.rod_scene(), &work.tips, &dimension, inputs.len())?);
        let counts = rows.as_ref().map_or_else(|| count_tips(&lattice, &work.tips), Rows::counts);
        let found = if self.fast && dimension.rank == 3 { work.painted(dimension) } else { work.measured(dimension)? };
        self.assemble(found, inputs, notes, counts, &mut map)
    }

    pub(super) fn assemble(
        &self,
        found: Measured,
        inputs: Vec<WorkspaceInput>,
        notes: Vec<String>,
        counts: CellMap<u32>,
        map: &mut EngineMap,
    ) -> Result<Workspace, WorkspaceError> {
        let Measured { dimension, grown, surface, volume, area, length, check, seen, seed_count, notes: more } = found;
        let scene = self.rod_scene();
        let notes = [notes, more].concat();
        self.tell(WorkspaceStage::Voxels(grown.reached_count()));
        let values = match self.with_values {
            true => VoxelValues::of(&grown, map, &seen, &counts)?,
            false => VoxelValues::default(),
        };
        let distances = if grown.dimension == 3 && !self.fast { boundary_distances(&grown) } else { Vec::new() };
        let causes = (0..grown.voxels.len()).map(|at| Cause::of(&grown, at)).collect();
        let pose = match self.with_values {
            true => Some(PoseRank::of(map, &grown, &scene, self.length)?),
            false => None,
        };
        let check_by_reference = match self.with_values && !self.any_stable {
            true => self.check_by_reference(&grown, &inputs, &scene, map)?,
            false => WitnessCheck::default(),
        };
        let mark = self.mark()?.or_else(|| check_by_reference.mark.clone());
        let notes = notes.into_iter().chain(too_coarse(&grown, dimension.rank, check.as_ref())).collect();
        Ok(Workspace {
            check_by_reference,
            pose,
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
            mark,
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

    /// What the reference says of a share of the voxels.
    fn check_by_reference(
        &self,
        grown: &Grown,
        inputs: &[WorkspaceInput],
        scene: &Scene,
        map: &mut EngineMap,
    ) -> Result<WitnessCheck, WorkspaceError> {
        let places: Vec<usize> = grown.reached().collect();
        let driven: Vec<Vec<Parameter>> =
            inputs.iter().flat_map(|input| input.parameters.iter().map(|one| vec![*one])).collect();
        let mut failed = None;
        let mut claim = |at: usize| {
            let scaled = padded(grown.inputs_of(places[at]));
            let tip = match map.solve_from_rest(&[scaled]) {
                Ok(tips) => tips.first().copied().filter(|tip| tip.usable)?,
                Err(error) => {
                    failed = Some(error);
                    return None;
                }
            };
            let values = inputs.iter().zip(scaled).flat_map(|(input, t)| {
                let value = input.value(t);
                input.rates.iter().map(move |rate| rate * value)
            });
            Some(Claim { inputs: values.collect(), tip: tip.position, error_estimate: 0.0 })
        };
        let check = WitnessCheck::of(scene, &driven, places.len(), &mut claim);
        if let Some(error) = failed {
            return Err(error.into());
        }
        check.map_err(|error| match error {
            CheckError::Plan(error) => error.into(),
            CheckError::Backend(error) => error.into(),
        })
    }

    /// What speaks against the rows.
    fn mark(&self) -> Result<Option<String>, WorkspaceError> {
        match self.origin {
            Origin::Rows(results) => Ok(results.verdict()?.and_then(|verdict| verdict.headline())),
            Origin::Sweep(_) => Ok(None),
        }
    }

    fn check_options(&self) -> Result<(), WorkspaceError> {
        if !(1e-12..=1e60).contains(&self.voxel) {
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

    pub(super) fn tell(&self, stage: WorkspaceStage) {
        if let Some(progress) = self.progress {
            progress(stage);
        }
    }

    /// Tells and asks whether to go on.
    pub(super) fn goes_on(&self, stage: WorkspaceStage) -> bool {
        self.tell(stage);
        !self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    pub(super) fn options<'b>(&self, watch: &'b dyn Fn(WorkspaceStage) -> bool) -> MeasureOptions<'b> {
        MeasureOptions {
            minimum_margin: self.minimum_margin,
            any_stable: self.any_stable,
            seed: self.seed,
            improves: self.with_values,
            watch,
        }
    }
}

/// A sentence where no centre is reached although samples count.
fn too_coarse(grown: &Grown, rank: usize, check: Option<&Check>) -> Option<String> {
    if grown.reached_count() > 0 || rank == 0 {
        return None;
    }
    let edge = grown.lattice.spacing;
    let volume = check.map(|check| check.by_change_of_variables.value).filter(|volume| *volume > 0.0);
    // A thousand voxels of a body tell its size to some per cent.
    let finer = volume.map_or(0.25 * edge, |volume| 0.1 * volume.powf(1.0 / rank.min(3) as f64)).min(0.25 * edge);
    Some(format!(
        "voxels too coarse: none of their centres is reached; take voxels of at most {:.3} mm (`--voxel {:.3}mm`)",
        1e3 * finer,
        1e3 * finer
    ))
}
