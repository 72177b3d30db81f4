//! A sweep: which scene, which samples, which columns. A valid `SweepSpec` can be planned and run.

use super::InputTable;
use super::axis::AxisSpec;
use super::precision::PrecisionChoice;
use super::sampling::{SaltelliDesign, Skeleton, SkeletonError, SkeletonSampling};
use crate::model::{Parameter, Plan, PlanError, PlanOptions, Scene};
use std::path::PathBuf;
use std::sync::Arc;

/// Rows that a sweep may write.
pub const MAX_ROWS: u64 = 1_000_000_000;
/// Samples of a sweep that only accumulates its workspace.
pub const MAX_SAMPLES: u64 = 1 << 40;

/// Samples in a part file.
pub const CHUNK: u64 = 65_536;
/// The same where every equilibrium is looked for.
pub const BRANCH_CHUNK: u64 = 2048;

/// Beside a resolved sweep file: the values of a table, SI.
pub const RESOLVED_TABLE: &str = "inputs.csv";

/// How samples are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Every combination of evenly spaced values; the first axis varies fastest.
    Grid,
    /// Sobol' points (Joe and Kuo's directions), scrambled after Owen by the seed.
    Sobol,
    /// One value in each of as many equal shares of every axis as there are samples.
    LatinHypercube,
    /// Values drawn independently.
    Uniform,
    /// Base rows of Saltelli's design for Sobol' indices, each of 2 axes + 2 samples.
    Saltelli,
    /// Sobol' points on the faces of the box of axes: some axes vary, the others are at a limit.
    Skeleton,
    /// The rows of a table.
    Table,
}

/// Which equilibria of a sample are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BranchChoice {
    /// The one reached by raising all loads together from zero.
    #[default]
    FromRest,
    /// Every one that can be found.
    All,
}

/// A column group of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OutputQuantity {
    /// Position of the tip, world frame (m).
    TipPosition,
    /// Rotation of the tip as a rotation vector, body to world (rad).
    TipRotation,
    /// Curvature at the start of the first flexible segment, body frame (1/m).
    BaseCurvature,
    /// Stability margin, and whether the equilibrium is stable.
    Stability,
    /// Estimated error of tip position over rod length or of tip rotation (rad), whichever is larger.
    ErrorEstimate,
    /// Internal moment at the base, world frame (N·m).
    BaseMoment,
    /// What is left of the balance of moments at the tip, in the plan's unit of moment.
    Residual,
    /// Passes over the rod.
    Iterations,
    /// Share of the full load that was reached from rest.
    LoadFraction,
    /// Estimated error of the derivatives: of the worst, (dp/L, w) over its norm.
    DerivativeError,
    /// Share of the full load at which the path from rest ends in a fold, its estimated error, and how it follows the
    /// parameters that the sweep differentiates by.
    FoldLoad,
    /// Gap and force at the wall, whether friction holds the tip, and how the force follows the parameters that the sweep
    /// differentiates by.
    Contact,
}

/// What a sweep writes its rows as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Parquet, with units in the schema.
    Parquet,
    /// Text with commas; it has no place for units.
    Csv,
    /// NumPy's archive of arrays.
    Npz,
    /// No rows: only the workspace reduction.
    None,
}

/// What a sweep says about its workspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkspaceOptions {
    /// Edge of a voxel (m)
    pub voxel: f64,
    /// Least stability margin of an equilibrium that counts, from 0 to 1.
    pub minimum_margin: f64,
    /// Of what is drawn for the workspace alone.
    pub seed: u64,
    /// What rotations are multiplied by beside positions (m); the study chooses where there is none.
    pub length: Option<f64>,
}

impl Default for WorkspaceOptions {
    fn default() -> Self {
        WorkspaceOptions { voxel: 1e-3, minimum_margin: 0.0, seed: 0, length: None }
    }
}

/// A sweep as it will be run.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepSpec {
    /// The sweep file.
    pub file: PathBuf,
    /// With its own values, where no axis says otherwise.
    pub scene: Scene,
    /// How samples are chosen.
    pub method: Method,
    /// Of what is drawn; the same seed makes the same samples.
    pub seed: u64,
    /// Samples of the whole sweep, over all shards.
    pub sample_count: u64,
    /// What varies.
    pub axes: Vec<AxisSpec>,
    /// What is not known well; a run gives it the scene's values.
    pub uncertain: Vec<AxisSpec>,
    /// What `method = "skeleton"` was asked for.
    pub skeleton: Option<SkeletonSampling>,
    /// Values of `method = "table"`.
    pub table: Option<Arc<InputTable>>,
    /// Target error of tip position over rod length and of tip rotation (rad).
    pub tolerance: f64,
    /// Target error of derivatives: the worst column of a sample, over its norm, in 95 % of the samples.
    pub derivative_tolerance: f64,
    /// Which equilibria are wanted.
    pub branch: BranchChoice,
    /// Arithmetic that the file asks for.
    pub precision: PrecisionChoice,
    /// Steps over the rod, where the file fixes them.
    pub steps: Option<usize>,
    /// Whether samples may start from anchors, equilibria on a grid over the axes, where these pay.
    pub anchors: bool,
    /// Share of the samples that may fail, from 0 to 1; `None`: those that the scene explains, such as folds.
    pub allow_failures: Option<f64>,
    /// Column groups of the rows, in order.
    pub quantities: Vec<OutputQuantity>,
    /// What the tip is differentiated by.
    pub wrt: Vec<Parameter>,
    /// Whether derivatives are written in single precision; without, in that of the engine.
    pub single_derivatives: bool,
    /// What rows are written as.
    pub format: Format,
    /// Whether rows lie in a folder of their own, which readers of tables open whole.
    pub rows_in_folder: bool,
    /// What it says about its workspace.
    pub workspace: WorkspaceOptions,
    /// Remarks on how the file was read.
    pub notes: Vec<String>,
}

impl OutputQuantity {
    /// Every quantity, in the order of the columns.
    pub const ALL: [OutputQuantity; 12] = [
        OutputQuantity::TipPosition,
        OutputQuantity::TipRotation,
        OutputQuantity::BaseCurvature,
        OutputQuantity::Stability,
        OutputQuantity::ErrorEstimate,
        OutputQuantity::BaseMoment,
        OutputQuantity::Residual,
        OutputQuantity::Iterations,
        OutputQuantity::LoadFraction,
        OutputQuantity::DerivativeError,
        OutputQuantity::FoldLoad,
        OutputQuantity::Contact,
    ];

    /// Those of a sweep of a scene that names none.
    pub fn usual(scene: &Scene, derivatives: &[Parameter]) -> Vec<OutputQuantity> {
        let of_derivatives = if derivatives.is_empty() { &[][..] } else { &[OutputQuantity::DerivativeError] };
        let of_wall = if scene.wall.is_none() { &[][..] } else { &[OutputQuantity::Contact] };
        [&OutputQuantity::ALL[..5], of_wall, of_derivatives].concat()
    }

    /// Whether a scene tells it: a contact needs a wall.
    pub fn is_told_by(self, scene: &Scene) -> bool {
        self != OutputQuantity::Contact || scene.wall.is_some()
    }

    /// The word in sweep files.
    pub fn name(self) -> &'static str {
        match self {
            OutputQuantity::TipPosition => "tip_position",
            OutputQuantity::TipRotation => "tip_rotation",
            OutputQuantity::BaseCurvature => "base_curvature",
            OutputQuantity::Stability => "stability",
            OutputQuantity::ErrorEstimate => "error_estimate",
            OutputQuantity::BaseMoment => "base_moment",
            OutputQuantity::Residual => "residual",
            OutputQuantity::Iterations => "iterations",
            OutputQuantity::LoadFraction => "load_fraction",
            OutputQuantity::DerivativeError => "derivative_error",
            OutputQuantity::FoldLoad => "fold.load",
            OutputQuantity::Contact => "contact",
        }
    }
}

impl Method {
    /// Every method.
    pub const ALL: [Method; 7] = [
        Method::Grid,
        Method::Sobol,
        Method::LatinHypercube,
        Method::Uniform,
        Method::Saltelli,
        Method::Skeleton,
        Method::Table,
    ];

    /// The word in sweep files.
    pub fn name(self) -> &'static str {
        match self {
            Method::Grid => "grid",
            Method::Sobol => "sobol",
            Method::LatinHypercube => "latin_hypercube",
            Method::Uniform => "uniform",
            Method::Saltelli => "saltelli",
            Method::Skeleton => "skeleton",
            Method::Table => "table",
        }
    }
}

impl BranchChoice {
    /// Every choice.
    pub const ALL: [BranchChoice; 2] = [BranchChoice::FromRest, BranchChoice::All];

    /// The word in sweep files.
    pub fn name(self) -> &'static str {
        match self {
            BranchChoice::FromRest => "from_rest",
            BranchChoice::All => "all",
        }
    }
}

impl Format {
    /// Every format.
    pub const ALL: [Format; 4] = [Format::Parquet, Format::Csv, Format::Npz, Format::None];

    /// Most samples of a sweep that writes this.
    pub(crate) fn most_samples(self) -> u64 {
        if self == Format::None { MAX_SAMPLES } else { MAX_ROWS }
    }

    /// The word in sweep files, and the extension of parts.
    pub fn name(self) -> &'static str {
        match self {
            Format::Parquet => "parquet",
            Format::Csv => "csv",
            Format::Npz => "npz",
            Format::None => "none",
        }
    }
}

impl SweepSpec {
    /// Whether rows tell how the load of a fold follows parameters.
    pub fn tells_fold_slopes(&self) -> bool {
        self.format != Format::None && !self.wrt.is_empty() && self.quantities.contains(&OutputQuantity::FoldLoad)
    }

    /// Parameters that each value of a sample drives: all those of an axis, or one each where an axis scales them.
    pub fn axis_parameters(&self) -> Vec<Vec<Parameter>> {
        self.axes.iter().flat_map(AxisSpec::groups).collect()
    }

    /// The design of `method = "saltelli"`.
    pub fn saltelli_design(&self) -> Option<SaltelliDesign> {
        (self.method == Method::Saltelli).then_some(SaltelliDesign { axis_count: self.axes.len() })
    }

    /// The faces of `method = "skeleton"`.
    pub fn skeleton_faces(&self) -> Option<Skeleton> {
        self.skeleton?.skeleton(self.axes.len()).ok()
    }

    /// The same sweep with so many axes that vary on each face; other methods stay as they are.
    ///
    /// # Errors
    ///
    /// More axes than the sweep has, none, or faces that take more samples than a sweep may have.
    pub fn with_skeleton_dimension(self, dimension: usize) -> Result<SweepSpec, SkeletonError> {
        let Some(before) = self.skeleton else { return Ok(self) };
        let axis_count = self.axes.len();
        let skeleton = SkeletonSampling { dimension: Some(dimension), ..before };
        let sample_count = skeleton.sample_count(axis_count, self.format.most_samples())?;
        let outdated = before.note(axis_count, self.sample_count);
        let mut notes = self.notes;
        notes.retain(|note| Some(note) != outdated.as_ref());
        notes.extend(skeleton.note(axis_count, sample_count));
        Ok(SweepSpec { skeleton: Some(skeleton), sample_count, notes, ..self })
    }

    /// The plan of this sweep at a resolution; tolerance and fixed steps come from the file. Without rows there are
    /// no derivatives, and rows have none of the base moment.
    ///
    /// # Errors
    ///
    /// A scene or parameters that make no plan.
    pub fn plan(&self, options: PlanOptions) -> Result<Plan, PlanError> {
        let steps = self.steps.unwrap_or(options.steps);
        let SweepSpec { tolerance, derivative_tolerance, .. } = *self;
        let (base_moment_rows, fold_rows) = (false, self.tells_fold_slopes());
        let options = PlanOptions { tolerance, derivative_tolerance, steps, base_moment_rows, fold_rows, ..options };
        let wrt = if self.format == Format::None { &[] } else { &self.wrt[..] };
        Plan::new(&self.scene, &self.axis_parameters(), wrt, options)
    }

    /// Samples in a part: fewer where each takes long.
    pub fn chunk(&self) -> u64 {
        match self.branch {
            BranchChoice::FromRest => CHUNK,
            BranchChoice::All => BRANCH_CHUNK,
        }
    }

    /// The scene of one sample, as `solve` would read it.
    pub fn sample_scene(&self, index: u64) -> Scene {
        let (sampler, driven) = (self.sampler(), self.axis_parameters());
        let mut row = vec![0.0; sampler.value_count()];
        sampler.values(index, &mut row);
        let mut scene = self.scene.clone();
        let values = driven.iter().zip(&row).flat_map(|(driven, value)| driven.iter().map(|p| (*p, *value)));
        // Checked when the file was read.
        let _ = Parameter::set_all(&mut scene, values);
        scene
    }
}
