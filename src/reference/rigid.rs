//! A rigid segment: coil torque (1), jump of the moment (4) with lever arm and weight, its variation (26), (29).

use super::chain::{Chain, Variation, e3_cross};
use super::state::State;
use nalgebra::Vector3;

/// Crosses rigid segment j.
pub(super) fn cross(chain: &Chain, j: usize, variations: &[Variation], state: &mut State) {
    let segment = chain.numbers.segments[j];
    let L = segment.length;
    let R = state.R;
    let t: Vector3<f64> = R.column(2).into();
    let (B, n, load) = (chain.numbers.B, chain.n_end[j], segment.load);
    let arm = if chain.rigid_force_arm { 1.0 } else { 0.0 };
    let B_body = R.tr_mul(&B);
    for (column, variation) in state.columns.iter_mut().zip(variations) {
        let d = variation.numbers.segments[j];
        let (w, dL, dn) = (column.w, d.length, variation.dn_end[j]);
        let dB_body = R.tr_mul(&(variation.numbers.B - w.cross(&B)));
        let dtau = d.mu.cross(&B_body) + segment.mu.cross(&dB_body); // (26)
        let force = n + 0.5 * load;
        let dforce = dn + 0.5 * d.load - w.cross(&force);
        column.dp += L * w.cross(&t) + dL * t;
        column.dm_body -= dtau + arm * e3_cross(R.tr_mul(&(L * dforce + dL * force))); // (29)
    }
    let tau = segment.mu.cross(&B_body); // (1)
    state.p += L * t;
    state.m_body -= tau + arm * L * e3_cross(R.tr_mul(&(n + 0.5 * load))); // (4)
}
