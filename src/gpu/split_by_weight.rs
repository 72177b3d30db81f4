//! Work cut into shares, by weight.

use std::ops::Range;

/// Cuts ranges, in order, into as many shares as there are weights, each as long as its weight says.
pub(super) fn split_by_weight(ranges: &[Range<u64>], weights: &[f64]) -> Vec<Vec<Range<u64>>> {
    let total: u64 = ranges.iter().map(|range| range.end - range.start).sum();
    let sum: f64 = weights.iter().sum();
    let mut ranges = ranges.iter().filter(|range| !range.is_empty()).cloned();
    let mut rest = ranges.next();
    let (mut weight, mut taken) = (0.0, 0);
    let mut share = |index: usize| {
        weight += weights[index];
        let end = if index + 1 == weights.len() { total } else { (total as f64 * weight / sum).round() as u64 };
        let mut share = Vec::new();
        while let Some(range) = rest.take_if(|_| taken < end.min(total)) {
            let cut = range.end.min(range.start + (end.min(total) - taken));
            taken += cut - range.start;
            rest = if cut < range.end { Some(cut..range.end) } else { ranges.next() };
            share.push(range.start..cut);
        }
        share
    };
    (0..weights.len()).map(&mut share).collect()
}

#[cfg(test)]
mod tests {
    use super::split_by_weight;

    #[test]
    fn everything_is_shared_once_and_in_order() {
        let ranges = [0..10, 10..10, 20..50, 60..61];
        for weights in [vec![1.0], vec![1.0, 1.0], vec![1e-9, 3.0, 1.0], vec![1.0; 50], vec![1e12, 1.0]] {
            let shares = split_by_weight(&ranges, &weights);
            assert_eq!(shares.len(), weights.len());
            let all: Vec<u64> = shares.iter().flatten().cloned().flatten().collect();
            assert_eq!(all, ranges.iter().cloned().flatten().collect::<Vec<_>>(), "{weights:?}");
        }
        assert_eq!(split_by_weight(&ranges, &[3.0, 1.0]), [vec![0..10, 20..41], vec![41..50, 60..61]]);
        assert_eq!(split_by_weight(&[], &[1.0, 1.0]), [vec![], vec![]]);
    }
}
