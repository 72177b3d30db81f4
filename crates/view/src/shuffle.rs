//! A fixed shuffled order of rows: any beginning of it is a fair sample of all.

/// Mixes the numbers below `count`, each once, without a table of them: four rounds of Feistel's network, walked until it
/// falls among them again.
#[derive(Clone, Copy, Debug)]
pub struct Shuffle {
    count: u64,
    half: u32,
}

impl Shuffle {
    /// Of so many rows.
    pub fn new(count: u64) -> Shuffle {
        let bits = 64 - count.max(2).saturating_sub(1).leading_zeros();
        Shuffle { count, half: bits.div_ceil(2) }
    }

    /// The row at a place of the order.
    pub fn at(&self, place: u64) -> u64 {
        let mut at = place;
        loop {
            at = self.mix(at);
            if at < self.count {
                return at;
            }
        }
    }

    fn mix(&self, at: u64) -> u64 {
        let mask = (1 << self.half) - 1;
        let (mut left, mut right) = (at >> self.half, at & mask);
        for round in 0..4u64 {
            (left, right) = (right, left ^ (hash(right.wrapping_add(round << 60)) & mask));
        }
        left << self.half | right
    }
}

/// Steele, Lea and Flood's finaliser (SplitMix64).
fn hash(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
