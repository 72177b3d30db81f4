//! The commands, as clap reads them; the arguments of each stand in its file.

use super::bench::BenchArguments;
use super::check::CheckArguments;
use super::contact::ContactArguments;
use super::control_job::ControlArguments;
use super::examples::ExamplesArguments;
use super::figures::FiguresArguments;
use super::fit::FitArguments;
use super::import::ImportArguments;
use super::manual::ManualArguments;
use super::merge::MergeArguments;
use super::new::NewArguments;
use super::parameters::ParametersArguments;
use super::run::RunArguments;
use super::sensitivity::SensitivityArguments;
use super::solve::SolveArguments;
use super::status::StatusArguments;
use super::submit::SubmitCommand;
use super::verify::VerifyArguments;
use super::view::ViewArguments;
use super::workspace::WorkspaceArguments;
use clap::{Parser, Subcommand};

/// Batched parameter sweeps of magnetic catheters and other rod-like continuum robots.
#[derive(Debug, Parser)]
#[command(name = "rodsweep", version, propagate_version = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented file to begin with: scene and sweep in one
    New(NewArguments),
    /// List the scenes and sweeps that the program brings along, or write one
    Examples(ExamplesArguments),
    /// Tell everything that is wrong with a file, or what it is and what it costs
    Check(CheckArguments),
    /// List every number of a scene: name, value, unit, meaning
    Parameters(ParametersArguments),
    /// Solve a sweep and write its result directory
    Run(RunArguments),
    /// Solve one scene with its Jacobian
    Solve(SolveArguments),
    /// Check every engine against the reference on this machine
    Verify(VerifyArguments),
    /// Speed against error on this machine: raw data, figures, a report
    Bench(BenchArguments),
    /// Tell what this machine has and what would be used
    Doctor,
    /// Tell what of a run is done, failed and left, and who works on it
    Status(StatusArguments),
    /// Write the files by which a scheduler runs a sweep on many machines
    #[command(subcommand)]
    Submit(SubmitCommand),
    /// Draw the figures of a result directory again
    Figures(FiguresArguments),
    /// Put the shards of one sweep together
    Merge(MergeArguments),
    /// Find the currents that drive the tip along a trajectory or to many targets
    Control(ControlArguments),
    /// Measure what can be reached: size with an error, boundary, dexterity
    Workspace(WorkspaceArguments),
    /// Find which force the tip can press where on a wall, held by friction
    Contact(ContactArguments),
    /// Fit rest curvature, stiffness and the like to observed shapes
    Fit(FitArguments),
    /// Find which input matters, how uncertain the tip is, and what to measure
    Sensitivity(SensitivityArguments),
    /// Show a rod that follows sliders, or the map of a result directory, in the browser
    View(ViewArguments),
    /// Make a scene of a catheter's parameter file, or a table of a play file
    Import(ImportArguments),
    /// Print licences and notices of the program and of everything that is built into it
    Licenses,
    /// Print a completion script for a shell
    Completions { shell: clap_complete::Shell },
    /// Write pages for `man`, one for each command
    Manual(ManualArguments),
}
