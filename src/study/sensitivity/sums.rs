//! Sums that blocks keep of one quantity, about a fixed offset: rounding does not grow with the mean.

/// Number, sum and sum of squares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    pub count: f64,
    pub sum: f64,
    pub squares: f64,
}

impl Sums {
    pub fn add(&mut self, x: f64) {
        self.count += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    pub fn merge(&mut self, other: &Sums) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
    }

    pub fn mean(&self) -> f64 {
        self.sum / self.count
    }

    /// Over all values: 1/n.
    pub fn population_variance(&self) -> f64 {
        (self.squares / self.count - self.mean().powi(2)).max(0.0)
    }

    /// Unbiased: 1/(n - 1).
    pub fn sample_variance(&self) -> f64 {
        self.population_variance() * self.count / (self.count - 1.0)
    }
}

/// A part and the whole that it is a share of; those of the components of a vector add up (Gamboa, Janon, Klein,
/// Lagnoux 2013).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// What an input accounts for.
    pub part: f64,
    /// The variance, or what stands for it.
    pub whole: f64,
}

impl Share {
    /// Part over whole; NaN where there is nothing to share.
    pub fn value(&self) -> f64 {
        if self.whole > 0.0 { self.part / self.whole } else { f64::NAN }
    }
}

impl std::iter::Sum for Share {
    fn sum<I: Iterator<Item = Share>>(shares: I) -> Share {
        shares
            .fold(Share::default(), |sum, share| Share { part: sum.part + share.part, whole: sum.whole + share.whole })
    }
}
