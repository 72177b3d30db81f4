//! What the reader of a study should know.

use super::design::Design;
use super::indices::Evidence;
use super::inputs::Law;
use super::outputs::{Kind, Output};

/// What a study says of a nominal rod that is not there.
pub(super) const NO_NOMINAL: &str = "the nominal rod, with every input at its mean, has no equilibrium from rest: there are no \
     distances from its tip and no first order; narrow the axes, or centre them elsewhere";

/// In plain words, most important first.
pub(super) fn notes(evidence: &Evidence, asked: &[&Output], has_nominal: bool) -> Vec<String> {
    let mut notes = Vec::new();
    let is_known = |output: &&Output| {
        let first = output.components.first().map(|at| evidence.outputs.scalars[*at].kind);
        has_nominal || first != Some(Kind::Distance)
    };
    let told = evidence.outputs.outputs.iter().filter(|output| !output.is_indicator);
    let constant: Vec<&str> =
        told.filter(|output| !asked.contains(output) && is_known(output)).map(|output| output.name.as_str()).collect();
    if !constant.is_empty() {
        notes.push(format!("no input changes {}: left out", constant.join(", ")));
    }
    if evidence.missing > 0.0 {
        notes.push(format!(
            "{:.2} % of the rows are missing: indices are those given success; the inputs that are left depend on each other, and indices of first order may add up to more than 1",
            100.0 * evidence.missing
        ));
    }
    let there = evidence.layout.samples;
    if evidence.rows < there {
        notes.push(format!("only {} of {there} samples are there: finish the run", evidence.rows));
    }
    if !has_nominal {
        notes.push(match evidence.inputs.iter().any(|input| matches!(input.law, Law::Ranks(_))) {
            true => "the inputs of the table have no law, so there is no nominal rod: no first order is told".into(),
            false => NO_NOMINAL.into(),
        });
    }
    let lacking = asked.iter().any(|output| output.name.starts_with("tip.position"))
        && !evidence.outputs.scalars.iter().any(|scalar| scalar.has_slopes);
    if lacking {
        let names = evidence.inputs.iter().flat_map(|input| &input.parameters);
        let names: Vec<String> = names.map(|name| format!("\"{name}\"")).collect();
        notes.push(format!(
            "bounds and slopes need derivatives: add `derivatives = [{}]` to [output]",
            names.join(", ")
        ));
    }
    if evidence.inputs.iter().any(|input| matches!(input.law, Law::Ranks(_))) {
        notes.push("the inputs of a table are taken as independent, by the law that their values have".into());
    }
    if matches!(evidence.layout.design, Design::Grid(_)) {
        notes.push("indices of a grid are exact sums over its points: there is no interval".into());
    }
    notes
}
