//! Where the voxels of a table lie.

use super::Table;
use crate::model::Vector;

/// Cubes side by side: voxel (i, j, k) has its centre at `origin` + (i + ½, j + ½, k + ½) `spacing`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// The corner between the voxels of indices -1 and 0 (m).
    pub origin: Vector,
    /// Edge of a voxel (m).
    pub spacing: f64,
}

impl Lattice {
    /// The centre of a voxel (m).
    pub fn centre(&self, voxel: [i32; 3]) -> Vector {
        self.place(voxel.map(f64::from))
    }

    /// The voxel in which a point (m) lies; of a point too far away for its number, the outermost.
    pub fn cell(&self, point: Vector) -> [i32; 3] {
        self.floors(point).map(|share| share as i32)
    }

    fn floors(&self, point: Vector) -> [f64; 3] {
        std::array::from_fn(|k| ((point[k] - self.origin[k]) / self.spacing).floor())
    }

    /// The voxel in which a point (m) lies; `None` where no index is known.
    pub fn voxel(&self, point: Vector) -> Option<[i32; 3]> {
        let share = self.floors(point);
        share.iter().all(|x| x.abs() <= f64::from(i32::MAX)).then(|| share.map(|x| x as i32))
    }

    /// The voxel of each row of a table, by its columns `voxel.x`, `voxel.y`, `voxel.z`: any point within the voxel (m).
    /// `None` without these columns.
    pub fn voxels(&self, table: &Table) -> Option<Vec<Option<[i32; 3]>>> {
        let columns = table.vector_columns("voxel")?;
        Some((0..table.row_count()).map(|row| self.voxel(columns.map(|values| values.number(row)))).collect())
    }

    /// A point between centres (m): whole numbers are centres.
    pub fn place(&self, at: Vector) -> Vector {
        std::array::from_fn(|k| self.origin[k] + (at[k] + 0.5) * self.spacing)
    }
}
