//! Pick-freeze estimators of first, total and second order, from sums over complete pairs.
//!
//! A and B are n x d matrices from one 2d-dimensional net. AB_i is A with column i of B, BA_i is B with column i of A.
//! With a, b, ab, ba for the outputs of a base row, m for their mean and V for the population variance of all values of A
//! and B:
//!
//! | estimator | first order | total |
//! |---|---|---|
//! | Saltelli 2010 (b), Jansen 1999 | ⟨(b - m)(ab - a)⟩ / V | ⟨(a - ab)²⟩ / 2V |
//! | Jansen 1999 | 1 - ⟨(b - ab)²⟩ / 2V | ⟨(a - ab)²⟩ / 2V |
//! | Janon 2014 | (⟨b ab⟩ - c²) / (⟨b² + ab²⟩/2 - c²), c = ⟨b + ab⟩/2 | 1 - the same with a for b |
//! | Azzini, Mara, Rosati 2021 | 2⟨(ba - b)(a - ab)⟩ / D, D = ⟨(a - b)² + (ba - ab)²⟩ | ⟨(b - ba)² + (a - ab)²⟩ / D |
//!
//! Second order (Saltelli 2002): ⟨ba_i ab_j - a b⟩ / V, both ways round, less the two of first order.

use super::sums::{Share, Sums};

/// How indices follow from a pick-freeze design.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Estimator {
    /// Azzini, Mara, Rosati: the most accurate for its cost.
    #[default]
    Azzini,
    /// Jansen for both.
    Jansen,
    /// Saltelli for the first order, Jansen for the total.
    Saltelli,
    /// Janon and Monod for both.
    Janon,
}

impl Estimator {
    /// Every estimator.
    pub const ALL: [Estimator; 4] = [Estimator::Azzini, Estimator::Jansen, Estimator::Saltelli, Estimator::Janon];

    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Estimator::Azzini => "azzini",
            Estimator::Jansen => "jansen",
            Estimator::Saltelli => "saltelli",
            Estimator::Janon => "janon",
        }
    }
}

/// The outputs of one base row; NaN for what is missing.
#[derive(Clone, Copy, Debug)]
pub struct BaseRow<'a> {
    /// Of A.
    pub a: f64,
    /// Of B.
    pub b: f64,
    /// Of AB_1, AB_2, ...
    pub ab: &'a [f64],
    /// Of BA_1, BA_2, ...; empty where the design has none.
    pub ba: &'a [f64],
}

/// What a block of base rows keeps of one output.
#[derive(Clone, Debug, PartialEq)]
pub struct PickFreezeSums {
    /// Taken off every value.
    offset: f64,
    values: Sums,
    inputs: Vec<InputSums>,
    /// By pair of inputs, row by row of the upper triangle.
    pairs: Vec<PairSums>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct InputSums {
    /// Of a, b and ab.
    saltelli: [f64; 3],
    /// Of a and ab, of b and ab.
    with_a: CrossSums,
    with_b: CrossSums,
    /// Of all four: count, product, total, variance.
    azzini: [f64; 4],
}

/// Of x and y: count, differences squared, products, sums, squares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct CrossSums {
    count: f64,
    differences: f64,
    products: f64,
    sums: f64,
    squares: f64,
}

/// Count, Σ (ba_i ab_j - a b), Σ (ba_i + ab_j - a - b), both ways round.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct PairSums([f64; 3]);

impl CrossSums {
    fn add(&mut self, x: f64, y: f64) {
        if (x + y).is_nan() {
            return;
        }
        self.count += 1.0;
        self.differences += (x - y) * (x - y);
        self.products += x * y;
        self.sums += x + y;
        self.squares += x * x + y * y;
    }

    fn merge(&mut self, other: &CrossSums) {
        self.count += other.count;
        self.differences += other.differences;
        self.products += other.products;
        self.sums += other.sums;
        self.squares += other.squares;
    }

    /// ⟨(x - y)²⟩ / 2
    fn half_difference(&self) -> f64 {
        0.5 * self.differences / self.count
    }

    /// ⟨x y⟩ - c², ⟨x² + y²⟩/2 - c² with c = ⟨x + y⟩/2; neither depends on the offset.
    fn covariance(&self) -> Share {
        let square = (0.5 * self.sums / self.count).powi(2);
        Share { part: self.products / self.count - square, whole: 0.5 * self.squares / self.count - square }
    }
}

impl PickFreezeSums {
    /// For so many inputs. The offset should be near the mean.
    pub fn new(inputs: usize, offset: f64) -> PickFreezeSums {
        let pairs = inputs * inputs.saturating_sub(1) / 2;
        PickFreezeSums {
            offset,
            values: Sums::default(),
            inputs: vec![InputSums::default(); inputs],
            pairs: vec![PairSums::default(); pairs],
        }
    }

    /// Adds a base row. Whatever pairs of values are complete count.
    pub fn add(&mut self, row: BaseRow<'_>) {
        let (a, b) = (row.a - self.offset, row.b - self.offset);
        [a, b].into_iter().filter(|x| !x.is_nan()).for_each(|x| self.values.add(x));
        let of = |values: &[f64], k: usize| values.get(k).map_or(f64::NAN, |x| x - self.offset);
        for (k, sums) in self.inputs.iter_mut().enumerate() {
            let (ab, ba) = (of(row.ab, k), of(row.ba, k));
            sums.with_a.add(a, ab);
            sums.with_b.add(b, ab);
            if !(a + b + ab).is_nan() {
                let [count, products, changes] = &mut sums.saltelli;
                *count += 1.0;
                *products += b * (ab - a);
                *changes += ab - a;
            }
            if !(a + b + ab + ba).is_nan() {
                let [count, products, total, variance] = &mut sums.azzini;
                *count += 1.0;
                *products += (ba - b) * (a - ab);
                *total += (b - ba) * (b - ba) + (a - ab) * (a - ab);
                *variance += (a - b) * (a - b) + (ba - ab) * (ba - ab);
            }
        }
        let count = self.inputs.len();
        let mut pairs = self.pairs.iter_mut();
        for i in 0..count {
            for j in i + 1..count {
                let Some(PairSums(sums)) = pairs.next() else { return };
                for (i, j) in [(i, j), (j, i)] {
                    let (ba, ab) = (of(row.ba, i), of(row.ab, j));
                    if !(a + b + ab + ba).is_nan() {
                        sums[0] += 1.0;
                        sums[1] += ba * ab - a * b;
                        sums[2] += ba + ab - a - b;
                    }
                }
            }
        }
    }

    /// Adds another block of the same output.
    pub fn merge(&mut self, other: &PickFreezeSums) {
        self.values.merge(&other.values);
        for (to, from) in self.inputs.iter_mut().zip(&other.inputs) {
            to.saltelli.iter_mut().zip(from.saltelli).for_each(|(to, from)| *to += from);
            to.azzini.iter_mut().zip(from.azzini).for_each(|(to, from)| *to += from);
            to.with_a.merge(&from.with_a);
            to.with_b.merge(&from.with_b);
        }
        for (PairSums(to), PairSums(from)) in self.pairs.iter_mut().zip(&other.pairs) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        }
    }

    /// Mean of A and B.
    pub fn mean(&self) -> f64 {
        self.offset + self.values.mean()
    }

    /// Population variance of A and B.
    pub fn variance(&self) -> f64 {
        self.values.population_variance()
    }

    /// Usable values of A and B.
    pub fn value_count(&self) -> u64 {
        self.values.count as u64
    }

    /// Complete pairs behind an input's index of first order, and of its total.
    pub fn pair_counts(&self, estimator: Estimator, input: usize) -> [u64; 2] {
        let sums = &self.inputs[input];
        let counts = match estimator {
            Estimator::Azzini => [sums.azzini[0]; 2],
            Estimator::Saltelli => [sums.saltelli[0], sums.with_a.count],
            Estimator::Jansen | Estimator::Janon => [sums.with_b.count, sums.with_a.count],
        };
        counts.map(|count| count as u64)
    }

    /// Index of first order.
    pub fn first(&self, estimator: Estimator, input: usize) -> Share {
        let (sums, variance) = (&self.inputs[input], self.variance());
        match estimator {
            Estimator::Azzini => {
                let [count, products, _, whole] = sums.azzini;
                Share { part: 2.0 * products / count, whole: whole / count }
            }
            Estimator::Saltelli => {
                let [count, products, changes] = sums.saltelli;
                Share { part: (products - self.values.mean() * changes) / count, whole: variance }
            }
            Estimator::Jansen => Share { part: variance - sums.with_b.half_difference(), whole: variance },
            Estimator::Janon => sums.with_b.covariance(),
        }
    }

    /// Total index.
    pub fn total(&self, estimator: Estimator, input: usize) -> Share {
        let (sums, variance) = (&self.inputs[input], self.variance());
        match estimator {
            Estimator::Azzini => {
                let [count, _, total, whole] = sums.azzini;
                Share { part: total / count, whole: whole / count }
            }
            Estimator::Saltelli | Estimator::Jansen => Share { part: sums.with_a.half_difference(), whole: variance },
            Estimator::Janon => {
                let Share { part, whole } = sums.with_a.covariance();
                Share { part: whole - part, whole }
            }
        }
    }

    /// Index of first order of two inputs together, and the complete pairs behind it.
    pub fn closed_second(&self, i: usize, j: usize) -> (Share, u64) {
        let (i, j, count) = (i.min(j), i.max(j), self.inputs.len());
        let at = i * count - i * (i + 1) / 2 + j - i - 1;
        let [count, products, sums] = self.pairs[at].0;
        let part = (products - self.values.mean() * sums) / count;
        (Share { part, whole: self.variance() }, count as u64)
    }
}
