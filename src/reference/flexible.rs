//! A flexible segment: equations (2), (9)-(11) and (17)-(20), corrected, in the state p, R, u - u* and, for each
//! variation, w, dp, du - du*.

use super::chain::{Chain, Segment, Variation, nu};
use super::extrapolation::{Extrapolation, Field, RunAway};
use super::state::{Column, State};
use nalgebra::{Matrix3, Vector3};

/// Entries of the state in front of the columns: p, R by columns, u - u*.
const STATE: usize = 15;
/// Entries of one column: w, dp, du - du*.
const COLUMN: usize = 9;

/// What a variation changes in this segment.
struct Source {
    d: Segment,
    /// dn(s) = dn_end + d.load (L - s)
    dn_end: Vector3<f64>,
    dB: Vector3<f64>,
    /// Whether it changes stiffness; only then are its terms computed.
    stiffens: bool,
}

/// One flexible segment with the variations to carry along.
pub(super) struct Flexible {
    numbers: Segment,
    /// n(s) = n_end + load (L - s)
    n_end: Vector3<f64>,
    B: Vector3<f64>,
    dK_ds: Vector3<f64>,
    du_star_ds: Vector3<f64>,
    sources: Vec<Source>,
    /// 1 / length, zero for no length.
    per_length: f64,
    /// Which of the terms that few rods have are computed: shear, magnet, taper; of the rod or of a source.
    shears: bool,
    has_magnet: bool,
    tapers: bool,
}

fn get(y: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(y[at], y[at + 1], y[at + 2])
}

fn put(y: &mut [f64], at: usize, v: Vector3<f64>) {
    y[at..at + 3].copy_from_slice(v.as_slice());
}

impl Flexible {
    pub(super) fn new(chain: &Chain, j: usize, variations: &[Variation]) -> Self {
        let numbers = chain.numbers.segments[j];
        let source = |variation: &Variation| {
            let d = variation.numbers.segments[j];
            // At fixed s, a longer segment leaves more load beyond s.
            let dn_end = variation.dn_end[j] + numbers.load * d.length;
            let stiffens = d.K != Vector3::zeros() || d.K_rise != Vector3::zeros();
            Source { d, dn_end, dB: variation.numbers.B, stiffens }
        };
        let sources: Vec<Source> = variations.iter().map(source).collect();
        let any = |of: fn(&Segment) -> Vector3<f64>| {
            of(&numbers) != Vector3::zeros() || sources.iter().any(|source| of(&source.d) != Vector3::zeros())
        };
        let per_length = if numbers.length > 0.0 { 1.0 / numbers.length } else { 0.0 };
        Self {
            shears: any(|segment| segment.C_se),
            has_magnet: any(|segment| segment.mu),
            tapers: numbers.K_rise != Vector3::zeros(),
            per_length,
            dK_ds: per_length * numbers.K_rise,
            du_star_ds: per_length * numbers.u_star_rise,
            numbers,
            n_end: chain.n_end[j],
            B: chain.numbers.B,
            sources,
        }
    }

    /// The first segment; nodes withdrawn behind the base leave pieces without length, which say nothing of the slope.
    pub(super) fn at_base(chain: &Chain) -> Self {
        let mut base = Self::new(chain, 0, &[]);
        let segments = &chain.numbers.segments;
        if let Some(j) = (0..segments.len()).find(|j| segments[*j].length > 0.0) {
            base.dK_ds = segments[j].K_rise / segments[j].length;
            base.du_star_ds = segments[j].u_star_rise / segments[j].length;
        }
        base
    }

    /// Where s is along what varies; a segment of no length is at its start.
    fn along(&self, s: f64) -> f64 {
        s * self.per_length
    }

    pub(super) fn K(&self, s: f64) -> Vector3<f64> {
        self.numbers.K + self.along(s) * self.numbers.K_rise
    }

    fn u_star(&self, s: f64) -> Vector3<f64> {
        self.numbers.u_star + self.along(s) * self.numbers.u_star_rise
    }

    /// n(s) in the world frame.
    pub(super) fn n(&self, s: f64) -> Vector3<f64> {
        self.n_end + self.numbers.load * (self.numbers.length - s)
    }

    /// Size of the terms by which the second variation may be negative per |w|^2: force and magnet.
    pub(super) fn softening(&self, s: f64) -> f64 {
        self.softening_by(self.n(s).norm().max(self.n_end.norm()))
    }

    fn softening_by(&self, n: f64) -> f64 {
        n + self.numbers.C_se.amax() * n * n + self.numbers.mu.norm() * self.B.norm()
    }

    /// By how much changes of moment and rotation grow on a unit of length. MS1
    pub(super) fn growth_rate(&self, s: f64) -> f64 {
        let K = self.K(s);
        let (softer, stiffer) = (K.x.min(K.y), K.x.max(K.y));
        (self.softening_by(self.n(s).norm()) / softer * (stiffer / K.z).max(1.0)).sqrt()
    }

    /// |u*|
    pub(super) fn rest_bend(&self, s: f64) -> f64 {
        self.u_star(s).norm()
    }

    /// m_body' = -(u x m_body + nu x R^T n + mu x R^T B), with (1) per length as the couple l of (2).
    fn moment_slope(&self, s: f64, R: &Matrix3<f64>, u: Vector3<f64>, m_body: Vector3<f64>) -> Vector3<f64> {
        let n_body = R.tr_mul(&self.n(s));
        let mut torque = u.cross(&m_body) + nu(self.numbers.C_se, n_body).cross(&n_body); // (2)
        if self.has_magnet {
            torque += self.numbers.mu.cross(&R.tr_mul(&self.B)); // (1)
        }
        -torque
    }

    /// u' of (2).
    pub(super) fn u_slope(&self, s: f64, R: &Matrix3<f64>, u: Vector3<f64>) -> Vector3<f64> {
        let v = u - self.u_star(s);
        self.du_star_ds + self.v_slope(s, R, u, v)
    }

    /// (u - u*)' of (2).
    fn v_slope(&self, s: f64, R: &Matrix3<f64>, u: Vector3<f64>, v: Vector3<f64>) -> Vector3<f64> {
        let K = self.K(s);
        (self.moment_slope(s, R, u, K.component_mul(&v)) - self.dK_ds.component_mul(&v)).component_div(&K) // (2)
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

    /// dK(s) of a variation.
    fn dK(&self, s: f64, source: &Source) -> Vector3<f64> {
        source.d.K + self.along(s) * source.d.K_rise
    }

    /// From the moment to the curvature at s: second half of (4), (29).
    fn enter(&self, s: f64, state: &State) -> Vec<f64> {
        let mut y = vec![0.0; STATE + COLUMN * state.columns.len()];
        let K = self.K(s);
        let v = state.m_body.component_div(&K); // (4)
        put(&mut y, 0, state.p);
        y[3..12].copy_from_slice(state.R.as_slice());
        put(&mut y, 12, v);
        for ((column, source), y) in state.columns.iter().zip(&self.sources).zip(y[STATE..].chunks_exact_mut(COLUMN)) {
            put(y, 0, column.w);
            put(y, 3, column.dp);
            let dv = (column.dm_body - self.dK(s, source).component_mul(&v)).component_div(&K); // (29)
            put(y, 6, dv);
        }
        y
    }

    /// From the curvature to the moment at s: first half of (4), (29).
    fn leave(&self, s: f64, y: &[f64], state: &mut State) {
        let K = self.K(s);
        let v = get(y, 12);
        state.p = get(y, 0);
        state.R = Matrix3::from_column_slice(&y[3..12]);
        state.m_body = K.component_mul(&v); // (4)
        for ((column, source), y) in state.columns.iter_mut().zip(&self.sources).zip(y[STATE..].chunks_exact(COLUMN)) {
            *column = Column {
                w: get(y, 0),
                dp: get(y, 3),
                dm_body: self.dK(s, source).component_mul(&v) + K.component_mul(&get(y, 6)), // (29)
            };
        }
    }

    /// u and du where the state stands, at s.
    pub(super) fn curvature(&self, s: f64, state: &State) -> (Vector3<f64>, Vec<Vector3<f64>>) {
        let K = self.K(s);
        let v = state.m_body.component_div(&K);
        let du = |(column, source): (&Column, &Source)| {
            let du_star = source.d.u_star + self.along(s) * source.d.u_star_rise;
            du_star + (column.dm_body - self.dK(s, source).component_mul(&v)).component_div(&K)
        };
        (self.u_star(s) + v, state.columns.iter().zip(&self.sources).map(du).collect())
    }

    /// p' of (2) at s.
    pub(super) fn tangent(&self, s: f64, R: &Matrix3<f64>) -> Vector3<f64> {
        R * nu(self.numbers.C_se, R.tr_mul(&self.n(s)))
    }

    /// A segment longer by dL ends dL further on.
    pub(super) fn lengthen(&self, state: &mut State) {
        let L = self.numbers.length;
        let (u, _) = self.curvature(L, state);
        let slope = self.moment_slope(L, &state.R, u, state.m_body);
        let nu = nu(self.numbers.C_se, state.R.tr_mul(&self.n_end));
        for (column, source) in state.columns.iter_mut().zip(&self.sources) {
            let dL = source.d.length;
            column.dp += dL * (state.R * nu);
            column.w += dL * (state.R * u);
            column.dm_body += dL * slope;
        }
    }
}

impl Field for Flexible {
    fn slope(&self, s: f64, y: &[f64], dy: &mut [f64]) {
        let R = Matrix3::from_column_slice(&y[3..12]);
        let t: Vector3<f64> = R.column(2).into();
        let v = get(y, 12);
        let K = self.K(s);
        let u = self.u_star(s) + v;
        let n = self.n(s);
        let n_body = R.tr_mul(&n);
        let C_se = self.numbers.C_se;
        let nu = nu(C_se, n_body);
        let velocity = if self.shears { R * nu } else { t };
        let m_body = K.component_mul(&v);
        let v_slope = self.v_slope(s, &R, u, v);
        put(dy, 0, velocity); // p' = R nu
        // R' = R hat(u), column by column.
        let [d1, d2]: [Vector3<f64>; 2] = [R.column(0).into(), R.column(1).into()];
        put(dy, 3, u.z * d2 - u.y * t);
        put(dy, 6, u.x * t - u.z * d1);
        put(dy, 9, u.y * d1 - u.x * d2);
        put(dy, 12, v_slope); // (2)
        let columns = y[STATE..].chunks_exact(COLUMN).zip(dy[STATE..].chunks_exact_mut(COLUMN));
        for ((y, dy), source) in columns.zip(&self.sources) {
            let (w, dv, d) = (get(y, 0), get(y, 6), &source.d);
            let du = d.u_star + self.along(s) * d.u_star_rise + dv;
            let dn = source.dn_end + d.load * (self.numbers.length - s);
            let dn_body = R.tr_mul(&(dn - w.cross(&n)));
            let mut dm_body = K.component_mul(&dv);
            let mut stiffening = Vector3::zeros();
            if source.stiffens {
                let dK = self.dK(s, source);
                dm_body += dK.component_mul(&v);
                stiffening += dK.component_mul(&v_slope) + self.per_length * d.K_rise.component_mul(&v); // (18)
            }
            if self.tapers {
                stiffening += self.dK_ds.component_mul(&dv); // (18)
            }
            // (17)-(20): (2) varied.
            let mut torque = du.cross(&m_body) + u.cross(&dm_body) + nu.cross(&dn_body);
            let mut displacement = w.cross(&velocity);
            if self.shears {
                let dnu = C_se.component_mul(&dn_body) + d.C_se.component_mul(&n_body);
                torque += dnu.cross(&n_body);
                displacement += R * dnu;
            }
            if self.has_magnet {
                let dB_body = R.tr_mul(&(source.dB - w.cross(&self.B)));
                torque += d.mu.cross(&R.tr_mul(&self.B)) + self.numbers.mu.cross(&dB_body);
            }
            put(dy, 0, R * du); // (10)
            put(dy, 3, displacement); // (11)
            put(dy, 6, -(torque + stiffening).component_div(&K));
        }
    }

    fn measure(&self, y: &[f64], error: &[f64]) -> f64 {
        let largest = |v: &[f64]| v.iter().fold(0.0, |m, x| worse(m, x.abs()));
        // Curvature counts by the moment it makes.
        let largest_K = self.numbers.K.max().max((self.numbers.K + self.numbers.K_rise).max());
        let smallest_curvature = 1.0 / largest_K.max(1.0);
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
