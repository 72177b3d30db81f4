//! A folder that holds the rows and nothing else, for readers that take whole folders: `pandas.read_parquet("out/rows")`.

use super::error::ResultsError;
use super::parts::part_chunk;
use super::store::Store;
use crate::spec::Format;
use std::collections::BTreeSet;

/// Name of the folder in a result directory.
pub(crate) const ROWS_FOLDER: &str = "rows";

/// Gives every part a second name in the folder. It takes no room on disk. Other places than folders of this machine, and
/// file systems without hard links, have no such folder.
///
/// # Errors
///
/// The folder cannot be listed or written.
pub(crate) fn gather_rows(store: &dyn Store, format: Format) -> Result<(), ResultsError> {
    if !matches!(format, Format::Parquet | Format::Csv) || store.is_remote() {
        return Ok(());
    }
    let parts = |folder: &str| -> Result<BTreeSet<String>, ResultsError> {
        let names = store.list(folder)?.into_iter().map(|entry| entry.name);
        Ok(names.filter(|name| part_chunk(name, format).is_some()).collect())
    };
    let rows = parts("")?;
    for gone in parts(ROWS_FOLDER)?.difference(&rows) {
        store.remove(&format!("{ROWS_FOLDER}/{gone}"))?;
    }
    for name in &rows {
        if !store.link(name, &format!("{ROWS_FOLDER}/{name}"))? {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::store_at;
    use std::fs;

    #[test]
    fn the_folder_holds_the_rows_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = store_at(folder.path()).expect("a store");
        let rows = folder.path().join(ROWS_FOLDER);
        let names = || {
            let entries = fs::read_dir(&rows).expect("a folder").flatten();
            let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into()).collect();
            names.sort();
            names
        };
        for name in ["part-0000000000.parquet", "part-0000000001.parquet", "workspace.parquet", "manifest.json"] {
            store.put(name, name.as_bytes()).expect("written");
        }
        gather_rows(store.as_ref(), Format::Parquet).expect("gathered");
        assert_eq!(names(), ["part-0000000000.parquet", "part-0000000001.parquet"]);
        // A part that was mended is the new one there, too; one that was put aside is gone.
        store.put("part-0000000000.parquet", b"new").expect("written");
        store.remove("part-0000000001.parquet").expect("removed");
        gather_rows(store.as_ref(), Format::Parquet).expect("gathered");
        assert_eq!(names(), ["part-0000000000.parquet"]);
        assert_eq!(fs::read(rows.join("part-0000000000.parquet")).expect("a file"), b"new");
    }
}
