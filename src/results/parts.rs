//! Part files: encode in memory, write whole or not at all, read back, check.
//!
//! A Parquet part carries the XXH3 of its data pages and its counts in the footer, which carries one of itself. A CSV or NPZ
//! part has them in a sidecar `<part>.<XXH3>.json`, written before it and likewise sealed: every byte is covered. The name of the sidecar tells which bytes it is of, so that a part with another
//! writer's bytes never meets it: the part's own name is the one commit record.

use super::error::ResultsError;
use super::layout::BRANCH_COLUMN;
use super::reduce::failures;
use super::store::{Entry, ROWS_FOLDER, Store, file_name, store_at, store_of};
use crate::model::Status;
use crate::spec::{Format, Shard, SolutionMethod};
use crate::table::parquet::Encoder;
use crate::table::{self, Column, Table, TableError};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// Key of what a part says about itself.
const PART_KEY: &str = "rodsweep.part";

/// What a part says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// By what; parts of versions before 0.3 do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<SolutionMethod>,
    pub checksum: String,
    /// Of a table that a run without rows keeps: which samples its numbers are of; `None` where shards were put together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// In a sidecar: hash of all the rest. In Parquet the footer has one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub seal: String,
}

impl PartInfo {
    fn own_seal(&self) -> String {
        let rest = PartInfo { seal: String::new(), ..self.clone() };
        format!("{:016x}", xxh3_64(serde_json::to_string(&rest).unwrap_or_default().as_bytes()))
    }

    /// Of a sidecar, if it is to the byte what was written.
    fn of_sidecar(text: &[u8]) -> Option<PartInfo> {
        let info: PartInfo = serde_json::from_slice(text).ok()?;
        (info.seal == info.own_seal() && serde_json::to_vec(&info).is_ok_and(|own| own == text)).then_some(info)
    }

    pub fn sample_count(&self) -> u64 {
        self.samples.unwrap_or(self.rows)
    }

    pub fn failed(&self) -> u64 {
        let mut counts = [0; Status::ALL.len()];
        counts.iter_mut().zip(&self.counts).for_each(|(count, of)| *count = *of);
        failures(&counts, self.samples.is_some())
    }
}

/// What every file of a run carries.
#[derive(Clone, Debug)]
pub(crate) struct FileMetadata {
    pub run_id: String,
    /// What solves.
    pub engine: String,
    /// By what.
    pub method: Option<SolutionMethod>,
    /// The resolved sweep.
    pub sweep: String,
    pub seed: u64,
    /// Whether the rows can be trusted, as far as it is known when the file is written.
    pub verdict: String,
}

/// Where the parts of a run lie, and how they are named.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PartFiles {
    pub format: Format,
    /// They lie in [`ROWS_FOLDER`].
    pub in_folder: bool,
}

impl PartFiles {
    /// Name of a chunk's part in the store.
    pub fn name(self, chunk: u64) -> String {
        self.placed(&format!("part-{chunk:010}.{}", self.format.name()))
    }

    /// The parts that are there, by their names, with their chunks.
    pub fn list(self, store: &dyn Store) -> Result<Vec<(u64, Entry)>, ResultsError> {
        let listed = store.list(if self.in_folder { ROWS_FOLDER } else { "" })?;
        let of_part =
            |entry: Entry| Some((self.chunk(&entry.name)?, Entry { name: self.placed(&entry.name), ..entry }));
        Ok(listed.into_iter().filter_map(of_part).collect())
    }

    /// Chunk of a part by the name of its file.
    fn chunk(self, name: &str) -> Option<u64> {
        let digits = name.strip_prefix("part-")?.strip_suffix(self.format.name())?.strip_suffix('.')?;
        (digits.len() >= 10).then(|| digits.parse().ok()).flatten()
    }

    fn placed(self, name: &str) -> String {
        if self.in_folder { format!("{ROWS_FOLDER}/{name}") } else { name.into() }
    }
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
        method: metadata.method,
        checksum: String::new(),
        shard: None,
        seal: String::new(),
    }
}

/// Writes a part unless one is there; then the one there is checked and kept. Returns what lies in the store, and whether
/// that is new.
///
/// `bytes` is memory to encode in, used again from part to part.
pub(crate) fn write_part(
    store: &dyn Store,
    name: &str,
    table: &Table,
    format: Format,
    metadata: &FileMetadata,
    encoder: &mut Encoder,
) -> Result<(PartInfo, bool), ResultsError> {
    let mut info = info_of(table, metadata);
    let path = store.path(name);
    match format {
        Format::Parquet => encode_parquet(table, metadata, &mut info, encoder).map_err(ResultsError::table(&path))?,
        Format::Csv => encoder.bytes = table::csv::encode(table),
        Format::Npz | Format::None => encoder.bytes = table::npz::encode(table).map_err(ResultsError::table(&path))?,
    }
    if format != Format::Parquet {
        info.checksum = checksum(&encoder.bytes);
    }
    place_part(store, name, format, info, &encoder.bytes)
}

/// Puts a part that is encoded, its sidecar before it, unless there is one.
pub(crate) fn place_part(
    store: &dyn Store,
    name: &str,
    format: Format,
    mut info: PartInfo,
    bytes: &[u8],
) -> Result<(PartInfo, bool), ResultsError> {
    if format != Format::Parquet {
        info.seal = info.own_seal();
        let (sidecar, text) = (sidecar(name, bytes), serde_json::to_string(&info).unwrap_or_default());
        let is_sound = |text: Vec<u8>| PartInfo::of_sidecar(&text).is_some();
        if !store.create(&sidecar, text.as_bytes())? && !store.get(&sidecar)?.is_some_and(is_sound) {
            store.put(&sidecar, text.as_bytes())?;
        }
    }
    if store.create(name, bytes)? { Ok((info, true)) } else { Ok((check_part(store, name, format)?, false)) }
}

/// Makes a Parquet part and completes `info` by the checksum.
fn encode_parquet(
    table: &Table,
    metadata: &FileMetadata,
    info: &mut PartInfo,
    encoder: &mut Encoder,
) -> Result<(), TableError> {
    encoder.encode(table, |data| {
        info.checksum = checksum(data);
        let pairs = [
            ("rodsweep.sweep", metadata.sweep.clone()),
            ("rodsweep.seed", metadata.seed.to_string()),
            ("rodsweep.version", env!("CARGO_PKG_VERSION").to_owned()),
            (VERDICT_KEY, metadata.verdict.clone()),
            (PART_KEY, serde_json::to_string(info).unwrap_or_default()),
        ];
        pairs.map(|(key, value)| (key.to_owned(), value)).into()
    })
}

/// Checks a part's checksum and returns what it says about itself.
pub(crate) fn check_part(store: &dyn Store, name: &str, format: Format) -> Result<PartInfo, ResultsError> {
    let path = store.path(name);
    let damaged = |reason: &str| ResultsError::Damaged { path: path.clone(), reason: reason.into() };
    let bytes = store.get(name)?.ok_or_else(|| damaged("it is gone"))?;
    if format == Format::Parquet {
        let said = said_by_footer(&bytes, &path)?;
        return match data_length(&said.info).and_then(|length| bytes.split_at_checked(length)) {
            Some((data, rest)) if checksum(data) == said.info.checksum && said.is_sound(rest) => Ok(said.info),
            _ => Err(damaged("the checksum differs")),
        };
    }
    // Version 0.1 had one sidecar a part, without a seal.
    let (text, is_old) = match store.get(&sidecar(name, &bytes))? {
        Some(text) => (Some(text), false),
        None => (store.get(&format!("{name}.json"))?, true),
    };
    let text = text.ok_or_else(|| damaged("it is not what was written: no checksum file is of its bytes"))?;
    let info = if is_old { serde_json::from_slice(&text).ok() } else { PartInfo::of_sidecar(&text) };
    let info = info.ok_or_else(|| damaged("its checksum file is damaged"))?;
    if info.checksum == checksum(&bytes) { Ok(info) } else { Err(damaged("the checksum differs")) }
}

/// What a part says about itself, without reading all of one that is far away: the store keeps its bytes as they are.
pub(crate) fn look_at_part(store: &dyn Store, entry: &Entry, format: Format) -> Result<PartInfo, ResultsError> {
    /// A footer is rarely longer.
    const END: u64 = 64 << 10;
    let name = &entry.name;
    if !store.is_remote() || format != Format::Parquet {
        return check_part(store, name, format);
    }
    let path = store.path(name);
    let mut end = store.get_range(name, entry.size.saturating_sub(END)..entry.size)?;
    let length = table::parquet::footer_length(&end).unwrap_or(0);
    if length > end.len() as u64 {
        end = store.get_range(name, entry.size.saturating_sub(length)..entry.size)?;
    }
    let said = said_by_footer(&end, &path)?;
    let damaged = |reason: &str| ResultsError::Damaged { path: path.clone(), reason: reason.into() };
    let start = data_length(&said.info).map_or(u64::MAX, |length| length as u64);
    if start > entry.size {
        return Err(damaged("its length differs"));
    }
    let fetched = end.len() as u64;
    if entry.size - start > fetched {
        end = store.get_range(name, start..entry.size)?;
    }
    let rest = end.len().checked_sub((entry.size - start) as usize).and_then(|from| end.get(from..));
    if rest.is_some_and(|rest| said.is_sound(rest)) { Ok(said.info) } else { Err(damaged("the checksum differs")) }
}

/// What the footer of a part says.
struct Said {
    info: PartInfo,
    rows: u64,
    /// Written by a version whose footers carry no checksum.
    is_old: bool,
}

impl Said {
    /// Whether all that follows the data is as it was written.
    fn is_sound(&self, after_data: &[u8]) -> bool {
        self.rows == self.info.rows && table::parquet::is_sealed(after_data).unwrap_or(self.is_old)
    }
}

fn said_by_footer(bytes: &[u8], path: &Path) -> Result<Said, ResultsError> {
    let damaged = |reason: &str| ResultsError::Damaged { path: path.into(), reason: reason.into() };
    let footer = table::parquet::footer(bytes).map_err(ResultsError::table(path))?;
    let text = footer.get(PART_KEY).ok_or_else(|| damaged("its footer has no checksum"))?;
    let info = serde_json::from_str(text).map_err(|error| damaged(&error.to_string()))?;
    let is_old = footer.get("rodsweep.version").is_some_and(|version| version.starts_with("0.1."));
    Ok(Said { info, rows: footer.row_count, is_old })
}

/// Bytes that the checksum is of.
fn data_length(info: &PartInfo) -> Option<usize> {
    info.checksum.rsplit(':').next()?.parse().ok()
}

/// Reads the columns named (all, if none are) of a part, in the part's order. `like` gives the kinds of text formats.
pub(crate) fn read_part(
    store: &Arc<dyn Store>,
    name: &str,
    format: Format,
    names: &[&str],
    like: &Table,
) -> Result<Table, ResultsError> {
    let path = store.path(name);
    let missing = || ResultsError::io(&path, "reading")(std::io::ErrorKind::NotFound.into());
    let table = match format {
        Format::Parquet => {
            let size = store.head(name)?.ok_or_else(missing)?.size;
            table::parquet::read_from(Arc::new(Part { store: store.clone(), name: name.into(), size }), names)
        }
        Format::Csv => {
            let bytes = store.get(name)?.ok_or_else(missing)?;
            let text = std::str::from_utf8(&bytes);
            let text =
                text.map_err(|_| ResultsError::Damaged { path: path.clone(), reason: "it is no text".into() })?;
            table::csv::decode(text, names, like)
        }
        Format::Npz | Format::None => table::npz::decode(&store.get(name)?.ok_or_else(missing)?, names, like),
    };
    table.map_err(ResultsError::table(&path))
}

/// A file of a store, read by ranges.
struct Part {
    store: Arc<dyn Store>,
    name: String,
    size: u64,
}

impl table::parquet::ByteSource for Part {
    fn size(&self) -> u64 {
        self.size
    }

    fn read(&self, range: Range<u64>) -> std::io::Result<Vec<u8>> {
        self.store.get_range(&self.name, range).map_err(std::io::Error::other)
    }
}

/// What the tables that a run without rows keeps are of.
pub(crate) struct Kept {
    /// `None`: shards put together.
    pub shard: Option<Shard>,
    pub samples: u64,
    /// Rows by status code.
    pub counts: [u64; Status::ALL.len()],
}

/// Writes a table of a run that is not a part (voxels, tips) as Parquet, replacing what is there.
pub(crate) fn write_run_table(
    store: &dyn Store,
    name: &str,
    table: &Table,
    metadata: &FileMetadata,
    kept: &Kept,
) -> Result<(), ResultsError> {
    let of_table = info_of(table, metadata);
    let mut info = PartInfo { samples: Some(kept.samples), counts: kept.counts.into(), shard: kept.shard, ..of_table };
    let mut encoder = Encoder::default();
    encode_parquet(table, metadata, &mut info, &mut encoder).map_err(ResultsError::table(&store.path(name)))?;
    store.put(name, &encoder.bytes)
}

/// Checks a table that a run without rows keeps; `None`: it is not there.
pub(crate) fn check_run_table(store: &dyn Store, name: &str, run_id: &str) -> Result<Option<PartInfo>, ResultsError> {
    if store.head(name)?.is_none() {
        return Ok(None);
    }
    let info = check_part(store, name, Format::Parquet)?;
    if info.run_id != run_id {
        let reason = "it belongs to another run".into();
        return Err(ResultsError::Damaged { path: store.path(name), reason });
    }
    Ok(Some(info))
}

/// Key of the verdict in the metadata of a Parquet file.
const VERDICT_KEY: &str = "rodsweep.verdict";

/// Metadata that say what speaks against a table; `None`: nothing that is known.
pub fn verdict_metadata(mark: Option<&str>) -> (&'static str, String) {
    (VERDICT_KEY, mark.unwrap_or("sound").to_owned())
}

/// The doubt about a study's table that the metadata of its Parquet file hold; `None`: there is no doubt, or no such file.
///
/// # Errors
///
/// A file that cannot be read.
pub fn read_mark(path: &Path) -> Result<Option<String>, ResultsError> {
    let (store, name) = store_of(path)?;
    let Some(bytes) = store.get(&name)? else { return Ok(None) };
    let footer = table::parquet::footer(&bytes).map_err(ResultsError::table(path))?;
    Ok(footer.get(VERDICT_KEY).filter(|verdict| verdict.starts_with("DISTRUSTED")).map(str::to_owned))
}

/// Writes a table, replacing what is there: Parquet if the name ends in `.parquet`, else CSV, which has no place for
/// units and metadata. Where the metadata have a verdict that is not sound, every row of CSV has it in a column `distrusted`.
///
/// # Errors
///
/// A table that the format cannot hold, or a file that cannot be written.
pub fn write_table(path: &Path, table: &Table, metadata: &[(&str, String)]) -> Result<(), ResultsError> {
    let is_parquet = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    let bytes = if is_parquet {
        table::parquet::encode(table, metadata).map_err(ResultsError::table(path))?
    } else {
        let mark = metadata.iter().find(|(key, value)| *key == VERDICT_KEY && value != "sound");
        match mark {
            Some((_, mark)) => {
                let mut marked = table.clone();
                marked.columns.push(Column::new("distrusted", "", vec![mark.clone(); table.row_count()]));
                table::csv::encode(&marked)
            }
            None => table::csv::encode(table),
        }
    };
    write_bytes(path, &bytes)
}

/// Makes a directory for files, and those above it; an object store needs none.
///
/// # Errors
///
/// A directory that cannot be made.
pub fn make_directory(dir: &Path) -> Result<(), ResultsError> {
    store_at(dir)?.prepare()
}

/// Writes a file whole or not at all, replacing what is there.
///
/// # Errors
///
/// A file that cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), ResultsError> {
    let (store, name) = store_of(path)?;
    store.put(&name, bytes)
}

/// Moves a damaged part out of the way. Sidecars stay: the part's name may be given again at any moment.
pub(crate) fn quarantine(store: &dyn Store, name: &str) -> Result<PathBuf, ResultsError> {
    // Readers of a folder of rows would take it for one of them.
    let kept = file_name(name);
    for number in 0u32.. {
        let to = format!("{kept}.bad-{number}");
        if store.rename(name, &to)? {
            return Ok(store.path(&to));
        }
    }
    Ok(store.path(name))
}

/// The sidecar of a part with these bytes.
fn sidecar(name: &str, bytes: &[u8]) -> String {
    format!("{name}.{:016x}.json", xxh3_64(bytes))
}

pub(crate) fn checksum(bytes: &[u8]) -> String {
    format!("xxh3:{:016x}:{}", xxh3_64(bytes), bytes.len())
}
