//! The analytic form of Hao and others: p, R, u integrated with nine numbers a column (w, dp, du), fixed steps of RK4,
//! Newton's method on the base curvature, Jacobian by the implicit function theorem. (1)-(4), (10), (11), (17)-(20),
//! (26), (29), (33), corrected as `EQUATIONS.md` lists. What the inner loop calls is inlined by order: else its speed would
//! change by half with the compiler's division of the crate.

use super::method::{self, Column, Jacobian, Method, NewtonStep, Tip};
use super::rod::{Flexible, Input, Rigid, Rod, Segment, Source};
use nalgebra::{Matrix3, Vector3};

/// The paper's method with a number of steps for each segment.
#[derive(Clone, Debug)]
pub struct Paper {
    steps: Vec<usize>,
}

/// Pose and curvature, or their slopes.
#[derive(Clone, Copy, Debug)]
struct State {
    p: Vector3<f64>,
    R: Matrix3<f64>,
    u: Vector3<f64>,
}

/// Change of the state, or its slope.
#[derive(Clone, Copy, Debug, Default)]
struct Variation {
    w: Vector3<f64>,
    dp: Vector3<f64>,
    du: Vector3<f64>,
}

/// At the end of a segment: the moment in the body frame takes the place of the curvature.
struct Station {
    p: Vector3<f64>,
    R: Matrix3<f64>,
    m_body: Vector3<f64>,
    /// w, dp, dm_body
    columns: Vec<[Vector3<f64>; 3]>,
}

/// What one integration from base to tip yields.
pub(super) struct Passage {
    pub p: Vector3<f64>,
    pub R: Matrix3<f64>,
    /// Moment left over at the tip, body frame.
    pub residual: Vector3<f64>,
    /// w, dp, d(residual)
    pub columns: Vec<[Vector3<f64>; 3]>,
}

/// What the columns differentiate by.
#[derive(Clone, Copy, Debug)]
enum By<'a> {
    BaseCurvature(usize),
    Input(&'a Input),
}

/// Those of a segment that are not zero.
fn sources(by: &[By], segment: usize) -> Vec<Source> {
    let source = |(column, by): (usize, &By)| match by {
        By::Input(input) => input.source(column, segment),
        By::BaseCurvature(_) => None,
    };
    by.iter().enumerate().filter_map(source).collect()
}

const BASE: [By<'static>; 3] = [By::BaseCurvature(0), By::BaseCurvature(1), By::BaseCurvature(2)];

/// e3 x v
#[inline(always)]
fn e3_cross(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(-v.y, v.x, 0.0)
}

impl State {
    #[inline(always)]
    fn plus(&self, h: f64, slope: &State) -> State {
        State { p: self.p + h * slope.p, R: self.R + h * slope.R, u: self.u + h * slope.u }
    }
}

impl Variation {
    #[inline(always)]
    fn plus(&self, h: f64, slope: &Variation) -> Variation {
        Variation { w: self.w + h * slope.w, dp: self.dp + h * slope.dp, du: self.du + h * slope.du }
    }
}

impl Flexible {
    /// Slopes of the state and of its columns where the internal force is n.
    #[inline(always)]
    fn slopes(
        &self,
        n: Vector3<f64>,
        y: &State,
        columns: &[Variation],
        sources: &[Source],
        slopes: &mut [Variation],
    ) -> State {
        let State { R, u, .. } = y;
        let t: Vector3<f64> = R.column(2).into();
        let m_body = self.K.component_mul(&(u - self.u_star));
        let torque = u.cross(&m_body) + e3_cross(R.tr_mul(&n));
        for (Variation { w, du, .. }, slope) in columns.iter().zip(slopes.iter_mut()) {
            let dm_body = self.K.component_mul(du);
            let dtorque = du.cross(&m_body) + u.cross(&dm_body) - e3_cross(R.tr_mul(&w.cross(&n)));
            slope.w = R * du; // (10)
            slope.dp = w.cross(&t); // (11)
            slope.du = -dtorque.component_div(&self.K); // (17)-(20)
        }
        for Source { column, dn, dK, du_star } in sources {
            let dm_body = dK.component_mul(&(u - self.u_star)) - self.K.component_mul(du_star);
            let dtorque = u.cross(&dm_body) + e3_cross(R.tr_mul(dn));
            let by_stiffness = dK.component_mul(&torque.component_div(&self.K));
            slopes[*column].du -= (dtorque - by_stiffness).component_div(&self.K);
        }
        State { p: t, R: R * u.cross_matrix(), u: -torque.component_div(&self.K) } // (2)
    }

    /// Integrates the segment in fixed steps of RK4.
    fn advance(&self, n_end: Vector3<f64>, steps: usize, sources: &[Source], y: &mut State, columns: &mut [Variation]) {
        const STAGES: [(f64, f64); 4] = [(0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)];
        let h = self.length / steps as f64;
        let mut slopes = vec![Variation::default(); columns.len()];
        let mut stage_columns = columns.to_vec();
        let mut sums = columns.to_vec();
        for step in 0..steps {
            let mut sum = *y;
            let mut stage = *y;
            for (k, (at, weight)) in STAGES.into_iter().enumerate() {
                let n = n_end + self.load * (self.length - (step as f64 + at) * h);
                let slope = self.slopes(n, &stage, &stage_columns, sources, &mut slopes);
                sum = sum.plus(weight * h, &slope);
                sums.iter_mut().zip(&slopes).for_each(|(sum, slope)| *sum = sum.plus(weight * h, slope));
                if let Some((next, _)) = STAGES.get(k + 1) {
                    stage = y.plus(next * h, &slope);
                    for ((stage, start), slope) in stage_columns.iter_mut().zip(columns.iter()).zip(&slopes) {
                        *stage = start.plus(next * h, slope);
                    }
                }
            }
            *y = sum;
            columns.copy_from_slice(&sums);
            stage_columns.copy_from_slice(&sums);
        }
    }

    /// From station to station: (4) and (29) between moment and curvature.
    fn cross(&self, n_end: Vector3<f64>, steps: usize, sources: &[Source], station: &mut Station) {
        let u = self.u_star + station.m_body.component_div(&self.K); // (4)
        let mut y = State { p: station.p, R: station.R, u };
        let variation = |&[w, dp, dm]: &[Vector3<f64>; 3]| Variation { w, dp, du: dm.component_div(&self.K) };
        let mut columns: Vec<Variation> = station.columns.iter().map(variation).collect(); // (29)
        for Source { column, dK, du_star, .. } in sources {
            columns[*column].du += du_star - dK.component_mul(&(u - self.u_star)).component_div(&self.K);
        }
        self.advance(n_end, steps, sources, &mut y, &mut columns);
        (station.p, station.R) = (y.p, y.R);
        station.m_body = self.K.component_mul(&(y.u - self.u_star));
        for (column, Variation { w, dp, du }) in station.columns.iter_mut().zip(&columns) {
            *column = [*w, *dp, self.K.component_mul(du)];
        }
        for Source { column, dK, du_star, .. } in sources {
            station.columns[*column][2] += dK.component_mul(&(y.u - self.u_star)) - self.K.component_mul(du_star);
        }
    }
}

impl Rigid {
    /// Across the segment, with what each column adds to its dipole.
    fn cross(
        &self,
        B: Vector3<f64>,
        n_end: Vector3<f64>,
        dmu: &[Vector3<f64>],
        sources: &[Source],
        station: &mut Station,
    ) {
        let R = station.R;
        let t: Vector3<f64> = R.column(2).into();
        let B_body = R.tr_mul(&B);
        let force = n_end + 0.5 * self.weight;
        for ([w, dp, dm_body], dmu) in station.columns.iter_mut().zip(dmu) {
            let dtau = dmu.cross(&B_body) - self.mu.cross(&R.tr_mul(&w.cross(&B))); // (26)
            *dp += self.length * w.cross(&t);
            *dm_body -= dtau - self.length * e3_cross(R.tr_mul(&w.cross(&force))); // (29)
        }
        for Source { column, dn, .. } in sources {
            station.columns[*column][2] -= self.length * e3_cross(R.tr_mul(dn));
        }
        let tau = self.mu.cross(&B_body); // (1)
        station.p += self.length * t;
        station.m_body -= tau + self.length * e3_cross(R.tr_mul(&force)); // (4)
    }
}

impl Paper {
    /// `steps` over the flexible part of the rod, shared out by length.
    pub fn new(rod: &Rod, steps: usize) -> Paper {
        Paper { steps: rod.shares(steps) }
    }

    /// One integration without columns.
    pub(super) fn integrate(&self, rod: &Rod, u0: Vector3<f64>) -> Passage {
        self.pass(rod, u0, &[])
    }

    fn pass(&self, rod: &Rod, u0: Vector3<f64>, by: &[By]) -> Passage {
        let Some(Segment::Flexible(first)) = rod.segments.first() else {
            unreachable!("a baseline's rod begins with a flexible segment")
        };
        let t: Vector3<f64> = rod.R0.column(2).into();
        let start = |by: &By| match *by {
            By::BaseCurvature(k) => [Vector3::zeros(), Vector3::zeros(), Vector3::ith(k, first.K[k])],
            // The rod is pushed on along itself: the base pose moves by what was its slope.
            By::Input(Input::Insertion) => [rod.R0 * u0, t, Vector3::zeros()],
            // The base curvature stays, its moment does not.
            By::Input(Input::RestCurvature { segment: 0, per_unit }) => {
                [Vector3::zeros(), Vector3::zeros(), -first.K.component_mul(&Vector3::from(*per_unit))]
            }
            By::Input(Input::Stiffness { segment: 0, per_unit }) => {
                let dm_body = Vector3::from(*per_unit).component_mul(&(u0 - first.u_star));
                [Vector3::zeros(), Vector3::zeros(), dm_body]
            }
            By::Input(_) => [Vector3::zeros(); 3],
        };
        let m_body = first.K.component_mul(&(u0 - first.u_star));
        let mut station = Station { p: rod.p0, R: rod.R0, m_body, columns: by.iter().map(start).collect() };
        let forces = rod.forces();
        for (j, segment) in rod.segments.iter().enumerate() {
            let sources = sources(by, j);
            match segment {
                Segment::Flexible(flexible) => flexible.cross(forces[j], self.steps[j], &sources, &mut station),
                Segment::Rigid(rigid) => {
                    let dmu = |by: &By| match by {
                        By::Input(Input::Dipole { segment, per_unit }) if *segment == j => Vector3::from(*per_unit),
                        _ => Vector3::zeros(),
                    };
                    let dmu: Vec<Vector3<f64>> = by.iter().map(dmu).collect();
                    rigid.cross(rod.B, forces[j], &dmu, &sources, &mut station);
                }
            }
        }
        let Station { p, R, m_body, columns } = station;
        Passage { p, R, residual: m_body, columns } // (3)
    }
}

/// d(residual)/d(u0)
fn matrix(passage: &Passage) -> Matrix3<f64> {
    Matrix3::from_columns(&[0, 1, 2].map(|k| passage.columns[k][2]))
}

impl Method for Paper {
    fn rest(&self, rod: &Rod) -> Vec<f64> {
        match rod.segments.first() {
            Some(Segment::Flexible(first)) => first.u_star.as_slice().to_vec(),
            _ => vec![0.0; 3],
        }
    }

    fn newton_step(&self, rod: &Rod, unknowns: &[f64]) -> Option<NewtonStep> {
        let passage = self.pass(rod, Vector3::from_column_slice(unknowns), &BASE);
        let step = matrix(&passage).lu().solve(&-passage.residual)?;
        Some(NewtonStep { step: step.as_slice().to_vec(), size: step.norm() * rod.length() })
    }

    fn tip(&self, rod: &Rod, unknowns: &[f64]) -> Tip {
        let passage = self.integrate(rod, Vector3::from_column_slice(unknowns));
        method::tip(passage.p, &passage.R)
    }

    fn jacobian(&self, rod: &Rod, unknowns: &[f64], inputs: &[Input]) -> Option<Jacobian> {
        let mut by = BASE.to_vec();
        by.extend(inputs.iter().map(By::Input));
        let passage = self.pass(rod, Vector3::from_column_slice(unknowns), &by);
        let matrix = matrix(&passage).lu();
        let mut columns = Vec::with_capacity(inputs.len());
        for [w, dp, dresidual] in &passage.columns[3..] {
            let du0: Vector3<f64> = matrix.solve(&-dresidual)?; // (33)
            let (mut dp, mut w) = (*dp, *w);
            for (k, [w_base, dp_base, _]) in passage.columns[..3].iter().enumerate() {
                w += du0[k] * w_base;
                dp += du0[k] * dp_base;
            }
            columns.push(Column { dp: dp.into(), w: w.into() });
        }
        Some(Jacobian { tip: method::tip(passage.p, &passage.R), columns })
    }
}
