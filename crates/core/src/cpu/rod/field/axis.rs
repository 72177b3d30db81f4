//! How the axis of the rod runs at a station: its place, and two derivatives by the length. R1, R5

use super::ends::slopes;
use super::space::Space;
use super::state::State;
use crate::cpu::algebra::{Vec3, cross};
use crate::cpu::contact::course::Course;
use crate::cpu::rod::section::{Flexible, curvature, velocity};
use crate::cpu::rod::terms::Terms;
use crate::cpu::simd::lane::Lane;

/// How the axis of a flexible segment runs at a share of its length, under the full load.
#[inline(always)]
pub fn bent<L: Lane>(
    terms: impl Terms,
    space: &Space<L>,
    segment: &Flexible<L>,
    share: f64,
    state: &State<L>,
) -> Course<L> {
    let State { p, d1, t, m, n } = *state;
    let d2 = cross(t, d1);
    let omega = curvature(terms, &segment.section(terms, share), d1, d2, t, m);
    let v = velocity(terms, segment, d1, d2, t, n);
    let mut bend = cross(omega, v);
    if segment.shears {
        // Beyond the turn of the section: shear and stretch by how the force changes in it.
        let turned = slopes(space, segment, state, v).1 - cross(omega, n);
        bend = bend + (velocity(terms, segment, d1, d2, t, turned) - t);
    }
    Course { p, v, bend }
}

/// How the axis of a rigid segment runs.
#[inline(always)]
pub fn straight<L: Lane>(state: &State<L>) -> Course<L> {
    Course { p: state.p, v: state.t, bend: Vec3::splat(state.p.x.constant(0.0)) }
}
