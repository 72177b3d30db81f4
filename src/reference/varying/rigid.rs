//! A rigid segment in a field that varies: force and torque of the field at its points. F1, F3, F4, F6
//!
//! Without the force arm every force acts as if at the proximal end.

use super::state::{Change, State, Varying};
use nalgebra::Vector3;

/// Crosses rigid segment j.
pub(super) fn cross(rod: &Varying, j: usize, changes: &[Change], state: &mut State) {
    let segment = rod.chain.numbers.segments[j];
    let field = &rod.field;
    let lever = if rod.chain.rigid_force_arm { 1.0 } else { 0.0 };
    let (L, R) = (segment.length, state.R);
    let in_world = |v: Vector3<f64>| if segment.follows { R * v } else { v };
    let (load, couple) = (in_world(segment.load), in_world(segment.couple));
    let t: Vector3<f64> = R.column(2).into();
    let mu = R * segment.mu;
    let (mut n, mut m) = (state.n - load, R * state.m_body);
    let places = field.places(state.p, L * t);
    for (xi, share) in places.iter().copied() {
        let arm = xi * L * t;
        let x = state.p + arm;
        let force = share * (field.G(x) * mu);
        n -= force;
        m -= share * mu.cross(&field.B(x)) + lever * arm.cross(&force); // F3, F4
    }
    m -= lever * L * t.cross(&(n + 0.5 * load)) + couple; // F3, F4, F11
    for (column, change) in state.columns.iter_mut().zip(changes) {
        let d = change.of.numbers.segments[j];
        let (w, dp) = (column.w, column.dp);
        let dmu = w.cross(&mu) + R * d.mu;
        let darm = L * w.cross(&t) + d.length * t;
        let turned = |v: Vector3<f64>| if segment.follows { w.cross(&v) } else { Vector3::zeros() };
        let dload = in_world(d.load) + turned(load); // F11
        let mut dn = column.dn - dload;
        let mut dm = w.cross(&(R * state.m_body)) + R * column.dm_body;
        for (xi, share) in places.iter().copied() {
            let (arm, dx) = (xi * L * t, dp + xi * darm);
            let x = state.p + arm;
            let (B, G) = (field.B(x), field.G(x));
            let (dB, dF) = field.change(x, mu, &change.field);
            let dB = dB + change.of.numbers.B + G * dx;
            let force = share * (G * mu);
            let dforce = share * (dF + field.T3(x, mu) * dx + G * dmu); // F6
            dn -= dforce;
            let by_arm = (xi * darm).cross(&force) + arm.cross(&dforce);
            dm -= share * (dmu.cross(&B) + mu.cross(&dB)) + lever * by_arm; // F6
        }
        let half = 0.5 * dload;
        dm -= lever * (darm.cross(&(n + 0.5 * load)) + L * t.cross(&(dn + half)));
        dm -= in_world(d.couple) + turned(couple); // F11
        column.dp += darm;
        column.dn = dn;
        column.dm_body = R.tr_mul(&(dm - w.cross(&m)));
    }
    state.p += L * t;
    state.n = n;
    state.m_body = R.tr_mul(&m);
}
