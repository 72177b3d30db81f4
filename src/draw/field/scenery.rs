//! What surrounds a rod, drawn in the four views of a figure.

use super::super::canvas::{Align, Canvas, Point, Rect, SMALL, Stroke, Text};
use super::super::colour::Colour;
use super::super::legend::Entry;
use super::super::samples::{arrow_entry, line_entry};
use super::super::symbols::{arrow, end_on, flat_arrow};
use super::super::ticks::compact;
use super::super::vectors::{along, bounds, dot, middle, norm, widest};
use super::super::views::View;
use super::beyond::{self, beyond};
use super::bodies::{self, CLEARANCE, GRID, RIM};
use super::free_places::{Taken, letter};
use super::sources::{FieldSource, SourceBody, Surroundings};
use super::spread::{Plane, SEPARATION, Spot, length};
use crate::model::Vector;

const LINE: Colour = Surroundings::LINE_COLOUR;
const LINE_WIDTH: f64 = 0.55;
/// A line has its full colour where this share of the field lies in the plane.
const FULL: f64 = 0.6;
const SHADES: f64 = 5.0;
/// Lines that are longer have an arrowhead (pt).
const HEADED: f64 = 36.0;
/// Where less of the field lies in the plane, marks tell its direction through it.
const THROUGH: f64 = 0.3;

/// What surrounds a rod in one figure.
pub(in crate::draw) struct Scenery<'a> {
    surroundings: &'a Surroundings,
    rod: Vec<Vector>,
    /// At its end, where that is one.
    tip: Option<Vector>,
    middle: Vector,
    extent: f64,
    limits: [[f64; 2]; 3],
}

impl<'a> Scenery<'a> {
    /// For a rod's points, base to tip, in views with these limits (m).
    pub fn of_rod(surroundings: &'a Surroundings, rod: Vec<Vector>, limits: [[f64; 2]; 3]) -> Scenery<'a> {
        Scenery { tip: rod.last().copied(), ..Scenery::of_points(surroundings, rod, limits) }
    }

    /// For points of several rods.
    pub fn of_points(surroundings: &'a Surroundings, rods: Vec<Vector>, limits: [[f64; 2]; 3]) -> Scenery<'a> {
        let rod = if rods.is_empty() { vec![middle(limits)] } else { rods };
        let middle = middle(bounds(rod.iter().copied()));
        Scenery { surroundings, tip: None, middle, extent: widest(limits), rod, limits }
    }

    fn is_shown(&self, source: &FieldSource) -> bool {
        let slack = 1e-9 * self.extent;
        let sides = source.limits().into_iter().zip(self.limits);
        sides.into_iter().all(|([low, high], [from, to])| low >= from - slack && high <= to + slack)
    }

    fn shown(&self) -> impl Iterator<Item = &'a FieldSource> + '_ {
        self.surroundings.sources.iter().filter(|source| self.is_shown(source))
    }

    /// Draws what lies behind the rod.
    pub fn draw_behind(&self, canvas: &mut Canvas, view: &View) {
        if view.axes.is_some() {
            self.draw_lines(canvas, view);
            self.surroundings.grids.iter().for_each(|grid| bodies::draw_grid(canvas, view, grid));
            self.shown().for_each(|source| bodies::draw_clearance(canvas, view, source));
        }
        let mut nearest_last: Vec<&FieldSource> = self.shown().collect();
        nearest_last.sort_by(|a, b| view.depth(a.position).total_cmp(&view.depth(b.position)));
        nearest_last.into_iter().for_each(|source| bodies::draw(canvas, view, source, self.extent));
    }

    /// A source where it is at one time: its middle, and the whole where that is wanted.
    pub fn draw_moved(&self, canvas: &mut Canvas, view: &View, source: &FieldSource, colour: Colour, is_whole: bool) {
        let at = view.place(source.position);
        if is_whole {
            for mut line in bodies::fronts(source, view, 1.0).into_iter().chain([bodies::outline(source, view)]) {
                line.extend(line.first().copied());
                canvas.clipped_line(line, Stroke::new(colour, 0.9), view.rect);
            }
            if let Some(moment) = bodies::moment_arrow(source, self.extent) {
                arrow(canvas, view, along(source.position, -0.5, moment), moment, colour, 1.1);
            }
        }
        canvas.circle(at, 1.5, Some(colour), Some(Stroke::new(Colour::WHITE, 0.4)));
    }

    /// The outline of a source that moves, with its moment: lines of as many points each, wherever it is.
    pub fn moving(&self, view: &View, source: &FieldSource) -> [Vec<Point>; 2] {
        let mut arrow = Vec::new();
        if let Some(moment) = bodies::moment_arrow(source, self.extent) {
            let from = view.place(along(source.position, -0.5, moment));
            let [u, v] = view.along(moment);
            let end = [from[0] + u, from[1] + v];
            let barb = |side: f64| [end[0] - 0.2 * u - 0.1 * side * v, end[1] - 0.2 * v + 0.1 * side * u];
            arrow.extend([from, end, barb(1.0), end, barb(-1.0)]);
        }
        [bodies::even_outline(source, view), arrow]
    }

    fn draw_lines(&self, canvas: &mut Canvas, view: &View) {
        if !self.surroundings.has_lines {
            return;
        }
        let plane = Plane { surroundings: self.surroundings, view, through: self.middle };
        for line in plane.lines() {
            draw_line(canvas, &line, view.rect);
        }
        self.draw_through(canvas, &plane);
    }

    /// Marks where the field goes through the plane of a view rather than along it.
    fn draw_through(&self, canvas: &mut Canvas, plane: &Plane) {
        let Rect { left, top, width, height } = plane.view.rect;
        let step = 2.0 * SEPARATION;
        let count = |size: f64| ((size / step).floor() as usize).max(1);
        let (columns, rows) = (count(width), count(height));
        let bodies: Vec<Rect> = self.shown().map(|source| extent(&bodies::outline(source, plane.view))).collect();
        let middle = |k: usize, of: usize, from: f64, size: f64| from + size * (k as f64 + 0.5) / of as f64;
        for k in 0..columns * rows {
            let at = [middle(k % columns, columns, left, width), middle(k / columns, rows, top, height)];
            let point = plane.point(at);
            let field = self.surroundings.flux_density(point);
            let through = dot(field, plane.view.toward) / norm(field);
            let is_seen = self.surroundings.is_known(point) && (1.0 - through * through).max(0.0).sqrt() < THROUGH;
            if is_seen && through.is_finite() && !bodies.iter().any(|body| body.contains(at)) {
                end_on(canvas, at, through > 0.0, LINE, 0.0);
            }
        }
    }

    /// Names what is drawn, and marks what lies beyond the panel; `points` of the data are left free where possible.
    pub fn draw_words(&self, canvas: &mut Canvas, view: &View, points: Vec<Point>, letters: &[Point]) {
        let mut taken = Taken::new(view.rect.inset(1.5), points);
        letters.iter().for_each(|at| taken.keep(letter(*at)));
        for source in self.shown() {
            let outline = bodies::marks(source, view, self.extent);
            let words = match source.current {
                _ if source.is_swept => format!("{}, swept", source.name),
                Some(current) => format!("{}, {} A", source.name, signed(current)),
                None => source.name.clone(),
            };
            let text = Text::new(words, [0.0; 2], SMALL).colour(Colour::INK).halo();
            if let Some(text) = taken.settle(&text, &around(&outline)) {
                canvas.text(text);
            }
        }
        if view.axes.is_some() {
            let hidden: Vec<&FieldSource> =
                self.surroundings.sources.iter().filter(|source| !self.is_shown(source)).collect();
            let marks = beyond(view, self.middle, &self.rod, &hidden);
            beyond::draw(canvas, &mut taken, &marks);
        }
    }

    /// Of the legend.
    pub fn entries(&self) -> Vec<Entry> {
        let mut entries = Vec::new();
        let is_magnet = |source: &&FieldSource| !source.is_coil();
        let magnets: Vec<&FieldSource> = self.shown().filter(is_magnet).collect();
        match magnets[..] {
            [] => {}
            [one] => entries.push(body_entry(format!("magnet, {} A·m² from S to N", compact(norm(one.moment))), one)),
            [one, ..] => entries.push(body_entry("magnets, arrows from S to N".into(), one)),
        }
        if let Some(coil) = self.shown().find(|source| source.is_coil()) {
            entries.push(body_entry("electromagnet (size not to scale)".into(), coil));
        }
        if magnets.iter().any(|magnet| magnet.clearance.is_some()) {
            entries.push(line_entry("clearance", CLEARANCE));
        }
        if self.surroundings.sources.iter().any(|source| !self.is_shown(source)) {
            entries.push(Entry::new("beyond the panel, distance to the rod", |canvas, rect| {
                let [x, y] = rect.centre();
                canvas.polygon([[x + 3.5, y], [x - 3.0, y - 2.7], [x - 3.0, y + 2.7]], Some(beyond::MARK), None);
            }));
        }
        if !self.surroundings.grids.is_empty() {
            entries.push(line_entry("grid of the sampled field", GRID));
        }
        if self.surroundings.has_lines {
            entries.push(arrow_entry(self.words_of_lines(), LINE));
        }
        entries
    }

    /// Of what is drawn behind the rod, for words to keep away from.
    pub fn points(&self, view: &View) -> Vec<Point> {
        self.shown().flat_map(|source| bodies::marks(source, view, self.extent)).collect()
    }

    /// Of the legend, with the field at the rod's tip where it is known.
    fn words_of_lines(&self) -> String {
        let size = self.tip.and_then(|tip| self.surroundings.magnitude(tip));
        let at_tip = size.map(|size| format!("; |B| = {} mT at the tip", compact(1e3 * size)));
        format!("lines of B in the plane through the rod's middle{}", at_tip.unwrap_or_default())
    }
}

fn signed(current: f64) -> String {
    let size = compact(current.abs());
    if current == 0.0 { size } else { format!("{}{size}", beyond::sign(current)) }
}

/// A line in shades by how much of the field lies in the plane, with an arrowhead at its middle.
fn draw_line(canvas: &mut Canvas, line: &[Spot], clip: Rect) {
    let shade = |spot: &Spot| ((spot.share / FULL).min(1.0) * SHADES).ceil() / SHADES;
    for run in line.chunk_by(|a, b| shade(a) == shade(b)).scan(0usize, |from, run| {
        // Each run begins where the one before ends.
        let begin = from.saturating_sub(1);
        *from += run.len();
        Some(&line[begin..*from])
    }) {
        let colour = Colour::WHITE.mix(LINE, run.last().map_or(1.0, shade));
        let points: Vec<Point> = run.iter().map(|spot| spot.at).collect();
        canvas.clipped_line(points, Stroke::new(colour, LINE_WIDTH), clip);
    }
    let whole = length(line);
    if whole < HEADED {
        return;
    }
    let mut gone = 0.0;
    for pair in line.windows(2) {
        let [a, b] = [pair[0].at, pair[1].at];
        let step = (b[0] - a[0]).hypot(b[1] - a[1]);
        gone += step;
        if gone >= 0.5 * whole && step > 0.0 {
            let [u, v] = [(b[0] - a[0]) / step, (b[1] - a[1]) / step];
            let tip = [b[0] + 2.2 * u, b[1] + 2.2 * v];
            let back = [b[0] - 2.2 * u, b[1] - 2.2 * v];
            let corners = [tip, [back[0] - 1.5 * v, back[1] + 1.5 * u], [back[0] + 1.5 * v, back[1] - 1.5 * u]];
            canvas.polygon(corners, Some(Colour::WHITE.mix(LINE, shade(&pair[1]))), None);
            return;
        }
    }
}

/// The smallest rectangle around places.
fn extent(places: &[Point]) -> Rect {
    let [[left, right], [top, bottom], _] = bounds(places.iter().map(|[x, y]| -> Vector { [*x, *y, 0.0] }));
    Rect { left, top, width: right - left, height: bottom - top }
}

/// Places for a name around an outline.
fn around(outline: &[Point]) -> Vec<(Point, Align)> {
    let rect = extent(outline);
    let ([x, y], [left, top], [right, bottom]) = (rect.centre(), [rect.left, rect.top], [rect.right(), rect.bottom()]);
    let mut places = Vec::new();
    for gap in [3.0, 10.0] {
        places.extend([
            ([x, top - gap - 3.0], Align::Middle),
            ([x, bottom + gap + 3.0], Align::Middle),
            ([left - gap, y], Align::End),
            ([right + gap, y], Align::Start),
            ([right + gap, top - gap], Align::Start),
            ([left - gap, top - gap], Align::End),
            ([right + gap, bottom + gap], Align::Start),
            ([left - gap, bottom + gap], Align::End),
        ]);
    }
    places
}

fn body_entry(words: String, source: &FieldSource) -> Entry {
    let (fill, is_dot) = (bodies::colour(source), source.body == SourceBody::Dipole);
    Entry::new(words, move |canvas, rect| {
        let [x, y] = rect.centre();
        match is_dot {
            true => canvas.circle([x, y], 2.6, Some(fill), Some(RIM)),
            false => canvas.rect(Rect { left: x - 5.0, top: y - 3.0, width: 10.0, height: 6.0 }, Some(fill), Some(RIM)),
        }
        flat_arrow(canvas, [x - 8.0, y], [x + 8.5, y], bodies::MOMENT, 1.0);
    })
}
