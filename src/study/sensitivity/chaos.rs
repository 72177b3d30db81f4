//! Polynomial chaos from values and slopes: indices are sums of squared coefficients (Sudret 2008).
//!
//! Least squares in an orthonormal basis. A row gives one equation of its value and one of each slope, by the input's
//! standard variable: over half the range of a uniform law, over the standard deviation of a normal one (Peng, Hampton,
//! Doostan 2016). A fifth of the rows is held out. The degree that predicts them best is taken, then fitted to all rows.

use super::cholesky;
use super::polynomials::{Basis, Family};
use super::sums::Share;
use crate::spec::Selection;
use nalgebra::DMatrix;

/// Largest total degree.
pub const MAX_DEGREE: usize = 4;
/// Inputs that a chaos may have.
pub const MAX_INPUTS: usize = 12;
/// Share of the held-out variance that a chaos has to predict.
pub const GOOD: f64 = 0.999;
/// A chaos that predicts this share needs no higher degree.
const BEST: f64 = 1.0 - 1e-6;
/// Equations for each term, at least; and at most, for more cost time and gain little.
const EQUATIONS: usize = 6;
const MOST_EQUATIONS: usize = 24;
/// Terms of a basis.
const MAX_TERMS: usize = 2000;
/// One in so many rows is held out.
const HELD_OUT: usize = 5;
/// Equations that are worked out at a time.
const CHUNK: usize = 512;

/// Rows to fit to, of outputs that are known alike.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChaosRows {
    /// Standard variables of the inputs, row by row.
    pub points: Vec<f64>,
    /// Values of the outputs, row by row.
    pub values: Vec<f64>,
    /// Slopes by the standard variables: by row, input and output; or empty.
    pub slopes: Vec<f64>,
}

/// A polynomial of one output.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Chaos {
    /// Terms.
    pub basis: Basis,
    /// Of each term.
    pub coefficients: Vec<f64>,
    /// Total degree.
    pub degree: usize,
    /// Share of the held-out variance that is predicted (Q²); NaN where nothing was held out.
    pub predicted: f64,
    /// Rows that were fitted to.
    pub rows: usize,
}

/// Rows, inputs and outputs of what is fitted.
#[derive(Clone, Copy)]
struct Shape {
    rows: usize,
    inputs: usize,
    outputs: usize,
}

impl ChaosRows {
    fn shape(&self, inputs: usize) -> Shape {
        let rows = self.points.len() / inputs.max(1);
        Shape { rows, inputs, outputs: self.values.len() / rows.max(1) }
    }

    /// Whether there are equations enough for a degree, and terms not too many.
    fn suffice(&self, shape: Shape, degree: usize) -> bool {
        let equations = shape.rows * if self.slopes.is_empty() { 1 } else { 1 + shape.inputs };
        let size = Basis::size(shape.inputs, degree).unwrap_or(usize::MAX);
        shape.inputs <= MAX_INPUTS && shape.rows >= HELD_OUT && size <= MAX_TERMS && EQUATIONS * size <= equations
    }
}

impl Chaos {
    /// Fits a chaos of one degree to all rows, for each output.
    pub fn fit(families: &[Family], rows: &ChaosRows, degree: usize) -> Vec<Chaos> {
        let shape = rows.shape(families.len());
        fit_all(&Basis::new(families, degree), rows, shape, &vec![f64::NAN; shape.outputs], degree)
    }

    /// Fits, for each output, a chaos of the degree that predicts best; higher ones are not tried where one predicts all
    /// but a millionth. `None` where the rows are too few for the first degree. `degree` is the largest to try.
    pub fn choose(families: &[Family], rows: &ChaosRows, degree: usize) -> Vec<Option<Chaos>> {
        let shape = rows.shape(families.len());
        let mut chosen: Vec<Option<Chaos>> = vec![None; shape.outputs];
        for degree in 1..=degree.min(MAX_DEGREE) {
            let is_enough = |chaos: &Option<Chaos>| chaos.as_ref().is_some_and(|chaos| chaos.predicted >= BEST);
            if !rows.suffice(shape, degree) || chosen.iter().all(is_enough) {
                break;
            }
            let basis = Basis::new(families, degree);
            let predicted = held_out(&basis, rows, shape);
            let is_better = |(chaos, predicted): (&Option<Chaos>, &f64)| {
                !is_enough(chaos) && chaos.as_ref().is_none_or(|chaos| *predicted > chaos.predicted)
            };
            let better: Vec<bool> = chosen.iter().zip(&predicted).map(is_better).collect();
            if better.contains(&true) {
                let fitted = fit_all(&basis, rows, shape, &predicted, degree);
                for ((chosen, fitted), is_better) in chosen.iter_mut().zip(fitted).zip(better) {
                    if is_better {
                        *chosen = Some(fitted);
                    }
                }
            }
        }
        chosen
    }

    /// Its value at a point, in standard variables.
    pub fn value(&self, point: &[f64]) -> f64 {
        let mut terms = vec![0.0; self.basis.len()];
        self.basis.terms(&self.basis.factors(point), None, &mut terms);
        terms.iter().zip(&self.coefficients).map(|(term, c)| term * c).sum()
    }

    /// Mean of the output.
    pub fn mean(&self) -> f64 {
        self.coefficients[0]
    }

    /// Variance of the output.
    pub fn variance(&self) -> f64 {
        self.share(|_| true).part
    }

    /// The predicted part of the output's variance, beside the whole; 0 where the output is the same in every row, whose share is 0 / 0.
    pub(super) fn predicted_share(&self) -> Share {
        let whole = self.variance();
        Share { part: if self.predicted.is_finite() { self.predicted * whole } else { 0.0 }, whole }
    }

    /// Index of first order.
    pub fn first(&self, input: usize) -> Share {
        self.share(|term| term.iter().enumerate().all(|(k, e)| (k == input) == (*e > 0)))
    }

    /// Total index.
    pub fn total(&self, input: usize) -> Share {
        self.share(|term| term[input] > 0)
    }

    /// Index of second order.
    pub fn second(&self, [i, j]: [usize; 2]) -> Share {
        self.share(|term| term.iter().enumerate().all(|(k, e)| (k == i || k == j) == (*e > 0)))
    }

    /// Variance of the terms that are chosen, and of all but the constant.
    fn share(&self, is_chosen: impl Fn(&[u8]) -> bool) -> Share {
        let terms = self.basis.exponents().iter().zip(&self.coefficients).skip(1);
        terms.fold(Share::default(), |Share { part, whole }, (term, c)| Share {
            part: part + if is_chosen(term) { c * c } else { 0.0 },
            whole: whole + c * c,
        })
    }
}

/// A chaos of each output, from all rows.
fn fit_all(basis: &Basis, rows: &ChaosRows, shape: Shape, predicted: &[f64], degree: usize) -> Vec<Chaos> {
    let all: Vec<usize> = (0..shape.rows).collect();
    let fitted = fit_rows(basis, rows, shape, &all).into_iter().zip(predicted);
    let chaos = |(coefficients, predicted): (Vec<f64>, &f64)| Chaos {
        basis: basis.clone(),
        coefficients,
        degree,
        predicted: *predicted,
        rows: shape.rows,
    };
    fitted.map(chaos).collect()
}

/// Share of the variance of a fifth of the rows that a fit to the others predicts, by output.
fn held_out(basis: &Basis, rows: &ChaosRows, shape: Shape) -> Vec<f64> {
    let held = Selection::new(shape.rows as u64, (shape.rows / HELD_OUT) as u64, 0);
    let (test, train): (Vec<usize>, Vec<usize>) = (0..shape.rows).partition(|row| held.contains(*row as u64));
    predicted(basis, &fit_rows(basis, rows, shape, &train), rows, shape, &test)
}

/// Coefficients by output, by the normal equations.
fn fit_rows(basis: &Basis, rows: &ChaosRows, shape: Shape, chosen: &[usize]) -> Vec<Vec<f64>> {
    let Shape { inputs, outputs, .. } = shape;
    let mut gram = DMatrix::zeros(basis.len(), basis.len());
    let mut right = DMatrix::zeros(basis.len(), outputs);
    let each = if rows.slopes.is_empty() { 1 } else { 1 + inputs };
    let some = Selection::new(chosen.len() as u64, (MOST_EQUATIONS * basis.len() / each) as u64, 4);
    let chosen: Vec<usize> = (0..some.len()).map(|k| chosen[some.get(k) as usize]).collect();
    for part in chosen.chunks((CHUNK / each).max(1)) {
        let mut terms = DMatrix::zeros(basis.len(), part.len() * each);
        let mut known = DMatrix::zeros(part.len() * each, outputs);
        for (at, row) in part.iter().enumerate() {
            let factors = basis.factors(&rows.points[row * inputs..][..inputs]);
            for equation in 0..each {
                let place = at * each + equation;
                let by = equation.checked_sub(1);
                basis.terms(&factors, by, &mut terms.as_mut_slice()[place * basis.len()..][..basis.len()]);
                let values = match by {
                    None => &rows.values[row * outputs..],
                    Some(input) => &rows.slopes[(row * inputs + input) * outputs..],
                };
                (0..outputs).for_each(|output| known[(place, output)] = values[output]);
            }
        }
        right.gemm(1.0, &terms, &known, 1.0);
        gram.gemm(1.0, &terms, &terms.transpose(), 1.0);
    }
    let solved = cholesky::solve(gram, right);
    (0..outputs).map(|output| solved.column(output).iter().copied().collect()).collect()
}

/// 1 - (squared errors) / (squared distances from the mean) over the chosen rows, by output.
fn predicted(basis: &Basis, fitted: &[Vec<f64>], rows: &ChaosRows, shape: Shape, chosen: &[usize]) -> Vec<f64> {
    let Shape { inputs, outputs, .. } = shape;
    let value = |row: usize, output: usize| rows.values[row * outputs + output];
    let mean = |output| chosen.iter().map(|row| value(*row, output)).sum::<f64>() / chosen.len() as f64;
    let means: Vec<f64> = (0..outputs).map(mean).collect();
    let (mut errors, mut distances) = (vec![0.0; outputs], vec![0.0; outputs]);
    let mut terms = vec![0.0; basis.len()];
    for row in chosen {
        basis.terms(&basis.factors(&rows.points[row * inputs..][..inputs]), None, &mut terms);
        for output in 0..outputs {
            let predicted: f64 = terms.iter().zip(&fitted[output]).map(|(term, c)| term * c).sum();
            errors[output] += (value(*row, output) - predicted).powi(2);
            distances[output] += (value(*row, output) - means[output]).powi(2);
        }
    }
    errors.iter().zip(distances).map(|(error, distance)| 1.0 - error / distance).collect()
}
