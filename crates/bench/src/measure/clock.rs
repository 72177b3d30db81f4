//! Times of a call: processor time of the calling thread where the system tells it, else time on the wall.

use rodsweep::clock::{process_time, thread_time};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// What is read before and after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Of the calling thread alone.
    Processor,
    /// Of all threads of the program together.
    Processors,
    Wall,
}

/// Repeats of a call.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub least: usize,
    pub most: usize,
    /// Repeats end here once there are enough.
    pub seconds: f64,
}

/// What the repeats took (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    pub median: f64,
    pub least: f64,
}

impl Timing {
    /// (median - least) / least
    pub fn spread(&self) -> f64 {
        self.median / self.least - 1.0
    }
}

impl Clock {
    fn now(self, start: Instant) -> Duration {
        match self {
            Clock::Processor => thread_time().unwrap_or_else(|| start.elapsed()),
            Clock::Processors => process_time().unwrap_or_else(|| start.elapsed()),
            Clock::Wall => start.elapsed(),
        }
    }

    /// What a call returns, and how long it took (s).
    pub fn once<T>(self, call: impl FnOnce() -> T) -> (T, f64) {
        let start = Instant::now();
        let before = self.now(start);
        let result = black_box(call());
        (result, (self.now(start) - before).as_secs_f64())
    }

    /// Calls until there are enough repeats; the caller has warmed up.
    pub fn time<T>(self, effort: Effort, mut call: impl FnMut() -> T) -> Timing {
        let begin = Instant::now();
        let mut times = Vec::new();
        while times.len() < effort.least || times.len() < effort.most && begin.elapsed().as_secs_f64() < effort.seconds
        {
            times.push(self.once(&mut call).1);
        }
        times.sort_by(f64::total_cmp);
        Timing { median: times[times.len() / 2], least: times[0].max(1e-12) }
    }
}

/// Whether times are those of the thread.
pub fn has_thread_time() -> bool {
    thread_time().is_some()
}
