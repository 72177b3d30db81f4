//! Sweep files: which scene, which samples, which columns. A valid `SweepSpec` can be planned and run.

use super::directory::plain_columns;
use super::error::InputError;
use super::layout::Layout;
use super::run::{BRANCH_CHUNK, CHUNK};
use super::sampling::Sampler;
use super::scene_file::read_text;
use super::scene_text::write_inline_scene;
use super::sweep_file::parse_sweep;
use super::table_file::InputTable;
use crate::backend::Precision;
use crate::model::{Parameter, Plan, PlanError, PlanOptions, Scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows that a sweep may write.
pub const MAX_ROWS: u64 = 1_000_000_000;
/// Samples of a sweep that only accumulates its workspace.
pub const MAX_SAMPLES: u64 = 1 << 40;

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
    /// Reads a sweep file and whatever it refers to.
    pub fn read(file: &Path) -> Result<SweepSpec, InputError> {
        Self::parse(file, &read_text(file)?)
    }

    /// Parses the text of a sweep file; relative paths in it start from the folder of `file`.
    pub fn parse(file: &Path, text: &str) -> Result<SweepSpec, InputError> {
        parse_sweep(file, text, &[])
    }

    /// The same; scenes that `built_in` lists, by the path that the sweep has for them, are not read from files.
    pub fn parse_with(file: &Path, text: &str, built_in: &[(&str, &str)]) -> Result<SweepSpec, InputError> {
        parse_sweep(file, text, built_in)
    }

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

    /// Names of the columns that are no derivatives.
    pub fn column_names(&self) -> Vec<String> {
        let layout = Layout::new(self, Precision::F64);
        plain_columns(layout.empty()).into_iter().map(str::to_owned).collect()
    }

    /// Samples in a part: fewer where each takes long.
    pub fn chunk(&self) -> u64 {
        match self.branch {
            BranchChoice::FromRest => CHUNK,
            BranchChoice::All => BRANCH_CHUNK,
        }
    }

    pub fn sampler(&self) -> Sampler {
        Sampler::new(self)
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

    /// The sweep as TOML that reads back to the same sweep: scene inline, SI numbers, names in full.
    ///
    /// The values of `method = "table"` are not in the text: they belong beside it, in [`RESOLVED_TABLE`].
    pub fn to_toml(&self) -> String {
        let name = |parameter: &Parameter| format!("\"{}\"", parameter.name(&self.scene));
        let list = |parameters: &[Parameter]| parameters.iter().map(name).collect::<Vec<_>>().join(", ");
        let mut text = format!("[sampling]\nmethod = \"{}\"\nseed = {}\n", self.method.name(), self.seed);
        match self.method {
            Method::Grid => {}
            Method::Table => text += &format!("file = \"{RESOLVED_TABLE}\"\n"),
            _ => text += &format!("samples = {}\n", self.sample_count),
        }
        for axis in self.axes.iter().filter(|_| self.method != Method::Table) {
            let (from, to) = (axis.from, axis.to);
            text += &format!("\n[[axis]]\nparameters = [{}]\nfrom = {from:?}\nto = {to:?}\n", list(&axis.parameters));
            if self.method == Method::Grid {
                text += &format!("points = {}\n", axis.points);
            }
        }
        text += &format!("\n[solver]\ntolerance = {:?}\nbranch = \"{}\"\n", self.tolerance, self.branch.name());
        if let Some(steps) = self.steps {
            text += &format!("steps = {steps}\n");
        }
        let quantities: Vec<_> = self.quantities.iter().map(|quantity| format!("\"{}\"", quantity.name())).collect();
        text += &format!("\n[output]\nquantities = [{}]\n", quantities.join(", "));
        text += &format!("derivatives = [{}]\nformat = \"{}\"\n", list(&self.wrt), self.format.name());
        text += &format!("\n[workspace]\nvoxel = {:?}\n\n", self.voxel);
        text + &write_inline_scene(&self.scene)
    }
}
