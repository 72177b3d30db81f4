//! `--force`: what an earlier run has left in a directory gives way, and nothing else does.

use super::{CommandError, say};
use rodsweep::files::is_taken;
use rodsweep::results::{is_url, remove_run};
use std::path::Path;

/// Files that studies write beside the parts of a run.
const FILES: [&str; 23] = [
    "boundary.ply",
    "boundary.vtp",
    "chaos.csv",
    "comparison.parquet",
    "contact.json",
    "contact.parquet",
    "design.csv",
    "designs.csv",
    "dgsm.csv",
    "failures.csv",
    "fisher.csv",
    "indices.csv",
    "local.csv",
    "moments.csv",
    "reach.csv",
    "robust.parquet",
    "robust_designs.csv",
    "sensitivity.json",
    "surface.parquet",
    "touched.parquet",
    "workspace.json",
    "workspace.parquet",
    "workspace.vti",
];
/// Names of figures of runs and studies, each as PNG or SVG.
const FIGURES: [&str; 21] = [
    "angle",
    "branches",
    "compliance",
    "convergence",
    "density",
    "designs",
    "dexterity",
    "failures",
    "first_order",
    "force",
    "friction",
    "identification",
    "indices",
    "margin",
    "multiplicity",
    "robust",
    "scatter",
    "slopes",
    "statuses",
    "tips",
    "workspace",
];

/// Empties a directory of a run and its studies.
pub fn clear(directory: &Path) -> Result<(), CommandError> {
    if is_url(directory) || is_taken(directory) {
        let figures: Vec<String> =
            FIGURES.iter().flat_map(|name| ["png", "svg"].map(|extension| format!("{name}.{extension}"))).collect();
        let names: Vec<&str> = FILES.into_iter().chain(figures.iter().map(String::as_str)).collect();
        remove_run(directory, &names)?;
        say(&format!("note: what {} held of an earlier run gives way", directory.display()));
    }
    Ok(())
}
