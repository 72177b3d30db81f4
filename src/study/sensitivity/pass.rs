//! One pass over the rows: sums of every output, in bounded memory.
//!
//! Outputs are summed side by side, each in order of rows. So the numbers do not depend on threads.

use super::anova::GridSums;
use super::cosine::{Cosines, Harmonics};
use super::design::{Design, Layout};
use super::inputs::Input;
use super::moments::Moments;
use super::outputs::Scalar;
use super::pick_freeze::PickFreeze;
use super::rows::Block;
use crate::model::Status;
use rayon::prelude::*;

/// Rows that are worked out at a time.
const ROWS: usize = 4096;

/// Sums of one scalar.
#[derive(Clone, Debug)]
pub(super) struct ScalarSums {
    pub pick_freeze: Option<PickFreeze>,
    pub grid: Option<GridSums>,
    /// By input; empty on a grid.
    pub cosines: Vec<Cosines>,
    pub moments: Moments,
}

/// Sums of all scalars.
pub(super) struct Pass<'a> {
    layout: &'a Layout,
    inputs: &'a [Input],
    scalars: &'a [Scalar],
    /// Stands for what is missing, by scalar.
    fill: Option<Vec<f64>>,
    pub sums: Vec<ScalarSums>,
    /// Rows by status code.
    pub counts: [u64; Status::ALL.len()],
}

impl<'a> Pass<'a> {
    pub fn new(layout: &'a Layout, inputs: &'a [Input], scalars: &'a [Scalar]) -> Pass<'a> {
        Pass { layout, inputs, scalars, fill: None, sums: Vec::new(), counts: [0; Status::ALL.len()] }
    }

    /// The same with a value in place of each that is missing.
    pub fn filled(layout: &'a Layout, inputs: &'a [Input], scalars: &'a [Scalar], fill: Vec<f64>) -> Pass<'a> {
        Pass { fill: Some(fill), ..Pass::new(layout, inputs, scalars) }
    }

    pub fn add(&mut self, block: &Block) {
        block.statuses.iter().for_each(|status| self.counts[status.code() as usize] += 1);
        if self.sums.is_empty() {
            self.sums = (0..self.scalars.len()).map(|scalar| self.begin(scalar, &block.values[scalar])).collect();
        }
        let Pass { layout, inputs, fill, sums, .. } = self;
        let is_grid = matches!(layout.design, Design::Grid(_));
        for first in (0..block.samples.len()).step_by(ROWS) {
            let rows = first..(first + ROWS).min(block.samples.len());
            let harmonics: Vec<Harmonics> = match is_grid {
                true => Vec::new(),
                false => rows.clone().into_par_iter().flat_map_iter(|row| harmonics(inputs, block, row)).collect(),
            };
            sums.par_iter_mut().enumerate().for_each(|(scalar, sums)| {
                let fill = fill.as_ref().map(|fill| fill[scalar]);
                for (at, row) in rows.clone().enumerate() {
                    let harmonics = harmonics.get(at * inputs.len()..(at + 1) * inputs.len()).unwrap_or_default();
                    sums.add(layout, block, scalar, row, harmonics, fill);
                }
            });
        }
    }

    /// The sums are complete.
    pub fn finish(&mut self) {
        for sums in &mut self.sums {
            sums.pick_freeze = sums.pick_freeze.take().map(PickFreeze::finish);
            sums.cosines = std::mem::take(&mut sums.cosines).into_iter().map(Cosines::finish).collect();
        }
    }

    /// Empty sums about the mean of the first rows.
    fn begin(&self, scalar: usize, first: &[f64]) -> ScalarSums {
        let usable: Vec<f64> = first.iter().copied().filter(|x| x.is_finite()).collect();
        let offset = if usable.is_empty() { 0.0 } else { usable.iter().sum::<f64>() / usable.len() as f64 };
        let (inputs, has_slopes) = (self.inputs.len(), self.scalars[scalar].has_slopes);
        let cosines = vec![Cosines::new(offset, has_slopes); inputs];
        let (pick_freeze, grid, cosines) = match &self.layout.design {
            Design::PickFreeze(_) => (Some(PickFreeze::new(inputs, self.layout.bases(), offset)), None, cosines),
            Design::Grid(points) => (None, Some(GridSums::new(points, offset)), Vec::new()),
            Design::Sample => (None, None, cosines),
        };
        ScalarSums { pick_freeze, grid, cosines, moments: Moments::new(offset) }
    }
}

impl ScalarSums {
    fn add(
        &mut self,
        layout: &Layout,
        block: &Block,
        scalar: usize,
        row: usize,
        harmonics: &[Harmonics],
        fill: Option<f64>,
    ) {
        let (sample, known) = (block.samples[row], block.values[scalar][row]);
        let value = fill.filter(|_| known.is_nan()).unwrap_or(known);
        if let (Some(sums), Design::PickFreeze(design)) = (&mut self.pick_freeze, &layout.design) {
            let each = design.rows_per_base();
            sums.push(sample / each, (sample % each) as usize, value);
        }
        if let Some(grid) = &mut self.grid {
            grid.add(sample, value);
        }
        let Some(item) = layout.item(sample) else { return };
        self.moments.add(value);
        let block_number = layout.block(item);
        for (input, (cosines, at)) in self.cosines.iter_mut().zip(harmonics).enumerate() {
            let slope = block.slopes[scalar].get(input).map_or(0.0, |slopes| slopes[row]);
            cosines.add(block_number, value, slope, at);
        }
    }
}

/// Of every input in a row.
fn harmonics(inputs: &[Input], block: &Block, row: usize) -> Vec<Harmonics> {
    let sample = block.samples[row];
    let of = |(input, values): (&Input, &Vec<f64>)| {
        let share = input.law.share(values[row], sample);
        Harmonics::new(share, input.law.rate(share))
    };
    inputs.iter().zip(&block.inputs).map(of).collect()
}
