//! Legends: samples of marks with words beside them.

use super::canvas::{Canvas, Point, Rect, SMALL, Stroke, Text};
use super::colour::Colour;

const SAMPLE: f64 = 18.0;
const LINE: f64 = 11.0;
const PAD: f64 = 4.0;
const GAP: f64 = 14.0;

/// Draws the sample of an entry into a small rectangle.
type Sample = dyn Fn(&mut Canvas, Rect);

/// One entry: its words, and how its sample is drawn into a small rectangle.
pub(super) struct Entry {
    pub words: String,
    pub sample: Box<Sample>,
}

impl Entry {
    pub(super) fn new(words: impl Into<String>, sample: impl Fn(&mut Canvas, Rect) + 'static) -> Self {
        Self { words: words.into(), sample: Box::new(sample) }
    }

    fn width(&self) -> f64 {
        SAMPLE + 5.0 + Text::new(&self.words, [0.0; 2], SMALL).width()
    }

    fn draw(&self, canvas: &mut Canvas, [x, y]: Point) {
        (self.sample)(canvas, Rect { left: x, top: y - 0.4 * LINE, width: SAMPLE, height: 0.8 * LINE });
        canvas.text(Text::new(&self.words, [x + SAMPLE + 5.0, y], SMALL));
    }
}

/// Size of a boxed legend, entries one below another.
fn size(entries: &[Entry]) -> [f64; 2] {
    let width = entries.iter().map(Entry::width).fold(0.0, f64::max);
    [width + 2.0 * PAD, LINE * entries.len() as f64 + 2.0 * PAD]
}

/// The corner of a panel in which a boxed legend hides the fewest points; none if it always hides too many.
pub(super) fn corner(entries: &[Entry], panel: Rect, points: &[Point]) -> Option<Rect> {
    let [width, height] = size(entries);
    let inner = panel.inset(5.0);
    if width > inner.width || height > inner.height {
        return None;
    }
    let places = [
        [inner.right() - width, inner.top],
        [inner.left, inner.top],
        [inner.right() - width, inner.bottom() - height],
        [inner.left, inner.bottom() - height],
    ];
    let boxes = places.map(|[left, top]| Rect { left, top, width, height });
    let hidden = |rect: &Rect| points.iter().filter(|point| rect.inset(-3.0).contains(**point)).count();
    boxes.into_iter().min_by_key(hidden).filter(|rect| hidden(rect) == 0)
}

/// Draws a boxed legend.
pub(super) fn draw_box(canvas: &mut Canvas, entries: &[Entry], rect: Rect) {
    canvas.rect(rect, Some(Colour::WHITE.with_alpha(0.9)), Some(Stroke::new(Colour::GRID, 0.5)));
    for (index, entry) in entries.iter().enumerate() {
        entry.draw(canvas, [rect.left + PAD, rect.top + PAD + LINE * (index as f64 + 0.5)]);
    }
}

/// Draws entries in lines from left to right within a width, from `at` down, if a canvas is given; returns the height.
pub(super) fn flow(canvas: Option<&mut Canvas>, entries: &[Entry], at: Point, width: f64) -> f64 {
    let mut places = Vec::new();
    let (mut x, mut y) = (0.0, 0.0);
    for entry in entries {
        if x > 0.0 && x + entry.width() > width {
            (x, y) = (0.0, y + LINE + 2.0);
        }
        places.push([at[0] + x, at[1] + y + 0.5 * LINE]);
        x += entry.width() + GAP;
    }
    if let Some(canvas) = canvas {
        for (entry, place) in entries.iter().zip(places) {
            entry.draw(canvas, place);
        }
    }
    if entries.is_empty() { 0.0 } else { y + LINE }
}
