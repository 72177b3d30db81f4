//! Round numbers for axes, and the words for them.

/// Values to mark on an axis and their labels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    pub values: Vec<f64>,
    pub labels: Vec<String>,
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `x`.
pub(super) fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let lead = x / power;
    power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| lead <= step * (1.0 + 1e-9)).unwrap_or(10.0)
}

/// Multiples of `step` from `low` to `high`.
pub(super) fn multiples(low: f64, high: f64, step: f64) -> Ticks {
    let slack = 1e-9 * (high - low).abs();
    let first = ((low - slack) / step).ceil() as i64;
    let last = ((high + slack) / step).floor() as i64;
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    let values: Vec<f64> = (first..=last).map(|k| k as f64 * step).collect();
    let labels = values.iter().map(|&x| fixed(x, decimals)).collect();
    Ticks { values, labels }
}

/// At most about `count` round values from `low` to `high`.
pub(super) fn linear(low: f64, high: f64, count: f64) -> Ticks {
    multiples(low, high, round_up((high - low) / count.max(1.0)))
}

/// Powers of ten from `low` to `high`, thinned to about `count`; with 2 and 5 times them over short ranges.
pub(super) fn logarithmic(low: f64, high: f64, count: f64) -> Ticks {
    let (first, last) = ((low.log10() - 1e-9).ceil() as i32, (high.log10() + 1e-9).floor() as i32);
    let decades = high.log10() - low.log10();
    if decades < 1.7 || last <= first {
        // Labels with a power of ten are wide.
        let few = if (0.01..1e4).contains(&low) { 0.9 } else { 0.35 };
        let leads: &[f64] = if decades < few { &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0] } else { &[1.0, 2.0, 5.0] };
        let values: Vec<f64> = (first - 1..=last + 1)
            .flat_map(|power| leads.iter().map(move |lead| lead * 10f64.powi(power)))
            .filter(|x| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(x))
            .collect();
        let labels = values.iter().map(|&x| compact(x)).collect();
        return Ticks { values, labels };
    }
    let stride = (f64::from(last - first + 1) / count.max(1.0)).ceil().max(1.0) as i32;
    let powers = (first..=last).filter(|power| power % stride == 0);
    let values = powers.clone().map(|power| 10f64.powi(power)).collect();
    let short = first >= -2 && last <= 3;
    let labels = powers.map(|power| if short { compact(10f64.powi(power)) } else { power_of_ten(power) }).collect();
    Ticks { values, labels }
}

/// A number with fixed decimals and a true minus sign.
pub(super) fn fixed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    if text.chars().all(|c| matches!(c, '-' | '0' | '.')) { text.replace('-', "") } else { text.replace('-', "−") }
}

/// A power of ten with a raised exponent.
pub(super) fn power_of_ten(power: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit.to_digit(10).unwrap_or(0) as usize],
    };
    format!("10{}", power.to_string().chars().map(raised).collect::<String>())
}

/// A number with three significant digits, with a power of ten when it is very large or small.
pub(super) fn compact(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return if x == 0.0 { "0".into() } else { x.to_string() };
    }
    let power = x.abs().log10().floor() as i32;
    if (-2..5).contains(&power) {
        let text = fixed(x, (2 - power).max(0) as usize);
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
    } else {
        let lead = fixed(x / 10f64.powi(power), 2);
        let lead = lead.trim_end_matches('0').trim_end_matches('.');
        if lead == "1" { power_of_ten(power) } else { format!("{lead} × {}", power_of_ten(power)) }
    }
}

/// The power of ten, a multiple of three, to take out of an axis' numbers: 0 when they read well as they are.
pub(super) fn common_power(low: f64, high: f64) -> i32 {
    let largest = low.abs().max(high.abs());
    if largest == 0.0 || (0.01..1e4).contains(&largest) { 0 } else { 3 * (largest.log10() / 3.0).floor() as i32 }
}

/// A label with its unit, and the power of ten that was taken out of the numbers.
pub(super) fn with_unit(label: &str, unit: &str, power: i32) -> String {
    match (unit.is_empty(), power) {
        (true, 0) => label.into(),
        (true, _) => format!("{label} ({})", power_of_ten(power)),
        (false, 0) => format!("{label} ({unit})"),
        (false, _) => format!("{label} ({} {unit})", power_of_ten(power)),
    }
}

/// A unit of length in which coordinates read well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthUnit {
    /// Such as `mm`.
    pub name: &'static str,
    /// In m
    pub metres: f64,
}

impl LengthUnit {
    /// For coordinates up to `extent` (m).
    pub fn for_extent(extent: f64) -> Self {
        match extent {
            x if x < 2e-6 => Self { name: "nm", metres: 1e-9 },
            x if x < 2e-3 => Self { name: "µm", metres: 1e-6 },
            x if x < 2.0 => Self { name: "mm", metres: 1e-3 },
            _ => Self { name: "m", metres: 1.0 },
        }
    }
}
