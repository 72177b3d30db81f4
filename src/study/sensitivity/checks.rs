//! What is refused: options that make no sense, designs and columns that lack what is asked for, too few rows.

use super::SensitivityError;
use super::chaos::MAX_DEGREE;
use super::design::{Design, Layout};
use super::inputs::Input;
use super::options::{EstimatorChoice, Options};
use super::outputs::{Kind, Output, Outputs};
use super::pass::Pass;
use super::rows::Source;
use crate::model::Status;
use crate::spec::{BranchChoice, Method, SweepSpec};

/// Rows that can be used, at least.
const LEAST_ROWS: u64 = 8;

/// Refuses numbers that make no sense.
pub(super) fn check_numbers(options: &Options) -> Result<(), SensitivityError> {
    let Options { confidence, degree, minimum_margin, .. } = *options;
    let number = |what, value, expected| Err(SensitivityError::Number { what, value, expected });
    if !(confidence > 0.0 && confidence < 1.0) {
        return number("the confidence", confidence, "a number between 0 and 1, such as 0.95");
    }
    if !(1..=MAX_DEGREE).contains(&degree) {
        return number("the degree", degree as f64, "a number from 1 to 4");
    }
    if !(0.0..=1.0).contains(&minimum_margin) {
        return number("the least margin", minimum_margin, "a number from 0 to 1, such as 0.3");
    }
    Ok(())
}

/// Refuses a source without rows, with several rows a sample, or whose samples follow no law.
pub(super) fn check_source(source: &Source) -> Result<(), SensitivityError> {
    if !source.has_rows() {
        return Err(SensitivityError::NoRows);
    }
    match (source.spec().branch, source.spec().method) {
        (BranchChoice::All, _) => Err(SensitivityError::EveryBranch),
        (_, Method::Skeleton) => Err(SensitivityError::Faces),
        _ => Ok(()),
    }
}

/// Whether the design and the columns have what was asked for by name.
pub(super) fn check_design(
    spec: &SweepSpec,
    options: &Options,
    layout: &Layout,
    outputs: &Outputs,
    inputs: &[Input],
) -> Result<(), SensitivityError> {
    let method = spec.method.name();
    let missing = || SensitivityError::NoDerivatives {
        what: "this estimator",
        names: inputs.iter().flat_map(|input| input.parameters.clone()).collect(),
    };
    let has_slopes = outputs.scalars.iter().any(|scalar| scalar.has_slopes);
    match options.estimator {
        EstimatorChoice::PickFreeze(estimator) if !matches!(layout.design, Design::PickFreeze(_)) => {
            Err(SensitivityError::NeedsDesign { estimator: estimator.name(), method })
        }
        EstimatorChoice::Slopes if !has_slopes || matches!(layout.design, Design::Grid(_)) => Err(missing()),
        _ => Ok(()),
    }
}

/// Rows that were read, and that count; refuses too few.
pub(super) fn check_rows(options: &Options, pass: &Pass, inputs: usize) -> Result<(u64, u64), SensitivityError> {
    let counts_as = |status: &Status| status.is_success() || options.with_unstable && *status == Status::Unstable;
    let rows: u64 = pass.counts.iter().sum();
    let of = |status: &Status| pass.counts[status.code() as usize];
    let usable = Status::ALL.iter().filter(|status| counts_as(status)).map(of).sum();
    let needed = LEAST_ROWS.max(inputs as u64 + 2);
    if usable >= needed {
        return Ok((rows, usable));
    }
    let failed = Status::ALL.iter().filter(|status| !counts_as(status) && of(status) > 0);
    let statuses = failed.map(|status| (status.name(), of(status))).collect();
    Err(SensitivityError::TooFewRows { usable, rows, needed, statuses })
}

/// Refuses an output that was asked for by name and never changes, or where none changes.
pub(super) fn check_constant(
    options: &Options,
    outputs: &Outputs,
    pass: &Pass,
    has_nominal: bool,
) -> Result<(), SensitivityError> {
    let told: Vec<&Output> = outputs.outputs.iter().filter(|output| !output.is_indicator).collect();
    let constant = told.iter().find(|output| !varies(output, pass));
    match constant {
        Some(output) if options.outputs.contains(&output.name) || told.iter().all(|o| !varies(o, pass)) => {
            let at = output.components[0];
            if outputs.scalars[at].kind == Kind::Distance && !has_nominal {
                return Err(SensitivityError::NoNominalFor { output: output.name.clone() });
            }
            let value = pass.sums[at].moments.mean();
            Err(SensitivityError::Constant { output: output.name.clone(), value })
        }
        _ => Ok(()),
    }
}

/// Whether any component of an output has two values.
pub(super) fn varies(output: &Output, pass: &Pass) -> bool {
    let of = |scalar: &usize| {
        let moments = &pass.sums[*scalar].moments;
        moments.largest > moments.least
    };
    output.components.iter().any(of)
}
