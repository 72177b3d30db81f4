//! Marks in space: arrows that also read when they point at the reader, and the clamp.

use super::canvas::{Canvas, Point, Stroke};
use super::colour::Colour;
use super::vectors::{across, dot, nonzero, norm, scaled};
use super::views::View;
use crate::model::Vector;

/// Draws an arrow from a point in space along a vector (m); towards the reader as a circled dot, away as a circled
/// cross. Returns the place of its head.
pub(super) fn arrow(
    canvas: &mut Canvas,
    view: &View,
    from: Vector,
    vector: Vector,
    colour: Colour,
    width: f64,
) -> Point {
    let [dx, dy] = view.along(vector);
    let length = dx.hypot(dy);
    let whole = view.scale * norm(vector);
    let start = view.place(from);
    if whole == 0.0 {
        return start;
    }
    if length < 0.2 * whole {
        end_on(canvas, start, dot(vector, view.toward) > 0.0, colour, width);
        return start;
    }
    flat_arrow(canvas, start, [start[0] + dx, start[1] + dy], colour, width)
}

/// Draws an arrow on the page.
pub(super) fn flat_arrow(canvas: &mut Canvas, start: Point, end: Point, colour: Colour, width: f64) -> Point {
    let [dx, dy] = [end[0] - start[0], end[1] - start[1]];
    let length = dx.hypot(dy).max(1e-9);
    let [ux, uy] = [dx / length, dy / length];
    let head = (3.0 + 2.2 * width).min(0.6 * length);
    let half = 0.38 * head;
    let neck = [end[0] - 0.85 * head * ux, end[1] - 0.85 * head * uy];
    let back = [end[0] - head * ux, end[1] - head * uy];
    let tips = [end, [back[0] - half * uy, back[1] + half * ux], neck, [back[0] + half * uy, back[1] - half * ux]];
    canvas.line([start, neck], Stroke::new(Colour::WHITE, width + 0.7));
    canvas.line([start, neck], Stroke::new(colour, width));
    canvas.polygon(tips, Some(colour), Some(Stroke::new(colour, 0.3)));
    end
}

/// An arrow seen along its axis.
pub(super) fn end_on(canvas: &mut Canvas, [x, y]: Point, toward: bool, colour: Colour, width: f64) {
    let radius = 2.4 + width;
    canvas.circle([x, y], radius, Some(Colour::WHITE), Some(Stroke::new(colour, 0.8)));
    if toward {
        canvas.circle([x, y], 0.33 * radius, Some(colour), None);
    } else {
        let r = 0.6 * radius;
        canvas.line([[x - r, y - r], [x + r, y + r]], Stroke::new(colour, 0.8));
        canvas.line([[x - r, y + r], [x + r, y - r]], Stroke::new(colour, 0.8));
    }
}

/// Draws the plate that holds the rod's base: square, behind the base, across the rod's direction.
pub(super) fn clamp(canvas: &mut Canvas, view: &View, base: Vector, direction: Vector, size: f64) {
    let along = if nonzero(direction) { scaled(direction, 1.0) } else { [0.0, 0.0, 1.0] };
    let [side, other] = across(along);
    let corner = |a: f64, b: f64, c: f64| -> Point {
        view.place(std::array::from_fn(|k| {
            base[k] + size * (0.5 * a * side[k] + 0.5 * b * other[k] - 0.22 * c * along[k])
        }))
    };
    let mut corners = Vec::new();
    for a in [-1.0, 1.0] {
        for b in [-1.0, 1.0] {
            corners.extend([corner(a, b, 0.0), corner(a, b, 1.0)]);
        }
    }
    let (fill, rim) = (Colour::hex(0xc9c9c9), Stroke::new(Colour::MUTED, 0.6));
    canvas.polygon(hull(corners), Some(fill), Some(rim));
    if dot(along, view.toward) > 0.05 {
        let front = [corner(-1.0, -1.0, 0.0), corner(1.0, -1.0, 0.0), corner(1.0, 1.0, 0.0), corner(-1.0, 1.0, 0.0)];
        canvas.polygon(front, Some(Colour::hex(0xdcdcdc)), Some(rim));
    }
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
pub(super) fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |a: Point, b: Point, c: Point| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let chain = |points: &mut dyn Iterator<Item = &Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for point in points {
            while chain.len() > 1 && turn(chain[chain.len() - 2], chain[chain.len() - 1], *point) <= 0.0 {
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter());
    hull.extend(chain(&mut points.iter().rev()));
    hull
}
