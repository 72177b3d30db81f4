//! Lines of the field in the plane of a view, spread evenly over its panel: each new line starts beside a known one and
//! ends where it would come too near to another (after Jobard and Lefer, 1997).

use super::super::canvas::Point;
use super::super::vectors::{along, dot, minus};
use super::super::views::View;
use super::line::{Walk, local};
use super::near::Known;
use super::sources::Surroundings;
use crate::model::Vector;
use std::collections::VecDeque;

/// Between lines (pt).
pub(super) const SEPARATION: f64 = 12.0;
/// A line ends where it comes nearer to another (share of the separation).
const NEAREST: f64 = 0.55;
/// Shorter lines are left out (pt).
const SHORTEST: f64 = 20.0;
/// Longer ones are cut (pt).
const LONGEST: f64 = 1500.0;
/// Of a step (pt).
const STEP: f64 = 2.0;
/// A line ends where less of the field than this lies in the plane.
const LEAST_SHARE: f64 = 0.05;

/// A place on a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub at: Point,
    /// Of the field, that lies in the plane.
    pub share: f64,
}

/// The plane of a view through a point, and lines in it.
pub(super) struct Plane<'a> {
    pub surroundings: &'a Surroundings,
    pub view: &'a View,
    /// The point (m).
    pub through: Vector,
}

impl Plane<'_> {
    /// The point of the plane that is drawn at a place.
    pub fn point(&self, at: Point) -> Vector {
        let View { right, up, toward, scale, centre, middle, .. } = *self.view;
        let in_view = along(along(centre, (at[0] - middle[0]) / scale, right), -(at[1] - middle[1]) / scale, up);
        along(in_view, dot(minus(self.through, in_view), toward), toward)
    }

    /// Lines along the field.
    pub fn lines(&self) -> Vec<Vec<Spot>> {
        let rect = self.view.rect;
        let mut known = self.known();
        let mut lines: Vec<Vec<Spot>> = Vec::new();
        let middle = self.view.place(self.through);
        let lattice = |k: usize, from: f64, size: f64| from + size * (k as f64 + 0.5) / 6.0;
        let far = (0..36).map(|k| [lattice(k % 6, rect.left, rect.width), lattice(k / 6, rect.top, rect.height)]);
        // Besides the middle, the panel's other parts: sources may keep them apart.
        let mut seeds: VecDeque<Point> = [middle].into_iter().chain(far).collect();
        while let Some(seed) = seeds.pop_front() {
            if !rect.contains(seed) || known.is_near(seed, 0.99 * SEPARATION, |_| true) {
                continue;
            }
            let line = self.line(seed, &known);
            if length(&line) < SHORTEST {
                continue;
            }
            line.iter().for_each(|spot| known.add(spot.at, 0.0));
            // Next to this line come first, so that lines stay parallel where the field is even.
            for pair in line.windows(2).rev() {
                let [a, b] = [pair[0].at, pair[1].at];
                let size = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
                let side = [-(b[1] - a[1]) / size * SEPARATION, (b[0] - a[0]) / size * SEPARATION];
                seeds.push_front([a[0] + side[0], a[1] + side[1]]);
                seeds.push_front([a[0] - side[0], a[1] - side[1]]);
            }
            lines.push(line);
        }
        lines
    }

    /// Nothing yet.
    fn known(&self) -> Known<2> {
        let rect = self.view.rect;
        Known::new([[rect.left, rect.right()], [rect.top, rect.bottom()]], SEPARATION)
    }

    /// One line through a seed, as far as it keeps away from others and from itself.
    fn line(&self, seed: Point, known: &Known<2>) -> Vec<Spot> {
        let (from, normal) = (self.point(seed), Some(self.view.toward));
        let mut line: Vec<Spot> = self.spot(seed).into_iter().collect();
        let mut own = self.known();
        own.add(seed, 0.0);
        for sign in [-1.0, 1.0] {
            line.reverse();
            let (mut last, mut gone) = (seed, 0.0f64);
            for (point, _) in Walk::new(self.surroundings, normal, from, STEP / self.view.scale, sign > 0.0) {
                let at = self.view.place(point);
                gone += (at[0] - last[0]).hypot(at[1] - last[1]);
                last = at;
                let Some(spot) = self.spot(at) else { break };
                line.push(spot);
                let place = sign * gone;
                // Near a part of itself that is far along the line: it has come back.
                let is_back = own.is_near(at, NEAREST * SEPARATION, |other| (other - place).abs() > 2.0 * SEPARATION);
                if !self.view.rect.contains(at)
                    || gone > LONGEST
                    || spot.share < LEAST_SHARE
                    || is_back
                    || known.is_near(at, NEAREST * SEPARATION, |_| true)
                {
                    break;
                }
                own.add(at, place);
            }
        }
        line
    }

    /// What a line is like at a place of the plane.
    pub fn spot(&self, at: Point) -> Option<Spot> {
        let local = local(self.surroundings, Some(self.view.toward), self.point(at))?;
        Some(Spot { at, share: local.share })
    }
}

/// Of a line (pt).
pub(super) fn length(line: &[Spot]) -> f64 {
    line.windows(2).map(|pair| (pair[1].at[0] - pair[0].at[0]).hypot(pair[1].at[1] - pair[0].at[1])).sum()
}
