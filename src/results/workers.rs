//! Who works on a run: what each worker tells of itself, and whether it lives.

use super::error::ResultsError;
use super::store::{Entry, Store, random_name};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

const WORKERS: &str = "workers";
const CLOCK: &str = "workers/clock";
const PLAN: &str = "workers/plan.json";
/// More claims than this make lists long.
const MOST_UNITS: u64 = 4096;
/// Chunks of a claim at most: what a dead worker takes with it.
const LONGEST_UNIT: u64 = 64;

/// How long a silent worker keeps what it has claimed, unless the first worker says otherwise.
pub const SILENCE: Duration = Duration::from_secs(60);

/// What all workers of a run hold to; the first of them settles it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    /// After so many seconds a silent worker is taken for dead.
    silence: f64,
    /// Chunks of a claim.
    pub unit: u64,
}

impl Plan {
    /// The plan that is there, or a new one.
    pub fn agree(store: &dyn Store, chunks: u64, silence: Duration) -> Result<Plan, ResultsError> {
        let unit = chunks.div_ceil(MOST_UNITS).clamp(1, LONGEST_UNIT);
        let plan = Plan { silence: silence.as_secs_f64(), unit };
        store.create(PLAN, (serde_json::to_string(&plan).unwrap_or_default() + "\n").as_bytes())?;
        Ok(Plan::find(store)?.unwrap_or(plan))
    }

    fn find(store: &dyn Store) -> Result<Option<Plan>, ResultsError> {
        let Some(bytes) = store.get(PLAN)? else { return Ok(None) };
        let damaged = |reason: String| ResultsError::Damaged { path: store.path(PLAN), reason };
        let plan: Plan = serde_json::from_slice(&bytes).map_err(|error| damaged(error.to_string()))?;
        if plan.unit == 0 || !(0.1..=1e6).contains(&plan.silence) {
            return Err(damaged("it holds numbers that no worker has written".into()));
        }
        Ok(Some(plan))
    }

    pub fn silence(&self) -> Duration {
        Duration::from_secs_f64(self.silence)
    }

    /// Claims of the whole run.
    pub fn units(&self, chunks: u64) -> u64 {
        chunks.div_ceil(self.unit)
    }
}

/// What a worker tells of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct WorkerReport {
    /// Of this process alone.
    pub id: String,
    /// Name of its machine.
    pub host: String,
    /// Number of its process there.
    pub process: u32,
    /// What solves.
    pub engine: String,
    /// Samples that it has solved and written.
    pub samples: u64,
    /// Of these, failed.
    pub failed: u64,
    /// Samples a second.
    pub rate: f64,
    /// It has ended by itself.
    pub has_left: bool,
}

impl WorkerReport {
    /// This process.
    pub(crate) fn new(engine: String) -> WorkerReport {
        let id = random_name();
        let (host, process) = (host_name(), std::process::id());
        WorkerReport { id, host, process, engine, samples: 0, failed: 0, rate: 0.0, has_left: false }
    }
}

fn host_name() -> String {
    let file = || std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let variable = || std::env::var("HOSTNAME").or_else(|_| std::env::var("COMPUTERNAME")).ok();
    file().or_else(variable).map_or_else(|| "unknown".into(), |name| name.trim().to_owned())
}

/// A worker as others see it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Worker {
    /// What it told last.
    pub report: WorkerReport,
    /// Since then, by the store's clock; until the last sign of any worker.
    pub silent: Duration,
    /// Whether it may still be at work.
    pub is_alive: bool,
}

/// All workers of a run, those that have shown themselves last before others; none where none has joined.
pub(crate) fn workers(store: &dyn Store) -> Result<Vec<Worker>, ResultsError> {
    let Some(plan) = Plan::find(store)? else { return Ok(Vec::new()) };
    let entries = reports(store)?;
    // A file written now tells what time it is in the store. Who may not write takes the last sign of a worker.
    let written = store.put(CLOCK, b"\n").and_then(|()| store.head(CLOCK)).ok().flatten();
    let newest = entries.iter().chain(&written).map(|entry| entry.modified).max();
    let now = newest.unwrap_or(SystemTime::UNIX_EPOCH);
    let mut found = Vec::new();
    for entry in entries {
        let Some(bytes) = store.get(&format!("{WORKERS}/{}", entry.name))? else { continue };
        let Ok(report) = serde_json::from_slice::<WorkerReport>(&bytes) else { continue };
        let silent = now.duration_since(entry.modified).unwrap_or_default();
        let is_alive = silent <= plan.silence() && !report.has_left;
        found.push(Worker { report, silent, is_alive });
    }
    found.sort_by(|a, b| a.silent.cmp(&b.silent).then_with(|| a.report.id.cmp(&b.report.id)));
    Ok(found)
}

/// The workers that live, as `own` sees it, whose file has just been written.
pub(crate) fn living(store: &dyn Store, own: &str, silence: Duration) -> Result<BTreeSet<String>, ResultsError> {
    let entries = reports(store)?;
    let now = entries.iter().find(|entry| id_of(entry) == Some(own)).map(|entry| entry.modified);
    let is_young = |entry: &&Entry| match now {
        Some(now) => now.duration_since(entry.modified).is_ok_and(|age| age <= silence) || entry.modified > now,
        // Not yet listed: nobody can be judged.
        None => true,
    };
    let mut living = BTreeSet::new();
    for entry in entries.iter().filter(is_young) {
        let Some(id) = id_of(entry) else { continue };
        // The file of one that has left is marked by its size: nothing need be read.
        if entry.size != LEFT_SIZE {
            living.insert(id.to_owned());
        }
    }
    Ok(living)
}

fn reports(store: &dyn Store) -> Result<Vec<Entry>, ResultsError> {
    let mut entries = store.list(WORKERS)?;
    entries.retain(|entry| id_of(entry).is_some());
    Ok(entries)
}

fn id_of(entry: &Entry) -> Option<&str> {
    entry.name.strip_suffix(".json").filter(|id| id.len() == 32)
}

/// Bytes of the file of a worker that has left, filled up with spaces; others are never as long.
const LEFT_SIZE: u64 = 4096;

/// The sign of life of this worker, given again and again by a thread of its own.
pub(crate) struct Beat {
    shared: Arc<Shared>,
    id: String,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    store: Arc<dyn Store>,
    state: Mutex<BeatState>,
    changed: Condvar,
    /// One sign at a time.
    writing: Mutex<()>,
}

struct BeatState {
    report: WorkerReport,
    begin: Instant,
    /// When the last sign that has arrived was begun.
    last: Instant,
    is_over: bool,
    /// Killed, as far as others can tell.
    is_dead: bool,
}

impl Beat {
    pub fn start(store: Arc<dyn Store>, report: WorkerReport, silence: Duration) -> Result<Beat, ResultsError> {
        let id = report.id.clone();
        let state = Mutex::new(BeatState {
            report,
            begin: Instant::now(),
            last: Instant::now(),
            is_over: false,
            is_dead: false,
        });
        let shared = Arc::new(Shared { store, state, changed: Condvar::new(), writing: Mutex::new(()) });
        shared.write()?;
        let other = shared.clone();
        // A system that gives no thread: signs are then given before each claim alone.
        let thread = std::thread::Builder::new().spawn(move || other.beat(silence / 6)).ok();
        Ok(Beat { shared, id, thread })
    }

    pub fn id(&self) -> &str {
        &self.id
    }

    /// Time since the last sign, by this machine's count of seconds.
    pub fn age(&self) -> Duration {
        self.shared.state().last.elapsed()
    }

    /// Gives a sign now.
    pub fn renew(&self) -> Result<(), ResultsError> {
        self.shared.write()
    }

    pub fn samples(&self) -> u64 {
        self.shared.state().report.samples
    }

    /// A part has been written.
    pub fn add(&self, samples: u64, failed: u64) {
        let mut state = self.shared.state();
        state.report.samples += samples;
        state.report.failed += failed;
        state.report.rate = state.report.samples as f64 / state.begin.elapsed().as_secs_f64().max(1e-3);
    }
}

#[cfg(test)]
impl Beat {
    /// No sign from now on, not even a last one.
    pub fn die(&self) {
        let mut state = self.shared.state();
        (state.is_over, state.is_dead) = (true, true);
        drop(state);
        self.shared.changed.notify_all();
    }
}

impl Drop for Beat {
    fn drop(&mut self) {
        {
            let mut state = self.shared.state();
            state.is_over = true;
            state.report.has_left = true;
        }
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        // Who cannot be told finds out by silence.
        let _ = self.shared.write();
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, BeatState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> Result<(), ResultsError> {
        let _one = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        let begin = Instant::now();
        let report = {
            let state = self.state();
            if state.is_dead {
                return Ok(());
            }
            state.report.clone()
        };
        let mut text = serde_json::to_string(&report).unwrap_or_default();
        if report.has_left {
            let missing = (LEFT_SIZE as usize).saturating_sub(text.len() + 1);
            text.extend(std::iter::repeat_n(' ', missing));
        }
        self.store.put(&format!("{WORKERS}/{}.json", report.id), (text + "\n").as_bytes())?;
        self.state().last = begin;
        Ok(())
    }

    fn beat(&self, pause: Duration) {
        let mut state = self.state();
        while !state.is_over {
            let (after, waited) = self.changed.wait_timeout(state, pause).unwrap_or_else(PoisonError::into_inner);
            state = after;
            if waited.timed_out() && !state.is_over {
                drop(state);
                // What fails now is tried again with the next sign; a claim asks for one that has arrived.
                let _ = self.write();
                state = self.state();
            }
        }
    }
}
