//! Bars: how often a value lies in a range, and how many samples ended in which status.

use super::axes::{Axes, Axis, AxisLabel};
use super::canvas::{Align, Canvas, Point, Rect, SMALL, Shape, Stroke, TITLE, Text};
use super::colour::Colour;
use super::text_table::count;
use super::{Panel, ReportError};
use crate::model::Status;

const HISTOGRAM: &str = "the histogram";

/// How values are distributed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// Above the panel; empty for none.
    pub title: String,
    /// Linear or logarithmic.
    pub x: AxisLabel,
    /// What is not finite, or not positive on a logarithmic axis, is left out and counted.
    pub values: Vec<f64>,
    /// Chosen from the number of values unless given.
    pub bins: Option<usize>,
}

impl Panel for Histogram {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        let Some(x) = Axis::spanning(&self.x, self.values.iter().copied()) else {
            let reason = format!("none of {} values of `{}` can be shown", self.values.len(), self.x.label);
            return Err(ReportError::Empty { figure: HISTOGRAM, reason });
        };
        let shares: Vec<f64> = self.values.iter().map(|value| x.share(*value)).filter(|x| x.is_finite()).collect();
        let skipped = self.values.len() - shares.len();
        let (first, last) = shares.iter().fold((1.0f64, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
        let width = last - first;
        let bins = self.bins.unwrap_or((2.0 * (shares.len() as f64).cbrt()).clamp(1.0, 60.0) as usize).max(1);
        let (bins, first, width) = if width > 0.0 { (bins, first, width) } else { (1, first - 0.05, 0.1) };
        let mut counts = vec![0u64; bins];
        for share in &shares {
            counts[((share - first) / width * bins as f64).clamp(0.0, bins as f64 - 1.0) as usize] += 1;
        }
        let most = counts.iter().copied().max().unwrap_or(1) as f64;
        let y = Axis::exactly(&AxisLabel::linear("samples", ""), 0.0, 1.06 * most);
        let axes = Axes::within(rect, x, y, &self.title);
        axes.draw(canvas, &self.title);
        for (bin, n) in counts.into_iter().enumerate() {
            let left = axes.rect.left + axes.rect.width * (first + width * bin as f64 / bins as f64);
            let height = axes.rect.height * axes.y.share(n as f64);
            let width = axes.rect.width * width / bins as f64;
            let bar = Rect { left, top: axes.rect.bottom() - height, width, height };
            if n > 0 {
                canvas.rect(bar, Some(Colour::BLUE.mix(Colour::WHITE, 0.25)), Some(Stroke::new(Colour::WHITE, 0.4)));
            }
        }
        canvas.rect(axes.rect, None, Some(Stroke::new(Colour::MUTED, 0.6)));
        if skipped > 0 {
            let note = format!("{} left out", count(skipped as u64));
            let at = [axes.rect.right(), axes.rect.top - if self.title.is_empty() { -8.0 } else { 9.0 }];
            canvas.text(Text::new(note, at, SMALL).align(Align::End).colour(Colour::MUTED).halo());
        }
        Ok(())
    }
}

/// Samples by status: one bar each, with count and share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// Above the panel; empty for none.
    pub title: String,
    /// Statuses in the order in which they are drawn; those without samples are left out.
    pub counts: Vec<(Status, u64)>,
}

impl Panel for Counts {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        let bars: Vec<(Status, u64)> = self.counts.iter().copied().filter(|(_, n)| *n > 0).collect();
        let total: u64 = bars.iter().map(|(_, n)| n).sum();
        if total == 0 {
            return Err(ReportError::Empty { figure: "the counts by status", reason: "no samples".into() });
        }
        let most = bars.iter().map(|(_, n)| *n).max().unwrap_or(1);
        let words = |n: u64| format!("{}  ({})", count(n), percentage(n, total));
        let width = |text: &str| Text::new(text, [0.0; 2], SMALL).width();
        let names = bars.iter().map(|(status, _)| width(status.name())).fold(0.0, f64::max);
        let numbers = bars.iter().map(|(_, n)| width(&words(*n))).fold(0.0, f64::max);
        let top = rect.top + if self.title.is_empty() { 4.0 } else { 20.0 };
        let left = rect.left + (16.0 + names).max(42.0);
        let longest = rect.right() - 14.0 - numbers - left;
        canvas.text(Text::new(&self.title, [left, rect.top + 9.0], TITLE).bold());
        let step = ((rect.bottom() - 6.0 - top) / bars.len() as f64).min(20.0);
        for (index, (status, n)) in bars.iter().enumerate() {
            let y = top + step * (index as f64 + 0.5);
            // A rare status stays visible.
            let width = (longest * *n as f64 / most as f64).max(0.8);
            let bar = Rect { left, top: y - 0.34 * step, width, height: 0.68 * step };
            canvas.rect(bar, Some(status_colour(*status)), None);
            canvas.text(Text::new(status.name(), [left - 5.0, y], SMALL).align(Align::End));
            canvas.text(Text::new(words(*n), [left + width + 4.0, y], SMALL));
        }
        let axis: [Point; 2] = [[left, top], [left, top + step * bars.len() as f64]];
        canvas.shapes.push(Shape::Path {
            points: axis.to_vec(),
            closed: false,
            fill: None,
            stroke: Some(Stroke::new(Colour::MUTED, 0.6)),
            clip: None,
        });
        Ok(())
    }

    fn height(&self, width: f64) -> f64 {
        (0.74 * width).min(34.0 + 20.0 * self.counts.iter().filter(|(_, n)| *n > 0).count() as f64)
    }
}

fn percentage(n: u64, total: u64) -> String {
    let share = 100.0 * n as f64 / total as f64;
    match share {
        100.0 => "100 %".into(),
        share if share >= 99.95 => "> 99.9 %".into(),
        share if share < 0.05 => "< 0.1 %".into(),
        share => format!("{share:.1} %"),
    }
}

/// Blues and greens are usable, warm colours and greys are not.
pub(super) fn status_colour(status: Status) -> Colour {
    match status {
        Status::Ok => Colour::BLUE,
        Status::Refined => Colour::SKY,
        Status::Ramped => Colour::GREEN,
        Status::Fold => Colour::VERMILION,
        Status::Unstable => Colour::ORANGE,
        Status::StepLimit => Colour::PURPLE,
        Status::NotConverged => Colour::hex(0x7b1e3a),
        Status::BadParameter => Colour::hex(0xb8a500),
        Status::NonFinite => Colour::BLACK,
        Status::Pending => Colour::GREY,
        Status::TooNearMagnet => Colour::hex(0x6b4f3a),
        Status::OutsideMap => Colour::hex(0xa08060),
        Status::Doubtful => Colour::hex(0xb04a8f),
        Status::ThroughWall => Colour::hex(0x8a7f70),
        Status::OutOfReach => Colour::hex(0xc9c2b8),
    }
}
