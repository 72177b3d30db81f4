//! The files of a workspace: account, voxels, sections, meshes, queries, designs.

use super::account::WorkspaceAccount;
use super::compare::Comparison;
use super::designs::{DesignStudy, RobustWorkspace};
use super::lattice::Cell;
use super::reach::Reach;
use super::workspace::Workspace;
use crate::results::{
    ResultsError, WORKSPACE_FILE, make_directory, place_table, verdict_metadata, write_bytes, write_table,
};
use crate::study::mesh::surface_nets;
use crate::study::witness::with_mark;
use crate::table::{Table, Triangles, ply, vtk};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Account of a workspace.
pub const ACCOUNT_FILE: &str = "workspace.json";

/// What was asked for beside the workspace itself.
#[derive(Clone, Debug, Default)]
pub struct WorkspaceExtras {
    /// Answers to queries.
    pub reach: Vec<Reach>,
    /// What uncertain designs have in common.
    pub robust: Option<RobustWorkspace>,
    /// What a number of the design does.
    pub study: Option<DesignStudy>,
    /// Beside another workspace.
    pub comparison: Option<Comparison>,
}

impl WorkspaceExtras {
    /// For a person: a few lines.
    pub fn text(&self, of: &Workspace) -> String {
        let (factor, unit) = [(1e3, "mm"), (1e3, "mm"), (1e4, "cm²"), (1e6, "cm³")][of.dimension.rank.min(3)];
        let mut lines = Vec::new();
        for answer in &self.reach {
            let [x, y, z] = answer.target.position.map(|x| 1e3 * x);
            let inputs: Vec<String> = of
                .inputs
                .iter()
                .zip(answer.inputs)
                .map(|(input, t)| format!("{} {:.5} {}", input.name(&of.scene), input.value(t), input.unit()))
                .collect();
            let target = format!("{x:.2} {y:.2} {z:.2} mm: {}", answer.status);
            let from = 1e3 * answer.boundary_distance;
            let far = if from.is_nan() { String::new() } else { format!(", {from:.2} mm from the boundary") };
            lines.push(match answer.margin.is_nan() {
                true => format!("{target}; no equilibrium near it is known"),
                false => format!("{target}{far}, margin {:.2}; {}", answer.margin, inputs.join(", ")),
            });
        }
        if let Some(robust) = &self.robust {
            let designs = robust.designs.len();
            for (share, size) in &robust.common {
                let by = match *share {
                    1.0 => "all".to_owned(),
                    0.0 => "any".to_owned(),
                    share => format!("at least {:.0} %", 100.0 * share),
                };
                lines.push(format!("reached by {by} of {designs} designs: {:.2} {unit}", factor * size));
            }
        }
        if let Some(study) = &self.study {
            for design in &study.designs {
                lines.push(format!(
                    "{} = {:.5} {}: {:.2} {unit}, 95 %: {:.2} to {:.2}",
                    study.name,
                    design.values[0],
                    study.unit,
                    factor * design.size.value,
                    factor * design.size.low,
                    factor * design.size.high
                ));
            }
            let per = if study.unit.is_empty() { "for its logarithm".into() } else { format!("per {}", study.unit) };
            lines.push(format!("slope {:.4} ± {:.4} {unit} {per}", factor * study.slope, factor * study.slope_error));
        }
        if !self.reach.is_empty() || self.robust.is_some() || self.study.is_some() {
            lines.push("answers to queries and designs were not checked against the reference".into());
        }
        if let Some(other) = &self.comparison {
            let told = format!(
                "beside the other: both {:.2} {unit}, gained {:.2}, lost {:.2}",
                factor * other.intersection,
                factor * other.gained,
                factor * other.lost
            );
            lines.push(with_mark(other.distrusted.as_deref(), told));
        }
        lines.join("\n")
    }
}

impl Workspace {
    /// Its account with what was asked for beside it, as JSON.
    pub fn json(&self, account: &WorkspaceAccount, extras: &WorkspaceExtras) -> String {
        let text = account.json();
        let mut more: Vec<(&str, Value)> = Vec::new();
        if !extras.reach.is_empty() {
            let answers = extras.reach.iter().map(|answer| {
                let inputs: Vec<f64> = self.inputs.iter().zip(answer.inputs).map(|(input, t)| input.value(t)).collect();
                json!({
                    "target": answer.target.position, "tangent": answer.target.tangent, "status": answer.status,
                    "inputs": inputs, "stability_margin": answer.margin, "input_reserve": answer.reserve,
                    "boundary_distance": answer.boundary_distance, "nearest": answer.tip,
                    "reach_probability": answer.probability, "tangent_error": answer.tangent_error,
                })
            });
            more.push(("reach", answers.collect()));
        }
        if let Some(robust) = &extras.robust {
            let common: Vec<Value> =
                robust.common.iter().map(|(share, size)| json!({ "share": share, "size": size })).collect();
            let value = json!({
                "designs": robust.designs.len(), "uncertain": robust.names, "nominal": robust.nominal,
                "reached_by_share": common,
            });
            more.push(("robust", value));
        }
        if let Some(study) = &extras.study {
            more.push(("study", serde_json::to_value(study).unwrap_or_default()));
        }
        if let Some(comparison) = &extras.comparison {
            more.push(("comparison", serde_json::to_value(comparison).unwrap_or_default()));
        }
        // The account keeps the order of its keys; what is added follows.
        let mut text = text.trim_end().trim_end_matches('}').trim_end().to_owned();
        for (name, value) in more {
            text += &format!(",\n  \"{name}\": {}", serde_json::to_string(&value).unwrap_or_default());
        }
        text + "\n}\n"
    }

    /// Writes everything into a folder, replacing what is there; returns the files.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(
        &self,
        dir: &Path,
        account: &WorkspaceAccount,
        extras: &WorkspaceExtras,
        dense: bool,
    ) -> Result<Vec<PathBuf>, ResultsError> {
        make_directory(dir)?;
        let mark = self.mark.as_deref();
        let mut written = Vec::new();
        let mut marked = |name: &str, table: &Table, mark: Option<&str>| -> Result<(), ResultsError> {
            let metadata = [
                ("rodsweep.version", env!("CARGO_PKG_VERSION").to_owned()),
                ("rodsweep.scene", self.scene.name.clone()),
                ("rodsweep.engine", self.engine.clone()),
                ("rodsweep.voxel", format!("{:e}", self.grown.lattice.spacing)),
                verdict_metadata(mark),
            ];
            let path = place_table(dir, name)?;
            write_table(&path, table, &metadata)?;
            written.push(path);
            Ok(())
        };
        if let Some(comparison) = &extras.comparison {
            marked("comparison.parquet", &comparison.table(), mark.or(comparison.distrusted.as_deref()))?;
        }
        let mut table = |name: &str, table: &Table| marked(name, table, mark);
        let voxels = self.voxel_table_with(extras.robust.as_ref());
        table(WORKSPACE_FILE, &voxels)?;
        if let Some(surface) = self.surface_table() {
            table("surface.parquet", &surface)?;
        }
        if !extras.reach.is_empty() {
            table("reach.csv", &self.reach_table(&extras.reach))?;
        }
        if let Some(robust) = &extras.robust {
            table("robust.parquet", &robust.voxel_columns(self))?;
            table("robust_designs.csv", &robust.table())?;
        }
        if let Some(study) = &extras.study {
            table("designs.csv", &study.table())?;
        }
        let mut bytes = |name: &str, bytes: Vec<u8>| -> Result<(), ResultsError> {
            let path = dir.join(name);
            write_bytes(&path, &bytes)?;
            written.push(path);
            Ok(())
        };
        if self.grown.dimension == 3 && !self.distances.is_empty() {
            let (vtp, ply) = self.meshes(&voxels).map_err(ResultsError::of_table(dir.join("boundary.vtp")))?;
            bytes("boundary.vtp", vtp)?;
            bytes("boundary.ply", ply)?;
        }
        if dense {
            let grid = vtk::image_data(&self.grown.lattice, &voxels, mark);
            bytes("workspace.vti", grid.map_err(ResultsError::of_table(dir.join("workspace.vti")))?)?;
        }
        bytes(ACCOUNT_FILE, self.json(account, extras).into_bytes())?;
        Ok(written)
    }

    /// The voxel table, with what the designs of a robust workspace say of each.
    pub fn voxel_table_with(&self, robust: Option<&RobustWorkspace>) -> Table {
        let mut table = self.voxel_table();
        let Some(robust) = robust else { return table };
        let Some(centre) = table.vector_columns("voxel") else { return table };
        let cell = |row: usize| self.grown.lattice.cell(centre.map(|column| column.number(row)));
        let cells: Vec<Cell> = (0..table.row_count()).map(cell).collect();
        table.columns.extend(robust.reach_columns(&cells));
        table
    }

    /// The boundary as triangles with the voxels' columns at their points: `.vtp` and `.ply`.
    fn meshes(&self, voxels: &Table) -> Result<(Vec<u8>, Vec<u8>), crate::table::TableError> {
        let lattice = &self.grown.lattice;
        let place = |at: usize| (self.grown.voxels[at].cell, self.distances[at]);
        let distances: HashMap<_, _> =
            (0..self.grown.voxels.len()).filter(|at| self.grown.voxels[*at].end.is_some()).map(place).collect();
        let mesh = surface_nets(&distances, lattice);
        let mut rows = HashMap::new();
        if let Some(centre) = voxels.vector_columns("voxel") {
            for row in 0..voxels.row_count() {
                rows.insert(lattice.cell(centre.map(|column| column.number(row))), row);
            }
        }
        let order: Vec<usize> = mesh.voxels.iter().filter_map(|cell| rows.get(cell).copied()).collect();
        let mut data = if order.len() == mesh.voxels.len() { voxels.select(&order) } else { Table::default() };
        data.columns.retain(|column| !column.name.starts_with("voxel.") && column.name != "reached");
        let normals = mesh.normals();
        let mark = self.mark.as_deref();
        let triangles =
            Triangles { points: &mesh.vertices, normals: &normals, triangles: &mesh.triangles, data: &data, mark };
        Ok((vtk::poly_data(&triangles)?, ply::encode(&triangles)?))
    }
}
