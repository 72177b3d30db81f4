//! The arguments of `rodsweep workspace`.

use super::engine_args::EngineArguments;
use clap::{Args, ValueEnum};
use rodsweep::input::{Dimension, parse_quantity};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct WorkspaceArguments {
    /// A result directory, or a sweep file (TOML) that need not have been run
    pub source: PathBuf,
    /// Go on with rows that are not to be trusted; what comes of them says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Where files go [default: the result directory, or results/NAME-OF-THE-SWEEP-workspace]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// First remove what an earlier workspace or run has left where files go; a file of somebody else stops it
    #[arg(long)]
    pub force: bool,
    /// Edge of a voxel, such as 1mm
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub voxel: Option<f64>,
    /// Least stability margin that counts, from 0 to 1
    #[arg(long, value_name = "MARGIN")]
    pub minimum_margin: Option<f64>,
    /// Count every stable equilibrium that continues one from rest, not only those from rest
    #[arg(long)]
    pub any_stable: bool,
    /// Only paint the voxels near rows: quick, and no voxel is proven
    #[arg(long)]
    pub fast: bool,
    /// Seed of the lattice and of all nets
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Can the tip be there? A table with columns x, y, z and perhaps tx, ty, tz, or "10 mm,-40 mm,80 mm"
    #[arg(long, value_name = "FILE|X,Y,Z", allow_hyphen_values = true)]
    pub reach: Option<String>,
    /// Which of several solutions answers a query
    #[arg(long, value_enum, default_value = "margin")]
    pub prefer: PreferenceName,
    /// What remains reachable for the designs that [[uncertain]] in the sweep describes
    #[arg(long)]
    pub robust: bool,
    /// Designs of --robust; 59 are the fewest that can show 95 % with a confidence of 95 %
    #[arg(long, value_name = "N", default_value = "64", requires = "robust")]
    pub designs: usize,
    /// A number of the design and its range, such as tube.youngs_modulus=-10%..10%:5
    #[arg(long, value_name = "NAME+NAME=LOW..HIGH:COUNT")]
    pub vary: Option<String>,
    /// Another directory with a workspace of the same voxel and seed
    #[arg(long, value_name = "DIR")]
    pub compare: Option<PathBuf>,
    /// Length by which rotations are multiplied beside positions [default: the last flexible segment]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub length: Option<f64>,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Write the voxels as a dense grid for ParaView, too
    #[arg(long)]
    pub vtk: bool,
    /// Draw nothing
    #[arg(long)]
    pub no_figures: bool,
    /// Print workspace.json and nothing else on the standard output
    #[arg(long)]
    pub json: bool,
    /// Only the size: nothing on the way, no account
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PreferenceName {
    /// The largest stability margin
    Margin,
    /// The farthest from the limits of the inputs
    Reserve,
    /// The smallest currents
    LeastCurrent,
}

/// A positive length (m), for clap.
fn length(text: &str) -> Result<f64, String> {
    match parse_quantity(text, Dimension::of("m")) {
        Ok(length) if length > 0.0 => Ok(length),
        Ok(_) => Err("give a length greater than zero, such as 1mm".into()),
        Err(error) => Err(error.to_string()),
    }
}
