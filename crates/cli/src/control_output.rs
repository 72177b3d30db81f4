//! Where `rodsweep control` writes.

use super::CommandError;
use super::args::{ControlArguments, TableFormat};
use rodsweep::results::ResultsError;
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
        if table.exists() && !arguments.force {
            return Err(CommandError::Usage(format!(
                "{} is already there: overwrite it with `--force`, or choose another directory with `--out`",
                table.display()
            )));
        }
        Ok(Outputs { dir, table })
    }

    pub fn make_directory(&self) -> Result<(), ResultsError> {
        let io = |error: std::io::Error| ResultsError::Io {
            path: self.dir.clone(),
            action: "making the directory",
            reason: error.to_string(),
        };
        std::fs::create_dir_all(&self.dir).map_err(io)
    }
}
