//! The study: one pass over the rows, then everything that follows from its sums and from the rows that were kept.

use super::SensitivityError;
use super::chaos::Chaos;
use super::checks::{check_constant, check_design, check_numbers, check_rows, check_source, varies};
use super::design::{Design, Layout};
use super::failures::wilson;
use super::identify::identify;
use super::indices::Evidence;
use super::inputs::{Input, chosen, inputs, uncertain};
use super::kept::Kept;
use super::local::local;
use super::moments::{ascending, quantile};
use super::nominal::Nominal;
use super::notes::notes;
use super::options::Options;
use super::outputs::{Kind, MARGIN, Output, Outputs, Scalar};
use super::pass::Pass;
use super::result::{Polynomial, Sensitivity, StatusShare};
use super::rows::{Reading, Rows, Source};
use super::shapes::{Shapes, points_asked};
use super::spread::{Linearised, spreads};
use super::worst_case::worst_cases;
use crate::model::Status;
use crate::study::pose_length::pose_length;

/// Finds everything.
pub(super) fn analyse(source: &Source, options: &Options) -> Result<Sensitivity, SensitivityError> {
    let Options { confidence, minimum_margin, .. } = *options;
    check_numbers(options)?;
    check_source(source)?;
    let spec = source.spec();
    let layout = Layout::new(spec, options.limit);
    let (inputs, uncertain) = (inputs(spec)?, uncertain(spec));
    let chosen = match options.identifies() {
        true => (0..inputs.len()).collect(),
        false => chosen(&inputs, &options.inputs)?,
    };
    let nominal = Nominal::solve(spec, &inputs, &uncertain, points_asked(&options.outputs)?)?;
    let table = Rows::new(source, Shapes::new(spec, &options.outputs, source.columns())?);
    let outputs = Outputs::new(
        &options.outputs,
        table.columns(),
        &inputs,
        minimum_margin,
        pose_length(&spec.scene, spec.workspace.length),
    )?;
    if options.propagate && nominal.is_none() {
        return Err(SensitivityError::NoNominal);
    }
    check_design(spec, options, &layout, &outputs, &inputs)?;
    let reading = Reading {
        inputs: &inputs,
        scalars: &outputs.scalars,
        uncertain: &uncertain,
        nominal: nominal.as_ref().map(Nominal::tip),
        with_unstable: options.with_unstable,
    };
    let linear = nominal.as_ref().map(|nominal| Linearised::new(nominal, &outputs, &inputs));
    let mut pass = Pass::new(&layout, &inputs, &outputs.scalars);
    let mut kept = Kept::new(&layout, &inputs, &uncertain, &outputs.scalars);
    let names = columns(&table, &outputs, &inputs, &uncertain);
    table.each(&names, |part| {
        let block = reading.read(part);
        let value = linear.as_ref().map(|linear| |scalar: usize, x: &[f64]| linear.value(scalar, x));
        kept.add(&layout, &inputs, &block, value.as_ref().map(|value| value as _));
        pass.add(&block);
    })?;
    pass.finish();
    let (rows, usable) = check_rows(options, &pass, inputs.len())?;
    check_constant(options, &outputs, &pass, nominal.is_some())?;
    let chaos = polynomials(options.degree, &layout, &inputs, &outputs, &kept);
    let evidence = Evidence {
        layout: &layout,
        inputs: &inputs,
        chosen: &chosen,
        outputs: &outputs,
        sums: &pass.sums,
        chaos: &chaos,
        estimator: options.estimator,
        confidence,
        rows,
        missing: 1.0 - usable as f64 / rows as f64,
    };
    let asked: Vec<&Output> = outputs.outputs.iter().filter(|output| varies(output, &pass)).collect();
    let (indicators, asked): (Vec<&Output>, Vec<&Output>) = asked.into_iter().partition(|output| output.is_indicator);
    let indices = |outputs: &[&Output]| outputs.iter().flat_map(|output| evidence.indices(output)).collect();
    let jumps = |output: &Output| evidence.jumps(output);
    let spreads = spreads(&outputs, &pass.sums, &kept, nominal.as_ref(), linear.as_ref(), &jumps);
    let worst_cases = match layout.design {
        Design::PickFreeze(_) if usable < rows => worst_cases(&table, &names, &reading, &evidence, &asked)?,
        _ => Vec::new(),
    };
    let identification = if options.identifies() { Some(identify(source, &layout, options)?) } else { None };
    Ok(Sensitivity {
        method: spec.method.name(),
        rows,
        usable,
        confidence,
        inputs: inputs.iter().map(|input| (input.name.clone(), input.unit, input.law.words())).collect(),
        uncertain: uncertain.iter().map(|input| (input.name.clone(), input.unit, input.law.words())).collect(),
        indices: indices(&asked),
        slopes: asked.iter().flat_map(|output| evidence.slopes(output)).collect(),
        local: local(&outputs, &inputs, &chosen, &uncertain, &kept, nominal.as_ref()),
        spreads,
        statuses: statuses(&pass, confidence),
        failure_indices: indices(&indicators),
        worst_cases,
        polynomials: polynomial_tables(&outputs, &chaos),
        convergence: asked.iter().flat_map(|output| evidence.convergence(output)).collect(),
        margins: margins(&outputs, &pass, &kept, nominal.as_ref()),
        identification,
        notes: notes(&evidence, &asked, nominal.is_some()),
        mark: source.mark(options)?,
        checked: source.checked(options)?,
    })
}

/// Columns that are read.
fn columns(table: &Rows, outputs: &Outputs, inputs: &[Input], uncertain: &[Input]) -> Vec<String> {
    let mut names = outputs.columns();
    names.extend(inputs.iter().map(|input| input.parameters[0].clone()));
    names.extend(outputs.slope_columns(inputs));
    let is_there = |name: &String| table.columns().iter().any(|column| column.name == *name);
    names.extend(outputs.slope_columns(uncertain).into_iter().filter(is_there));
    names.sort();
    names.dedup();
    names
}

/// A polynomial of each scalar; none on a grid, of indicators, or with too few rows.
fn polynomials(degree: usize, layout: &Layout, inputs: &[Input], outputs: &Outputs, kept: &Kept) -> Vec<Option<Chaos>> {
    let mut found: Vec<Option<Chaos>> = vec![None; outputs.scalars.len()];
    if matches!(layout.design, Design::Grid(_)) {
        return found;
    }
    let families = Kept::families(inputs);
    for has_slopes in [true, false] {
        let alike = |scalar: &usize| {
            let scalar = &outputs.scalars[*scalar];
            let is_indicator = matches!(scalar.kind, Kind::Failed | Kind::MarginBelow(_));
            scalar.has_slopes == has_slopes && !is_indicator
        };
        let scalars: Vec<usize> = (0..outputs.scalars.len()).filter(alike).collect();
        if scalars.is_empty() {
            continue;
        }
        let chaos = Chaos::choose(&families, &kept.chaos_rows(inputs, &scalars), degree);
        scalars.into_iter().zip(chaos).for_each(|(scalar, chaos)| found[scalar] = chaos);
    }
    found
}

fn statuses(pass: &Pass, confidence: f64) -> Vec<StatusShare> {
    let rows: u64 = pass.counts.iter().sum();
    let some = Status::ALL.into_iter().filter(|status| pass.counts[status.code() as usize] > 0);
    let share = |status: Status| {
        let count = pass.counts[status.code() as usize];
        let interval = wilson(count, rows, confidence);
        StatusShare { status, rows: count, share: count as f64 / rows as f64, interval }
    };
    some.map(share).collect()
}

/// Nominal margin, 1 % quantile, least.
fn margins(outputs: &Outputs, pass: &Pass, kept: &Kept, nominal: Option<&Nominal>) -> [f64; 3] {
    let nominal = nominal.map_or(f64::NAN, Nominal::margin);
    match outputs.scalars.iter().position(|scalar| scalar.name == MARGIN) {
        Some(at) => [nominal, quantile(&ascending(&kept.values[at]), 0.01), pass.sums[at].moments.least],
        None => [nominal, f64::NAN, f64::NAN],
    }
}

fn polynomial_tables(outputs: &Outputs, chaos: &[Option<Chaos>]) -> Vec<Polynomial> {
    let table = |(scalar, chaos): (&Scalar, &Option<Chaos>)| {
        let chaos = chaos.clone()?;
        Some(Polynomial {
            output: scalar.name.clone(),
            exponents: chaos.basis.exponents().to_vec(),
            coefficients: chaos.coefficients,
            predicted: chaos.predicted,
            degree: chaos.degree,
            rows: chaos.rows,
        })
    };
    outputs.scalars.iter().zip(chaos).filter_map(table).collect()
}
