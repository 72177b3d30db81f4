//! What a study of sensitivity gives.

use super::blocks::Estimate;
use super::experiments::Observability;
use super::moments::Lumps;
use crate::model::Status;
use crate::study::Direction;
use crate::table::Table;

/// Which index of variance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Order {
    /// What an input does alone.
    First,
    /// What it does alone and together with others.
    Total,
    /// What two inputs do together beyond what each does alone.
    Second,
}

/// One index of one output.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Index {
    /// The output.
    pub output: String,
    /// The input, or two joined by `*`.
    pub input: String,
    /// Which index.
    pub order: Order,
    /// By which estimator.
    pub estimator: &'static str,
    /// Whether this estimator is the one to read first.
    pub is_main: bool,
    /// NaN where the value is withheld.
    pub estimate: Estimate,
    /// Complete pairs, of a pick-freeze design; else rows that count.
    pub pairs: u64,
    /// Rows of the sweep that were read.
    pub rows: u64,
    /// Why the value is withheld or to be read with care; else empty.
    pub flag: String,
}

/// What slopes say of one output and one input.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Slopes {
    /// The output.
    pub output: String,
    /// The input.
    pub input: String,
    /// Mean square of the slope, SI.
    pub mean_square: f64,
    /// Poincaré's constant of the input's law, SI.
    pub constant: f64,
    /// The bound of the total index; NaN where it is withheld.
    pub upper: f64,
    /// Mean of the slope, SI.
    pub mean: f64,
    /// Standard deviation of the slope, SI.
    pub deviation: f64,
    /// Share of the variance that slopes do not see.
    pub jump_share: f64,
    /// Why the bound is withheld; else empty.
    pub flag: String,
}

/// Slopes at the nominal sample and over the sweep.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Local {
    /// The output.
    pub output: String,
    /// The input.
    pub input: String,
    /// At the nominal sample, SI; NaN where it is not known.
    pub slope: f64,
    /// Change of the output by the input's whole value, at the nominal sample.
    pub per_value: f64,
    /// Change of the output by one standard deviation of the input, at the nominal sample.
    pub per_deviation: f64,
    /// 5, 50 and 95 % quantiles of the change by one standard deviation, over the sweep.
    pub quantiles: [f64; 3],
}

/// How an output spreads.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Spread {
    /// The output.
    pub output: String,
    /// SI; empty for none.
    pub unit: String,
    /// Rows that count.
    pub rows: u64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Third moment over the cube of the standard deviation.
    pub skew: f64,
    /// Smallest value.
    pub least: f64,
    /// Largest value.
    pub largest: f64,
    /// At [`QUANTILES`].
    pub quantiles: [f64; QUANTILES.len()],
    /// At the nominal sample; NaN where it is not known.
    pub nominal: f64,
    /// Standard deviation by the slopes at the nominal sample; NaN where it is not known.
    pub first_order: f64,
    /// [`QUANTILES`] by the slopes at the nominal sample.
    pub first_order_quantiles: [f64; QUANTILES.len()],
    /// Standard deviation over that of the first order.
    pub ratio: f64,
    /// Mean less the nominal value: what the first order does not see.
    pub mean_shift: f64,
    /// Percentiles 1 to 99: by the first order, of the rows; empty where the first order is not known.
    pub percentiles: Vec<[f64; 2]>,
    /// Two groups of values with few between.
    pub lumps: Option<Lumps>,
    /// Why the first order is not to be trusted; else empty.
    pub flag: String,
}

/// Quantiles that are told.
pub const QUANTILES: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];

/// Rows of a status.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct StatusShare {
    /// The status.
    pub status: Status,
    /// Rows.
    pub rows: u64,
    /// Of all rows.
    pub share: f64,
    /// Wilson's interval of the share.
    pub interval: [f64; 2],
}

/// Total indices with every missing value at the least and at the largest value seen.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct WorstCase {
    /// The output.
    pub output: String,
    /// By input: from complete pairs, at the least, at the largest.
    pub totals: Vec<[f64; 3]>,
    /// Whether the inputs' order by total index changes.
    pub changes_order: bool,
}

/// A polynomial that stands for an output.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Polynomial {
    /// The output.
    pub output: String,
    /// Degree by input, for each term.
    pub exponents: Vec<Vec<u8>>,
    /// Of each term.
    pub coefficients: Vec<f64>,
    /// Share of the held-out variance that is predicted (Q²).
    pub predicted: f64,
    /// Total degree.
    pub degree: usize,
    /// Rows that were fitted to.
    pub rows: usize,
}

/// An index as more and more of the rows count.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Convergence {
    /// The output.
    pub output: String,
    /// The input.
    pub input: String,
    /// Which index.
    pub order: Order,
    /// Rows and value, ascending.
    pub steps: Vec<(u64, f64)>,
}

/// What measurements of the tip tell of the parameters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Identification {
    /// Names of the parameters, joined by `+` where they keep their ratio.
    pub parameters: Vec<String>,
    /// Whether a parameter counts by its logarithm; curvatures count by the rod's length.
    pub logarithmic: Vec<bool>,
    /// Standard deviation of a measured coordinate (m).
    pub noise: f64,
    /// Standard deviation of a measured tangent (rad), where tangents are measured.
    pub tangent_noise: Option<f64>,
    /// Candidates, and the least margin that they were asked to have.
    pub candidates: u64,
    /// Least stability margin of a candidate.
    pub minimum_margin: f64,
    /// What all candidates together tell.
    pub all: Information,
    /// What the chosen ones tell; `None` where none were asked for.
    pub chosen: Option<Chosen>,
}

/// Fisher information of some measurements, in scaled parameters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Information {
    /// Σ JᵀJ over the noise squared.
    pub fisher: Vec<Vec<f64>>,
    /// Ascending.
    pub eigenvalues: Vec<f64>,
    /// Standard deviations of the scaled parameters; infinite where they are not determined.
    pub deviations: Vec<f64>,
    /// Of the scaled parameters.
    pub correlations: Vec<Vec<f64>>,
    /// Strongest first, in the words of a fit.
    pub directions: Vec<Direction>,
    /// What weak directions mean.
    pub findings: Vec<String>,
    /// Of the singular values.
    pub observability: Observability,
    /// Logarithm of the determinant.
    pub log_determinant: f64,
}

/// Chosen measurements.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Chosen {
    /// Their samples.
    pub samples: Vec<u64>,
    /// Their stability margins; NaN where they are not known.
    pub margins: Vec<f64>,
    /// Inputs of each by the names of parameters: a table to run or to command.
    pub table: Table,
    /// What they tell.
    pub information: Information,
    /// The least log-determinant over the ends of what is uncertain, and at which end; `None` where nothing is.
    pub worst: Option<(f64, String)>,
}

/// Indices, bounds, spreads, failures, and what measurements would tell.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Sensitivity {
    /// How the samples were chosen.
    pub method: &'static str,
    /// Rows that were read.
    pub rows: u64,
    /// Rows whose numbers count.
    pub usable: u64,
    /// Of the intervals.
    pub confidence: f64,
    /// Name, unit and law of each input.
    pub inputs: Vec<(String, &'static str, String)>,
    /// The same of the numbers that the rows hold at the scene's values.
    pub uncertain: Vec<(String, &'static str, String)>,
    /// Indices of every output.
    pub indices: Vec<Index>,
    /// Bounds by slopes.
    pub slopes: Vec<Slopes>,
    /// Slopes in numbers that can be compared.
    pub local: Vec<Local>,
    /// Spreads of the outputs.
    pub spreads: Vec<Spread>,
    /// Rows by status.
    pub statuses: Vec<StatusShare>,
    /// Indices of what makes rows fail or come near it.
    pub failure_indices: Vec<Index>,
    /// Rankings with missing values at their worst.
    pub worst_cases: Vec<WorstCase>,
    /// Polynomials of the outputs.
    pub polynomials: Vec<Polynomial>,
    /// How indices settle.
    pub convergence: Vec<Convergence>,
    /// Stability margins: nominal, 1 % quantile, least; NaN where they are not known.
    pub margins: [f64; 3],
    /// What measurements tell; `None` unless asked for.
    pub identification: Option<Identification>,
    /// What the reader should know.
    pub notes: Vec<String>,
    /// What speaks against the rows; `None`: nothing that is known.
    pub mark: Option<String>,
    /// Whether and how many rows were checked against the reference, in a sentence.
    pub checked: String,
}

impl Order {
    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Order::First => "S1",
            Order::Total => "ST",
            Order::Second => "S2",
        }
    }
}
