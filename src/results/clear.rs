//! Removing what an earlier run and its studies have left in a directory, and nothing else.

use super::directory::{RUN_FILE, SWEEP_FILE, TIPS_FILE, TOUCHED_FILE, WORKSPACE_FILE, WORST_FILE};
use super::error::ResultsError;
use super::manifest::MANIFEST_FILE;
use super::store::{Entry, ROWS_FOLDER, Store, TABLES_FOLDER, store_at};
use crate::spec::{Format, RESOLVED_TABLE};
use std::path::Path;

/// Folders of runs: what workers and shards share, rows where they are asked to lie apart, and tables of studies.
const FOLDERS: [&str; 5] = ["claims", "workers", "verdicts", ROWS_FOLDER, TABLES_FOLDER];
/// What a measured workspace leaves, with or without a run.
const MEASURED_FILE: &str = "workspace.json";
/// Files of a run that are there once.
const FILES: [&str; 8] =
    [RUN_FILE, SWEEP_FILE, RESOLVED_TABLE, MANIFEST_FILE, WORST_FILE, WORKSPACE_FILE, TOUCHED_FILE, TIPS_FILE];

/// Removes a run from its directory, with files of these names that studies and figures have left there. An empty
/// directory, or none, is as good. Where anything else lies there, nothing is removed.
///
/// # Errors
///
/// Files that are neither of the run nor in the list, no run, or files that cannot be removed.
pub fn remove_run(dir: &Path, others: &[&str]) -> Result<(), ResultsError> {
    let store = store_at(dir)?;
    let entries = store.list("")?;
    let visible: Vec<_> = entries.iter().filter(|entry| !entry.name.starts_with('.')).collect();
    if visible.is_empty() {
        return Ok(());
    }
    let is_ours = |name: &str, is_file: bool| match is_file {
        true => is_of_run(name) || others.contains(&name),
        false => FOLDERS.contains(&name),
    };
    let foreign: Vec<String> =
        visible.iter().filter(|entry| !is_ours(&entry.name, entry.is_file)).map(|entry| entry.name.clone()).collect();
    let is_known =
        visible.iter().any(|entry| entry.is_file && [RUN_FILE, MEASURED_FILE].contains(&entry.name.as_str()));
    if !foreign.is_empty() || !is_known {
        return Err(ResultsError::NotOnlyOurs { dir: dir.into(), foreign });
    }
    let (mut names, mut folders) = (Vec::new(), Vec::new());
    for entry in visible {
        match entry.is_file {
            true => names.push(entry.name.clone()),
            false => {
                names.extend(of_folder(store.as_ref(), dir, &entry.name, others)?);
                folders.push(&entry.name);
            }
        }
    }
    // The identity goes last: a removal that is interrupted can be done again.
    names.iter().filter(|name| *name != RUN_FILE).try_for_each(|name| store.remove(name))?;
    folders.into_iter().try_for_each(|folder| store.remove_folder(folder))?;
    store.remove(RUN_FILE)
}

/// The files of a folder of a run.
fn of_folder(store: &dyn Store, dir: &Path, folder: &str, others: &[&str]) -> Result<Vec<String>, ResultsError> {
    let entries = store.list(folder)?;
    // A part whose writing was cut short has a point before its name.
    let is_row = |name: &str| is_part(name.strip_prefix('.').unwrap_or(name));
    let is_ours = |entry: &&Entry| {
        entry.is_file
            && match folder {
                ROWS_FOLDER => is_row(&entry.name),
                TABLES_FOLDER => others.contains(&entry.name.as_str()),
                _ => true,
            }
    };
    let name = |entry: &Entry| format!("{folder}/{}", entry.name);
    let foreign: Vec<String> = entries.iter().filter(|entry| !is_ours(entry)).map(name).collect();
    if !foreign.is_empty() {
        return Err(ResultsError::NotOnlyOurs { dir: dir.into(), foreign });
    }
    Ok(entries.iter().map(name).collect())
}

/// Whether a run writes a file of this name.
fn is_of_run(name: &str) -> bool {
    let is_scene = name.starts_with("distrusted-") && name.ends_with(".toml");
    FILES.contains(&name) || is_scene || is_part(name)
}

/// A part, one that was put aside, or what is kept beside one: `part-0000000000.parquet`, `....parquet.bad-0`.
fn is_part(name: &str) -> bool {
    let Some(rest) = name.strip_prefix("part-") else { return false };
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    let extension = &rest[digits..];
    let is_format = |format: &Format| extension.strip_prefix('.').is_some_and(|rest| rest.starts_with(format.name()));
    digits >= 10 && Format::ALL.iter().any(is_format)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn only_what_a_run_writes_is_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let dir = folder.path();
        let write = |name: &str| fs::write(dir.join(name), "x").expect("a file");
        remove_run(dir, &[]).expect("an empty directory");
        ["run.json", "part-0000000000.parquet", "part-0000000001.csv.bad-0", "tips.png"]
            .iter()
            .for_each(|name| write(name));
        fs::create_dir(dir.join("claims")).expect("a folder");
        write("claims/0-0");
        write("notes.txt");
        let error = remove_run(dir, &["tips.png"]).expect_err("a foreign file").to_string();
        assert!(error.contains("notes.txt") && !error.contains("run.json"), "{error}");
        assert!(dir.join("run.json").exists() && dir.join("claims/0-0").exists());
        fs::remove_file(dir.join("notes.txt")).expect("removed");
        remove_run(dir, &["tips.png"]).expect("removed");
        assert_eq!(fs::read_dir(dir).expect("a folder").count(), 0);
    }

    #[test]
    fn a_directory_without_a_run_is_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("inputs.csv"), "x").expect("a file");
        assert!(matches!(remove_run(folder.path(), &[]), Err(ResultsError::NotOnlyOurs { .. })));
        assert!(folder.path().join("inputs.csv").exists());
    }

    #[test]
    fn names_of_parts() {
        for (name, is_ours) in [
            ("part-0000000000.parquet", true),
            ("part-0000000012.csv", true),
            ("part-0000000012.npz.bad-3", true),
            ("part-1.parquet", false),
            ("part-0000000000.txt", false),
            ("parts.parquet", false),
        ] {
            assert_eq!(is_part(name), is_ours, "{name}");
        }
    }
}
