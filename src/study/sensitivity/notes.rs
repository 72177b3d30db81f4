//! What the reader of a study should know.

use super::design::Design;
use super::indices::Evidence;
use super::inputs::Law;
use super::outputs::Output;

/// In plain words, most important first.
pub(super) fn notes(evidence: &Evidence, asked: &[&Output], has_nominal: bool) -> Vec<String> {
    let mut notes = Vec::new();
    let told = evidence.outputs.outputs.iter().filter(|output| !output.is_indicator);
    let constant: Vec<&str> =
        told.filter(|output| !asked.contains(output)).map(|output| output.name.as_str()).collect();
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
        notes.push(
            "the nominal sample has no equilibrium, or the table's inputs have no law: no first order is told".into(),
        );
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
