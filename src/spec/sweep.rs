//! A sweep: which scene, which samples, which columns. A valid `SweepSpec` can be planned and run.

use super::InputTable;
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    Grid,
    Sobol,
    LatinHypercube,
    Uniform,
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
pub enum OutputQuantity {
    TipPosition,
    TipRotation,
    BaseCurvature,
    Stability,
    ErrorEstimate,
    BaseMoment,
    Residual,
    Iterations,
    LoadFraction,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Parquet,
    Csv,
    Npz,
    /// No rows: only the workspace reduction.
    None,
}

/// One swept direction; it may drive several parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisSpec {
    pub parameters: Vec<Parameter>,
    /// SI
    pub from: f64,
    /// SI
    pub to: f64,
    /// Grid points; 0 for other methods.
    pub points: u64,
}

/// A sweep as it will be run.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepSpec {
    pub file: PathBuf,
    pub scene: Scene,
    pub method: Method,
    pub seed: u64,
    pub sample_count: u64,
    pub axes: Vec<AxisSpec>,
    /// Values of `method = "table"`.
    pub table: Option<Arc<InputTable>>,
    pub tolerance: f64,
    pub branch: BranchChoice,
    /// Steps over the rod, where the file fixes them.
    pub steps: Option<usize>,
    pub quantities: Vec<OutputQuantity>,
    pub wrt: Vec<Parameter>,
    pub format: Format,
    /// Edge of a workspace voxel [m]
    pub voxel: f64,
    /// What the user should know about how the file was read.
    pub notes: Vec<String>,
}

impl OutputQuantity {
    pub const ALL: [OutputQuantity; 9] = [
        OutputQuantity::TipPosition,
        OutputQuantity::TipRotation,
        OutputQuantity::BaseCurvature,
        OutputQuantity::Stability,
        OutputQuantity::ErrorEstimate,
        OutputQuantity::BaseMoment,
        OutputQuantity::Residual,
        OutputQuantity::Iterations,
        OutputQuantity::LoadFraction,
    ];

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
        }
    }
}

impl Method {
    pub const ALL: [Method; 5] = [Method::Grid, Method::Sobol, Method::LatinHypercube, Method::Uniform, Method::Table];

    pub fn name(self) -> &'static str {
        match self {
            Method::Grid => "grid",
            Method::Sobol => "sobol",
            Method::LatinHypercube => "latin_hypercube",
            Method::Uniform => "uniform",
            Method::Table => "table",
        }
    }
}

impl BranchChoice {
    pub const ALL: [BranchChoice; 2] = [BranchChoice::FromRest, BranchChoice::All];

    pub fn name(self) -> &'static str {
        match self {
            BranchChoice::FromRest => "from_rest",
            BranchChoice::All => "all",
        }
    }
}

impl Format {
    pub const ALL: [Format; 4] = [Format::Parquet, Format::Csv, Format::Npz, Format::None];

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
    /// Parameters that each axis drives.
    pub fn axis_parameters(&self) -> Vec<Vec<Parameter>> {
        self.axes.iter().map(|axis| axis.parameters.clone()).collect()
    }

    /// The plan of this sweep at a resolution; tolerance and fixed steps come from the file. Without rows there are
    /// no derivatives, and rows have none of the base moment.
    pub fn plan(&self, options: PlanOptions) -> Result<Plan, PlanError> {
        let steps = self.steps.unwrap_or(options.steps);
        let options = PlanOptions { tolerance: self.tolerance, steps, base_moment_rows: false, ..options };
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
        let mut row = vec![0.0; self.axes.len()];
        self.sampler().values(index, &mut row);
        let mut scene = self.scene.clone();
        let values = self.axes.iter().zip(&row).flat_map(|(axis, value)| axis.parameters.iter().map(|p| (*p, *value)));
        // Checked when the file was read.
        let _ = Parameter::set_all(&mut scene, values);
        scene
    }
}
