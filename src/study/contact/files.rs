//! The files of a map: table and account.

use super::map::{ContactAccount, ContactMap};
use super::robust::RobustContact;
use crate::results::{ResultsError, make_directory, place_table, verdict_metadata, write_bytes, write_table};
use std::path::{Path, PathBuf};

/// One row a point.
pub const TABLE_FILE: &str = "contact.parquet";
/// One row a design.
pub const DESIGNS_FILE: &str = "robust_designs.csv";
/// Account of a map.
pub const ACCOUNT_FILE: &str = "contact.json";

impl ContactMap {
    /// Writes table and account into a folder, replacing what is there; returns the files.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(
        &self,
        dir: &Path,
        account: &ContactAccount,
        robust: Option<&RobustContact>,
    ) -> Result<Vec<PathBuf>, ResultsError> {
        make_directory(dir)?;
        let metadata = [
            ("rodsweep.version", env!("CARGO_PKG_VERSION").to_owned()),
            ("rodsweep.scene", self.scene.name.clone()),
            ("rodsweep.engine", self.engine.clone()),
            ("rodsweep.voxel", format!("{:e}", self.lattice.spacing)),
            verdict_metadata(self.mark()),
        ];
        let (table, json) = (place_table(dir, TABLE_FILE)?, dir.join(ACCOUNT_FILE));
        write_table(&table, &self.table(robust), &metadata)?;
        write_bytes(&json, account.json().as_bytes())?;
        let mut files = vec![table, json];
        if let Some(robust) = robust {
            let designs = place_table(dir, DESIGNS_FILE)?;
            write_table(&designs, &robust.table(), &metadata)?;
            files.push(designs);
        }
        Ok(files)
    }
}
