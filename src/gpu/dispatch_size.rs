//! How much work the device gets at once: no dispatch keeps it busy for long, and its memory suffices.

use super::adapter::AdapterKind;

/// Time that a dispatch should take (s); some systems reset a device that is busy much longer.
const TARGET: f64 = 0.1;

/// Blocks of the first dispatch on an unknown device, and on a card of its own.
const FIRST_BLOCKS: usize = 16;
const FIRST_ON_A_CARD: usize = 256;

/// Growth from one dispatch to the next at most.
const GROWTH: f64 = 4.0;

/// Blocks of the next dispatch, by what earlier ones have shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DispatchSize {
    blocks: usize,
    limit: usize,
}

impl DispatchSize {
    /// Starts small; never exceeds `limit` blocks.
    pub fn new(limit: usize, kind: AdapterKind) -> Self {
        let first = if kind == AdapterKind::Discrete { FIRST_ON_A_CARD } else { FIRST_BLOCKS };
        Self { blocks: first.min(limit), limit }
    }

    /// Blocks of the next dispatch.
    pub fn blocks(&self) -> usize {
        self.blocks
    }

    /// After a lack of memory for so many blocks: half of them at most. False where it was a single one.
    pub fn halve(&mut self, blocks: usize) -> bool {
        if blocks <= 1 {
            return false;
        }
        self.limit = blocks / 2;
        self.blocks = self.blocks.min(self.limit);
        true
    }

    /// After a loss: half as many, now and at most.
    pub fn ease(&mut self) {
        self.limit = (self.limit / 2).max(1);
        self.blocks = (self.blocks / 2).clamp(1, self.limit);
    }

    /// Learns from a dispatch of `blocks` that took `seconds`.
    pub fn learn(&mut self, blocks: usize, seconds: f64) {
        let ratio = (TARGET / seconds.max(1e-9)).min(GROWTH);
        let next = ((blocks as f64 * ratio) as usize).clamp(1, self.limit);
        // A short dispatch at the end of a batch says little about a full one, unless it took too long.
        if blocks >= self.blocks || ratio < 1.0 {
            self.blocks = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{AdapterKind, DispatchSize};

    #[test]
    fn grows_to_the_target_and_no_further() {
        let seconds_per_block = 0.001;
        let mut size = DispatchSize::new(1000, AdapterKind::Virtual);
        for _ in 0..5 {
            size.learn(size.blocks(), size.blocks() as f64 * seconds_per_block);
        }
        assert_eq!(size.blocks(), 100);
    }

    #[test]
    fn respects_its_limit_and_stays_above_zero() {
        let mut size = DispatchSize::new(20, AdapterKind::Virtual);
        size.learn(16, 0.0);
        assert_eq!(size.blocks(), 20);
        size.learn(20, 1e6);
        assert_eq!(size.blocks(), 1);
    }

    #[test]
    fn gives_half_until_one_is_left() {
        let mut size = DispatchSize::new(20, AdapterKind::Virtual);
        assert!(size.halve(16));
        assert_eq!(size.blocks(), 8);
        size.learn(8, 0.0);
        assert_eq!(size.blocks(), 8);
        assert!(size.halve(3) && !size.halve(1));
        assert_eq!(size.blocks(), 1);
        let mut size = DispatchSize::new(20, AdapterKind::Virtual);
        size.ease();
        assert_eq!(size.blocks(), 8);
        size.learn(8, 0.0);
        assert_eq!(size.blocks(), 10);
        (0..9).for_each(|_| size.ease());
        assert_eq!(size.blocks(), 1);
    }

    #[test]
    fn a_short_last_dispatch_does_not_slow_the_next_batch() {
        let mut size = DispatchSize::new(1000, AdapterKind::Virtual);
        size.learn(16, 0.001);
        size.learn(1, 0.05);
        assert_eq!(size.blocks(), 64);
    }
}
