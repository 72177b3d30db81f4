//! Numbers to colours: a range that outliers do not spoil, and its scale beside the figure.

use super::canvas::{Align, Canvas, NORMAL, Rect, SMALL, Shape, Stroke, Text};
use super::colour::{Colour, ColourMap};
use super::ticks;

/// Percentiles that the colours span.
const LOW: f64 = 0.01;
const HIGH: f64 = 0.99;
const BAR: f64 = 9.0;

/// How numbers become colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ColourScale {
    /// By equal differences.
    #[default]
    Linear,
    /// By equal ratios; what is not positive has no colour.
    Logarithmic,
    /// Each whole number has a colour of its own.
    Whole,
}

/// Range of a quantity's colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourRange {
    /// From a share of the range to a colour.
    pub map: ColourMap,
    /// From a number to a share of the range.
    pub scale: ColourScale,
    /// Number of the first colour.
    pub low: f64,
    /// Number of the last colour.
    pub high: f64,
    /// Whether values lie below or above the range.
    pub clipped: [bool; 2],
}

impl ColourRange {
    /// Range of finite values, as [`Cloud`](super::Cloud) colours them; signed values get a diverging map around zero.
    /// `None` without values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values = values.into_iter().peekable();
        values.peek()?;
        Some(Self::new(values, None))
    }

    /// Range of finite values, of which there is at least one; signed values get a diverging map around zero.
    pub(super) fn new(values: impl IntoIterator<Item = f64>, map: Option<ColourMap>) -> Self {
        let ([mut low, mut high], [first, last]) = bulk(values);
        let signed = low < 0.0 && high > 0.0 && -low > 0.05 * high && high > -0.05 * low;
        let map = map.unwrap_or(if signed { ColourMap::Diverging } else { ColourMap::Sequential });
        if map == ColourMap::Diverging {
            high = high.abs().max(low.abs());
            low = -high;
        }
        if high - low <= 1e-12 * high.abs().max(low.abs()) {
            let half = if high == 0.0 { 1.0 } else { 0.05 * high.abs() };
            (low, high) = (low - half, high + half);
        }
        let clipped = [first < low, last > high];
        Self { map, scale: ColourScale::Linear, low, high, clipped }
    }

    /// Range of positive values, of which there is at least one, equal ratios apart.
    pub(super) fn logarithmic(values: impl IntoIterator<Item = f64>) -> Self {
        let ([low, high], [first, last]) = bulk(values.into_iter().map(f64::log10));
        let clipped = [first < low, last > high];
        let half = if high - low < 1e-9 { 0.15 } else { 0.0 };
        let [low, high] = [low - half, high + half].map(|power| 10f64.powf(power));
        Self { map: ColourMap::Sequential, scale: ColourScale::Logarithmic, low, high, clipped }
    }

    /// From one number to another, whatever the values are.
    pub(super) fn exactly(low: f64, high: f64) -> Self {
        Self { map: ColourMap::Sequential, scale: ColourScale::Linear, low, high, clipped: [false; 2] }
    }

    /// Whole numbers, of which there is at least one.
    pub(super) fn whole(values: impl IntoIterator<Item = f64>) -> Self {
        let (_, [first, last]) = bulk(values);
        let [low, high] = [first.round() - 0.5, last.round() + 0.5];
        let map = ColourMap::Sequential;
        Self { map, scale: ColourScale::Whole, low, high, clipped: [false; 2] }
    }

    fn share(&self, value: f64) -> f64 {
        match self.scale {
            ColourScale::Linear | ColourScale::Whole => (value - self.low) / (self.high - self.low),
            ColourScale::Logarithmic => (value / self.low).log10() / (self.high / self.low).log10(),
        }
    }

    /// The colour of a value; held at both ends.
    pub fn colour(&self, value: f64) -> Colour {
        match self.scale {
            ColourScale::Whole => self.map.at((value.round() - self.low - 0.5) / (self.high - self.low - 1.0).max(1.0)),
            ColourScale::Linear | ColourScale::Logarithmic => self.map.at(self.share(value)),
        }
    }

    /// The colour of a value; `None` for what the scale cannot show.
    pub(super) fn shown(&self, value: f64) -> Option<Colour> {
        let is_shown = value.is_finite() && (self.scale != ColourScale::Logarithmic || value > 0.0);
        is_shown.then(|| self.colour(value))
    }

    /// Draws the bar with ticks and its label to the right; `rect` gives its left edge, top and height.
    pub(super) fn draw(&self, canvas: &mut Canvas, rect: Rect, label: &str, unit: &str) {
        let bar = Rect { width: BAR, ..rect };
        let (count, pixels): (usize, Vec<Colour>) = if self.scale == ColourScale::Whole {
            let count = (self.high - self.low).clamp(1.0, 256.0) as usize;
            (count, (0..count).map(|row| self.colour(self.high - 0.5 - row as f64)).collect())
        } else {
            (256, (0..256).map(|row| self.map.at(1.0 - f64::from(row) / 255.0)).collect())
        };
        canvas.shapes.push(Shape::Image { rect: bar, width: 1, height: count, pixels });
        let frame = Stroke::new(Colour::MUTED, 0.6);
        canvas.rect(bar, None, Some(frame));
        let tip = 7.0;
        for (clipped, y, out, share) in
            [(self.clipped[0], bar.bottom(), tip, 0.0), (self.clipped[1], bar.top, -tip, 1.0)]
        {
            if clipped {
                let triangle = [[bar.left, y], [bar.right(), y], [bar.centre()[0], y + out]];
                canvas.polygon(triangle, Some(self.map.at(share)), Some(frame));
            }
        }
        let power = if self.scale == ColourScale::Linear { ticks::common_power(self.low, self.high) } else { 0 };
        let factor = 10f64.powi(power);
        let count = bar.height / 26.0;
        let marks = match self.scale {
            ColourScale::Linear => ticks::linear(self.low / factor, self.high / factor, count),
            ColourScale::Logarithmic => ticks::logarithmic(self.low, self.high, count),
            ColourScale::Whole => {
                ticks::multiples(self.low, self.high, ticks::round_up((self.high - self.low) / count).max(1.0))
            }
        };
        let mut widest = 0.0f64;
        for (value, label) in marks.values.into_iter().zip(marks.labels) {
            let y = bar.bottom() - bar.height * self.share(value * factor);
            canvas.line([[bar.right(), y], [bar.right() + 3.0, y]], frame);
            let text = Text::new(label, [bar.right() + 5.0, y], SMALL);
            widest = widest.max(text.width());
            canvas.text(text);
        }
        let at = [bar.right() + widest + 14.0, bar.centre()[1]];
        let label = ticks::with_unit(label, unit, power);
        canvas.text(Text::new(label, at, NORMAL).align(Align::Middle).angle(90.0));
    }
}

/// What most of the values span, and what all of them span.
fn bulk(values: impl IntoIterator<Item = f64>) -> ([f64; 2], [f64; 2]) {
    let mut values: Vec<f64> = values.into_iter().collect();
    let highest = values.len() - 1;
    let mut ranked = |rank: usize| *values.select_nth_unstable_by(rank, f64::total_cmp).1;
    let (first, last) = (ranked(0), ranked(highest));
    let mut percentile = |share: f64| ranked((share * highest as f64).round() as usize);
    let (mut low, mut high) = (percentile(LOW), percentile(HIGH));
    // Short tails are shown whole: an arrow is for outliers.
    let width = high - low;
    if low - first <= 0.05 * width {
        low = first;
    }
    if last - high <= 0.05 * width {
        high = last;
    }
    ([low, high], [first, last])
}
