//! How outputs spread, beside what the slopes at the nominal sample say of the same rows.

use super::inputs::Input;
use super::kept::Kept;
use super::moments::{Moments, ascending, lumps, quantile};
use super::nominal::Nominal;
use super::outputs::{Kind, Output, Outputs, Scalar};
use super::pass::ScalarSums;
use super::result::{QUANTILES, Spread};
use crate::model::Vector;

/// The first order holds where the spread of the rows over its own lies within this of 1.
const HOLDS: f64 = 0.05;

/// The scalars to first order about the nominal sample.
pub(super) struct Linearised {
    means: Vec<f64>,
    /// By scalar: nominal value, slopes by input.
    scalars: Vec<(f64, Vec<f64>)>,
    /// Slopes of the tip by input.
    tip: Vec<Vector>,
    is_distance: Vec<bool>,
}

impl Linearised {
    pub fn new(nominal: &Nominal, outputs: &Outputs, inputs: &[Input]) -> Linearised {
        let of = |scalar: &Scalar| {
            let slopes = inputs.iter().map(|input| nominal.slope(scalar, input)).collect();
            (nominal.value(scalar), slopes)
        };
        Linearised {
            means: inputs.iter().map(|input| input.law.mean()).collect(),
            scalars: outputs.scalars.iter().map(of).collect(),
            tip: inputs.iter().map(|input| nominal.tip_slope(input)).collect(),
            is_distance: outputs.scalars.iter().map(|scalar| scalar.kind == Kind::Distance).collect(),
        }
    }

    /// A scalar at some values of the inputs; NaN for what is no position.
    pub fn value(&self, scalar: usize, inputs: &[f64]) -> f64 {
        let off = || inputs.iter().zip(&self.means).map(|(x, mean)| x - mean);
        if self.is_distance[scalar] {
            let along = |axis: usize| off().zip(&self.tip).map(|(off, slope)| off * slope[axis]).sum::<f64>();
            return (0..3).map(|axis| along(axis).powi(2)).sum::<f64>().sqrt();
        }
        let (nominal, slopes) = &self.scalars[scalar];
        nominal + off().zip(slopes).map(|(off, slope)| off * slope).sum::<f64>()
    }
}

/// The spread of every scalar that is asked for.
pub(super) fn spreads(
    outputs: &Outputs,
    sums: &[ScalarSums],
    kept: &Kept,
    nominal: Option<&Nominal>,
    linear: Option<&Linearised>,
    jumps: &dyn Fn(&Output) -> Option<String>,
) -> Vec<Spread> {
    let told = outputs.outputs.iter().filter(|output| !output.is_indicator && output.components.len() == 1);
    let spread = |output: &Output| {
        let at = output.components[0];
        let (scalar, moments) = (&outputs.scalars[at], &sums[at].moments);
        let values = ascending(&kept.values[at]);
        let mut first = Moments::new(nominal.map_or(0.0, |nominal| nominal.value(scalar)));
        kept.linear[at].iter().for_each(|value| first.add(*value));
        let linear_values = ascending(&kept.linear[at]);
        let is_known = linear.is_some() && first.count > 1.0;
        let first_order = if is_known { first.standard_deviation() } else { f64::NAN };
        let ratio = moments.standard_deviation() / first_order;
        Spread {
            output: output.name.clone(),
            unit: output.unit.clone(),
            rows: moments.count as u64,
            mean: moments.mean(),
            deviation: moments.standard_deviation(),
            skew: moments.skew(),
            least: moments.least,
            largest: moments.largest,
            quantiles: QUANTILES.map(|share| quantile(&values, share)),
            nominal: nominal.map_or(f64::NAN, |nominal| nominal.value(scalar)),
            first_order,
            first_order_quantiles: QUANTILES.map(|share| quantile(&linear_values, share)),
            ratio,
            mean_shift: if is_known { moments.mean() - first.mean() } else { f64::NAN },
            percentiles: match is_known {
                true => {
                    (1..100).map(|k| [&linear_values, &values].map(|of| quantile(of, f64::from(k) / 100.0))).collect()
                }
                false => Vec::new(),
            },
            lumps: lumps(&values),
            flag: flag(ratio, jumps(output)),
        }
    };
    told.map(spread).collect()
}

fn flag(ratio: f64, jumps: Option<String>) -> String {
    match jumps {
        Some(why) => format!("first order fails: {why}"),
        None if ratio.is_finite() && (ratio - 1.0).abs() > HOLDS => {
            format!("first order fails: the rows spread {ratio:.2} times as much")
        }
        None => String::new(),
    }
}
