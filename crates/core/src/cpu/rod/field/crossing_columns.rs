//! Columns over a rigid segment in a field that varies. F6

use super::acting::Acting;
use super::crossing::Crossing;
use super::parameters::Parameters;
use super::state::{Columns, State};
use crate::cpu::algebra::{Vec3, axpy, cross, cross_sub};
use crate::cpu::rod::section::to_world;
use crate::cpu::simd::lane::Lane;

impl<L: Lane> Crossing<'_, L> {
    /// Columns by parameters of the field beyond it, where nothing has changed before.
    #[inline(always)]
    pub fn begin_columns(&self, acting: &Acting<L>, parameters: &Parameters<L>, columns: &mut Columns<L>) {
        if !self.segment.has_dipole {
            return;
        }
        let (mu, arm) = (self.dipole(), self.before.t * self.segment.length);
        let zero = Vec3::splat(self.lambda.constant(0.0));
        for k in 0..parameters.count {
            let (dB, dforce, dfirst) = parameters.acting(k, self, acting);
            let mut dm = cross_sub(mu, dB, zero); // F6
            if self.force_arm {
                dm = cross_sub(arm, dfirst - dforce, dm); // F6
            }
            (columns.dn[k], columns.dm[k]) = (zero - dforce, dm);
        }
    }

    /// Takes columns over it; `after` is the state beyond it, `by` are parameters, number `index` of the segment.
    #[inline(always)]
    pub fn cross_columns(
        &self,
        after: &State<L>,
        acting: &Acting<L>,
        by: Option<(&Parameters<L>, usize)>,
        columns: &mut Columns<L>,
    ) {
        let Crossing { segment, lambda, force_arm, before, .. } = self;
        if let Some((parameters, index)) = by
            && parameters.begin_at == Some(index)
        {
            self.begin_columns(acting, parameters, columns);
            return;
        }
        let State { d1, t, .. } = *before;
        let (arm, load) = (t * segment.length, self.load());
        let half = lambda.constant(0.5);
        let zero = Vec3::splat(lambda.constant(0.0));
        let middle = axpy(half, load, after.n);
        let mu = self.dipole();
        let first = acting.G[1] * mu;
        for k in 0..by.map_or(3, |(parameters, _)| parameters.count) {
            let (w, dp) = (columns.w[k], columns.dp[k]);
            let (mut dn, mut dm) = (columns.dn[k], columns.dm[k]);
            let mut darm = cross(w, arm);
            let mut dload = zero;
            if let Some((parameters, index)) = by {
                let source = &parameters.sources.segments[index];
                darm = axpy(source.dL[k], t, darm);
                dload = self.in_world(source.dload[k]);
            }
            if segment.follows {
                dload = dload + cross(w, load);
            }
            dn = dn - dload;
            if segment.has_dipole {
                let mut dmu = cross(w, mu);
                let (mut dB, mut dforce, mut dfirst) = (zero, zero, zero);
                if let Some((parameters, index)) = by {
                    let dmu_body = parameters.sources.segments[index].dmu[k];
                    dmu = dmu + to_world(d1, cross(t, d1), t, dmu_body);
                    (dB, dforce, dfirst) = parameters.acting(k, self, acting);
                }
                let ([G, G1], [T3, T31, T32]) = (acting.G, acting.T3);
                dB = dB + G * dp + G1 * darm;
                dforce = dforce + T3 * dp + T31 * darm + G * dmu; // F6
                dn = dn - dforce;
                dm = cross_sub(dmu, acting.B, cross_sub(mu, dB, dm)); // F6
                if *force_arm {
                    dfirst = dfirst + T31 * dp + T32 * darm + G1 * dmu;
                    dm = cross_sub(darm, first, cross_sub(arm, dfirst, dm)); // F6
                }
            }
            if *force_arm {
                dm = cross_sub(darm, middle, cross_sub(arm, axpy(half, dload, dn), dm));
            }
            if segment.has_couple {
                if let Some((parameters, index)) = by {
                    dm = dm - self.in_world(parameters.sources.segments[index].dmu[k]);
                }
                if segment.follows {
                    dm = cross_sub(w, self.couple(), dm);
                }
            }
            (columns.dp[k], columns.dn[k], columns.dm[k]) = (dp + darm, dn, dm);
        }
    }
}
