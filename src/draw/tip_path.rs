//! Where the tip should go and where it goes, in three projections and in space; rods along the way.

use super::canvas::{Canvas, Dot, Point, Shape, Stroke};
use super::colour::{Colour, ColourMap};
use super::field::{FieldSource, Scenery, Surroundings, widened};
use super::legend::Entry;
use super::vectors::{bounds, widest};
use super::views::FourViews;
use super::wall::{DrawnWall, WallScenery};
use super::{Figure, ReportError, TWO_COLUMNS};
use crate::model::Vector;

const FIGURE: &str = "the tip's path";
const TOP: f64 = 30.0;
const MARGIN: f64 = 14.0;
const DESIRED: Colour = Colour::ORANGE;
const ACHIEVED: Colour = Colour::BLUE;
const FLAGGED: Colour = Colour::VERMILION;

/// A tip's path.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TipPath {
    /// Above the panels; empty for none.
    pub title: String,
    /// Where the tip should be, in order (m); what is not finite interrupts the line.
    pub desired: Vec<Vector>,
    /// Where the tip is, in order (m).
    pub achieved: Vec<Vector>,
    /// Desired places that are not reached (m).
    pub flagged: Vec<Vector>,
    /// Centrelines along the way (m), coloured from first to last.
    pub rods: Vec<Vec<Vector>>,
    /// What the two are called in the legend.
    pub names: [&'static str; 2],
    /// Whether the points follow one another: lines, else dots.
    pub order: bool,
    /// What makes the field vary.
    pub surroundings: Option<Surroundings>,
    /// The wall of the scene; `None`: it has none.
    pub wall: Option<DrawnWall>,
    /// Magnets that move, for each rod.
    pub magnets: Vec<Vec<FieldSource>>,
}

impl Figure for TipPath {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let all = self.desired.iter().chain(&self.achieved).chain(self.rods.iter().flatten()).copied();
        let finite: Vec<Vector> = all.filter(|point| point.iter().all(|x| x.is_finite())).collect();
        if finite.is_empty() {
            return Err(ReportError::Empty { figure: FIGURE, reason: "no point is finite".into() });
        }
        let sources = self.surroundings.iter().flat_map(|surroundings| &surroundings.sources);
        let tips: Vec<Vector> = self
            .desired
            .iter()
            .chain(&self.achieved)
            .copied()
            .filter(|point| point.iter().all(|x| x.is_finite()))
            .collect();
        let tips = if tips.is_empty() { &finite } else { &tips };
        let mut around = bounds(finite.iter().copied());
        if let Some(wall) = &self.wall {
            around = bounds(finite.iter().copied().chain(wall.marks(tips[0], widest(around))));
        }
        let limits = widened(sources.chain(self.magnets.iter().flatten()), around);
        let views = FourViews::new(limits, TWO_COLUMNS, TOP, MARGIN);
        let scenery = self.surroundings.as_ref().map(|around| Scenery::of_points(around, finite.clone(), views.limits));
        let wall = self.wall.as_ref().map(|wall| WallScenery::at_tips(wall, tips, views.limits));
        let mut entries = self.entries();
        entries.extend(wall.iter().flat_map(WallScenery::entries));
        entries.extend(scenery.iter().flat_map(Scenery::entries));
        let mut canvas = views.page(&self.title, &entries);
        for view in &views.views {
            wall.iter().for_each(|wall| wall.draw_behind(&mut canvas, view));
            if let Some(scenery) = &scenery {
                scenery.draw_behind(&mut canvas, view);
                for (k, magnets) in self.magnets.iter().enumerate() {
                    let is_end = k == 0 || k + 1 == self.magnets.len();
                    for magnet in magnets {
                        scenery.draw_moved(&mut canvas, view, magnet, self.rod_colour(k), is_end);
                    }
                }
            }
            for (k, rod) in self.rods.iter().enumerate() {
                let line: Vec<Point> = rod.iter().map(|point| view.place(*point)).collect();
                canvas.line(line, Stroke::new(self.rod_colour(k), 1.1));
            }
            if !self.order {
                let radius = if self.achieved.len() > 500 { 0.5 } else { 1.2 };
                let dots = |points: &[Vector], colour| -> Vec<Dot> {
                    let finite = points.iter().filter(|point| point.iter().all(|x| x.is_finite()));
                    finite.map(|point| Dot { at: view.place(*point), colour }).collect()
                };
                for (points, colour, radius) in
                    [(&self.desired, DESIRED, 2.0 * radius), (&self.achieved, ACHIEVED, radius)]
                {
                    canvas.shapes.push(Shape::Dots { clip: view.rect, radius, rim: 0.0, dots: dots(points, colour) });
                }
            }
            let thin = if self.achieved.len() > 1000 { 0.35 } else { 0.9 };
            for (points, colour, width) in [(&self.desired, DESIRED, 2.6), (&self.achieved, ACHIEVED, thin)] {
                for stretch in
                    points.split(|point| !point.iter().all(|x| x.is_finite())).filter(|s| s.len() > 1 && self.order)
                {
                    let line: Vec<Point> = stretch.iter().map(|point| view.place(*point)).collect();
                    canvas.line(line, Stroke::new(colour, width));
                }
            }
            let radius = if self.flagged.len() > 100 { 0.8 } else { 1.6 };
            for point in self.flagged.iter().filter(|point| point.iter().all(|x| x.is_finite())) {
                canvas.circle(view.place(*point), radius, None, Some(Stroke::new(FLAGGED, 0.4 * radius)));
            }
            if let Some(scenery) = &scenery {
                let points = finite.iter().map(|point| view.place(*point)).collect();
                scenery.draw_words(&mut canvas, view, points, &[]);
            }
        }
        views.draw_legend(&mut canvas, &entries);
        Ok(canvas)
    }
}

impl TipPath {
    fn rod_colour(&self, k: usize) -> Colour {
        ColourMap::Sequential.at(0.08 + 0.84 * k as f64 / (self.rods.len().max(2) - 1) as f64)
    }

    fn entries(&self) -> Vec<Entry> {
        let line = |words: &str, stroke: Stroke| {
            Entry::new(words, move |canvas, rect| {
                let y = rect.centre()[1];
                canvas.line([[rect.left, y], [rect.right(), y]], stroke);
            })
        };
        let dot = |words: &str, colour: Colour, radius: f64| {
            Entry::new(words, move |canvas, rect| canvas.circle(rect.centre(), radius, Some(colour), None))
        };
        let mut entries = if self.order {
            vec![line(self.names[0], Stroke::new(DESIRED, 2.6)), line(self.names[1], Stroke::new(ACHIEVED, 0.9))]
        } else {
            vec![dot(self.names[0], DESIRED, 2.4), dot(self.names[1], ACHIEVED, 1.2)]
        };
        if !self.flagged.is_empty() {
            let words = format!("not reached ({} of {})", self.flagged.len(), self.desired.len());
            entries.push(Entry::new(words, |canvas, rect| {
                canvas.circle(rect.centre(), 1.6, None, Some(Stroke::new(FLAGGED, 0.7)));
            }));
        }
        if let Some(last) = self.rods.len().checked_sub(1) {
            entries.push(line("rod, first", Stroke::new(self.rod_colour(0), 1.1)));
            entries.push(line("rod, last", Stroke::new(self.rod_colour(last), 1.1)));
            if self.magnets.iter().any(|magnets| !magnets.is_empty()) {
                entries.push(dot("magnet, first and last whole, others by their middles", self.rod_colour(0), 1.5));
            }
        }
        entries
    }
}
