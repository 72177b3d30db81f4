//! Magnets, coils and grids in a view.

use super::super::canvas::{Canvas, Point, Stroke};
use super::super::colour::Colour;
use super::super::symbols::{arrow, hull};
use super::super::vectors::{along, circle, dot, nonzero, scaled};
use super::super::views::View;
use super::sources::{Cylinder, FieldSource, GridBox, SourceBody, Surroundings};
use crate::model::Vector;
use std::f64::consts::TAU;

/// Corners of a circle.
const CORNERS: usize = 64;
/// Radius of a magnet without a size (pt).
const DOT: f64 = 3.2;
/// Of a coil's bore over its diameter.
const BORE: f64 = 0.55;
/// The arrow of a moment over the body's length along it, and over the view's extent at least.
const ARROW: f64 = 0.8;
const LEAST_ARROW: f64 = 0.12;
pub(super) const MOMENT: Colour = Colour::VERMILION;
pub(super) const RIM: Stroke = Stroke { colour: Colour::MUTED, width: 0.6, dash: None };
pub(super) const CLEARANCE: Stroke = Stroke { colour: Colour::GREY, width: 0.5, dash: Some([2.0, 2.0]) };
pub(super) const GRID: Stroke = Stroke { colour: Colour::GREEN, width: 0.6, dash: Some([5.0, 1.5]) };

/// The end of a cylinder that the reader sees, and the other.
fn ends(cylinder: &Cylinder, position: Vector, view: &View) -> [Vector; 2] {
    let sign = if dot(cylinder.axis, view.toward) < 0.0 { -0.5 } else { 0.5 };
    [sign, -sign].map(|by| along(position, by * cylinder.length, cylinder.axis))
}

/// The outline of a source on the page.
pub(super) fn outline(source: &FieldSource, view: &View) -> Vec<Point> {
    match &source.body {
        SourceBody::Dipole => {
            let [x, y] = view.place(source.position);
            (0..CORNERS)
                .map(|k| TAU * k as f64 / CORNERS as f64)
                .map(|angle| [x + DOT * angle.cos(), y + DOT * angle.sin()])
                .collect()
        }
        SourceBody::Cylinder(cylinder) | SourceBody::Coil(cylinder) => {
            let ends = ends(cylinder, source.position, view);
            let rims = ends.into_iter().flat_map(|end| circle(CORNERS, end, cylinder.axis, 0.5 * cylinder.diameter));
            hull(rims.map(|point| view.place(point)).collect())
        }
        SourceBody::Cuboid(cuboid) => {
            let corners = cuboid.faces(view.toward).into_iter().flatten();
            hull(corners.map(|corner| view.place(along(source.position, 1.0, corner))).collect())
        }
    }
}

/// What a source covers of the page, with the arrow of its moment.
pub(super) fn marks(source: &FieldSource, view: &View, extent: f64) -> Vec<Point> {
    let moment = moment_arrow(source, extent).into_iter();
    let ends = moment.flat_map(|moment| [-0.5, 0.5].map(|by| view.place(along(source.position, by, moment))));
    outline(source, view).into_iter().chain(ends).collect()
}

/// As many corners of an outline for any view and place.
pub(super) fn even_outline(source: &FieldSource, view: &View) -> Vec<Point> {
    let corners = outline(source, view);
    let farthest = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / CORNERS as f64).sin_cos();
        let reach = |[x, y]: &Point| x * cos + y * sin;
        corners.iter().copied().max_by(|a, b| reach(a).total_cmp(&reach(b)))
    };
    (0..=CORNERS).filter_map(farthest).collect()
}

/// The rim of the end that the reader sees, or a share of it, or the faces of a cuboid; nothing where there is none or it is seen from
/// the side.
pub(super) fn fronts(source: &FieldSource, view: &View, share: f64) -> Vec<Vec<Point>> {
    let placed = |points: Vec<Vector>| points.into_iter().map(|point| view.place(point)).collect();
    match &source.body {
        SourceBody::Dipole => Vec::new(),
        SourceBody::Cuboid(cuboid) => {
            let faces = cuboid.faces(view.toward).into_iter();
            faces.map(|face| placed(face.map(|corner| along(source.position, 1.0, corner)).into())).collect()
        }
        SourceBody::Cylinder(cylinder) | SourceBody::Coil(cylinder) => {
            let [front, _] = ends(cylinder, source.position, view);
            let rim = circle(CORNERS, front, cylinder.axis, 0.5 * share * cylinder.diameter);
            let is_open = dot(cylinder.axis, view.toward).abs() > 0.02;
            is_open.then(|| placed(rim)).into_iter().collect()
        }
    }
}

/// Of a source's body.
pub(super) fn colour(source: &FieldSource) -> Colour {
    if source.is_coil() { Surroundings::COIL_COLOUR } else { Surroundings::MAGNET_COLOUR }
}

/// Draws a source with the arrow of its moment; `extent` is that of the view (m).
pub(super) fn draw(canvas: &mut Canvas, view: &View, source: &FieldSource, extent: f64) {
    let fill = colour(source);
    canvas.polygon(outline(source, view), Some(fill.with_alpha(0.75)), Some(RIM));
    for (k, face) in fronts(source, view, 1.0).into_iter().enumerate() {
        let light = if k == 0 { fill.mix(Colour::WHITE, 0.35) } else { fill };
        canvas.polygon(face, Some(light.with_alpha(0.75)), Some(RIM));
    }
    for bore in fronts(source, view, BORE).into_iter().filter(|_| source.is_coil()) {
        canvas.polygon(bore, Some(Colour::WHITE.with_alpha(0.8)), Some(RIM));
    }
    if let Some(moment) = moment_arrow(source, extent) {
        let from = along(source.position, -0.5, moment);
        arrow(canvas, view, from, moment, MOMENT, 1.3);
    }
}

/// The arrow of a source's moment, about its middle (m).
pub(super) fn moment_arrow(source: &FieldSource, extent: f64) -> Option<Vector> {
    let is_known = !(source.is_coil() && source.is_swept);
    let moment = Some(source.moment).filter(|moment| is_known && nonzero(*moment))?;
    let direction = scaled(moment, 1.0);
    let across = match &source.body {
        SourceBody::Dipole => 0.0,
        SourceBody::Cylinder(body) | SourceBody::Coil(body) => {
            let share = dot(direction, body.axis).abs();
            body.length * share + body.diameter * (1.0 - share * share).max(0.0).sqrt()
        }
        SourceBody::Cuboid(body) => body.extent(direction),
    };
    Some(scaled(moment, (ARROW * across).max(LEAST_ARROW * extent)))
}

/// Draws how near a rod may come: circles about the dipoles of a magnet, where none lies in another.
pub(super) fn draw_clearance(canvas: &mut Canvas, view: &View, source: &FieldSource) {
    let Some(clearance) = source.clearance else { return };
    let radius = view.scale * clearance;
    let centres: Vec<Point> = source.dipoles.iter().map(|dipole| view.place(*dipole)).collect();
    for (k, [x, y]) in centres.iter().enumerate() {
        let at = |k: usize| {
            let angle = TAU * k as f64 / (3 * CORNERS) as f64;
            [x + radius * angle.cos(), y + radius * angle.sin()]
        };
        let is_free = |[x, y]: &Point| {
            let others = centres.iter().enumerate().filter(|(other, _)| *other != k);
            // Of circles in the same place the first is drawn.
            others.into_iter().all(|(other, [a, b])| {
                let away = (x - a).hypot(y - b);
                away > radius * (1.0 + 1e-9) || (other > k && away > radius * (1.0 - 1e-9))
            })
        };
        let points: Vec<Point> = (0..=3 * CORNERS).map(at).collect();
        for arc in points.split(|point| !is_free(point)).filter(|arc| arc.len() > 1) {
            canvas.clipped_line(arc, CLEARANCE, view.rect);
        }
    }
}

/// Draws the edges of a grid's box.
pub(super) fn draw_grid(canvas: &mut Canvas, view: &View, grid: &GridBox) {
    let corner = |index: usize| -> Vector { std::array::from_fn(|k| grid.limits[k][index >> k & 1]) };
    for from in 0..8usize {
        for axis in (0..3).filter(|axis| from >> axis & 1 == 0) {
            let (a, b) = (corner(from), corner(from | 1 << axis));
            canvas.clipped_line([a, b].map(|point| view.place(point)), GRID, view.rect);
        }
    }
}
