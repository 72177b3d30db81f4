//! A result directory opened again: sweep, rows by column and part by part, statuses, tips, voxels.

use super::directory::{self, Parts, RunRecord, SWEEP_FILE, TIPS_FILE};
use super::error::ResultsError;
use super::layout::{Layout, plain_columns};
use super::manifest::Manifest;
use super::parts::{self, PartInfo};
use super::reduce::{Reduction, failures};
use super::store::{self, Store};
use super::workers::{self, Worker};
use crate::backend::Precision;
use crate::model::{Status, closest};
use crate::spec::{BranchChoice, Format, RESOLVED_TABLE, SolutionMethod, SweepSpec};
use crate::table::{Column, Table};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A result directory, or the address of one in an object store.
///
/// ```no_run
/// use rodsweep::results::Results;
///
/// let results = Results::open("results/workspace")?;
/// let tips = results.read(&["tip.position.x", "tip.position.y", "tip.position.z", "status"])?;
/// println!("{} rows, method: {:?}", tips.row_count(), results.method());
/// for part in results.parts(&["stability.margin"])? {
///     println!("{} rows", part?.row_count());
/// }
/// # Ok::<(), rodsweep::results::ResultsError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Results {
    dir: PathBuf,
    store: Arc<dyn Store>,
    record: RunRecord,
    spec: SweepSpec,
    /// Without rows.
    columns: Table,
}

/// What of a run is there.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct DirectoryStatus {
    /// Identity of the run.
    pub record: RunRecord,
    /// Parts of the whole sweep.
    pub parts_total: u64,
    /// Sound parts.
    pub parts_done: u64,
    /// The first chunks without a sound part, at most 4,096. Of a run without rows, which keeps all or nothing, the first.
    pub missing: Vec<u64>,
    /// Chunks without a sound part.
    pub missing_count: u64,
    /// Damaged parts and what is wrong with them.
    pub damaged: Vec<(PathBuf, String)>,
    /// Samples of the sound parts.
    pub samples_done: u64,
    /// Whether samples have a row for each equilibrium.
    pub every_branch: bool,
    /// Rows by status code.
    pub counts: [u64; Status::ALL.len()],
    /// Rows by the engine that solved them, as each part says.
    pub engines: BTreeMap<String, u64>,
    /// Rows by the method they were solved by, as each part says.
    pub methods: BTreeMap<String, u64>,
}

impl DirectoryStatus {
    /// Whether no part is missing.
    pub fn is_complete(&self) -> bool {
        self.missing_count == 0
    }

    /// Rows that are no success; where every equilibrium was asked for, samples without any.
    pub fn failed(&self) -> u64 {
        failures(&self.counts, self.every_branch)
    }
}

impl Results {
    /// Opens a directory that a run has written to.
    ///
    /// # Errors
    ///
    /// A directory without a run, or whose identity or sweep cannot be read or is not yet there.
    pub fn open(dir: impl Into<PathBuf>) -> Result<Results, ResultsError> {
        let dir = dir.into();
        let store = store::store_at(&dir)?;
        let record = RunRecord::read(store.as_ref())?;
        let Some(text) = text(store.as_ref(), SWEEP_FILE)? else { return Err(ResultsError::NotBegun { dir }) };
        let table = self::text(store.as_ref(), RESOLVED_TABLE)?;
        let tables: Vec<(&str, &str)> = table.iter().map(|text| (RESOLVED_TABLE, text.as_str())).collect();
        record.check_sweep(store.as_ref(), &text, table.as_deref())?;
        let spec = SweepSpec::parse_with(&store.path(SWEEP_FILE), &text, &tables)?;
        let precision = if record.precision == Precision::F32.name() { Precision::F32 } else { Precision::F64 };
        let columns = Layout::new(&spec, precision).empty().clone();
        Ok(Results { dir, store, record, spec, columns })
    }

    /// Where it lies.
    pub fn directory(&self) -> &Path {
        &self.dir
    }

    /// Identity of the run.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// The sweep as it was run, resolved.
    pub fn spec(&self) -> &SweepSpec {
        &self.spec
    }

    /// By what the run is solved; runs of version 0.1 do not say.
    pub fn method(&self) -> Option<SolutionMethod> {
        self.record.method
    }

    /// Name, unit and kind of every column, without rows.
    pub fn columns(&self) -> &[Column] {
        &self.columns.columns
    }

    /// The run's account of itself.
    ///
    /// # Errors
    ///
    /// As [`Manifest::read`]: a run that was interrupted at once has none.
    pub fn manifest(&self) -> Result<Manifest, ResultsError> {
        Manifest::read(&self.dir)
    }

    /// Checks every part and counts rows by status.
    ///
    /// # Errors
    ///
    /// A directory that cannot be listed or read.
    pub fn status(&self) -> Result<DirectoryStatus, ResultsError> {
        if !self.has_rows() {
            return self.status_without_rows();
        }
        Ok(self.status_of(directory::parts(self.store.as_ref(), &self.record)?))
    }

    /// What the parts found say.
    pub(crate) fn status_of(&self, parts: Parts) -> DirectoryStatus {
        let mut counts = [0; Status::ALL.len()];
        for info in parts.sound.values() {
            for (sum, count) in counts.iter_mut().zip(&info.counts) {
                *sum += count;
            }
        }
        let (mut engines, mut methods) = (BTreeMap::new(), BTreeMap::new());
        for info in parts.sound.values() {
            *engines.entry(info.engine.clone()).or_default() += info.rows;
            let method = info.method.or(self.record.method).map(|method| method.to_string());
            *methods.entry(method.unwrap_or_default()).or_default() += info.rows;
        }
        engines.remove("");
        methods.remove("");
        let parts_total = self.record.chunk_count();
        DirectoryStatus {
            parts_total,
            parts_done: parts.sound.len() as u64,
            missing: first_missing(parts_total, &parts.sound),
            missing_count: parts_total.saturating_sub(parts.sound.len() as u64),
            samples_done: parts.sound.values().map(PartInfo::sample_count).sum(),
            every_branch: parts.sound.values().any(|info| info.samples.is_some()),
            damaged: parts.damaged.into_iter().map(|(name, why)| (self.store.path(&name), why)).collect(),
            counts,
            engines,
            methods,
            record: self.record.clone(),
        }
    }

    /// Parts that are there, and their samples, without looking into them.
    ///
    /// # Errors
    ///
    /// A directory that cannot be listed.
    pub fn progress(&self) -> Result<(u64, u64), ResultsError> {
        let listed = self.record.part_files().list(self.store.as_ref())?;
        let sizes = listed.into_iter().map(|(chunk, _)| self.record.chunk_range(chunk).1).filter(|size| *size > 0);
        Ok(sizes.fold((0, 0), |(parts, samples), size| (parts + 1, samples + size)))
    }

    /// What the tables say that a run without rows keeps: all of it, or nothing.
    fn status_without_rows(&self) -> Result<DirectoryStatus, ResultsError> {
        let store = self.store.as_ref();
        let mut status = DirectoryStatus {
            parts_total: 0,
            parts_done: 0,
            missing: Vec::new(),
            missing_count: 0,
            samples_done: 0,
            every_branch: self.spec.branch == BranchChoice::All,
            damaged: Vec::new(),
            counts: [0; Status::ALL.len()],
            engines: BTreeMap::new(),
            methods: BTreeMap::new(),
            record: self.record.clone(),
        };
        for name in [directory::voxel_file(store)?, TIPS_FILE] {
            match parts::check_run_table(store, name, &self.record.run_id) {
                Ok(Some(kept)) => {
                    status.samples_done = kept.sample_count();
                    status.counts.iter_mut().zip(&kept.counts).for_each(|(to, from)| *to = *from);
                }
                Ok(None) => status.missing = vec![0],
                Err(ResultsError::Damaged { path, reason }) => status.damaged.push((path, reason)),
                Err(error) => return Err(error),
            }
        }
        if !status.damaged.is_empty() {
            status.missing = vec![0];
        }
        status.missing_count = status.missing.len() as u64;
        Ok(status)
    }

    /// Who works on the run, or has done so, the last seen first; none where no worker has joined it.
    ///
    /// # Errors
    ///
    /// A directory that cannot be listed or read.
    pub fn workers(&self) -> Result<Vec<Worker>, ResultsError> {
        workers::workers(self.store.as_ref())
    }

    /// Whether the run has written its rows, not only tips and voxels.
    pub fn has_rows(&self) -> bool {
        self.record.format() != Format::None
    }

    /// The rows part by part, in order of samples, with the named columns only (all, if none are named).
    ///
    /// # Errors
    ///
    /// A column that is not there, or a directory that cannot be read; each part may be found damaged as it is read.
    pub fn parts<'a>(
        &'a self,
        names: &'a [&'a str],
    ) -> Result<impl Iterator<Item = Result<Table, ResultsError>> + 'a, ResultsError> {
        self.check_names(names)?;
        let chunks = self.part_numbers()?;
        Ok(chunks.into_iter().map(move |chunk| self.read_part(chunk, names)))
    }

    /// Numbers of the sound parts, from 0.
    ///
    /// # Errors
    ///
    /// A directory that cannot be read.
    pub fn part_numbers(&self) -> Result<Vec<u64>, ResultsError> {
        Ok(directory::parts(self.store.as_ref(), &self.record)?.sound.into_keys().collect())
    }

    /// The named columns of one part (all, if none are named).
    ///
    /// # Errors
    ///
    /// A column that is not there, or a part that is missing or damaged.
    pub fn read_part(&self, part: u64, names: &[&str]) -> Result<Table, ResultsError> {
        self.check_names(names)?;
        let files = self.record.part_files();
        parts::read_part(&self.store, &files.name(part), files.format, names, &self.columns)
    }

    fn check_names(&self, names: &[&str]) -> Result<(), ResultsError> {
        match names.iter().find(|name| self.columns.column(name).is_none()) {
            None => Ok(()),
            Some(name) => {
                let suggestion = closest(name, self.columns.columns.iter().map(|column| column.name.as_str()));
                Err(ResultsError::NoColumn { dir: self.dir.clone(), name: (*name).into(), suggestion })
            }
        }
    }

    /// The named columns of all rows (every column, if none are named), in order of samples.
    ///
    /// # Errors
    ///
    /// As [`Results::parts`].
    pub fn read(&self, names: &[&str]) -> Result<Table, ResultsError> {
        let mut all = Table::default();
        for part in self.parts(names)? {
            all.append(&part?);
        }
        Ok(all)
    }

    /// Statistics of all rows, as the run itself has gathered them: counts, extents, voxels of an edge (m), and the
    /// rows of at most [`MAX_TIPS`](super::MAX_TIPS) samples without derivatives.
    ///
    /// Of a run without rows it is what the run has kept: voxels have the edge of the sweep, whatever `voxel` says.
    ///
    /// # Errors
    ///
    /// As [`Results::parts`].
    pub fn reduce(&self, voxel: f64) -> Result<Reduction, ResultsError> {
        if self.has_rows() {
            return self.add_parts(Reduction::new(self.record.sample_count, voxel, true));
        }
        self.restore(voxel, &self.voxels(voxel)?)
    }

    /// The same without voxels.
    ///
    /// # Errors
    ///
    /// As [`Results::parts`].
    pub fn reduce_without_voxels(&self) -> Result<Reduction, ResultsError> {
        let voxel = self.spec.workspace.voxel;
        if self.has_rows() {
            return self.add_parts(Reduction::new(self.record.sample_count, voxel, false));
        }
        self.restore(voxel, &Table::default())
    }

    fn add_parts(&self, mut reduction: Reduction) -> Result<Reduction, ResultsError> {
        for part in self.parts(&plain_columns(&self.columns))? {
            reduction.add(&part?);
        }
        Ok(reduction)
    }

    fn restore(&self, voxel: f64, voxels: &Table) -> Result<Reduction, ResultsError> {
        let mut reduction = Reduction::new(self.record.sample_count, voxel, true);
        reduction.restore(self.tips()?, voxels, &self.manifest()?);
        Ok(reduction)
    }

    /// The rows of at most [`MAX_TIPS`](super::MAX_TIPS) samples, evenly chosen: every column but derivatives.
    ///
    /// # Errors
    ///
    /// As [`Results::parts`].
    pub fn tips(&self) -> Result<Table, ResultsError> {
        match self.has_rows() {
            true => Ok(self.reduce_without_voxels()?.tips),
            false => self.run_table(TIPS_FILE),
        }
    }

    /// Occupied voxels of an edge (m): centre (m) and number of rows. Of a run without rows the edge is the sweep's.
    ///
    /// # Errors
    ///
    /// As [`Results::parts`].
    pub fn voxels(&self, voxel: f64) -> Result<Table, ResultsError> {
        match self.has_rows() {
            true => Ok(self.reduce(voxel)?.voxel_table()),
            false => self.run_table(directory::voxel_file(self.store.as_ref())?),
        }
    }

    fn run_table(&self, name: &str) -> Result<Table, ResultsError> {
        parts::check_run_table(self.store.as_ref(), name, &self.record.run_id)?;
        parts::read_part(&self.store, name, Format::Parquet, &[], &Table::default())
    }

    /// Moves the voxels of a run without rows to `touched.parquet`, so that the measured workspace can have their name.
    ///
    /// # Errors
    ///
    /// A file that cannot be moved.
    pub fn keep_touched_voxels(&self) -> Result<(), ResultsError> {
        let (from, to) = (directory::WORKSPACE_FILE, directory::TOUCHED_FILE);
        if !self.has_rows() && self.store.head(to)?.is_none() && self.store.head(from)?.is_some() {
            self.store.rename(from, to)?;
        }
        Ok(())
    }
}

/// The first chunks that are not there: found by what is there, however many there should be.
fn first_missing(total: u64, sound: &BTreeMap<u64, PartInfo>) -> Vec<u64> {
    (0..total).filter(|chunk| !sound.contains_key(chunk)).take(4096).collect()
}

/// A file of a run that is text; `None`: there is none.
fn text(store: &dyn Store, name: &str) -> Result<Option<String>, ResultsError> {
    let damaged = |_| ResultsError::Damaged { path: store.path(name), reason: "it is not UTF-8 text".into() };
    store.get(name)?.map(|bytes| String::from_utf8(bytes).map_err(damaged)).transpose()
}

/// Any Parquet file that a run wrote (`workspace.parquet`, `tips.parquet`).
///
/// # Errors
///
/// A file that cannot be read.
pub fn read_parquet_table(path: &Path) -> Result<Table, ResultsError> {
    let (store, name) = store::store_of(path)?;
    parts::read_part(&store, &name, Format::Parquet, &[], &Table::default())
}
