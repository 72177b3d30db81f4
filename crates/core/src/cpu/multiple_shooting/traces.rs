//! What columns leave on intervals, and what responses make of it: only what rows of the Jacobian ask for.

use super::state::Nodes;
use crate::cpu::algebra::{Mat3, Vec3, axpy, row_times, transpose};
use crate::cpu::rod::program::{Collect, Program};
use crate::cpu::rod::segments::Segment;
use crate::cpu::rod::trace::Trace;
use crate::cpu::simd::lane::Lane;

impl<L: Lane> Nodes<L> {
    /// Keeps what the columns have left on the segments of one interval, after those of the intervals before.
    #[inline(always)]
    pub fn keep_traces(&mut self, program: &Program, traces: &mut [[Trace<L>; 3]]) {
        let segments = self.alone.first..self.alone.first + self.alone.segments.len();
        for (collect, columns) in program.collect[segments.clone()].iter().zip(&mut traces[segments]) {
            columns.iter_mut().for_each(|trace| trace.keep(*collect, &mut self.traces));
        }
    }
}

/// Three responses at the start of an interval; one of them may drive it.
#[derive(Clone, Copy)]
pub struct Response<L> {
    pub w: Mat3<L>,
    pub mu: Mat3<L>,
    pub drives: bool,
}

impl<L: Lane> Response<L> {
    /// A row of theirs, from the same row of the columns by moment, by what drives, by rotation.
    #[inline(always)]
    fn row(&self, by_moment: Vec3<L>, by_drive: Vec3<L>, by_rotation: Vec3<L>) -> Vec3<L> {
        let sum = row_times(by_moment, self.mu) + row_times(by_rotation, self.w);
        if self.drives { sum + by_drive } else { sum }
    }

    /// Rows of theirs, likewise, from rows of all three.
    #[inline(always)]
    fn rows(&self, a: &[Vec3<L>; 3], b: &[Vec3<L>; 3], c: &[Vec3<L>; 3]) -> [Vec3<L>; 3] {
        [self.row(a[0], b[0], c[0]), self.row(a[1], b[1], c[1]), self.row(a[2], b[2], c[2])]
    }
}

/// `s a + b`, row by row.
#[inline(always)]
fn add_rows<L: Lane>(s: L, a: [Vec3<L>; 3], b: &mut [Vec3<L>; 3]) {
    *b = [axpy(s, a[0], b[0]), axpy(s, a[1], b[1]), axpy(s, a[2], b[2])];
}

impl<L: Lane> Trace<L> {
    /// Its integrals that are collected.
    #[inline(always)]
    fn collected(&mut self, collect: Collect) -> impl Iterator<Item = &mut Vec3<L>> {
        let Collect { rest_curvature, stiffness, rise, .. } = collect;
        let integrals = [
            (rest_curvature, &mut self.rest_curvature),
            (rest_curvature && rise, &mut self.rest_curvature_rise),
            (stiffness, &mut self.stiffness),
            (stiffness && rise, &mut self.stiffness_rise),
            (collect.shear_compliance, &mut self.shear_compliance),
            (collect.load, &mut self.load),
            (collect.dipole, &mut self.dipole),
            (collect.field, &mut self.field),
        ];
        let rows = integrals.into_iter().filter(|(is_collected, _)| *is_collected).flat_map(|(_, rows)| rows);
        rows.chain(collect.length.then_some(&mut self.length))
    }

    /// Puts them after others.
    #[inline(always)]
    fn keep(&mut self, collect: Collect, kept: &mut Vec<Vec3<L>>) {
        kept.extend(self.collected(collect).map(|row| *row));
    }

    /// And back, the next of those that were kept.
    #[inline(always)]
    pub fn take_back<'a>(&mut self, collect: Collect, kept: &mut impl Iterator<Item = &'a Vec3<L>>) {
        self.collected(collect).zip(kept).for_each(|(to, from)| *to = *from);
    }

    /// Adds what responses leave on an interval, from what its columns leave: by moment, by what drives, by rotation. It sees
    /// displacements from its start alone; that has moved by `dp`.
    #[inline(always)]
    pub fn add(
        &mut self,
        [a, b, c]: &[Self; 3],
        collect: Collect,
        response: &Response<L>,
        piece: Option<(L, L, bool)>,
        segment: &Segment<L>,
        dp: Mat3<L>,
    ) {
        let one = dp.x.x.constant(1.0);
        if collect.rest_curvature {
            let part = response.rows(&a.rest_curvature, &b.rest_curvature, &c.rest_curvature);
            add_rows(one, part, &mut self.rest_curvature);
            if let (Some((start, share, _)), true) = (piece, collect.rise) {
                let rise = response.rows(&a.rest_curvature_rise, &b.rest_curvature_rise, &c.rest_curvature_rise);
                add_rows(start, part, &mut self.rest_curvature_rise);
                add_rows(share, rise, &mut self.rest_curvature_rise);
            }
        }
        if collect.stiffness {
            let part = response.rows(&a.stiffness, &b.stiffness, &c.stiffness);
            add_rows(one, part, &mut self.stiffness);
            if let (Some((start, share, _)), true) = (piece, collect.rise) {
                let rise = response.rows(&a.stiffness_rise, &b.stiffness_rise, &c.stiffness_rise);
                add_rows(start, part, &mut self.stiffness_rise);
                add_rows(share, rise, &mut self.stiffness_rise);
            }
        }
        if collect.shear_compliance {
            let part = response.rows(&a.shear_compliance, &b.shear_compliance, &c.shear_compliance);
            add_rows(one, part, &mut self.shear_compliance);
        }
        if collect.load {
            let length = match (piece, segment) {
                (Some((_, share, _)), Segment::Flexible(flexible)) => flexible.length * share,
                _ => one,
            };
            let moved = transpose(dp);
            add_rows(one, response.rows(&a.load, &b.load, &c.load), &mut self.load);
            add_rows(length, [moved.x, moved.y, moved.z], &mut self.load);
        }
        if collect.dipole {
            add_rows(one, response.rows(&a.dipole, &b.dipole, &c.dipole), &mut self.dipole);
        }
        if collect.field {
            add_rows(one, response.rows(&a.field, &b.field, &c.field), &mut self.field);
        }
        if collect.length {
            let part = response.row(a.length, b.length, c.length);
            match (piece, segment) {
                (Some((_, _, true)), Segment::Flexible(flexible)) => {
                    self.length = part + row_times(flexible.w, dp);
                }
                (None, _) => self.length = part,
                _ => {}
            }
        }
    }
}
