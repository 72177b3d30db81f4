//! Counter-based random numbers: hashes of whole numbers, and permutations by them.

/// Rounds of a permutation.
const ROUNDS: usize = 6;
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// 53 bits of a hash as a number in [0, 1).
pub(crate) fn unit_interval(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// The finaliser of splitmix64: a bijection in which every input bit moves every output bit.
fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Three numbers hashed in order.
pub(crate) fn hash(a: u64, b: u64, c: u64) -> u64 {
    mix(hash_key(a, b) ^ c.wrapping_add(GOLDEN).wrapping_mul(0xaef1_7502_108e_f2d9))
}

/// The first two of them.
pub(super) fn hash_key(a: u64, b: u64) -> u64 {
    let first = mix(a.wrapping_add(GOLDEN));
    mix(first ^ b.wrapping_add(GOLDEN).wrapping_mul(0xd1b5_4a32_d192_ed03))
}

/// A keyed permutation of 0..count, where `index` is below `count`: Feistel rounds on the enclosing power of four, walked
/// until inside.
pub fn permute(index: u64, count: u64, key: u64) -> u64 {
    let bits = (64 - (count - 1).leading_zeros()).max(2);
    let half = bits.div_ceil(2);
    let mask = (1u64 << half) - 1;
    let mut at = index;
    loop {
        let (mut left, mut right) = (at >> half, at & mask);
        for round in 0..ROUNDS as u64 {
            (left, right) = (right, left ^ (hash(key, round, right) & mask));
        }
        at = (left << half) | right;
        if at < count {
            return at;
        }
    }
}
