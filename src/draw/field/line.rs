//! A line along the field, by the classical method of Runge and Kutta. The slope at the end of a step makes a second, coarser
//! answer of it; steps are halved until both agree.

use super::super::vectors::{along, distance, dot, norm};
use super::sources::Surroundings;
use crate::model::Vector;

/// Answers agree where they differ by this share of the longest step.
const AGREE: f64 = 1e-4;
/// Steps are halved so often at most.
const HALVINGS: i32 = 12;

/// Where a line goes on, step by step.
pub(super) struct Walk<'a> {
    surroundings: &'a Surroundings,
    /// Across the plane in which it stays; `None` in space.
    plane: Option<Vector>,
    /// Of a step (m).
    longest: f64,
    /// The step that was taken last, backwards if negative (m).
    step: f64,
    at: Vector,
    local: Option<Local>,
}

impl<'a> Walk<'a> {
    /// From a place (m), along the field or against it.
    pub fn new(
        surroundings: &'a Surroundings,
        plane: Option<Vector>,
        at: Vector,
        longest: f64,
        forwards: bool,
    ) -> Self {
        let step = if forwards { longest } else { -longest };
        Walk { surroundings, plane, longest, step, at, local: local(surroundings, plane, at) }
    }
}

/// The field at a point of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    /// Of length one, in the plane if there is one.
    pub direction: Vector,
    /// Of the field, that lies in it.
    pub share: f64,
    /// |B| (T)
    pub size: f64,
}

/// The field at a point, and its direction in a plane; `None` where it is not known or has none.
pub(super) fn local(surroundings: &Surroundings, plane: Option<Vector>, at: Vector) -> Option<Local> {
    if !surroundings.is_known(at) {
        return None;
    }
    let whole = surroundings.flux_density(at);
    let inside = plane.map_or(whole, |normal| along(whole, -dot(whole, normal), normal));
    let (inner, size) = (norm(inside), norm(whole));
    (inner.is_finite() && inner > 0.0).then(|| Local {
        direction: inside.map(|x| x / inner),
        share: inner / size,
        size,
    })
}

impl Walk<'_> {
    /// Where a step ends, the field there, and how far its two answers are apart; `None` where the field is not known.
    fn stepped(&self) -> Option<(Vector, Local, f64)> {
        let (at, step, first) = (self.at, self.step, self.local?.direction);
        let slope = |at: Vector| local(self.surroundings, self.plane, at).map(|local| local.direction);
        let second = slope(along(at, 0.5 * step, first))?;
        let third = slope(along(at, 0.5 * step, second))?;
        let fourth = slope(along(at, step, third))?;
        let end: Vector =
            std::array::from_fn(|k| at[k] + step / 6.0 * (first[k] + 2.0 * (second[k] + third[k]) + fourth[k]));
        let last = local(self.surroundings, self.plane, end)?;
        // The other has a tenth of the last slope and as much less of the fourth; it is of third order.
        Some((end, last, 0.1 * step.abs() * distance(fourth, last.direction)))
    }
}

impl Iterator for Walk<'_> {
    type Item = (Vector, Local);

    fn next(&mut self) -> Option<Self::Item> {
        while self.step.abs() >= self.longest * 0.5f64.powi(HALVINGS) {
            if let Some((end, local, error)) = self.stepped().filter(|(.., error)| *error <= AGREE * self.longest) {
                let grown = if error < AGREE / 40.0 * self.longest { 2.0 * self.step } else { self.step };
                self.step = grown.clamp(-self.longest, self.longest);
                (self.at, self.local) = (end, Some(local));
                return Some((end, local));
            }
            self.step *= 0.5;
        }
        None
    }
}

impl Surroundings {
    /// The line of the field through a point (m), against the field and along it, `most` (m) on each side at most: it ends
    /// where the field is not known. In steps of `step` (m) at most.
    pub fn line(&self, through: Vector, step: f64, most: f64) -> Vec<Vector> {
        let mut line = vec![through];
        for forwards in [false, true] {
            line.reverse();
            let (mut last, mut length) = (through, 0.0);
            for (at, _) in Walk::new(self, None, through, step, forwards) {
                length += distance(last, at);
                last = at;
                line.push(at);
                if length >= most {
                    break;
                }
            }
        }
        line
    }
}
