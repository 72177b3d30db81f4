//! Every equilibrium: `rodsweep solve --all-branches`, and what a sweep with `branch = "all"` searches with.

use super::engine::{Engine, second_attempt};
use super::solve::Solved;
use super::{CommandError, say, solution_json};
use rodsweep::model::{Plan, Quantity, Solutions};
use rodsweep::reference::energy;
use rodsweep::report::{Table, engineering};
use rodsweep::sweep::{BackendFactory, Branch, BranchSearch, BranchTools, Branches, Equilibria};
use serde_json::{Value, json};

/// Searches on an engine; answers in f64 on the CPU, energies by the reference.
pub fn tools(engine: BackendFactory<'_>) -> BranchTools<'_> {
    BranchTools { engine, finisher: &second_attempt, energy: &energy }
}

/// Every equilibrium beside the one from rest, lowest energy first, as text or as JSON.
pub fn answer(from_rest: &Solved, engine: &Engine, as_json: bool) -> Result<String, CommandError> {
    let Solved { plan, batch, solutions, .. } = from_rest;
    let make = |plan: &Plan| engine.make(plan);
    let found = BranchSearch::new(plan, tools(&make))?.find(batch, solutions, &|| false)?;
    let Some(Branches { solutions, branches, samples }) = found else { return Ok(String::new()) };
    let Some(Equilibria { balanced, searches, .. }) = samples.into_iter().next() else { return Ok(String::new()) };
    let solved: Vec<(Solved, Branch)> = branches
        .into_iter()
        .enumerate()
        .map(|(row, branch)| {
            let mut of_row = Solutions::new(plan, 1);
            of_row.copy_row(0, &solutions, row);
            (Solved { solutions: of_row, ..from_rest.clone() }, branch)
        })
        .collect();
    if !balanced {
        say(&format!(
            "note: of {searches} searches {} equilibria came out, whose signs do not add up: some are missing",
            solved.len()
        ));
    }
    if !as_json {
        return Ok(text(&solved));
    }
    let branches: Vec<Value> = solved.iter().map(|(solved, branch)| json_value(solved, branch)).collect();
    let value = json!({ "branches": branches, "balanced": balanced, "searches": searches });
    Ok(serde_json::to_string_pretty(&value).unwrap_or_default() + "\n")
}

fn json_value(solved: &Solved, branch: &Branch) -> Value {
    let mut value = solution_json::value(solved);
    value["energy"] = json!(branch.energy);
    value["from_rest"] = json!(branch.from_rest);
    value["stability_index"] = json!(solved.solutions.get(0, Quantity::StabilityIndex) as u64);
    value
}

fn text(branches: &[(Solved, Branch)]) -> String {
    let heads = ["branch", "energy [J]", "index", "margin", "x [mm]", "y", "z", "status", "from rest"];
    let mut table = Table::new(heads);
    for (k, (Solved { solutions, .. }, branch)) in branches.iter().enumerate() {
        let mut cells = vec![
            k.to_string(),
            branch.energy.map_or_else(|| "-".into(), |energy| format!("{energy:.9e}")),
            format!("{}", solutions.get(0, Quantity::StabilityIndex)),
            engineering(solutions.get(0, Quantity::StabilityMargin)),
        ];
        cells.extend(solutions.vector(0, Quantity::TipPosition).iter().map(|x| format!("{:.6}", x * 1e3)));
        cells.push(solutions.status(0).name().into());
        cells.push(if branch.from_rest { "yes" } else { "" }.into());
        table.row(cells);
    }
    format!("equilibria\n{table}")
}
