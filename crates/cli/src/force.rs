//! `--force`: what an earlier run has left in a directory gives way, and nothing else does.

use super::{CommandError, say};
use rodsweep::files::is_taken;
use rodsweep::results::{is_url, remove_run};
use std::path::Path;

/// Files that studies and figures write beside the parts of a run.
const FILES: [&str; 61] = [
    "boundary.ply",
    "boundary.vtp",
    "branches.png",
    "branches.svg",
    "chaos.csv",
    "comparison.parquet",
    "compliance.png",
    "compliance.svg",
    "convergence.png",
    "convergence.svg",
    "density.png",
    "density.svg",
    "design.csv",
    "designs.csv",
    "designs.png",
    "designs.svg",
    "dexterity.png",
    "dexterity.svg",
    "dgsm.csv",
    "failures.csv",
    "failures.png",
    "failures.svg",
    "first_order.png",
    "first_order.svg",
    "fisher.csv",
    "identification.png",
    "identification.svg",
    "indices.csv",
    "indices.png",
    "indices.svg",
    "local.csv",
    "margin.png",
    "margin.svg",
    "moments.csv",
    "multiplicity.png",
    "multiplicity.svg",
    "reach.csv",
    "robust.parquet",
    "robust.png",
    "robust.svg",
    "robust_designs.csv",
    "scatter.png",
    "scatter.svg",
    "sensitivity.json",
    "slopes.png",
    "slopes.svg",
    "statuses.png",
    "statuses.svg",
    "surface.parquet",
    "tips.png",
    "tips.svg",
    "touched.parquet",
    "workspace.csv",
    "workspace.json",
    "workspace.parquet",
    "workspace.png",
    "workspace.svg",
    "workspace.vti",
    "projection.png",
    "projection.svg",
    "jumps.csv",
];

/// Empties a directory of a run and its studies.
pub fn clear(directory: &Path) -> Result<(), CommandError> {
    if is_url(directory) || is_taken(directory) {
        remove_run(directory, &FILES)?;
        say(&format!("note: what {} held of an earlier run gives way", directory.display()));
    }
    Ok(())
}
