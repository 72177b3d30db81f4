//! The rows of a batch as one block of numbers, column after column, from which NumPy takes views.

use super::failure::Failure;
use rodsweep::results::ResultsError;
use rodsweep::spec::SolutionMethod;
use rodsweep::sweep::{Found, RowSink, RunEnd, RunHeader, SweepError};
use rodsweep::table::{Column, Table, Values};

/// Numbers of the rows, their statuses, and what holds of them, such as whether they are stable.
#[derive(Default)]
pub struct Block {
    /// Of each column of numbers in the order of the table.
    pub names: Vec<String>,
    /// Column after column, `rows` numbers each.
    pub numbers: Vec<f64>,
    /// Codes of statuses.
    pub statuses: Vec<u8>,
    /// Flags by the names of their columns, such as `stable`: 1, 0, or -1 where it is not known.
    pub flags: Vec<(String, Vec<i8>)>,
    /// Of the whole block.
    pub rows: usize,
    /// Rows that are there.
    filled: usize,
    /// Places of the columns of numbers.
    columns: Vec<usize>,
}

/// Columns of flags that are results of every row.
const FLAGS: [&str; 3] = ["stable", "contact.touching", "contact.holds"];

/// Columns that are results: behind the status, without what only branches have.
fn is_result(column: &Column) -> bool {
    matches!(column.values, Values::Double(_) | Values::Single(_)) && column.name != "energy"
}

impl Block {
    /// Room for so many rows of these columns.
    pub fn new(columns: &Table, rows: usize) -> Result<Block, Failure> {
        let behind = columns.columns.iter().position(|column| matches!(column.values, Values::Status(_)));
        let behind = behind.unwrap_or(0);
        let all = columns.columns.iter().enumerate().skip(behind);
        let is_there = |name: &&str| columns.columns.iter().any(|column| column.name == *name);
        let flags = FLAGS.iter().filter(|name| **name == "stable" || is_there(name));
        let flags = flags.map(|name| ((*name).to_owned(), Vec::with_capacity(rows))).collect();
        let columns: Vec<(usize, &Column)> = all.filter(|(_, column)| is_result(column)).collect();
        let too_many = || Failure::input(format!("{rows} rows do not fit into memory: solve fewer at once"));
        let size = columns.len().checked_mul(rows).ok_or_else(too_many)?;
        // Asked for first, since what cannot be had would end the process.
        Vec::<f64>::new().try_reserve_exact(size).map_err(|_| too_many())?;
        Ok(Block {
            names: columns.iter().map(|(_, column)| column.name.clone()).collect(),
            numbers: vec![0.0; size],
            statuses: Vec::with_capacity(rows),
            flags,
            rows,
            filled: 0,
            columns: columns.into_iter().map(|(at, _)| at).collect(),
        })
    }

    /// Takes in some rows.
    pub fn push(&mut self, table: &Table) {
        let (at, count) = (self.filled, table.row_count());
        for (number, place) in self.columns.iter().enumerate() {
            let start = number * self.rows + at;
            let to = &mut self.numbers[start..start + count];
            match &table.columns[*place].values {
                Values::Double(from) => to.copy_from_slice(from),
                from => to.iter_mut().enumerate().for_each(|(row, to)| *to = from.number(row)),
            }
        }
        self.statuses.extend(table.statuses().iter().map(|status| status.code()));
        for (name, all) in &mut self.flags {
            let column = table.columns.iter().find(|column| column.name == *name);
            if let Some(Values::Flag(flags)) = column.map(|column| &column.values) {
                all.extend(flags.iter().map(|flag| flag.map_or(-1, i8::from)));
            }
        }
        self.filled += count;
    }
}

/// Fills a block as rows come.
pub struct BlockSink {
    /// What has come.
    pub block: Block,
    /// For all of this number of rows.
    pub rows: usize,
}

impl RowSink for BlockSink {
    fn method(&self) -> Result<Option<SolutionMethod>, SweepError> {
        Ok(None)
    }

    fn open(&mut self, run: &RunHeader<'_>, _: &mut dyn FnMut(&Table)) -> Result<Found, SweepError> {
        self.block = Block::new(run.columns, self.rows).map_err(|_| ResultsError::Io {
            path: "memory".into(),
            action: "keeping rows",
            reason: format!("{} rows do not fit: solve fewer at once", self.rows),
        })?;
        Ok(Found::default())
    }

    fn write(&mut self, _: u64, rows: &Table) -> Result<(), SweepError> {
        self.block.push(rows);
        Ok(())
    }

    fn close(&mut self, _: &RunEnd<'_>) -> Result<(), SweepError> {
        Ok(())
    }
}
