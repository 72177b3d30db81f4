//! `rodsweep solve --all-branches`: every equilibrium that can be found, lowest energy first.

use super::engine::Engine;
use super::solve::Solved;
use super::{CommandError, say, solution_json};
use rodsweep::model::{Quantity, Solutions};
use rodsweep::reference::energy;
use rodsweep::report::{Table, engineering};
use rodsweep::study::find_branches;
use serde_json::{Value, json};

/// One equilibrium, as a solution of its own, with its energy [J] where the loads have a potential.
struct Branch {
    solved: Solved,
    energy: Option<f64>,
}

/// Every equilibrium beside the one from rest, as text or as JSON.
pub fn answer(from_rest: &Solved, engine: &Engine, as_json: bool) -> Result<String, CommandError> {
    let Solved { plan, batch, .. } = from_rest;
    let found = find_branches(plan, batch, 0, &from_rest.solutions, &mut |plan| engine.make(plan))?;
    let rod = plan.sample_rod(batch, 0);
    let mut branches: Vec<Branch> = (0..found.solutions.sample_count())
        .filter(|row| found.solutions.status(*row).is_converged())
        .map(|row| {
            let mut solutions = Solutions::new(plan.derivatives.len(), 1);
            solutions.copy_row(0, &found.solutions, row);
            let energy = energy(&rod, solutions.vector(0, Quantity::BaseMoment));
            Branch { solved: Solved { solutions, ..from_rest.clone() }, energy }
        })
        .collect();
    // Where nothing has an energy, stable ones first.
    let rank = |branch: &Branch| {
        let index = branch.solved.solutions.get(0, Quantity::StabilityIndex);
        branch.energy.unwrap_or(index)
    };
    branches.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    if !found.balanced {
        say(&format!(
            "note: of {} searches {} equilibria came out, whose signs do not add up: some may be missing",
            found.searches,
            branches.len()
        ));
    }
    Ok(if as_json { json_text(&branches, &found) } else { text(&branches) })
}

fn json_text(branches: &[Branch], found: &rodsweep::study::Branches) -> String {
    let value = |branch: &Branch| -> Value {
        let mut value = solution_json::value(&branch.solved);
        value["energy"] = json!(branch.energy);
        value["stability_index"] = json!(branch.solved.solutions.get(0, Quantity::StabilityIndex) as u64);
        value
    };
    let value = json!({
        "branches": branches.iter().map(value).collect::<Vec<_>>(),
        "balanced": found.balanced,
        "searches": found.searches,
    });
    serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
}

fn text(branches: &[Branch]) -> String {
    let mut table = Table::new(["branch", "energy [J]", "index", "margin", "x [mm]", "y", "z", "status"]);
    for (k, Branch { solved, energy }) in branches.iter().enumerate() {
        let solutions = &solved.solutions;
        let mut cells = vec![
            (k + 1).to_string(),
            energy.map_or_else(|| "-".into(), |energy| format!("{energy:.9e}")),
            format!("{}", solutions.get(0, Quantity::StabilityIndex)),
            engineering(solutions.get(0, Quantity::StabilityMargin)),
        ];
        cells.extend(solutions.vector(0, Quantity::TipPosition).iter().map(|x| format!("{:.6}", x * 1e3)));
        cells.push(solutions.status(0).name().into());
        table.row(cells);
    }
    format!("equilibria\n{table}")
}
