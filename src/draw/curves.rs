//! Lines and markers over two axes, linear or logarithmic, with error bands and a legend.

use super::axes::{Axes, Axis, AxisLabel};
use super::canvas::{Canvas, Point, Rect, Shape, Stroke, TITLE, Text};
use super::colour::Colour;
use super::legend::{self, Entry};
use super::{Panel, ReportError};

const FIGURE: &str = "the curves";

/// What stands at each point of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Marker {
    /// A disc.
    Circle,
    /// A square on its side.
    Square,
    /// A triangle on its side.
    Triangle,
    /// A square on its corner.
    Diamond,
}

impl Marker {
    /// Every marker, in the order in which series use them.
    pub const ALL: [Marker; 4] = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond];

    /// Filled with a white rim, or hollow.
    fn draw(self, canvas: &mut Canvas, [x, y]: Point, colour: Colour, hollow: bool) {
        let rim = Some(if hollow { Stroke::new(colour, 0.7) } else { Stroke::new(Colour::WHITE, 0.5) });
        let r = if hollow { 1.9 } else { 2.3 };
        let fill = Some(if hollow { Colour::WHITE } else { colour });
        match self {
            Marker::Circle => canvas.circle([x, y], r, fill, rim),
            Marker::Square => {
                canvas.rect(Rect { left: x - 0.9 * r, top: y - 0.9 * r, width: 1.8 * r, height: 1.8 * r }, fill, rim)
            }
            Marker::Triangle => {
                canvas.polygon([[x, y - 1.2 * r], [x + 1.1 * r, y + 0.8 * r], [x - 1.1 * r, y + 0.8 * r]], fill, rim)
            }
            Marker::Diamond => {
                let r = 1.25 * r;
                canvas.polygon([[x, y - r], [x + r, y], [x, y + r], [x - r, y]], fill, rim)
            }
        }
    }
}

/// One series of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Words in the legend; empty for none.
    pub name: String,
    /// In the axes' units; what is not finite, or not positive on a logarithmic axis, interrupts the line.
    pub points: Vec<[f64; 2]>,
    /// Lower and upper bound at each point, or none.
    pub band: Vec<[f64; 2]>,
    /// Whether the bounds are drawn as a bar at each point, not as a band.
    pub bars: bool,
    /// Whether points are joined.
    pub line: bool,
    /// Whether the line is dashed.
    pub dashed: bool,
    /// What stands at each point; `None` for nothing.
    pub marker: Option<Marker>,
    /// Whether markers are not filled.
    pub hollow: bool,
    /// Of the line (pt).
    pub width: f64,
    /// The next colour of the palette unless chosen.
    pub colour: Option<Colour>,
}

impl Series {
    /// A line without markers.
    pub fn line(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        let band = Vec::new();
        let (bars, dashed, hollow, marker, colour) = (false, false, false, None, None);
        Self { name: name.into(), points, band, bars, line: true, dashed, marker, hollow, width: 1.2, colour }
    }

    /// Markers without a line.
    pub fn scatter(name: impl Into<String>, points: Vec<[f64; 2]>, marker: Marker) -> Self {
        Self { line: false, marker: Some(marker), ..Self::line(name, points) }
    }

    /// With markers.
    pub fn marker(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }

    /// With markers that are not filled.
    pub fn hollow(self) -> Self {
        Self { hollow: true, ..self }
    }

    /// With a dashed line.
    pub fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// Width of the line (pt).
    pub fn width(self, width: f64) -> Self {
        Self { width, ..self }
    }

    /// In a colour of its own.
    pub fn colour(self, colour: Colour) -> Self {
        Self { colour: Some(colour), ..self }
    }

    /// With a lower and an upper bound at each point, shaded.
    pub fn band(self, band: Vec<[f64; 2]>) -> Self {
        Self { band, ..self }
    }

    /// With a lower and an upper bound at each point, drawn as bars. A bound that is not finite ends at the point.
    pub fn bars(self, bounds: Vec<[f64; 2]>) -> Self {
        Self { band: bounds, bars: true, ..self }
    }
}

/// A panel of series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// Above the panel; empty for none.
    pub title: String,
    /// To the right.
    pub x: AxisLabel,
    /// Upwards.
    pub y: AxisLabel,
    /// The first lies lowest.
    pub series: Vec<Series>,
}

/// Curves in a plane: a unit is as long along y as along x.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneCurves(pub Curves);

impl Panel for PlaneCurves {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        self.0.draw_on(canvas, rect, true)
    }
}

impl Panel for Curves {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        self.draw_on(canvas, rect, false)
    }
}

impl Curves {
    fn draw_on(&self, canvas: &mut Canvas, rect: Rect, plane: bool) -> Result<(), ReportError> {
        for series in &self.series {
            let (expected, found) = (series.points.len(), series.band.len());
            if found != 0 && found != expected {
                return Err(ReportError::Length { figure: FIGURE, what: "the error band", expected, found });
            }
        }
        let points = || self.series.iter().flat_map(|series| &series.points);
        let bands = self.series.iter().flat_map(|series| series.band.iter().flatten());
        let x = Axis::spanning(&self.x, points().map(|point| point[0]));
        let y = Axis::spanning(&self.y, points().map(|point| &point[1]).chain(bands).copied());
        let (Some(x), Some(y)) = (x, y) else {
            let reason = format!("no point of `{}` against `{}` can be shown", self.y.label, self.x.label);
            return Err(ReportError::Empty { figure: FIGURE, reason });
        };
        let entries = self.entries();
        let mut axes = Axes::within(rect, x, y, &self.title);
        if plane {
            axes.equalise();
        }
        let boxed = legend::corner(&entries, axes.rect, &self.trace(&axes));
        if boxed.is_none() {
            // No corner is free: the legend stands between title and frame.
            let height = legend::flow(None, &entries, [0.0; 2], axes.rect.width) + 4.0;
            let top = axes.rect.top - 3.0;
            (axes.rect.top, axes.rect.height) = (axes.rect.top + height, axes.rect.height - height);
            if plane {
                axes.equalise();
            }
            axes.draw(canvas, "");
            canvas.text(Text::new(&self.title, [axes.rect.left, rect.top + 9.0], TITLE).bold());
            legend::flow(Some(canvas), &entries, [axes.rect.left, top], axes.rect.width);
        } else {
            axes.draw(canvas, &self.title);
        }
        self.draw_series(canvas, &axes);
        if let Some(place) = boxed.filter(|_| !entries.is_empty()) {
            legend::draw_box(canvas, &entries, place);
        }
        Ok(())
    }

    fn colour(&self, index: usize) -> Colour {
        self.series[index].colour.unwrap_or(Colour::SERIES[index % Colour::SERIES.len()])
    }

    fn stroke(&self, index: usize) -> Stroke {
        let dash = self.series[index].dashed.then_some([3.5, 2.5]);
        Stroke { dash, ..Stroke::new(self.colour(index), self.series[index].width) }
    }

    fn entries(&self) -> Vec<Entry> {
        let named = self.series.iter().enumerate().filter(|(_, series)| !series.name.is_empty());
        named
            .map(|(index, series)| {
                let (line, marker, hollow, stroke) = (series.line, series.marker, series.hollow, self.stroke(index));
                Entry::new(&series.name, move |canvas, rect| {
                    let y = rect.centre()[1];
                    if line {
                        canvas.line([[rect.left, y], [rect.right(), y]], stroke);
                    }
                    if let Some(marker) = marker {
                        marker.draw(canvas, rect.centre(), stroke.colour, hollow);
                    }
                })
            })
            .collect()
    }

    /// Stretches of a series without gaps, on the page.
    fn stretches(points: &[[f64; 2]], axes: &Axes) -> Vec<Vec<Point>> {
        let places: Vec<Point> = points.iter().map(|point| axes.place(*point)).collect();
        let stretches = places.split(|place| !place.iter().all(|x| x.is_finite()));
        stretches.filter(|stretch| !stretch.is_empty()).map(<[Point]>::to_vec).collect()
    }

    /// Places that a legend should not hide: points, and steps of a few points along the lines.
    fn trace(&self, axes: &Axes) -> Vec<Point> {
        let mut trace = Vec::new();
        for series in &self.series {
            for stretch in Self::stretches(&series.points, axes) {
                for pair in stretch.windows(2).filter(|_| series.line) {
                    let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
                    let count = ((x1 - x0).hypot(y1 - y0) / 4.0).ceil().min(500.0) as usize;
                    trace.extend((0..count).map(|k| {
                        let share = k as f64 / count as f64;
                        [x0 + share * (x1 - x0), y0 + share * (y1 - y0)]
                    }));
                }
                trace.extend(stretch);
            }
            for (point, bounds) in series.points.iter().zip(&series.band).filter(|_| series.bars) {
                if let Some([[x, top], [_, bottom]]) = bar_ends(axes, *point, *bounds) {
                    let count = ((bottom - top) / 4.0).ceil().clamp(0.0, 500.0) as usize;
                    trace.extend((0..=count).map(|k| [x, top + (bottom - top) * k as f64 / count.max(1) as f64]));
                }
            }
        }
        trace
    }

    fn draw_series(&self, canvas: &mut Canvas, axes: &Axes) {
        let clip = Some(axes.rect);
        for (index, series) in self.series.iter().enumerate().filter(|(_, series)| series.bars) {
            let stroke = Stroke::new(self.colour(index), 0.7);
            for (point, bounds) in series.points.iter().zip(&series.band) {
                draw_bar(canvas, axes, *point, *bounds, stroke);
            }
        }
        let banded = |series: &Series| !series.band.is_empty() && !series.bars;
        for (index, series) in self.series.iter().enumerate().filter(|(_, series)| banded(series)) {
            let side = |k: usize| series.points.iter().zip(&series.band).map(move |(point, band)| [point[0], band[k]]);
            let edge = side(0).chain(side(1).collect::<Vec<_>>().into_iter().rev()).map(|point| axes.place(point));
            let points: Vec<Point> = edge.filter(|place| place.iter().all(|x| x.is_finite())).collect();
            let fill = Some(self.colour(index).with_alpha(0.18));
            canvas.shapes.push(Shape::Path { points, closed: true, fill, stroke: None, clip });
        }
        for (index, series) in self.series.iter().enumerate().filter(|(_, series)| series.line) {
            for stretch in Self::stretches(&series.points, axes) {
                canvas.clipped_line(stretch, self.stroke(index), axes.rect);
            }
        }
        for (index, series) in self.series.iter().enumerate() {
            let places = series.points.iter().map(|point| axes.place(*point));
            if let Some(marker) = series.marker {
                places
                    .filter(|place| place.iter().all(|x| x.is_finite()))
                    .for_each(|place| marker.draw(canvas, place, self.colour(index), series.hollow));
            }
        }
    }
}

/// The upper and the lower end of a point's bar. A bound that is not finite ends at the point, one that a logarithmic axis
/// cannot show at the frame.
fn bar_ends(axes: &Axes, point: [f64; 2], [low, high]: [f64; 2]) -> Option<[Point; 2]> {
    let [x, y] = axes.place(point);
    let end = |bound: f64, edge: f64| match axes.place([point[0], bound])[1] {
        _ if !bound.is_finite() => y,
        place if place.is_finite() => place,
        _ => edge,
    };
    let ends = [[x, end(high, axes.rect.top)], [x, end(low, axes.rect.bottom())]];
    (x.is_finite() && y.is_finite()).then_some(ends)
}

/// A point's bar, with a short line across both ends that lie within the frame.
fn draw_bar(canvas: &mut Canvas, axes: &Axes, point: [f64; 2], bounds: [f64; 2], stroke: Stroke) {
    let Some(ends) = bar_ends(axes, point, bounds) else { return };
    let [[x, top], [_, bottom]] = ends;
    if top == bottom {
        return;
    }
    canvas.clipped_line(ends, stroke, axes.rect);
    for y in [top, bottom].into_iter().filter(|y| axes.rect.inset(0.1).contains([x, *y])) {
        canvas.clipped_line([[x - 1.8, y], [x + 1.8, y]], stroke, axes.rect);
    }
}
