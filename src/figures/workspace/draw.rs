//! The figures of a measured workspace.

use super::sheets::write_both;
use super::{DesignStudy, Method, MethodPoint, WorkspaceFigures, WorkspaceSummary};
use crate::draw::ReportError;
use crate::figures::files::Drawn;
use crate::figures::wall::still_wall;
use crate::study::workspace::{Convergence, Workspace, WorkspaceExtras};
use std::path::Path;

/// Draws everything that is known into a folder, as PNG and SVG. What has nothing to draw is left out.
///
/// # Errors
///
/// A figure that cannot be written.
pub fn draw_workspace(
    found: &Workspace,
    extras: &WorkspaceExtras,
    convergence: &[Convergence],
    folder: &Path,
) -> Result<Drawn, ReportError> {
    let title = if found.scene.name.is_empty() { "Workspace".to_owned() } else { found.scene.name.clone() };
    let summary = WorkspaceSummary {
        title: title.clone(),
        dimension: found.grown.dimension,
        size: found.size(),
        methods: methods(convergence),
        wall: still_wall(&found.scene, found.inputs.iter().flat_map(|input| input.parameters.iter().copied())),
        reference: None,
    };
    let lattice = found.grown.lattice;
    let table = found.voxel_table();
    let drawn = WorkspaceFigures { table: &table, lattice, summary: &summary };
    let mut drawn = drawn.draw_marked(folder, found.mark.as_deref())?;
    if let Some(robust) = &extras.robust {
        // Voxels that only other designs reach belong to this figure alone.
        let only = WorkspaceSummary { methods: Vec::new(), size: None, ..summary.clone() };
        let table = robust.voxel_columns(found);
        for (name, figure) in (WorkspaceFigures { table: &table, lattice, summary: &only }).figures() {
            if name == "robust" {
                write_both(&mut drawn, (name, figure.as_ref()), folder, found.mark.as_deref())?;
            }
        }
    }
    if let Some(study) = &extras.study {
        let figure = DesignStudy {
            title,
            dimension: found.grown.dimension,
            name: study.name.clone(),
            unit: study.unit.into(),
            values: study.designs.iter().map(|design| design.values[0]).collect(),
            sizes: study.designs.iter().map(|design| design.size).collect(),
            slope: (!study.unit.is_empty() || study.designs.len() > 2).then_some([study.slope, study.slope_error]),
            margins: [0.01, 0.05, 0.5]
                .into_iter()
                .enumerate()
                .map(|(k, share)| (share, study.designs.iter().map(|design| design.margin[k]).collect()))
                .collect(),
        };
        write_both(&mut drawn, ("designs", &figure), folder, found.mark.as_deref())?;
    }
    Ok(drawn)
}

fn methods(convergence: &[Convergence]) -> Vec<Method> {
    let mut methods: Vec<Method> = Vec::new();
    for row in convergence {
        let point = MethodPoint { spacing: row.edge, solves: row.solves, size: row.size };
        match methods.iter_mut().find(|method| method.name == row.method) {
            Some(method) => method.points.push(point),
            None => methods.push(Method { name: row.method.into(), points: vec![point] }),
        }
    }
    methods
}
