//! By which law a number varies: from a share of all values to the value, and back.

use super::normal;
use std::sync::Arc;

/// Ratio of the ends, less one, or width over the standard deviation, below which a law between ends is uniform to
/// round-off of its closed moments.
const NARROW: f64 = 1e-3;

/// By which law a number varies.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// Equally likely between two ends; `from` may be the larger one.
    Uniform {
        /// Where it begins.
        from: f64,
        /// Where it ends.
        to: f64,
    },
    /// Its logarithm is equally likely between those of two ends: each decade has the same share.
    LogUniform {
        /// Where it begins; not zero.
        from: f64,
        /// Where it ends; of the sign of `from`.
        to: f64,
    },
    /// The density rises from one end to the mode and falls to the other end, each along a line.
    Triangular {
        /// Lower end.
        from: f64,
        /// The likeliest value, between the ends or at one.
        mode: f64,
        /// Upper end.
        to: f64,
    },
    /// Normally distributed, without limits.
    Normal {
        /// Mean and median.
        mean: f64,
        /// Greater than zero.
        standard_deviation: f64,
    },
    /// Normally distributed, but never beyond two ends.
    TruncatedNormal {
        /// Mean of the normal law before it is cut.
        mean: f64,
        /// Standard deviation of the normal law before it is cut; greater than zero.
        standard_deviation: f64,
        /// Lower end.
        from: f64,
        /// Upper end.
        to: f64,
    },
    /// The logarithm is normally distributed; all values have the sign of the mean.
    LogNormal {
        /// Mean of the values, not of their logarithms; not zero.
        mean: f64,
        /// Standard deviation of the values, not of their logarithms; greater than zero.
        standard_deviation: f64,
    },
    /// One of these values, each as likely as any other; at least one.
    Values(Arc<[f64]>),
}

use Distribution as D;

impl Distribution {
    /// Its word in a sweep file; a list of values has none.
    pub fn name(&self) -> &'static str {
        match self {
            D::Uniform { .. } => "uniform",
            D::LogUniform { .. } => "log-uniform",
            D::Triangular { .. } => "triangular",
            D::Normal { .. } => "normal",
            D::TruncatedNormal { .. } => "truncated-normal",
            D::LogNormal { .. } => "lognormal",
            D::Values(_) => "values",
        }
    }

    /// Its numbers by their keys in a sweep file; none of a list of values.
    pub fn numbers(&self) -> Vec<(&'static str, f64)> {
        match *self {
            D::Uniform { from, to } | D::LogUniform { from, to } => vec![("from", from), ("to", to)],
            D::Triangular { from, mode, to } => vec![("from", from), ("mode", mode), ("to", to)],
            D::Normal { mean, standard_deviation } | D::LogNormal { mean, standard_deviation } => {
                vec![("mean", mean), ("standard_deviation", standard_deviation)]
            }
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                vec![("mean", mean), ("standard_deviation", standard_deviation), ("from", from), ("to", to)]
            }
            D::Values(_) => Vec::new(),
        }
    }

    /// In words: `normal, mean 1, standard deviation 0.1`.
    pub fn words(&self) -> String {
        match self {
            D::Uniform { from, to } => format!("uniform from {from} to {to}"),
            D::Values(values) => match &values[..] {
                [first, .., last] if values.len() > 8 => format!("one of {} values, {first} … {last}", values.len()),
                _ => format!("one of {}", values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")),
            },
            _ => {
                let number = |(key, number): &(&str, f64)| format!(", {} {number}", key.replace('_', " "));
                self.name().to_owned() + &self.numbers().iter().map(number).collect::<String>()
            }
        }
    }

    /// The value that a share `unit` of all values lies below (from the side of `from`, or of the first value): maps
    /// [0, 1] to the law.
    ///
    /// A law without ends takes the shares 0 and 1 as the nearest numbers inside.
    pub fn value(&self, unit: f64) -> f64 {
        match *self {
            D::Uniform { from, to } => from + (to - from) * unit,
            D::LogUniform { from, to } => from * (to / from).powf(unit),
            D::Triangular { from, mode, to } => {
                let width = to - from;
                match unit * width < mode - from {
                    true => from + (unit * width * (mode - from)).sqrt(),
                    false => to - ((1.0 - unit) * width * (to - mode)).sqrt(),
                }
            }
            D::Normal { mean, standard_deviation } => mean + standard_deviation * normal::quantile(unit),
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                Cut::new(mean, standard_deviation, from, to).value(unit).clamp(from, to)
            }
            D::LogNormal { mean, standard_deviation } => {
                let (middle, spread) = logarithm(mean, standard_deviation);
                mean.signum() * (middle + spread * normal::quantile(unit)).exp()
            }
            D::Values(ref values) => values[((unit * values.len() as f64) as usize).min(values.len() - 1)],
        }
    }

    /// The inverse of [`Distribution::value`]. Of listed values the middle of the value's shares; NaN for any other.
    pub fn unit(&self, value: f64) -> f64 {
        match *self {
            D::Uniform { from, to } => (value - from) / (to - from),
            D::LogUniform { from, to } => (value / from).ln() / (to / from).ln(),
            D::Triangular { from, mode, to } => {
                let width = to - from;
                match value < mode {
                    true => (value - from).powi(2) / (width * (mode - from)),
                    false if to > mode => 1.0 - (to - value).powi(2) / (width * (to - mode)),
                    false => 1.0,
                }
            }
            D::Normal { mean, standard_deviation } => normal::share_below((value - mean) / standard_deviation),
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                Cut::new(mean, standard_deviation, from, to).unit(value)
            }
            D::LogNormal { mean, standard_deviation } => {
                let (middle, spread) = logarithm(mean, standard_deviation);
                normal::share_below(((value * mean.signum()).ln() - middle) / spread)
            }
            D::Values(ref values) => {
                let places = || values.iter().enumerate().filter(|(_, listed)| **listed == value);
                let sum: f64 = places().map(|(place, _)| place as f64 + 0.5).sum();
                sum / places().count() as f64 / values.len() as f64
            }
        }
    }

    /// Derivative of [`Distribution::value`] by the share; negative where the values fall. NaN for listed values.
    pub fn rate(&self, unit: f64) -> f64 {
        match *self {
            D::Uniform { from, to } => to - from,
            D::LogUniform { from, to } => self.value(unit) * (to / from).ln(),
            D::Normal { standard_deviation, .. } => standard_deviation / normal::density(normal::quantile(unit)),
            D::Triangular { .. } | D::TruncatedNormal { .. } => 1.0 / self.density(self.value(unit)),
            D::LogNormal { mean, .. } => mean.signum() / self.density(self.value(unit)),
            D::Values(_) => f64::NAN,
        }
    }

    /// Probability per unit of the value; NaN for listed values.
    pub fn density(&self, value: f64) -> f64 {
        if self.limits().is_some_and(|(from, to)| !(from.min(to)..=from.max(to)).contains(&value)) {
            return 0.0;
        }
        match *self {
            D::Uniform { from, to } => 1.0 / (to - from).abs(),
            D::LogUniform { from, to } => 1.0 / (value * (to / from).ln()).abs(),
            D::Triangular { from, mode, to } => {
                let height = 2.0 / (to - from);
                match value < mode {
                    true => height * (value - from) / (mode - from),
                    false if to > mode => height * (to - value) / (to - mode),
                    false => height,
                }
            }
            D::Normal { mean, standard_deviation } => {
                normal::density((value - mean) / standard_deviation) / standard_deviation
            }
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                let share = Cut::new(mean, standard_deviation, from, to).share();
                normal::density((value - mean) / standard_deviation) / (standard_deviation * share)
            }
            D::LogNormal { mean, standard_deviation } => {
                let (middle, spread) = logarithm(mean, standard_deviation);
                match value * mean.signum() {
                    size if size > 0.0 => normal::density((size.ln() - middle) / spread) / (spread * size),
                    _ => 0.0,
                }
            }
            D::Values(_) => f64::NAN,
        }
    }

    /// Mean of all values.
    pub fn mean(&self) -> f64 {
        match *self {
            D::Uniform { from, to } => 0.5 * (from + to),
            D::LogUniform { from, to } if is_narrow(from, to) => 0.5 * (from + to),
            D::LogUniform { from, to } => (to - from) / (to / from).ln(),
            D::Triangular { from, mode, to } => from + ((mode - from) + (to - from)) / 3.0,
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                Cut::new(mean, standard_deviation, from, to).moments()[0]
            }
            D::Normal { mean, .. } | D::LogNormal { mean, .. } => mean,
            D::Values(ref values) => values.iter().sum::<f64>() / values.len() as f64,
        }
    }

    /// Standard deviation of all values.
    pub fn standard_deviation(&self) -> f64 {
        match *self {
            D::Uniform { .. } => self.half_range() / 3f64.sqrt(),
            D::LogUniform { from, to } if is_narrow(from, to) => self.half_range() / 3f64.sqrt(),
            D::LogUniform { from, to } => {
                let square = 0.5 * (to - from) * (to + from) / (to / from).ln();
                (square - self.mean().powi(2)).sqrt()
            }
            D::Triangular { from, mode, to } => {
                let (a, b) = (mode - from, to - from);
                ((a * a + b * b - a * b) / 18.0).sqrt()
            }
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                Cut::new(mean, standard_deviation, from, to).moments()[1]
            }
            D::Normal { standard_deviation, .. } | D::LogNormal { standard_deviation, .. } => standard_deviation,
            D::Values(ref values) => {
                let mean = self.mean();
                (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
            }
        }
    }

    /// Half the distance of the ends; for a law without ends that of the uniform law with the same standard deviation.
    pub fn half_range(&self) -> f64 {
        match self.limits() {
            Some((from, to)) => 0.5 * (to - from).abs(),
            None => 3f64.sqrt() * self.standard_deviation(),
        }
    }

    /// From and to, where the law has ends; of listed values the least and the largest.
    pub fn limits(&self) -> Option<(f64, f64)> {
        match *self {
            D::Uniform { from, to } | D::LogUniform { from, to } => Some((from, to)),
            D::Triangular { from, to, .. } | D::TruncatedNormal { from, to, .. } => Some((from, to)),
            D::Normal { .. } | D::LogNormal { .. } => None,
            D::Values(ref values) => {
                Some(values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x))))
            }
        }
    }

    /// Where nearly all values lie: the ends, or for a law without ends where a normal variable is at this many standard
    /// deviations on either side. The lower one first.
    pub fn range(&self, deviations: f64) -> (f64, f64) {
        let (a, b) = match *self {
            D::Normal { mean, standard_deviation } => {
                (mean - deviations * standard_deviation, mean + deviations * standard_deviation)
            }
            _ => self.limits().unwrap_or_else(|| {
                let [low, high] = [-deviations, deviations].map(normal::share_below);
                (self.value(low), self.value(high))
            }),
        };
        (a.min(b), a.max(b))
    }

    /// The law of a value times a factor that has this law; the value is not zero.
    pub fn times(&self, value: f64) -> Distribution {
        let ordered =
            |from: f64, to: f64| if value < 0.0 { (to * value, from * value) } else { (from * value, to * value) };
        match *self {
            D::Uniform { from, to } => D::Uniform { from: from * value, to: to * value },
            D::LogUniform { from, to } => D::LogUniform { from: from * value, to: to * value },
            D::Triangular { from, mode, to } => {
                let (from, to) = ordered(from, to);
                D::Triangular { from, mode: mode * value, to }
            }
            D::Normal { mean, standard_deviation } => {
                D::Normal { mean: mean * value, standard_deviation: standard_deviation * value.abs() }
            }
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                let (from, to) = ordered(from, to);
                let (mean, standard_deviation) = (mean * value, standard_deviation * value.abs());
                D::TruncatedNormal { mean, standard_deviation, from, to }
            }
            D::LogNormal { mean, standard_deviation } => {
                D::LogNormal { mean: mean * value, standard_deviation: standard_deviation * value.abs() }
            }
            D::Values(ref values) => D::Values(values.iter().map(|listed| listed * value).collect()),
        }
    }

    /// Share of the normal law that lies between the ends of a truncated one; 1 for every other law.
    pub fn kept_share(&self) -> f64 {
        match *self {
            D::TruncatedNormal { mean, standard_deviation, from, to } => {
                Cut::new(mean, standard_deviation, from, to).share()
            }
            _ => 1.0,
        }
    }

    /// Mean and standard deviation of the logarithm of the size of the values; `None` for all but a lognormal law.
    pub fn of_logarithm(&self) -> Option<(f64, f64)> {
        match *self {
            D::LogNormal { mean, standard_deviation } => Some(logarithm(mean, standard_deviation)),
            _ => None,
        }
    }

    /// Point `at` of a grid of so many: exact at both ends, symmetric about the middle; in the order of listed values.
    pub(super) fn grid_value(&self, at: u64, points: u64) -> f64 {
        let last = (points.max(2) - 1) as f64;
        match *self {
            D::Uniform { from, to } => (from * (last - at as f64) + to * at as f64) / last,
            D::LogUniform { from, .. } if at == 0 => from,
            D::LogUniform { to, .. } if at as f64 == last => to,
            D::LogUniform { from, to } => {
                let logarithm = from.abs().ln() * (last - at as f64) + to.abs().ln() * at as f64;
                from.signum() * (logarithm / last).exp()
            }
            D::Values(ref values) => values[at as usize],
            _ => self.value((at as f64 + 0.5) / points as f64),
        }
    }
}

/// Whether closed moments of a law that is uniform in the logarithm lose their digits.
fn is_narrow(from: f64, to: f64) -> bool {
    (to / from - 1.0).abs() < NARROW
}

/// Mean and standard deviation of the logarithm of a lognormal variable.
fn logarithm(mean: f64, standard_deviation: f64) -> (f64, f64) {
    let variance = (standard_deviation / mean).powi(2).ln_1p();
    (mean.abs().ln() - 0.5 * variance, variance.sqrt())
}

/// A normal law between two ends, turned over where its weight lies in the upper tail, for shares keep their digits in
/// the lower one.
struct Cut {
    mean: f64,
    /// Below zero where the law is turned over.
    scale: f64,
    /// Ends and the shares below them, of the standard law.
    ends: [f64; 2],
    shares: [f64; 2],
}

impl Cut {
    fn new(mean: f64, standard_deviation: f64, from: f64, to: f64) -> Cut {
        let [a, b] = [from, to].map(|end| (end - mean) / standard_deviation);
        let (scale, ends) = if a + b > 0.0 { (-standard_deviation, [-b, -a]) } else { (standard_deviation, [a, b]) };
        Cut { mean, scale, ends, shares: ends.map(normal::share_below) }
    }

    /// Share of the normal law that lies between the ends.
    fn share(&self) -> f64 {
        self.shares[1] - self.shares[0]
    }

    fn turned(&self, unit: f64) -> f64 {
        if self.scale < 0.0 { 1.0 - unit } else { unit }
    }

    fn value(&self, unit: f64) -> f64 {
        let share = self.shares[0] + self.turned(unit) * self.share();
        self.mean + self.scale * normal::quantile(share)
    }

    fn unit(&self, value: f64) -> f64 {
        let share = normal::share_below((value - self.mean) / self.scale) - self.shares[0];
        self.turned(share / self.share())
    }

    /// Mean and standard deviation.
    fn moments(&self) -> [f64; 2] {
        let [a, b] = self.ends;
        if b - a < NARROW {
            return [self.mean + self.scale * 0.5 * (a + b), self.scale.abs() * (b - a) / 12f64.sqrt()];
        }
        let [at_a, at_b] = self.ends.map(normal::density);
        let (mean, square) = ((at_a - at_b) / self.share(), 1.0 + (a * at_a - b * at_b) / self.share());
        [self.mean + self.scale * mean, self.scale.abs() * (square - mean * mean).sqrt()]
    }
}
