//! Part files: encode in memory, write whole or not at all, read back, check.
//!
//! A Parquet part carries the XXH3 of its data pages and its counts in the footer; a CSV or NPZ part has them in a
//! sidecar `<part>.json`, written before it.

use super::error::ResultsError;
use super::layout::BRANCH_COLUMN;
use crate::files;
use crate::model::Status;
use crate::spec::Format;
use crate::table::{self, Table, TableError};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use xxhash_rust::xxh3::xxh3_64;

/// Key of what a part says about itself.
const PART_KEY: &str = "rodsweep.part";

/// What a part says about itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PartInfo {
    pub run_id: String,
    pub rows: u64,
    /// Where a sample may have several rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<u64>,
    /// First sample.
    pub first: u64,
    /// Rows by status code.
    pub counts: Vec<u64>,
    /// What solved it, second attempts aside.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub engine: String,
    pub checksum: String,
}

impl PartInfo {
    pub fn sample_count(&self) -> u64 {
        self.samples.unwrap_or(self.rows)
    }
}

/// What every file of a run carries.
#[derive(Clone, Debug)]
pub(crate) struct FileMetadata {
    pub run_id: String,
    /// What solves.
    pub engine: String,
    /// The resolved sweep.
    pub sweep: String,
    pub seed: u64,
}

/// Name of a chunk's part.
pub(crate) fn part_name(chunk: u64, format: Format) -> String {
    format!("part-{chunk:010}.{}", format.name())
}

/// Chunk of a part file's name.
pub(crate) fn part_chunk(name: &str, format: Format) -> Option<u64> {
    let digits = name.strip_prefix("part-")?.strip_suffix(format.name())?.strip_suffix('.')?;
    (digits.len() >= 10).then(|| digits.parse().ok()).flatten()
}

pub(crate) fn info_of(table: &Table, metadata: &FileMetadata) -> PartInfo {
    let mut counts = vec![0; Status::ALL.len()];
    for status in table.statuses() {
        counts[status.code() as usize] += 1;
    }
    PartInfo {
        run_id: metadata.run_id.clone(),
        rows: table.row_count() as u64,
        samples: table.column(BRANCH_COLUMN).map(|_| table.sample_count()),
        first: table.samples().first().copied().unwrap_or(0),
        counts,
        engine: metadata.engine.clone(),
        checksum: String::new(),
    }
}

/// Writes a part unless one is there; then the one there is checked and kept. Returns what lies on disk.
///
/// `bytes` is memory to encode in, used again from part to part.
pub(crate) fn write_part(
    path: &Path,
    table: &Table,
    format: Format,
    metadata: &FileMetadata,
    bytes: &mut Vec<u8>,
) -> Result<PartInfo, ResultsError> {
    let mut info = info_of(table, metadata);
    match format {
        Format::Parquet => encode_parquet(table, metadata, &mut info, bytes).map_err(ResultsError::table(path))?,
        Format::Csv => *bytes = table::csv::encode(table),
        Format::Npz | Format::None => *bytes = table::npz::encode(table).map_err(ResultsError::table(path))?,
    }
    if format != Format::Parquet {
        info.checksum = checksum(bytes);
        let text = serde_json::to_string(&info).unwrap_or_default();
        write_atomically(&sidecar(path), text.as_bytes(), true)?;
    }
    if write_atomically(path, bytes, false)? { Ok(info) } else { check_part(path, format) }
}

/// Makes `bytes` a Parquet part and completes `info` by the checksum.
fn encode_parquet(
    table: &Table,
    metadata: &FileMetadata,
    info: &mut PartInfo,
    bytes: &mut Vec<u8>,
) -> Result<(), TableError> {
    table::parquet::encode_into(table, bytes, |data| {
        info.checksum = checksum(data);
        let pairs = [
            ("rodsweep.sweep", metadata.sweep.clone()),
            ("rodsweep.seed", metadata.seed.to_string()),
            ("rodsweep.version", env!("CARGO_PKG_VERSION").to_owned()),
            (PART_KEY, serde_json::to_string(info).unwrap_or_default()),
        ];
        pairs.map(|(key, value)| (key.to_owned(), value)).into()
    })
}

/// Checks a part's checksum and returns what it says about itself.
pub(crate) fn check_part(path: &Path, format: Format) -> Result<PartInfo, ResultsError> {
    let damaged = |reason: &str| ResultsError::Damaged { path: path.into(), reason: reason.into() };
    if let Some(what) = files::irregular(path) {
        return Err(damaged(&format!("it is {what}")));
    }
    let bytes = files::read(path).map_err(ResultsError::io(path, "reading"))?;
    if format == Format::Parquet {
        let footer = table::parquet::footer(&bytes).map_err(ResultsError::table(path))?;
        let text = footer.get(PART_KEY).ok_or_else(|| damaged("its footer has no checksum"))?;
        let info: PartInfo = serde_json::from_str(text).map_err(|error| damaged(&error.to_string()))?;
        let length = info.checksum.rsplit(':').next().and_then(|length| length.parse().ok()).unwrap_or(usize::MAX);
        return match bytes.get(..length) {
            Some(data) if checksum(data) == info.checksum && footer.row_count == info.rows => Ok(info),
            _ => Err(damaged("the checksum differs")),
        };
    }
    let text = files::read(&sidecar(path)).map_err(|_| damaged("its checksum file is missing"))?;
    let info: PartInfo = serde_json::from_slice(&text).map_err(|_| damaged("its checksum file cannot be read"))?;
    if info.checksum == checksum(&bytes) { Ok(info) } else { Err(damaged("the checksum differs")) }
}

/// Reads the columns named (all, if none are) of a part, in the part's order. `like` gives the kinds of text formats.
pub(crate) fn read_part(path: &Path, format: Format, names: &[&str], like: &Table) -> Result<Table, ResultsError> {
    let table = match format {
        Format::Parquet => table::parquet::read(path, names),
        Format::Csv => table::csv::read(path, names, like),
        Format::Npz | Format::None => table::npz::read(path, names, like),
    };
    table.map_err(ResultsError::table(path))
}

/// Writes a table of a run that is not a part (voxels, tips) as Parquet, replacing what is there.
pub(crate) fn write_run_table(path: &Path, table: &Table, metadata: &FileMetadata) -> Result<(), ResultsError> {
    let mut info = info_of(table, metadata);
    let mut bytes = Vec::new();
    encode_parquet(table, metadata, &mut info, &mut bytes).map_err(ResultsError::table(path))?;
    write_atomically(path, &bytes, true).map(|_| ())
}

/// Writes a table, replacing what is there: Parquet if the name ends in `.parquet`, else CSV, which has no place for
/// units and metadata.
///
/// # Errors
///
/// A table that the format cannot hold, or a file that cannot be written.
pub fn write_table(path: &Path, table: &Table, metadata: &[(&str, String)]) -> Result<(), ResultsError> {
    let is_parquet = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    let bytes = if is_parquet {
        table::parquet::encode(table, metadata).map_err(ResultsError::table(path))?
    } else {
        table::csv::encode(table)
    };
    write_atomically(path, &bytes, true).map(|_| ())
}

/// Makes a directory for files, and those above it.
///
/// # Errors
///
/// A directory that cannot be made.
pub fn make_directory(dir: &Path) -> Result<(), ResultsError> {
    std::fs::create_dir_all(dir).map_err(ResultsError::io(dir, "making the directory"))
}

/// Writes a file whole or not at all, replacing what is there.
///
/// # Errors
///
/// A file that cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), ResultsError> {
    write_atomically(path, bytes, true).map(|_| ())
}

/// Moves a damaged part and its sidecar out of the way.
pub(crate) fn quarantine(path: &Path) -> Result<PathBuf, ResultsError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let free = (0..).map(|k| path.with_file_name(format!("{name}.bad-{k}"))).find(|to| !to.exists());
    let to = free.unwrap_or_else(|| path.with_file_name(format!("{name}.bad")));
    std::fs::rename(path, &to).map_err(ResultsError::io(path, "moving a damaged part away"))?;
    let _ = std::fs::remove_file(sidecar(path));
    Ok(to)
}

pub(crate) fn sidecar(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

pub(crate) fn checksum(bytes: &[u8]) -> String {
    format!("xxh3:{:016x}:{}", xxh3_64(bytes), bytes.len())
}

/// Temporary file, fsync, then link (fails if the name is taken) or rename, fsync of the folder. False: taken.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8], replace: bool) -> Result<bool, ResultsError> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let unique = COUNTER.fetch_add(1, Ordering::Relaxed);
    let temporary = path.with_file_name(format!(".{name}.tmp-{}-{unique}", std::process::id()));
    let written = (|| {
        let mut file = std::fs::File::create_new(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()
    })();
    let placed = written.and_then(|()| place(&temporary, path, replace));
    let _ = std::fs::remove_file(&temporary);
    let placed = placed.map_err(ResultsError::io(path, "writing"))?;
    sync_folder(path);
    Ok(placed)
}

fn place(temporary: &Path, path: &Path, replace: bool) -> std::io::Result<bool> {
    if replace {
        return std::fs::rename(temporary, path).map(|()| true);
    }
    match std::fs::hard_link(temporary, path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => Ok(false),
        // A file system without hard links.
        Err(_) if path.exists() => Ok(false),
        Err(_) => std::fs::rename(temporary, path).map(|()| true),
    }
}

/// Makes a new name in a folder survive a power loss, where the system can.
fn sync_folder(path: &Path) {
    if let Some(folder) = path.parent() {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        if let Ok(folder) = std::fs::File::open(folder) {
            let _ = folder.sync_all();
        }
    }
}
