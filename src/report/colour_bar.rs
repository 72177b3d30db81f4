//! Numbers to colours: a range that outliers do not spoil, and its scale beside the figure.

use super::canvas::{Align, Canvas, NORMAL, Rect, SMALL, Shape, Stroke, Text};
use super::colour::{Colour, ColourMap};
use super::ticks;

/// Percentiles that the colours span.
const LOW: f64 = 0.01;
const HIGH: f64 = 0.99;
const BAR: f64 = 9.0;

/// Range of a quantity's colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColourRange {
    pub map: ColourMap,
    pub low: f64,
    pub high: f64,
    /// Whether values lie below or above the range.
    pub clipped: [bool; 2],
}

impl ColourRange {
    /// Range of finite values, of which there is at least one; signed values get a diverging map around zero.
    pub(super) fn new(values: impl IntoIterator<Item = f64>, map: Option<ColourMap>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
        let percentile = |share: f64| sorted[(share * (sorted.len() - 1) as f64).round() as usize];
        let (mut low, mut high) = (percentile(LOW), percentile(HIGH));
        // Short tails are shown whole: an arrow is for outliers.
        let width = high - low;
        if low - first <= 0.05 * width {
            low = first;
        }
        if last - high <= 0.05 * width {
            high = last;
        }
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
        Self { map, low, high, clipped: [first < low, last > high] }
    }

    pub(super) fn colour(&self, value: f64) -> Colour {
        self.map.at((value - self.low) / (self.high - self.low))
    }

    /// Draws the bar with ticks and its label to the right; `rect` gives its left edge, top and height.
    pub(super) fn draw(&self, canvas: &mut Canvas, rect: Rect, label: &str, unit: &str) {
        let bar = Rect { width: BAR, ..rect };
        let pixels = (0..256).map(|row| self.map.at(1.0 - f64::from(row) / 255.0)).collect();
        canvas.shapes.push(Shape::Image { rect: bar, width: 1, height: 256, pixels, smooth: false });
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
        let power = ticks::common_power(self.low, self.high);
        let factor = 10f64.powi(power);
        let marks = ticks::linear(self.low / factor, self.high / factor, bar.height / 26.0);
        let mut widest = 0.0f64;
        for (value, label) in marks.values.into_iter().zip(marks.labels) {
            let y = bar.bottom() - bar.height * (value * factor - self.low) / (self.high - self.low);
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
