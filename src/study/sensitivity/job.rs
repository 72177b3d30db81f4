//! The study in one call: what is asked for, and of which rows.

use super::SensitivityError;
use super::analysis::analyse;
use super::candidates::unknowns;
use super::checks::{check_design, check_numbers};
use super::design::Layout;
use super::inputs::{chosen, inputs};
use super::options::{EstimatorChoice, Options};
use super::outputs::Outputs;
use super::prepare::prepared;
use super::result::Sensitivity;
use super::rows::Source;
use super::shapes::Shapes;
use crate::backend::Precision;
use crate::results::{Layout as Columns, Results};
use crate::spec::SweepSpec;
use crate::study::pose_length::pose_length;
use crate::table::Table;

/// Indices, bounds, spreads and failures of a sweep's outputs, and what measurements would tell.
///
/// ```no_run
/// use rodsweep::results::Results;
/// use rodsweep::study::sensitivity::SensitivityJob;
///
/// let results = Results::open("results/stiffness")?;
/// let found = SensitivityJob::of_results(results).outputs(&["tip.position"]).run()?;
/// for index in found.indices.iter().filter(|index| index.is_main) {
///     println!("{} of {} by {}: {}", index.order.name(), index.output, index.input, index.estimate.value);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SensitivityJob {
    source: Source,
    options: Options,
}

impl SensitivityJob {
    /// Of a result directory, read part by part.
    pub fn of_results(results: Results) -> SensitivityJob {
        SensitivityJob { source: Source::Directory(Box::new(results)), options: Options::default() }
    }

    /// Of a sweep's rows in memory, every column.
    pub fn of_rows(spec: SweepSpec, rows: Table) -> SensitivityJob {
        SensitivityJob { source: Source::Memory(Box::new(spec), rows), options: Options::default() }
    }

    /// Of a sweep that has yet to be run: [`SensitivityJob::sweep`] is what to run, with the derivatives that are needed.
    /// Give the rows with [`SensitivityJob::with_results`] or [`SensitivityJob::with_rows`].
    pub fn of_sweep(spec: SweepSpec) -> SensitivityJob {
        SensitivityJob::of_rows(prepared(spec, &Options::default()), Table::default())
    }

    /// The sweep to run, once all options are set.
    pub fn sweep(&self) -> SweepSpec {
        prepared(self.spec().clone(), &self.options)
    }

    /// The same study of what a run has written.
    pub fn with_results(self, results: Results) -> SensitivityJob {
        SensitivityJob { source: Source::Directory(Box::new(results)), ..self }
    }

    /// The same study of rows in memory.
    pub fn with_rows(self, rows: Table) -> SensitivityJob {
        let spec = self.sweep();
        SensitivityJob { source: Source::Memory(Box::new(spec), rows), ..self }
    }

    /// Columns, vectors of three columns such as `tip.position`, `tip.distance`, `tip.pose`, `shape` or `shape:20` (points
    /// along the rod, ten unless given). Unless named: tip, its distance from the nominal tip, stability margin.
    pub fn outputs(mut self, names: &[impl AsRef<str>]) -> SensitivityJob {
        self.options.outputs = names.iter().map(|name| name.as_ref().trim().to_owned()).collect();
        self
    }

    /// Inputs that are told of, all unless named. With a choice of measurements: what is to be found by them.
    pub fn inputs(mut self, names: &[impl AsRef<str>]) -> SensitivityJob {
        self.options.inputs = names.iter().map(|name| name.as_ref().trim().to_owned()).collect();
        self
    }

    /// The estimator that is to be read first.
    pub fn estimator(mut self, estimator: EstimatorChoice) -> SensitivityJob {
        self.options.estimator = estimator;
        self
    }

    /// Of the intervals, 0.95 unless given.
    pub fn confidence(mut self, confidence: f64) -> SensitivityJob {
        self.options.confidence = confidence;
        self
    }

    /// Largest total degree of polynomials, 1 to 4.
    pub fn degree(mut self, degree: usize) -> SensitivityJob {
        self.options.degree = degree;
        self
    }

    /// Whether unstable equilibria count; they do not unless asked for.
    pub fn with_unstable(mut self, with_unstable: bool) -> SensitivityJob {
        self.options.with_unstable = with_unstable;
        self
    }

    /// Insists on the first order beside the spread of the rows: it is an error where the nominal sample has no
    /// equilibrium or its slopes are not known.
    pub fn propagate(mut self, propagate: bool) -> SensitivityJob {
        self.options.propagate = propagate;
        self
    }

    /// How many measurements are to be chosen of the rows.
    pub fn choose(mut self, count: Option<usize>) -> SensitivityJob {
        self.options.choose = count;
        self
    }

    /// Standard deviation of a measured coordinate (m); with it, what all rows would tell is told.
    pub fn noise(mut self, noise: Option<f64>) -> SensitivityJob {
        self.options.noise = noise;
        self
    }

    /// Standard deviation of a measured tangent (rad): the tip's tangent is measured, too, each time.
    pub fn tangent_noise(mut self, noise: Option<f64>) -> SensitivityJob {
        self.options.tangent_noise = noise;
        self
    }

    /// Least stability margin of a chosen measurement, and the limit of the indicator of low margins; 0.3 unless given.
    pub fn minimum_margin(mut self, margin: f64) -> SensitivityJob {
        self.options.minimum_margin = margin;
        self
    }

    /// Says that only the first samples of the sweep are there, so that blocks are shares of these.
    pub fn limit(mut self, limit: Option<u64>) -> SensitivityJob {
        self.options.limit = limit;
        self
    }

    /// What speaks against rows that are given in memory; a directory says it itself.
    pub fn mark(mut self, mark: Option<String>) -> SensitivityJob {
        self.options.mark = mark;
        self
    }

    /// How many rows that are given in memory were checked, in a sentence; a directory says it itself.
    pub fn checked(mut self, sentence: Option<String>) -> SensitivityJob {
        self.options.checked = sentence;
        self
    }

    /// The sweep as it was run.
    pub fn spec(&self) -> &SweepSpec {
        self.source.spec()
    }

    /// Refuses options that make no sense and names that the sweep has not, before anything is run.
    ///
    /// # Errors
    ///
    /// As [`SensitivityJob::run`].
    pub fn check(&self) -> Result<(), SensitivityError> {
        check_numbers(&self.options)?;
        let spec = self.sweep();
        let layout = Layout::new(&spec, self.options.limit);
        let inputs = inputs(&spec)?;
        let columns = Columns::new(&spec, Precision::F64);
        let mut columns = columns.empty().columns.clone();
        let shapes = Shapes::new(&spec, &self.options.outputs, &columns)?;
        columns.extend(shapes.as_ref().map(Shapes::columns).unwrap_or_default());
        if self.options.identifies() {
            unknowns(&spec, &columns, &self.options.inputs)?;
        } else {
            chosen(&inputs, &self.options.inputs)?;
        }
        let length = pose_length(&spec.scene, spec.workspace.length);
        let outputs = Outputs::new(&self.options.outputs, &columns, &inputs, self.options.minimum_margin, length)?;
        check_design(&spec, &self.options, &layout, &outputs, &inputs)
    }

    /// Finds everything.
    ///
    /// # Errors
    ///
    /// Options that make no sense, names that the sweep has not, too few rows, rows that cannot be read.
    pub fn run(&self) -> Result<Sensitivity, SensitivityError> {
        analyse(&self.source, &self.options)
    }
}
