//! Where the tables of studies lie: apart from rows of their format, so that `out/*.parquet` finds rows and nothing else.

use super::directory::RunRecord;
use super::error::ResultsError;
use super::store::{TABLES_FOLDER, store_at};
use std::path::{Path, PathBuf};

/// The path that a study's table of this name takes in a directory. Where rows of the same format lie at the top of it, that is
/// in its folder `tables`, and a table that an earlier version has left beside the rows is removed.
///
/// # Errors
///
/// A folder that cannot be made, or a run that cannot be read.
pub fn place_table(dir: &Path, name: &str) -> Result<PathBuf, ResultsError> {
    let store = store_at(dir)?;
    let is_beside_rows = RunRecord::find(store.as_ref())?.is_some_and(|run| {
        !run.rows_in_folder && Path::new(name).extension().is_some_and(|ending| ending == run.format.as_str())
    });
    if !is_beside_rows {
        return Ok(dir.join(name));
    }
    store.remove(name)?;
    let folder = dir.join(TABLES_FOLDER);
    store_at(&folder)?.prepare()?;
    Ok(folder.join(name))
}

/// The path of a study's table of this name in a directory; `None`: there is none.
///
/// # Errors
///
/// A directory that cannot be read.
pub fn find_table(dir: &Path, name: &str) -> Result<Option<PathBuf>, ResultsError> {
    let store = store_at(dir)?;
    let apart = format!("{TABLES_FOLDER}/{name}");
    for there in [apart.as_str(), name] {
        if store.head(there)?.is_some() {
            return Ok(Some(dir.join(there)));
        }
    }
    Ok(None)
}
