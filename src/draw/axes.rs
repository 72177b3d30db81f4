//! A panel with two axes, linear or logarithmic: frame, grid, ticks and labels.

use super::canvas::{Align, Canvas, NORMAL, Point, Rect, SMALL, Stroke, TITLE, Text};
use super::colour::Colour;
use super::ticks::{self, Ticks};

/// Least distance between ticks of a vertical axis (pt).
const TICK_HEIGHT: f64 = 18.0;

/// How numbers are spread along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally long.
    #[default]
    Linear,
    /// Equal ratios are equally long; numbers that are not positive are not shown.
    Logarithmic,
}

/// What an axis shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisLabel {
    /// The quantity, in words.
    pub label: String,
    /// Its unit; empty for none. Numbers are drawn as given: convert them first.
    pub unit: String,
    /// Linear or logarithmic.
    pub scale: Scale,
}

impl AxisLabel {
    /// A quantity on a linear axis.
    pub fn linear(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), scale: Scale::Linear }
    }

    /// A quantity on a logarithmic axis.
    pub fn logarithmic(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { scale: Scale::Logarithmic, ..Self::linear(label, unit) }
    }
}

/// An axis and the range that it spans.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    pub label: AxisLabel,
    pub low: f64,
    pub high: f64,
    /// The power of ten taken out of the numbers.
    power: i32,
}

impl Axis {
    /// Spans the values with a small rim; values that the scale cannot show do not count. None without any value.
    pub(super) fn spanning(label: &AxisLabel, values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let logarithmic = label.scale == Scale::Logarithmic;
        let shown = |x: &f64| x.is_finite() && (!logarithmic || *x > 0.0);
        let (low, high) = values
            .into_iter()
            .filter(shown)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        if low > high {
            return None;
        }
        let (low, high) = if logarithmic {
            let rim = (0.05 * (high / low).log10()).max(if high / low < 1.001 { 0.3 } else { 0.02 });
            (low / 10f64.powf(rim), high * 10f64.powf(rim))
        } else {
            let largest = low.abs().max(high.abs());
            let narrow = high - low <= 1e-9 * largest;
            let rim = if !narrow {
                0.05 * (high - low)
            } else if largest > 0.0 {
                0.1 * largest
            } else {
                1.0
            };
            (low - rim, high + rim)
        };
        Some(Self::exactly(label, low, high))
    }

    pub(super) fn exactly(label: &AxisLabel, low: f64, high: f64) -> Self {
        let power = if label.scale == Scale::Linear { ticks::common_power(low, high) } else { 0 };
        Self { label: label.clone(), low, high, power }
    }

    /// Place of a value along the axis, 0 to 1; NaN for what the scale cannot show.
    pub(super) fn share(&self, value: f64) -> f64 {
        match self.label.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic if value > 0.0 => (value / self.low).log10() / (self.high / self.low).log10(),
            Scale::Logarithmic => f64::NAN,
        }
    }

    fn ticks(&self, count: f64) -> Ticks {
        match self.label.scale {
            Scale::Logarithmic => ticks::logarithmic(self.low, self.high, count),
            Scale::Linear => {
                let factor = 10f64.powi(self.power);
                let mut ticks = ticks::linear(self.low / factor, self.high / factor, count);
                ticks.values.iter_mut().for_each(|value| *value *= factor);
                ticks
            }
        }
    }

    /// Unlabelled marks between the decades of a logarithmic axis.
    fn minor(&self) -> Vec<f64> {
        let decades = (self.high / self.low).log10();
        if self.label.scale == Scale::Linear || !(0.0..=9.0).contains(&decades) {
            return Vec::new();
        }
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        (first..last)
            .flat_map(|power| (2..10).map(move |lead| f64::from(lead) * 10f64.powi(power)))
            .filter(|x| (self.low..=self.high).contains(x))
            .collect()
    }

    fn title(&self) -> String {
        ticks::with_unit(&self.label.label, &self.label.unit, self.power)
    }
}

/// A frame on the page with its two axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axes {
    pub rect: Rect,
    pub x: Axis,
    pub y: Axis,
}

impl Axes {
    /// Fits the frame with its labels and a title into a panel.
    pub(super) fn within(panel: Rect, x: Axis, y: Axis, title: &str) -> Self {
        let top = if title.is_empty() { 6.0 } else { 18.0 };
        let (right, bottom) = (10.0, 32.0);
        let height = panel.height - top - bottom;
        let labels = y.ticks(height / TICK_HEIGHT).labels.into_iter();
        let widest = labels.map(|label| Text::new(label, [0.0; 2], SMALL).width()).fold(0.0, f64::max);
        let left = (widest + 21.0).max(42.0);
        let width = panel.width - left - right;
        Self { rect: Rect { left: panel.left + left, top: panel.top + top, width, height }, x, y }
    }

    /// Widens one axis until a unit is as long on both.
    pub(super) fn equalise(&mut self) {
        let extents = [self.rect.width, self.rect.height];
        let [x, y] = [&mut self.x, &mut self.y];
        let unit = ((x.high - x.low) / extents[0]).max((y.high - y.low) / extents[1]);
        for (axis, extent) in [x, y].into_iter().zip(extents) {
            let middle = 0.5 * (axis.low + axis.high);
            *axis = Axis::exactly(&axis.label, middle - 0.5 * unit * extent, middle + 0.5 * unit * extent);
        }
    }

    /// NaN for what a logarithmic axis cannot show.
    pub(super) fn place(&self, [x, y]: [f64; 2]) -> Point {
        [self.rect.left + self.rect.width * self.x.share(x), self.rect.bottom() - self.rect.height * self.y.share(y)]
    }

    /// Frame, grid and labels, to lie under the data.
    pub(super) fn draw(&self, canvas: &mut Canvas, title: &str) {
        let marks = [self.x.ticks(self.rect.width / 30.0), self.y.ticks(self.rect.height / TICK_HEIGHT)];
        self.draw_marks(canvas, marks, [true; 2]);
        canvas.text(Text::new(title, [self.rect.left, self.rect.top - 9.0], TITLE).bold());
    }

    /// As [`draw`](Axes::draw) without a title, with marks at multiples of a step on each axis, which is labelled or not.
    pub(super) fn draw_multiples(&self, canvas: &mut Canvas, [x, y]: [f64; 2], labelled: [bool; 2]) {
        let marks = [(&self.x, x), (&self.y, y)].map(|(axis, step)| ticks::multiples(axis.low, axis.high, step));
        self.draw_marks(canvas, marks, labelled);
    }

    fn draw_marks(&self, canvas: &mut Canvas, [x_marks, y_marks]: [Ticks; 2], labelled: [bool; 2]) {
        let rect = self.rect;
        let frame = Stroke::new(Colour::MUTED, 0.6);
        let grid = Stroke::new(Colour::GRID, 0.5);
        for (value, label) in x_marks.values.into_iter().zip(x_marks.labels) {
            let x = rect.left + rect.width * self.x.share(value);
            canvas.line([[x, rect.top], [x, rect.bottom()]], grid);
            canvas.line([[x, rect.bottom()], [x, rect.bottom() + 3.0]], frame);
            canvas.text(Text::new(label, [x, rect.bottom() + 9.0], SMALL).align(Align::Middle));
        }
        let mut widest = 0.0f64;
        for (value, label) in y_marks.values.into_iter().zip(y_marks.labels) {
            let y = rect.bottom() - rect.height * self.y.share(value);
            canvas.line([[rect.left, y], [rect.right(), y]], grid);
            canvas.line([[rect.left - 3.0, y], [rect.left, y]], frame);
            let text = Text::new(label, [rect.left - 5.0, y], SMALL).align(Align::End);
            widest = widest.max(text.width());
            canvas.text(text);
        }
        for value in self.x.minor() {
            let x = rect.left + rect.width * self.x.share(value);
            canvas.line([[x, rect.bottom()], [x, rect.bottom() + 1.5]], frame);
        }
        for value in self.y.minor() {
            let y = rect.bottom() - rect.height * self.y.share(value);
            canvas.line([[rect.left - 1.5, y], [rect.left, y]], frame);
        }
        canvas.rect(rect, None, Some(frame));
        let [x, y] = rect.centre();
        if labelled[0] {
            canvas.text(Text::new(self.x.title(), [x, rect.bottom() + 21.0], NORMAL).align(Align::Middle));
        }
        if labelled[1] {
            let at = [rect.left - widest - 13.0, y];
            canvas.text(Text::new(self.y.title(), at, NORMAL).align(Align::Middle).angle(90.0));
        }
    }
}
