//! Columns by parameters where the rod begins and where a flexible segment ends. F2, J4

use super::parameters::Parameters;
use super::space::Space;
use super::state::{Columns, State};
use crate::cpu::algebra::{Mat3, Vec3, cross, cross_sub, outer};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::section::{Flexible, curvature, to_world, velocity};
use crate::cpu::rod::segments::Segment;
use crate::cpu::simd::lane::Lane;

/// Columns by three parameters at the base, its load held.
#[inline(always)]
pub fn base_columns<L: Lane>(problem: &Problem<'_, L>, parameters: &Parameters<L>, state: &State<L>) -> Columns<L> {
    let (terms, sources) = (problem.program.terms, &parameters.sources);
    let zero = Mat3::zero(state.m.x);
    let (mut w, mut dp) = (sources.w0, sources.dp0);
    if let Some(Segment::Flexible(first)) = problem.rod.segments.first() {
        let d2 = cross(state.t, state.d1);
        let omega = curvature(terms, &first.section(terms, 0.0), state.d1, d2, state.t, state.m);
        w = outer(omega, sources.insertion, w);
        dp = outer(velocity(terms, first, state.d1, d2, state.t, state.n), sources.insertion, dp);
    }
    Columns { w, dp, dm: zero, dn: zero }
}

/// More of a flexible segment at its distal end, where the state stands.
#[inline(always)]
pub fn lengthen<L: Lane>(
    space: &Space<L>,
    problem: &Problem<'_, L>,
    segment: &Flexible<L>,
    state: &State<L>,
    dL: &Vec3<L>,
    columns: &mut Columns<L>,
) {
    let terms = problem.program.terms;
    let State { d1, t, m, n, .. } = *state;
    let d2 = cross(t, d1);
    let omega = curvature(terms, &segment.section(terms, 1.0), d1, d2, t, m);
    let v = velocity(terms, segment, d1, d2, t, n);
    let (dm, dn) = slopes(space, segment, state, v);
    columns.w = outer(omega, *dL, columns.w);
    columns.dp = outer(v, *dL, columns.dp);
    columns.dm = outer(dm, *dL, columns.dm);
    columns.dn = outer(dn, *dL, columns.dn);
}

/// m' and n' under the full load, where p' is `v`. F2
#[inline(always)]
pub fn slopes<L: Lane>(space: &Space<L>, segment: &Flexible<L>, state: &State<L>, v: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
    let State { p, d1, t, n, .. } = *state;
    let (mut dm, mut dn) = (cross(n, v), -segment.w);
    if segment.has_magnet {
        let mu = to_world(d1, cross(t, d1), t, segment.mu);
        let (B, G) = space.field(p);
        dm = cross_sub(mu, B, dm);
        dn = dn - G * mu;
    }
    (dm, dn)
}
