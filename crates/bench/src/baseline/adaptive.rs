//! An adaptive integrator as it comes in a crate: DOP853 of `ode_solvers` on the augmented state, that is position,
//! rotation, moment and their columns by base moment and inputs under one tolerance; Newton's method on the base
//! moment. What is integrated has no units, since the crate has one absolute tolerance for all numbers. R1, R2, R4

use super::method::{self, Column, Jacobian, Method, NewtonStep, Tip};
use super::rod::{Flexible, Input, Rigid, Rod, Segment, Source};
use nalgebra::allocator::Allocator;
use nalgebra::{Const, DVector, DefaultAllocator, Dim, Matrix3, OVector, SVector, Vector3};
use ode_solvers::{Dop853, OutputType, System};
use std::ops::Mul;

/// Numbers of the state: p, R by columns, m, n. Numbers of a column: dp, w, dm.
///
/// The force is in it so that slopes do not depend on the place: where they do, this DOP853 is wrong (it takes its last
/// stage for the first one's place; `srenevey/ode-solvers` #42).
const STATE: usize = 18;
const COLUMN: usize = 9;
/// State and the columns by base moment.
const NEWTON: usize = STATE + 3 * COLUMN;
/// In a segment; more are needed where numbers overflow.
const MOST_STEPS: u32 = 10_000;

/// Newton's method over an integrator with error control.
#[derive(Clone, Copy, Debug)]
pub struct Adaptive {
    /// Of a step, relative and absolute.
    tolerance: f64,
}

/// A flexible segment as the crate integrates it.
struct Span<'a> {
    flexible: &'a Flexible,
    sources: &'a [Source],
}

fn vector(numbers: &[f64], at: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&numbers[at..at + 3])
}

fn rotation(y: &[f64]) -> Matrix3<f64> {
    Matrix3::from_column_slice(&y[3..12])
}

fn put(numbers: &mut [f64], at: usize, v: &Vector3<f64>) {
    numbers[at..at + 3].copy_from_slice(v.as_slice());
}

fn add(numbers: &mut [f64], at: usize, v: &Vector3<f64>) {
    numbers[at..at + 3].iter_mut().zip(v).for_each(|(x, dx)| *x += dx);
}

impl<D: Dim> System<f64, OVector<f64, D>> for Span<'_>
where
    DefaultAllocator: Allocator<D>,
{
    #[inline(always)]
    fn system(&self, _: f64, y: &OVector<f64, D>, slopes: &mut OVector<f64, D>) {
        self.slopes(y.as_slice(), slopes.as_mut_slice());
    }
}

impl Span<'_> {
    #[inline(always)]
    fn slopes(&self, y: &[f64], slopes: &mut [f64]) {
        let Flexible { K, u_star, load, .. } = self.flexible;
        let (R, m, n) = (rotation(y), vector(y, 12), vector(y, 15));
        let t: Vector3<f64> = R.column(2).into();
        let strain = R.tr_mul(&m).component_div(K);
        put(slopes, 0, &t);
        slopes[3..12].copy_from_slice((R * (u_star + strain).cross_matrix()).as_slice()); // R2
        put(slopes, 12, &n.cross(&t)); // R1
        put(slopes, 15, &-load);
        for (column, slope) in y[STATE..].chunks_exact(COLUMN).zip(slopes[STATE..].chunks_exact_mut(COLUMN)) {
            let (w, dm) = (vector(column, 3), vector(column, 6));
            let dt = w.cross(&t);
            let du = R.tr_mul(&(dm - w.cross(&m))).component_div(K);
            put(slope, 0, &dt); // J2
            put(slope, 3, &(R * du)); // J1
            put(slope, 6, &n.cross(&dt));
        }
        for Source { column, dn, dK, du_star } in self.sources {
            let slope = &mut slopes[STATE + column * COLUMN..][..COLUMN];
            let du = du_star - dK.component_mul(&strain).component_div(K);
            add(slope, 3, &(R * du));
            add(slope, 6, &dn.cross(&t));
        }
    }
}

impl Rigid {
    /// Across the segment, where the force at its distal end is n.
    fn advance(&self, segment: usize, n: Vector3<f64>, B: &Vector3<f64>, inputs: &[Input], y: &mut [f64]) {
        let (state, columns) = y.split_at_mut(STATE);
        let (R, force) = (rotation(state), n + 0.5 * self.weight);
        let arm = self.length * R.column(2);
        let mu = R * self.mu;
        for (index, column) in columns.chunks_exact_mut(COLUMN).enumerate() {
            let w = vector(column, 3);
            let darm = w.cross(&arm);
            let (dmu, dforce) = match index.checked_sub(3).and_then(|index| inputs.get(index)) {
                Some(Input::Dipole { segment: of, per_unit }) if *of == segment => {
                    (R * Vector3::from(*per_unit), Vector3::zeros())
                }
                Some(Input::TipForce { per_unit }) => (Vector3::zeros(), (*per_unit).into()),
                _ => (Vector3::zeros(), Vector3::zeros()),
            };
            add(column, 0, &darm);
            add(column, 6, &-((w.cross(&mu) + dmu).cross(B) + darm.cross(&force) + arm.cross(&dforce)));
        }
        add(state, 0, &arm);
        add(state, 12, &-(mu.cross(B) + arm.cross(&force)));
    }
}

/// State and columns at the base.
fn start(rod: &Rod, m0: &Vector3<f64>, inputs: &[Input], y: &mut [f64]) {
    let (state, columns) = y.split_at_mut(STATE);
    put(state, 0, &rod.p0);
    state[3..12].copy_from_slice(rod.R0.as_slice());
    put(state, 12, m0);
    for (index, column) in columns.chunks_exact_mut(COLUMN).enumerate() {
        match (index.checked_sub(3).and_then(|index| inputs.get(index)), rod.segments.first()) {
            // The rod is pushed on along itself: the base pose moves by what was its slope.
            (Some(Input::Insertion), Some(Segment::Flexible(first))) => {
                let u = first.u_star + rod.R0.tr_mul(m0).component_div(&first.K);
                put(column, 0, &rod.R0.column(2).into());
                put(column, 3, &(rod.R0 * u));
            }
            (None, _) => column[6 + index] = 1.0,
            _ => {}
        }
    }
}

impl Adaptive {
    /// With a tolerance for each step, relative and absolute.
    pub fn new(tolerance: f64) -> Adaptive {
        Adaptive { tolerance }
    }

    /// State and columns at the tip; rod, inputs and base moment without units, `y` of the size that is asked for.
    fn pass<D: Dim>(
        &self,
        rod: &Rod,
        m0: &Vector3<f64>,
        inputs: &[Input],
        mut y: OVector<f64, D>,
    ) -> Option<OVector<f64, D>>
    where
        DefaultAllocator: Allocator<D>,
        OVector<f64, D>: Mul<f64, Output = OVector<f64, D>>,
    {
        start(rod, m0, inputs, y.as_mut_slice());
        for ((index, segment), n) in rod.segments.iter().enumerate().zip(rod.forces()) {
            match segment {
                Segment::Flexible(flexible) if flexible.length > 0.0 => {
                    // The first three columns are those by base moment.
                    let source = |(column, input): (usize, &Input)| input.source(column, index);
                    let sources: Vec<Source> = (3..).zip(inputs).filter_map(source).collect();
                    put(y.as_mut_slice(), 15, &(n + flexible.load * flexible.length));
                    y = self.integrate(Span { flexible, sources: &sources }, y)?;
                }
                Segment::Flexible(_) => {}
                Segment::Rigid(rigid) => rigid.advance(index, n, &rod.B, inputs, y.as_mut_slice()),
            }
        }
        Some(y)
    }

    /// The whole segment is tried first: where it bends little, that is the last step, too.
    fn integrate<D: Dim>(&self, span: Span<'_>, y: OVector<f64, D>) -> Option<OVector<f64, D>>
    where
        DefaultAllocator: Allocator<D>,
        OVector<f64, D>: Mul<f64, Output = OVector<f64, D>>,
    {
        let (length, tolerance) = (span.flexible.length, self.tolerance);
        // Safety factor, damping, least and largest change of the step, and test for stiffness are the crate's own.
        let (safety, beta, least, most, stiff) = (0.9, 0.0, 0.333, 6.0, 1000);
        let mut solver = Dop853::from_param(
            span,
            0.0,
            length,
            length,
            y,
            tolerance,
            tolerance,
            safety,
            beta,
            least,
            most,
            length,
            length,
            MOST_STEPS,
            stiff,
            OutputType::Sparse,
        );
        solver.integrate().ok()?;
        solver.y_out().last().cloned()
    }

    /// One pass from a base moment in SI, the rest without units. The numbers of inputs that bench scenes have are known to
    /// the compiler, which halves the time.
    fn pass_with(&self, rod: &Rod, unknowns: &[f64], inputs: &[Input]) -> Option<Vec<f64>> {
        let m0 = Vector3::from_column_slice(unknowns) / rod.moment_unit();
        let inputs: Vec<Input> = inputs.iter().map(|input| rod.input_without_units(input)).collect();
        let rod = rod.without_units();
        match inputs.len() {
            0 => self.sized::<NEWTON>(&rod, &m0, &inputs),
            3 => self.sized::<{ NEWTON + 3 * COLUMN }>(&rod, &m0, &inputs),
            4 => self.sized::<{ NEWTON + 4 * COLUMN }>(&rod, &m0, &inputs),
            7 => self.sized::<{ NEWTON + 7 * COLUMN }>(&rod, &m0, &inputs),
            17 => self.sized::<{ NEWTON + 17 * COLUMN }>(&rod, &m0, &inputs),
            count => {
                let zeros = DVector::zeros(NEWTON + count * COLUMN);
                Some(self.pass(&rod, &m0, &inputs, zeros)?.as_slice().to_vec())
            }
        }
    }

    fn sized<const N: usize>(&self, rod: &Rod, m0: &Vector3<f64>, inputs: &[Input]) -> Option<Vec<f64>> {
        Some(self.pass::<Const<N>>(rod, m0, inputs, SVector::zeros())?.as_slice().to_vec())
    }
}

/// d(moment at the tip)/d(m0)
fn matrix(y: &[f64]) -> Matrix3<f64> {
    Matrix3::from_columns(&[0, 1, 2].map(|k| vector(y, STATE + k * COLUMN + 6)))
}

impl Method for Adaptive {
    fn rest(&self, _: &Rod) -> Vec<f64> {
        vec![0.0; 3]
    }

    fn newton_step(&self, rod: &Rod, unknowns: &[f64]) -> Option<NewtonStep> {
        let y = self.pass_with(rod, unknowns, &[])?;
        let step = matrix(&y).lu().solve(&-vector(&y, 12))?;
        Some(NewtonStep { step: (step * rod.moment_unit()).as_slice().to_vec(), size: step.norm() })
    }

    fn tip(&self, rod: &Rod, unknowns: &[f64]) -> Tip {
        let y = self.pass_with(rod, unknowns, &[]).unwrap_or(vec![f64::NAN; NEWTON]);
        method::tip(rod.length() * vector(&y, 0), &rotation(&y))
    }

    fn jacobian(&self, rod: &Rod, unknowns: &[f64], inputs: &[Input]) -> Option<Jacobian> {
        let y = self.pass_with(rod, unknowns, inputs)?;
        let matrix = matrix(&y).lu();
        let base: [&[f64]; 3] = [0, 1, 2].map(|k| &y[STATE + k * COLUMN..][..COLUMN]);
        let mut columns = Vec::with_capacity(inputs.len());
        for (column, input) in y[NEWTON..].chunks_exact(COLUMN).zip(inputs) {
            let dm0 = matrix.solve(&-vector(column, 6))?;
            let (mut dp, mut w) = (vector(column, 0), vector(column, 3));
            for (base, change) in base.iter().zip(&dm0) {
                dp += *change * vector(base, 0);
                w += *change * vector(base, 3);
            }
            let scale = rod.scale(input);
            columns.push(Column { dp: (dp * (rod.length() / scale)).into(), w: (w / scale).into() });
        }
        Some(Jacobian { tip: method::tip(rod.length() * vector(&y, 0), &rotation(&y)), columns })
    }
}
