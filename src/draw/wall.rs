//! A wall in the four views of a figure: its cut with each panel's plane, hatched; in space a patch or a net of lines.

use super::canvas::{Canvas, Point, Stroke};
use super::colour::Colour;
use super::legend::Entry;
use super::samples::{arrow_entry, force_words};
use super::symbols::hull;
use super::ticks::compact;
use super::vectors::{along, bounds, circle, cross, distance, dot, middle, minus, nonzero, norm, plus, scaled, widest};
use super::views::View;
use crate::model::{RodWall, Surface, Vector};
use std::f64::consts::TAU;

/// Points of a circle or an ellipse.
const CORNERS: usize = 720;
/// Between the strokes of the hatching, and their length (pt).
const SPACING: f64 = 4.5;
const STROKE: f64 = 4.5;
/// A cylinder whose axis lies in a panel's plane but for this is cut in two lines.
const PARALLEL: f64 = 0.02;
/// A plane has no line in a panel to which it is inclined by less: the square of the sine of some 20 degrees.
const INCLINED: f64 = 0.12;
/// Lines of the net around a curved wall.
const NET: usize = 12;
const LINE: Stroke = Stroke { colour: DrawnWall::COLOUR, width: 1.0, dash: None };
const HATCHING: Stroke = Stroke { colour: DrawnWall::COLOUR, width: 0.5, dash: None };

/// A wall beside a rod.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnWall {
    /// Where it is.
    pub wall: RodWall,
    /// The force of the wall on the tip; `None` where it does not press, and where several rods are drawn.
    pub press: Option<WallPress>,
}

/// The force of a wall on the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallPress {
    /// World frame (N).
    pub force: Vector,
    /// From the wall to where the rod is.
    pub normal: Vector,
    /// Coefficient of friction of a wall that holds the tip; `None` where the tip slides or none is given.
    pub friction: Option<f64>,
    /// The coefficient that holding the tip takes; `None` where the wall does not press.
    pub friction_ratio: Option<f64>,
}

impl DrawnWall {
    /// Colour of a wall and of its hatching.
    pub const COLOUR: Colour = Colour::hex(0x8a5a44);
    /// Colour of the arrow and the cone of a contact force.
    pub const FORCE_COLOUR: Colour = Colour::hex(0x7b3294);

    /// Points that the limits of a figure should hold besides a rod with this tip and extent (m): the nearest point of the wall, and
    /// a sphere that is no larger than the rod.
    pub(super) fn marks(&self, tip: Vector, extent: f64) -> Vec<Vector> {
        let RodWall { position, radius, kind, .. } = self.wall;
        let foot = self.wall.foot(tip);
        let mut marks = Vec::new();
        if distance(foot, tip) <= extent {
            marks.push(foot);
        }
        if kind.surface == Surface::Sphere && 2.0 * radius <= extent {
            marks.extend([-radius, radius].map(|by| position.map(|x| x + by)));
        }
        marks
    }
}

impl WallPress {
    /// The arrow of the force, so long (m), and where it begins: an arrow that pushes ends at the tip, one that pulls begins there.
    pub(super) fn arrow(&self, tip: Vector, length: f64) -> (Vector, Vector) {
        let vector = scaled(self.force, length);
        let from = if self.pulls() { tip } else { minus(tip, vector) };
        (from, vector)
    }

    /// Whether it draws the tip towards the wall.
    pub(super) fn pulls(&self) -> bool {
        dot(self.force, self.normal) < 0.0
    }
}

/// A wall in one figure.
pub(super) struct WallScenery<'a> {
    drawn: &'a DrawnWall,
    /// In the planes of the cuts (m), and in words.
    through: Vector,
    place: &'static str,
    limits: [[f64; 2]; 3],
}

impl<'a> WallScenery<'a> {
    /// Cut by planes through the tip, in views with these limits (m).
    pub(super) fn at_tip(drawn: &'a DrawnWall, tip: Vector, limits: [[f64; 2]; 3]) -> WallScenery<'a> {
        WallScenery { drawn, through: tip, place: "the tip", limits }
    }

    /// Cut by planes through the middle of several tips.
    pub(super) fn at_tips(drawn: &'a DrawnWall, tips: &[Vector], limits: [[f64; 2]; 3]) -> WallScenery<'a> {
        let through = middle(bounds(tips.iter().copied()));
        WallScenery { drawn, through, place: "the middle of the tips", limits }
    }

    /// Cut by a plane of voxels through this point.
    pub(super) fn in_plane(drawn: &'a DrawnWall, through: Vector) -> WallScenery<'a> {
        WallScenery { drawn, through, place: "each slice, and the middle of all voxels", limits: [[0.0; 2]; 3] }
    }

    /// Draws what lies behind the rod.
    pub(super) fn draw_behind(&self, canvas: &mut Canvas, view: &View) {
        if view.axes.is_none() {
            return self.draw_in_space(canvas, view);
        }
        for line in self.cut(view) {
            self.hatch(canvas, view, &line);
            let line: Vec<Point> = line.iter().map(|point| view.place(*point)).collect();
            canvas.clipped_line(line, LINE, view.rect);
        }
    }

    /// Draws the ball at the tip, and behind the arrow of the force what friction holds: a cone with its point at the tip, as long as
    /// the arrow may be (m).
    pub(super) fn draw_tip(&self, canvas: &mut Canvas, view: &View, tip: Vector, length: f64) {
        let radius = view.scale * self.drawn.wall.tip_radius;
        if radius > 0.0 {
            canvas.circle(view.place(tip), radius, Some(DrawnWall::COLOUR.with_alpha(0.15)), Some(HATCHING));
        }
        let Some(WallPress { normal, friction: Some(friction), .. }) = self.drawn.press else { return };
        let half = friction.atan();
        let axis = normal.map(|x| -x);
        let base = along(tip, length * half.cos(), axis);
        let rim = circle(CORNERS, base, axis, length * half.sin()).into_iter().step_by(CORNERS / 60);
        let outline = hull(rim.chain([tip]).map(|point| view.place(point)).collect());
        let (fill, rim) = (DrawnWall::FORCE_COLOUR.with_alpha(0.14), Stroke::new(DrawnWall::FORCE_COLOUR, 0.5));
        canvas.polygon(outline, Some(fill), Some(rim));
    }

    /// Entries of the legend for the wall, its force and its friction.
    pub(super) fn entries(&self) -> Vec<Entry> {
        let stiffness = match self.drawn.wall.kind.yields {
            true => format!(" of {} N/m", compact(1.0 / self.drawn.wall.compliance)),
            false => String::new(),
        };
        let mut entries = vec![Entry::new(format!("wall{stiffness}, cut through {}", self.place), |canvas, rect| {
            let y = rect.centre()[1];
            for k in 0..4 {
                let x = rect.left + 3.0 + 4.0 * f64::from(k);
                canvas.line([[x, y], [x - 2.5, y + 3.0]], HATCHING);
            }
            canvas.line([[rect.left + 1.0, y], [rect.right() - 1.0, y]], LINE);
        })];
        let Some(press) = self.drawn.press.filter(|press| nonzero(press.force)) else { return entries };
        let words = if press.pulls() { "force of the wall f, pulls" } else { "force of the wall f" };
        entries.push(arrow_entry(force_words(words, norm(press.force)), DrawnWall::FORCE_COLOUR));
        if let Some(friction) = press.friction {
            let takes = match press.friction_ratio {
                Some(ratio) => format!("holding takes {}", compact(ratio)),
                None => "which holds no tip that pulls".into(),
            };
            let words = format!("cone of friction {}; {takes}", compact(friction));
            entries.push(Entry::new(words, |canvas, rect| {
                let [x, y] = rect.centre();
                let cone = [[x - 6.0, y], [x + 6.0, y - 3.2], [x + 6.0, y + 3.2]];
                let (fill, rim) = (DrawnWall::FORCE_COLOUR.with_alpha(0.14), DrawnWall::FORCE_COLOUR);
                canvas.polygon(cone, Some(fill), Some(Stroke::new(rim, 0.5)));
            }));
        }
        entries
    }

    /// Points of the wall as it is drawn in a flat view; labels and arrows are placed away from them.
    pub(super) fn points(&self, view: &View) -> Vec<Point> {
        if view.axes.is_none() {
            return Vec::new();
        }
        let place = |point: Vector| view.place(point);
        self.cut(view).iter().flat_map(|line| evenly(line, 8.0 / view.scale)).map(place).collect()
    }

    /// Longer than any line across a panel (m).
    fn span(&self, view: &View) -> f64 {
        2.0 * (view.rect.width + view.rect.height) / view.scale
    }

    /// The wall's cut with the plane of a flat view: lines of points (m).
    fn cut(&self, view: &View) -> Vec<Vec<Vector>> {
        let RodWall { kind, position, axis, radius, .. } = self.drawn.wall;
        let (t, q) = (view.toward, self.through);
        let to_panel = |point: Vector| along(point, dot(t, minus(q, point)), t);
        let span = self.span(view);
        let line = |at: Vector, direction: Vector| vec![along(at, -span, direction), along(at, span, direction)];
        // Half of what the plane cuts out of a sphere, or of a cylinder along its axis.
        let half = (radius * radius - dot(t, minus(position, q)).powi(2)).max(0.0).sqrt();
        let slope = dot(axis, t);
        match kind.surface {
            Surface::Plane => {
                let within = along(axis, -slope, t);
                let share = dot(within, within);
                if share < INCLINED {
                    return Vec::new();
                }
                let at = along(q, dot(axis, minus(position, q)) / share, within);
                vec![line(at, scaled(cross(axis, t), 1.0))]
            }
            Surface::Sphere if half > 0.0 => vec![closed(circle(CORNERS, to_panel(position), t, half))],
            Surface::Cylinder if slope.abs() < PARALLEL && half > 0.0 => {
                let middle = to_panel(along(position, dot(axis, minus(q, position)), axis));
                let side = scaled(cross(axis, t), half);
                [plus(middle, side), minus(middle, side)].map(|at| line(at, axis)).into()
            }
            Surface::Cylinder if slope.abs() >= PARALLEL => {
                let ring = circle(CORNERS, position, axis, radius);
                vec![closed(ring.into_iter().map(|p| along(p, dot(t, minus(q, p)) / slope, axis)).collect())]
            }
            Surface::Sphere | Surface::Cylinder => Vec::new(),
        }
    }

    /// Strokes on the side of the wall where the rod is not.
    fn hatch(&self, canvas: &mut Canvas, view: &View, line: &[Vector]) {
        let points = evenly(line, SPACING / view.scale);
        for pair in points.windows(2) {
            let at = view.place(pair[0]);
            if !view.rect.contains(at) {
                continue;
            }
            let into = unit(view.along(self.drawn.wall.gap(pair[0]).normal.map(|x| -x)));
            let forth = unit(view.along(minus(pair[1], pair[0])));
            let [x, y] = unit([into[0] + 0.8 * forth[0], into[1] + 0.8 * forth[1]]);
            canvas.clipped_line([at, [at[0] + STROKE * x, at[1] + STROKE * y]], HATCHING, view.rect);
        }
    }

    fn draw_in_space(&self, canvas: &mut Canvas, view: &View) {
        let RodWall { kind, position, axis, radius, .. } = self.drawn.wall;
        let net = Stroke::new(DrawnWall::COLOUR.with_alpha(0.55), 0.45);
        match kind.surface {
            Surface::Plane => {
                let patch: Vec<Point> = self.patch().into_iter().map(|point| view.place(point)).collect();
                if patch.len() > 2 {
                    canvas.polygon(hull(patch), Some(DrawnWall::COLOUR.with_alpha(0.16)), Some(net));
                }
            }
            Surface::Sphere => {
                for k in 0..NET / 2 {
                    let angle = TAU * k as f64 / NET as f64;
                    let meridian = circle(CORNERS, position, [angle.cos(), angle.sin(), 0.0], radius);
                    self.draw_within(canvas, view, closed(meridian), net);
                }
                for k in 1..NET / 2 {
                    let (sin, cos) = (TAU * k as f64 / NET as f64).sin_cos();
                    let up = along(position, radius * cos, [0.0, 0.0, 1.0]);
                    self.draw_within(canvas, view, closed(circle(CORNERS, up, [0.0, 0.0, 1.0], radius * sin)), net);
                }
            }
            Surface::Cylinder => {
                let extent = widest(self.limits);
                let middle = along(position, dot(axis, minus(self.through, position)), axis);
                for point in circle(CORNERS, middle, axis, radius).into_iter().step_by(CORNERS / NET) {
                    let line = [-2.0, 2.0].map(|by| along(point, by * extent, axis));
                    self.draw_within(canvas, view, evenly(&line, extent / 200.0), net);
                }
                let step = (0.5 * radius).max(0.1 * extent);
                let count = (2.0 * extent / step) as i32;
                for k in -count..=count {
                    let ring = circle(CORNERS, along(middle, f64::from(k) * step, axis), axis, radius);
                    self.draw_within(canvas, view, closed(ring), net);
                }
            }
        }
    }

    /// Corners of what the limits cut out of a plane (m).
    fn patch(&self) -> Vec<Vector> {
        let RodWall { position, axis, .. } = self.drawn.wall;
        let corner = |index: usize| -> Vector { std::array::from_fn(|k| self.limits[k][index >> k & 1]) };
        let mut corners = Vec::new();
        for from in 0..8usize {
            for to in (0..3).filter(|k| from >> k & 1 == 0).map(|k| from | 1 << k) {
                let (a, b) = (corner(from), corner(to));
                let [one, other] = [a, b].map(|point| dot(axis, minus(point, position)));
                if one * other <= 0.0 && one != other {
                    corners.push(along(a, one / (one - other), minus(b, a)));
                }
            }
        }
        corners
    }

    /// Draws what of a line lies within the limits.
    fn draw_within(&self, canvas: &mut Canvas, view: &View, line: Vec<Vector>, stroke: Stroke) {
        let is_inside = |point: &Vector| {
            point.iter().zip(self.limits).all(|(x, [low, high])| (low - 1e-12..=high + 1e-12).contains(x))
        };
        for run in line.split(|point| !is_inside(point)).filter(|run| run.len() > 1) {
            canvas.line(run.iter().map(|point| view.place(*point)).collect::<Vec<Point>>(), stroke);
        }
    }
}

fn closed(mut points: Vec<Vector>) -> Vec<Vector> {
    points.extend(points.first().copied());
    points
}

/// Points along a line, so far apart (m).
fn evenly(line: &[Vector], step: f64) -> Vec<Vector> {
    let mut points = Vec::new();
    let mut next = 0.0;
    for pair in line.windows(2) {
        let length = distance(pair[0], pair[1]);
        while next < length {
            points.push(along(pair[0], next / length, minus(pair[1], pair[0])));
            next += step;
        }
        next -= length;
    }
    points
}

/// Scales a vector to length 1; a vector of length 0 stays as it is.
fn unit([x, y]: Point) -> Point {
    let size = x.hypot(y);
    if size > 0.0 { [x / size, y / size] } else { [0.0; 2] }
}
