//! A rigid segment in a field that varies. F1, F3, F4, F6

use super::parameters::Parameters;
use super::space::{Local, Space};
use super::step::{Columns, State};
use crate::lanes::algebra::{Vec3, axpy, cross, cross_sub};
use crate::lanes::lane::Lane;
use crate::lanes::rod::Rigid;
use crate::lanes::section::to_world;

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

/// A point of a rigid segment where the field acts on a part of its dipole.
#[derive(Clone, Copy, Debug)]
struct Point<L> {
    xi: L,
    share: L,
    lever: Vec3<L>,
    part: Vec3<L>,
    local: Local<L>,
}

/// All of them, and what each dipole of the field does at each.
#[derive(Clone, Debug)]
pub struct Points<L> {
    all: Vec<Point<L>>,
    kept: Vec<Local<L>>,
}

impl<L: Lane> Points<L> {
    pub fn new() -> Self {
        Self { all: Vec::new(), kept: Vec::new() }
    }

    /// Looks at the field for the columns of a crossing.
    #[inline(always)]
    pub fn load(&mut self, crossing: &Crossing<'_, L>) {
        let Crossing { space, segment, lambda, points, before, .. } = crossing;
        self.all.clear();
        self.kept.clear();
        if !segment.has_dipole {
            return;
        }
        let mu = crossing.dipole();
        for (xi, share) in *points {
            let (xi, share) = (lambda.constant(*xi), lambda.constant(*share));
            let (lever, part) = (before.t * segment.length * xi, mu * share);
            let local = space.local(before.p + lever, part, &mut self.kept);
            self.all.push(Point { xi, share, lever, part, local });
        }
    }
}

impl<L: Lane> Crossing<'_, L> {
    /// R mu
    #[inline(always)]
    fn dipole(&self) -> Vec3<L> {
        let State { d1, t, .. } = self.before;
        to_world(d1, cross(t, d1), t, self.segment.mu) * self.lambda
    }

    /// The state beyond it.
    #[inline(always)]
    pub fn cross(&self) -> State<L> {
        let Crossing { space, segment, lambda, force_arm, before, .. } = self;
        let State { p, d1, t, mut m, mut n } = *before;
        let (arm, load) = (t * segment.length, segment.w * *lambda);
        let half = lambda.constant(0.5);
        n = n - load;
        if segment.has_dipole {
            let mu = self.dipole();
            for (xi, share) in self.points {
                let lever = arm * lambda.constant(*xi);
                let (B, G) = space.field(p + lever);
                let part = mu * lambda.constant(*share);
                let force = G * part; // F1
                n = n - force;
                m = cross_sub(part, B, m); // F3, F4
                if *force_arm {
                    m = cross_sub(lever, force, m); // F3, F4
                }
            }
        }
        if *force_arm {
            m = cross_sub(arm, axpy(half, load, n), m); // F3, F4
        }
        State { p: p + arm, d1, t, m, n }
    }

    /// Takes columns over it; `after` is the state beyond it, `by` are parameters, number `index` of the segment.
    #[inline(always)]
    pub fn cross_columns(
        &self,
        after: &State<L>,
        points: &Points<L>,
        by: Option<(&Parameters<L>, usize)>,
        columns: &mut Columns<L>,
    ) {
        let Crossing { space, segment, lambda, force_arm, before, .. } = self;
        let State { p, d1, t, .. } = *before;
        let (arm, load) = (t * segment.length, segment.w * *lambda);
        let half = lambda.constant(0.5);
        let d2 = cross(t, d1);
        let zero = Vec3::splat(lambda.constant(0.0));
        let middle = axpy(half, load, after.n);
        let mut change = *columns;
        let mut darms = columns.w;
        for k in 0..3 {
            let w = columns.w[k];
            let mut darm = cross(w, arm);
            let mut dload = zero;
            if let Some((parameters, index)) = by {
                let source = &parameters.sources.segments[index];
                darm = axpy(source.dL[k], t, darm);
                dload = source.dload[k];
            }
            change.dn[k] = columns.dn[k] - dload;
            change.dp[k] = columns.dp[k] + darm;
            darms[k] = darm;
        }
        for (point, Point { xi, share, lever, part, local }) in points.all.iter().enumerate() {
            let (xi, share, lever, part) = (*xi, *share, *lever, *part);
            let Local { B, G, T3 } = *local;
            let kept = &points.kept[point * space.dipoles.len()..];
            let force = G * part;
            for k in 0..3 {
                let dlever = darms[k] * xi;
                let dx = columns.dp[k] + dlever;
                let mut dmu = cross(columns.w[k], part);
                let (mut dB, mut dF) = (G * dx, T3 * dx);
                if let Some((parameters, index)) = by {
                    let dmu_body = parameters.sources.segments[index].dmu[k];
                    dmu = axpy(share, to_world(d1, d2, t, dmu_body), dmu);
                    let (of_B, of_F) = parameters.field(space, k, p + lever, part, kept);
                    (dB, dF) = (dB + of_B, dF + of_F);
                }
                let dforce = dF + G * dmu; // F6
                change.dn[k] = change.dn[k] - dforce;
                let mut torque = cross_sub(dmu, B, cross_sub(part, dB, change.dm[k]));
                if *force_arm {
                    torque = cross_sub(dlever, force, cross_sub(lever, dforce, torque));
                }
                change.dm[k] = torque; // F6
            }
        }
        for k in 0..if *force_arm { 3 } else { 0 } {
            let dload = match by {
                Some((parameters, index)) => parameters.sources.segments[index].dload[k],
                None => zero,
            };
            let dmiddle = axpy(half, dload, change.dn[k]);
            change.dm[k] = cross_sub(darms[k], middle, cross_sub(arm, dmiddle, change.dm[k]));
        }
        *columns = change;
    }
}
