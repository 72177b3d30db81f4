//! Shares of samples that failed, and how sure they are.

use super::quantiles::normal_two_sided;

/// Wilson's interval of a share: `count` of `total`, at a confidence.
pub fn wilson(count: u64, total: u64, confidence: f64) -> [f64; 2] {
    if total == 0 {
        return [0.0, 1.0];
    }
    let (n, z2) = (total as f64, normal_two_sided(confidence).powi(2));
    let share = count as f64 / n;
    let middle = share + 0.5 * z2 / n;
    let half = (z2 * (share * (1.0 - share) / n + 0.25 * z2 / (n * n))).sqrt();
    let end = |x: f64| (x / (1.0 + z2 / n)).clamp(0.0, 1.0);
    // At the ends the formula gives exactly 0 or 1, but for round-off.
    let low = if count == 0 { 0.0 } else { end(middle - half) };
    let high = if count == total { 1.0 } else { end(middle + half) };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_intervals_are_the_known_ones() {
        let [low, high] = wilson(0, 10, 0.95);
        assert!(low == 0.0 && (high - 0.277_532_8).abs() < 1e-6, "{low} {high}");
        let [low, high] = wilson(5, 10, 0.95);
        assert!((low - 0.236_593_1).abs() < 1e-6 && (high - 0.763_406_9).abs() < 1e-6, "{low} {high}");
        assert_eq!(wilson(7, 7, 0.95)[1], 1.0);
    }
}
