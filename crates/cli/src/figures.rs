//! `rodsweep figures`: the figures of a result directory, drawn again.

use super::{CommandError, Exit, run, say, verdict};
use clap::Args;
use rodsweep::figures::RunFigures;
use rodsweep::results::Results;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct FiguresArguments {
    /// A result directory
    pub directory: PathBuf,
    /// Column that colours the tip cloud, for example stability.margin or coil.current.z
    #[arg(long, value_name = "COLUMN")]
    pub colour: Option<String>,
    /// Go on with rows that are not to be trusted; every figure says so
    #[arg(long)]
    pub accept_distrusted: bool,
}

pub fn figures(arguments: &FiguresArguments) -> Result<Exit, CommandError> {
    let FiguresArguments { directory, colour, accept_distrusted } = arguments;
    let results = Results::open(directory)?;
    if let Some(exit) = verdict::of_results(&results, *accept_distrusted)? {
        return Ok(exit);
    }
    let drawn = RunFigures::new().colour(colour.as_deref()).drawn(&results, directory)?;
    run::tell_figures(drawn, &say);
    Ok(Exit::Done)
}
