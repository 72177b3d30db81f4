//! How many samples each rung of the ladder took, and how long.

use crate::backend::RungCount;
use crate::cpu::ladder::Rung;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// Counts of one rung.
#[derive(Debug, Default)]
pub struct Tally {
    samples: AtomicU64,
    left: AtomicU64,
    nanoseconds: AtomicU64,
}

impl Tally {
    pub fn add(&self, samples: usize, left: usize, time: Duration) {
        self.samples.fetch_add(samples as u64, Relaxed);
        self.left.fetch_add(left as u64, Relaxed);
        self.nanoseconds.fetch_add(time.as_nanos() as u64, Relaxed);
    }
}

/// The account of those that any sample has taken, in the order of the ladder.
pub fn account(tallies: &[Tally]) -> Vec<RungCount> {
    let of = |rung: Rung| {
        let Tally { samples, left, nanoseconds } = &tallies[rung as usize];
        let seconds = Duration::from_nanos(nanoseconds.load(Relaxed)).as_secs_f64();
        RungCount { rung: rung.line().rung.into(), samples: samples.load(Relaxed), left: left.load(Relaxed), seconds }
    };
    Rung::ALL.into_iter().map(of).filter(|rung| rung.samples > 0).collect()
}
