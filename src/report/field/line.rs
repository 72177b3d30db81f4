//! A line along the field, by the classical method of Runge and Kutta with steps halved until they agree.

use super::super::vectors::{along, distance, dot, norm};
use super::sources::Surroundings;
use crate::model::Vector;

/// Steps agree where their ends differ by this share of the longest step.
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
        Walk { surroundings, plane, longest, step, at }
    }
}

/// The direction of the field in a plane, and which share of the field lies in it; `None` where it is not known.
pub(super) fn direction(surroundings: &Surroundings, plane: Option<Vector>, at: Vector) -> Option<(Vector, f64)> {
    if !surroundings.is_known(at) {
        return None;
    }
    let whole = surroundings.flux_density(at);
    let inside = plane.map_or(whole, |normal| along(whole, -dot(whole, normal), normal));
    let size = norm(inside);
    (size.is_finite() && size > 0.0).then(|| (inside.map(|x| x / size), size / norm(whole)))
}

impl Walk<'_> {
    fn stepped(&self, at: Vector, step: f64) -> Option<Vector> {
        let slope = |at: Vector| direction(self.surroundings, self.plane, at).map(|(direction, _)| direction);
        let first = slope(at)?;
        let second = slope(along(at, 0.5 * step, first))?;
        let third = slope(along(at, 0.5 * step, second))?;
        let last = slope(along(at, step, third))?;
        Some(std::array::from_fn(|k| at[k] + step / 6.0 * (first[k] + 2.0 * (second[k] + third[k]) + last[k])))
    }
}

impl Iterator for Walk<'_> {
    type Item = Vector;

    fn next(&mut self) -> Option<Vector> {
        loop {
            let whole = self.stepped(self.at, self.step);
            let halves = self.stepped(self.at, 0.5 * self.step).and_then(|at| self.stepped(at, 0.5 * self.step));
            if let (Some(whole), Some(halves)) = (whole, halves) {
                let error = distance(whole, halves);
                if error <= AGREE * self.longest {
                    let grown = if error < AGREE / 40.0 * self.longest { 2.0 * self.step } else { self.step };
                    self.step = grown.clamp(-self.longest, self.longest);
                    self.at = halves;
                    return Some(halves);
                }
            }
            self.step *= 0.5;
            if self.step.abs() < self.longest * 0.5f64.powi(HALVINGS) {
                return None;
            }
        }
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
            for at in Walk::new(self, None, through, step, forwards) {
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
