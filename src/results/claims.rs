//! Chunks shared out among any number of workers, on any machines, through the store alone.
//!
//! | file | written | tells |
//! |---|---|---|
//! | `workers/plan.json` | once, by the first worker | how long a silent worker keeps what it has claimed, chunks of a claim |
//! | `workers/ID.json` | by its worker, again and again | that it lives, and what it has done |
//! | `claims/UNIT-TURN` | once | which worker solves these chunks; the next turn is for whoever takes them over |
//! | `workers/done.json` | by the worker that finished the run | that nothing is left |
//!
//! A worker is dead when its file is older than that of the worker that judges, by more than the plan allows. Both times
//! are the store's: no clock of a machine is compared with another. A claim saves work, it decides nothing: a part is put
//! only where there is none, so that a worker that was taken for dead does no harm.

use super::directory::{self, Parts, RunRecord};
use super::error::ResultsError;
use super::parts;
use super::store::{Store, random_name};
use super::workers::{self, Beat, Plan, WorkerReport};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

const CLAIMS: &str = "claims";
/// Written when every part is there and the manifest, too.
const DONE: &str = "workers/done.json";
/// A worker claims what will take it about so long.
const ROUND: Duration = Duration::from_secs(5);
/// Claims of one round.
const MOST_UNITS: u64 = 16;

/// A worker that finds nothing free lists everything anew at most this seldom, unless there are very many.
const LOOK: Duration = Duration::from_secs(10);
/// Requests a second that the looks of all workers together make at most.
const LISTS: f64 = 500.0;

/// What a worker does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Next {
    /// Solve this chunk.
    Chunk(u64),
    /// Nothing is free; ask again after this time.
    Wait(Duration),
    /// Every part is there.
    Done,
}

/// What others may know of a worker's claims while it works.
#[derive(Debug, Default)]
pub(crate) struct ClaimState {
    /// Samples in parts of other workers, as of the last look.
    pub elsewhere: AtomicU64,
    /// Every part is there.
    pub complete: AtomicBool,
    /// This worker writes the manifest.
    pub finishes: AtomicBool,
    /// What it has found, once it has looked into all parts.
    pub found: Mutex<Option<Parts>>,
}

/// The claims of one worker.
pub(crate) struct Claims {
    store: Arc<dyn Store>,
    record: RunRecord,
    plan: Plan,
    beat: Arc<Beat>,
    state: Arc<ClaimState>,
    /// Chunks that are claimed and not yet given out.
    ready: VecDeque<u64>,
    /// By unit the last turn that is known.
    turns: BTreeMap<u64, u64>,
    /// By claim the worker that made it.
    owners: BTreeMap<(u64, u64), String>,
    /// Chunks with parts.
    there: BTreeSet<u64>,
    /// Chunks that this worker has given out.
    given: u64,
    begin: Instant,
    /// The unit where it looks first: by chance, so that workers seldom meet.
    place: u64,
    last_look: Option<Instant>,
    /// Looks since it last had something to solve.
    idle: u32,
    /// Workers that live, as of the last look.
    living_count: usize,
}

impl Claims {
    /// Joins the workers of a run, or is the first of them.
    pub fn join(
        store: Arc<dyn Store>,
        record: &RunRecord,
        report: WorkerReport,
        silence: Duration,
    ) -> Result<Claims, ResultsError> {
        let plan = Plan::agree(store.as_ref(), record.chunk_count(), silence)?;
        let beat = Arc::new(Beat::start(store.clone(), report, plan.silence())?);
        let place = chance() % plan.units(record.chunk_count()).max(1);
        let mut claims = Claims {
            store,
            record: record.clone(),
            plan,
            beat,
            state: Arc::default(),
            ready: VecDeque::new(),
            turns: BTreeMap::new(),
            owners: BTreeMap::new(),
            there: BTreeSet::new(),
            given: 0,
            begin: Instant::now(),
            place,
            last_look: None,
            idle: 0,
            living_count: 1,
        };
        claims.look()?;
        if !claims.is_whole() {
            // Somebody has taken parts away since.
            claims.store.remove(DONE)?;
        }
        Ok(claims)
    }

    pub fn state(&self) -> Arc<ClaimState> {
        self.state.clone()
    }

    /// What this worker tells of itself.
    pub fn beat(&self) -> Arc<Beat> {
        self.beat.clone()
    }

    /// Whether a chunk is claimed and not yet given out, so that to ask for it costs nothing.
    pub fn has_ready(&self) -> bool {
        !self.ready.is_empty()
    }

    /// What to do next.
    pub fn next(&mut self) -> Result<Next, ResultsError> {
        if self.beat.age() > self.plan.silence() / 2 {
            // A worker that was silent for long may have been taken for dead: then others have its claims.
            let was_lost = self.beat.age() > self.plan.silence();
            self.beat.renew()?;
            if was_lost {
                self.ready.clear();
            }
        }
        if self.ready.is_empty() {
            self.claim_free()?;
        }
        if let Some(chunk) = self.ready.pop_front() {
            (self.given, self.idle) = (self.given + 1, 0);
            return Ok(Next::Chunk(chunk));
        }
        if self.is_done()? {
            return Ok(Next::Done);
        }
        let pause = self.pause();
        if self.last_look.is_some_and(|last| last.elapsed() < pause) {
            return Ok(Claims::wait(pause));
        }
        self.look()?;
        self.idle += 1;
        if self.is_whole() {
            return self.finish(pause);
        }
        self.take_over()?;
        match self.ready.pop_front() {
            Some(chunk) => {
                (self.given, self.idle) = (self.given + 1, 0);
                Ok(Next::Chunk(chunk))
            }
            None => Ok(Claims::wait(pause)),
        }
    }

    /// Time between two looks: twice as long each time, and longer where a look takes many requests.
    fn pause(&self) -> Duration {
        let first = Duration::from_millis(if self.store.is_remote() { 250 } else { 20 });
        const PAGE: u64 = 1000;
        let pages = 1 + (self.record.chunk_count() + self.end_unit()) / PAGE;
        let factor = pages.min(1000) as u32 * (1 << self.idle.min(10));
        let alone = (first * factor).min(self.plan.silence() / 6).min(LOOK);
        alone.max(Duration::from_secs_f64(self.living_count as f64 * pages as f64 / LISTS))
    }

    /// Asks again whether all is done before it looks again.
    fn wait(pause: Duration) -> Next {
        Next::Wait((pause / 2).min(LOOK / 2))
    }

    /// After the manifest has been written: all others may go.
    pub fn done(store: &dyn Store) -> Result<(), ResultsError> {
        store.put(DONE, b"{}\n")
    }

    /// Whether the manifest has been written.
    fn is_done(&self) -> Result<bool, ResultsError> {
        let is_done = self.store.head(DONE)?.is_some();
        if is_done {
            self.state.complete.store(true, Ordering::Relaxed);
        }
        Ok(is_done)
    }

    fn is_whole(&self) -> bool {
        self.there.len() as u64 == self.record.chunk_count()
    }

    /// The number after the last unit stands for the end: whoever has it writes the manifest.
    fn end_unit(&self) -> u64 {
        self.plan.units(self.record.chunk_count())
    }

    /// Lists parts and claims.
    fn look(&mut self) -> Result<(), ResultsError> {
        let count = self.record.chunk_count();
        let listed = self.record.part_files().list(self.store.as_ref())?;
        self.there = listed.into_iter().map(|(chunk, _)| chunk).collect();
        self.there.retain(|chunk| *chunk < count);
        self.look_at_claims()?;
        let samples: u64 = self.there.iter().map(|chunk| self.record.chunk_range(*chunk).1).sum();
        let own = self.beat.samples();
        self.state.elsewhere.store(samples.saturating_sub(own), Ordering::Relaxed);
        self.last_look = Some(Instant::now());
        Ok(())
    }

    fn look_at_claims(&mut self) -> Result<(), ResultsError> {
        for entry in self.store.list(CLAIMS)? {
            let Some((unit, turn)) = entry.name.split_once('-') else { continue };
            let (Ok(unit), Ok(turn)) = (unit.parse(), turn.parse()) else { continue };
            let known = self.turns.entry(unit).or_insert(turn);
            *known = turn.max(*known);
        }
        Ok(())
    }

    /// Chunks of a unit that have no part.
    fn missing(&self, unit: u64) -> Vec<u64> {
        let chunks = unit * self.plan.unit..((unit + 1) * self.plan.unit).min(self.record.chunk_count());
        chunks.filter(|chunk| !self.there.contains(chunk)).collect()
    }

    /// Claims units that nobody has: as many as take a few seconds, fewer as the end comes near.
    fn claim_free(&mut self) -> Result<(), ResultsError> {
        /// After so many lost races what is known of claims is out of date.
        const LOST: u32 = 8;
        loop {
            let is_free = |unit: &u64| !self.turns.contains_key(unit) && !self.missing(*unit).is_empty();
            let mut free: Vec<u64> = self.units_in_order().filter(is_free).collect();
            let rate = self.given as f64 / self.plan.unit as f64 / self.begin.elapsed().as_secs_f64().max(1e-3);
            let wanted = ((rate * ROUND.as_secs_f64()) as u64).clamp(1, MOST_UNITS).min(1 + free.len() as u64 / 64);
            let (mut won, mut lost) = (0, 0);
            while won < wanted && lost < LOST && !free.is_empty() {
                // Where one is taken, its neighbours mostly are, too: workers that follow one another would all try them.
                let at = if lost == 0 { 0 } else { chance() as usize % free.len() };
                let unit = free.remove(at);
                if self.claim(unit, 0)? {
                    self.ready.extend(self.missing(unit));
                    self.place = unit + 1;
                    won += 1;
                } else {
                    lost += 1;
                }
            }
            if won > 0 || lost < LOST {
                return Ok(());
            }
            self.look_at_claims()?;
        }
    }

    /// Every unit, from the one where this worker looks first.
    fn units_in_order(&self) -> impl Iterator<Item = u64> + use<> {
        let (place, units) = (self.place, self.end_unit());
        (0..units).map(move |k| (place + k) % units)
    }

    /// Claims a unit whose worker is dead or has left.
    ///
    /// Whose a unit is has to be asked for: the living share that out by chance, from look to look.
    fn take_over(&mut self) -> Result<(), ResultsError> {
        self.place = chance() % self.end_unit().max(1);
        let open: Vec<u64> = self.units_in_order().filter(|unit| !self.missing(*unit).is_empty()).collect();
        if open.is_empty() {
            return Ok(());
        }
        let living = self.living()?;
        let mut questions = 4 + 2 * open.len() / living.len().max(1);
        for unit in open {
            let is_known = self.turns.get(&unit).is_none_or(|turn| self.owners.contains_key(&(unit, *turn)));
            if !is_known && questions == 0 {
                continue;
            }
            questions -= usize::from(!is_known);
            if let Some(turn) = self.free_turn(unit, &living)?
                && self.claim(unit, turn)?
            {
                self.ready.extend(self.missing(unit));
                return Ok(());
            }
        }
        Ok(())
    }

    /// The turn in which a unit may be claimed; `None`: a living worker has it.
    fn free_turn(&mut self, unit: u64, living: &BTreeSet<String>) -> Result<Option<u64>, ResultsError> {
        let Some(turn) = self.turns.get(&unit).copied() else { return Ok(Some(0)) };
        let owner = match self.owners.get(&(unit, turn)) {
            Some(owner) => owner.clone(),
            None => {
                let bytes = self.store.get(&claim_name(unit, turn))?.unwrap_or_default();
                let owner = String::from_utf8_lossy(&bytes).trim().to_owned();
                self.owners.insert((unit, turn), owner.clone());
                owner
            }
        };
        Ok((!living.contains(&owner)).then_some(turn + 1))
    }

    fn living(&mut self) -> Result<BTreeSet<String>, ResultsError> {
        // Its own file, just written, tells the time.
        self.beat.renew()?;
        let living = workers::living(self.store.as_ref(), self.beat.id(), self.plan.silence())?;
        self.living_count = living.len();
        Ok(living)
    }

    fn claim(&mut self, unit: u64, turn: u64) -> Result<bool, ResultsError> {
        let is_won = self.store.create_lightly(&claim_name(unit, turn), self.beat.id().as_bytes())?;
        let known = self.turns.entry(unit).or_insert(turn);
        *known = turn.max(*known);
        if is_won {
            self.owners.insert((unit, turn), self.beat.id().into());
        }
        Ok(is_won)
    }

    /// Every part is there: one worker looks into them and writes the manifest, the others wait for it.
    fn finish(&mut self, pause: Duration) -> Result<Next, ResultsError> {
        let (end, living) = (self.end_unit(), self.living()?);
        let own = self.beat.id().to_owned();
        let is_mine = match self.turns.get(&end) {
            Some(turn) if self.owners.get(&(end, *turn)) == Some(&own) => true,
            _ => match self.free_turn(end, &living)? {
                // The worker that had the end may have written the manifest and left since this one asked.
                Some(turn) if turn > 0 && self.is_done()? => return Ok(Next::Done),
                Some(turn) => self.claim(end, turn)?,
                None => false,
            },
        };
        if !is_mine {
            return Ok(Claims::wait(pause));
        }
        let found = directory::parts(self.store.as_ref(), &self.record)?;
        for (name, _) in &found.damaged {
            parts::quarantine(self.store.as_ref(), name)?;
        }
        self.there = found.sound.keys().copied().collect();
        if !self.is_whole() {
            // Its worker believes that it is done, so whether that lives does not matter.
            let broken: Vec<u64> = (0..end).filter(|unit| !self.missing(*unit).is_empty()).collect();
            for unit in broken {
                let turn = self.turns.get(&unit).map_or(0, |turn| turn + 1);
                if self.claim(unit, turn)? {
                    self.ready.extend(self.missing(unit));
                }
            }
            return Ok(self.ready.pop_front().map_or(Claims::wait(pause), Next::Chunk));
        }
        self.state.complete.store(true, Ordering::Relaxed);
        self.state.finishes.store(true, Ordering::Relaxed);
        *self.state.found.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
        Ok(Next::Done)
    }
}

#[cfg(test)]
impl Claims {
    /// As if it had looked long ago.
    pub fn may_look(&mut self) {
        self.last_look = None;
    }

    pub fn looks_every(&self) -> Duration {
        self.pause()
    }
}

/// A number that no other worker has.
fn chance() -> u64 {
    u64::from_str_radix(&random_name()[..15], 16).unwrap_or(0)
}

fn claim_name(unit: u64, turn: u64) -> String {
    format!("{CLAIMS}/{unit:010}-{turn}")
}
