//! Faults on demand, for tests: what goes wrong with a device, and when. The default is nothing.

use crate::backend::Precision;
use crate::model::BLOCK;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A plan of faults. A device that is opened again keeps it and goes on counting.
///
/// Dispatches are numbered from 0. The first of an engine has no samples, and so has the first on a device opened again.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// The device is lost while these dispatches are under way.
    pub lost_at: Vec<u64>,
    /// Buffers larger than this cannot be had (bytes).
    pub memory: Option<u64>,
    /// Numbers that come back changed.
    pub flipped: Option<Flip>,
    /// The self-test's first answer is off by a thousandth.
    pub wrong_arithmetic: bool,
    /// The device has no larger buffers and bindings (bytes).
    pub largest_buffer: Option<u64>,
    /// The device has no more workgroups in one dimension.
    pub most_workgroups: Option<u32>,
    /// What happened so far.
    pub counts: Arc<FaultCounts>,
}

/// One bit of every number of a column, flipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flip {
    /// Dispatches by their number.
    pub dispatches: Range<u64>,
    /// Output column.
    pub column: usize,
    /// Counted from the least significant.
    pub bit: usize,
}

/// How many faults there were.
#[derive(Debug, Default)]
pub struct FaultCounts {
    dispatches: AtomicU64,
    losses: AtomicU64,
    refusals: AtomicU64,
    flips: AtomicU64,
}

impl FaultCounts {
    /// Dispatches so far.
    pub fn dispatches(&self) -> u64 {
        self.dispatches.load(Ordering::Relaxed)
    }

    /// Devices lost.
    pub fn losses(&self) -> u64 {
        self.losses.load(Ordering::Relaxed)
    }

    /// Buffers refused for want of memory.
    pub fn refusals(&self) -> u64 {
        self.refusals.load(Ordering::Relaxed)
    }

    /// Numbers changed.
    pub fn flips(&self) -> u64 {
        self.flips.load(Ordering::Relaxed)
    }
}

impl Faults {
    /// Numbers the next dispatch, and says whether the device is lost with it.
    pub(super) fn dispatch(&self) -> (u64, bool) {
        let number = self.counts.dispatches.fetch_add(1, Ordering::Relaxed);
        let is_lost = self.lost_at.contains(&number);
        self.counts.losses.fetch_add(is_lost.into(), Ordering::Relaxed);
        (number, is_lost)
    }

    /// Whether there is no memory for so many bytes.
    pub(super) fn refuses(&self, bytes: u64) -> bool {
        let refuses = self.memory.is_some_and(|most| bytes > most);
        self.counts.refusals.fetch_add(refuses.into(), Ordering::Relaxed);
        refuses
    }

    /// What came back of a dispatch in blocks of so many bytes from `start` on, changed; `None` where it is not.
    pub(super) fn flipped(
        &self,
        dispatch: u64,
        bytes: &[u8],
        start: usize,
        (block_bytes, precision): (usize, Precision),
    ) -> Option<Vec<u8>> {
        let flip = self.flipped.as_ref().filter(|flip| flip.dispatches.contains(&dispatch))?;
        let mut changed = bytes.to_vec();
        let column = BLOCK * precision.size();
        for block in changed[start..].chunks_exact_mut(block_bytes) {
            for number in block[flip.column * column..][..column].chunks_exact_mut(precision.size()) {
                number[flip.bit / 8] ^= 1 << (flip.bit % 8);
                self.counts.flips.fetch_add(1, Ordering::Relaxed);
            }
        }
        Some(changed)
    }
}
