//! Horizontal bars with intervals, several for each name, and a cap beyond which none should lie.

use super::canvas::{Align, Canvas, NORMAL, Rect, SMALL, Stroke, TITLE, Text};
use super::colour::Colour;
use super::legend::{self, Entry};
use super::{Panel, ReportError, ticks};

/// Height of one bar, and of the gap between names (pt).
const BAR: f64 = 5.0;
const GAP: f64 = 5.0;
/// Room for the title above the legend, and for ticks and label below (pt).
const TITLE_ROOM: f64 = 17.0;
const BELOW: f64 = 32.0;
/// The legend begins so far from the left (pt).
const INDENT: f64 = 42.0;
/// Half the height of a whisker's end and of a cap (pt).
const END: f64 = 1.6;

/// A number with its interval; NaN for what is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Length of the bar.
    pub value: f64,
    /// Where the interval begins.
    pub low: f64,
    /// Where it ends.
    pub high: f64,
}

/// Bars from zero, those of a name one below another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IntervalBars {
    /// Above the panel; empty for none.
    pub title: String,
    /// What the bars show, under them.
    pub label: String,
    /// Words of the legend, one for each bar of a name.
    pub kinds: Vec<String>,
    /// Words of the legend for caps; empty for none.
    pub cap: String,
    /// Names from the top, their bars, and the cap or NaN.
    pub rows: Vec<(String, Vec<Interval>, f64)>,
}

impl IntervalBars {
    /// Height of title and legend at a width.
    fn above(&self, width: f64) -> f64 {
        TITLE_ROOM + legend::flow(None, &self.entries(), [0.0; 2], width - INDENT - 10.0) + 5.0
    }

    fn step(&self) -> f64 {
        BAR * self.kinds.len().max(1) as f64 + GAP
    }

    /// From the least to the largest number that is drawn, zero included.
    fn range(&self) -> Option<(f64, f64)> {
        let bars = self.rows.iter().flat_map(|(_, bars, cap)| {
            bars.iter().flat_map(|bar| [bar.value, bar.low, bar.high]).chain(std::iter::once(*cap))
        });
        let known: Vec<f64> = bars.filter(|x| x.is_finite()).collect();
        let low = known.iter().copied().fold(0.0, f64::min);
        let high = known.iter().copied().fold(0.0, f64::max);
        (high > low).then_some((low, high + 0.03 * (high - low)))
    }

    fn entries(&self) -> Vec<Entry> {
        let bars = self.kinds.iter().enumerate().map(|(k, name)| {
            let colour = Colour::SERIES[k % Colour::SERIES.len()];
            Entry::new(name, move |canvas, rect| canvas.rect(rect.inset(1.0), Some(colour), None))
        });
        let cap = (!self.cap.is_empty()).then(|| {
            Entry::new(&self.cap, |canvas, rect| {
                let [x, y] = rect.centre();
                canvas.line([[x, y - 4.0], [x, y + 4.0]], Stroke::new(Colour::INK, 1.2));
            })
        });
        bars.chain(cap).collect()
    }
}

impl Panel for IntervalBars {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        let Some((low, high)) = self.range() else {
            return Err(ReportError::Empty { figure: "the bars", reason: "no number other than zero".into() });
        };
        let width = |text: &str| Text::new(text, [0.0; 2], SMALL).width();
        let names = self.rows.iter().map(|(name, ..)| width(name)).fold(0.0, f64::max);
        let left = rect.left + (14.0 + names).max(INDENT);
        let frame = Rect {
            left,
            top: rect.top + self.above(rect.width),
            width: rect.right() - 10.0 - left,
            height: self.step() * self.rows.len() as f64,
        };
        let place = |x: f64| frame.left + frame.width * (x - low) / (high - low);
        canvas.text(Text::new(&self.title, [rect.left + INDENT, rect.top + 9.0], TITLE).bold());
        let at = [rect.left + INDENT, rect.top + TITLE_ROOM];
        legend::flow(Some(canvas), &self.entries(), at, rect.width - INDENT - 10.0);
        let marks = ticks::linear(low, high, frame.width / 30.0);
        for (value, label) in marks.values.into_iter().zip(marks.labels) {
            let x = place(value);
            canvas.line([[x, frame.top], [x, frame.bottom()]], Stroke::new(Colour::GRID, 0.5));
            canvas.text(Text::new(label, [x, frame.bottom() + 9.0], SMALL).align(Align::Middle));
        }
        for (index, (name, bars, cap)) in self.rows.iter().enumerate() {
            let top = frame.top + self.step() * index as f64 + 0.5 * GAP;
            let middle = top + 0.5 * BAR * self.kinds.len() as f64;
            canvas.text(Text::new(name, [frame.left - 5.0, middle], SMALL).align(Align::End));
            for (k, bar) in bars.iter().enumerate() {
                draw_bar(canvas, *bar, top + BAR * k as f64, Colour::SERIES[k % Colour::SERIES.len()], &place);
            }
            if cap.is_finite() {
                let x = place(*cap);
                let ends = [[x, top - END], [x, top + BAR * self.kinds.len() as f64 + END]];
                canvas.line(ends, Stroke::new(Colour::INK, 1.2));
            }
        }
        let zero = place(0.0);
        canvas.line([[zero, frame.top], [zero, frame.bottom()]], Stroke::new(Colour::MUTED, 0.6));
        let at = [frame.centre()[0], frame.bottom() + 21.0];
        canvas.text(Text::new(&self.label, at, NORMAL).align(Align::Middle));
        Ok(())
    }

    fn height(&self, width: f64) -> f64 {
        self.above(width) + self.step() * self.rows.len() as f64 + BELOW
    }
}

fn draw_bar(canvas: &mut Canvas, bar: Interval, top: f64, colour: Colour, place: &dyn Fn(f64) -> f64) {
    let Interval { value, low, high } = bar;
    if value.is_finite() {
        let (from, to) = (place(value.min(0.0)), place(value.max(0.0)));
        canvas.rect(Rect { left: from, top: top + 0.3, width: to - from, height: BAR - 0.6 }, Some(colour), None);
    }
    if low.is_finite() && high.is_finite() {
        let (y, stroke) = (top + 0.5 * BAR, Stroke::new(Colour::INK, 0.6));
        canvas.line([[place(low), y], [place(high), y]], stroke);
        for x in [place(low), place(high)] {
            canvas.line([[x, y - END], [x, y + END]], stroke);
        }
    }
}
