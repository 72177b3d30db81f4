//! A few samples of many, evenly spread.

use super::sampling::hash;
use std::ops::Range;

/// A fixed, evenly spread choice of `chosen` out of `total` indices: one at a hashed place in each stratum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Selection {
    total: u64,
    chosen: u64,
    seed: u64,
}

impl Selection {
    pub fn new(total: u64, chosen: u64, seed: u64) -> Selection {
        Selection { total, chosen: chosen.min(total), seed }
    }

    pub fn len(&self) -> u64 {
        self.chosen
    }

    fn start(&self, stratum: u64) -> u64 {
        (u128::from(stratum) * u128::from(self.total) / u128::from(self.chosen.max(1))) as u64
    }

    /// The chosen index of a stratum.
    pub fn get(&self, stratum: u64) -> u64 {
        let (start, end) = (self.start(stratum), self.start(stratum + 1));
        start + hash(self.seed, stratum, 0) % (end - start).max(1)
    }

    /// The chosen indices in a range, ascending.
    pub fn within(&self, range: Range<u64>) -> Vec<u64> {
        let end = range.end.min(self.total);
        if self.chosen == 0 || range.start >= end {
            return Vec::new();
        }
        let stratum = |index: u64| ((u128::from(index) + 1) * u128::from(self.chosen) - 1) / u128::from(self.total);
        (stratum(range.start) as u64..=stratum(end - 1) as u64)
            .map(|stratum| self.get(stratum))
            .filter(|index| range.contains(index))
            .collect()
    }

    /// Whether nothing is left out.
    pub fn is_everything(&self) -> bool {
        self.chosen == self.total
    }

    pub fn contains(&self, index: u64) -> bool {
        if self.chosen == 0 || index >= self.total {
            return false;
        }
        let product = (u128::from(index) + 1) * u128::from(self.chosen) - 1;
        self.get((product / u128::from(self.total)) as u64) == index
    }
}

#[cfg(test)]
mod tests {
    use super::Selection;

    #[test]
    fn selections_have_their_size_and_recognise_their_members() {
        for (total, chosen) in [(1, 64), (64, 64), (1000, 64), (226_981, 227), (10, 0)] {
            let selection = Selection::new(total, chosen, 4);
            let members: Vec<u64> = (0..total).filter(|index| selection.contains(*index)).collect();
            assert_eq!(members.len() as u64, chosen.min(total));
            assert_eq!(members, (0..selection.len()).map(|k| selection.get(k)).collect::<Vec<_>>());
            let parts = [0..total / 3, total / 3..total / 2 + 1, total / 2 + 1..total + 5];
            assert_eq!(members, parts.into_iter().flat_map(|part| selection.within(part)).collect::<Vec<_>>());
        }
    }
}
