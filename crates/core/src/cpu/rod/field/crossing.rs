//! A rigid segment in a field that varies. F1, F3, F4, F6

use super::space::Space;
use super::state::State;
use crate::cpu::algebra::{Vec3, axpy, cross, cross_sub};
use crate::cpu::rod::section::to_world;
use crate::cpu::rod::segments::Rigid;
use crate::cpu::simd::lane::Lane;

/// A rigid segment under part of its loads, and the state before it.
pub struct Crossing<'a, L: Lane> {
    pub space: &'a Space<L>,
    pub segment: &'a Rigid<L>,
    pub lambda: L,
    /// Shares of its length and of its dipole.
    pub points: &'a [(f64, f64)],
    /// Whether forces act on lever arms.
    pub force_arm: bool,
    pub before: State<L>,
}

impl<L: Lane> Crossing<'_, L> {
    /// Mean of the places of its points.
    #[inline(always)]
    pub fn mean(&self) -> L {
        self.lambda.constant(self.points.iter().map(|(xi, share)| xi * share).sum())
    }

    /// R mu
    #[inline(always)]
    pub fn dipole(&self) -> Vec3<L> {
        let State { d1, t, .. } = self.before;
        to_world(d1, cross(t, d1), t, self.segment.mu) * self.lambda
    }

    /// A load of it in the world frame.
    #[inline(always)]
    pub fn in_world(&self, load: Vec3<L>) -> Vec3<L> {
        let State { d1, t, .. } = self.before;
        if self.segment.follows { to_world(d1, cross(t, d1), t, load) } else { load } // F11
    }

    /// Its force.
    #[inline(always)]
    pub fn load(&self) -> Vec3<L> {
        self.in_world(self.segment.w) * self.lambda
    }

    /// Its couple.
    #[inline(always)]
    pub fn couple(&self) -> Vec3<L> {
        self.in_world(self.segment.c) * self.lambda
    }

    /// The state beyond it.
    #[inline(always)]
    pub fn cross(&self) -> State<L> {
        let Crossing { space, segment, lambda, force_arm, before, .. } = self;
        let State { p, d1, t, mut m, mut n } = *before;
        let (arm, load) = (t * segment.length, self.load());
        let half = lambda.constant(0.5);
        n = n - load;
        if segment.has_dipole {
            let (mu, zero) = (self.dipole(), Vec3::splat(lambda.constant(0.0)));
            let (mut B, mut force, mut first) = (zero, zero, zero);
            for (xi, share) in self.points {
                let (xi, share) = (lambda.constant(*xi), lambda.constant(*share));
                let (at_point, pull) = space.acts(axpy(xi, arm, p), mu); // F1
                B = axpy(share, at_point, B);
                force = axpy(share, pull, force);
                first = axpy(share * xi, pull, first);
            }
            for map in &space.maps {
                for (xi, share) in map.places(p, arm, self.points) {
                    let local = map.local(axpy(xi, arm, p), 2);
                    let share = share * map.scale;
                    let pull = local.G * mu; // F1
                    B = axpy(share, local.B, B);
                    force = axpy(share, pull, force);
                    first = axpy(share * xi, pull, first);
                }
            }
            n = n - force;
            m = cross_sub(mu, B, m); // F3, F4
            if *force_arm {
                m = cross_sub(arm, first, m); // F3, F4
            }
        }
        if *force_arm {
            m = cross_sub(arm, axpy(half, load, n), m); // F3, F4
        }
        if segment.has_couple {
            m = m - self.couple();
        }
        State { p: p + arm, d1, t, m, n }
    }
}
