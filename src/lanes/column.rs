//! Sensitivity columns in threes: virtual rotation w, displacement dp and dM of each. J1 to J4.

use super::algebra::{
    Mat3, Vec3, axpy, columns_axpy, columns_cross, columns_cross_add, columns_cross_sub, cross, hat, row_times,
};
use super::lane::Lane;
use super::rod::{Flexible, Rigid, Rod, State, Terms, world_dipole};
use super::step::Stages;

/// Three columns; those of a unit tip force carry dn = e_k.
#[derive(Clone, Copy, Debug)]
pub struct Columns<L> {
    pub w: Mat3<L>,
    pub dp: Mat3<L>,
    pub dM: Mat3<L>,
    pub unit_force: bool,
}

/// What three columns leave behind on a segment; `row[j]` holds component j of each column.
#[derive(Clone, Copy, Debug)]
pub struct Trace<L> {
    /// Integral of dm_b,j.
    pub rest_curvature: [Vec3<L>; 3],
    /// Integral of dm_b,j m_b,j.
    pub stiffness: [Vec3<L>; 3],
    /// Integral of dp_j.
    pub load: [Vec3<L>; 3],
    /// w . (R e_j x B) on a rigid segment.
    pub dipole: [Vec3<L>; 3],
    /// (w x R mu)_j on a rigid segment.
    pub field: [Vec3<L>; 3],
    /// Change of H at the distal end.
    pub length: Vec3<L>,
}

impl<L: Lane> Trace<L> {
    #[inline(always)]
    pub fn zero(zero: L) -> Self {
        let v = Vec3::splat(zero);
        let rows = [v; 3];
        Self { rest_curvature: rows, stiffness: rows, load: rows, dipole: rows, field: rows, length: v }
    }
}

/// dm of three columns, from dM.
#[inline(always)]
pub fn column_moment<L: Lane, T: Terms>(unit_force: bool, p: Vec3<L>, n: Vec3<L>, dp: Mat3<L>, dM: Mat3<L>) -> Mat3<L> {
    let dm = if unit_force { dM - hat(p) } else { dM }; // J3
    if T::FORCE { columns_cross_sub(dp, n, dm) } else { dm } // J3
}

/// `a row^T + sum`
#[inline(always)]
fn outer<L: Lane>(a: Vec3<L>, row: Vec3<L>, sum: Mat3<L>) -> Mat3<L> {
    Mat3 { x: axpy(row.x, a, sum.x), y: axpy(row.y, a, sum.y), z: axpy(row.z, a, sum.z) }
}

/// C x = R K^-1 R^T x for three vectors.
#[inline(always)]
fn compliance_times<L: Lane, T: Terms>(
    segment: &Flexible<L>,
    d1: Vec3<L>,
    d2: Vec3<L>,
    t: Vec3<L>,
    x: Mat3<L>,
) -> Mat3<L> {
    let k = segment.compliance;
    if T::ANISOTROPIC {
        let (x1, x2, x3) = (row_times(d1, x) * k.x, row_times(d2, x) * k.y, row_times(t, x) * k.z);
        let sum = Mat3 { x: t * x3.x, y: t * x3.y, z: t * x3.z };
        outer(d1, x1, outer(d2, x2, sum))
    } else {
        outer(t, row_times(t, x) * (k.z - k.x), x * k.x)
    }
}

/// Takes three columns over one step whose stages are known.
#[inline(always)]
pub fn step_columns<L: Lane, T: Terms>(
    segment: &Flexible<L>,
    lambda: L,
    stages: &mut Stages<L>,
    trace: Option<&mut Trace<L>>,
    collect: super::program::Collect,
    columns: &mut Columns<L>,
) {
    let stage_count = stages.tableau.a.len();
    let mut at = 0;
    let weight = segment.w * lambda;
    for i in 0..stage_count {
        let (mut w, mut dp, mut dM) = (columns.w, columns.dp, columns.dM);
        for j in 0..i {
            let ha = stages.ha[at + j];
            w = columns_axpy(ha, stages.dw[j], w);
            dp = columns_axpy(ha, stages.ddp[j], dp);
            if T::LOAD {
                dM = columns_axpy(ha, stages.ddM[j], dM);
            }
        }
        at += i;
        let stage = &stages.stage[i];
        let dm = column_moment::<L, T>(columns.unit_force, stage.p, stage.n, dp, dM);
        let x = columns_cross_sub(w, stage.m, dm);
        stages.dw[i] = compliance_times::<L, T>(segment, stage.d1, stage.d2, stage.t, x); // J1
        stages.ddp[i] = columns_cross(w, stage.t); // J2
        if T::LOAD {
            stages.ddM[i] = -columns_cross(dp, weight); // J3
        }
        stages.x[i] = x;
        stages.dp[i] = dp;
    }
    for j in 0..stage_count {
        let hb = stages.ha[at + j];
        columns.w = columns_axpy(hb, stages.dw[j], columns.w);
        columns.dp = columns_axpy(hb, stages.ddp[j], columns.dp);
        if T::LOAD {
            columns.dM = columns_axpy(hb, stages.ddM[j], columns.dM);
        }
    }
    if let Some(trace) = trace {
        collect_integrals(stages, at, collect, trace);
    }
}

/// Adds a step's part of the integrals that the derivatives need, with the stepper's own weights.
#[inline(always)]
fn collect_integrals<L: Lane>(
    stages: &Stages<L>,
    weights: usize,
    collect: super::program::Collect,
    trace: &mut Trace<L>,
) {
    for i in 0..stages.tableau.a.len() {
        let (hb, stage) = (stages.ha[weights + i], &stages.stage[i]);
        if collect.rest_curvature || collect.stiffness {
            for (j, d) in [stage.d1, stage.d2, stage.t].into_iter().enumerate() {
                let dm_body = row_times(d, stages.x[i]) * hb;
                trace.rest_curvature[j] = trace.rest_curvature[j] + dm_body;
                trace.stiffness[j] = axpy(super::algebra::dot(d, stage.m), dm_body, trace.stiffness[j]);
            }
        }
        if collect.load {
            let dp = super::algebra::transpose(stages.dp[i]);
            for (j, row) in [dp.x, dp.y, dp.z].into_iter().enumerate() {
                trace.load[j] = axpy(hb, row, trace.load[j]);
            }
        }
    }
}

/// Change of H = m_b . K^-1 m_b / 2 + m_b . u* + n . t at the distal end of a segment.
///
/// `curvature` is R u there; on a rigid segment there is none.
#[inline(always)]
pub fn length_row<L: Lane, T: Terms>(
    state: &State<L>,
    m: Vec3<L>,
    n: Vec3<L>,
    w: Vec3<L>,
    curvature: Option<Vec3<L>>,
    columns: &Columns<L>,
) -> Vec3<L> {
    let zero = Vec3::splat(n.x.constant(0.0));
    let mut row = if columns.unit_force { state.t } else { zero };
    if let Some(curvature) = curvature {
        let dm = column_moment::<L, T>(columns.unit_force, state.p, n, columns.dp, columns.dM);
        row = row + row_times(curvature, columns_cross_sub(columns.w, m, dm));
    }
    if T::FORCE {
        row = row + row_times(n, columns_cross(columns.w, state.t));
    }
    if T::LOAD {
        row = row + row_times(w, columns.dp);
    }
    row
}

/// Takes three columns over a rigid segment; `state` and `n` are those before it.
#[inline(always)]
pub fn cross_rigid_columns<L: Lane, T: Terms>(
    rod: &Rod<L>,
    segment: &Rigid<L>,
    lambda: L,
    force_arm: bool,
    n: Vec3<L>,
    state: &State<L>,
    columns: &mut Columns<L>,
) {
    let (length, t) = (segment.length, state.t);
    let mu_world = world_dipole(segment, state, lambda);
    let wt = columns_cross(columns.w, t);
    let dtau = columns_cross(columns_cross(columns.w, mu_world), rod.B);
    let dp = columns.dp;
    columns.dM = columns.dM - dtau; // J4
    columns.dp = columns_axpy(length, wt, dp); // J4
    let mut n_after = n;
    if T::LOAD {
        let weight = segment.w * (lambda * length);
        let middle = if force_arm { columns_axpy(length * length.constant(0.5), wt, dp) } else { dp };
        columns.dM = columns_cross_sub(middle, weight, columns.dM); // J4
        n_after = n - weight;
    }
    if !force_arm {
        if T::FORCE {
            columns.dM = columns_cross_add(wt * length, n_after, columns.dM);
        }
        if columns.unit_force {
            columns.dM = columns.dM + hat(t * length);
        }
    }
}

/// What a coil contributes: w . (R e_j x B) and (w x R mu)_j.
#[inline(always)]
pub fn collect_coil<L: Lane>(
    rod: &Rod<L>,
    segment: &Rigid<L>,
    lambda: L,
    state: &State<L>,
    columns: &Columns<L>,
    trace: &mut Trace<L>,
) {
    let d2 = cross(state.t, state.d1);
    for (j, d) in [state.d1, d2, state.t].into_iter().enumerate() {
        trace.dipole[j] = row_times(cross(d, rod.B), columns.w);
    }
    let mu_world = world_dipole(segment, state, lambda);
    let field = super::algebra::transpose(columns_cross(columns.w, mu_world));
    trace.field = [field.x, field.y, field.z];
}
