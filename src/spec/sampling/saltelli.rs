//! The design of Saltelli for Sobol' indices: two matrices of one net, and each with one column of the other.

/// Rows of the design for a number of axes: sample = base row · (2 axes + 2) + kind.
///
/// A and B are the halves of one scrambled Sobol' net with twice as many dimensions as there are axes. Kinds follow
/// each other as A, AB_0 .. AB_(d-1), B, BA_0 .. BA_(d-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SaltelliDesign {
    /// What varies.
    pub axis_count: usize,
}

/// Which row of its base row a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DesignKind {
    /// The row of A.
    A,
    /// That of A with this axis from B.
    AB(usize),
    /// The row of B.
    B,
    /// That of B with this axis from A.
    BA(usize),
}

impl SaltelliDesign {
    /// Samples of a base row: 2 axes + 2.
    pub fn rows_per_base(&self) -> u64 {
        2 * self.axis_count as u64 + 2
    }

    /// Base row and kind of a sample.
    pub fn kind(&self, index: u64) -> (u64, DesignKind) {
        let (base, place) = (index / self.rows_per_base(), (index % self.rows_per_base()) as usize);
        let kind = match place.checked_sub(self.axis_count + 1) {
            None if place == 0 => DesignKind::A,
            None => DesignKind::AB(place - 1),
            Some(0) => DesignKind::B,
            Some(place) => DesignKind::BA(place - 1),
        };
        (base, kind)
    }

    /// The sample of a base row and kind.
    pub fn index(&self, base: u64, kind: DesignKind) -> u64 {
        let place = match kind {
            DesignKind::A => 0,
            DesignKind::AB(axis) => 1 + axis,
            DesignKind::B => 1 + self.axis_count,
            DesignKind::BA(axis) => 2 + self.axis_count + axis,
        };
        base * self.rows_per_base() + place as u64
    }

    /// The dimension of the net that an axis has in rows of a kind: `axis` in A, `axis + axis_count` in B.
    pub fn dimension(&self, kind: DesignKind, axis: usize) -> usize {
        let is_of_b = match kind {
            DesignKind::A => false,
            DesignKind::B => true,
            DesignKind::AB(other) => other == axis,
            DesignKind::BA(other) => other != axis,
        };
        if is_of_b { axis + self.axis_count } else { axis }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_and_kinds_lead_to_each_other() {
        for axis_count in 1..6 {
            let design = SaltelliDesign { axis_count };
            for index in 0..5 * design.rows_per_base() {
                let (base, kind) = design.kind(index);
                assert_eq!((base, design.index(base, kind)), (index / design.rows_per_base(), index));
            }
        }
        let kinds: Vec<DesignKind> = (0..6).map(|index| SaltelliDesign { axis_count: 2 }.kind(index).1).collect();
        use DesignKind::{A, AB, B, BA};
        assert_eq!(kinds, [A, AB(0), AB(1), B, BA(0), BA(1)]);
    }
}
