//! The rows of a result directory, for drawing: columns on demand in single precision, in a shuffled order; one row whole.

use crate::error::{Refusal, ViewError};
use rodsweep::model::Status;
use rodsweep::results::{Results, ResultsError};
use rodsweep::spec::permute;
use rodsweep::table::{Column, Table, Values};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Most rows that are drawn; more are thinned fairly.
pub const MOST_POINTS: u64 = 4_000_000;
/// Columns that are kept in memory, 16 MB each at most.
const MOST_KEPT: usize = 24;
/// Tells the order of the points from other permutations.
const ORDER: u64 = 0x7669_6577;

/// A part and what of it is drawn.
struct Part {
    number: u64,
    /// Of the part, over all rows.
    first: u64,
    /// Row of the part, and its place among the points.
    chosen: Vec<(u32, u32)>,
}

enum Source {
    Parts(Vec<Part>),
    /// Tips that a run without rows has kept.
    Tips(Table),
}

/// Rows that can be drawn.
pub struct Rows {
    results: Results,
    source: Source,
    columns: Vec<Column>,
    /// Of the directory.
    row_count: u64,
    /// Row of each point.
    order: Vec<u32>,
    kept: Mutex<HashMap<String, Arc<Vec<f32>>>>,
}

impl Rows {
    /// Reads how many rows there are.
    pub fn open(results: &Results) -> Result<Rows, ViewError> {
        let no_tips = || ViewError::NoTips { dir: results.directory().to_owned() };
        let results = results.clone();
        let (source, columns, order, row_count) = match results.has_rows() {
            true => {
                let (parts, order, row_count) = chosen_parts(&results)?;
                (Source::Parts(parts), results.columns().to_vec(), order, row_count)
            }
            false => {
                let tips = results.tips()?;
                let row_count = tips.row_count() as u64;
                let order: Vec<u32> = shuffled(row_count, row_count).map(|row| row as u32).collect();
                let columns = tips.empty().columns;
                (Source::Tips(tips), columns, order, row_count)
            }
        };
        let rows = Rows { results, source, columns, row_count, order, kept: Mutex::default() };
        if rows.columns.iter().all(|column| column.name != "tip.position.x") {
            return Err(no_tips());
        }
        Ok(rows)
    }

    /// Rows of the directory.
    pub fn row_count(&self) -> u64 {
        self.row_count
    }

    /// Rows that are drawn.
    pub fn point_count(&self) -> usize {
        self.order.len()
    }

    /// Name, unit and kind of every column, without rows.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Number of the row of each point. Of a directory with more rows than 2^32, only those below are drawn.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// One column at the points, in their order. Statuses are their codes, flags 1 and 0, NaN is none.
    ///
    /// # Errors
    ///
    /// A column that is not there, or a part that cannot be read any more.
    pub fn column(&self, name: &str) -> Result<Arc<Vec<f32>>, Refusal> {
        if let Some(values) = self.kept().get(name) {
            return Ok(Arc::clone(values));
        }
        if !self.columns.iter().any(|column| column.name == name) {
            return Err(Refusal::absent(format!("no column `{name}`")));
        }
        let values = Arc::new(self.read(name)?);
        let mut kept = self.kept();
        if kept.len() >= MOST_KEPT {
            // Positions are asked for at once and kept by the page; any may go.
            let some = kept.keys().next().cloned();
            some.and_then(|name| kept.remove(&name));
        }
        kept.insert(name.to_owned(), Arc::clone(&values));
        Ok(values)
    }

    fn kept(&self) -> std::sync::MutexGuard<'_, HashMap<String, Arc<Vec<f32>>>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn read(&self, name: &str) -> Result<Vec<f32>, Refusal> {
        let mut values = vec![f32::NAN; self.point_count()];
        match &self.source {
            Source::Tips(tips) => {
                if let Some(column) = tips.column(name) {
                    values
                        .iter_mut()
                        .zip(&self.order)
                        .for_each(|(to, row)| *to = column.values.number(*row as usize) as f32);
                }
            }
            Source::Parts(parts) => {
                for part in parts {
                    let table = self.results.read_part(part.number, &[name]).map_err(Refusal::failed)?;
                    let Some(column) = table.column(name) else { continue };
                    for (row, place) in &part.chosen {
                        if (*row as usize) < column.values.len() {
                            values[*place as usize] = column.values.number(*row as usize) as f32;
                        }
                    }
                }
            }
        }
        Ok(values)
    }

    /// One row with all its digits.
    ///
    /// # Errors
    ///
    /// A row that is not there, or a part that cannot be read any more.
    pub fn row(&self, row: u64) -> Result<Table, Refusal> {
        let absent = || Refusal::absent(format!("no row {row}: the directory has {} rows", self.row_count));
        if row >= self.row_count {
            return Err(absent());
        }
        match &self.source {
            Source::Tips(tips) => Ok(tips.select(&[row as usize])),
            Source::Parts(parts) => {
                let at = parts.partition_point(|part| part.first <= row).checked_sub(1).ok_or_else(absent)?;
                let table = self.results.read_part(parts[at].number, &[]).map_err(Refusal::failed)?;
                let local = (row - parts[at].first) as usize;
                if local < table.row_count() { Ok(table.select(&[local])) } else { Err(absent()) }
            }
        }
    }

    /// Whether each point is a success, as in the figures.
    ///
    /// # Errors
    ///
    /// As [`Rows::column`].
    pub fn successes(&self) -> Result<Vec<bool>, Refusal> {
        let is_success = |code: &f32| Status::from_code(*code as u8).is_some_and(Status::is_success);
        Ok(self.column("status")?.iter().map(is_success).collect())
    }
}

type Chosen = (Vec<Part>, Vec<u32>, u64);

fn chosen_parts(results: &Results) -> Result<Chosen, ResultsError> {
    let mut parts = Vec::new();
    let mut row_count = 0;
    for number in results.part_numbers()? {
        parts.push(Part { number, first: row_count, chosen: Vec::new() });
        row_count += results.read_part(number, &["sample"])?.row_count() as u64;
    }
    let order: Vec<u64> = shuffled(row_count.min(u32::MAX.into()), MOST_POINTS).collect();
    for (place, row) in order.iter().enumerate() {
        let at = parts.partition_point(|part| part.first <= *row);
        if let Some(part) = at.checked_sub(1).and_then(|at| parts.get_mut(at)) {
            part.chosen.push(((row - part.first) as u32, place as u32));
        }
    }
    Ok((parts, order.into_iter().map(|row| row as u32).collect(), row_count))
}

/// Rows in a fixed shuffled order, `most` at most: any beginning of it is a fair sample of all.
fn shuffled(row_count: u64, most: u64) -> impl Iterator<Item = u64> {
    (0..row_count.min(most)).map(move |place| permute(place, row_count, ORDER))
}

/// The kind of a column in a word: `number`, `flag`, `status`, `text`.
pub fn kind(column: &Column) -> &'static str {
    match column.values {
        Values::Flag(_) => "flag",
        Values::Status(_) => "status",
        Values::Text(_) => "text",
        _ => "number",
    }
}
