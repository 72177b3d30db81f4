//! The whole shape as an output: points along the rod of every row, as columns beside those that the run has written.

use super::SensitivityError;
use super::inputs::slope_name;
use crate::model::{Parameter, Vector};
use crate::reference::Pose;
use crate::spec::SweepSpec;
use crate::study::rod_points::RodPoints;
use crate::table::{Column, Table};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Points along the rod, all of them as one output.
pub(super) const SHAPE: &str = "shape";
const BASE_MOMENT: &str = "base_moment";
const AXES: [&str; 3] = ["x", "y", "z"];
/// Points unless a number is given, and at most.
const POINTS: usize = 10;
const MOST_POINTS: usize = 1000;
/// Rows whose points are worked out at a time: it bounds the memory.
const ROWS: usize = 2048;

/// Whether an output is the shape, `shape` or `shape:20`.
pub(super) fn is_shape(name: &str) -> bool {
    name == SHAPE || name.strip_prefix(SHAPE).is_some_and(|rest| rest.starts_with(':'))
}

/// Points that outputs ask for: `shape` and `shape.3` ten, `shape:20` twenty.
pub(super) fn points_asked(outputs: &[String]) -> Result<Option<usize>, SensitivityError> {
    let mut found = None;
    for rest in outputs.iter().filter_map(|name| name.strip_prefix(SHAPE)) {
        match rest.strip_prefix(':') {
            Some(count) => {
                let count = count.trim().parse().ok().filter(|count| (1..=MOST_POINTS).contains(count));
                let asked = rest.to_owned();
                found = Some(count.ok_or(SensitivityError::ShapePoints { asked, most: MOST_POINTS })?);
            }
            None if rest.is_empty() || rest.starts_with('.') => found = found.or(Some(POINTS)),
            None => {}
        }
    }
    Ok(found)
}

/// `shape.3.x` as the point's place from 0 and the axis.
pub(super) fn place(scalar: &str) -> Option<(usize, usize)> {
    let (point, axis) = scalar.strip_prefix(SHAPE)?.strip_prefix('.')?.split_once('.')?;
    let point: usize = point.parse().ok()?;
    Some((point.checked_sub(1)?, AXES.iter().position(|name| *name == axis)?))
}

/// How the points follow from rows.
pub(super) struct Shapes {
    points: RodPoints,
    count: usize,
    /// Columns of the values that are varied.
    values: Vec<String>,
    /// Names of what there are slopes by.
    wrt: Vec<String>,
}

impl Shapes {
    /// What the outputs ask for; `None` where no shape is asked for.
    pub fn new(spec: &SweepSpec, outputs: &[String], columns: &[Column]) -> Result<Option<Shapes>, SensitivityError> {
        let Some(count) = points_asked(outputs)? else { return Ok(None) };
        if spec.scene.wall.is_some() {
            return Err(SensitivityError::ShapeBesideWall);
        }
        if !columns.iter().any(|column| column.name == format!("{BASE_MOMENT}.x")) {
            return Err(SensitivityError::NoBaseMoments);
        }
        let axes = spec.axis_parameters();
        let mut wrt: Vec<Parameter> = axes.concat();
        wrt.extend(spec.uncertain.iter().flat_map(|axis| axis.parameters.iter().copied()));
        wrt.sort_by_key(|parameter| parameter.name(&spec.scene));
        wrt.dedup();
        let name = |parameter: &Parameter| parameter.name(&spec.scene);
        Ok(Some(Shapes {
            points: RodPoints::new(&spec.scene, &axes, &wrt, count)?,
            count,
            values: axes.iter().map(|parameters| name(&parameters[0])).collect(),
            wrt: wrt.iter().map(name).collect(),
        }))
    }

    /// The columns that are added, without rows.
    pub fn columns(&self) -> Vec<Column> {
        self.table(&[])
    }

    /// The columns to be read: those of these that are not added, and those that the points follow from.
    pub fn read(&self, names: &[String]) -> Vec<String> {
        let added: BTreeSet<String> = self.columns().into_iter().map(|column| column.name).collect();
        let moments = AXES.iter().map(|axis| format!("{BASE_MOMENT}.{axis}"));
        let own = names.iter().filter(|name| !added.contains(*name)).cloned();
        let mut names: Vec<String> = own.chain(self.values.iter().cloned()).chain(moments).collect();
        names.sort();
        names.dedup();
        names
    }

    /// The rows with the points of each, some at a time.
    pub fn each(&self, rows: &Table, mut take: impl FnMut(&Table)) {
        let all: Vec<usize> = (0..rows.row_count()).collect();
        for some in all.chunks(ROWS) {
            let mut rows = rows.select(some);
            let added = self.added(&rows);
            rows.columns.extend(added);
            take(&rows);
        }
    }

    fn added(&self, rows: &Table) -> Vec<Column> {
        let moments = rows.vector_columns(BASE_MOMENT);
        let values: Vec<Vec<f64>> = self.values.iter().map(|name| rows.numbers(name).unwrap_or_default()).collect();
        let batch = self.points.batch(rows.row_count(), |row, to| {
            to.iter_mut().zip(&values).for_each(|(to, values)| *to = values[row]);
        });
        let of = |row: usize| {
            let m0: Vector = moments?.map(|column| column.number(row));
            self.points.of(&batch, row, m0)
        };
        let points: Vec<Option<Vec<Pose>>> = (0..rows.row_count()).into_par_iter().map(of).collect();
        self.table(&points)
    }

    fn table(&self, rows: &[Option<Vec<Pose>>]) -> Vec<Column> {
        let mut columns = Vec::new();
        for (k, axis) in (0..self.count).flat_map(|k| (0..3).map(move |axis| (k, axis))) {
            let name = format!("{SHAPE}.{}.{}", k + 1, AXES[axis]);
            let column = |of: &dyn Fn(&Pose) -> f64| -> Vec<f64> {
                rows.iter().map(|points| points.as_ref().map_or(f64::NAN, |points| of(&points[k]))).collect()
            };
            columns.push(Column::new(name.clone(), "m", column(&|point| point.position[axis])));
            for (j, wrt) in self.wrt.iter().enumerate() {
                let slopes = column(&|point| point.derivatives[j].dp[axis]);
                columns.push(Column::new(slope_name(&name, wrt), "", slopes));
            }
        }
        columns
    }
}
