//! Shards put together.

use super::directory::{self, RunRecord, SWEEP_FILE, TIPS_FILE, WORKSPACE_FILE};
use super::error::ResultsError;
use super::manifest::{Manifest, named_counts};
use super::parts::{self, PartInfo};
use super::read::{DirectoryStatus, Results, read_parquet_table};
use super::store::{Store, store_at};
use crate::model::Status;
use crate::spec::{BranchChoice, Format, RESOLVED_TABLE, SweepSpec};
use crate::table::Table;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Gathers the parts of shards into `out`; every chunk must be in one of them, and all must be of one run: the same
/// sweep, solved by the same method.
///
/// # Errors
///
/// Shards of different runs, or a part that is missing or damaged.
pub fn merge(dirs: &[PathBuf], out: &Path) -> Result<DirectoryStatus, ResultsError> {
    let Some(first) = dirs.first() else { return Err(ResultsError::NoRun { dir: out.into() }) };
    let results = Results::open(first)?;
    let (record, spec) = (results.record(), results.spec());
    let stores = dirs.iter().map(|dir| store_at(dir)).collect::<Result<Vec<_>, _>>()?;
    for store in &stores {
        record.check_same(store.as_ref(), &RunRecord::read(store.as_ref())?)?;
    }
    if record.format() == Format::None {
        return merge_workspaces(dirs, out, record, spec);
    }
    let mut sources: BTreeMap<u64, (&dyn Store, PartInfo)> = BTreeMap::new();
    for store in &stores {
        for (chunk, info) in directory::parts(store.as_ref(), record)?.sound {
            sources.entry(chunk).or_insert((store.as_ref(), info));
        }
    }
    let missing: Vec<u64> = (0..record.chunk_count()).filter(|chunk| !sources.contains_key(chunk)).collect();
    if let Some(first) = missing.first() {
        let (count, total) = (missing.len() as u64, record.chunk_count());
        return Err(ResultsError::MissingParts { count, total, first: *first });
    }
    let target = store_at(out)?;
    // The sweep as run was read from `first`, so its text is the same again.
    directory::open(target.as_ref(), record, spec, true)?;
    for name in [SWEEP_FILE, RESOLVED_TABLE] {
        if let Some(bytes) = stores[0].get(name)? {
            target.put(name, &bytes)?;
        }
    }
    let format = record.format();
    for (chunk, (store, info)) in sources {
        let name = parts::part_name(chunk, format);
        let gone = || ResultsError::Damaged { path: store.path(&name), reason: "it is gone".into() };
        parts::place_part(target.as_ref(), &name, format, info, &store.get(&name)?.ok_or_else(gone)?)?;
    }
    let status = Results::open(out)?.status()?;
    let merged_from = dirs.iter().filter_map(|dir| Manifest::read(dir).ok()).collect();
    Manifest { merged_from, ..account(record, spec, &status) }.write(target.as_ref())?;
    Ok(status)
}

/// What the parts of a run say of it.
pub(crate) fn account(record: &RunRecord, spec: &SweepSpec, status: &DirectoryStatus) -> Manifest {
    Manifest {
        program: "rodsweep".into(),
        version: crate::VERSION.into(),
        commit: crate::commit().map(str::to_owned),
        run_id: record.run_id.clone(),
        solved_by: record.method,
        engines: status.engines.clone(),
        methods: if record.mixed { status.methods.clone() } else { BTreeMap::new() },
        sample_count: record.sample_count,
        chunk: record.chunk,
        seed: spec.seed,
        precision: record.precision.clone(),
        branch: spec.branch.name().into(),
        complete: status.is_complete(),
        counts: named_counts(&status.counts),
        failed: status.failed(),
        run: None,
        merged_from: Vec::new(),
        workers: Vec::new(),
    }
}

/// Adds up the voxels of shards without rows; every shard must be there once and complete.
fn merge_workspaces(
    dirs: &[PathBuf],
    out: &Path,
    record: &RunRecord,
    spec: &SweepSpec,
) -> Result<DirectoryStatus, ResultsError> {
    let mut seen: BTreeMap<u64, u64> = BTreeMap::new();
    let mut engines: BTreeMap<String, u64> = BTreeMap::new();
    let (mut voxels, mut tips) = (BTreeMap::<[u64; 3], (usize, u64)>::new(), Table::default());
    let (mut centres, mut counts, mut done) = (Table::default(), [0; Status::ALL.len()], 0);
    for dir in dirs {
        let manifest = Manifest::read(dir)?;
        let damaged =
            |reason: &str| ResultsError::Damaged { path: dir.join(directory::MANIFEST_FILE), reason: reason.into() };
        let run = manifest.run.as_ref().ok_or_else(|| damaged("it is of merged shards"))?;
        if !manifest.complete || seen.insert(run.shard.index, run.shard.count).is_some() {
            return Err(damaged("the shard is not complete, or is given twice"));
        }
        done += run.samples_of_shard;
        manifest.engines.iter().for_each(|(engine, rows)| *engines.entry(engine.clone()).or_default() += rows);
        for status in Status::ALL {
            counts[status.code() as usize] += manifest.count(status);
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
        return Err(ResultsError::MissingParts { count, total: expected, first });
    }
    let target = store_at(out)?;
    directory::open(target.as_ref(), record, spec, true)?;
    let metadata = directory::metadata(spec, record);
    let mut rows: Vec<(usize, u64)> = voxels.into_values().collect();
    rows.sort_unstable();
    let (rows, totals): (Vec<usize>, Vec<u64>) = rows.into_iter().unzip();
    let mut merged = centres.select(&rows);
    if let Some(count) = merged.columns.iter_mut().find(|column| column.name == "count") {
        count.values = totals.into();
    }
    parts::write_run_table(target.as_ref(), WORKSPACE_FILE, &merged, &metadata)?;
    parts::write_run_table(target.as_ref(), TIPS_FILE, &tips, &metadata)?;
    let every_branch = spec.branch == BranchChoice::All;
    let status = Results::open(out)?.status()?;
    let status = DirectoryStatus { samples_done: done, every_branch, counts, engines, ..status };
    let merged_from = dirs.iter().filter_map(|dir| Manifest::read(dir).ok()).collect();
    Manifest { merged_from, ..account(record, spec, &status) }.write(target.as_ref())?;
    Ok(status)
}
