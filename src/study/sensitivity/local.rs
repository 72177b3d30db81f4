//! Slopes in numbers that can be compared: by the input's whole value, and by one standard deviation.

use super::inputs::Input;
use super::kept::Kept;
use super::moments::{ascending, quantile};
use super::nominal::Nominal;
use super::outputs::{Output, Outputs};
use super::result::Local;

/// What all uncertain numbers do together, if they are independent.
const TOGETHER: &str = "all uncertain numbers";
const SHARES: [f64; 3] = [0.05, 0.5, 0.95];

/// Of every output with slopes: the inputs that are told of, then the uncertain numbers. Of a vector it is the length.
pub(super) fn local(
    outputs: &Outputs,
    inputs: &[Input],
    chosen: &[usize],
    uncertain: &[Input],
    kept: &Kept,
    nominal: Option<&Nominal>,
) -> Vec<Local> {
    let mut found = Vec::new();
    for output in outputs.outputs.iter().filter(|output| !output.is_indicator) {
        let by_input = |k: usize| output.components.iter().map(|scalar| kept.slopes(*scalar, k)).collect::<Vec<_>>();
        found.extend(chosen.iter().map(|k| of(outputs, output, &inputs[*k], &by_input(*k), nominal)));
        let by_number =
            |k: usize| output.components.iter().map(|scalar| kept.uncertain(*scalar, k)).collect::<Vec<_>>();
        let numbers = uncertain.iter().enumerate();
        found.extend(numbers.map(|(k, number)| of(outputs, output, number, &by_number(k), nominal)));
        let each: Vec<Vec<&[f64]>> = (0..uncertain.len()).map(by_number).collect();
        found.extend(together(output, uncertain, &each));
    }
    found.retain(|local| !local.slope.is_nan() || !local.quantiles[1].is_nan());
    found
}

fn of(outputs: &Outputs, output: &Output, input: &Input, slopes: &[&[f64]], nominal: Option<&Nominal>) -> Local {
    let slope = |scalar: &usize| nominal.map_or(f64::NAN, |nominal| nominal.slope(&outputs.scalars[*scalar], input));
    let slope = match &output.components[..] {
        [scalar] => slope(scalar),
        parts => parts.iter().map(|scalar| slope(scalar).powi(2)).sum::<f64>().sqrt(),
    };
    let deviation = input.law.standard_deviation();
    let changes: Vec<f64> = (0..rows(slopes)).map(|row| deviation * length(slopes, row)).collect();
    Local {
        output: output.name.clone(),
        input: input.name.clone(),
        slope,
        per_value: slope * input.law.mean(),
        per_deviation: slope * deviation,
        quantiles: quantiles(&changes),
    }
}

/// The standard deviation that all uncertain numbers give together in each row.
fn together(output: &Output, uncertain: &[Input], each: &[Vec<&[f64]>]) -> Option<Local> {
    let count = each.first().map_or(0, |slopes| rows(slopes));
    if uncertain.len() < 2 || count == 0 {
        return None;
    }
    let total = |row: usize| {
        let parts = uncertain.iter().zip(each);
        parts
            .map(|(number, slopes)| (number.law.standard_deviation() * length(slopes, row)).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let changes: Vec<f64> = (0..count).map(total).collect();
    let (output, input, nan) = (output.name.clone(), TOGETHER.to_owned(), f64::NAN);
    Some(Local { output, input, slope: nan, per_value: nan, per_deviation: nan, quantiles: quantiles(&changes) })
}

/// Rows for which every component has a slope.
fn rows(slopes: &[&[f64]]) -> usize {
    slopes.iter().map(|slopes| slopes.len()).min().unwrap_or(0)
}

/// Of the slope of a vector; of one component the slope with its sign.
fn length(slopes: &[&[f64]], row: usize) -> f64 {
    match slopes {
        [one] => one[row],
        parts => parts.iter().map(|part| part[row] * part[row]).sum::<f64>().sqrt(),
    }
}

fn quantiles(values: &[f64]) -> [f64; 3] {
    let sorted = ascending(values);
    SHARES.map(|share| quantile(&sorted, share))
}
