//! A result directory: its identity, what lies in it, who may write to it.

use super::error::SweepError;
use super::sink::{self, FileMetadata, PartInfo};
use super::spec::{Format, RESOLVED_TABLE, SweepSpec};
use crate::backend::Precision;
use crate::table::{Column, Table};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use xxhash_rust::xxh3::xxh3_128;

pub(super) const RUN_FILE: &str = "run.json";
pub(super) const SWEEP_FILE: &str = "sweep.toml";
pub(super) const MANIFEST_FILE: &str = "manifest.json";

/// What a run is. Never changes; every part carries `run_id`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Hash of all that follows.
    pub run_id: String,
    pub version: String,
    pub sample_count: u64,
    /// Samples in a part.
    pub chunk: u64,
    pub format: String,
    pub precision: String,
    /// Hash of the resolved scene and sweep.
    pub input: String,
    /// Hash of the columns.
    pub columns: String,
}

impl RunRecord {
    pub(super) fn new(
        spec: &SweepSpec,
        schema: &str,
        sample_count: u64,
        chunk: u64,
        precision: Precision,
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
            precision: precision.to_string(),
            input: hash(&input),
            columns: hash(schema),
        };
        record.run_id = hash(&format!("{record:?}"));
        record
    }

    pub fn chunk_count(&self) -> u64 {
        self.sample_count.div_ceil(self.chunk)
    }

    /// First sample and number of samples of a chunk.
    pub fn chunk_range(&self, chunk: u64) -> (u64, u64) {
        let start = chunk * self.chunk;
        (start, self.chunk.min(self.sample_count.saturating_sub(start)))
    }

    pub fn format(&self) -> Format {
        Format::ALL.into_iter().find(|format| format.name() == self.format).unwrap_or(Format::Parquet)
    }

    pub(super) fn read(dir: &Path) -> Result<RunRecord, SweepError> {
        let path = dir.join(RUN_FILE);
        let text = std::fs::read_to_string(&path).map_err(|_| SweepError::NoRun { dir: dir.into() })?;
        serde_json::from_str(&text).map_err(|error| SweepError::Damaged { path, reason: error.to_string() })
    }

    /// Refuses a directory whose run differs, naming what differs.
    pub(super) fn check_same(&self, dir: &Path, theirs: &RunRecord) -> Result<(), SweepError> {
        if self.run_id == theirs.run_id {
            return Ok(());
        }
        let number = |number: u64| number.to_string();
        let fields = [
            ("rodsweep version", theirs.version.clone(), self.version.clone()),
            ("number of samples", number(theirs.sample_count), number(self.sample_count)),
            ("chunk size", number(theirs.chunk), number(self.chunk)),
            ("format", theirs.format.clone(), self.format.clone()),
            ("precision", theirs.precision.clone(), self.precision.clone()),
            ("scene or sweep", format!("hash {:.8}", theirs.input), format!("hash {:.8}", self.input)),
            ("set of columns", format!("hash {:.8}", theirs.columns), format!("hash {:.8}", self.columns)),
        ];
        let differs = fields.into_iter().find(|(_, theirs, ours)| theirs != ours);
        let unknown = || ("run id", theirs.run_id.clone(), self.run_id.clone());
        let (what, theirs, ours) = differs.unwrap_or_else(unknown);
        Err(SweepError::Mismatch { dir: dir.into(), what, theirs, ours })
    }
}

/// Makes or joins a directory for a run.
pub(super) fn open(dir: &Path, record: &RunRecord, spec: &SweepSpec, resume: bool) -> Result<(), SweepError> {
    std::fs::create_dir_all(dir).map_err(SweepError::io(dir, "making the result directory"))?;
    let run_file = dir.join(RUN_FILE);
    if run_file.exists() {
        record.check_same(dir, &RunRecord::read(dir)?)?;
        if !resume {
            return Err(SweepError::Exists { dir: dir.into() });
        }
    } else {
        if names(dir)?.iter().any(|name| !name.starts_with('.')) {
            return Err(SweepError::Foreign { dir: dir.into() });
        }
        let text = serde_json::to_string_pretty(record).unwrap_or_default() + "\n";
        if !sink::write_atomically(&run_file, text.as_bytes(), false)? {
            record.check_same(dir, &RunRecord::read(dir)?)?;
        }
    }
    remove_stale_temporaries(dir)?;
    if let Some(table) = &spec.table {
        sink::write_atomically(&dir.join(RESOLVED_TABLE), table.to_csv(&spec.scene).as_bytes(), true)?;
    }
    sink::write_atomically(&dir.join(SWEEP_FILE), spec.to_toml().as_bytes(), true)?;
    Ok(())
}

pub(super) fn names(dir: &Path) -> Result<Vec<String>, SweepError> {
    let entries = std::fs::read_dir(dir).map_err(SweepError::io(dir, "listing"))?;
    Ok(entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect())
}

/// Temporary files that no live writer can still be writing.
fn remove_stale_temporaries(dir: &Path) -> Result<(), SweepError> {
    const STALE: Duration = Duration::from_secs(3600);
    for name in names(dir)?.iter().filter(|name| name.starts_with('.') && name.contains(".tmp-")) {
        let path = dir.join(name);
        let modified = std::fs::metadata(&path).and_then(|metadata| metadata.modified());
        let age = modified.ok().and_then(|modified| SystemTime::now().duration_since(modified).ok());
        if age.is_some_and(|age| age > STALE) {
            let _ = std::fs::remove_file(&path);
        }
    }
    Ok(())
}

/// Parts of a directory by chunk: sound ones, and paths of damaged ones with the reason.
pub(super) struct Parts {
    pub sound: BTreeMap<u64, PartInfo>,
    pub damaged: Vec<(PathBuf, String)>,
}

pub(super) fn parts(dir: &Path, record: &RunRecord) -> Result<Parts, SweepError> {
    let mut parts = Parts { sound: BTreeMap::new(), damaged: Vec::new() };
    let format = record.format();
    for name in names(dir)? {
        let Some(chunk) = sink::part_chunk(&name, format) else { continue };
        let path = dir.join(&name);
        match check(&path, chunk, record) {
            Ok(info) => drop(parts.sound.insert(chunk, info)),
            Err(SweepError::Damaged { reason, .. }) => parts.damaged.push((path, reason)),
            Err(error) => return Err(error),
        }
    }
    parts.damaged.sort();
    Ok(parts)
}

/// Whether a part is whole, of this run, and holds its chunk's samples.
fn check(path: &Path, chunk: u64, record: &RunRecord) -> Result<PartInfo, SweepError> {
    let damaged = |reason: &str| SweepError::Damaged { path: path.into(), reason: reason.into() };
    let info = sink::check_part(path, record.format())?;
    if info.run_id != record.run_id {
        return Err(damaged("it belongs to another run"));
    }
    if chunk >= record.chunk_count() || (info.first, info.sample_count()) != record.chunk_range(chunk) {
        return Err(damaged("it does not hold the samples of its number"));
    }
    Ok(info)
}

pub(super) fn part_path(dir: &Path, chunk: u64, format: Format) -> PathBuf {
    dir.join(sink::part_name(chunk, format))
}

/// Metadata that every file of a run carries.
pub(super) fn metadata(spec: &SweepSpec, record: &RunRecord) -> FileMetadata {
    FileMetadata { run_id: record.run_id.clone(), sweep: spec.to_toml(), seed: spec.seed }
}

/// Names of the columns that are not derivatives.
pub(super) fn plain_columns(columns: &Table) -> Vec<&str> {
    let names = columns.columns.iter().map(|column: &Column| column.name.as_str());
    names.filter(|name| !name.starts_with("d(")).collect()
}
