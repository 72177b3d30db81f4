//! `rodsweep solve --explain`: the plan that a scene compiles to, and what it costs.

use super::CommandError;
use super::solve::Solved;
use rodsweep::backend::Precision;
use rodsweep::lanes::{Lanes, Operations};
use rodsweep::model::path::PATH_STEPPER;
use rodsweep::model::{Plan, SegmentPlan, Terms};
use rodsweep::report::{Table, engineering};
use serde_json::{Value, json};

/// What a plan may model beyond bending and twisting: name, and whether it does.
fn terms(terms: &Terms) -> [(&'static str, bool); 9] {
    [
        ("coils", terms.dipole),
        ("permanent magnets", terms.magnet),
        ("internal force", terms.force),
        ("weight or force per length", terms.load),
        ("tip moment", terms.tip_moment),
        ("different bending about x and y", terms.anisotropic),
        ("stiffness along a segment", terms.taper),
        ("rest curvature along a segment", terms.curvature_rise),
        ("shear and stretch", terms.shear),
    ]
}

/// One kind of pass over the rod.
struct Pass {
    name: &'static str,
    stepper: &'static str,
    steps: usize,
    columns: usize,
    operations: Operations,
}

fn passes(solved: &Solved) -> Result<Vec<Pass>, CommandError> {
    let plan = &solved.plan;
    let counted = Lanes::new(plan, Precision::F64)?.count_operations(&solved.batch, 0);
    let stepper = plan.options.stepper;
    let integrated = plan.free.map_or(plan.segments.len(), |free| free.segment);
    let steps = |of: &dyn Fn(usize) -> usize| plan.segments[..integrated].iter().map(|s| of(s.steps)).sum::<usize>();
    let fine = steps(&|n| n);
    let pass = |name, stepper, steps, columns, operations| Pass { name, stepper, steps, columns, operations };
    Ok(vec![
        pass("on the path", PATH_STEPPER.name(), steps(&|n| stepper.path_steps(n)), 3, counted.path),
        pass("chord step", stepper.name(), fine, 0, counted.chord),
        pass("answer and Jacobian", stepper.name(), fine, column_count(plan), counted.answer),
        pass("error estimate", stepper.name(), 2 * fine, 0, counted.check),
    ])
}

/// Columns of the last pass: by base moment, and what derivatives need.
fn column_count(plan: &Plan) -> usize {
    match plan.derivatives.len() {
        0 => 3,
        count if plan.forward => 3 + count,
        _ => 3 + shared_columns(plan),
    }
}

/// Columns that all derivatives share by reciprocity: by tip force, and by base rotation for those of the base moment.
fn shared_columns(plan: &Plan) -> usize {
    if plan.options.base_moment_rows { 6 } else { 3 }
}

fn derivatives(plan: &Plan) -> String {
    let count = plan.derivatives.len();
    match count {
        0 => "none".into(),
        _ if plan.forward => format!("{count} by forward columns, one each"),
        _ => format!("{count} by reciprocity, from {} columns more, whatever their number", shared_columns(plan)),
    }
}

fn free_segments(solved: &Solved) -> Vec<&str> {
    let first = solved.plan.free.map_or(usize::MAX, |free| free.segment);
    let is_free = |index: &usize| solved.scene.piece_indices(*index).start >= first;
    (0..solved.scene.segments.len()).filter(is_free).map(|index| solved.scene.segments[index].name.as_str()).collect()
}

/// What is particular about a segment.
fn traits(segment: &SegmentPlan) -> String {
    let traits = [
        ("dipole", segment.has_dipole),
        ("magnet", segment.has_magnet),
        ("shears", segment.shears),
        ("stiffness varies", segment.tapers),
        ("rest curvature varies", segment.curvature_rises),
    ];
    traits.iter().filter(|(_, holds)| *holds).map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

/// The plan for a person.
pub fn text(solved: &Solved) -> Result<String, CommandError> {
    let plan = &solved.plan;
    let named = |holds: bool| -> String {
        let names: Vec<&str> = terms(&plan.terms).iter().filter(|(_, t)| *t == holds).map(|(name, _)| *name).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    };
    let units = &plan.units;
    let mut text = String::from("plan\n");
    let mut line = |name: &str, value: String| text += &format!("  {name:<16}{value}\n");
    line("solved by", solved.engine.clone());
    line("terms", named(true));
    line("left out", named(false));
    line("derivatives", derivatives(plan));
    line(
        "units",
        format!(
            "length {} m, force {} N, moment {} N·m, field {} T",
            engineering(units.length),
            engineering(units.force),
            engineering(units.moment()),
            engineering(units.field)
        ),
    );
    let free = free_segments(solved);
    if !free.is_empty() {
        line("at rest", format!("{}: nothing loads it; its shape is closed form", free.join(", ")));
    }
    let mut segments = Table::new(["segment", "piece", "kind", "steps", "with"]);
    for (index, segment) in solved.scene.segments.iter().enumerate() {
        for (piece, at) in solved.scene.piece_indices(index).enumerate() {
            let of = &plan.segments[at];
            let kind = if of.is_flexible { "flexible" } else { "rigid" };
            let at_rest = plan.free.is_some_and(|free| at >= free.segment);
            let steps = if at_rest || !of.is_flexible { "-".into() } else { of.steps.to_string() };
            segments.row([segment.name.clone(), (piece + 1).to_string(), kind.into(), steps, traits(of)]);
        }
    }
    let mut table = Table::new(["pass", "stepper", "steps", "columns", "+", "x", "fused", "/", "operations"]);
    for Pass { name, stepper, steps, columns, operations } in passes(solved)? {
        let Operations { additions, multiplications, fused, divisions } = operations;
        let numbers = [additions, multiplications, fused, divisions, operations.total()];
        let mut cells = vec![name.to_owned(), stepper.into(), steps.to_string(), columns.to_string()];
        cells.extend(numbers.iter().map(u64::to_string));
        table.row(cells);
    }
    Ok(format!("{text}{segments}operations of a pass over the rod (counted; a fused multiply and add is two)\n{table}"))
}

/// The plan for a program.
pub fn json(solved: &Solved) -> Result<Value, CommandError> {
    let plan = &solved.plan;
    let terms: serde_json::Map<String, Value> =
        terms(&plan.terms).into_iter().map(|(name, holds)| (name.replace(' ', "_"), json!(holds))).collect();
    let passes: Vec<Value> = passes(solved)?
        .into_iter()
        .map(|pass| {
            json!({
                "pass": pass.name,
                "stepper": pass.stepper,
                "steps": pass.steps,
                "columns": pass.columns,
                "additions": pass.operations.additions,
                "multiplications": pass.operations.multiplications,
                "fused": pass.operations.fused,
                "divisions": pass.operations.divisions,
                "operations": pass.operations.total(),
            })
        })
        .collect();
    Ok(json!({
        "engine": solved.engine,
        "terms": terms,
        "derivatives": plan.derivatives.len(),
        "sensitivity": if plan.forward { "forward" } else { "reciprocity" },
        "at_rest": free_segments(solved),
        "steps": plan.segments.iter().map(|segment| segment.steps).collect::<Vec<_>>(),
        "passes": passes,
    }))
}
