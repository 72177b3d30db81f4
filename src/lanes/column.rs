//! Sensitivity columns in threes: virtual rotation w, displacement dp and dM of each. J1 to J4.

use super::algebra::{
    Mat3, Vec3, columns_axpy, columns_cross, columns_cross_add, columns_cross_sub, hat, outer, row_times,
};
use super::lane::Lane;
use super::program::Collect;
use super::rod::{Rigid, Rod, State, Terms, world_dipole};
use super::section::{Flexible, to_world};
use super::source::Source;
use super::step::{Stages, Step};
use super::trace::{Trace, collect_integrals};

/// Three columns.
#[derive(Clone, Copy, Debug)]
pub struct Columns<L> {
    pub w: Mat3<L>,
    pub dp: Mat3<L>,
    pub dM: Mat3<L>,
    pub force: Force,
    /// dn where the force is `Forward`.
    pub dn: Mat3<L>,
}

/// How three columns change the internal force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Force {
    /// Not at all.
    None,
    /// dn = e_k all along the rod.
    Unit,
    /// As the sources of forward columns say.
    Forward,
}

/// dm of three columns, from dM.
#[inline(always)]
pub fn column_moment<L: Lane, T: Terms>(
    force: Force,
    dn: &Mat3<L>,
    p: Vec3<L>,
    n: Vec3<L>,
    dp: Mat3<L>,
    dM: Mat3<L>,
) -> Mat3<L> {
    let mut dm = dM;
    if force == Force::Unit {
        dm = dm - hat(p); // J3
    }
    if T::GENERAL && force == Force::Forward {
        dm = columns_cross_add(*dn, p, dm); // J3
    }
    if T::FORCE { columns_cross_sub(dp, n, dm) } else { dm } // J3
}

/// dn - w x n of three columns: what the force changes by in the body frame.
#[inline(always)]
pub fn column_force<L: Lane>(force: Force, dn: &Mat3<L>, n: Vec3<L>, w: Mat3<L>) -> Mat3<L> {
    let turned = columns_cross(w, n);
    match force {
        Force::None => -turned,
        Force::Unit => Mat3::identity(n.x) - turned,
        Force::Forward => *dn - turned,
    }
}

/// R diag(k) R^T x for three vectors.
#[inline(always)]
fn compliance_times<L: Lane, T: Terms>(k: Vec3<L>, d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, x: Mat3<L>) -> Mat3<L> {
    if T::ANISOTROPIC { principal_times(k, d1, d2, t, x) } else { outer(t, row_times(t, x) * (k.z - k.x), x * k.x) }
}

/// R diag(k) R^T x, any k.
#[inline(always)]
fn principal_times<L: Lane>(k: Vec3<L>, d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, x: Mat3<L>) -> Mat3<L> {
    let (x1, x2, x3) = (row_times(d1, x) * k.x, row_times(d2, x) * k.y, row_times(t, x) * k.z);
    let sum = Mat3 { x: t * x3.x, y: t * x3.y, z: t * x3.z };
    outer(d1, x1, outer(d2, x2, sum))
}

/// Takes three columns over one step whose stages are known; `source` is that of forward columns.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub fn step_columns<L: Lane, T: Terms>(
    rod: &Rod<L>,
    segment: &Flexible<L>,
    lambda: L,
    step: &Step<L>,
    stages: &mut Stages<L>,
    trace: Option<&mut Trace<L>>,
    collect: Collect,
    source: Option<&Source<L>>,
    columns: &mut Columns<L>,
) {
    let source = if T::GENERAL { source } else { None };
    let stage_count = stages.tableau.a.len();
    let mut at = 0;
    let weight = segment.w * lambda;
    let mu = segment.mu * lambda;
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
        let forward;
        let dn = match source {
            Some(source) => {
                forward = source.force(&columns.dn, step.h * step.h.constant(stages.tableau.c[i]));
                &forward
            }
            None => &columns.dn,
        };
        let dm = column_moment::<L, T>(columns.force, dn, stage.p, stage.n, dp, dM);
        let x = columns_cross_sub(w, stage.m, dm);
        let compliance = segment.compliance_at::<T>(stage.compliance);
        let mut dw = compliance_times::<L, T>(compliance, stage.d1, stage.d2, stage.t, x); // J1
        let mut ddp = columns_cross(w, stage.velocity::<T>()); // J2
        if T::GENERAL && segment.shears {
            let y = column_force(columns.force, dn, stage.n, w);
            ddp = ddp + principal_times(segment.shear, stage.d1, stage.d2, stage.t, y); // J2
        }
        if T::LOAD {
            let mut ddM = -columns_cross(dp, weight); // J3
            if T::GENERAL && segment.has_magnet {
                let mu_world = to_world(stage.d1, stage.d2, stage.t, mu);
                ddM = columns_cross_sub(columns_cross(w, mu_world), rod.B, ddM); // J3
            }
            stages.ddM[i] = ddM;
        }
        if let Some(source) = source {
            let x = stages.tableau.c[i].mul_add(step.share, step.start);
            source.bend(x, compliance, stage, &mut dw); // J1
            source.shear(stage, &mut ddp); // J2
            if T::LOAD {
                source.couple(rod, segment, stage, &mut stages.ddM[i]); // J3
            }
        }
        (stages.dw[i], stages.ddp[i]) = (dw, ddp);
        if trace.is_some() {
            (stages.w[i], stages.x[i], stages.dp[i]) = (w, x, dp);
        }
    }
    for j in 0..stage_count {
        let hb = stages.ha[at + j];
        columns.w = columns_axpy(hb, stages.dw[j], columns.w);
        columns.dp = columns_axpy(hb, stages.ddp[j], columns.dp);
        if T::LOAD {
            columns.dM = columns_axpy(hb, stages.ddM[j], columns.dM);
        }
    }
    if let Some(source) = source {
        columns.dn = source.force(&columns.dn, step.h);
    }
    if let Some(trace) = trace {
        collect_integrals::<L, T>(rod, segment, step, stages, at, collect, columns, trace);
    }
}

/// Takes three columns over a rigid segment; `state` and `n` are those before it.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub fn cross_rigid_columns<L: Lane, T: Terms>(
    rod: &Rod<L>,
    segment: &Rigid<L>,
    lambda: L,
    force_arm: bool,
    n: Vec3<L>,
    state: &State<L>,
    source: Option<&Source<L>>,
    columns: &mut Columns<L>,
) {
    let source = if T::GENERAL { source } else { None };
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
    if T::LOAD {
        let weight = segment.w * lambda;
        let middle = if force_arm { columns_axpy(half, arm, dp) } else { dp };
        columns.dM = columns_cross_sub(middle, weight, columns.dM); // J4
        n_after = n - weight;
    }
    if let Some(source) = source {
        source.cross_rigid(rod, segment, force_arm, state, columns); // J4
    }
    if !force_arm {
        if T::FORCE {
            columns.dM = columns_cross_add(arm, n_after, columns.dM);
        }
        match columns.force {
            Force::None => {}
            Force::Unit => columns.dM = columns.dM + hat(t * length),
            Force::Forward => columns.dM = columns_cross_sub(columns.dn, t * length, columns.dM),
        }
    }
}

/// Takes three columns over the unloaded distal part: it turns and moves as a rigid body.
#[inline(always)]
pub fn cross_free_columns<L: Lane>(state: &State<L>, p_tip: Vec3<L>, columns: &mut Columns<L>) {
    columns.dp = columns.dp + columns_cross(columns.w, p_tip - state.p); // R6
}
