//! Where growth begins: a net over the inputs, or the rows of a run.

use super::error::WorkspaceError;
use super::inputs::WorkspaceInput;
use super::lattice::CellMap;
use super::tip_map::{Inputs, MOST_INPUTS, Tip};
use crate::model::Vector;
use crate::results::Results;
use crate::spec::SobolNet;
use crate::table::Lattice;
use crate::table::Table;

/// The first points of a scrambled Sobol' net over the inputs, scaled; `count` is a power of two.
pub(super) fn net_points(input_count: usize, count: u64, seed: u64) -> Vec<Inputs> {
    let net = SobolNet::new(input_count, seed);
    (0..count).map(|index| net_point(&net, input_count, index)).collect()
}

/// A point of a net, scaled.
pub(super) fn net_point(net: &SobolNet, input_count: usize, index: u64) -> Inputs {
    let mut point = [0.0; MOST_INPUTS];
    net.point(index, &mut point[..input_count]);
    std::array::from_fn(|k| if k < input_count { 2.0 * point[k] - 1.0 } else { 0.0 })
}

fn scaled(inputs: &[WorkspaceInput], values: &[f64]) -> Inputs {
    let mut at = [0.0; MOST_INPUTS];
    at.iter_mut().zip(inputs.iter().zip(values)).for_each(|(t, (input, value))| *t = input.scaled(*value));
    at
}

/// What is kept of the rows in one voxel.
#[derive(Clone, Copy, Debug)]
struct Touched {
    count: u32,
    /// Square of the distance of the row that is kept (m²).
    distance: f64,
    at: Inputs,
}

/// Rows of a run by voxel: as many as there are, one kept for each voxel.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    touched: CellMap<Touched>,
    /// Rows that can be used.
    pub usable: u64,
    /// All rows.
    pub seen: u64,
}

impl Rows {
    /// Reads the rows of a directory part by part; of a run without rows, the tips that it kept.
    pub(super) fn read(
        results: &Results,
        inputs: &[WorkspaceInput],
        lattice: &Lattice,
        minimum_margin: f64,
    ) -> Result<Rows, WorkspaceError> {
        let scene = &results.spec().scene;
        let names: Vec<String> = inputs.iter().map(|input| input.name(scene)).collect();
        let mut wanted: Vec<&str> = names.iter().map(String::as_str).collect();
        wanted.extend(["status", "tip.position.x", "tip.position.y", "tip.position.z"]);
        let has = |name: &str| results.columns().iter().any(|column| column.name == name);
        if let Some(name) = wanted.iter().find(|name| !has(name)) {
            return Err(WorkspaceError::NoColumn { dir: results.directory().into(), column: (*name).into() });
        }
        wanted.extend(["stability.margin", "from_rest"].into_iter().filter(|name| has(name)));
        let mut rows = Rows::default();
        if results.has_rows() {
            for part in results.parts(&wanted)? {
                rows.add(&part?, &names, inputs, lattice, minimum_margin);
            }
        } else {
            rows.add(&results.tips()?, &names, inputs, lattice, minimum_margin);
        }
        Ok(rows)
    }

    fn add(&mut self, table: &Table, names: &[String], inputs: &[WorkspaceInput], lattice: &Lattice, least: f64) {
        let Some(position) = table.vector_columns("tip.position") else { return };
        let columns: Option<Vec<_>> = names.iter().map(|name| table.column(name)).collect();
        let Some(columns) = columns else { return };
        let number = |name: &str, row: usize| table.column(name).map(|column| column.values.number(row));
        for (row, status) in table.statuses().iter().enumerate() {
            self.seen += 1;
            let tip: Vector = position.map(|column| column.number(row));
            let is_usable = status.is_success()
                && tip.iter().all(|x| x.is_finite())
                && number("stability.margin", row).is_none_or(|margin| margin >= least)
                && number("from_rest", row).is_none_or(|from_rest| from_rest == 1.0);
            if !is_usable {
                continue;
            }
            self.usable += 1;
            let cell = lattice.cell(tip);
            let centre = lattice.centre(cell);
            let distance: f64 = (0..3).map(|axis| (tip[axis] - centre[axis]).powi(2)).sum();
            let at = || {
                let values: Vec<f64> = columns.iter().map(|column| column.values.number(row)).collect();
                scaled(inputs, &values)
            };
            let touched =
                self.touched.entry(cell).or_insert_with(|| Touched { count: 0, distance: f64::INFINITY, at: at() });
            touched.count = touched.count.saturating_add(1);
            if distance < touched.distance {
                (touched.distance, touched.at) = (distance, at());
            }
        }
    }

    /// Inputs of the rows that are kept, in the order of their voxels; at most so many, evenly chosen.
    pub(super) fn starts(&self, most: usize) -> Vec<Inputs> {
        let mut cells: Vec<_> = self.touched.iter().collect();
        cells.sort_unstable_by_key(|(cell, _)| **cell);
        let every = cells.len().div_ceil(most).max(1);
        cells.into_iter().step_by(every).map(|(_, touched)| touched.at).collect()
    }

    /// Rows in each voxel.
    pub(super) fn counts(&self) -> CellMap<u32> {
        self.touched.iter().map(|(cell, touched)| (*cell, touched.count)).collect()
    }
}

/// Counts usable tips by voxel.
pub(super) fn count_tips(lattice: &Lattice, tips: &[Tip]) -> CellMap<u32> {
    let mut counts = CellMap::default();
    tips.iter().filter(|tip| tip.usable).for_each(|tip| *counts.entry(lattice.cell(tip.position)).or_default() += 1);
    counts
}

/// Good's estimate of the share of samples that fall into voxels that are known: 1 - singletons / samples.
pub(super) fn coverage(counts: &CellMap<u32>) -> f64 {
    let all: u64 = counts.values().map(|count| u64::from(*count)).sum();
    let singletons = counts.values().filter(|count| **count == 1).count();
    if all == 0 { 0.0 } else { 1.0 - singletons as f64 / all as f64 }
}
