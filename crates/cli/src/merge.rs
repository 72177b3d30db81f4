//! `rodsweep merge`: the shards of one sweep, put together.

use super::{CommandError, Exit, say, verdict};
use clap::Args;
use rodsweep::draw::count;
use rodsweep::results::{self, Results};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct MergeArguments {
    /// Result directories of the shards
    #[arg(required = true, value_name = "DIR")]
    pub directories: Vec<PathBuf>,
    /// Directory of the whole
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Exit with 0 although rows are not to be trusted
    #[arg(long)]
    pub accept_distrusted: bool,
}

pub fn merge(arguments: &MergeArguments) -> Result<Exit, CommandError> {
    let MergeArguments { directories, out, accept_distrusted } = arguments;
    let status = results::merge(directories, out)?;
    let distrust = verdict::of_results(&Results::open(out)?, *accept_distrusted)?;
    say(&format!(
        "merged {} samples of {} directories into {}",
        count(status.samples_done),
        directories.len(),
        out.display()
    ));
    Ok(distrust.unwrap_or(Exit::Done))
}
