//! Whether missing values could change the ranking: total indices with each of them at the least and at the largest value
//! seen.

use super::indices::Evidence;
use super::outputs::Output;
use super::pass::{Pass, ScalarSums};
use super::pick_freeze::PickFreeze;
use super::result::WorstCase;
use super::rows::{Reading, Rows};
use crate::results::ResultsError;

/// Reads the rows twice more.
pub(super) fn worst_cases(
    rows: &Rows,
    columns: &[String],
    reading: &Reading,
    evidence: &Evidence,
    outputs: &[&Output],
) -> Result<Vec<WorstCase>, ResultsError> {
    let ends: [fn(&ScalarSums) -> f64; 2] = [|sums| sums.moments.least, |sums| sums.moments.largest];
    let mut passes = Vec::new();
    for end in ends {
        let fill = evidence.sums.iter().map(end).collect();
        let mut pass = Pass::filled(evidence.layout, reading.inputs, reading.scalars, fill);
        rows.each(columns, |part| pass.add(&reading.read(part)))?;
        pass.finish();
        passes.push(pass.sums);
    }
    let total = |sums: &[ScalarSums], output: &Output, input: usize| {
        let parts: Vec<&PickFreeze> =
            output.components.iter().filter_map(|scalar| sums[*scalar].pick_freeze.as_ref()).collect();
        let estimator = evidence.estimator.pick_freeze();
        PickFreeze::total(&parts, estimator, input, evidence.confidence).estimate.value
    };
    let of = |output: &&Output| {
        let each = [evidence.sums, &passes[0], &passes[1]];
        let totals: Vec<[f64; 3]> =
            evidence.chosen.iter().map(|input| each.map(|sums| total(sums, output, *input))).collect();
        let order = |k: usize| {
            let mut order: Vec<usize> = (0..totals.len()).collect();
            order.sort_by(|i, j| totals[*j][k].total_cmp(&totals[*i][k]));
            order
        };
        let changes_order = (1..3).any(|k| order(k) != order(0));
        WorstCase { output: output.name.clone(), totals, changes_order }
    };
    Ok(outputs.iter().map(of).collect())
}
