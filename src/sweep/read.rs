//! Reads result directories back: status, columns, and shards merged into one.

use super::directory::{self, MANIFEST_FILE, RUN_FILE, RunRecord, SWEEP_FILE};
use super::error::SweepError;
use super::manifest::{TIPS_FILE, WORKSPACE_FILE};
use super::reduce::{Reduction, failures};
use super::sink::{self, PartInfo};
use super::spec::{BranchChoice, Format, RESOLVED_TABLE, SweepSpec};
use crate::backend::Precision;
use crate::model::{Status, closest};
use crate::table::{Column, Table};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a result directory holds.
#[derive(Clone, Debug)]
pub struct DirectoryStatus {
    pub record: RunRecord,
    pub parts_total: u64,
    pub parts_done: u64,
    /// Chunks without a sound part.
    pub missing: Vec<u64>,
    /// Damaged parts and what is wrong with them.
    pub damaged: Vec<(PathBuf, String)>,
    pub samples_done: u64,
    /// Whether samples have a row for each equilibrium.
    pub every_branch: bool,
    /// Rows by status code.
    pub counts: [u64; Status::ALL.len()],
}

impl DirectoryStatus {
    pub fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }

    pub fn failed(&self) -> u64 {
        failures(&self.counts, self.every_branch)
    }
}

/// Checks every part of a result directory.
pub fn directory_status(dir: &Path) -> Result<DirectoryStatus, SweepError> {
    let record = RunRecord::read(dir)?;
    let parts = directory::parts(dir, &record)?;
    let mut counts = [0; Status::ALL.len()];
    for info in parts.sound.values() {
        for (sum, count) in counts.iter_mut().zip(&info.counts) {
            *sum += count;
        }
    }
    let without_rows = record.format() == Format::None;
    let parts_total = if without_rows { 0 } else { record.chunk_count() };
    Ok(DirectoryStatus {
        parts_total,
        parts_done: parts.sound.len() as u64,
        missing: (0..parts_total).filter(|chunk| !parts.sound.contains_key(chunk)).collect(),
        samples_done: parts.sound.values().map(PartInfo::sample_count).sum(),
        every_branch: parts.sound.values().any(|info| info.samples.is_some()),
        damaged: parts.damaged,
        counts,
        record,
    })
}

/// The sweep of a result directory.
pub fn read_spec(dir: &Path) -> Result<SweepSpec, SweepError> {
    if !dir.join(RUN_FILE).is_file() {
        return Err(SweepError::NoRun { dir: dir.into() });
    }
    Ok(SweepSpec::read(&dir.join(SWEEP_FILE))?)
}

/// The manifest of a result directory.
pub fn read_manifest(dir: &Path) -> Result<serde_json::Value, SweepError> {
    let path = dir.join(MANIFEST_FILE);
    let text = std::fs::read_to_string(&path).map_err(SweepError::io(&path, "reading"))?;
    serde_json::from_str(&text).map_err(|error| SweepError::Damaged { path, reason: error.to_string() })
}

/// Columns of a result without rows: names, units, kinds.
fn layout(dir: &Path, record: &RunRecord) -> Result<Table, SweepError> {
    let precision = if record.precision == "f32" { Precision::F32 } else { Precision::F64 };
    Ok(super::layout::Layout::new(&read_spec(dir)?, precision).empty().clone())
}

/// Hands every part to `visit`, in order of samples, with the named columns only (all, if none are named).
pub fn for_each_part(
    dir: &Path,
    names: &[&str],
    mut visit: impl FnMut(&Table) -> Result<(), SweepError>,
) -> Result<(), SweepError> {
    let record = RunRecord::read(dir)?;
    let columns = layout(dir, &record)?;
    for name in names {
        if columns.column(name).is_none() {
            let suggestion = closest(name, columns.columns.iter().map(|column: &Column| column.name.as_str()));
            return Err(SweepError::NoColumn { dir: dir.into(), name: (*name).into(), suggestion });
        }
    }
    for chunk in directory::parts(dir, &record)?.sound.keys() {
        let path = directory::part_path(dir, *chunk, record.format());
        visit(&sink::read_part(&path, record.format(), names, &columns)?)?;
    }
    Ok(())
}

/// The named columns of a whole result (all, if none are named), in order of samples.
pub fn read_columns(dir: &Path, names: &[&str]) -> Result<Table, SweepError> {
    let mut all = Table::default();
    for_each_part(dir, names, |table| {
        all.append(table);
        Ok(())
    })?;
    Ok(all)
}

/// Any Parquet file that a run wrote (`workspace.parquet`, `tips.parquet`).
pub fn read_parquet_table(path: &Path) -> Result<Table, SweepError> {
    sink::read_part(path, Format::Parquet, &[], &Table::default())
}

/// Statistics of a finished result, voxels included, as the run itself would have gathered them.
pub fn reduce_directory(dir: &Path, voxel: f64) -> Result<Reduction, SweepError> {
    let record = RunRecord::read(dir)?;
    let columns = layout(dir, &record)?;
    let mut reduction = Reduction::new(record.sample_count, voxel, true);
    for_each_part(dir, &directory::plain_columns(&columns), |table| {
        reduction.add(table);
        Ok(())
    })?;
    Ok(reduction)
}

/// Gathers the parts of shards into `out`; every chunk must be in one of them.
pub fn merge(dirs: &[PathBuf], out: &Path) -> Result<DirectoryStatus, SweepError> {
    let Some(first) = dirs.first() else { return Err(SweepError::NoRun { dir: out.into() }) };
    let record = RunRecord::read(first)?;
    if record.format() == Format::None {
        return merge_workspaces(dirs, out, &record);
    }
    let mut sources: BTreeMap<u64, PathBuf> = BTreeMap::new();
    for dir in dirs {
        record.check_same(dir, &RunRecord::read(dir)?)?;
        for chunk in directory::parts(dir, &record)?.sound.keys() {
            sources.entry(*chunk).or_insert_with(|| directory::part_path(dir, *chunk, record.format()));
        }
    }
    let missing: Vec<u64> = (0..record.chunk_count()).filter(|chunk| !sources.contains_key(chunk)).collect();
    if let Some(first) = missing.first() {
        let (count, total) = (missing.len() as u64, record.chunk_count());
        return Err(SweepError::MissingParts { count, total, first: *first });
    }
    // The sweep as run was read from `first`, so its text is the same again.
    let spec = read_spec(first)?;
    directory::open(out, &record, &spec, true)?;
    for name in [SWEEP_FILE, RESOLVED_TABLE] {
        if first.join(name).is_file() {
            copy(&first.join(name), &out.join(name), true)?;
        }
    }
    for path in sources.values() {
        let to = out.join(path.file_name().unwrap_or_default());
        if sink::sidecar(path).is_file() {
            copy(&sink::sidecar(path), &sink::sidecar(&to), true)?;
        }
        copy(path, &to, false)?;
    }
    finish_merge(dirs, out, &record, &spec, directory_status(out)?)
}

/// Writes the manifest of a merged result.
fn finish_merge(
    dirs: &[PathBuf],
    out: &Path,
    record: &RunRecord,
    spec: &SweepSpec,
    status: DirectoryStatus,
) -> Result<DirectoryStatus, SweepError> {
    let manifests: Vec<serde_json::Value> = dirs.iter().filter_map(|dir| read_manifest(dir).ok()).collect();
    let counts: BTreeMap<&str, u64> =
        Status::ALL.into_iter().map(|s| (s.name(), status.counts[s.code() as usize])).filter(|(_, n)| *n > 0).collect();
    let merged = serde_json::json!({
        "program": "rodsweep",
        "version": env!("CARGO_PKG_VERSION"),
        "run_id": record.run_id,
        "sample_count": record.sample_count,
        "chunk": record.chunk,
        "seed": spec.seed,
        "precision": record.precision,
        "branch": spec.branch.name(),
        "complete": status.is_complete(),
        "counts": counts,
        "failed": status.failed(),
        "merged_from": manifests,
    });
    let text = serde_json::to_string_pretty(&merged).unwrap_or_default() + "\n";
    sink::write_atomically(&out.join(MANIFEST_FILE), text.as_bytes(), true)?;
    Ok(status)
}

/// Adds up the voxels of shards without rows; every shard must be there once and complete.
fn merge_workspaces(dirs: &[PathBuf], out: &Path, record: &RunRecord) -> Result<DirectoryStatus, SweepError> {
    let mut seen: BTreeMap<u64, u64> = BTreeMap::new();
    let (mut voxels, mut tips) = (BTreeMap::<[u64; 3], (usize, u64)>::new(), Table::default());
    let (mut centres, mut counts, mut done) = (Table::default(), [0; Status::ALL.len()], 0);
    for dir in dirs {
        record.check_same(dir, &RunRecord::read(dir)?)?;
        let manifest = read_manifest(dir)?;
        let shard = |key: &str| manifest["shard"][key].as_u64().unwrap_or(0);
        if manifest["complete"] != true || seen.insert(shard("index"), shard("count")).is_some() {
            let reason = "the shard is not complete, or is given twice".into();
            return Err(SweepError::Damaged { path: dir.join(MANIFEST_FILE), reason });
        }
        done += manifest["samples_of_shard"].as_u64().unwrap_or(0);
        for status in Status::ALL {
            counts[status.code() as usize] += manifest["counts"][status.name()].as_u64().unwrap_or(0);
        }
        let table = read_parquet_table(&dir.join(WORKSPACE_FILE))?;
        let position = table.vector_columns("voxel");
        if let (Some(position), Some(count)) = (position, table.column("count")) {
            for row in 0..table.row_count() {
                let key = position.map(|column| column.number(row).to_bits());
                let entry = voxels.entry(key).or_insert((centres.row_count() + row, 0));
                entry.1 += count.values.number(row) as u64;
            }
        }
        centres.append(&table);
        tips.append(&read_parquet_table(&dir.join(TIPS_FILE))?);
    }
    let expected = seen.values().next().copied().unwrap_or(1);
    if let Some(first) = (1..=expected).find(|index| seen.get(index) != Some(&expected)) {
        let count = expected.saturating_sub(seen.len() as u64).max(1);
        return Err(SweepError::MissingParts { count, total: expected, first });
    }
    let spec = read_spec(&dirs[0])?;
    directory::open(out, record, &spec, true)?;
    let metadata = directory::metadata(&spec, record);
    let mut rows: Vec<(usize, u64)> = voxels.into_values().collect();
    rows.sort_unstable();
    let (rows, totals): (Vec<usize>, Vec<u64>) = rows.into_iter().unzip();
    let mut merged = centres.select(&rows);
    if let Some(count) = merged.columns.iter_mut().find(|column| column.name == "count") {
        count.values = totals.into();
    }
    sink::write_run_table(&out.join(WORKSPACE_FILE), &merged, &metadata)?;
    sink::write_run_table(&out.join(TIPS_FILE), &tips, &metadata)?;
    let every_branch = spec.branch == BranchChoice::All;
    let status = DirectoryStatus { samples_done: done, every_branch, counts, ..directory_status(out)? };
    finish_merge(dirs, out, record, &spec, status)
}

fn copy(from: &Path, to: &Path, replace: bool) -> Result<(), SweepError> {
    let bytes = std::fs::read(from).map_err(SweepError::io(from, "reading"))?;
    sink::write_atomically(to, &bytes, replace).map(|_| ())
}
