//! The shape of one rod in three projections and in space, with its coils' dipoles, the field and the tip.

use super::canvas::{Align, Canvas, NORMAL, Point, Rect, Stroke, Text};
use super::colour::Colour;
use super::field::{Scenery, Surroundings, widened};
use super::legend::Entry;
use super::samples::{arrow_entry, force_words, line_entry};
use super::symbols::{arrow, clamp};
use super::ticks::compact;
use super::vectors::{bounds, minus, nonzero, norm, plus, scaled, widest};
use super::views::{FourViews, View};
use super::wall::{DrawnWall, WallScenery};
use super::{Figure, ReportError, TWO_COLUMNS};
use crate::model::{Segment, SegmentKind, Vector};

const FIGURE: &str = "the rod's shape";
const TOP: f64 = 30.0;
const MARGIN: f64 = 14.0;
/// Lengths of arrows and symbols over the widest extent of the rod.
const FIELD: f64 = 0.16;
const DIPOLE: f64 = 0.20;
const FORCE: f64 = 0.18;
const FRAME: f64 = 0.10;
const PLATE: f64 = 0.10;

/// What a stretch of a rod is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StretchKind {
    /// It bends.
    Flexible,
    /// It does not bend.
    Rigid,
    /// It does not bend and carries a coil.
    Coil,
    /// It does not bend and is a magnet.
    Magnet,
}

impl StretchKind {
    /// What a segment is drawn as.
    pub fn of(segment: &Segment) -> StretchKind {
        match &segment.kind {
            SegmentKind::Flexible(_) => StretchKind::Flexible,
            SegmentKind::Rigid(rigid) if rigid.coil.is_some() => StretchKind::Coil,
            SegmentKind::Rigid(rigid) if rigid.is_magnet() => StretchKind::Magnet,
            SegmentKind::Rigid(_) => StretchKind::Rigid,
        }
    }

    /// Whether it has a dipole moment.
    pub fn has_dipole(self) -> bool {
        matches!(self, StretchKind::Coil | StretchKind::Magnet)
    }

    /// In a word: `flexible`, `rigid`, `coil`, `magnet`.
    pub fn name(self) -> &'static str {
        match self {
            StretchKind::Flexible => "flexible",
            StretchKind::Rigid => "rigid",
            StretchKind::Coil => "coil",
            StretchKind::Magnet => "magnet",
        }
    }
}

/// One segment of the rod.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Of the segment.
    pub name: String,
    /// What it is drawn as.
    pub kind: StretchKind,
    /// Along the centreline, base to tip (m).
    pub points: Vec<Vector>,
    /// Of the coil, world frame (A·m²).
    pub dipole: Option<Vector>,
}

/// A force inside of the rod.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceAt {
    /// For the legend.
    pub name: String,
    /// Where it acts (m).
    pub point: Vector,
    /// World frame (N).
    pub force: Vector,
}

/// A rod and what acts on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RodShape {
    /// Above the panels; empty for none.
    pub title: String,
    /// Base to tip.
    pub stretches: Vec<Stretch>,
    /// Tip orientation, body to world, by rows; columns are the directors.
    pub tip_rotation: Option<[[f64; 3]; 3]>,
    /// Uniform, world frame (T).
    pub flux_density: Option<Vector>,
    /// What makes the field vary.
    pub surroundings: Option<Surroundings>,
    /// The wall of the scene; `None`: it has none.
    pub wall: Option<DrawnWall>,
    /// World frame (N).
    pub tip_force: Option<Vector>,
    /// At points between base and tip.
    pub inner_loads: Vec<ForceAt>,
    /// Centreline at rest (m).
    pub rest: Option<Vec<Vector>>,
}

impl RodShape {
    /// Of stretches that bend.
    pub const FLEXIBLE_COLOUR: Colour = Colour::hex(0x333333);
    /// Of stretches that do not bend.
    pub const RIGID_COLOUR: Colour = Colour::GREY;
    /// Of coils.
    pub const COIL_COLOUR: Colour = Colour::ORANGE;
    /// Of dipole moments.
    pub const DIPOLE_COLOUR: Colour = Colour::VERMILION;
    /// Of the field.
    pub const FIELD_COLOUR: Colour = Colour::BLUE;
    /// Of forces.
    pub const FORCE_COLOUR: Colour = Colour::GREEN;
    /// Of the directors of the tip.
    pub const FRAME_COLOURS: [Colour; 3] = [Colour::hex(0xb03060), Colour::hex(0x4daf4a), Colour::hex(0x3b6fb6)];
}

impl Figure for RodShape {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let centreline: Vec<Vector> = self.stretches.iter().flat_map(|stretch| finite(&stretch.points)).collect();
        let (Some(&base), Some(&tip)) = (centreline.first(), centreline.last()) else {
            let reason = "no point of the centreline is finite".into();
            return Err(ReportError::Empty { figure: FIGURE, reason });
        };
        let direction =
            centreline.iter().find(|point| **point != base).map_or([0.0, 0.0, 1.0], |next| minus(*next, base));
        let rest = finite(self.rest.as_deref().unwrap_or_default());
        let mut marks = centreline.clone();
        marks.extend(&rest);
        let widest = widest(bounds(marks.iter().copied()));
        let arrows = self.arrows(tip, widest);
        marks.extend(arrows.iter().flat_map(|arrow| [arrow.from, plus(arrow.from, arrow.vector)]));
        marks.extend(self.wall.iter().flat_map(|wall| wall.marks(tip, widest)));
        let sources = self.surroundings.iter().flat_map(|surroundings| &surroundings.sources);
        let views = FourViews::new(widened(sources, bounds(marks)), TWO_COLUMNS, TOP, MARGIN);
        let scenery =
            self.surroundings.as_ref().map(|around| Scenery::of_rod(around, centreline.clone(), views.limits));

        let wall = self.wall.as_ref().map(|wall| WallScenery::at_tip(wall, tip, views.limits));

        let mut entries = self.entries(!rest.is_empty());
        entries.extend(wall.iter().flat_map(WallScenery::entries));
        entries.extend(scenery.iter().flat_map(Scenery::entries));
        let mut canvas = views.page(&self.title, &entries);
        for view in &views.views {
            scenery.iter().for_each(|scenery| scenery.draw_behind(&mut canvas, view));
            wall.iter().for_each(|wall| wall.draw_behind(&mut canvas, view));
            if view.axes.is_none() {
                let floor = views.limits[2][0];
                let shadow: Vec<Point> = centreline.iter().map(|p| view.place([p[0], p[1], floor])).collect();
                canvas.line(shadow, Stroke::new(Colour::hex(0xcfcfcf), 1.6));
            }
            if rest.len() > 1 {
                let line: Vec<Point> = rest.iter().map(|point| view.place(*point)).collect();
                canvas.line(line, Stroke { dash: Some([3.0, 2.5]), ..Stroke::new(Colour::GREY, 0.9) });
            }
            clamp(&mut canvas, view, base, direction, PLATE * widest);
            self.draw_stretches(&mut canvas, view);
            wall.iter().for_each(|wall| wall.draw_tip(&mut canvas, view, tip, FORCE * widest));
            let mut labels: Vec<Text> = Vec::new();
            for mark in &arrows {
                let head = arrow(&mut canvas, view, mark.from, mark.vector, mark.colour, mark.width);
                if view.axes.is_none() {
                    labels.push(match mark.ends_at_tip {
                        true => {
                            let back = mark.vector.map(|x| -x);
                            beside(mark.label, view, back, view.place(mark.from), mark.colour, &labels)
                        }
                        false => beside(mark.label, view, mark.vector, head, mark.colour, &labels),
                    });
                }
            }
            let mut letters: Vec<Point> = labels.iter().map(|label| label.at).collect();
            labels.into_iter().for_each(|label| canvas.text(label));
            let mut points = occupied(view, &centreline, &rest, &arrows);
            points.extend(scenery.iter().flat_map(|scenery| scenery.points(view)));
            points.extend(wall.iter().flat_map(|wall| wall.points(view)));
            // The plate of the base.
            let [x, y] = view.place(base);
            let half = 0.5 * PLATE * widest * view.scale;
            points.extend(
                (0..25).map(|k| [x + half * f64::from(k % 5 - 2) / 2.0, y + half * f64::from(k / 5 - 2) / 2.0]),
            );
            if let Some(flux_density) = self.flux_density.filter(|b| nonzero(*b)) {
                let vector = scaled(flux_density, FIELD * widest);
                let from = field_place(&views, view, vector, &points);
                let head = arrow(&mut canvas, view, from, vector, RodShape::FIELD_COLOUR, 1.5);
                let label = beside(self.field_letter(), view, vector, head, RodShape::FIELD_COLOUR, &[]);
                letters.push(label.at);
                points.extend([view.place(from), view.place(plus(from, vector))]);
                canvas.text(label);
            }
            scenery.iter().for_each(|scenery| scenery.draw_words(&mut canvas, view, points.clone(), &letters));
        }
        views.draw_legend(&mut canvas, &entries);
        Ok(canvas)
    }
}

/// An arrow at the rod (m).
struct Mark {
    from: Vector,
    vector: Vector,
    colour: Colour,
    width: f64,
    label: &'static str,
    /// Its letter stands where it begins.
    ends_at_tip: bool,
}

impl RodShape {
    fn arrows(&self, tip: Vector, widest: f64) -> Vec<Mark> {
        let mut arrows = Vec::new();
        let directors = self.tip_rotation.filter(|rows| rows.iter().flatten().all(|x| x.is_finite()));
        if let Some(rows) = directors {
            for (k, label) in ["d₁", "d₂", "d₃"].into_iter().enumerate() {
                let vector = rows.map(|row| FRAME * widest * row[k]);
                arrows.push(Mark {
                    from: tip,
                    vector,
                    colour: RodShape::FRAME_COLOURS[k],
                    width: 0.9,
                    label,
                    ends_at_tip: false,
                });
            }
        }
        let largest = self.largest_dipole();
        for stretch in &self.stretches {
            let points = finite(&stretch.points);
            if let (Some(dipole), false) = (stretch.dipole.filter(|m| nonzero(*m)), points.is_empty()) {
                let (a, b) = (points[0], points[points.len() - 1]);
                let from = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
                let vector = dipole.map(|x| DIPOLE * widest * x / largest);
                arrows.push(Mark {
                    from,
                    vector,
                    colour: RodShape::DIPOLE_COLOUR,
                    width: 1.5,
                    label: "µ",
                    ends_at_tip: false,
                });
            }
        }
        let inner = self.inner_loads.iter().map(|inner| (inner.point, inner.force));
        let forces: Vec<(Vector, Vector)> = self.tip_force.map(|force| (tip, force)).into_iter().chain(inner).collect();
        let press = self.wall.as_ref().and_then(|wall| wall.press).filter(|press| nonzero(press.force));
        let sizes = forces.iter().map(|(_, force)| norm(*force)).chain(press.map(|press| norm(press.force)));
        let largest = sizes.fold(0.0, f64::max);
        for (from, force) in forces.into_iter().filter(|(_, force)| nonzero(*force)) {
            let vector = scaled(force, FORCE * widest * norm(force) / largest);
            let (colour, label) = (RodShape::FORCE_COLOUR, "F");
            arrows.push(Mark { from, vector, colour, width: 1.5, label, ends_at_tip: false });
        }
        if let Some(press) = press {
            let (from, vector) = press.arrow(tip, FORCE * widest * norm(press.force) / largest);
            let colour = DrawnWall::FORCE_COLOUR;
            arrows.push(Mark { from, vector, colour, width: 1.5, label: "f", ends_at_tip: !press.pulls() });
        }
        arrows
    }

    /// The uniform field is a part of the whole where there are sources.
    fn field_letter(&self) -> &'static str {
        if self.surroundings.is_some() { "B₀" } else { "B" }
    }

    /// In A·m²
    fn largest_dipole(&self) -> f64 {
        self.stretches.iter().filter_map(|stretch| stretch.dipole).filter(|m| nonzero(*m)).map(norm).fold(0.0, f64::max)
    }

    fn draw_stretches(&self, canvas: &mut Canvas, view: &View) {
        let mut nearest_last: Vec<(&Stretch, Vec<Vector>)> =
            self.stretches.iter().map(|stretch| (stretch, finite(&stretch.points))).collect();
        nearest_last.retain(|(_, points)| !points.is_empty());
        let depth = |points: &[Vector]| points.iter().map(|p| view.depth(*p)).sum::<f64>() / points.len() as f64;
        nearest_last.sort_by(|a, b| depth(&a.1).total_cmp(&depth(&b.1)));
        for (stretch, points) in nearest_last {
            let line: Vec<Point> = points.iter().map(|point| view.place(*point)).collect();
            let (colour, width) = style(stretch.kind);
            if stretch.kind != StretchKind::Flexible {
                canvas.line(line.clone(), Stroke::new(colour.mix(Colour::BLACK, 0.35), width + 0.9));
            }
            canvas.line(line, Stroke::new(colour, width));
        }
    }

    fn entries(&self, rest: bool) -> Vec<Entry> {
        let mut entries = Vec::new();
        let kinds = [
            (StretchKind::Flexible, "flexible"),
            (StretchKind::Rigid, "rigid"),
            (StretchKind::Coil, "coil (rigid)"),
            (StretchKind::Magnet, "magnet (rigid)"),
        ];
        for (kind, words) in kinds {
            if self.stretches.iter().any(|stretch| stretch.kind == kind) {
                let (colour, width) = style(kind);
                entries.push(line_entry(words, Stroke::new(colour, width)));
            }
        }
        if rest {
            let stroke = Stroke { dash: Some([3.0, 2.5]), ..Stroke::new(Colour::GREY, 0.9) };
            entries.push(line_entry("at rest", stroke));
        }
        entries.push(Entry::new("base clamp", |canvas, rect| {
            let [x, y] = rect.centre();
            let plate = Rect { left: x - 3.0, top: y - 3.5, width: 6.0, height: 7.0 };
            canvas.rect(plate, Some(Colour::hex(0xc9c9c9)), Some(Stroke::new(Colour::MUTED, 0.6)));
        }));
        let dipoles: Vec<f64> =
            self.stretches.iter().filter_map(|s| s.dipole).filter(|m| nonzero(*m)).map(norm).collect();
        match dipoles[..] {
            [] => {}
            [one] => {
                entries.push(arrow_entry(format!("dipole moment µ, {} A·m²", compact(one)), RodShape::DIPOLE_COLOUR))
            }
            _ => {
                let words = format!("dipole moments µ, longest {} A·m²", compact(self.largest_dipole()));
                entries.push(arrow_entry(words, RodShape::DIPOLE_COLOUR));
            }
        }
        if let Some(flux_density) = self.flux_density.filter(|b| nonzero(*b)) {
            let words = match &self.surroundings {
                Some(_) => format!("uniform field {}, {} mT", self.field_letter(), compact(1e3 * norm(flux_density))),
                None => format!("field {}, {} T", self.field_letter(), compact(norm(flux_density))),
            };
            entries.push(arrow_entry(words, RodShape::FIELD_COLOUR));
        }
        if let Some(force) = self.tip_force.filter(|f| nonzero(*f)) {
            entries.push(force_entry("tip force F", norm(force)));
        }
        match &self.inner_loads[..] {
            [] => {}
            [inner] => entries.push(force_entry(&format!("force {}", inner.name), norm(inner.force))),
            forces => {
                let largest = forces.iter().map(|inner| norm(inner.force)).fold(0.0, f64::max);
                entries.push(force_entry("forces inside of the rod, largest", largest));
            }
        }
        if self.tip_rotation.is_some() {
            for (colour, words) in RodShape::FRAME_COLOURS.into_iter().zip(["tip d₁", "tip d₂", "tip d₃ (tangent)"])
            {
                entries.push(arrow_entry(words, colour));
            }
        }
        entries
    }
}

fn force_entry(words: &str, newtons: f64) -> Entry {
    arrow_entry(force_words(words, newtons), RodShape::FORCE_COLOUR)
}

/// Colour and width (pt).
pub(super) fn style(kind: StretchKind) -> (Colour, f64) {
    match kind {
        StretchKind::Flexible => (RodShape::FLEXIBLE_COLOUR, 1.7),
        StretchKind::Rigid => (RodShape::RIGID_COLOUR, 3.2),
        StretchKind::Coil | StretchKind::Magnet => (RodShape::COIL_COLOUR, 4.2),
    }
}

/// Where the field's arrow starts: of the places along the rim of the limits, the one farthest from everything else.
fn field_place(views: &FourViews, view: &View, vector: Vector, occupied: &[Point]) -> Vector {
    let shares = [-1.0, 0.0, 1.0];
    let start = |place: [f64; 3]| -> Vector {
        std::array::from_fn(|k| {
            let [low, high] = views.limits[k];
            let room = 14.0 / view.scale;
            let half = (0.5 * (high - low) - 0.5 * vector[k].abs() - room).max(0.0);
            0.5 * (low + high) + half * place[k] - 0.5 * vector[k]
        })
    };
    let free = |from: &Vector| {
        // The arrow, and the letter beyond its head.
        let along = (0..=6).map(|k| view.place(std::array::from_fn(|i| from[i] + 0.22 * f64::from(k) * vector[i])));
        along.flat_map(|[x, y]| occupied.iter().map(move |[a, b]| (x - a).hypot(y - b))).fold(f64::INFINITY, f64::min)
    };
    let places = shares.into_iter().flat_map(|x| shares.into_iter().flat_map(move |y| shares.map(|z| [x, y, z])));
    let starts = places.map(start);
    starts.max_by(|a, b| free(a).total_cmp(&free(b))).unwrap_or(view.centre)
}

/// A letter at the head of an arrow, moved on where it would touch another.
fn beside(label: &str, view: &View, vector: Vector, head: Point, colour: Colour, others: &[Text]) -> Text {
    let [dx, dy] = view.along(vector);
    let length = dx.hypot(dy);
    let [ux, uy] = if length < 4.0 { [1.0, 0.0] } else { [dx / length, dy / length] };
    let mut text = Text::new(label, head, NORMAL).bold().colour(colour).align(Align::Middle).halo();
    let wider = (0.5 * text.width() - 3.0).max(0.0);
    let turns = [0.0f64, -50.0, 50.0, -100.0, 100.0].map(f64::to_radians);
    for (distance, turn) in
        [7.5 + wider, 13.0 + wider].into_iter().flat_map(|distance| turns.map(|turn| (distance, turn)))
    {
        let (sin, cos) = turn.sin_cos();
        text.at = [head[0] + distance * (cos * ux - sin * uy), head[1] + distance * (sin * ux + cos * uy)];
        let touches = |other: &Text| (other.at[0] - text.at[0]).abs() < 10.0 && (other.at[1] - text.at[1]).abs() < 8.0;
        if !others.iter().any(touches) {
            break;
        }
    }
    text
}

/// Places on the page that a symbol should not cover.
fn occupied(view: &View, centreline: &[Vector], rest: &[Vector], arrows: &[Mark]) -> Vec<Point> {
    let heads = arrows.iter().map(|arrow| plus(arrow.from, arrow.vector));
    centreline.iter().chain(rest).copied().chain(heads).map(|point| view.place(point)).collect()
}

fn finite(points: &[Vector]) -> Vec<Vector> {
    points.iter().copied().filter(|point| point.iter().all(|x| x.is_finite())).collect()
}
