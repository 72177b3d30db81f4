//! Streaming reduction of a sweep: counts by status, extents, voxel occupancy, a bounded choice of tips.

use super::layout::{BALANCED_COLUMN, BRANCH_COLUMN};
use super::manifest::Manifest;
use super::outcome::BranchCounts;
use crate::model::Status;
use crate::spec::Selection;
use crate::table::{Column, Table};
use foldhash::fast::FixedState;
use std::collections::HashMap;

/// Tips kept for figures.
pub const MAX_TIPS: u64 = 262_144;

/// Rows that are no success; where every equilibrium was asked for, an unstable one is none of them.
pub(crate) fn failures(counts: &[u64; Status::ALL.len()], every_branch: bool) -> u64 {
    let fails = |status: &Status| if every_branch { !status.is_converged() } else { !status.is_success() };
    Status::ALL.into_iter().filter(fails).map(|status| counts[status.code() as usize]).sum()
}

/// What is known of a workspace without its rows. Order of tables changes nothing but the order of `tips`.
#[derive(Clone, Debug)]
pub struct Reduction {
    /// Edge of a voxel (m)
    pub voxel: f64,
    /// Rows with a success status in each voxel, by floor(position / voxel).
    pub voxels: HashMap<[i32; 3], u32, FixedState>,
    /// Box around the tips of success rows (m); `None` before the first.
    pub extents: Option<[[f64; 3]; 2]>,
    /// Rows by status code.
    pub counts: [u64; Status::ALL.len()],
    /// Samples added.
    pub sample_count: u64,
    /// Where every equilibrium was asked for.
    pub branches: Option<BranchCounts>,
    /// The rows of at most `MAX_TIPS` samples, evenly chosen by index: every column but derivatives.
    pub tips: Table,
    selection: Selection,
    /// Whether voxels are wanted.
    counts_voxels: bool,
}

impl Reduction {
    pub(crate) fn new(sample_count: u64, voxel: f64, counts_voxels: bool) -> Reduction {
        Reduction {
            voxel,
            voxels: HashMap::default(),
            extents: None,
            counts: [0; Status::ALL.len()],
            sample_count: 0,
            branches: None,
            tips: Table::default(),
            selection: Selection::new(sample_count, MAX_TIPS, 0x7195),
            counts_voxels,
        }
    }

    /// Adds the rows of a part.
    pub(crate) fn add(&mut self, table: &Table) {
        for status in table.statuses() {
            self.counts[status.code() as usize] += 1;
        }
        self.sample_count += table.sample_count();
        if let (Some(numbers), Some(balanced)) = (table.column(BRANCH_COLUMN), table.column(BALANCED_COLUMN)) {
            let counts = self.branches.get_or_insert_default();
            for (row, status) in table.statuses().iter().enumerate() {
                let number = numbers.values.number(row) as u64;
                counts.most = counts.most.max(number + u64::from(status.is_converged()));
                counts.unbalanced += u64::from(number == 0 && balanced.values.number(row) == 0.0);
            }
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

    /// Adds a sample without a row, and its tip where it has one.
    pub(crate) fn add_sample(&mut self, status: Status, tip: Option<[f64; 3]>) {
        self.counts[status.code() as usize] += 1;
        self.sample_count += 1;
        if let Some(p) = tip.filter(|p| status.is_success() && p.iter().all(|x| x.is_finite())) {
            self.add_tip(p);
        }
    }

    /// Adds samples that the engine has counted, as `Ok` and as `Ramped`; their voxels follow.
    pub(crate) fn add_counted(&mut self, [ok, ramped]: [u64; 2]) {
        self.counts[Status::Ok.code() as usize] += ok;
        self.counts[Status::Ramped.code() as usize] += ramped;
        self.sample_count += ok + ramped;
    }

    pub(crate) fn add_voxels(&mut self, voxels: HashMap<[i32; 3], u32>) {
        for (cell, more) in voxels {
            let count = self.voxels.entry(cell).or_default();
            *count = count.saturating_add(more);
        }
    }

    /// Puts the kept rows in the order of their samples.
    pub(crate) fn sort_tips(&mut self) {
        let mut order: Vec<usize> = (0..self.tips.row_count()).collect();
        order.sort_by_key(|row| self.tips.samples().get(*row));
        self.tips = self.tips.select(&order);
    }

    /// What a run without rows has kept.
    pub(crate) fn restore(&mut self, tips: Table, voxels: &Table, manifest: &Manifest) {
        for status in Status::ALL {
            self.counts[status.code() as usize] = manifest.count(status);
        }
        if let Some(run) = &manifest.run {
            self.sample_count = run.samples_of_shard;
            self.extents = run.extents;
            self.branches = run.branches;
        }
        if let (Some(centre), Some(count)) = (voxels.vector_columns("voxel"), voxels.column("count")) {
            for row in 0..voxels.row_count() {
                let cell = centre.map(|column| (column.number(row) / self.voxel).floor() as i32);
                self.voxels.insert(cell, count.values.number(row) as u32);
            }
        }
        self.tips = tips;
    }

    /// Samples whose rows are kept.
    pub(crate) fn selection(&self) -> Selection {
        self.selection
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

    /// Keeps those rows of a table that are chosen, and counts none.
    pub(crate) fn keep_rows(&mut self, table: &Table) {
        if self.tips.columns.is_empty() {
            let mut kept = table.empty();
            kept.columns.retain(|column| !column.name.starts_with("d("));
            kept.reserve(self.selection.len() as usize);
            self.tips = kept;
        }
        let chosen = |row: &usize| self.selection.contains(table.samples()[*row]);
        let rows: Option<Vec<usize>> =
            (!self.selection.is_everything()).then(|| (0..table.row_count()).filter(chosen).collect());
        for kept in &mut self.tips.columns {
            match (table.column(&kept.name), &rows) {
                (Some(column), Some(rows)) => kept.values.append_rows(&column.values, rows),
                (Some(column), None) => kept.values.append(&column.values),
                (None, _) => {}
            }
        }
    }

    /// Rows that were counted, of any status.
    pub fn row_count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Rows that are no success; where every equilibrium was asked for, samples without any.
    pub fn failed(&self) -> u64 {
        failures(&self.counts, self.branches.is_some())
    }

    /// Occupied voxels, sorted: centre (m) and count.
    pub fn voxel_table(&self) -> Table {
        let mut cells: Vec<_> = self.voxels.iter().collect();
        cells.sort_unstable();
        let centre = |axis: usize| {
            let values: Vec<f64> = cells.iter().map(|(cell, _)| (f64::from(cell[axis]) + 0.5) * self.voxel).collect();
            Column::new(format!("voxel.{}", ["x", "y", "z"][axis]), "m", values)
        };
        let counts: Vec<u64> = cells.iter().map(|(_, count)| u64::from(**count)).collect();
        let mut columns: Vec<Column> = (0..3).map(centre).collect();
        columns.push(Column::new("count", "", counts));
        Table::new(columns)
    }
}
