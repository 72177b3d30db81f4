//! Where the rows of a run go: a result directory, memory, or a callback.

use super::error::SweepError;
use crate::backend::BackendInfo;
use crate::input::write_scene;
use crate::results::claims::{ClaimState, Claims};
use crate::results::directory::{self, TIPS_FILE, WORKSPACE_FILE, WORST_FILE};
use crate::results::layout;
use crate::results::merge;
use crate::results::parts::{self, FileMetadata, Kept};
use crate::results::verdict_files;
use crate::results::workers::Beat;
use crate::results::{Manifest, Reduction, Results, ResultsError, RunRecord, Store, Verdict, WorkerReport, store_at};
use crate::spec::{Format, Shard, SolutionMethod, SweepSpec};
use crate::table::Table;
use crate::table::parquet::Encoder;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

/// Takes the rows of a run, part after part in order of samples.
pub trait RowSink: Send {
    /// By what a run that is already there is solved; the run that begins then has to do as it did.
    ///
    /// # Errors
    ///
    /// What is there cannot be read.
    fn method(&self) -> Result<Option<SolutionMethod>, SweepError> {
        Ok(None)
    }

    /// Makes ready for a run. Rows that are already there go to `seen`, part by part.
    ///
    /// # Errors
    ///
    /// The sink holds something else, or cannot be written.
    fn open(&mut self, run: &RunHeader<'_>, seen: &mut dyn FnMut(&Table)) -> Result<Found, SweepError>;

    /// Takes the rows of a part.
    ///
    /// # Errors
    ///
    /// The rows cannot be kept; the run ends.
    fn write(&mut self, part: u64, rows: &Table) -> Result<(), SweepError>;

    /// The run has ended, whole or interrupted.
    ///
    /// # Errors
    ///
    /// What is left to be written cannot be.
    fn close(&mut self, end: &RunEnd<'_>) -> Result<(), SweepError>;
}

/// A run that begins.
#[non_exhaustive]
pub struct RunHeader<'a> {
    /// What is run.
    pub spec: &'a SweepSpec,
    /// Its identity.
    pub record: &'a RunRecord,
    /// The columns of its rows, without rows.
    pub columns: &'a Table,
    /// What solves.
    pub engine: &'a BackendInfo,
    /// By what it solves.
    pub method: SolutionMethod,
    /// Which part of the sweep.
    pub shard: Shard,
}

/// What of a run was already there.
#[derive(Default)]
pub struct Found {
    /// Parts that need not be solved.
    pub done: BTreeSet<u64>,
    /// Damaged parts that were put aside.
    pub quarantined: Vec<PathBuf>,
    /// What shares the chunks out among workers; then `done` says nothing.
    pub(crate) claims: Option<Claims>,
    /// What earlier calls have said of the rows that are there.
    pub(crate) verdict: Option<Verdict>,
    /// The account of an earlier call that has finished what is asked for.
    pub(crate) finished: Option<Box<Manifest>>,
}

/// A run that has ended.
#[non_exhaustive]
pub struct RunEnd<'a> {
    /// What was run.
    pub spec: &'a SweepSpec,
    /// The account of the run.
    pub manifest: &'a Manifest,
    /// Tips and voxels.
    pub reduction: &'a Reduction,
}

/// A result directory, or a place in an object store: parts that are whole or absent, `run.json`, `sweep.toml`, `manifest.json`.
pub struct ResultDirectory {
    dir: PathBuf,
    /// Of the run that is open.
    store: Option<Arc<dyn Store>>,
    resume: bool,
    /// Shares the run with other workers, the silent ones of which are taken for dead after this time.
    join: Option<Duration>,
    /// The sign of life, and how it ended, where the run is shared.
    worker: Option<(Arc<Beat>, Arc<ClaimState>)>,
    format: Format,
    metadata: Option<FileMetadata>,
    record: Option<RunRecord>,
    /// Rows by the engine that made them.
    engines: BTreeMap<String, u64>,
    /// Memory to encode in.
    encoder: Encoder,
    /// Whether an earlier call has finished what is asked for, and nothing is missing.
    is_finished: bool,
}

impl ResultDirectory {
    /// A new directory, or an empty one; or the address of one, such as `s3://bucket/results`.
    pub fn new(dir: impl Into<PathBuf>) -> ResultDirectory {
        ResultDirectory {
            dir: dir.into(),
            store: None,
            resume: false,
            join: None,
            worker: None,
            format: Format::None,
            metadata: None,
            record: None,
            engines: BTreeMap::new(),
            encoder: Encoder::default(),
            is_finished: false,
        }
    }

    /// Whether to go on with what the directory holds.
    pub fn resume(self, resume: bool) -> ResultDirectory {
        ResultDirectory { resume, ..self }
    }

    /// Shares the run with whoever else joins it, on whatever machine: workers claim chunks of it, take over what dead ones
    /// have claimed, and end together. A worker that shows no sign for `silence` is taken for dead; the first worker of a
    /// run settles it for all.
    pub fn join(self, silence: Duration) -> ResultDirectory {
        ResultDirectory { resume: true, join: Some(silence), ..self }
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.dir
    }
}

impl RowSink for ResultDirectory {
    fn method(&self) -> Result<Option<SolutionMethod>, SweepError> {
        match self.resume {
            true => Ok(RunRecord::find(store_at(&self.dir)?.as_ref())?.and_then(|record| record.method)),
            false => Ok(None),
        }
    }

    fn open(&mut self, run: &RunHeader<'_>, seen: &mut dyn FnMut(&Table)) -> Result<Found, SweepError> {
        let RunHeader { spec, record, columns, .. } = *run;
        let store = store_at(&self.dir)?;
        directory::open(store.as_ref(), record, spec, self.resume)?;
        self.store = Some(store.clone());
        // Opened again by the same program, a run goes on.
        self.resume = true;
        self.format = spec.format;
        let metadata = FileMetadata {
            engine: run.engine.to_string(),
            method: Some(run.method),
            ..directory::metadata(spec, record)
        };
        self.metadata = Some(metadata);
        self.record = Some(record.clone());
        self.engines.clear();
        let mut found = Found::default();
        if let Some(silence) = self.join {
            if spec.format == Format::None {
                return Err(ResultsError::SharedWithoutRows { dir: self.dir.clone() }.into());
            }
            let claims = Claims::join(store, record, WorkerReport::new(run.engine.to_string()), silence)?;
            self.worker = Some((claims.beat(), claims.state()));
            found.claims = Some(claims);
            return Ok(found);
        }
        if spec.format == Format::None {
            directory::check_shard(store.as_ref(), record, run.shard)?;
            return Ok(found);
        }
        let there = directory::parts(store.as_ref(), record)?;
        for (name, _) in there.damaged {
            found.quarantined.push(parts::quarantine(store.as_ref(), &name)?);
        }
        let names = layout::plain_columns(columns);
        for (chunk, info) in there.sound {
            if run.shard.owns(chunk) {
                let name = record.part_files().name(chunk);
                seen(&parts::read_part(&store, &name, spec.format, &names, columns)?);
                self.count(info.engine, info.rows);
            }
            found.done.insert(chunk);
        }
        // A manifest that is damaged tells nothing, and is made again.
        let manifest = Manifest::find(store.as_ref()).ok().flatten();
        found.verdict = match run.shard {
            Shard::WHOLE => verdict_files::find(store.as_ref()).ok().flatten(),
            shard => verdict_files::get(store.as_ref(), &verdict_files::of_shard(shard)).ok().flatten(),
        };
        let is_of_this = |manifest: &Manifest| {
            manifest.complete
                && manifest.run_id == record.run_id
                && manifest.run.as_ref().is_some_and(|account| account.shard == run.shard)
        };
        let owned = found.done.iter().filter(|chunk| run.shard.owns(**chunk));
        let there: u64 = owned.map(|chunk| record.chunk_range(*chunk).1).sum();
        let is_whole = there == record.samples_of(run.shard);
        found.finished = manifest.filter(|manifest| is_whole && is_of_this(manifest)).map(Box::new);
        self.is_finished = found.finished.is_some() && found.quarantined.is_empty();
        Ok(found)
    }

    fn write(&mut self, part: u64, rows: &Table) -> Result<(), SweepError> {
        let (Some(metadata), Some(store), Some(record)) = (&self.metadata, &self.store, &self.record) else {
            return Ok(());
        };
        let name = record.part_files().name(part);
        let (info, is_new) = parts::write_part(store.as_ref(), &name, rows, self.format, metadata, &mut self.encoder)?;
        if let Some((beat, _)) = self.worker.as_ref().filter(|_| is_new) {
            beat.add(info.sample_count(), info.failed());
        }
        self.count(info.engine, info.rows);
        Ok(())
    }

    fn close(&mut self, end: &RunEnd<'_>) -> Result<(), SweepError> {
        let (Some(metadata), Some(store)) = (&self.metadata, &self.store) else { return Ok(()) };
        let store = store.as_ref();
        if self.is_finished {
            // Nothing was solved: what is known of the rows stays as it is.
            return Ok(());
        }
        let RunEnd { spec, reduction, .. } = *end;
        if spec.format == Format::None && end.manifest.complete {
            // Another shard may have ended here meanwhile.
            let shard = end.manifest.run.as_ref().map(|run| run.shard);
            if let Some((record, shard)) = self.record.as_ref().zip(shard) {
                directory::check_shard(store, record, shard)?;
            }
            let words = end.manifest.verdict().headline().unwrap_or_else(|| "sound".into());
            let metadata = &FileMetadata { verdict: words, ..metadata.clone() };
            let kept = Kept { shard, samples: reduction.sample_count, counts: reduction.counts };
            parts::write_run_table(store, WORKSPACE_FILE, &reduction.voxel_table(), metadata, &kept)?;
            parts::write_run_table(store, TIPS_FILE, &reduction.tips, metadata, &kept)?;
        }
        if let Some((beat, state)) = self.worker.take() {
            let text = serde_json::to_string_pretty(end.manifest).unwrap_or_default() + "\n";
            store.put(&format!("workers/{}.account.json", beat.id()), text.as_bytes())?;
            verdict_files::put_scenes(store, spec, end.manifest.verdict.as_ref())?;
            if let Some(verdict) = &end.manifest.verdict {
                verdict_files::put(store, &verdict_files::of_worker(beat.id()), verdict)?;
            }
            let found = state.found.lock().unwrap_or_else(PoisonError::into_inner).take();
            if let Some(found) = found {
                beat.renew()?;
                let results = Results::open(&self.dir)?;
                let workers = results.workers()?.into_iter().map(|worker| worker.report).collect();
                let account = merge::account(results.record(), results.spec(), &results.status_of(found));
                let verdict = verdict_files::find(store)?;
                Manifest { workers, verdict, ..account }.write(store)?;
                Claims::done(store)?;
            }
            return Ok(());
        }
        let check = end.manifest.run.as_ref().and_then(|run| run.spot_check.as_ref());
        if let Some(index) = check.and_then(|check| check.worst_sample) {
            let scene = write_scene(&spec.sample_scene(index));
            store.put(WORST_FILE, scene.as_bytes())?;
        }
        verdict_files::put_scenes(store, spec, end.manifest.verdict.as_ref())?;
        let mut manifest = end.manifest.clone();
        if spec.format != Format::None {
            manifest.engines = std::mem::take(&mut self.engines);
        }
        let shard = manifest.run.as_ref().map_or(Shard::WHOLE, |run| run.shard);
        if shard == Shard::WHOLE || spec.format == Format::None {
            manifest.write(store)?;
            return Ok(verdict_files::clear(store)?);
        }
        // Other shards of this directory may end at this moment.
        verdict_files::put(store, &verdict_files::of_shard(shard), &manifest.verdict())?;
        manifest.verdict = verdict_files::find(store)?;
        Ok(manifest.write(store)?)
    }
}

impl ResultDirectory {
    fn count(&mut self, engine: String, rows: u64) {
        if !engine.is_empty() {
            *self.engines.entry(engine).or_default() += rows;
        }
    }
}

/// All rows in memory.
#[derive(Debug, Default)]
pub struct Memory {
    rows: Table,
}

impl Memory {
    /// Empty.
    pub fn new() -> Memory {
        Memory::default()
    }

    /// The rows, in order of samples.
    pub fn into_table(self) -> Table {
        self.rows
    }
}

impl RowSink for Memory {
    fn open(&mut self, run: &RunHeader<'_>, _: &mut dyn FnMut(&Table)) -> Result<Found, SweepError> {
        self.rows = run.columns.clone();
        Ok(Found::default())
    }

    fn write(&mut self, _: u64, rows: &Table) -> Result<(), SweepError> {
        self.rows.append(rows);
        Ok(())
    }

    fn close(&mut self, _: &RunEnd<'_>) -> Result<(), SweepError> {
        Ok(())
    }
}

/// A function that is called with each part: its number and its rows.
pub struct Callback<F>(pub F);

impl<F: FnMut(u64, &Table) -> Result<(), SweepError> + Send> RowSink for Callback<F> {
    fn open(&mut self, _: &RunHeader<'_>, _: &mut dyn FnMut(&Table)) -> Result<Found, SweepError> {
        Ok(Found::default())
    }

    fn write(&mut self, part: u64, rows: &Table) -> Result<(), SweepError> {
        (self.0)(part, rows)
    }

    fn close(&mut self, _: &RunEnd<'_>) -> Result<(), SweepError> {
        Ok(())
    }
}
