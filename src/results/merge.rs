//! Shards put together.

use super::directory::{self, RunRecord, SWEEP_FILE, TIPS_FILE, WORKSPACE_FILE};
use super::error::ResultsError;
use super::manifest::{Manifest, named_counts};
use super::parts::{self, FileMetadata, Kept, PartInfo};
use super::read::{DirectoryStatus, Results};
use super::store::{Store, store_at};
use super::verdict::Verdict;
use super::verdict_files;
use crate::model::Status;
use crate::spec::{Format, RESOLVED_TABLE, Shard, SweepSpec};
use crate::table::Table;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    let verdict = verdict_of(&stores)?;
    if record.format() == Format::None {
        return merge_workspaces(dirs, &stores, out, (record, spec), verdict);
    }
    let mut sources: BTreeMap<u64, (&dyn Store, PartInfo)> = BTreeMap::new();
    let mut damaged: Vec<(PathBuf, String)> = Vec::new();
    for store in &stores {
        let there = directory::parts(store.as_ref(), record)?;
        for (chunk, info) in there.sound {
            sources.entry(chunk).or_insert((store.as_ref(), info));
        }
        damaged.extend(there.damaged.into_iter().map(|(name, reason)| (store.path(&name), reason)));
    }
    let total = record.chunk_count();
    if let Some(first) = (0..total).find(|chunk| !sources.contains_key(chunk)) {
        let name = record.part_files().name(first);
        let cause = damaged.into_iter().find(|(path, _)| path.ends_with(&name));
        let count = total.saturating_sub(sources.len() as u64);
        return Err(match cause {
            Some((path, reason)) => ResultsError::Damaged { path, reason },
            None => ResultsError::MissingParts { count, total, first },
        });
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
        let name = record.part_files().name(chunk);
        let gone = || ResultsError::Damaged { path: store.path(&name), reason: "it is gone".into() };
        parts::place_part(target.as_ref(), &name, format, info, &store.get(&name)?.ok_or_else(gone)?)?;
    }
    let status = Results::open(out)?.status()?;
    check_whole(&status)?;
    let merged_from = dirs.iter().filter_map(|dir| Manifest::read(dir).ok()).collect();
    verdict_files::put_scenes(target.as_ref(), spec, Some(&verdict))?;
    Manifest { merged_from, verdict: Some(verdict), ..account(record, spec, &status) }.write(target.as_ref())?;
    Ok(status)
}

/// The verdicts of all shards put together. A shard without a manifest adds nothing, so that its samples are not covered.
fn verdict_of(stores: &[Arc<dyn Store>]) -> Result<Verdict, ResultsError> {
    let found = stores.iter().map(|store| verdict_files::find(store.as_ref())).collect::<Result<Vec<_>, _>>()?;
    Ok(Verdict::sum(found.iter().flatten()))
}

/// Refuses what is not whole.
fn check_whole(status: &DirectoryStatus) -> Result<(), ResultsError> {
    if let Some((path, reason)) = status.damaged.first() {
        return Err(ResultsError::Damaged { path: path.clone(), reason: reason.clone() });
    }
    match status.missing.first() {
        None => Ok(()),
        Some(first) => {
            let (count, total) = (status.missing_count, status.parts_total);
            Err(ResultsError::MissingParts { count, total, first: *first })
        }
    }
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
        verdict: None,
        run: None,
        merged_from: Vec::new(),
        workers: Vec::new(),
    }
}

/// What a shard without rows keeps, as far as it can be merged.
struct ShardTables {
    shard: Shard,
    samples: u64,
    counts: Vec<u64>,
    engines: BTreeMap<String, u64>,
    voxels: Table,
    tips: Table,
}

/// Reads the tables of a shard: each is checked against the run, the shard and its checksum.
fn read_shard(store: &Arc<dyn Store>, record: &RunRecord) -> Result<ShardTables, ResultsError> {
    let refused = |reason: String| ResultsError::Unmergeable { dir: store.place(), reason };
    let table = |name: &str| {
        let kept = parts::check_run_table(store.as_ref(), name, &record.run_id)?;
        let kept = kept.ok_or_else(|| refused(format!("{name} is missing: finish the shard")))?;
        let shard = kept.shard.ok_or_else(|| refused(format!("{name} is of no shard, but of shards put together")))?;
        let expected = record.samples_of(shard);
        if kept.sample_count() != expected {
            return Err(refused(format!("{name} is of {} samples, shard {shard} has {expected}", kept.sample_count())));
        }
        Ok((shard, kept, parts::read_part(store, name, Format::Parquet, &[], &Table::default())?))
    };
    let (shard, kept, voxels) = table(directory::voxel_file(store.as_ref())?)?;
    let (shard_of_tips, _, tips) = table(TIPS_FILE)?;
    let manifest = Manifest::find(store.as_ref())?;
    let manifest = manifest.ok_or_else(|| refused("it has no manifest.json: finish the shard".into()))?;
    let others = [("tips.parquet", Some(shard_of_tips)), ("manifest.json", manifest.run.as_ref().map(|run| run.shard))];
    if let Some((name, _)) = others.iter().find(|(_, other)| *other != Some(shard)) {
        return Err(refused(format!("its voxels are of shard {shard}, {name} is not")));
    }
    if manifest.run_id != record.run_id || !manifest.complete {
        return Err(refused("its manifest.json is of another run, or of one that was interrupted".into()));
    }
    let samples = kept.sample_count();
    Ok(ShardTables { shard, samples, counts: kept.counts, engines: manifest.engines, voxels, tips })
}

/// Adds up the voxels of shards without rows; every shard must be there once and complete.
fn merge_workspaces(
    dirs: &[PathBuf],
    stores: &[Arc<dyn Store>],
    out: &Path,
    (record, spec): (&RunRecord, &SweepSpec),
    verdict: Verdict,
) -> Result<DirectoryStatus, ResultsError> {
    let mut seen: BTreeMap<u64, PathBuf> = BTreeMap::new();
    let mut total = None;
    let mut engines: BTreeMap<String, u64> = BTreeMap::new();
    let (mut voxels, mut tips) = (BTreeMap::<[u64; 3], (usize, u64)>::new(), Table::default());
    let (mut centres, mut counts, mut done) = (Table::default(), [0; Status::ALL.len()], 0);
    for store in stores {
        let one = read_shard(store, record)?;
        let (shard, total) = (one.shard, *total.get_or_insert(one.shard.count));
        let refused = |reason: String| ResultsError::Unmergeable { dir: store.place(), reason };
        if shard.count != total {
            return Err(refused(format!(
                "it is shard {shard}, where the first is one of {total}: leave one of them out"
            )));
        }
        if let Some(other) = seen.insert(shard.index, store.place()) {
            return Err(refused(format!("it is shard {shard}, as {} is: leave one of them out", other.display())));
        }
        done += one.samples;
        one.engines.iter().for_each(|(engine, rows)| *engines.entry(engine.clone()).or_default() += rows);
        counts.iter_mut().zip(&one.counts).for_each(|(sum, count)| *sum += count);
        let position = one.voxels.vector_columns("voxel");
        if let (Some(position), Some(count)) = (position, one.voxels.column("count")) {
            for row in 0..one.voxels.row_count() {
                let key = position.map(|column| column.number(row).to_bits());
                let entry = voxels.entry(key).or_insert((centres.row_count() + row, 0));
                entry.1 += count.values.number(row) as u64;
            }
        }
        centres.append(&one.voxels);
        tips.append(&one.tips);
    }
    let total = total.unwrap_or(1);
    if let Some(first) = (1..=total).find(|index| !seen.contains_key(index)) {
        let (count, reason) = (total - seen.len() as u64, format!("shard {first}/{total} is missing"));
        let more = if count > 1 { format!(", and {} more", count - 1) } else { String::new() };
        return Err(ResultsError::Unmergeable { dir: out.into(), reason: reason + &more });
    }
    let target = store_at(out)?;
    directory::open(target.as_ref(), record, spec, true)?;
    let words = verdict.headline().unwrap_or_else(|| "sound".into());
    let metadata = FileMetadata { verdict: words, ..directory::metadata(spec, record) };
    let mut rows: Vec<(usize, u64)> = voxels.into_values().collect();
    rows.sort_unstable();
    let (rows, totals): (Vec<usize>, Vec<u64>) = rows.into_iter().unzip();
    let mut merged = centres.select(&rows);
    if let Some(count) = merged.columns.iter_mut().find(|column| column.name == "count") {
        count.values = totals.into();
    }
    let kept = Kept { shard: None, samples: done, counts };
    parts::write_run_table(target.as_ref(), WORKSPACE_FILE, &merged, &metadata, &kept)?;
    parts::write_run_table(target.as_ref(), TIPS_FILE, &tips, &metadata, &kept)?;
    let status = DirectoryStatus { engines, ..Results::open(out)?.status()? };
    check_whole(&status)?;
    let merged_from = dirs.iter().filter_map(|dir| Manifest::read(dir).ok()).collect();
    verdict_files::put_scenes(target.as_ref(), spec, Some(&verdict))?;
    Manifest { merged_from, verdict: Some(verdict), ..account(record, spec, &status) }.write(target.as_ref())?;
    Ok(status)
}
