//! Three orthographic projections and one view in space, at equal scale on all axes of each panel.
//!
//! The projections are arranged as in a technical drawing (x-z, y-z above x-y) and share limits and one scale.

use super::canvas::{Align, Canvas, NORMAL, Point, Rect, SMALL, Stroke, TITLE, Text};
use super::colour::Colour;
use super::legend::{self, Entry};
use super::ticks::{self, LengthUnit};
use super::vectors::{cross, dot, middle, widest};
use crate::model::Vector;

const NAMES: [&str; 3] = ["x", "y", "z"];
/// Limits are drawn no narrower than this share of the widest.
const NARROWEST: f64 = 0.6;
/// White rim between data and limits over their range.
const RIM: f64 = 0.05;
/// Room for tick labels and axis labels (pt).
const LEFT: f64 = 40.0;
const BOTTOM: f64 = 31.0;
const GAP_X: f64 = 43.0;
const GAP_Y: f64 = 44.0;
const TALLEST: f64 = 430.0;
/// From where figures in space are seen: angle about z, from the x axis (deg).
pub const AZIMUTH: f64 = -58.0;
/// From where figures in space are seen: angle above the plane of x and y (deg).
pub const ELEVATION: f64 = 24.0;

/// An orthographic camera and its panel.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Where it is on the page.
    pub rect: Rect,
    /// Unit vector to the right on the page.
    pub right: Vector,
    /// Unit vector up on the page.
    pub up: Vector,
    /// Unit vector towards the reader.
    pub toward: Vector,
    /// Points per metre, the same in every direction.
    pub scale: f64,
    /// The point in space that is drawn at `middle` (m).
    pub centre: Vector,
    /// Where on the page (pt).
    pub middle: Point,
    /// The horizontal and vertical axis of a projection; none in space.
    pub axes: Option<[usize; 2]>,
}

impl View {
    /// Where on the page a point in space is drawn (m to pt).
    pub fn place(&self, point: Vector) -> Point {
        let [x, y] = self.along(std::array::from_fn(|k| point[k] - self.centre[k]));
        [self.middle[0] + x, self.middle[1] + y]
    }

    /// A vector in space, drawn on the page (m to pt).
    pub fn along(&self, direction: Vector) -> Point {
        [self.scale * dot(direction, self.right), -self.scale * dot(direction, self.up)]
    }

    /// How near to the reader a point is (m).
    pub fn depth(&self, point: Vector) -> f64 {
        dot(point, self.toward)
    }
}

/// The four panels of a spatial figure.
#[derive(Clone, Debug, PartialEq)]
pub struct FourViews {
    /// Lower and upper limit of x, y and z (m).
    pub limits: [[f64; 2]; 3],
    /// In which coordinates are written.
    unit: LengthUnit,
    /// x-z, y-z, x-y, space.
    pub views: [View; 4],
    /// The lowest point of the panels' labels (pt).
    pub bottom: f64,
    /// Of the page, and what is free on its right (pt).
    width: f64,
    margin: f64,
}

impl FourViews {
    /// Arranges the panels for points within `bounds` (m): from `top` down, on a page of some width, leaving
    /// `margin` free on the right (pt).
    pub fn new(bounds: [[f64; 2]; 3], width: f64, top: f64, margin: f64) -> Self {
        let largest = bounds.iter().flatten().fold(0.0f64, |largest, x| largest.max(x.abs()));
        let widest = widest(bounds);
        // A single point still gets a panel with readable numbers around it.
        let widest = if widest > 1e-9 * largest { widest } else { 0.2 * largest };
        let widest = if widest > 0.0 { widest } else { 1e-3 };
        let ranges = bounds.map(|[low, high]| (high - low).max(NARROWEST * widest) * (1.0 + 2.0 * RIM));
        let free_width = width - LEFT - GAP_X - margin;
        let scale = (free_width / (ranges[0] + ranges[1])).min((TALLEST - GAP_Y) / (ranges[1] + ranges[2]));
        // Where the height decides the scale, both columns of panels become wider than their limits.
        let spare = 0.5 * (free_width - scale * (ranges[0] + ranges[1]));
        let middle = middle(bounds);
        let limits: [[f64; 2]; 3] = std::array::from_fn(|k| [middle[k] - 0.5 * ranges[k], middle[k] + 0.5 * ranges[k]]);
        let extent = limits.iter().flatten().fold(0.0f64, |extent, x| extent.max(x.abs())).min(10.0 * widest);
        let [x, y, z] = ranges.map(|range| range * scale);
        let (first, second) = (x + spare, y + spare);
        let (right, lower) = (LEFT + first + GAP_X, top + z + GAP_Y);
        let panel = |left, top, width, height| Rect { left, top, width, height };
        let flat = |rect: Rect, axes: [usize; 2]| {
            let unit = |axis| std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
            let (right, up) = (unit(axes[0]), unit(axes[1]));
            let toward = cross(right, up);
            View { rect, right, up, toward, scale, centre: middle, middle: rect.centre(), axes: Some(axes) }
        };
        let wider = 0.75 * GAP_X;
        let space_width = second + wider + (margin - 4.0).min(30.0);
        let space = panel(right - wider, lower - 0.4 * GAP_Y, space_width, y + 0.4 * GAP_Y + BOTTOM);
        let views = [
            flat(panel(LEFT, top, first, z), [0, 2]),
            flat(panel(right, top, second, z), [1, 2]),
            flat(panel(LEFT, lower, first, y), [0, 1]),
            spatial(space, limits, middle),
        ];
        Self { limits, unit: LengthUnit::for_extent(extent), views, bottom: lower + y + BOTTOM, width, margin }
    }

    /// A page with a title and the axes, and room for a legend below the panels.
    pub(super) fn page(&self, title: &str, entries: &[Entry]) -> Canvas {
        let ([left, top], width) = self.legend_place();
        let mut canvas = Canvas::new(self.width, top + legend::flow(None, entries, [0.0; 2], width) + 5.0);
        canvas.text(Text::new(title, [left, 9.0], TITLE).bold());
        self.draw_axes(&mut canvas);
        canvas
    }

    /// Draws the legend below the panels.
    pub(super) fn draw_legend(&self, canvas: &mut Canvas, entries: &[Entry]) {
        let (at, width) = self.legend_place();
        legend::flow(Some(canvas), entries, at, width);
    }

    /// Where the legend is, and how wide.
    fn legend_place(&self) -> (Point, f64) {
        let left = self.views[0].rect.left;
        ([left, self.bottom + 4.0], self.width - left - self.margin)
    }

    /// Frames, grids, ticks and labels, to lie under the data.
    pub fn draw_axes(&self, canvas: &mut Canvas) {
        for view in &self.views {
            match view.axes {
                Some(axes) => self.draw_plane(canvas, view, axes),
                None => self.draw_box(canvas, view),
            }
        }
        for (view, letter) in self.views.iter().zip(["a", "b", "c", "d"]) {
            let x = if view.axes.is_some() { view.rect.left } else { self.views[1].rect.left };
            let y = if view.axes.is_some() { view.rect.top } else { self.views[2].rect.top };
            canvas.text(Text::new(letter, [x, y - 7.0], TITLE).bold());
        }
    }

    fn label(&self, axis: usize) -> String {
        format!("{} ({})", NAMES[axis], self.unit.name)
    }

    /// Ticks of an axis between limits (m), at least `spacing` metres apart.
    fn ticks(&self, limits: [f64; 2], spacing: f64) -> (Vec<f64>, Vec<String>) {
        let metres = self.unit.metres;
        let [low, high] = limits.map(|x| x / metres);
        let ticks = ticks::multiples(low, high, ticks::round_up(spacing / metres));
        (ticks.values.into_iter().map(|x| x * metres).collect(), ticks.labels)
    }

    fn draw_plane(&self, canvas: &mut Canvas, view: &View, [horizontal, vertical]: [usize; 2]) {
        let rect = view.rect;
        let frame = Stroke::new(Colour::MUTED, 0.6);
        let grid = Stroke::new(Colour::GRID, 0.5);
        let spacing = 23.0 / view.scale;
        let shown = |axis: usize, extent: f64| {
            let half = 0.5 * extent / view.scale;
            [view.centre[axis] - half, view.centre[axis] + half]
        };
        let mut point = view.centre;
        let (values, labels) = self.ticks(shown(horizontal, rect.width), spacing);
        for (value, label) in values.into_iter().zip(labels) {
            point[horizontal] = value;
            let x = view.place(point)[0];
            canvas.line([[x, rect.top], [x, rect.bottom()]], grid);
            canvas.line([[x, rect.bottom()], [x, rect.bottom() + 3.0]], frame);
            canvas.text(Text::new(label, [x, rect.bottom() + 9.0], SMALL).align(Align::Middle));
        }
        let mut point = view.centre;
        let (values, labels) = self.ticks(shown(vertical, rect.height), spacing);
        let mut widest = 0.0f64;
        for (value, label) in values.into_iter().zip(labels) {
            point[vertical] = value;
            let y = view.place(point)[1];
            canvas.line([[rect.left, y], [rect.right(), y]], grid);
            canvas.line([[rect.left - 3.0, y], [rect.left, y]], frame);
            let text = Text::new(label, [rect.left - 5.0, y], SMALL).align(Align::End);
            widest = widest.max(text.width());
            canvas.text(text);
        }
        canvas.rect(rect, None, Some(frame));
        let [x, y] = rect.centre();
        canvas.text(Text::new(self.label(horizontal), [x, rect.bottom() + 20.5], NORMAL).align(Align::Middle));
        let left = rect.left - widest - 13.0;
        canvas.text(Text::new(self.label(vertical), [left, y], NORMAL).align(Align::Middle).angle(90.0));
    }

    /// Three back panes with a grid, and the ticked edges: x and y below in front, z on the left.
    fn draw_box(&self, canvas: &mut Canvas, view: &View) {
        let [[x0, x1], [y0, y1], [z0, z1]] = self.limits;
        let panes = [
            [[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]],
            [[x0, y0, z0], [x0, y1, z0], [x0, y1, z1], [x0, y0, z1]],
            [[x0, y1, z0], [x1, y1, z0], [x1, y1, z1], [x0, y1, z1]],
        ];
        let grid = Stroke::new(Colour::GRID, 0.5);
        for pane in panes {
            canvas.polygon(pane.map(|corner| view.place(corner)), Some(Colour::PANE), Some(grid));
        }
        // Each axis: the edge that carries its ticks, and the direction in which these point.
        let edges =
            [([x0, y0, z0], [0.0, -1.0, 0.0]), ([x1, y0, z0], [1.0, 0.0, 0.0]), ([x0, y0, z0], [-1.0, -1.0, 0.0])];
        let frame = Stroke::new(Colour::MUTED, 0.6);
        for (axis, (start, out)) in edges.into_iter().enumerate() {
            let mut end = start;
            end[axis] = self.limits[axis][1];
            let place = |value: f64| {
                let mut point = start;
                point[axis] = value;
                view.place(point)
            };
            let [a, b] = [view.place(start), view.place(end)];
            canvas.line([a, b], frame);
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let spacing = (self.limits[axis][1] - self.limits[axis][0]) * [19.0, 12.0, 14.0][axis] / length;
            let out = if axis == 2 { [-1.0, 0.0] } else { unit(view.along(out)) };
            let (values, labels) = self.ticks(self.limits[axis], spacing);
            let mut widest = 0.0f64;
            for (value, label) in values.into_iter().zip(labels) {
                let [x, y] = place(value);
                for pane in panes.iter().filter(|pane| pane.iter().any(|corner| corner[axis] != pane[0][axis])) {
                    let mut low = pane.iter().copied().fold(pane[0], minimum);
                    let mut high = pane.iter().copied().fold(pane[0], maximum);
                    (low[axis], high[axis]) = (value, value);
                    canvas.line([view.place(low), view.place(high)], grid);
                }
                canvas.line([[x, y], [x + 3.0 * out[0], y + 3.0 * out[1]]], frame);
                let align = if axis == 1 { Align::Start } else { Align::End };
                let text = Text::new(label, [x + 5.0 * out[0], y + 5.0 * out[1] + out[1] * 1.5], SMALL).align(align);
                widest = widest.max(text.width());
                canvas.text(text);
            }
            let [x, y] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            if axis == 2 {
                let at = [x - widest - 13.0, y];
                canvas.text(Text::new(self.label(axis), at, NORMAL).align(Align::Middle).angle(90.0));
            } else {
                let (side, align) = if axis == 0 { (-1.0, Align::End) } else { (1.0, Align::Start) };
                let at = [x + side * (widest + 4.0) * 0.6 + 8.0 * out[0], y + 17.0];
                let mut text = Text::new(self.label(axis), at, NORMAL).align(align);
                if axis == 1 {
                    text.at[0] = text.at[0].min(view.rect.right() - text.width());
                }
                canvas.text(text);
            }
        }
        for (a, b) in [([x0, y0, z1], [x0, y1, z1]), ([x0, y1, z1], [x1, y1, z1]), ([x1, y1, z0], [x1, y1, z1])] {
            canvas.line([view.place(a), view.place(b)], Stroke::new(Colour::GREY.with_alpha(0.6), 0.5));
        }
    }
}

/// The camera in space whose box of limits, with room for labels, fills a panel.
fn spatial(rect: Rect, limits: [[f64; 2]; 3], centre: Vector) -> View {
    let (sin_a, cos_a) = AZIMUTH.to_radians().sin_cos();
    let (sin_e, cos_e) = ELEVATION.to_radians().sin_cos();
    let right = [-sin_a, cos_a, 0.0];
    let toward = [cos_e * cos_a, cos_e * sin_a, sin_e];
    let up = cross(toward, right);
    let half = limits.map(|[low, high]| 0.5 * (high - low));
    let reach = |direction: Vector| (0..3).map(|k| half[k] * direction[k].abs()).sum::<f64>();
    // Labels stand on the left (z), on the right (y) and below (x and y).
    let (left, side, below, above) = (32.0, 24.0, 26.0, 8.0);
    let scale = (0.5 * (rect.width - left - side) / reach(right)).min(0.5 * (rect.height - below - above) / reach(up));
    let [x, y] = rect.centre();
    let middle = [x + 0.5 * (left - side), y + 0.5 * (above - below)];
    View { rect, right, up, toward, scale, centre, middle, axes: None }
}

fn minimum(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k].min(b[k]))
}

fn maximum(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k].max(b[k]))
}

fn unit([x, y]: Point) -> Point {
    let norm = x.hypot(y);
    if norm > 0.0 { [x / norm, y / norm] } else { [0.0, 1.0] }
}
