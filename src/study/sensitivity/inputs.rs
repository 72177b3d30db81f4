//! The inputs of a study: axes of the sweep with their laws.

use super::SensitivityError;
use super::bounds::{poincare_constant, poincare_log_uniform, poincare_normal, poincare_uniform};
use super::polynomials::Family;
use crate::model::closest;
use crate::spec::{AxisSpec, Distribution, Method, SweepSpec};
use crate::table::Table;
use std::sync::Arc;

/// Correlations of a table's columns up to this, and what chance makes of so few rows, count as none.
const NO_CORRELATION: f64 = 0.05;

/// Spread over the mean, below which the double nearest to a value, and the error of its equilibrium, count.
const NARROW: f64 = 1e-9;

/// What varies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Input {
    /// Names of what it drives, joined by `+`.
    pub name: String,
    /// SI; empty for none.
    pub unit: &'static str,
    /// Of the parameters that it drives.
    pub parameters: Vec<String>,
    /// Change of each parameter by the input.
    pub rates: Vec<f64>,
    pub law: Law,
}

/// By which law an input varies.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Law {
    Known(Distribution),
    /// Of a table: the shares of its column's values below each row's.
    Ranks(Arc<Vec<f64>>),
}

impl Law {
    /// Share of the law below a value; of a table, of its row.
    pub fn share(&self, value: f64, sample: u64) -> f64 {
        match self {
            Law::Known(law) => law.unit(value),
            Law::Ranks(shares) => shares.get(sample as usize).copied().unwrap_or(f64::NAN),
        }
    }

    /// Change of the value by the share; NaN where the law is not known or has no slope.
    pub fn rate(&self, share: f64) -> f64 {
        match self {
            Law::Known(law) => law.rate(share),
            Law::Ranks(_) => f64::NAN,
        }
    }

    /// Whether its value changes steadily with the share, so that slopes say something.
    pub fn is_steady(&self) -> bool {
        !matches!(self, Law::Ranks(_) | Law::Known(Distribution::Values(_)))
    }

    pub fn family(&self) -> Family {
        match self {
            Law::Known(Distribution::Normal { .. } | Distribution::LogNormal { .. }) => Family::Hermite,
            _ => Family::Legendre,
        }
    }

    /// The variable of the law's polynomials at a value.
    pub fn standard(&self, value: f64, sample: u64) -> f64 {
        match self {
            Law::Known(law @ Distribution::Normal { .. }) => (value - law.mean()) / law.standard_deviation(),
            Law::Known(law @ Distribution::LogNormal { .. }) => {
                law.of_logarithm().map_or(f64::NAN, |(mean, deviation)| (value.abs().ln() - mean) / deviation)
            }
            _ => 2.0 * self.share(value, sample) - 1.0,
        }
    }

    /// Change of the value by that variable, where it is `standard`; NaN where the law is not steady.
    pub fn standard_rate(&self, standard: f64) -> f64 {
        match self {
            Law::Known(Distribution::Normal { standard_deviation, .. }) => *standard_deviation,
            Law::Known(Distribution::Uniform { from, to }) => 0.5 * (to - from),
            Law::Known(law) => match law.of_logarithm() {
                Some((mean, deviation)) => law.mean().signum() * deviation * (mean + deviation * standard).exp(),
                None => 0.5 * law.rate(0.5 * (1.0 + standard)),
            },
            Law::Ranks(_) => f64::NAN,
        }
    }

    /// Poincaré's constant; NaN where the law is not steady, or has none: the tail of a lognormal law is too heavy.
    pub fn poincare(&self) -> f64 {
        match self {
            Law::Known(Distribution::Uniform { from, to }) => poincare_uniform(*from, *to),
            Law::Known(Distribution::LogUniform { from, to }) => poincare_log_uniform(*from, *to),
            Law::Known(Distribution::Normal { standard_deviation, .. }) => poincare_normal(*standard_deviation),
            Law::Known(
                law @ (Distribution::Triangular { from, to, .. } | Distribution::TruncatedNormal { from, to, .. }),
            ) => poincare_constant(*from, *to, |value| law.density(value)),
            Law::Known(Distribution::LogNormal { .. } | Distribution::Values(_)) | Law::Ranks(_) => f64::NAN,
        }
    }

    pub fn mean(&self) -> f64 {
        match self {
            Law::Known(law) => law.mean(),
            Law::Ranks(_) => f64::NAN,
        }
    }

    pub fn standard_deviation(&self) -> f64 {
        match self {
            Law::Known(law) => law.standard_deviation(),
            Law::Ranks(_) => f64::NAN,
        }
    }

    /// In words: `uniform from .. to ..`.
    pub fn words(&self) -> String {
        match self {
            Law::Known(law) => law.words(),
            Law::Ranks(_) => "as the table has it".into(),
        }
    }
}

impl Input {
    fn new(axis: &AxisSpec, spec: &SweepSpec, law: Law) -> Input {
        Input {
            name: axis.name(&spec.scene),
            unit: axis.unit(),
            parameters: axis.parameters.iter().map(|parameter| parameter.name(&spec.scene)).collect(),
            rates: axis.rates(&spec.scene),
            law,
        }
    }

    /// Its values in rows, by the column of its first parameter.
    pub fn values(&self, rows: &Table) -> Vec<f64> {
        let values = rows.numbers(&self.parameters[0]).unwrap_or_default();
        values.into_iter().map(|value| value / self.rates[0]).collect()
    }

    /// The sum of the slopes of a column by its parameters, as the input drives them.
    pub fn slopes(&self, rows: &Table, column: &str) -> Option<Vec<f64>> {
        let mut sum = vec![0.0; rows.row_count()];
        for (parameter, rate) in self.parameters.iter().zip(&self.rates) {
            let slopes = rows.column(&slope_name(column, parameter))?;
            sum.iter_mut().enumerate().for_each(|(row, sum)| *sum += rate * slopes.values.number(row));
        }
        Some(sum)
    }
}

/// Name of the column of a derivative.
pub(super) fn slope_name(column: &str, parameter: &str) -> String {
    format!("d({column})/d({parameter})")
}

/// Every axis of a sweep.
pub(super) fn inputs(spec: &SweepSpec) -> Result<Vec<Input>, SensitivityError> {
    let ranks = if spec.method == Method::Table { table_ranks(spec)? } else { Vec::new() };
    let law = |k: usize, axis: &AxisSpec| match ranks.get(k) {
        Some(shares) => Law::Ranks(shares.clone()),
        None => Law::Known(axis.distribution.clone()),
    };
    let inputs = spec.axes.iter().enumerate().map(|(k, axis)| Input::new(axis, spec, law(k, axis)));
    let inputs: Vec<Input> = inputs.collect();
    let is_fixed = |axis: &AxisSpec| axis.distribution.standard_deviation() <= 0.0 || axis.points == 1;
    if spec.method == Method::Table {
        return Ok(inputs);
    }
    if let Some(fixed) = spec.axes.iter().position(is_fixed) {
        return Err(SensitivityError::Fixed { input: inputs[fixed].name.clone() });
    }
    let is_narrow = |axis: &AxisSpec| {
        let law = &axis.distribution;
        law.standard_deviation() < NARROW * law.mean().abs()
    };
    match spec.axes.iter().position(is_narrow) {
        Some(narrow) => Err(SensitivityError::Narrow { input: inputs[narrow].name.clone(), least: NARROW }),
        None => Ok(inputs),
    }
}

/// The uncertain numbers of a sweep, which its rows hold at the scene's values.
pub(super) fn uncertain(spec: &SweepSpec) -> Vec<Input> {
    spec.uncertain.iter().map(|axis| Input::new(axis, spec, Law::Known(axis.distribution.clone()))).collect()
}

/// The inputs that are asked for, by places; all, where none is named.
pub(super) fn chosen(inputs: &[Input], names: &[String]) -> Result<Vec<usize>, SensitivityError> {
    if names.is_empty() {
        return Ok((0..inputs.len()).collect());
    }
    let place = |name: &String| {
        let meant = |input: &Input| input.name == *name || input.parameters.contains(name);
        inputs.iter().position(meant).ok_or_else(|| SensitivityError::UnknownInput {
            name: name.clone(),
            suggestion: closest(name, inputs.iter().map(|input| input.name.as_str())),
            known: inputs.iter().map(|input| input.name.clone()).collect(),
        })
    };
    names.iter().map(place).collect()
}

/// Shares by rank of each column of a table; refuses columns that go together.
fn table_ranks(spec: &SweepSpec) -> Result<Vec<Arc<Vec<f64>>>, SensitivityError> {
    let Some(table) = &spec.table else { return Ok(Vec::new()) };
    let count = table.row_count();
    let column = |k: usize| -> Vec<f64> { (0..count).map(|row| table.row(row)[k]).collect() };
    let ranks: Vec<Vec<f64>> = (0..spec.axes.len()).map(|k| shares_by_rank(&column(k))).collect();
    let limit = NO_CORRELATION + 4.0 / (count as f64).sqrt();
    for (k, one) in ranks.iter().enumerate() {
        for (j, other) in ranks[..k].iter().enumerate() {
            let correlation = correlation(one, other);
            if count > 2 && correlation.abs() > limit {
                let name = |k: usize| spec.axes[k].name(&spec.scene);
                return Err(SensitivityError::Correlated { first: name(j), second: name(k), correlation });
            }
        }
    }
    Ok(ranks.into_iter().map(Arc::new).collect())
}

/// Shares of the values below each; equal values share their places.
fn shares_by_rank(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut shares = vec![0.0; values.len()];
    let mut first = 0;
    for group in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let middle = first as f64 + 0.5 * group.len() as f64;
        group.iter().for_each(|row| shares[*row] = middle / values.len() as f64);
        first += group.len();
    }
    shares
}

fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let sum = |of: &dyn Fn(f64, f64) -> f64| x.iter().zip(y).map(|(x, y)| of(x - mx, y - my)).sum::<f64>();
    let scale = (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt();
    if scale > 0.0 { sum(&|x, y| x * y) / scale } else { 0.0 }
}
