//! The Jacobian of the same boundary value problem by finite differences. Newton's matrix is differenced, too.
//!
//! A forward difference errs by about h (truncation) and noise / h, least at h = sqrt(epsilon); a central one by h² and
//! noise / h, least at the cube root. h is in units of what bends the rod by a radian ([`Rod::scale`]).

use super::method::{self, Column, Jacobian, Method, NewtonStep, Tip};
use super::paper::{Paper, Passage};
use super::rod::{Input, Rod};
use nalgebra::{Matrix3, Vector3};

/// What is differenced, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// The solution, solved again for each input: (x(h) - x(0)) / h.
    Forward,
    /// The solution, solved again twice for each input: (x(h) - x(-h)) / 2h.
    Central,
    /// The integration, forward, by each input and each unknown, joined by the implicit function theorem.
    Integrations,
}

/// A boundary value problem without analytic derivatives, in the same integrator as [`Paper`].
#[derive(Clone, Debug)]
pub struct Differences {
    integrator: Paper,
    scheme: Scheme,
    /// Step of the difference, without unit.
    step: f64,
}

/// Most corrections of an equilibrium that is solved again.
const CORRECTIONS: usize = 6;
/// A correction below this is round-off (rad).
pub(super) const SHARP: f64 = 1e-13;

/// Base curvature and the integration there.
type Solved = (Vector3<f64>, Passage);

impl Differences {
    /// With the step that balances truncation and round-off.
    pub fn new(rod: &Rod, steps: usize, scheme: Scheme) -> Differences {
        let step = match scheme {
            Scheme::Forward | Scheme::Integrations => f64::EPSILON.sqrt(),
            Scheme::Central => f64::EPSILON.cbrt(),
        };
        Self::with_step(rod, steps, scheme, step)
    }

    /// With a given step, in units of what bends the rod by a radian.
    pub fn with_step(rod: &Rod, steps: usize, scheme: Scheme, step: f64) -> Differences {
        Differences { integrator: Paper::new(rod, steps), scheme, step }
    }

    /// The integration at u0, and those with each component of u0 changed.
    fn by_base_curvature(&self, rod: &Rod, u0: Vector3<f64>) -> (Passage, [Passage; 3], f64) {
        let h = f64::EPSILON.sqrt() * (1.0 / rod.length()).max(u0.norm());
        let changed = [0, 1, 2].map(|k| self.integrator.integrate(rod, u0 + h * Vector3::ith(k, 1.0)));
        (self.integrator.integrate(rod, u0), changed, h)
    }

    /// The equilibrium of a rod near by, with the matrix of the old one, from the integration at a guess.
    fn again(&self, rod: &Rod, mut u0: Vector3<f64>, mut passage: Passage, inverse: &Matrix3<f64>) -> Solved {
        let mut last = f64::INFINITY;
        for _ in 0..CORRECTIONS {
            let step = -inverse * passage.residual;
            let size = step.norm() * rod.length();
            // Also ends on NaN.
            let shrinks = size < 0.5 * last && size > SHARP;
            if !shrinks {
                break;
            }
            u0 += step;
            passage = self.integrator.integrate(rod, u0);
            last = size;
        }
        (u0, passage)
    }
}

fn matrix(base: &Passage, changed: &[Passage; 3], h: f64) -> Matrix3<f64> {
    Matrix3::from_columns(&[0, 1, 2].map(|k| (changed[k].residual - base.residual) / h))
}

/// Rotation vector that turns one rotation into another near by, world frame.
pub(super) fn rotation_between(from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector3<f64> {
    let turn = (to - from) * from.transpose();
    0.5 * Vector3::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)])
}

impl Method for Differences {
    fn rest(&self, rod: &Rod) -> Vec<f64> {
        self.integrator.rest(rod)
    }

    fn newton_step(&self, rod: &Rod, unknowns: &[f64]) -> Option<NewtonStep> {
        let (base, changed, h) = self.by_base_curvature(rod, Vector3::from_column_slice(unknowns));
        let step = matrix(&base, &changed, h).lu().solve(&-base.residual)?;
        Some(NewtonStep { step: step.as_slice().to_vec(), size: step.norm() * rod.length() })
    }

    fn tip(&self, rod: &Rod, unknowns: &[f64]) -> Tip {
        self.integrator.tip(rod, unknowns)
    }

    fn jacobian(&self, rod: &Rod, unknowns: &[f64], inputs: &[Input]) -> Option<Jacobian> {
        let guess = Vector3::from_column_slice(unknowns);
        let (passage, changed, h) = self.by_base_curvature(rod, guess);
        let inverse = matrix(&passage, &changed, h).try_inverse()?;
        // What is left of the residual would be divided by the step.
        let (u0, here) = match self.scheme {
            Scheme::Forward => self.again(rod, guess, passage, &inverse),
            Scheme::Central | Scheme::Integrations => (guess, passage),
        };
        let moved = |input: &Input, by: f64| {
            let rod = rod.moved(input, by);
            let passage = self.integrator.integrate(&rod, u0);
            self.again(&rod, u0, passage, &inverse).1
        };
        let column = |input: &Input| {
            let by = self.step * rod.scale(input);
            let column =
                |from: &Passage, to: &Passage, by: f64| ((to.p - from.p) / by, rotation_between(&from.R, &to.R) / by);
            match self.scheme {
                Scheme::Forward => column(&here, &moved(input, by), by),
                Scheme::Central => column(&moved(input, -by), &moved(input, by), 2.0 * by),
                Scheme::Integrations => {
                    let there = self.integrator.integrate(&rod.moved(input, by), guess);
                    let du0 = -inverse * (there.residual - here.residual) / by; // (33)
                    let (mut dp, mut w) = column(&here, &there, by);
                    for (k, changed) in changed.iter().enumerate() {
                        let (dp_base, w_base) = column(&here, changed, h);
                        dp += du0[k] * dp_base;
                        w += du0[k] * w_base;
                    }
                    (dp, w)
                }
            }
        };
        let columns = inputs.iter().map(column).map(|(dp, w)| Column { dp: dp.into(), w: w.into() }).collect();
        Some(Jacobian { tip: method::tip(here.p, &here.R), columns })
    }
}
