//! Error bars by contiguous blocks of one net: the estimate keeps the net's accuracy, the scatter of the blocks tells
//! its error.
//!
//! A bootstrap of rows would take a low-discrepancy net for independent draws, and give bars many times too wide.

use super::quantiles::student_two_sided;

/// Blocks of a sweep.
pub const BLOCKS: usize = 16;
/// Numbers of blocks that show how an estimate settles.
pub(super) const DOUBLING: [usize; 5] = [1, 2, 4, 8, 16];

/// A number with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// From all rows.
    pub value: f64,
    /// Lower end of the interval; NaN where there is none. It is not cut off at zero.
    pub low: f64,
    /// Upper end of the interval; NaN where there is none.
    pub high: f64,
}

impl Estimate {
    /// Without an interval.
    pub fn exact(value: f64) -> Estimate {
        Estimate { value, low: f64::NAN, high: f64::NAN }
    }

    /// From `value - error` to `value + error`.
    pub fn within(value: f64, error: f64) -> Estimate {
        Estimate { value, low: value - error, high: value + error }
    }

    /// An estimate of all rows with the estimates of its blocks: Student's interval of the blocks' mean about `value`.
    /// Blocks without an estimate are left out; fewer than two leave no interval.
    pub fn of_blocks(value: f64, blocks: impl IntoIterator<Item = f64>, confidence: f64) -> Estimate {
        let blocks: Vec<f64> = blocks.into_iter().filter(|x| x.is_finite()).collect();
        let count = blocks.len() as f64;
        if blocks.len() < 2 {
            return Estimate::exact(value);
        }
        let mean = blocks.iter().sum::<f64>() / count;
        let variance = blocks.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let error = student_two_sided(confidence, blocks.len() - 1) * (variance / count).sqrt();
        Estimate::within(value, error)
    }
}

/// The block of an item, of `count` in order.
pub(super) fn block_of(item: u64, count: u64) -> usize {
    let blocks = count.clamp(1, BLOCKS as u64);
    let block = u128::from(item) * u128::from(blocks) / u128::from(count.max(1));
    block.min(u128::from(blocks) - 1) as usize
}
