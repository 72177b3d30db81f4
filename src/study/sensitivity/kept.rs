//! Rows that are kept: a fixed, evenly spread choice, whatever the length of the sweep.

use super::chaos::ChaosRows;
use super::design::Layout;
use super::inputs::Input;
use super::outputs::Scalar;
use super::polynomials::{Basis, Family};
use super::rows::Block;
use crate::spec::Selection;

/// Rows whose values are kept, for quantiles.
const VALUES: u64 = 262_144;
/// Rows that are kept with their slopes, for chaos and the quantiles of slopes, at least.
const SLOPES: u64 = 8192;
/// Terms of a chaos for which enough rows without slopes are kept.
const MOST_TERMS: usize = 2000;

/// Rows that are kept.
pub(super) struct Kept {
    values_of: Selection,
    slopes_of: Selection,
    /// By scalar; NaN for none.
    pub values: Vec<Vec<f64>>,
    /// What the first order about the nominal sample says of the same rows.
    pub linear: Vec<Vec<f64>>,
    /// Rows with standard variables, by scalar and input; empty for a scalar without slopes.
    points: Vec<f64>,
    chaos_values: Vec<Vec<f64>>,
    slopes: Vec<Vec<Vec<f64>>>,
    /// By scalar and uncertain number.
    uncertain: Vec<Vec<Vec<f64>>>,
}

/// First order about the nominal sample: value and slopes by scalar, or distance from slopes of the tip.
pub(super) type Linear<'a> = dyn Fn(usize, &[f64]) -> f64 + 'a;

impl Kept {
    pub fn new(layout: &Layout, inputs: &[Input], uncertain: &[Input], scalars: &[Scalar]) -> Kept {
        let terms = (1..=super::MAX_DEGREE).filter_map(|degree| Basis::size(inputs.len(), degree));
        let most = terms.filter(|terms| *terms <= MOST_TERMS).max().unwrap_or(0) as u64;
        let none = vec![Vec::new(); scalars.len()];
        let of = |scalar: &Scalar| vec![Vec::new(); if scalar.has_slopes { inputs.len() } else { 0 }];
        Kept {
            values_of: Selection::new(layout.items(), VALUES, 1),
            slopes_of: Selection::new(layout.items(), SLOPES.max(6 * most), 2),
            values: none.clone(),
            linear: none.clone(),
            points: Vec::new(),
            chaos_values: none,
            slopes: scalars.iter().map(of).collect(),
            uncertain: vec![vec![Vec::new(); uncertain.len()]; scalars.len()],
        }
    }

    pub fn add(&mut self, layout: &Layout, inputs: &[Input], block: &Block, linear: Option<&Linear>) {
        let mut x = vec![0.0; inputs.len()];
        for (row, sample) in block.samples.iter().enumerate() {
            let Some(item) = layout.item(*sample) else { continue };
            if self.values_of.contains(item) {
                x.iter_mut().zip(&block.inputs).for_each(|(x, values)| *x = values[row]);
                for (scalar, values) in block.values.iter().enumerate() {
                    self.values[scalar].push(values[row]);
                    self.linear[scalar].push(linear.map_or(f64::NAN, |linear| linear(scalar, &x)));
                }
            }
            if self.slopes_of.contains(item) && block.usable[row] {
                for (input, values) in inputs.iter().zip(&block.inputs) {
                    self.points.push(input.law.standard(values[row], *sample));
                }
                for (scalar, values) in block.values.iter().enumerate() {
                    self.chaos_values[scalar].push(values[row]);
                    let known = self.slopes[scalar].iter_mut().zip(&block.slopes[scalar]);
                    let uncertain = self.uncertain[scalar].iter_mut().zip(&block.uncertain[scalar]);
                    known.chain(uncertain).for_each(|(to, from)| to.push(from[row]));
                }
            }
        }
    }

    /// Slopes of a scalar by an input in the rows that are kept with them.
    pub fn slopes(&self, scalar: usize, input: usize) -> &[f64] {
        self.slopes[scalar].get(input).map_or(&[], Vec::as_slice)
    }

    /// The same by an uncertain number.
    pub fn uncertain(&self, scalar: usize, number: usize) -> &[f64] {
        &self.uncertain[scalar][number]
    }

    /// Rows to fit a chaos of some scalars to; slopes are taken where all have them.
    pub fn chaos_rows(&self, inputs: &[Input], scalars: &[usize]) -> ChaosRows {
        let has_slopes = scalars.iter().all(|scalar| !self.slopes[*scalar].is_empty())
            && inputs.iter().all(|input| input.law.is_steady());
        let mut rows = ChaosRows::default();
        for (row, point) in self.points.chunks(inputs.len().max(1)).enumerate() {
            let values: Vec<f64> = scalars.iter().map(|scalar| self.chaos_values[*scalar][row]).collect();
            let mut slopes = Vec::new();
            for (input, standard) in point.iter().enumerate().filter(|_| has_slopes) {
                let rate = inputs[input].law.standard_rate(*standard);
                slopes.extend(scalars.iter().map(|scalar| rate * self.slopes[*scalar][input][row]));
            }
            if values.iter().chain(&slopes).chain(point).all(|x| x.is_finite()) {
                rows.points.extend(point);
                rows.values.extend(values);
                rows.slopes.extend(slopes);
            }
        }
        rows
    }

    pub fn families(inputs: &[Input]) -> Vec<Family> {
        inputs.iter().map(|input| input.law.family()).collect()
    }
}
