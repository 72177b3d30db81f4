//! Two workspaces on one lattice: what both reach, what was gained, what was lost.

use super::error::WorkspaceError;
use super::lattice::{Cell, CellMap};
use super::workspace::Workspace;
use crate::model::Vector;
use crate::results::{WORKSPACE_FILE, find_table, read_mark, read_parquet_table};
use crate::study::columns::Columns;
use crate::table::Table;
use serde::Serialize;
use std::path::Path;

/// Centres may differ by so much of an edge, from the digits of a file.
const SAME: f64 = 1e-6;

/// What this workspace has and another has not, as sizes (m³; of surfaces, voxels touched times h²).
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Reached by one or the other.
    pub union: f64,
    /// Reached by both.
    pub intersection: f64,
    /// Reached by one alone.
    pub symmetric_difference: f64,
    /// Reached here alone.
    pub gained: f64,
    /// Reached there alone.
    pub lost: f64,
    /// The doubt about the other workspace.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distrusted: Option<String>,
    /// Each voxel of either: 0 both, 1 gained, 2 lost.
    #[serde(skip)]
    pub voxels: Vec<(Vector, u8)>,
}

/// The doubt about the workspace of a directory that its `workspace.parquet` holds; `None`: there is no doubt, or no such file.
///
/// # Errors
///
/// A file that cannot be read.
pub fn workspace_mark(dir: &Path) -> Result<Option<String>, WorkspaceError> {
    Ok(find_table(dir, WORKSPACE_FILE)?.map(|path| read_mark(&path)).transpose()?.flatten())
}

impl Workspace {
    /// Compares with the `workspace.parquet` of another directory, which may be marked: see [`workspace_mark`].
    ///
    /// # Errors
    ///
    /// A directory without one, or one of another lattice.
    pub fn compare(&self, dir: &Path) -> Result<Comparison, WorkspaceError> {
        let there = find_table(dir, WORKSPACE_FILE)?;
        let path = there.clone().unwrap_or_else(|| dir.join(WORKSPACE_FILE));
        let wrong = |problem: &str| WorkspaceError::Compare { path: path.clone(), problem: problem.into() };
        if there.is_none() {
            return Err(wrong("there is no such file: measure that workspace first, with the same voxel and seed"));
        }
        let table = read_parquet_table(&path)?;
        let (Some(centre), Some(reached)) = (table.vector_columns("voxel"), table.column("reached")) else {
            return Err(wrong("it holds voxels that were touched, not reached: measure that workspace first"));
        };
        let lattice = &self.grown.lattice;
        let mut theirs: CellMap<()> = CellMap::default();
        for row in 0..table.row_count() {
            let point: Vector = centre.map(|column| column.number(row));
            let cell = lattice.cell(point);
            let there = lattice.centre(cell);
            if (0..3).any(|axis| (there[axis] - point[axis]).abs() > SAME * lattice.spacing) {
                return Err(wrong("its voxels lie elsewhere: measure both with the same voxel and seed"));
            }
            if reached.values.number(row) == 1.0 {
                theirs.insert(cell, ());
            }
        }
        let ours = |cell: &Cell| self.grown.voxel(*cell).is_some_and(|voxel| voxel.is_reached());
        let mut cells: Vec<Cell> = theirs.keys().copied().filter(|cell| !ours(cell)).collect();
        cells.extend(self.grown.reached().map(|at| self.grown.voxels[at].cell));
        cells.sort_unstable();
        let state = |cell: &Cell| match (ours(cell), theirs.contains_key(cell)) {
            (true, true) => 0,
            (true, false) => 1,
            _ => 2,
        };
        let voxels: Vec<(Vector, u8)> = cells.iter().map(|cell| (lattice.centre(*cell), state(cell))).collect();
        let unit = lattice.spacing.powi(self.grown.dimension as i32);
        let size = |wanted: &[u8]| unit * voxels.iter().filter(|(_, state)| wanted.contains(state)).count() as f64;
        Ok(Comparison {
            union: size(&[0, 1, 2]),
            intersection: size(&[0]),
            symmetric_difference: size(&[1, 2]),
            gained: size(&[1]),
            lost: size(&[2]),
            distrusted: workspace_mark(dir)?,
            voxels,
        })
    }
}

impl Comparison {
    /// One row a voxel: centre and `both`, `gained` or `lost`.
    pub fn table(&self) -> Table {
        let mut columns = Columns::default();
        columns.vectors("voxel", "m", &self.voxels.iter().map(|(centre, _)| *centre).collect::<Vec<Vector>>());
        let word = |state: u8| ["both", "gained", "lost"][usize::from(state)].to_owned();
        columns.words("change", self.voxels.iter().map(|(_, state)| word(*state)));
        columns.finish()
    }
}
