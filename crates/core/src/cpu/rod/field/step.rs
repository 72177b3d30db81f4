//! One step over a flexible segment in a field that varies: the rod once, then every column. F2, F6, J1, J2

use super::parameters::Parameters;
use super::space::{Local, Space};
use super::state::{Columns, State};
use crate::cpu::algebra::{Mat3, Vec3, axpy, cross, cross_sub};
use crate::cpu::rod::column::{compliance_times, principal_times};
use crate::cpu::rod::section::{Flexible, curvature, to_world, velocity};
use crate::cpu::rod::step::{STAGES, Stages};
use crate::cpu::rod::terms::Terms;
use crate::cpu::simd::lane::Lane;

/// How fast a state or a column changes; of a state the first is p' with the stage.
#[derive(Clone, Copy, Debug)]
pub struct Slope<L> {
    a: Vec3<L>,
    b: Vec3<L>,
    dm: Vec3<L>,
    dn: Vec3<L>,
}

/// The field at one stage.
#[derive(Clone, Copy, Debug)]
struct Magnetic<L> {
    mu: Vec3<L>,
    local: Local<L>,
}

/// Room for the stages of a step.
pub struct Room<L: Lane> {
    pub stages: Stages<L>,
    /// Where it starts and ends.
    ends: [Vec3<L>; 2],
    slopes: [Slope<L>; STAGES],
    column_slopes: [Slope<L>; STAGES],
    magnetic: [Magnetic<L>; STAGES],
    /// What each dipole of the field does at each stage.
    kept: Vec<Local<L>>,
}

/// One of several equal steps over a segment under part of its loads.
pub struct Step<'a, L: Lane, T> {
    pub terms: T,
    pub space: &'a Space<L>,
    pub segment: &'a Flexible<L>,
    pub lambda: L,
    /// Its start and its length as shares of the segment.
    pub start: f64,
    pub share: f64,
}

impl<L: Lane> Room<L> {
    pub fn new(stages: Stages<L>, zero: L) -> Self {
        let (v, o) = (Vec3::splat(zero), Mat3::zero(zero));
        let slope = Slope { a: v, b: v, dm: v, dn: v };
        let magnetic = Magnetic { mu: v, local: Local { B: v, G: o, T3: o } };
        Self {
            stages,
            ends: [v; 2],
            slopes: [slope; STAGES],
            column_slopes: [slope; STAGES],
            magnetic: [magnetic; STAGES],
            kept: Vec::new(),
        }
    }
}

/// Takes the rod over one step; `columns` says whether columns will follow, `STEADY` that no force acts along the segment.
#[inline(always)]
pub fn step_rod<L: Lane, T: Terms, const STEADY: bool>(
    step: &Step<'_, L, T>,
    room: &mut Room<L>,
    columns: bool,
    state: &mut State<L>,
) {
    let Step { terms, space, segment, lambda, .. } = *step;
    let Room { stages, ends, slopes, magnetic, kept, .. } = room;
    kept.clear();
    let (weight, mu_body) = (segment.w * lambda, segment.mu * lambda);
    let count = stages.tableau.a.len();
    ends[0] = state.p;
    for i in 0..count {
        let State { p, d1, t, m, n } = advanced::<L, T, STEADY>(terms, state, stages, slopes, i);
        let section = segment.section(terms, stages.tableau.c[i].mul_add(step.share, step.start));
        let d2 = cross(t, d1);
        let omega = curvature(terms, &section, d1, d2, t, m);
        let v = velocity(terms, segment, d1, d2, t, n);
        let slope = &mut slopes[i % STAGES];
        (slope.a, slope.b) = (cross(omega, d1), cross(omega, t)); // R1, R2
        if !STEADY {
            (slope.dm, slope.dn) = (cross(n, v), -weight);
        }
        if !STEADY && terms.general() && segment.has_magnet {
            let mu = to_world(d1, d2, t, mu_body);
            let local = if columns {
                space.local(p, mu, kept)
            } else {
                let (B, G) = space.field(p);
                Local { B, G, T3: G }
            };
            slope.dm = cross_sub(mu, local.B, slope.dm); // F2
            slope.dn = slope.dn - local.G * mu; // F2
            magnetic[i % STAGES] = Magnetic { mu, local };
        }
        let stage = &mut stages.stage[i % STAGES];
        (stage.p, stage.d1, stage.d2, stage.t, stage.m, stage.n) = (p, d1, d2, t, m, n);
        if terms.general() {
            (stage.v, stage.compliance) = (v, section.compliance);
        }
    }
    *state = advanced::<L, T, STEADY>(terms, state, stages, slopes, count);
    ends[1] = state.p;
}

/// The state at stage `i`, or at the end.
#[inline(always)]
fn advanced<L: Lane, T: Terms, const STEADY: bool>(
    terms: T,
    state: &State<L>,
    stages: &Stages<L>,
    slopes: &[Slope<L>; STAGES],
    i: usize,
) -> State<L> {
    let State { mut p, mut d1, mut t, mut m, mut n } = *state;
    for (ha, j) in stages.row(i) {
        let slope = &slopes[j];
        p = axpy(ha, stages.stage[j].velocity(terms), p);
        d1 = axpy(ha, slope.a, d1);
        t = axpy(ha, slope.b, t);
        if !STEADY {
            m = axpy(ha, slope.dm, m);
            n = axpy(ha, slope.dn, n);
        }
    }
    if STEADY {
        // R1 with a constant force.
        m = cross_sub(p - state.p, n, m);
    }
    State { p, d1, t, m, n }
}

/// Takes three columns over a step whose stages are known; `by` are parameters, number `index` of the segment.
#[inline(always)]
pub fn step_columns<L: Lane, T: Terms, const STEADY: bool>(
    step: &Step<'_, L, T>,
    room: &mut Room<L>,
    by: Option<(&Parameters<L>, usize)>,
    columns: &mut Columns<L>,
) {
    let Step { terms, space, segment, .. } = *step;
    let Room { stages, ends, column_slopes, magnetic, kept, .. } = room;
    let count = stages.tableau.a.len();
    for k in 0..by.map_or(3, |(parameters, _)| parameters.count) {
        let start = (columns.w[k], columns.dp[k], columns.dm[k], columns.dn[k]);
        for i in 0..=count {
            let (mut w, mut dp, mut dm, mut dn) = start;
            for (ha, j) in stages.row(i) {
                let slope = &column_slopes[j];
                w = axpy(ha, slope.a, w);
                dp = axpy(ha, slope.b, dp);
                if !STEADY {
                    dm = axpy(ha, slope.dm, dm);
                    dn = axpy(ha, slope.dn, dn);
                }
            }
            if STEADY {
                let arm = if i == count { ends[1] } else { stages.stage[i % STAGES].p } - ends[0];
                let n = stages.stage[0].n;
                // J3 with a constant force.
                dm = cross_sub(arm, dn, cross_sub(dp - start.1, n, dm));
            }
            if i == count {
                (columns.w[k], columns.dp[k], columns.dm[k], columns.dn[k]) = (w, dp, dm, dn);
                break;
            }
            let stage = &stages.stage[i % STAGES];
            let compliance = segment.compliance_at(terms, stage.compliance);
            let x = cross_sub(w, stage.m, dm);
            let mut dw = compliance_times(terms, compliance, stage.d1, stage.d2, stage.t, x); // J1
            let mut ddp = cross(w, stage.velocity(terms)); // J2
            if terms.general() && segment.shears {
                let y = cross_sub(w, stage.n, dn);
                ddp = ddp + principal_times(segment.shear, stage.d1, stage.d2, stage.t, y); // J2
            }
            let slope = &mut column_slopes[i % STAGES];
            let mut ddn = Vec3::splat(dn.x.constant(0.0));
            if let Some((parameters, index)) = by {
                let source = &parameters.sources.segments[index];
                let at = stages.tableau.c[i].mul_add(step.share, step.start);
                source.bend(k, at, compliance, stage, &mut dw); // J1
                source.shear(k, stage, &mut ddp); // J2
                ddn = -source.dload[k];
            }
            (slope.a, slope.b) = (dw, ddp);
            if STEADY {
                continue;
            }
            let mut ddm = cross_sub(ddp, stage.n, cross(dn, stage.velocity(terms))); // J3
            if terms.general() && segment.has_magnet {
                let Magnetic { mu, local } = magnetic[i % STAGES];
                let mut dmu = cross(w, mu);
                let (mut dB, mut dF) = (local.G * dp, local.T3 * dp);
                if let Some((parameters, index)) = by {
                    let dmu_body = parameters.sources.segments[index].dmu[k];
                    dmu = dmu + to_world(stage.d1, stage.d2, stage.t, dmu_body);
                    let (of_B, of_F) = parameters.field(space, k, stage.p, mu, &kept[i * space.dipoles.len()..]);
                    (dB, dF) = (dB + of_B, dF + of_F);
                }
                ddm = cross_sub(dmu, local.B, cross_sub(mu, dB, ddm)); // F6
                ddn = ddn - dF - local.G * dmu; // F6
            }
            (slope.dm, slope.dn) = (ddm, ddn);
        }
    }
}
