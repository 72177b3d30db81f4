//! Mean, spread, skew and extremes of an output as it streams by; quantiles and lumps of what is kept of it.

/// Share of the rows that a lump has at least.
const LUMP: f64 = 0.05;
/// Between two lumps there are fewer rows than this share of what the lesser one has at its peak.
const VALLEY: f64 = 0.5;
const BINS: usize = 32;
/// Values that tell lumps from chance.
const ENOUGH: usize = 500;

/// Sums of powers about an offset, and extremes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    offset: f64,
    pub count: f64,
    powers: [f64; 3],
    pub least: f64,
    pub largest: f64,
}

/// Two groups of values with few between.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Lumps {
    /// Where the values are parted.
    pub at: f64,
    /// Share of the values above.
    pub share_above: f64,
}

impl Moments {
    pub fn new(offset: f64) -> Moments {
        Moments { offset, count: 0.0, powers: [0.0; 3], least: f64::INFINITY, largest: f64::NEG_INFINITY }
    }

    /// NaN does not count.
    pub fn add(&mut self, value: f64) {
        if value.is_nan() {
            return;
        }
        let y = value - self.offset;
        self.count += 1.0;
        let [one, two, three] = &mut self.powers;
        *one += y;
        *two += y * y;
        *three += y * y * y;
        self.least = self.least.min(value);
        self.largest = self.largest.max(value);
    }

    fn shift(&self) -> f64 {
        self.powers[0] / self.count
    }

    pub fn mean(&self) -> f64 {
        self.offset + self.shift()
    }

    /// 1/(n - 1)
    pub fn variance(&self) -> f64 {
        (self.powers[1] - self.count * self.shift().powi(2)).max(0.0) / (self.count - 1.0)
    }

    pub fn standard_deviation(&self) -> f64 {
        self.variance().sqrt()
    }

    pub fn skew(&self) -> f64 {
        let [_, two, three] = self.powers.map(|sum| sum / self.count);
        let d = self.shift();
        let (second, third) = (two - d * d, three - 3.0 * d * two + 2.0 * d * d * d);
        third / second.powf(1.5)
    }
}

/// A quantile of ascending values, between neighbours; NaN without values.
pub(super) fn quantile(ascending: &[f64], share: f64) -> f64 {
    let Some(last) = ascending.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let (low, part) = (place as usize, place.fract());
    let high = (low + 1).min(last);
    ascending[low] + part * (ascending[high] - ascending[low])
}

/// The finite values, ascending.
pub(super) fn ascending(values: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Two lumps, where the counts of even bins fall deeply between two peaks.
pub(super) fn lumps(ascending: &[f64]) -> Option<Lumps> {
    let [low, high] = [0.002, 0.998].map(|share| quantile(ascending, share));
    if ascending.len() < ENOUGH || low >= high {
        return None;
    }
    let width = (high - low) / BINS as f64;
    let mut counts = [0.0; BINS];
    for value in ascending.iter().filter(|value| (low..=high).contains(*value)) {
        counts[(((value - low) / width) as usize).min(BINS - 1)] += 1.0;
    }
    for _ in 0..2 {
        let of = |k: usize| counts[k.min(BINS - 1)];
        counts = std::array::from_fn(|k| 0.25 * of(k.saturating_sub(1)) + 0.5 * of(k) + 0.25 * of(k + 1));
    }
    let peak = |bins: &[f64]| bins.iter().copied().fold(0.0, f64::max);
    let depth = |k: &usize| counts[*k] / peak(&counts[..*k]).min(peak(&counts[k + 1..]));
    let valley = (1..BINS - 1).min_by(|i, j| depth(i).total_cmp(&depth(j)))?;
    let at = low + (valley as f64 + 0.5) * width;
    let above = ascending.len() - ascending.partition_point(|value| *value < at);
    let share_above = above as f64 / ascending.len() as f64;
    let is_lump = |share: f64| share >= LUMP;
    (depth(&valley) < VALLEY && is_lump(share_above) && is_lump(1.0 - share_above)).then_some(Lumps { at, share_above })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_values() {
        let mut moments = Moments::new(2.0);
        [1.0, 2.0, 4.0, f64::NAN, 9.0].into_iter().for_each(|x| moments.add(x));
        assert!((moments.mean() - 4.0).abs() < 1e-14 && (moments.variance() - 38.0 / 3.0).abs() < 1e-13);
        assert!((moments.skew() - 90.0 / 4.0 / 9.5f64.powf(1.5)).abs() < 1e-13, "{}", moments.skew());
        assert_eq!((moments.least, moments.largest), (1.0, 9.0));
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.75), 3.0);
    }

    #[test]
    fn two_lumps_are_told_from_one() {
        let unit = |k: usize| (k as f64 + 0.5) / 2000.0;
        let one = ascending(&(0..2000).map(|k| (unit(k) / (1.0 - unit(k))).ln()).collect::<Vec<_>>());
        assert_eq!(lumps(&one), None);
        assert_eq!(lumps(&ascending(&(0..2000).map(unit).collect::<Vec<_>>())), None);
        let two = ascending(
            &one.iter().enumerate().map(|(k, x)| x + if k % 10 < 3 { -20.0 } else { 20.0 }).collect::<Vec<_>>(),
        );
        let found = lumps(&two).expect("two lumps");
        assert!((found.share_above - 0.7).abs() < 0.01 && found.at.abs() < 12.0, "{found:?}");
    }
}
