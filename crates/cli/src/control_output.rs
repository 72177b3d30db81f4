//! Where `rodsweep control` writes.

use super::args::{ControlArguments, TableFormat};
use super::{CommandError, flags};
use rodsweep::results::{ResultsError, make_directory};
use std::path::PathBuf;

/// Where results go.
pub struct Outputs {
    pub dir: PathBuf,
    pub table: PathBuf,
}

impl Outputs {
    /// Refuses to overwrite, before anything is solved: `results/NAME/TABLE.csv`, unless told otherwise.
    pub fn new(arguments: &ControlArguments, name: &str, table: &str) -> Result<Outputs, CommandError> {
        let default = || PathBuf::from("results").join(name);
        let dir = arguments.out.clone().unwrap_or_else(default);
        let table = dir.join(match arguments.format {
            TableFormat::Csv => format!("{table}.csv"),
            TableFormat::Parquet => format!("{table}.parquet"),
        });
        flags::refuse_to_overwrite(&table, arguments.force, "directory with `--out`")?;
        Ok(Outputs { dir, table })
    }

    pub fn make_directory(&self) -> Result<(), ResultsError> {
        make_directory(&self.dir)
    }
}
