//! Time of the stages of a run: on the wall, and of processors.

use crate::clock::{Busy, Entered, process_time};
use crate::results::Timings;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Time of one stage.
pub(crate) struct StageTime {
    /// Nanoseconds on the wall.
    wall: AtomicU64,
    pub processor: Busy,
}

impl StageTime {
    fn new() -> StageTime {
        StageTime { wall: AtomicU64::new(0), processor: Busy::new() }
    }

    /// Both clocks go on until the guard is dropped.
    pub fn enter(&self) -> InStage<'_> {
        InStage { stage: self, begin: Instant::now(), _processor: self.processor.enter() }
    }

    pub fn add_wall(&self, time: Duration) {
        self.wall.fetch_add(time.as_nanos() as u64, Ordering::Relaxed);
    }

    fn wall_seconds(&self) -> f64 {
        Duration::from_nanos(self.wall.load(Ordering::Relaxed)).as_secs_f64()
    }
}

/// The calling thread is at a stage.
#[must_use]
pub(crate) struct InStage<'a> {
    stage: &'a StageTime,
    begin: Instant,
    _processor: Entered,
}

impl Drop for InStage<'_> {
    fn drop(&mut self) {
        self.stage.add_wall(self.begin.elapsed());
    }
}

/// Time of every stage, and of the run.
pub(crate) struct StageTimes {
    begin: Instant,
    process_before: Option<Duration>,
    pub build: StageTime,
    pub solve: StageTime,
    pub refine: StageTime,
    pub search: StageTime,
    pub rows: StageTime,
    pub write: StageTime,
    pub check: StageTime,
}

impl StageTimes {
    /// The run begins.
    pub fn start() -> StageTimes {
        let new = StageTime::new;
        StageTimes {
            begin: Instant::now(),
            process_before: process_time(),
            build: new(),
            solve: new(),
            refine: new(),
            search: new(),
            rows: new(),
            write: new(),
            check: new(),
        }
    }

    /// Seconds on the wall so far.
    pub fn wall(&self) -> Timings {
        self.timings(self.begin.elapsed(), StageTime::wall_seconds)
    }

    /// Processor seconds so far; in all, those of the whole process.
    pub fn processor(&self) -> Option<Timings> {
        let before = self.process_before?;
        let stages = self.timings(Duration::ZERO, |stage| stage.processor.seconds().unwrap_or(0.0));
        // Read last, so that the stages do not exceed it.
        Some(Timings { total: process_time()?.saturating_sub(before).as_secs_f64(), ..stages })
    }

    fn timings(&self, total: Duration, of: impl Fn(&StageTime) -> f64) -> Timings {
        Timings {
            build: of(&self.build),
            solve: of(&self.solve),
            refine: of(&self.refine),
            search: of(&self.search),
            rows: of(&self.rows),
            write: of(&self.write),
            check: of(&self.check),
            total: total.as_secs_f64(),
        }
    }
}
