//! A result directory: its identity, what lies in it, who may write to it.

use super::error::ResultsError;
use super::parts::{self, FileMetadata, PartInfo};
use crate::files;
use crate::spec::{Format, RESOLVED_TABLE, SolutionMethod, SweepSpec};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use xxhash_rust::xxh3::xxh3_128;

pub(crate) const RUN_FILE: &str = "run.json";
pub(crate) const SWEEP_FILE: &str = "sweep.toml";
pub(crate) const MANIFEST_FILE: &str = "manifest.json";
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
    /// Hash of the resolved scene and sweep.
    pub input: String,
    /// Hash of the columns.
    pub columns: String,
}

impl RunRecord {
    pub(crate) fn new(
        spec: &SweepSpec,
        schema: &str,
        sample_count: u64,
        chunk: u64,
        method: SolutionMethod,
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
            precision: method.precision.to_string(),
            method: Some(method),
            input: hash(&input),
            columns: hash(schema),
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

    /// Format of the parts.
    pub fn format(&self) -> Format {
        Format::ALL.into_iter().find(|format| format.name() == self.format).unwrap_or(Format::Parquet)
    }

    pub(crate) fn read(dir: &Path) -> Result<RunRecord, ResultsError> {
        let path = dir.join(RUN_FILE);
        if !files::is_taken(&path) {
            return Err(ResultsError::NoRun { dir: dir.into() });
        }
        let bytes = files::read(&path).map_err(ResultsError::io(&path, "reading"))?;
        let unsound = |reason: String| ResultsError::Identity { path: path.clone(), reason };
        let record: RunRecord = serde_json::from_slice(&bytes).map_err(|error| unsound(error.to_string()))?;
        record.check().map_err(unsound)?;
        Ok(record)
    }

    /// Whether the numbers can be those of a run, and the id is theirs.
    fn check(&self) -> Result<(), String> {
        let Some(format) = Format::ALL.into_iter().find(|format| format.name() == self.format) else {
            return Err(format!("no format is called \"{}\"", self.format));
        };
        if self.chunk == 0 || self.sample_count == 0 || self.sample_count > format.most_samples() {
            return Err(format!("no run has {} samples in parts of {}", self.sample_count, self.chunk));
        }
        // Other versions may have hashed more, or less.
        if self.version == env!("CARGO_PKG_VERSION") && self.run_id != self.id() {
            return Err("its run id does not fit what it says: it has been changed".into());
        }
        Ok(())
    }

    /// Hash of all but the id.
    fn id(&self) -> String {
        let record = RunRecord { run_id: String::new(), ..self.clone() };
        format!("{:032x}", xxh3_128(format!("{record:?}").as_bytes()))
    }

    /// Refuses a directory whose run differs, naming what differs.
    pub(crate) fn check_same(&self, dir: &Path, theirs: &RunRecord) -> Result<(), ResultsError> {
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
        let method = || theirs.method?.difference(&self.method?);
        let unknown = || ("run id", theirs.run_id.clone(), self.run_id.clone());
        let (what, theirs, ours) = method().or(differs).unwrap_or_else(unknown);
        Err(ResultsError::Mismatch { dir: dir.into(), what, theirs, ours })
    }
}

/// Makes or joins a directory for a run.
pub(crate) fn open(dir: &Path, record: &RunRecord, spec: &SweepSpec, resume: bool) -> Result<(), ResultsError> {
    std::fs::create_dir_all(dir).map_err(ResultsError::io(dir, "making the result directory"))?;
    let run_file = dir.join(RUN_FILE);
    if files::is_taken(&run_file) {
        record.check_same(dir, &RunRecord::read(dir)?)?;
        if !resume {
            return Err(ResultsError::Exists { dir: dir.into() });
        }
    } else {
        // Another shard may begin the run at this moment.
        if names(dir)?.iter().any(|name| !name.starts_with('.')) && !files::is_taken(&run_file) {
            return Err(ResultsError::Foreign { dir: dir.into() });
        }
        let text = serde_json::to_string_pretty(record).unwrap_or_default() + "\n";
        if !parts::write_atomically(&run_file, text.as_bytes(), false)? {
            record.check_same(dir, &RunRecord::read(dir)?)?;
        }
    }
    remove_stale_temporaries(dir)?;
    if let Some(table) = &spec.table {
        parts::write_atomically(&dir.join(RESOLVED_TABLE), table.to_csv(&spec.scene).as_bytes(), true)?;
    }
    parts::write_atomically(&dir.join(SWEEP_FILE), spec.to_toml().as_bytes(), true)?;
    Ok(())
}

pub(crate) fn names(dir: &Path) -> Result<Vec<String>, ResultsError> {
    let entries = std::fs::read_dir(dir).map_err(ResultsError::io(dir, "listing"))?;
    Ok(entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect())
}

/// Temporary files that no live writer can still be writing.
fn remove_stale_temporaries(dir: &Path) -> Result<(), ResultsError> {
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
pub(crate) struct Parts {
    pub sound: BTreeMap<u64, PartInfo>,
    pub damaged: Vec<(PathBuf, String)>,
}

pub(crate) fn parts(dir: &Path, record: &RunRecord) -> Result<Parts, ResultsError> {
    let mut parts = Parts { sound: BTreeMap::new(), damaged: Vec::new() };
    let format = record.format();
    for name in names(dir)? {
        let Some(chunk) = parts::part_chunk(&name, format) else { continue };
        let path = dir.join(&name);
        match check(&path, chunk, record) {
            Ok(info) => drop(parts.sound.insert(chunk, info)),
            Err(ResultsError::Damaged { reason, .. }) => parts.damaged.push((path, reason)),
            Err(error) => return Err(error),
        }
    }
    parts.damaged.sort();
    Ok(parts)
}

/// Whether a part is whole, of this run, and holds its chunk's samples.
fn check(path: &Path, chunk: u64, record: &RunRecord) -> Result<PartInfo, ResultsError> {
    let damaged = |reason: &str| ResultsError::Damaged { path: path.into(), reason: reason.into() };
    let info = parts::check_part(path, record.format())?;
    if info.run_id != record.run_id {
        return Err(damaged("it belongs to another run"));
    }
    if chunk >= record.chunk_count() || (info.first, info.sample_count()) != record.chunk_range(chunk) {
        return Err(damaged("it does not hold the samples of its number"));
    }
    Ok(info)
}

pub(crate) fn part_path(dir: &Path, chunk: u64, format: Format) -> PathBuf {
    dir.join(parts::part_name(chunk, format))
}

/// Metadata that every file of a run carries.
pub(crate) fn metadata(spec: &SweepSpec, record: &RunRecord) -> FileMetadata {
    FileMetadata { run_id: record.run_id.clone(), engine: String::new(), sweep: spec.to_toml(), seed: spec.seed }
}
