//! How many samples each way of the ladder took, and how long.

use super::ladder::Way;
use crate::backend::RungCount;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// Counts of one way.
#[derive(Debug, Default)]
pub struct Rung {
    samples: AtomicU64,
    left: AtomicU64,
    nanoseconds: AtomicU64,
}

impl Rung {
    pub fn add(&self, samples: usize, left: usize, time: Duration) {
        self.samples.fetch_add(samples as u64, Relaxed);
        self.left.fetch_add(left as u64, Relaxed);
        self.nanoseconds.fetch_add(time.as_nanos() as u64, Relaxed);
    }
}

/// The account of those that any sample has taken, in the order of the ladder.
pub fn account(rungs: &[Rung]) -> Vec<RungCount> {
    let of = |way: Way| {
        let Rung { samples, left, nanoseconds } = &rungs[way as usize];
        let seconds = Duration::from_nanos(nanoseconds.load(Relaxed)).as_secs_f64();
        RungCount { rung: way.name().into(), samples: samples.load(Relaxed), left: left.load(Relaxed), seconds }
    };
    Way::ALL.into_iter().map(of).filter(|rung| rung.samples > 0).collect()
}
