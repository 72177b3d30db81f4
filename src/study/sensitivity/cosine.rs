//! Indices of first order from any sample, by cosines; jumps that slopes do not see.
//!
//! With u the share of an input's law below its value and e_k = √2 cos(kπu), c_k = ⟨f e_k⟩ and S1 = Σ c_k² / V. For an
//! output that is continuous in the input, integration by parts gives c_k = -⟨f_u √2 sin(kπu)/(kπ)⟩ as well. The mix of the
//! two that scatters least is taken, and the sampling bias of c_k² is taken off (Plischke 2010; Roustant, Gamboa, Iooss
//! 2020). Where the output jumps, the two differ: the jump share is the part of V that slopes do not see.
//!
//! Chatterjee's rank estimator is not offered: on a low-discrepancy net it is inconsistent.

use super::blocks::{BLOCKS, DOUBLING, Estimate};
use super::sums::{Share, Sums};
use std::f64::consts::{PI, SQRT_2};

/// Cosines of an estimate.
pub const ORDERS: usize = 6;
/// Cosines of a jump share.
pub const JUMP_ORDERS: usize = 4;
/// Above this jump share nothing that rests on derivatives is trusted.
pub const JUMP_LIMIT: f64 = 0.005;
/// Missing rows cut the law of the others: at its edges values and slopes differ. Of a share p that is missing, about so
/// many times p² of the variance may look like a jump (an edge two standard deviations high, four orders).
const EDGE: f64 = 32.0;
/// A jump is told from chance where what slopes do not see is so many standard deviations above what chance makes.
const CHANCE: f64 = 4.0;

/// The cosines of an input's value, and what its slope is multiplied by, with the slope by u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonics {
    cosines: [f64; ORDERS],
    sines: [f64; ORDERS],
}

impl Harmonics {
    /// At u, the share of the law below the value. `rate` is dx/du, what a slope by the input is multiplied by.
    pub fn new(u: f64, rate: f64) -> Harmonics {
        let (sine, cosine) = (PI * u).sin_cos();
        let (mut s, mut c) = (0.0, 1.0);
        let (mut cosines, mut sines) = ([0.0; ORDERS], [0.0; ORDERS]);
        for k in 0..ORDERS {
            (s, c) = (s * cosine + c * sine, c * cosine - s * sine);
            cosines[k] = SQRT_2 * c;
            sines[k] = -SQRT_2 * s * rate / ((k + 1) as f64 * PI);
        }
        Harmonics { cosines, sines }
    }
}

/// What a block keeps of one output and one input.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct CosineSums {
    values: Sums,
    /// e, e², v = f e, v², v e, s = slope term, s², v s, e s of each order.
    orders: [[f64; ORDERS]; 9],
}

/// Mean of f e_k by values and by slopes, with variances and covariance of a row's share.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Coefficient {
    value: f64,
    slope: f64,
    value_variance: f64,
    slope_variance: f64,
    covariance: f64,
    count: f64,
}

/// By what the coefficients are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Source {
    /// Values of the output.
    Values,
    /// Its slopes.
    Slopes,
    /// Whatever of both scatters least.
    Mix,
}

impl CosineSums {
    fn add(&mut self, y: f64, at: &Harmonics) {
        self.values.add(y);
        let [e1, e2, v1, v2, ve, ..] = &mut self.orders;
        for k in 0..ORDERS {
            let e = at.cosines[k];
            let v = y * e;
            e1[k] += e;
            e2[k] += e * e;
            v1[k] += v;
            v2[k] += v * v;
            ve[k] += v * e;
        }
    }

    fn add_slope(&mut self, y: f64, slope: f64, at: &Harmonics) {
        let [.., s1, s2, vs, es] = &mut self.orders;
        for k in 0..ORDERS {
            let (e, s) = (at.cosines[k], slope * at.sines[k]);
            let v = y * e;
            s1[k] += s;
            s2[k] += s * s;
            vs[k] += v * s;
            es[k] += e * s;
        }
    }

    fn merge(&mut self, other: &CosineSums) {
        self.values.merge(&other.values);
        for (to, from) in self.orders.iter_mut().flatten().zip(other.orders.iter().flatten()) {
            *to += from;
        }
    }

    /// Centred by the sums' own mean.
    fn coefficient(&self, k: usize) -> Coefficient {
        let [e1, e2, v1, v2, ve, s1, s2, vs, es] = self.orders.each_ref().map(|sums| sums[k]);
        let (n, d) = (self.values.count, self.values.mean());
        let (value, slope) = ((v1 - d * e1) / n, s1 / n);
        let over = |squares: f64, product: f64| (squares - n * product) / (n - 1.0);
        Coefficient {
            value,
            slope,
            value_variance: over(v2 - 2.0 * d * ve + d * d * e2, value * value),
            slope_variance: over(s2, slope * slope),
            covariance: over(vs - d * es, value * slope),
            count: n,
        }
    }

    /// Σ c_k² without its sampling bias, and the variance.
    fn share(&self, source: Source, orders: usize) -> Share {
        let part = (0..orders.min(ORDERS)).map(|k| self.coefficient(k).square(source)).sum();
        Share { part, whole: self.values.sample_variance() }
    }

    /// What slopes do not see beyond what chance makes, and the variance that chance gives it.
    fn excess(&self) -> [f64; 2] {
        let each = (0..JUMP_ORDERS).map(|k| self.coefficient(k).excess());
        each.fold([0.0; 2], |[sum, variance], [excess, noise]| [sum + excess, variance + 2.0 * noise * noise])
    }

    fn jump(&self) -> Share {
        let part = (0..JUMP_ORDERS).map(|k| self.coefficient(k).excess()[0].max(0.0)).sum();
        Share { part, whole: self.values.sample_variance() }
    }
}

impl Coefficient {
    fn square(&self, source: Source) -> f64 {
        let weight = match source {
            Source::Values => 1.0,
            Source::Slopes => 0.0,
            Source::Mix => self.best_weight(),
        };
        let other = 1.0 - weight;
        let mean = weight * self.value + other * self.slope;
        let variance = weight * weight * self.value_variance
            + other * other * self.slope_variance
            + 2.0 * weight * other * self.covariance;
        mean * mean - variance / self.count
    }

    /// Of the values, so that the mix scatters least.
    fn best_weight(&self) -> f64 {
        let difference = self.value_variance + self.slope_variance - 2.0 * self.covariance;
        if difference > 0.0 { ((self.slope_variance - self.covariance) / difference).clamp(0.0, 1.0) } else { 0.5 }
    }

    /// Squared difference of values and slopes less its expectation without a jump, and that expectation.
    fn excess(&self) -> [f64; 2] {
        let noise = (self.value_variance + self.slope_variance - 2.0 * self.covariance) / self.count;
        [(self.value - self.slope).powi(2) - noise, noise]
    }
}

/// One output against one input, in blocks. Its memory does not depend on the number of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Cosines {
    offset: f64,
    has_slopes: bool,
    blocks: Vec<CosineSums>,
    all: CosineSums,
    slopes: Sums,
}

impl Cosines {
    /// The offset should be near the output's mean.
    pub fn new(offset: f64, has_slopes: bool) -> Cosines {
        let blocks = vec![CosineSums::default(); BLOCKS];
        Cosines { offset, has_slopes, blocks, all: CosineSums::default(), slopes: Sums::default() }
    }

    /// Adds a row: block, value of the output, slope by the input (any number without slopes). Rows without a value, or
    /// without a slope where there are slopes, do not count.
    pub fn add(&mut self, block: usize, value: f64, slope: f64, at: &Harmonics) {
        if value.is_nan() || self.has_slopes && slope.is_nan() {
            return;
        }
        let y = value - self.offset;
        self.blocks[block].add(y, at);
        if self.has_slopes {
            self.blocks[block].add_slope(y, slope, at);
            self.slopes.add(slope);
        }
    }

    /// The sums are complete: no more rows come.
    pub fn finish(mut self) -> Cosines {
        for block in &self.blocks {
            self.all.merge(block);
        }
        self
    }

    /// Rows that count.
    pub fn row_count(&self) -> u64 {
        self.all.values.count as u64
    }

    /// Variance of the rows that count, 1/(n - 1).
    pub fn variance(&self) -> f64 {
        self.all.values.sample_variance()
    }

    /// Mean, standard deviation and mean square of the slope.
    pub fn slope_moments(&self) -> [f64; 3] {
        let Sums { count, squares, .. } = self.slopes;
        [self.slopes.mean(), self.slopes.population_variance().sqrt(), squares / count]
    }

    /// Index of first order of a vector's components, or of one output.
    pub fn first(of: &[&Cosines], source: Source, orders: usize, confidence: f64) -> Estimate {
        let value = |sums: &dyn Fn(&Cosines) -> CosineSums| {
            of.iter().map(|one| sums(one).share(source, orders)).sum::<Share>().value()
        };
        let blocks = (0..BLOCKS).map(|k| value(&|one| one.blocks[k]));
        Estimate::of_blocks(value(&|one| one.all), blocks, confidence)
    }

    /// The index by the first blocks, ever twice as many: rows that count, and value.
    pub(super) fn settling(of: &[&Cosines], source: Source, orders: usize) -> Vec<(u64, f64)> {
        let sums = |one: &Cosines, count: usize| {
            let mut sums = CosineSums::default();
            one.blocks[..count].iter().for_each(|block| sums.merge(block));
            sums
        };
        let step = |count: usize| {
            let parts: Vec<CosineSums> = of.iter().map(|one| sums(one, count)).collect();
            let rows = parts.first().map_or(0.0, |sums| sums.values.count) as u64;
            (rows, parts.iter().map(|sums| sums.share(source, orders)).sum::<Share>().value())
        };
        DOUBLING.into_iter().map(step).filter(|(_, value)| value.is_finite()).collect()
    }

    /// Part of the variance that slopes do not see; `None` without slopes.
    pub fn jump_share(of: &[&Cosines]) -> Option<f64> {
        let has_slopes = of.iter().all(|one| one.has_slopes);
        has_slopes.then(|| of.iter().map(|one| one.all.jump()).sum::<Share>().value())
    }

    /// Whether the jump share is above its limit, and neither by chance nor by the share of the rows that is missing.
    pub fn jumps(of: &[&Cosines], missing: f64) -> bool {
        let [excess, variance] =
            of.iter().map(|one| one.all.excess()).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
        Cosines::jump_share(of).is_some_and(|share| share > JUMP_LIMIT + EDGE * missing * missing)
            && excess > CHANCE * variance.sqrt()
    }
}
