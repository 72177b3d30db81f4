//! Sensitivity columns in threes: virtual rotation w, displacement dp and dM of each. J1 to J4.

use super::columns::{By, Columns, column_force, column_moment};
use super::program::Collect;
use super::section::{alike, to_world};
use super::segments::{Crossing, State, world_dipole};
use super::source::Source;
use super::step::{ColumnSlope, STAGES, Stages, Step};
use super::terms::Terms;
use super::trace::{Column, Trace, collect_integrals};
use crate::cpu::algebra::{
    Vec3, axpy, columns_axpy, columns_cross, columns_cross_add, columns_cross_sub, cross, cross_sub, dot, hat, outer,
};
use crate::cpu::simd::lane::Lane;

/// R diag(k) R^T x
#[inline(always)]
pub fn compliance_times<L: Lane>(
    terms: impl Terms,
    k: Vec3<L>,
    d1: Vec3<L>,
    d2: Vec3<L>,
    t: Vec3<L>,
    x: Vec3<L>,
) -> Vec3<L> {
    if terms.anisotropic() { principal_times(k, d1, d2, t, x) } else { axpy(dot(t, x) * (k.z - k.x), t, x * k.x) }
}

/// R diag(k) R^T x, any k.
#[inline(always)]
pub fn principal_times<L: Lane>(k: Vec3<L>, d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, x: Vec3<L>) -> Vec3<L> {
    let both = alike(k);
    let along = t * (dot(t, x) * (k.z - both));
    axpy(both, x, axpy(dot(d1, x) * (k.x - both), d1, axpy(dot(d2, x) * (k.y - both), d2, along)))
}

/// Takes three columns over one step whose stages are known, one after the other, or side by side in the place of the
/// first: a column's numbers stay in registers.
///
/// `source` is that of forward columns.
#[inline(always)]
pub fn step_columns<L: Lane, T: Terms>(
    step: &Step<'_, L, T>,
    stages: &mut Stages<L>,
    mut trace: Option<&mut Trace<L>>,
    collect: Collect,
    source: Option<&Source<L>>,
    columns: &mut Columns<L>,
) {
    let Step { terms, rod, segment, lambda, .. } = *step;
    let source = if terms.general() { source } else { None };
    let stage_count = stages.tableau.a.len();
    let weight = segment.w * lambda;
    let mu = segment.mu * lambda;
    for k in 0..step.turns {
        let start = (columns.w[k], columns.dp[k], columns.dM[k], columns.dn[k]);
        for i in 0..stage_count {
            let (mut w, mut dp, mut dM, mut dn) = start;
            for (ha, j) in stages.row(i) {
                let slope = &stages.column_slope[j];
                w = axpy(ha, slope.dw, w);
                dp = axpy(ha, slope.ddp, dp);
                if terms.load() {
                    dM = axpy(ha, slope.ddM, dM);
                }
            }
            let stage = &stages.stage[i % STAGES];
            if let Some(source) = source {
                dn = source.force(k, dn, step.h * step.h.constant(stages.tableau.c[i]));
            }
            let dm = column_moment(terms, columns.by, dn, stage.p, stage.n, dp, dM);
            let x = cross_sub(w, stage.m, dm);
            let compliance = segment.compliance_at(terms, stage.compliance);
            let mut dw = compliance_times(terms, compliance, stage.d1, stage.d2, stage.t, x); // J1
            let mut ddp = cross(w, stage.velocity(terms)); // J2
            if terms.general() && segment.shears {
                let y = column_force(columns.by, dn, stage.n, w);
                ddp = ddp + principal_times(segment.shear, stage.d1, stage.d2, stage.t, y); // J2
            }
            let mut ddM = dM;
            if terms.load() {
                ddM = cross(weight, dp); // J3
                if terms.general() && segment.has_magnet {
                    let mu_world = to_world(stage.d1, stage.d2, stage.t, mu);
                    ddM = cross_sub(cross(w, mu_world), rod.B, ddM); // J3
                }
            }
            if let Some(source) = source {
                let at = stages.tableau.c[i].mul_add(step.share, step.start);
                source.bend(k, at, compliance, stage, &mut dw); // J1
                source.shear(k, stage, &mut ddp); // J2
                if terms.load() {
                    source.couple(k, rod, segment, stage, &mut ddM); // J3
                }
            }
            if let (Some(trace), true) = (&mut trace, stages.tableau.b[i] != 0.0) {
                let column = Column { by: columns.by, w, x, dp, dn };
                collect_integrals(step, stages, i, collect, &column, k, trace);
            }
            stages.column_slope[i % STAGES] = ColumnSlope { dw, ddp, ddM };
        }
        let (mut w, mut dp, mut dM, mut dn) = start;
        for (hb, j) in stages.row(stage_count) {
            let slope = &stages.column_slope[j];
            w = axpy(hb, slope.dw, w);
            dp = axpy(hb, slope.ddp, dp);
            if terms.load() {
                dM = axpy(hb, slope.ddM, dM);
            }
        }
        if let Some(source) = source {
            dn = source.force(k, dn, step.h);
        }
        (columns.w[k], columns.dp[k], columns.dM[k], columns.dn[k]) = (w, dp, dM, dn);
    }
}

/// Takes three columns over a rigid segment; `state` and `n` are those before it.
#[inline(always)]
pub fn cross_rigid_columns<L: Lane, T: Terms>(
    crossing: &Crossing<'_, L, T>,
    n: Vec3<L>,
    state: &State<L>,
    source: Option<&Source<L>>,
    columns: &mut Columns<L>,
) {
    let Crossing { terms, rod, segment, lambda, force_arm } = *crossing;
    let source = if terms.general() { source } else { None };
    let (length, t) = (segment.length, state.t);
    let half = length.constant(0.5);
    let mut arm = columns_cross(columns.w, t) * length;
    if let Some(source) = source {
        arm = outer(t, source.dL, arm);
    }
    let dp = columns.dp;
    if segment.has_dipole {
        let mu_world = world_dipole(segment, state, lambda);
        let dtau = columns_cross(columns_cross(columns.w, mu_world), rod.B);
        columns.dM = columns.dM - dtau; // J4
    }
    columns.dp = dp + arm; // J4
    let mut n_after = n;
    if terms.load() {
        let weight = segment.w * lambda;
        let middle = if force_arm { columns_axpy(half, arm, dp) } else { dp };
        columns.dM = columns_cross_sub(middle, weight, columns.dM); // J4
        n_after = n - weight;
    }
    if let Some(source) = source {
        source.cross_rigid(rod, segment, force_arm, state, columns); // J4
    }
    if !force_arm {
        if terms.force() {
            columns.dM = columns_cross_add(arm, n_after, columns.dM);
        }
        match columns.by {
            By::BaseMoment | By::BaseRotation => {}
            By::TipForce => columns.dM = columns.dM + hat(t * length),
            By::Parameters => columns.dM = columns_cross_sub(columns.dn, t * length, columns.dM),
        }
    }
}

/// Takes three columns over the unloaded distal part: it turns and moves as a rigid body.
#[inline(always)]
pub fn cross_free_columns<L: Lane>(state: &State<L>, p_tip: Vec3<L>, columns: &mut Columns<L>) {
    columns.dp = columns.dp + columns_cross(columns.w, p_tip - state.p); // R6
}
