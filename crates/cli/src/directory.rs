//! `rodsweep status` and `rodsweep merge`.

use super::{CommandError, Exit, print, say};
use rodsweep::model::Status;
use rodsweep::report::count;
use rodsweep::results::{self, DirectoryStatus, Results};
use rodsweep::spec::Format;
use std::path::{Path, PathBuf};

pub fn status(directory: &Path) -> Result<Exit, CommandError> {
    let status = Results::open(directory)?.status()?;
    print(&describe(directory, &status))?;
    Ok(if status.damaged.is_empty() { Exit::Done } else { Exit::Failed })
}

pub fn merge(directories: &[PathBuf], out: &Path) -> Result<Exit, CommandError> {
    let status = results::merge(directories, out)?;
    say(&format!(
        "merged {} samples of {} directories into {}",
        count(status.samples_done),
        directories.len(),
        out.display()
    ));
    Ok(Exit::Done)
}

fn describe(directory: &Path, status: &DirectoryStatus) -> String {
    let (place, samples) = (directory.display(), count(status.samples_done));
    let has_rows = status.record.format() != Format::None;
    let mut text = match (has_rows, status.is_complete()) {
        (true, _) => {
            format!("{place}: {} of {} parts done, {samples} samples\n", status.parts_done, status.parts_total)
        }
        (false, true) => format!("{place}: done, {samples} samples without rows\n"),
        (false, false) => format!("{place}: not done, and a run without rows keeps none before its end\n"),
    };
    if status.every_branch {
        text += &format!("every equilibrium: {} rows\n", count(status.counts.iter().sum()));
    }
    for kind in Status::ALL {
        let samples = status.counts[kind.code() as usize];
        if samples > 0 {
            text += &format!("  {:<14}{:>12}\n", kind.name(), count(samples));
        }
    }
    for (path, reason) in &status.damaged {
        text += &format!("damaged: {}: {reason}\n", path.display());
    }
    if !status.is_complete() && has_rows {
        text += &format!("left: {} parts; `rodsweep run ... --resume` goes on\n", status.missing.len());
    }
    text
}
