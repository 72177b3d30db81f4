//! A flexible segment: equations (2), (9)-(11) and (17)-(20), corrected, in the state p, R, u - u* and, for each
//! variation, w, dp, du - du*.

use super::chain::{Chain, Variation, e3_cross};
use super::extrapolation::{Extrapolation, Field, RunAway};
use super::shooting::{Column, State};
use nalgebra::{Matrix3, Vector3};

/// Entries of the state in front of the columns: p, R by columns, u - u*.
const STATE: usize = 15;
/// Entries of one column: w, dp, du - du*.
const COLUMN: usize = 9;

/// What a variation changes in this segment.
struct Source {
    dK: Vector3<f64>,
    du_star: Vector3<f64>,
    /// dn(s) = dn_end + dload (L - s)
    dn_end: Vector3<f64>,
    dload: Vector3<f64>,
}

/// One flexible segment with the variations to carry along.
pub(super) struct Flexible {
    pub K: Vector3<f64>,
    pub u_star: Vector3<f64>,
    length: f64,
    /// n(s) = n_end + load (L - s)
    n_end: Vector3<f64>,
    load: Vector3<f64>,
    sources: Vec<Source>,
}

fn get(y: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(y[at], y[at + 1], y[at + 2])
}

fn put(y: &mut [f64], at: usize, v: Vector3<f64>) {
    y[at..at + 3].copy_from_slice(v.as_slice());
}

impl Flexible {
    pub fn new(chain: &Chain, j: usize, variations: &[Variation]) -> Self {
        let segment = chain.numbers.segments[j];
        let source = |variation: &Variation| {
            let d = variation.numbers.segments[j];
            // At fixed s, a longer segment leaves more load beyond s.
            let dn_end = variation.dn_end[j] + segment.load * d.length;
            Source { dK: d.K, du_star: d.u_star, dn_end, dload: d.load }
        };
        Self {
            K: segment.K,
            u_star: segment.u_star,
            length: segment.length,
            n_end: chain.n_end[j],
            load: segment.load,
            sources: variations.iter().map(source).collect(),
        }
    }

    /// n(s) in the world frame.
    pub fn n(&self, s: f64) -> Vector3<f64> {
        self.n_end + self.load * (self.length - s)
    }

    /// u' of (2), its K' and u*' being zero.
    pub fn u_slope(&self, R: &Matrix3<f64>, u: Vector3<f64>, n: Vector3<f64>) -> Vector3<f64> {
        let m_body = self.K.component_mul(&(u - self.u_star));
        -(u.cross(&m_body) + e3_cross(R.tr_mul(&n))).component_div(&self.K) // (2)
    }

    /// Integrates the state over part of the segment.
    pub fn advance(
        &self,
        integrator: &mut Extrapolation,
        start: f64,
        end: f64,
        state: &mut State,
    ) -> Result<(), RunAway> {
        let mut y = self.enter(state);
        integrator.advance(self, start, end, &mut y)?;
        self.leave(&y, state);
        Ok(())
    }

    /// From the moment to the curvature at the start: second half of (4), (29).
    fn enter(&self, state: &State) -> Vec<f64> {
        let mut y = vec![0.0; STATE + COLUMN * state.columns.len()];
        let v = state.m_body.component_div(&self.K); // (4)
        put(&mut y, 0, state.p);
        y[3..12].copy_from_slice(state.R.as_slice());
        put(&mut y, 12, v);
        for ((column, source), y) in state.columns.iter().zip(&self.sources).zip(y[STATE..].chunks_exact_mut(COLUMN)) {
            put(y, 0, column.w);
            put(y, 3, column.dp);
            let dv = (column.dm_body - source.dK.component_mul(&v)).component_div(&self.K); // (29)
            put(y, 6, dv);
        }
        y
    }

    /// From the curvature to the moment at the end: first half of (4), (29).
    fn leave(&self, y: &[f64], state: &mut State) {
        let v = get(y, 12);
        state.p = get(y, 0);
        state.R = Matrix3::from_column_slice(&y[3..12]);
        state.m_body = self.K.component_mul(&v); // (4)
        for ((column, source), y) in state.columns.iter_mut().zip(&self.sources).zip(y[STATE..].chunks_exact(COLUMN)) {
            *column = Column {
                w: get(y, 0),
                dp: get(y, 3),
                dm_body: source.dK.component_mul(&v) + self.K.component_mul(&get(y, 6)), // (29)
            };
        }
    }

    /// u and du at the point where the state stands.
    pub fn curvature(&self, state: &State) -> (Vector3<f64>, Vec<Vector3<f64>>) {
        let v = state.m_body.component_div(&self.K);
        let du = |(column, source): (&Column, &Source)| {
            source.du_star + (column.dm_body - source.dK.component_mul(&v)).component_div(&self.K)
        };
        (self.u_star + v, state.columns.iter().zip(&self.sources).map(du).collect())
    }

    /// A segment longer by dL ends dL further on.
    pub fn lengthen(&self, variations: &[Variation], j: usize, state: &mut State) {
        let (u, _) = self.curvature(state);
        let slope = self.u_slope(&state.R, u, self.n_end);
        for (column, variation) in state.columns.iter_mut().zip(variations) {
            let dL = variation.numbers.segments[j].length;
            column.dp += dL * state.R.column(2);
            column.w += dL * (state.R * u);
            column.dm_body += dL * self.K.component_mul(&slope);
        }
    }
}

impl Field for Flexible {
    fn slope(&self, s: f64, y: &[f64], dy: &mut [f64]) {
        let R = Matrix3::from_column_slice(&y[3..12]);
        let t: Vector3<f64> = R.column(2).into();
        let v = get(y, 12);
        let u = self.u_star + v;
        let n = self.n(s);
        let m_body = self.K.component_mul(&v);
        let u_slope = self.u_slope(&R, u, n);
        put(dy, 0, t); // p' = R e3
        // R' = R hat(u), column by column.
        let [d1, d2]: [Vector3<f64>; 2] = [R.column(0).into(), R.column(1).into()];
        put(dy, 3, u.z * d2 - u.y * t);
        put(dy, 6, u.x * t - u.z * d1);
        put(dy, 9, u.y * d1 - u.x * d2);
        put(dy, 12, u_slope); // (2)
        let columns = y[STATE..].chunks_exact(COLUMN).zip(dy[STATE..].chunks_exact_mut(COLUMN));
        for ((y, dy), source) in columns.zip(&self.sources) {
            let (w, dv) = (get(y, 0), get(y, 6));
            let du = source.du_star + dv;
            let dn = source.dn_end + source.dload * (self.length - s);
            let dm_body = source.dK.component_mul(&v) + self.K.component_mul(&dv);
            // (17)-(20): (2) varied, with d(R^T n) = R^T (dn - w x n).
            let torque = du.cross(&m_body) + u.cross(&dm_body) + e3_cross(R.tr_mul(&(dn - w.cross(&n))));
            put(dy, 0, R * du); // (10)
            put(dy, 3, w.cross(&t)); // (11)
            put(dy, 6, -(torque + source.dK.component_mul(&u_slope)).component_div(&self.K));
        }
    }

    fn measure(&self, y: &[f64], error: &[f64]) -> f64 {
        let largest = |v: &[f64]| v.iter().fold(0.0, |m, x| worse(m, x.abs()));
        // Curvature counts by the moment it makes.
        let smallest_curvature = 1.0 / self.K.max().max(1.0);
        let mut measure = largest(&error[..12]);
        measure = worse(measure, largest(&error[12..STATE]) / largest(&y[12..STATE]).max(smallest_curvature));
        for (y, error) in y[STATE..].chunks_exact(COLUMN).zip(error[STATE..].chunks_exact(COLUMN)) {
            let size = largest(&y[..6]).max(1.0);
            measure = worse(measure, largest(&error[..6]) / size);
            measure = worse(measure, largest(&error[6..]) / largest(&y[6..]).max(size * smallest_curvature));
        }
        measure
    }
}

/// The larger of two errors; undefined if either is.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
