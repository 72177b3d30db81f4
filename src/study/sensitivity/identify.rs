//! What measurements tell of parameters, which ones tell most, and whether that stays so where the parameters may be.

use super::SensitivityError;
use super::candidates::{Candidates, Noise, Unknown, unknowns};
use super::design::Layout;
use super::experiments::{Observability, choose, fisher, log_determinant};
use super::options::Options;
use super::result::{Chosen, Identification, Information};
use super::rows::Source;
use crate::engines::cpu_f64;
use crate::model::{Parameter, Plan, PlanOptions};
use crate::spec::SweepSpec;
use crate::study::fit::{analyse, findings};
use crate::table::{Column, Table};
use nalgebra::{DMatrix, DVector};

/// An end of a normal law lies so many standard deviations from its mean.
const NORMAL_END: f64 = 1.96;
/// Corners are tried of at most so many uncertain numbers; of more, one end at a time.
const MOST_CORNERS: usize = 5;
/// Steps over the rod where rows are solved again.
const STEPS: usize = 24;

/// Fisher information of the candidates, and the best choice of measurements where one is asked for.
pub(super) fn identify(
    source: &Source,
    layout: &Layout,
    options: &Options,
) -> Result<Identification, SensitivityError> {
    let noise = noise(options)?;
    let unknowns = unknowns(source.spec(), source.columns(), &options.inputs)?;
    let candidates = Candidates::read(source, layout, &unknowns, noise, options.minimum_margin)?;
    let all: Vec<usize> = (0..candidates.samples.len()).collect();
    if all.is_empty() || options.choose.is_some_and(|count| count > all.len()) {
        let asked = options.choose.unwrap_or(1);
        return Err(SensitivityError::TooFewCandidates { asked, candidates: all.len() });
    }
    let chosen = match options.choose {
        Some(0) => {
            let expected = "at least 1 measurement";
            return Err(SensitivityError::Number { what: "the number of measurements", value: 0.0, expected });
        }
        Some(count) => choose(&candidates.matrices, &all, count),
        None => None,
    };
    let chosen = match chosen {
        Some(choice) => {
            let worst = worst(source.spec(), &unknowns, &candidates, &choice.rows, noise)?;
            Some(Chosen {
                samples: choice.rows.iter().map(|row| candidates.samples[*row]).collect(),
                margins: choice.rows.iter().map(|row| candidates.margins[*row]).collect(),
                table: table(source.spec(), &candidates, &choice.rows),
                information: information(&candidates.matrices, &choice.rows, &unknowns),
                worst,
            })
        }
        None => None,
    };
    Ok(Identification {
        parameters: unknowns.iter().map(|unknown| unknown.name.clone()).collect(),
        logarithmic: unknowns.iter().map(|unknown| unknown.logarithmic).collect(),
        noise: noise.position,
        tangent_noise: noise.tangent,
        candidates: all.len() as u64,
        minimum_margin: options.minimum_margin,
        all: information(&candidates.matrices, &all, &unknowns),
        chosen,
    })
}

fn noise(options: &Options) -> Result<Noise, SensitivityError> {
    let position = options.noise.unwrap_or(f64::NAN);
    let is_good = |x: f64| x > 0.0 && x.is_finite();
    if !is_good(position) {
        let expected = "the standard deviation of a measured coordinate, a length above zero such as 0.5 mm";
        return Err(SensitivityError::Number { what: "the noise", value: position, expected });
    }
    match options.tangent_noise.filter(|tangent| !is_good(*tangent)) {
        Some(value) => {
            let expected = "the standard deviation of a measured tangent, an angle above zero such as 2 deg";
            Err(SensitivityError::Number { what: "the noise of tangents", value, expected })
        }
        None => Ok(Noise { position, tangent: options.tangent_noise }),
    }
}

/// What some of the measurements tell together.
fn information(matrices: &[DMatrix<f64>], rows: &[usize], unknowns: &[Unknown]) -> Information {
    let fisher = fisher(matrices, rows);
    let eigen = fisher.clone().symmetric_eigen();
    let count = unknowns.len();
    // A square root of the information tells the same as all measurements together.
    let roots = DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| x.max(0.0).sqrt()));
    let (covariance, open, directions) = analyse(&(roots * eigen.eigenvectors.transpose()), 1.0);
    let deviations: Vec<f64> =
        (0..count).map(|k| if open[k] { f64::INFINITY } else { covariance[(k, k)].sqrt() }).collect();
    let correlation = |i: usize, j: usize| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
    let matrix = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        (0..count).map(|i| (0..count).map(|j| of(i, j)).collect()).collect()
    };
    let mut eigenvalues: Vec<f64> = eigen.eigenvalues.iter().copied().collect();
    eigenvalues.sort_by(f64::total_cmp);
    let names: Vec<String> = unknowns.iter().map(|unknown| unknown.name.clone()).collect();
    let logarithmic: Vec<bool> = unknowns.iter().map(|unknown| unknown.logarithmic).collect();
    Information {
        eigenvalues,
        deviations,
        correlations: matrix(&correlation),
        findings: findings(&names, &logarithmic, &directions),
        directions,
        observability: Observability::new(&fisher, rows.iter().map(|row| matrices[*row].nrows()).sum()),
        log_determinant: log_determinant(&fisher),
        fisher: matrix(&|i, j| fisher[(i, j)]),
    }
}

/// The chosen samples and the values that command them.
fn table(spec: &SweepSpec, candidates: &Candidates, rows: &[usize]) -> Table {
    let samples: Vec<u64> = rows.iter().map(|row| candidates.samples[*row]).collect();
    let mut columns = vec![Column::new("sample", "", samples)];
    for (k, parameter) in spec.axis_parameters().concat().iter().enumerate() {
        let values: Vec<f64> = rows.iter().map(|row| candidates.commands[*row][k]).collect();
        columns.push(Column::new(parameter.name(&spec.scene), parameter.unit(), values));
    }
    Table::new(columns)
}

/// The least determinant of the chosen measurements over the ends of what is uncertain, and that end in words.
fn worst(
    spec: &SweepSpec,
    unknowns: &[Unknown],
    candidates: &Candidates,
    rows: &[usize],
    noise: Noise,
) -> Result<Option<(f64, String)>, SensitivityError> {
    let commands: Vec<Vec<Parameter>> = spec.axis_parameters();
    let axes: Vec<Vec<Parameter>> = commands
        .iter()
        .flatten()
        .chain(unknowns.iter().flat_map(|unknown| &unknown.parameters))
        .map(|parameter| vec![*parameter])
        .collect();
    let driven: Vec<Parameter> = commands.concat();
    let is_free = |unknown: &&Unknown| !unknown.parameters.iter().any(|parameter| driven.contains(parameter));
    let open: Vec<&Unknown> = unknowns.iter().filter(|unknown| unknown.prior.is_some()).filter(is_free).collect();
    if open.is_empty() || open.len() < unknowns.len() {
        return Ok(None);
    }
    let wrt: Vec<Parameter> = unknowns.iter().flat_map(|unknown| unknown.parameters.iter().copied()).collect();
    let options = PlanOptions { tolerance: spec.tolerance, steps: STEPS, ..PlanOptions::default() };
    let plan = Plan::new(&spec.scene, &axes, &wrt, options)?;
    let mut engine = cpu_f64(&plan)?;
    let ends = ends(&open);
    let batch = plan.batch(ends.len() * rows.len(), |sample, values| {
        let (end, row) = (&ends[sample / rows.len()], rows[sample % rows.len()]);
        let shifted = unknowns.iter().zip(end).flat_map(|(unknown, side)| moved(unknown, *side));
        let of_row = candidates.commands[row].iter().copied();
        values.iter_mut().zip(of_row.chain(shifted)).for_each(|(to, from)| *to = from);
    });
    let solutions = engine.solve(&batch)?;
    let length = spec.scene.total_length();
    let mut worst: Option<(f64, String)> = None;
    for (number, end) in ends.iter().enumerate() {
        let matrix = |at: usize| {
            let sample = number * rows.len() + at;
            let mut first = 0;
            let rotation = solutions.tip_rotation(sample);
            let mut matrix = DMatrix::zeros(noise.numbers(), unknowns.len());
            for (k, (unknown, side)) in unknowns.iter().zip(end).enumerate() {
                for (j, rate) in unknown.rates(&moved(unknown, *side), length).into_iter().enumerate() {
                    let slope = |row: usize| rate * solutions.derivative(sample, first + j, row);
                    let [position, turn] = [0, 3].map(|from| std::array::from_fn(|a| slope(from + a)));
                    let column = DVector::from_vec(noise.weighed(position, turn, &rotation));
                    matrix.column_mut(k).axpy(1.0, &column, 1.0);
                }
                first += unknown.parameters.len();
            }
            solutions.status(sample).is_success().then_some(matrix)
        };
        let matrices: Option<Vec<DMatrix<f64>>> = (0..rows.len()).map(matrix).collect();
        let value = matrices.map_or(f64::NEG_INFINITY, |matrices| {
            log_determinant(&fisher(&matrices, &(0..rows.len()).collect::<Vec<_>>()))
        });
        if worst.as_ref().is_none_or(|(least, _)| value < *least) {
            worst = Some((value, words(unknowns, end)));
        }
    }
    Ok(worst)
}

/// Where each unknown is: at its value (0), its lower (-1) or upper end (1). Every corner, or one end at a time.
fn ends(open: &[&Unknown]) -> Vec<Vec<i8>> {
    let count = open.len();
    if count <= MOST_CORNERS {
        return (0..1 << count)
            .map(|bits| (0..count).map(|k| if bits >> k & 1 == 1 { 1 } else { -1 }).collect())
            .collect();
    }
    let alone = |k: usize, side: i8| (0..count).map(|j| if j == k { side } else { 0 }).collect();
    (0..count).flat_map(|k| [alone(k, -1), alone(k, 1)]).collect()
}

/// Values of an unknown's parameters at one of its ends.
fn moved(unknown: &Unknown, side: i8) -> Vec<f64> {
    let Some(axis) = unknown.prior.as_ref().filter(|_| side != 0) else { return unknown.values.clone() };
    let (low, high) = axis.distribution.range(NORMAL_END);
    let value = if side > 0 { high } else { low };
    unknown.values.iter().map(|nominal| if axis.scales { value * nominal } else { value }).collect()
}

fn words(unknowns: &[Unknown], end: &[i8]) -> String {
    let moved = unknowns.iter().zip(end).filter(|(_, side)| **side != 0);
    let words: Vec<String> =
        moved.map(|(unknown, side)| format!("{} {}", unknown.name, if *side > 0 { "high" } else { "low" })).collect();
    words.join(", ")
}
