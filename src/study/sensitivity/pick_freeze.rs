//! A pick-freeze design as it streams by: sums in blocks, and the indices that they give.

use super::blocks::{BLOCKS, DOUBLING, Estimate, block_of};
use super::estimator::{BaseRow, Estimator, PickFreezeSums};
use super::sums::Share;

/// One output of a pick-freeze design, in blocks of base rows. Its memory does not depend on the number of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct PickFreeze {
    bases: u64,
    blocks: Vec<PickFreezeSums>,
    all: PickFreezeSums,
    /// The base row that is being read, and its values: A, AB_1, .., B, BA_1, ..
    base: u64,
    row: Vec<f64>,
}

/// An index, and the complete pairs behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedEstimate {
    /// Value and interval.
    pub estimate: Estimate,
    /// Complete pairs; of a vector, of the component that has fewest.
    pub pairs: u64,
}

impl PickFreeze {
    /// For so many inputs and base rows; the offset should be near the output's mean.
    pub fn new(inputs: usize, bases: u64, offset: f64) -> PickFreeze {
        let sums = PickFreezeSums::new(inputs, offset);
        let row = vec![f64::NAN; 2 * inputs + 2];
        PickFreeze { bases, blocks: vec![sums.clone(); BLOCKS], all: sums, base: 0, row }
    }

    /// Takes the value of a row of the interleaved design, rows in order; NaN for what is missing.
    pub fn push(&mut self, base: u64, place: usize, value: f64) {
        if base != self.base {
            self.flush();
            self.base = base;
        }
        self.row[place] = value;
    }

    /// Takes a whole base row.
    pub fn add(&mut self, base: u64, row: BaseRow<'_>) {
        self.blocks[block_of(base, self.bases)].add(row);
    }

    /// The sums are complete: no more rows come.
    pub fn finish(mut self) -> PickFreeze {
        self.flush();
        for block in &self.blocks {
            self.all.merge(block);
        }
        self
    }

    fn flush(&mut self) {
        let (inputs, base) = (self.row.len() / 2 - 1, self.base);
        let row = std::mem::take(&mut self.row);
        let (a_part, b_part) = row.split_at(inputs + 1);
        self.add(base, BaseRow { a: a_part[0], b: b_part[0], ab: &a_part[1..], ba: &b_part[1..] });
        self.row = row;
        self.row.fill(f64::NAN);
    }

    /// The sums of all blocks.
    pub fn sums(&self) -> &PickFreezeSums {
        &self.all
    }

    /// Index of first order of a vector's components, or of one output.
    pub fn first(of: &[&PickFreeze], estimator: Estimator, input: usize, confidence: f64) -> PairedEstimate {
        let pairs = of.iter().map(|one| one.all.pair_counts(estimator, input)[0]).min().unwrap_or(0);
        let estimate = in_blocks(of, confidence, |sums| sums.first(estimator, input));
        PairedEstimate { estimate, pairs }
    }

    /// Total index of a vector's components, or of one output.
    pub fn total(of: &[&PickFreeze], estimator: Estimator, input: usize, confidence: f64) -> PairedEstimate {
        let pairs = of.iter().map(|one| one.all.pair_counts(estimator, input)[1]).min().unwrap_or(0);
        let estimate = in_blocks(of, confidence, |sums| sums.total(estimator, input));
        PairedEstimate { estimate, pairs }
    }

    /// Index of second order of two inputs: what they do together beyond what each does alone.
    pub fn second(of: &[&PickFreeze], estimator: Estimator, [i, j]: [usize; 2], confidence: f64) -> PairedEstimate {
        let pairs = of.iter().map(|one| one.all.closed_second(i, j).1).min().unwrap_or(0);
        let value = |sums: &dyn Fn(&PickFreeze) -> PickFreezeSums| {
            let share =
                |share: &dyn Fn(&PickFreezeSums) -> Share| of.iter().map(|one| share(&sums(one))).sum::<Share>();
            let alone = |input| share(&|sums| sums.first(estimator, input)).value();
            share(&|sums| sums.closed_second(i, j).0).value() - alone(i) - alone(j)
        };
        let blocks = (0..BLOCKS).map(|k| value(&|one| one.blocks[k].clone()));
        let estimate = Estimate::of_blocks(value(&|one| one.all.clone()), blocks, confidence);
        PairedEstimate { estimate, pairs }
    }
}

impl PickFreeze {
    /// An index by the first blocks, ever twice as many: base rows that count, and value.
    pub(super) fn settling(of: &[&PickFreeze], share: impl Fn(&PickFreezeSums) -> Share) -> Vec<(u64, f64)> {
        let sums = |one: &PickFreeze, count: usize| {
            let mut sums = one.blocks[0].clone();
            one.blocks[1..count].iter().for_each(|block| sums.merge(block));
            sums
        };
        let step = |count: usize| {
            let parts: Vec<PickFreezeSums> = of.iter().map(|one| sums(one, count)).collect();
            let rows = parts.first().map_or(0, |sums| sums.value_count() / 2);
            (rows, parts.iter().map(&share).sum::<Share>().value())
        };
        DOUBLING.into_iter().map(step).filter(|(_, value)| value.is_finite()).collect()
    }
}

fn in_blocks(of: &[&PickFreeze], confidence: f64, share: impl Fn(&PickFreezeSums) -> Share) -> Estimate {
    let value = of.iter().map(|one| share(&one.all)).sum::<Share>().value();
    let blocks = (0..BLOCKS).map(|k| of.iter().map(|one| share(&one.blocks[k])).sum::<Share>().value());
    Estimate::of_blocks(value, blocks, confidence)
}
