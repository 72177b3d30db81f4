//! What columns leave behind along the rod: the integrals and values that rows of the Jacobian are made of.

use super::columns::{By, Columns, column_force};
use super::program::Collect;
use super::section::{Flexible, to_world};
use super::segments::{Crossing, Rod, State, world_dipole};
use super::step::{Stages, Step};
use super::terms::Terms;
use crate::cpu::algebra::{
    Mat3, Vec3, axpy, columns_axpy, columns_cross, columns_cross_sub, cross, dot, row_times, transpose,
};
use crate::cpu::simd::lane::Lane;

/// What three columns leave behind on a segment; `row[j]` holds component j of each column.
#[derive(Clone, Copy, Debug)]
pub struct Trace<L> {
    /// Integral of dm_b,j; the same times s / length.
    pub rest_curvature: [Vec3<L>; 3],
    pub rest_curvature_rise: [Vec3<L>; 3],
    /// Integral of -dm_b,j m_b,j / K_j²; the same times s / length.
    pub stiffness: [Vec3<L>; 3],
    pub stiffness_rise: [Vec3<L>; 3],
    /// Integral of dn_b,j n_b,j.
    pub shear_compliance: [Vec3<L>; 3],
    /// Integral of dp_j on a flexible segment, dp_j in the middle of a rigid one.
    pub load: [Vec3<L>; 3],
    /// w . (R e_j x B): its integral on a flexible segment, its value on a rigid one.
    pub dipole: [Vec3<L>; 3],
    /// (w x R mu)_j, likewise.
    pub field: [Vec3<L>; 3],
    /// Change of H at the distal end.
    pub length: Vec3<L>,
}

impl<L: Lane> Trace<L> {
    pub fn zero(zero: L) -> Self {
        let v = Vec3::splat(zero);
        let rows = [v; 3];
        Self {
            rest_curvature: rows,
            rest_curvature_rise: rows,
            stiffness: rows,
            stiffness_rise: rows,
            shear_compliance: rows,
            load: rows,
            dipole: rows,
            field: rows,
            length: v,
        }
    }

    /// Empties what will be collected.
    #[inline(always)]
    pub fn clear(&mut self, collect: Collect, zero: L) {
        let rows = [Vec3::splat(zero); 3];
        if collect.rest_curvature || collect.stiffness {
            (self.rest_curvature, self.stiffness) = (rows, rows);
            (self.rest_curvature_rise, self.stiffness_rise) = (rows, rows);
        }
        for (is_collected, integral) in [
            (collect.shear_compliance, &mut self.shear_compliance),
            (collect.load, &mut self.load),
            (collect.dipole, &mut self.dipole),
            (collect.field, &mut self.field),
        ] {
            if is_collected {
                *integral = rows;
            }
        }
    }
}

/// One column at one stage.
pub struct Column<L> {
    pub by: By,
    pub w: Vec3<L>,
    /// dm - w x m
    pub x: Vec3<L>,
    pub dp: Vec3<L>,
    pub dn: Vec3<L>,
}

/// Adds a stage's part of the integrals that the derivatives need, with the stepper's own weight, for column `k`.
#[inline(always)]
pub fn collect_integrals<L: Lane, T: Terms>(
    step: &Step<'_, L, T>,
    stages: &Stages<L>,
    i: usize,
    collect: Collect,
    column: &Column<L>,
    k: usize,
    trace: &mut Trace<L>,
) {
    let Step { terms, rod, segment, .. } = *step;
    let hb = step.h * step.h.constant(stages.tableau.b[i]);
    let stage = &stages.stage[i];
    let share = hb.constant(stages.tableau.c[i].mul_add(step.share, step.start));
    let directors = [stage.d1, stage.d2, stage.t];
    if collect.rest_curvature || collect.stiffness {
        for (j, d) in directors.into_iter().enumerate() {
            let dm_body = dot(d, column.x) * hb;
            let strain = stages.strain[i][j];
            trace.rest_curvature[j][k] = trace.rest_curvature[j][k] + dm_body;
            trace.stiffness[j][k] = strain.mul_add(dm_body, trace.stiffness[j][k]);
            if terms.general() && collect.rise {
                trace.rest_curvature_rise[j][k] = share.mul_add(dm_body, trace.rest_curvature_rise[j][k]);
                trace.stiffness_rise[j][k] = (strain * share).mul_add(dm_body, trace.stiffness_rise[j][k]);
            }
        }
    }
    if terms.general() && collect.shear_compliance {
        let y = column_force(column.by, column.dn, stage.n, column.w);
        for (j, d) in directors.into_iter().enumerate() {
            let n_body = dot(d, stage.n) * hb;
            trace.shear_compliance[j][k] = n_body.mul_add(dot(d, y), trace.shear_compliance[j][k]);
        }
    }
    if collect.load {
        for j in 0..3 {
            trace.load[j][k] = hb.mul_add(column.dp[j], trace.load[j][k]);
        }
    }
    if terms.general() && collect.dipole {
        for (j, d) in directors.into_iter().enumerate() {
            trace.dipole[j][k] = hb.mul_add(dot(cross(d, rod.B), column.w), trace.dipole[j][k]);
        }
    }
    if terms.general() && collect.field && segment.has_magnet {
        let torque = cross(column.w, to_world(stage.d1, stage.d2, stage.t, segment.mu));
        for j in 0..3 {
            trace.field[j][k] = hb.mul_add(torque[j], trace.field[j][k]);
        }
    }
}

/// -m_b,j / K_j² at every stage.
#[inline(always)]
pub fn set_strains<L: Lane>(terms: impl Terms, segment: &Flexible<L>, stages: &mut Stages<L>) {
    for i in 0..stages.tableau.b.len() {
        let stage = &stages.stage[i];
        let k = segment.compliance_at(terms, stage.compliance);
        let m_body = Vec3 { x: dot(stage.d1, stage.m), y: dot(stage.d2, stage.m), z: dot(stage.t, stage.m) };
        stages.strain[i] = -(m_body * k * k);
    }
}

/// Adds the rows of three columns, times a factor.
#[inline(always)]
fn add_rows<L: Lane>(factor: L, columns: Mat3<L>, sum: [Vec3<L>; 3]) -> [Vec3<L>; 3] {
    let rows = transpose(columns);
    [axpy(factor, rows.x, sum[0]), axpy(factor, rows.y, sum[1]), axpy(factor, rows.z, sum[2])]
}

/// Change of H = m_b . K^-1 m_b / 2 + m_b . u* + n . t + n_b . Kse^-1 n_b / 2 at the distal end of a flexible segment.
///
/// `omega` is R u there and `v` p'.
#[inline(always)]
pub fn length_row<L: Lane>(
    terms: impl Terms,
    rod: &Rod<L>,
    segment: &Flexible<L>,
    state: &State<L>,
    (m, n): (Vec3<L>, Vec3<L>),
    (omega, v): (Vec3<L>, Vec3<L>),
    columns: &Columns<L>,
) -> Vec3<L> {
    let dm = columns.moment(terms, state.p, n);
    let mut row = row_times(omega, columns_cross_sub(columns.w, m, dm));
    if columns.by == By::TipForce {
        row = row + v;
    }
    if terms.force() {
        row = row + row_times(n, columns_cross(columns.w, v));
    }
    if terms.load() {
        row = row + row_times(segment.w, columns.dp);
        if terms.general() && segment.has_magnet {
            let mu_world = to_world(state.d1, cross(state.t, state.d1), state.t, segment.mu);
            row = row + row_times(rod.B, columns_cross(columns.w, mu_world));
        }
    }
    row
}

/// What three columns leave on a rigid segment; `state` and `columns` are those at its proximal end, `n` is the force
/// at its distal end.
#[inline(always)]
pub fn collect_rigid<L: Lane, T: Terms>(
    crossing: &Crossing<'_, L, T>,
    state: &State<L>,
    n: Vec3<L>,
    columns: &Columns<L>,
    trace: &mut Trace<L>,
) {
    let Crossing { terms, rod, segment, .. } = *crossing;
    let half = segment.length.constant(0.5);
    let (w, d2) = (columns.w, cross(state.t, state.d1));
    for (j, d) in [state.d1, d2, state.t].into_iter().enumerate() {
        trace.dipole[j] = row_times(cross(d, rod.B), w);
    }
    let mu_world = world_dipole(segment, state, half.constant(1.0));
    let zero = [Vec3::splat(half.constant(0.0)); 3];
    let one = half.constant(1.0);
    trace.field = add_rows(one, columns_cross(w, mu_world), zero);
    let wt = columns_cross(w, state.t);
    trace.load = add_rows(one, columns_axpy(segment.length * half, wt, columns.dp), zero);
    trace.length = if columns.by == By::TipForce { state.t } else { zero[0] };
    if terms.force() {
        trace.length = trace.length + row_times(axpy(half, segment.w, n), wt);
    }
}
