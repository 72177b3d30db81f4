//! Where samples fail: a map over two swept axes.

use super::axes::{Axes, Axis, AxisLabel, Scale};
use super::bars::status_colour;
use super::canvas::{Canvas, Rect, Shape, TITLE, Text};
use super::colour::Colour;
use super::legend::{self, Entry};
use super::text_table::count;
use super::{Panel, ReportError};
use crate::model::Status;

const FIGURE: &str = "the failure map";
/// With more distinct values than this, samples are gathered in as many cells.
const MOST_CELLS: usize = 96;
const SUCCESS: Colour = Colour::hex(0xdfe9f2);

/// A swept parameter and its value in every sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweptAxis {
    /// The parameter, in words.
    pub label: String,
    /// Its unit; empty for none.
    pub unit: String,
    /// One for each sample, in `unit`.
    pub values: Vec<f64>,
}

/// Statuses over two axes. A cell shows its most frequent failure, fainter where only some of its samples failed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FailureMap {
    /// Above the panel; empty for none.
    pub title: String,
    /// To the right.
    pub x: SweptAxis,
    /// Upwards.
    pub y: SweptAxis,
    /// One for each sample.
    pub status: Vec<Status>,
}

impl Panel for FailureMap {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        let expected = self.status.len();
        for (axis, what) in [(&self.x, "the first axis"), (&self.y, "the second axis")] {
            let found = axis.values.len();
            if found != expected {
                return Err(ReportError::Length { figure: FIGURE, what, expected, found });
            }
        }
        let (Some(x), Some(y)) = (Cells::new(&self.x.values), Cells::new(&self.y.values)) else {
            return Err(ReportError::Empty { figure: FIGURE, reason: "no sample has finite axis values".into() });
        };
        let mut cells = vec![[0u32; Status::ALL.len()]; x.count * y.count];
        let mut totals = [0u64; Status::ALL.len()];
        for (sample, status) in self.status.iter().enumerate() {
            let place = (x.cell(self.x.values[sample]), y.cell(self.y.values[sample]));
            if let (Some(column), Some(row)) = place {
                cells[row * x.count + column][usize::from(status.code())] += 1;
                totals[usize::from(status.code())] += 1;
            }
        }
        let axis = |swept: &SweptAxis, cells: &Cells| {
            let label = AxisLabel { label: swept.label.clone(), unit: swept.unit.clone(), scale: Scale::Linear };
            Axis::exactly(&label, cells.low, cells.low + cells.width * cells.count as f64)
        };
        let entries = entries(&totals);
        let mut axes = Axes::within(rect, axis(&self.x, &x), axis(&self.y, &y), &self.title);
        let height = legend::flow(None, &entries, [0.0; 2], axes.rect.width) + 4.0;
        let above = [axes.rect.left, axes.rect.top - 3.0];
        (axes.rect.top, axes.rect.height) = (axes.rect.top + height, axes.rect.height - height);
        let rows = (0..y.count).rev().flat_map(|row| &cells[row * x.count..(row + 1) * x.count]);
        let pixels = rows.map(cell_colour).collect();
        axes.draw(canvas, "");
        canvas.shapes.push(Shape::Image { rect: axes.rect, width: x.count, height: y.count, pixels });
        canvas.rect(axes.rect, None, Some(super::canvas::Stroke::new(Colour::MUTED, 0.6)));
        canvas.text(Text::new(&self.title, [axes.rect.left, rect.top + 9.0], TITLE).bold());
        legend::flow(Some(canvas), &entries, above, axes.rect.width);
        Ok(())
    }

    fn height(&self, width: f64) -> f64 {
        0.95 * width
    }
}

/// Equal cells along an axis.
struct Cells {
    low: f64,
    width: f64,
    count: usize,
}

impl Cells {
    fn new(values: &[f64]) -> Option<Self> {
        let mut distinct: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        distinct.sort_unstable_by(f64::total_cmp);
        let (first, last) = (*distinct.first()?, *distinct.last()?);
        distinct.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * (last - first));
        let n = distinct.len();
        if n == 1 {
            let half = if first == 0.0 { 0.5 } else { 0.05 * first.abs() };
            return Some(Self { low: first - half, width: 2.0 * half, count: 1 });
        }
        if n > MOST_CELLS {
            // Few samples need coarse cells to leave none empty.
            let count = ((values.len() as f64).sqrt() / 3.0).clamp(4.0, MOST_CELLS as f64) as usize;
            return Some(Self { low: first, width: (last - first) / count as f64, count });
        }
        // The values of a grid lie in the middle of their cells.
        let width = (last - first) / (n - 1) as f64;
        Some(Self { low: first - 0.5 * width, width, count: n })
    }

    fn cell(&self, value: f64) -> Option<usize> {
        value.is_finite().then(|| ((value - self.low) / self.width).clamp(0.0, self.count as f64 - 1.0) as usize)
    }
}

fn cell_colour(counts: &[u32; Status::ALL.len()]) -> Colour {
    let total: u32 = counts.iter().sum();
    let failed: u32 = Status::ALL.iter().zip(counts).filter(|(status, _)| !status.is_success()).map(|(_, n)| n).sum();
    let worst = Status::ALL.iter().zip(counts).filter(|(status, _)| !status.is_success()).max_by_key(|(_, n)| **n);
    match worst {
        _ if total == 0 => Colour::WHITE,
        Some((status, n)) if *n > 0 => {
            SUCCESS.mix(status_colour(*status), 0.35 + 0.65 * f64::from(failed) / f64::from(total))
        }
        _ => SUCCESS,
    }
}

fn entries(totals: &[u64; Status::ALL.len()]) -> Vec<Entry> {
    let patch = |colour: Colour| {
        move |canvas: &mut Canvas, rect: Rect| {
            let patch = Rect { left: rect.right() - 9.0, top: rect.centre()[1] - 3.5, width: 9.0, height: 7.0 };
            canvas.rect(patch, Some(colour), None);
        }
    };
    let succeeded: u64 = Status::ALL.iter().zip(totals).filter(|(status, _)| status.is_success()).map(|(_, n)| n).sum();
    let mut entries = vec![Entry::new(format!("solved: {}", count(succeeded)), patch(SUCCESS))];
    for (status, n) in Status::ALL.iter().zip(totals) {
        if *n > 0 && !status.is_success() {
            entries.push(Entry::new(format!("{}: {}", status.name(), count(*n)), patch(status_colour(*status))));
        }
    }
    entries
}
