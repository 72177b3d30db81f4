//! An order of samples in which neighbours are alike, so that those of a register take about as many steps.

use crate::model::Blocks;

/// Binary digits of a place in the order.
const DIGITS: usize = 60;

/// Sorts samples along a curve that fills the box of their inputs (Morton 1966).
pub fn sort_alike(inputs: &Blocks<f64>, samples: &mut [usize]) {
    let count = inputs.column_count().min(DIGITS);
    if count == 0 {
        return;
    }
    let digits = DIGITS / count;
    let cells = (1u64 << digits) as f64;
    let bounds: Vec<(f64, f64)> = (0..count)
        .map(|column| {
            let values = samples.iter().map(|sample| inputs.get(*sample, column));
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        })
        .collect();
    let place = |sample: usize| {
        let mut place = 0u64;
        for (column, (low, high)) in bounds.iter().enumerate() {
            let share = (inputs.get(sample, column) - low) / (high - low);
            // No number counts as the least.
            let cell = (share * cells).min(cells - 1.0) as u64;
            for digit in 0..digits {
                place |= (cell >> digit & 1) << (digit * count + column);
            }
        }
        place
    };
    samples.sort_by_cached_key(|sample| (place(*sample), *sample));
}

#[cfg(test)]
mod tests {
    use super::sort_alike;
    use crate::model::Blocks;

    #[test]
    fn neighbours_in_the_order_are_neighbours() {
        // A grid of 16 by 16, its rows in an order of their own; a column that never changes; no numbers.
        let mut inputs = Blocks::new(3, 257);
        for sample in 0..256 {
            inputs.set(sample, 0, (sample * 7 % 16) as f64 * 1e-3);
            inputs.set(sample, 1, (sample / 16) as f64 - 8.0);
            inputs.set(sample, 2, 5.0);
        }
        (0..3).for_each(|column| inputs.set(256, column, f64::NAN));
        let mut samples: Vec<usize> = (0..257).collect();
        sort_alike(&inputs, &mut samples);
        let mut all = samples.clone();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..257), "each sample once");
        samples.retain(|sample| *sample < 256);
        for eight in samples.chunks(8) {
            for (column, most) in [(0, 3.5e-3), (1, 3.5)] {
                let values = || eight.iter().map(|sample| inputs.get(*sample, column));
                let wide = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
                assert!(wide < most, "{eight:?} are {wide} apart in column {column}");
            }
        }
    }
}
