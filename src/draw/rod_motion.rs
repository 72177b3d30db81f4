//! A rod on its way along a path, in three projections and in space. As SVG it moves, in a browser; a PNG shows its
//! first place.

use super::canvas::{Canvas, Point, Shape, Stroke};
use super::colour::Colour;
use super::field::{FieldSource, Scenery, Surroundings, widened};
use super::legend::Entry;
use super::rod_shape::{Stretch, StretchKind, style};
use super::samples::line_entry;
use super::vectors::{bounds, widest};
use super::views::{FourViews, View};
use super::wall::{DrawnWall, WallScenery};
use super::{Figure, ReportError, TWO_COLUMNS};
use crate::model::Vector;

const FIGURE: &str = "the rod's motion";
const TOP: f64 = 30.0;
const MARGIN: f64 = 14.0;
const DESIRED: Stroke = Stroke { colour: Colour::SKY, width: 2.6, dash: None };
const ACHIEVED: Stroke = Stroke { colour: Colour::BLUE, width: 0.9, dash: None };

/// A rod and its tip's path.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RodMotion {
    /// Above the panels; empty for none.
    pub title: String,
    /// Where the tip should go (m).
    pub desired: Vec<Vector>,
    /// Where the tip goes (m).
    pub tips: Vec<Vector>,
    /// The rod at places that follow one another evenly in time, the same stretches with as many points in each; the
    /// first at the first tip, the last at the last.
    pub rods: Vec<Vec<Stretch>>,
    /// Of the whole way (s).
    pub seconds: f64,
    /// What makes the field vary.
    pub surroundings: Option<Surroundings>,
    /// The wall of the scene; `None`: it has none.
    pub wall: Option<DrawnWall>,
    /// Magnets that move, for each place of the rod.
    pub magnets: Vec<Vec<FieldSource>>,
}

impl Figure for RodMotion {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let points = |rod: &Vec<Stretch>| rod.iter().flat_map(|stretch| stretch.points.clone()).collect::<Vec<_>>();
        let on_rods: Vec<Vector> = self.rods.iter().flat_map(points).collect();
        let all = || on_rods.iter().chain(&self.desired).chain(&self.tips);
        let (Some(first), true) = (self.rods.first(), all().flatten().all(|x| x.is_finite())) else {
            return Err(ReportError::Empty { figure: FIGURE, reason: "no rod, or a point that is not finite".into() });
        };
        let counts = |rod: &Vec<Stretch>| rod.iter().map(|stretch| stretch.points.len()).collect::<Vec<_>>();
        if let Some(other) = self.rods.iter().find(|rod| counts(rod) != counts(first)) {
            let [expected, found] = [first, other].map(|rod| points(rod).len());
            return Err(ReportError::Length { figure: FIGURE, what: "a rod's points", expected, found });
        }
        let sources = self.surroundings.iter().flat_map(|surroundings| &surroundings.sources);
        let tips = if self.tips.is_empty() { &on_rods } else { &self.tips };
        let mut around = bounds(all().copied());
        if let Some(wall) = &self.wall {
            around = bounds(all().copied().chain(wall.marks(tips[0], widest(around))));
        }
        let limits = widened(sources.chain(self.magnets.iter().flatten()), around);
        let views = FourViews::new(limits, TWO_COLUMNS, TOP, MARGIN);
        let scenery =
            self.surroundings.as_ref().map(|around| Scenery::of_points(around, on_rods.clone(), views.limits));
        let wall = self.wall.as_ref().map(|wall| WallScenery::at_tips(wall, tips, views.limits));
        let mut entries = self.entries(first);
        entries.extend(wall.iter().flat_map(WallScenery::entries));
        entries.extend(scenery.iter().flat_map(Scenery::entries));
        let mut canvas = views.page(&self.title, &entries);
        for view in &views.views {
            scenery.iter().for_each(|scenery| self.draw_magnets(&mut canvas, view, scenery));
            wall.iter().for_each(|wall| wall.draw_behind(&mut canvas, view));
            let place = |points: &[Vector]| points.iter().map(|point| view.place(*point)).collect::<Vec<Point>>();
            canvas.line(place(&self.desired), DESIRED);
            self.draw_trail(&mut canvas, place(&self.tips));
            for (index, stretch) in first.iter().enumerate() {
                let frames: Vec<Vec<Point>> = self.rods.iter().map(|rod| place(&rod[index].points)).collect();
                let (colour, width) = style(stretch.kind);
                canvas.shapes.push(Shape::Moving { frames, stroke: Stroke::new(colour, width), seconds: self.seconds });
            }
            if let Some(scenery) = &scenery {
                let points = all().map(|point| view.place(*point)).collect();
                scenery.draw_words(&mut canvas, view, points, &[]);
            }
        }
        views.draw_legend(&mut canvas, &entries);
        Ok(canvas)
    }
}

impl RodMotion {
    /// What surrounds the rod, and the magnets that move.
    fn draw_magnets(&self, canvas: &mut Canvas, view: &View, scenery: &Scenery) {
        scenery.draw_behind(canvas, view);
        let count = self.magnets.iter().map(Vec::len).min().unwrap_or(0);
        for index in 0..count {
            let lines = || self.magnets.iter().map(|magnets| scenery.moving(view, &magnets[index]));
            for (part, colour) in [Colour::MUTED, Colour::VERMILION].into_iter().enumerate() {
                let frames: Vec<Vec<Point>> = lines().map(|mut lines| std::mem::take(&mut lines[part])).collect();
                if frames.iter().any(Vec::is_empty) {
                    continue;
                }
                canvas.shapes.push(Shape::Moving { frames, stroke: Stroke::new(colour, 1.0), seconds: self.seconds });
            }
        }
    }

    /// The tip's path as far as it has come.
    fn draw_trail(&self, canvas: &mut Canvas, points: Vec<Point>) {
        let mut lengths = vec![0.0];
        for pair in points.windows(2) {
            let step = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            lengths.push(lengths[lengths.len() - 1] + step);
        }
        let (whole, last) = (lengths[lengths.len() - 1].max(f64::MIN_POSITIVE), self.rods.len().max(2) - 1);
        let share = |k: usize| {
            let at = (k * (lengths.len() - 1)) as f64 / last as f64;
            let (below, above) = (lengths[at.floor() as usize], lengths[at.ceil() as usize]);
            (below + at.fract() * (above - below)) / whole
        };
        let shares = (0..=last).map(share).collect();
        canvas.shapes.push(Shape::Growing { points, shares, stroke: ACHIEVED, seconds: self.seconds });
    }

    fn entries(&self, rod: &[Stretch]) -> Vec<Entry> {
        let mut entries = vec![line_entry("desired", DESIRED), line_entry("tip so far", ACHIEVED)];
        if self.magnets.iter().any(|magnets| !magnets.is_empty()) {
            entries.push(line_entry("magnet that moves", Stroke::new(Colour::MUTED, 1.0)));
        }
        for kind in [StretchKind::Flexible, StretchKind::Rigid, StretchKind::Coil, StretchKind::Magnet] {
            if rod.iter().any(|stretch| stretch.kind == kind) {
                let (colour, width) = style(kind);
                entries.push(line_entry(kind.name(), Stroke::new(colour, width)));
            }
        }
        entries
    }
}
