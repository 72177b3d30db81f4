//! Normal and Student's distribution, to round-off.

use crate::spec::Distribution;
use std::f64::consts::PI;

const STANDARD: Distribution = Distribution::Normal { mean: 0.0, standard_deviation: 1.0 };

/// The number that a standard normal variable exceeds in size with a chance of 1 - `confidence`.
pub(super) fn normal_two_sided(confidence: f64) -> f64 {
    STANDARD.value(0.5 * (1.0 + confidence))
}

/// The same for Student's variable.
pub(super) fn student_two_sided(confidence: f64, freedom: usize) -> f64 {
    let n = freedom as f64;
    match freedom {
        0 => f64::INFINITY,
        _ => bisect(confidence, |t| 1.0 - incomplete_beta(0.5 * n, 0.5, n / (n + t * t))),
    }
}

/// Where a function that rises from 0 to 1 over the positive numbers has this value.
fn bisect(value: f64, of: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while of(high) < value && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if of(middle) < value { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Regularised incomplete beta function (Abramowitz and Stegun 26.5.8, by Lentz's method).
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = a * x.ln() + b * (1.0 - x).ln() + log_gamma(a + b) - log_gamma(a) - log_gamma(b);
    let (mut c, mut d) = (1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..500 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for step in [even, odd] {
            (d, c) = (1.0 / (1.0 + step * d), 1.0 + step / c);
            fraction *= c * d;
            change = c * d;
        }
        if (change - 1.0).abs() < 1e-16 {
            break;
        }
    }
    front.exp() * fraction / a
}

/// Logarithm of the gamma function for x > 0: Stirling's series beyond 15, the recurrence below.
fn log_gamma(x: f64) -> f64 {
    if x < 15.0 {
        return log_gamma(x + 1.0) - x.ln();
    }
    let y = 1.0 / (x * x);
    let series = (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_met() {
        for (z, share) in [(-6.0, 9.865_876_450_376_98e-10), (-1.0, 0.158_655_253_931_457_05), (0.0, 0.5)] {
            assert!((STANDARD.unit(z) / share - 1.0).abs() < 1e-12, "{z}: {}", STANDARD.unit(z));
        }
        assert!((normal_two_sided(0.95) - 1.959_963_984_540_054).abs() < 1e-12);
        for (freedom, t) in [
            (1, 12.706_204_736_174_7),
            (2, 4.302_652_729_911_28),
            (7, 2.364_624_251_592_78),
            (15, 2.131_449_545_559_32),
        ] {
            let found = student_two_sided(0.95, freedom);
            assert!((found - t).abs() < 1e-9, "{freedom}: {found}");
        }
    }
}
