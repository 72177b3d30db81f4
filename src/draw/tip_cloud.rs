//! Where the tip goes: a cloud of positions coloured by a quantity, in three projections and in space.

use super::canvas::{Align, Canvas, Dot, NORMAL, Point, Rect, SMALL, Shape, Stroke, Text};
use super::colour::{Colour, ColourMap};
use super::colour_bar::ColourRange;
use super::field::{Scenery, Surroundings, widened};
use super::legend::Entry;
use super::text_table::count;
use super::vectors::bounds;
use super::views::{FourViews, View};
use super::wall::{DrawnWall, WallScenery};
use super::{Figure, ReportError, TWO_COLUMNS};
use crate::model::Vector;
use rayon::prelude::*;

const FIGURE: &str = "the tip cloud";
/// Room for the title and for the colour bar (pt).
const TOP: f64 = 30.0;
const MARGIN: f64 = 62.0;
/// Most dots that are drawn with a rim.
const MOST_RIMS: usize = 1500;

/// Tip positions with one value each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// In m; points that are not finite, in position or value, are left out and counted.
    pub points: Vec<Vector>,
    /// One for each point, in `unit`.
    pub values: Vec<f64>,
    /// What the values are.
    pub quantity: String,
    /// Their unit; empty for none.
    pub unit: String,
    /// Above the panels; empty for none.
    pub title: String,
    /// Sequential, or diverging where values have both signs, unless chosen here.
    pub map: Option<ColourMap>,
    /// The rod of the scene, drawn as a line (m).
    pub rod: Option<Vec<Vector>>,
    /// What makes the field vary.
    pub surroundings: Option<Surroundings>,
    /// The wall of the scene; `None`: it has none.
    pub wall: Option<DrawnWall>,
}

impl Figure for Cloud {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let (expected, found) = (self.points.len(), self.values.len());
        if expected != found {
            return Err(ReportError::Length { figure: FIGURE, what: "the quantity", expected, found });
        }
        let pairs = self.points.iter().copied().zip(self.values.iter().copied());
        let finite = |(point, value): &(Vector, f64)| value.is_finite() && point.iter().all(|x| x.is_finite());
        let cloud: Vec<(Vector, f64)> = pairs.filter(finite).collect();
        if cloud.is_empty() {
            let reason = match expected {
                0 => "no points were given".into(),
                _ => format!("none of {} points is finite", count(expected as u64)),
            };
            return Err(ReportError::Empty { figure: FIGURE, reason });
        }
        let rod = self.rod.iter().flatten().copied().filter(|point| point.iter().all(|x| x.is_finite()));
        let rod: Vec<Vector> = rod.collect();
        let bounds = bounds(cloud.iter().map(|(point, _)| *point).chain(rod.iter().copied()));
        let sources = self.surroundings.iter().flat_map(|surroundings| &surroundings.sources);
        let views = FourViews::new(widened(sources, bounds), TWO_COLUMNS, TOP, MARGIN);
        let scenery = self.surroundings.as_ref().map(|around| Scenery::of_rod(around, rod.clone(), views.limits));
        let wall = self.wall.as_ref().map(|wall| match rod.last() {
            Some(tip) => WallScenery::at_tip(wall, *tip, views.limits),
            None => {
                WallScenery::at_tips(wall, &cloud.iter().map(|(point, _)| *point).collect::<Vec<_>>(), views.limits)
            }
        });
        let of_field = scenery.iter().flat_map(Scenery::entries);
        let entries: Vec<Entry> = of_field.chain(wall.iter().flat_map(WallScenery::entries)).collect();
        let range = ColourRange::new(cloud.iter().map(|(_, value)| *value), self.map);

        let mut canvas = views.page(&self.title, &entries);
        let note = self.note(cloud.len(), expected - cloud.len(), &range, !rod.is_empty());
        canvas.text(Text::new(note, [TWO_COLUMNS - 6.0, 9.0], SMALL).align(Align::End).colour(Colour::MUTED));
        let colours: Vec<Colour> = cloud.iter().map(|(_, value)| range.colour(*value)).collect();
        let dots = |view: &View| -> Vec<Dot> {
            let depths = cloud.iter().map(|(point, _)| view.depth(*point));
            back_to_front(depths).map(|k| Dot { at: view.place(cloud[k].0), colour: colours[k] }).collect()
        };
        let dots: Vec<Vec<Dot>> = views.views.par_iter().map(dots).collect();
        for (view, dots) in views.views.iter().zip(dots) {
            scenery.iter().for_each(|scenery| scenery.draw_behind(&mut canvas, view));
            wall.iter().for_each(|wall| wall.draw_behind(&mut canvas, view));
            let mut points: Vec<Point> = sparse(&dots).map(|dot| dot.at).collect();
            let radius = dot_radius(view.rect, cloud.len());
            // A rim keeps pale dots apart from the paper; many would darken the cloud.
            let rim = if cloud.len() <= MOST_RIMS { 0.3 } else { 0.0 };
            canvas.shapes.push(Shape::Dots { clip: view.rect, radius, rim, dots });
            if rod.len() > 1 {
                let line: Vec<_> = rod.iter().map(|point| view.place(*point)).collect();
                canvas.clipped_line(line.clone(), Stroke::new(Colour::WHITE, 3.0), view.rect);
                canvas.clipped_line(line.clone(), Stroke::new(Colour::INK, 1.4), view.rect);
                // It counts for more than a dot.
                (0..6).for_each(|_| points.extend(&line));
            }
            scenery.iter().for_each(|scenery| scenery.draw_words(&mut canvas, view, points.clone(), &[]));
        }
        views.draw_legend(&mut canvas, &entries);
        let upper = views.views[1].rect;
        let height = upper.height.max(110.0);
        let bar = Rect { left: TWO_COLUMNS - MARGIN + 14.0, top: upper.top, width: 0.0, height };
        range.draw(&mut canvas, bar, &self.quantity, &self.unit);
        Ok(canvas)
    }
}

impl Cloud {
    fn note(&self, drawn: usize, skipped: usize, range: &ColourRange, rod: bool) -> String {
        let mut parts = vec![format!("{} tip position{}", count(drawn as u64), if drawn == 1 { "" } else { "s" })];
        if skipped > 0 {
            parts.push(format!("{} not finite, left out", count(skipped as u64)));
        }
        if range.clipped.contains(&true) {
            parts.push("colours span percentiles 1 to 99".into());
        }
        if rod {
            parts.push("black: rod of the scene".into());
        }
        parts.join(" · ")
    }
}

/// Places of numbers from the lowest to the highest; of equal ones the first comes first.
fn back_to_front(depths: impl Iterator<Item = f64>) -> impl Iterator<Item = usize> {
    // As whole numbers in the same order: below zero, the bits of a number fall where it rises.
    let key = |depth: f64| depth.to_bits() as i64 ^ (depth.to_bits() as i64 >> 63 & i64::MAX);
    let mut order: Vec<(i64, u32)> = depths.map(key).zip(0..).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, k)| k as usize)
}

/// Enough of many dots to tell where they are.
fn sparse(dots: &[Dot]) -> impl Iterator<Item = &Dot> {
    dots.iter().step_by(dots.len() / MOST_RIMS + 1)
}

/// Few points are drawn large, many so that they just cover the panel.
fn dot_radius(rect: Rect, point_count: usize) -> f64 {
    (0.47 * (rect.width * rect.height / point_count as f64).sqrt()).clamp(0.36, 0.3 * NORMAL)
}
