//! A result directory: its identity, what lies in it, who may write to it.

use super::differences::differences;
use super::error::ResultsError;
use super::manifest::Manifest;
use super::parts::{self, FileMetadata, PartFiles, PartInfo};
use super::store::{Entry, Store};
use crate::backend::Precision;
use crate::files;
use crate::spec::{Format, RESOLVED_TABLE, Shard, SolutionMethod, SweepSpec};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::panic::resume_unwind;
use xxhash_rust::xxh3::xxh3_128;

pub(crate) const RUN_FILE: &str = "run.json";
pub(crate) const SWEEP_FILE: &str = "sweep.toml";
/// Scene of the sample with the largest spot-check error, for `solve`.
pub const WORST_FILE: &str = "spot-check-worst.toml";
/// Voxels of a run without rows.
pub const WORKSPACE_FILE: &str = "workspace.parquet";
/// The same once the workspace itself has been measured, which takes that name.
pub(crate) const TOUCHED_FILE: &str = "touched.parquet";
/// Tips of a run without rows.
pub const TIPS_FILE: &str = "tips.parquet";

/// What a run is. Never changes; every part carries `run_id`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RunRecord {
    /// Hash of all that follows.
    pub run_id: String,
    /// Of the program.
    pub version: String,
    /// Samples of the sweep.
    pub sample_count: u64,
    /// Samples in a part.
    pub chunk: u64,
    /// Of the parts.
    pub format: String,
    /// Arithmetic of the engine.
    pub precision: String,
    /// By what it is solved; runs of version 0.1 do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<SolutionMethod>,
    /// Workers may solve it by different methods; each part then says by which.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mixed: bool,
    /// Hash of the resolved scene and sweep.
    pub input: String,
    /// Hash of the columns.
    pub columns: String,
    /// Whether the parts lie in the folder `rows`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rows_in_folder: bool,
}

impl RunRecord {
    pub(crate) fn new(
        spec: &SweepSpec,
        schema: &str,
        sample_count: u64,
        chunk: u64,
        method: Option<SolutionMethod>,
    ) -> RunRecord {
        let mut input = spec.to_toml();
        if let Some(table) = &spec.table {
            input += &table.to_csv(&spec.scene);
        }
        let hash = |text: &str| format!("{:032x}", xxh3_128(text.as_bytes()));
        let mut record = RunRecord {
            run_id: String::new(),
            version: env!("CARGO_PKG_VERSION").into(),
            sample_count,
            chunk,
            format: spec.format.name().into(),
            // Where methods may differ, columns hold what the finest of them gives.
            precision: method.map_or(Precision::F64, |method| method.precision).to_string(),
            method,
            mixed: method.is_none(),
            input: hash(&input),
            columns: hash(schema),
            rows_in_folder: spec.rows_in_folder,
        };
        record.run_id = record.id();
        record
    }

    /// Parts of the whole sweep.
    pub fn chunk_count(&self) -> u64 {
        self.sample_count.div_ceil(self.chunk)
    }

    /// First sample and number of samples of a chunk.
    pub fn chunk_range(&self, chunk: u64) -> (u64, u64) {
        let start = chunk.saturating_mul(self.chunk);
        (start, self.chunk.min(self.sample_count.saturating_sub(start)))
    }

    /// Samples of a shard.
    pub fn samples_of(&self, shard: Shard) -> u64 {
        let count = self.chunk_count();
        let first = shard.index.checked_sub(1).filter(|first| *first < count && shard.count > 0);
        let Some(first) = first else { return 0 };
        let chunks = (count - 1 - first) / shard.count + 1;
        let short = if shard.owns(count - 1) { self.chunk - self.chunk_range(count - 1).1 } else { 0 };
        chunks.saturating_mul(self.chunk) - short
    }

    /// Format of the parts.
    pub fn format(&self) -> Format {
        Format::ALL.into_iter().find(|format| format.name() == self.format).unwrap_or(Format::Parquet)
    }

    /// Where the parts lie, and how they are named.
    pub(crate) fn part_files(&self) -> PartFiles {
        PartFiles { format: self.format(), in_folder: self.rows_in_folder }
    }

    pub(crate) fn read(store: &dyn Store) -> Result<RunRecord, ResultsError> {
        RunRecord::find(store)?.ok_or_else(|| ResultsError::NoRun { dir: store.place() })
    }

    /// `None`: there is no run.
    pub(crate) fn find(store: &dyn Store) -> Result<Option<RunRecord>, ResultsError> {
        let Some(bytes) = store.get(RUN_FILE)? else { return Ok(None) };
        let unsound = |reason: String| ResultsError::Identity { path: store.path(RUN_FILE), reason };
        let record: RunRecord = serde_json::from_slice(&bytes).map_err(|error| unsound(error.to_string()))?;
        record.check().map_err(unsound)?;
        Ok(Some(record))
    }

    /// Whether the numbers can be those of a run, and the id is theirs.
    fn check(&self) -> Result<(), String> {
        let Some(format) = Format::ALL.into_iter().find(|format| format.name() == self.format) else {
            return Err(format!("no format is called \"{}\"", self.format));
        };
        if self.chunk == 0 || self.sample_count == 0 || self.sample_count > format.most_samples() {
            return Err(format!("no run has {} samples in parts of {}", self.sample_count, self.chunk));
        }
        // One flipped bit makes an old version of today's.
        let of_today = RunRecord { version: env!("CARGO_PKG_VERSION").into(), ..self.clone() };
        let is_changed = if self.is_old() { self.run_id == of_today.id() } else { self.run_id != self.id() };
        if is_changed {
            return Err("its run id does not fit what it says: it has been changed, or is of another version".into());
        }
        Ok(())
    }

    /// Refuses a resolved sweep, and its table, that are not those of the run.
    pub(crate) fn check_sweep(&self, store: &dyn Store, sweep: &str, table: Option<&str>) -> Result<(), ResultsError> {
        let hash = format!("{:032x}", xxh3_128((sweep.to_owned() + table.unwrap_or_default()).as_bytes()));
        if self.is_old() || hash == self.input {
            return Ok(());
        }
        let reason = "it is not the sweep that was run: it has been changed".into();
        Err(ResultsError::Damaged { path: store.path(SWEEP_FILE), reason })
    }

    /// Version 0.1 hashed less.
    fn is_old(&self) -> bool {
        self.version.starts_with("0.1.")
    }

    /// Hash of all but the id.
    fn id(&self) -> String {
        let record = RunRecord { run_id: String::new(), ..self.clone() };
        // Runs that were written before there was this folder keep their ids.
        let text = format!("{record:?}").replace(", rows_in_folder: false", "");
        format!("{:032x}", xxh3_128(text.as_bytes()))
    }

    /// Refuses a directory whose run differs, naming what differs.
    pub(crate) fn check_same(&self, store: &dyn Store, theirs: &RunRecord) -> Result<(), ResultsError> {
        // The id of version 0.1 says little.
        if self.run_id == theirs.run_id && format!("{self:?}") == format!("{theirs:?}") {
            return Ok(());
        }
        let number = |number: u64| number.to_string();
        let choice = |mixed: bool| if mixed { "free" } else { "fixed" }.to_owned();
        let fields = [
            ("rodsweep version", theirs.version.clone(), self.version.clone()),
            ("number of samples", number(theirs.sample_count), number(self.sample_count)),
            ("chunk size", number(theirs.chunk), number(self.chunk)),
            ("format", theirs.format.clone(), self.format.clone()),
            ("choice of methods", choice(theirs.mixed), choice(self.mixed)),
            ("precision", theirs.precision.clone(), self.precision.clone()),
            ("scene or sweep", format!("hash {:.8}", theirs.input), format!("hash {:.8}", self.input)),
            ("set of columns", format!("hash {:.8}", theirs.columns), format!("hash {:.8}", self.columns)),
        ];
        let differs = fields.into_iter().find(|(_, theirs, ours)| theirs != ours);
        let method = || theirs.method?.difference(&self.method?);
        let unknown = || ("run id", theirs.run_id.clone(), self.run_id.clone());
        let (what, theirs, ours) = method().or(differs).unwrap_or_else(unknown);
        Err(ResultsError::Mismatch { dir: store.place(), what, theirs, ours })
    }
}

/// Makes or joins a directory for a run.
pub(crate) fn open(store: &dyn Store, record: &RunRecord, spec: &SweepSpec, resume: bool) -> Result<(), ResultsError> {
    store.prepare()?;
    if let Some(theirs) = RunRecord::find(store)? {
        check_input(store, record, &theirs, spec)?;
        if let Err(error) = record.check_same(store, &theirs) {
            // The pilot of a new run measures anew; only what users choose tells runs apart.
            let is_measured = matches!(&error, ResultsError::Mismatch { what, .. } if MEASURED.contains(what));
            if resume || !is_measured {
                return Err(error);
            }
        }
        if !resume {
            return Err(ResultsError::Exists { dir: store.place() });
        }
    } else {
        // Another shard may begin the run at this moment.
        let is_foreign = store.list("")?.iter().any(|entry| !entry.name.starts_with('.'));
        if is_foreign && store.head(RUN_FILE)?.is_none() {
            return Err(ResultsError::Foreign { dir: store.place() });
        }
        let text = serde_json::to_string_pretty(record).unwrap_or_default() + "\n";
        if !store.create(RUN_FILE, text.as_bytes())? {
            record.check_same(store, &RunRecord::read(store)?)?;
        }
    }
    if let Some(table) = &spec.table {
        store.put(RESOLVED_TABLE, table.to_csv(&spec.scene).as_bytes())?;
    }
    store.put(SWEEP_FILE, spec.to_toml().as_bytes())
}

/// What a method holds that no user asks for.
const MEASURED: [&str; 2] = ["error share", "derivative scale"];

/// Refuses a directory with the run of another scene or sweep, in the words of their files.
fn check_input(store: &dyn Store, ours: &RunRecord, theirs: &RunRecord, spec: &SweepSpec) -> Result<(), ResultsError> {
    if ours.input == theirs.input || ours.version != theirs.version {
        return Ok(());
    }
    // What is damaged is told by whoever reads it.
    let text = |bytes: Option<Vec<u8>>| bytes.and_then(|bytes| String::from_utf8(bytes).ok());
    let (sweep, table) = (text(store.get(SWEEP_FILE)?), text(store.get(RESOLVED_TABLE)?));
    let Some(sweep) = sweep else { return Ok(()) };
    let tables: Vec<(&str, &str)> = table.iter().map(|text| (RESOLVED_TABLE, text.as_str())).collect();
    let Ok(before) = SweepSpec::parse_with(&store.path(SWEEP_FILE), &sweep, &tables) else { return Ok(()) };
    // An engine may hold a run to a coarser tolerance; the method tells that.
    let as_coarse = SweepSpec { tolerance: spec.tolerance, ..before.clone() };
    if ours.method != theirs.method && as_coarse.to_toml() == spec.to_toml() && before.table == spec.table {
        return Ok(());
    }
    Err(ResultsError::Changed { dir: store.place(), changes: differences(spec, &before) })
}

/// Where a run without rows keeps its voxels: the measured workspace may have taken their name.
pub(crate) fn voxel_file(store: &dyn Store) -> Result<&'static str, ResultsError> {
    Ok(if store.head(TOUCHED_FILE)?.is_some() { TOUCHED_FILE } else { WORKSPACE_FILE })
}

/// Refuses a directory that holds another shard of a run without rows: there its numbers would be lost.
pub(crate) fn check_shard(store: &dyn Store, record: &RunRecord, shard: Shard) -> Result<(), ResultsError> {
    let theirs = match Manifest::find(store)? {
        Some(manifest) => manifest.run.map(|run| run.shard),
        None => match parts::check_run_table(store, voxel_file(store)?, &record.run_id)? {
            Some(kept) => kept.shard,
            None => return Ok(()),
        },
    };
    if theirs == Some(shard) {
        return Ok(());
    }
    let theirs = theirs.map_or("that of shards put together".into(), |shard| shard.to_string());
    Err(ResultsError::Mismatch { dir: store.place(), what: "shard", theirs, ours: shard.to_string() })
}

/// Parts of a directory by chunk: sound ones, and names of damaged ones with the reason.
#[derive(Debug)]
pub(crate) struct Parts {
    pub sound: BTreeMap<u64, PartInfo>,
    pub damaged: Vec<(String, String)>,
}

pub(crate) fn parts(store: &dyn Store, record: &RunRecord) -> Result<Parts, ResultsError> {
    let listed = record.part_files().list(store)?;
    let checked = at_once(store, &listed, |(chunk, entry)| check(store, entry, *chunk, record));
    let mut parts = Parts { sound: BTreeMap::new(), damaged: Vec::new() };
    for ((chunk, entry), checked) in listed.into_iter().zip(checked) {
        match checked {
            Ok(info) => drop(parts.sound.insert(chunk, info)),
            Err(ResultsError::Damaged { reason, .. }) => parts.damaged.push((entry.name.clone(), reason)),
            Err(error) => return Err(error),
        }
    }
    parts.damaged.sort();
    Ok(parts)
}

/// What `of` makes of each item, many at once: files of this machine wait for processors, others for replies.
fn at_once<T: Sync, R: Send>(store: &dyn Store, items: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    const REPLIES: usize = 16;
    let threads = if store.is_remote() { REPLIES } else { std::thread::available_parallelism().map_or(1, usize::from) };
    let share = items.len().div_ceil(threads.max(1)).max(1);
    std::thread::scope(|scope| {
        let of = &of;
        let workers: Vec<_> =
            items.chunks(share).map(|items| scope.spawn(move || items.iter().map(of).collect::<Vec<R>>())).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
    })
}

/// Whether a part is whole, of this run, and holds its chunk's samples.
fn check(store: &dyn Store, entry: &Entry, chunk: u64, record: &RunRecord) -> Result<PartInfo, ResultsError> {
    let damaged = |reason: &str| ResultsError::Damaged { path: store.path(&entry.name), reason: reason.into() };
    if !entry.is_file {
        let what = files::irregular(&store.path(&entry.name)).unwrap_or("not a file");
        return Err(damaged(&format!("it is {what}")));
    }
    let info = parts::look_at_part(store, entry, record.format())?;
    if info.run_id != record.run_id {
        return Err(damaged("it belongs to another run"));
    }
    if chunk >= record.chunk_count() || (info.first, info.sample_count()) != record.chunk_range(chunk) {
        return Err(damaged("it does not hold the samples of its number"));
    }
    Ok(info)
}

/// Metadata that every file of a run carries.
pub(crate) fn metadata(spec: &SweepSpec, record: &RunRecord) -> FileMetadata {
    FileMetadata {
        run_id: record.run_id.clone(),
        engine: String::new(),
        method: record.method,
        sweep: spec.to_toml(),
        seed: spec.seed,
        verdict: "in manifest.json".into(),
    }
}
