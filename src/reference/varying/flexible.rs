//! A flexible segment in a field that varies: equations (2), (9)-(11), (17)-(20) with the force n as a part of the
//! state. F2, F6

use super::state::{Change, Column, State, Varying};
use crate::reference::chain::{Segment, nu};
use crate::reference::extrapolation::{self, Extrapolation, RunAway};
use nalgebra::{Matrix3, Vector3};

/// Entries of the state in front of the columns: p, R by columns, u - u*, n.
const STATE: usize = 18;
/// Entries of one column: w, dp, du - du*, dn.
const COLUMN: usize = 12;

/// One flexible segment with the changes to carry along.
pub(super) struct Flexible<'a> {
    numbers: Segment,
    rod: &'a Varying,
    changes: &'a [Change],
    segment: usize,
    has_magnet: bool,
}

/// What the rest of the rod does to a place.
struct Slopes {
    u: Vector3<f64>,
    m_body: Vector3<f64>,
    n_body: Vector3<f64>,
    nu: Vector3<f64>,
    dm: Vector3<f64>,
    dn: Vector3<f64>,
}

fn get(y: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(y[at], y[at + 1], y[at + 2])
}

fn put(y: &mut [f64], at: usize, v: Vector3<f64>) {
    y[at..at + 3].copy_from_slice(v.as_slice());
}

impl<'a> Flexible<'a> {
    pub(super) fn new(rod: &'a Varying, segment: usize, changes: &'a [Change]) -> Self {
        let numbers = rod.chain.numbers.segments[segment];
        let of_change = |change: &Change| change.of.numbers.segments[segment].mu != Vector3::zeros();
        let has_magnet = numbers.mu != Vector3::zeros() || changes.iter().any(of_change);
        Self { numbers, rod, changes, segment, has_magnet }
    }

    fn along(&self, s: f64) -> f64 {
        if self.numbers.length > 0.0 { s / self.numbers.length } else { 0.0 }
    }

    /// dK/ds, du*/ds
    fn rises(&self) -> (Vector3<f64>, Vector3<f64>) {
        let per_length = if self.numbers.length > 0.0 { 1.0 / self.numbers.length } else { 0.0 };
        (per_length * self.numbers.K_rise, per_length * self.numbers.u_star_rise)
    }

    pub(super) fn K(&self, s: f64) -> Vector3<f64> {
        self.numbers.K + self.along(s) * self.numbers.K_rise
    }

    fn u_star(&self, s: f64) -> Vector3<f64> {
        self.numbers.u_star + self.along(s) * self.numbers.u_star_rise
    }

    fn source(&self, change: usize) -> &Segment {
        &self.changes[change].of.numbers.segments[self.segment]
    }

    /// p' where the rod has this attitude and force.
    pub(super) fn velocity(&self, R: &Matrix3<f64>, n: Vector3<f64>) -> Vector3<f64> {
        R * nu(self.numbers.C_se, R.tr_mul(&n))
    }

    fn slopes(&self, s: f64, p: Vector3<f64>, R: &Matrix3<f64>, m_body: Vector3<f64>, n: Vector3<f64>) -> Slopes {
        let u = self.u_star(s) + m_body.component_div(&self.K(s));
        let n_body = R.tr_mul(&n);
        let nu = nu(self.numbers.C_se, n_body);
        let mut dm = -(u.cross(&m_body) + nu.cross(&n_body)); // (2)
        let mut dn = -self.numbers.load;
        if self.has_magnet {
            let field = &self.rod.field;
            dm -= self.numbers.mu.cross(&R.tr_mul(&field.B(p))); // F2
            dn -= field.G(p) * (R * self.numbers.mu); // F2
        }
        Slopes { u, m_body, n_body, nu, dm, dn }
    }

    /// Integrates the state over part of the segment.
    pub(super) fn advance(
        &self,
        integrator: &mut Extrapolation,
        start: f64,
        end: f64,
        state: &mut State,
    ) -> Result<(), RunAway> {
        let mut y = self.enter(start, state);
        integrator.advance(self, start, end, &mut y)?;
        self.leave(end, &y, state);
        Ok(())
    }

    fn dK(&self, s: f64, change: usize) -> Vector3<f64> {
        let d = self.source(change);
        d.K + self.along(s) * d.K_rise
    }

    fn enter(&self, s: f64, state: &State) -> Vec<f64> {
        let mut y = vec![0.0; STATE + COLUMN * state.columns.len()];
        let K = self.K(s);
        let v = state.m_body.component_div(&K);
        put(&mut y, 0, state.p);
        y[3..12].copy_from_slice(state.R.as_slice());
        put(&mut y, 12, v);
        put(&mut y, 15, state.n);
        for (k, (column, y)) in state.columns.iter().zip(y[STATE..].chunks_exact_mut(COLUMN)).enumerate() {
            put(y, 0, column.w);
            put(y, 3, column.dp);
            put(y, 6, (column.dm_body - self.dK(s, k).component_mul(&v)).component_div(&K)); // (29)
            put(y, 9, column.dn);
        }
        y
    }

    fn leave(&self, s: f64, y: &[f64], state: &mut State) {
        let K = self.K(s);
        let v = get(y, 12);
        state.p = get(y, 0);
        state.R = Matrix3::from_column_slice(&y[3..12]);
        state.m_body = K.component_mul(&v);
        state.n = get(y, 15);
        for (k, (column, y)) in state.columns.iter_mut().zip(y[STATE..].chunks_exact(COLUMN)).enumerate() {
            *column = Column {
                w: get(y, 0),
                dp: get(y, 3),
                dm_body: self.dK(s, k).component_mul(&v) + K.component_mul(&get(y, 6)), // (29)
                dn: get(y, 9),
            };
        }
    }

    /// u and du where the state stands, at s.
    pub(super) fn curvature(&self, s: f64, state: &State) -> (Vector3<f64>, Vec<Vector3<f64>>) {
        let K = self.K(s);
        let v = state.m_body.component_div(&K);
        let du = |(k, column): (usize, &Column)| {
            let d = self.source(k);
            let du_star = d.u_star + self.along(s) * d.u_star_rise;
            du_star + (column.dm_body - self.dK(s, k).component_mul(&v)).component_div(&K)
        };
        (self.u_star(s) + v, state.columns.iter().enumerate().map(du).collect())
    }

    /// u' at the proximal end.
    pub(super) fn u_slope(&self, state: &State) -> Vector3<f64> {
        let (dK_ds, du_star_ds) = self.rises();
        let K = self.K(0.0);
        let v = state.m_body.component_div(&K);
        let slopes = self.slopes(0.0, state.p, &state.R, state.m_body, state.n);
        du_star_ds + (slopes.dm - dK_ds.component_mul(&v)).component_div(&K)
    }

    /// m_body' and u at the proximal end, for what insertion does to the base.
    pub(super) fn moment_slope(&self, state: &State) -> Vector3<f64> {
        self.slopes(0.0, state.p, &state.R, state.m_body, state.n).dm
    }

    /// A segment longer by dL ends dL further on.
    pub(super) fn lengthen(&self, state: &mut State) {
        let slopes = self.slopes(self.numbers.length, state.p, &state.R, state.m_body, state.n);
        for (k, column) in state.columns.iter_mut().enumerate() {
            let dL = self.source(k).length;
            column.dp += dL * (state.R * slopes.nu);
            column.w += dL * (state.R * slopes.u);
            column.dm_body += dL * slopes.dm;
            column.dn += dL * slopes.dn;
        }
    }
}

impl extrapolation::Field for Flexible<'_> {
    fn slope(&self, s: f64, y: &[f64], dy: &mut [f64]) {
        let (p, R, v, n) = (get(y, 0), Matrix3::from_column_slice(&y[3..12]), get(y, 12), get(y, 15));
        let K = self.K(s);
        let (dK_ds, _) = self.rises();
        let Slopes { u, m_body, n_body, nu, dm, dn } = self.slopes(s, p, &R, K.component_mul(&v), n);
        let v_slope = (dm - dK_ds.component_mul(&v)).component_div(&K); // (2)
        let velocity = R * nu;
        let [d1, d2, t]: [Vector3<f64>; 3] = [0, 1, 2].map(|k| R.column(k).into());
        put(dy, 0, velocity);
        put(dy, 3, u.z * d2 - u.y * t);
        put(dy, 6, u.x * t - u.z * d1);
        put(dy, 9, u.y * d1 - u.x * d2);
        put(dy, 12, v_slope);
        put(dy, 15, dn);
        let mu_world = R * self.numbers.mu;
        let (field, magnetic) = (&self.rod.field, self.has_magnet);
        let zero = (Vector3::zeros(), Matrix3::zeros(), Matrix3::zeros());
        let (B, G, T3) = if magnetic { (field.B(p), field.G(p), field.T3(p, mu_world)) } else { zero };
        for (k, (y, dy)) in y[STATE..].chunks_exact(COLUMN).zip(dy[STATE..].chunks_exact_mut(COLUMN)).enumerate() {
            let (w, dp, dv, d_n) = (get(y, 0), get(y, 3), get(y, 6), get(y, 9));
            let (change, d) = (&self.changes[k], self.source(k));
            let du = d.u_star + self.along(s) * d.u_star_rise + dv;
            let dK = self.dK(s, k);
            let dm_body = K.component_mul(&dv) + dK.component_mul(&v);
            let K_rise = if self.numbers.length > 0.0 { d.K_rise / self.numbers.length } else { Vector3::zeros() };
            let stiffening = dK.component_mul(&v_slope) + K_rise.component_mul(&v) + dK_ds.component_mul(&dv); // (18)
            let dn_body = R.tr_mul(&(d_n - w.cross(&n)));
            let dnu = self.numbers.C_se.component_mul(&dn_body) + d.C_se.component_mul(&n_body);
            let mut torque = du.cross(&m_body) + u.cross(&dm_body) + nu.cross(&dn_body) + dnu.cross(&n_body);
            let mut force = d.load;
            if magnetic {
                let (dB, dF) = field.change(p, mu_world, &change.field);
                let dB = dB + change.of.numbers.B + G * dp;
                let dmu = w.cross(&mu_world) + R * d.mu;
                torque += d.mu.cross(&R.tr_mul(&B)) + self.numbers.mu.cross(&R.tr_mul(&(dB - w.cross(&B))));
                force += dF + T3 * dp + G * dmu; // F6
            }
            put(dy, 0, R * du); // (10)
            put(dy, 3, w.cross(&velocity) + R * dnu); // (11)
            put(dy, 6, -(torque + stiffening).component_div(&K));
            put(dy, 9, -force);
        }
    }

    fn measure(&self, y: &[f64], error: &[f64]) -> f64 {
        // A number that is none stays one.
        let larger = |m: f64, x: f64| if m.is_nan() || x <= m { m } else { x };
        let largest = |v: &[f64]| v.iter().fold(0.0, |m, x| larger(m, x.abs()));
        let stiffest = self.numbers.K.max().max((self.numbers.K + self.numbers.K_rise).max());
        let smallest = 1.0 / stiffest.max(1.0);
        let mut measure = largest(&error[..12]);
        let mut worse = |value: f64| measure = larger(measure, value);
        worse(largest(&error[12..15]) / largest(&y[12..15]).max(smallest));
        worse(largest(&error[15..STATE]) / largest(&y[15..STATE]).max(1.0));
        for (y, error) in y[STATE..].chunks_exact(COLUMN).zip(error[STATE..].chunks_exact(COLUMN)) {
            let size = largest(&y[..6]).max(1.0);
            worse(largest(&error[..6]) / size);
            worse(largest(&error[6..9]) / largest(&y[6..9]).max(size * smallest));
            worse(largest(&error[9..]) / largest(&y[9..]).max(size));
        }
        measure
    }
}
