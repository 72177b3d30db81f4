//! The map of a result directory: points by column, statistics of a column, a row, and what a workspace left beside it.

use crate::columns::{WireColumn, WireValues, typed_columns};
use crate::error::{Refusal, ViewError};
use crate::rows::{Rows, kind};
use crate::surface::Surface;
use rodsweep::draw::{ColourMap, ColourRange};
use rodsweep::results::{Results, Verdict, WORKSPACE_FILE, find_table, read_parquet_table};
use rodsweep::spec::BranchChoice;
use rodsweep::table::{Column, Table, Values};
use serde_json::{Value, json};

/// Columns that colour the points, in order of preference, as in the figures.
const COLOURS: [&str; 2] = ["stability.margin", "error_estimate"];
/// Points of one answer.
const MOST_OF_ONE: usize = 262_144;
const SHARES: [f64; 9] = [0.0, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0];

/// A result directory on the page.
pub struct ResultMap {
    /// Its rows.
    pub rows: Rows,
    /// Its boundary, where `workspace` left one.
    pub surface: Option<Surface>,
    /// Its voxels, those that are reached, likewise.
    pub voxels: Option<Table>,
    /// Distance of neighbouring voxels (m).
    voxel_edge: Option<f64>,
    results: Results,
    verdict: Option<Verdict>,
}

impl ResultMap {
    /// Opens a directory.
    pub fn open(results: Results) -> Result<ResultMap, ViewError> {
        let rows = Rows::open(&results)?;
        let dir = results.directory();
        let surface = rodsweep::files::read(&dir.join("boundary.ply")).ok().and_then(|bytes| Surface::parse(&bytes));
        let voxels = find_table(dir, WORKSPACE_FILE)?.and_then(|path| read_parquet_table(&path).ok());
        let voxels = voxels.filter(|table| table.vector_columns("voxel").is_some());
        let voxel_edge = voxels.as_ref().and_then(voxel_edge);
        let verdict = results.verdict()?;
        Ok(ResultMap { verdict, rows, surface, voxels: voxels.as_ref().map(reached), voxel_edge, results })
    }

    /// The directory and what was swept.
    pub fn results(&self) -> &Results {
        &self.results
    }

    /// What there is to draw.
    ///
    /// # Errors
    ///
    /// Parts that cannot be read any more.
    pub fn describe(&self) -> Result<Value, Refusal> {
        let spec = self.results.spec();
        let column = |column: &Column| {
            json!({ "name": column.name, "unit": column.unit, "kind": kind(column),
                    "derivative": column.name.starts_with("d(") })
        };
        let columns: Vec<Value> = self.rows.columns().iter().map(column).collect();
        let inputs: Vec<String> =
            spec.axis_parameters().iter().flatten().map(|parameter| parameter.name(&spec.scene)).collect();
        let words = |table: &Table| table.columns.iter().map(column).collect::<Vec<Value>>();
        Ok(json!({
            "rows": self.rows.row_count(),
            "points": self.rows.point_count(),
            "samples": self.results.record().sample_count,
            "has_rows": self.results.has_rows(),
            "columns": columns,
            "inputs": inputs,
            "colour": self.default_colour(),
            "statuses": rodsweep::model::Status::ALL.map(|status| json!({
                "name": status.name(), "success": status.is_success(), "converged": status.is_converged() })),
            "surface": self.surface.is_some(),
            "voxels": self.voxels.as_ref().map(words),
            "voxel": self.voxel_edge,
            "wrong_rows": self.wrong_rows(),
        }))
    }

    /// Rows that the check of the run found wrong; none where a sample has several rows.
    fn wrong_rows(&self) -> Vec<u64> {
        let is_one_each = self.results.spec().branch == BranchChoice::FromRest && self.results.has_rows();
        let seen = self.verdict.iter().flat_map(Verdict::seen);
        if is_one_each { seen.collect() } else { Vec::new() }
    }

    /// What speaks against the rows, in a sentence and in full; `None`: nothing does.
    pub fn distrust(&self) -> Option<(String, String)> {
        let verdict = self.verdict.as_ref()?;
        Some((verdict.headline()?, self.results.distrust().ok().flatten().unwrap_or_default()))
    }

    /// Column that colours the points at first.
    pub fn default_colour(&self) -> String {
        let columns = self.rows.columns();
        let known = COLOURS.iter().find(|name| columns.iter().any(|column| column.name == **name));
        known.map(|name| (*name).to_owned()).or(columns.get(1).map(|column| column.name.clone())).unwrap_or_default()
    }

    /// Columns of the points from one place of the order on. `row` is the number of the row, `status` its code.
    ///
    /// # Errors
    ///
    /// A column that is not there, or a part that cannot be read any more.
    pub fn points(&self, names: &[String], from: usize, count: usize) -> Result<Vec<u8>, Refusal> {
        if names.is_empty() {
            return Err(Refusal::wrong("`columns` is missing"));
        }
        let end = from.saturating_add(count.min(MOST_OF_ONE)).min(self.rows.point_count());
        let range = from.min(end)..end;
        let column = |name: &String| {
            let values = match name.as_str() {
                "row" => WireValues::Index(self.rows.order()[range.clone()].to_vec()),
                "status" => {
                    WireValues::Code(self.rows.column(name)?[range.clone()].iter().map(|code| *code as u8).collect())
                }
                _ => WireValues::Single(self.rows.column(name)?[range.clone()].to_vec()),
            };
            Ok(WireColumn { name: name.clone(), unit: self.unit(name), values })
        };
        typed_columns(&names.iter().map(column).collect::<Result<Vec<_>, Refusal>>()?)
    }

    fn unit(&self, name: &str) -> String {
        self.rows
            .columns()
            .iter()
            .find(|column| column.name == name)
            .map(|column| column.unit.clone())
            .unwrap_or_default()
    }

    /// Range of the colours of a column, as in the figures, and its percentiles, over successful rows.
    ///
    /// # Errors
    ///
    /// As [`ResultMap::points`].
    pub fn column(&self, name: &str) -> Result<Value, Refusal> {
        let values = self.rows.column(name)?;
        let usable = self.rows.successes()?;
        let pairs = values.iter().zip(&usable);
        let shown = pairs.filter(|(_, is_usable)| **is_usable).map(|(value, _)| f64::from(*value));
        Ok(statistics(name, &self.unit(name), shown))
    }

    /// The same of a column of the voxels.
    ///
    /// # Errors
    ///
    /// As [`ResultMap::voxels`].
    pub fn voxel_column(&self, name: &str) -> Result<Value, Refusal> {
        let column = voxel_column(self.known_voxels()?, name)?;
        Ok(statistics(name, &column.unit, column.values.numbers()))
    }

    fn known_voxels(&self) -> Result<&Table, Refusal> {
        self.voxels.as_ref().ok_or_else(|| Refusal::absent("no voxels: run `rodsweep workspace` on it"))
    }

    /// A row with all its digits: names, units, values; null for none.
    ///
    /// # Errors
    ///
    /// As [`ResultMap::points`].
    pub fn row(&self, row: u64) -> Result<Value, Refusal> {
        let table = self.rows.row(row)?;
        let cell =
            |column: &Column| json!({ "name": column.name, "unit": column.unit, "value": value(&column.values) });
        Ok(json!({ "row": row, "cells": table.columns.iter().map(cell).collect::<Vec<Value>>() }))
    }

    /// Voxels: centres, and one column.
    ///
    /// # Errors
    ///
    /// No voxels, or no such column.
    pub fn voxels(&self, name: &str) -> Result<Vec<u8>, Refusal> {
        let table = self.known_voxels()?;
        let mut columns = Vec::new();
        for name in ["voxel.x", "voxel.y", "voxel.z", name] {
            let column = voxel_column(table, name)?;
            let values = (0..table.row_count()).map(|row| column.values.number(row) as f32).collect();
            columns.push(WireColumn::single(name, &column.unit, values));
        }
        typed_columns(&columns)
    }
}

fn voxel_column<'a>(voxels: &'a Table, name: &str) -> Result<&'a Column, Refusal> {
    voxels.column(name).ok_or_else(|| Refusal::absent(format!("no column `{name}`")))
}

/// Range of the colours of finite values, as in the figures, and percentiles.
fn statistics(name: &str, unit: &str, values: impl IntoIterator<Item = f64>) -> Value {
    let mut shown: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    let Some(range) = ColourRange::of(shown.iter().copied()) else {
        return json!({ "name": name, "unit": unit, "count": 0 });
    };
    shown.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| shown[(share * (shown.len() - 1) as f64).round() as usize];
    json!({
        "name": name,
        "unit": unit,
        "count": shown.len(),
        "map": if range.map == ColourMap::Diverging { "diverging" } else { "sequential" },
        "low": range.low,
        "high": range.high,
        "clipped": range.clipped,
        "shares": SHARES,
        "percentiles": SHARES.map(at),
    })
}

fn voxel_edge(voxels: &Table) -> Option<f64> {
    let mut edge = f64::INFINITY;
    for values in voxels.vector_columns("voxel")? {
        let mut at: Vec<f64> = values.numbers();
        at.sort_unstable_by(f64::total_cmp);
        let steps = at.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-9);
        edge = steps.fold(edge, f64::min);
    }
    edge.is_finite().then_some(edge)
}

/// Those voxels that are part of the workspace.
fn reached(voxels: &Table) -> Table {
    let reached = voxels.column("reached");
    let is_reached = |row: &usize| reached.is_none_or(|column| column.values.number(*row) == 1.0);
    voxels.select(&(0..voxels.row_count()).filter(is_reached).collect::<Vec<_>>())
}

fn value(values: &Values) -> Value {
    match values {
        Values::Index(values) => json!(values.first()),
        Values::Status(values) => json!(values.first().map(|status| status.name())),
        Values::Text(values) => json!(values.first()),
        Values::Flag(values) => json!(values.first().copied().flatten()),
        other if other.is_empty() => Value::Null,
        other => json!(other.number(0)),
    }
}
