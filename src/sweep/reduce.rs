//! Streaming reduction of a sweep: counts by status, extents, voxel occupancy, a bounded choice of tips.

use super::columns::{Column, Table, Values};
use super::sampling::Selection;
use crate::model::Status;
use std::collections::HashMap;

/// Tips kept for figures.
pub const MAX_TIPS: u64 = 262_144;

/// What is known of a workspace without its rows. Order of tables changes nothing but the order of `tips`.
#[derive(Clone, Debug)]
pub struct Reduction {
    /// Edge of a voxel [m]
    pub voxel: f64,
    /// Samples with a success status in each voxel, by floor(position / voxel).
    pub voxels: HashMap<[i32; 3], u32>,
    /// Box around the tips of success rows [m]; `None` before the first.
    pub extents: Option<[[f64; 3]; 2]>,
    /// Rows by status code.
    pub counts: [u64; Status::ALL.len()],
    /// At most `MAX_TIPS` rows, evenly chosen by index: every column but derivatives.
    pub tips: Table,
    selection: Selection,
    /// Whether voxels are wanted.
    counts_voxels: bool,
}

impl Reduction {
    pub(super) fn new(sample_count: u64, voxel: f64, counts_voxels: bool) -> Reduction {
        Reduction {
            voxel,
            voxels: HashMap::new(),
            extents: None,
            counts: [0; Status::ALL.len()],
            tips: Table::default(),
            selection: Selection::new(sample_count, MAX_TIPS, 0x7195),
            counts_voxels,
        }
    }

    /// Adds the rows of a part.
    pub(super) fn add(&mut self, table: &Table) {
        for status in table.statuses() {
            self.counts[status.code() as usize] += 1;
        }
        if let Some(position) = table.vector_columns("tip.position") {
            for (row, status) in table.statuses().iter().enumerate() {
                let p = position.map(|column| column.number(row));
                if status.is_success() && p.iter().all(|x| x.is_finite()) {
                    self.add_tip(p);
                }
            }
        }
        self.keep_rows(table);
    }

    fn add_tip(&mut self, p: [f64; 3]) {
        let [low, high] = self.extents.get_or_insert([p, p]);
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
        if self.counts_voxels {
            let count = self.voxels.entry(p.map(|x| (x / self.voxel).floor() as i32)).or_default();
            *count = count.saturating_add(1);
        }
    }

    fn keep_rows(&mut self, table: &Table) {
        if self.tips.columns.is_empty() {
            let mut kept = table.empty();
            kept.columns.retain(|column| !column.name.starts_with("d("));
            self.tips = kept;
        }
        let rows: Vec<usize> =
            (0..table.row_count()).filter(|row| self.selection.contains(table.samples()[*row])).collect();
        for kept in &mut self.tips.columns {
            if let Some(column) = table.column(&kept.name) {
                rows.iter().for_each(|row| kept.values.append_row(&column.values, *row));
            }
        }
    }

    pub fn sample_count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Occupied voxels, sorted: centre [m] and count.
    pub fn voxel_table(&self) -> Table {
        let mut cells: Vec<_> = self.voxels.iter().collect();
        cells.sort_unstable();
        let centre = |axis: usize| {
            let values = cells.iter().map(|(cell, _)| (f64::from(cell[axis]) + 0.5) * self.voxel).collect();
            let name = format!("voxel.{}", ["x", "y", "z"][axis]);
            Column { name, unit: "m".into(), values: Values::Double(values) }
        };
        let counts = cells.iter().map(|(_, count)| u64::from(**count)).collect();
        let mut columns: Vec<Column> = (0..3).map(centre).collect();
        columns.push(Column { name: "count".into(), unit: String::new(), values: Values::Index(counts) });
        Table { columns }
    }
}
