//! Every equilibrium of one scene.

use super::{SolveError, Solved};
use crate::backend::BackendError;
use crate::model::{Plan, Solutions};
use crate::report::{TextTable, engineering};
use crate::results::StabilityEvidence;
use crate::sweep::branch_tools;
use crate::sweep::{Branch, BranchSearch};
use serde_json::{Value, json};
use std::fmt;

/// The equilibria of one scene that were found, lowest energy first; without energies, fewest unstable modes first.
#[derive(Clone, Debug)]
pub struct AllBranches {
    branches: Vec<FoundBranch>,
    is_balanced: bool,
    search_count: usize,
}

/// One equilibrium of a scene.
#[derive(Clone, Debug)]
pub struct FoundBranch {
    solved: Solved,
    energy: Option<f64>,
    is_from_rest: bool,
}

impl FoundBranch {
    /// Its numbers.
    pub fn solved(&self) -> &Solved {
        &self.solved
    }

    /// Elastic energy less the work of the loads (J); `None` where the loads have no potential.
    pub fn energy(&self) -> Option<f64> {
        self.energy
    }

    /// Whether the path from rest leads to it.
    pub fn is_from_rest(&self) -> bool {
        self.is_from_rest
    }

    /// As of [`Solved::to_json`], with energy, origin and stability index.
    pub fn to_json(&self) -> Value {
        let mut value = self.solved.to_json();
        value["energy"] = json!(self.energy);
        value["from_rest"] = json!(self.is_from_rest);
        if self.solved.has_dead_moment() {
            let evidence = self.solved.evidence(self.is_from_rest);
            value["stability_evidence"] = json!(evidence.map(StabilityEvidence::name));
        }
        value["stability_index"] = json!(self.solved.stability_index().unwrap_or_default());
        value
    }
}

impl AllBranches {
    /// The equilibria, in order.
    pub fn branches(&self) -> &[FoundBranch] {
        &self.branches
    }

    /// Whether signs add up as they do over all equilibria. If not, some are missing; if so, pairs of them may be.
    pub fn is_balanced(&self) -> bool {
        self.is_balanced
    }

    /// Searches that were made.
    pub fn search_count(&self) -> usize {
        self.search_count
    }

    /// All of it as JSON: `branches`, `balanced`, `searches`.
    pub fn to_json(&self) -> Value {
        let branches: Vec<Value> = self.branches.iter().map(FoundBranch::to_json).collect();
        json!({ "branches": branches, "balanced": self.is_balanced, "searches": self.search_count })
    }
}

impl Solved {
    /// Every equilibrium that can be found, this one among them.
    ///
    /// # Errors
    ///
    /// An engine that cannot search: the reference, or a GPU that fails. A rod that is too limp or too taut for a search.
    pub fn all_branches(&self) -> Result<AllBranches, SolveError> {
        let engine = self.chosen_engine();
        let rod = self.rod();
        if rod.is_too_limp() {
            let growth = rod.growth();
            let what = format!(
                "the search for other equilibria of so limp or so taut a rod: errors grow by e^{growth:.0} from base to tip, so \
                 that base moments do not tell equilibria apart"
            );
            let remedy = "ask for the equilibrium from rest".into();
            return Err(BackendError::Unsupported { backend: engine.kind(), what, remedy }.into());
        }
        let make = |plan: &Plan| engine.make(plan);
        let mut search = BranchSearch::new(self.plan(), branch_tools(&make))?;
        let found = search.find(self.batch(), self.solutions(), &|| false)?;
        let mut all = AllBranches { branches: Vec::new(), is_balanced: false, search_count: 0 };
        // Nothing asks the search to stop early.
        let Some(found) = found else { return Ok(all) };
        if let Some(equilibria) = found.samples.first() {
            (all.is_balanced, all.search_count) = (equilibria.balanced, equilibria.searches);
        }
        for (row, branch) in found.branches.into_iter().enumerate() {
            let Branch { energy, from_rest: is_from_rest, base, .. } = branch;
            let mut solutions = Solutions::new(self.plan(), 1);
            solutions.copy_row(0, &found.solutions, row);
            all.branches.push(FoundBranch { solved: self.at(solutions, base.force), energy, is_from_rest });
        }
        Ok(all)
    }
}

impl fmt::Display for AllBranches {
    /// A table with a line for each equilibrium; positions in mm.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let heads = ["branch", "energy [J]", "index", "margin", "x [mm]", "y", "z", "status", "from rest"];
        let has_dead_moment = self.branches.iter().any(|branch| branch.solved.has_dead_moment());
        let evidence = has_dead_moment.then_some("evidence");
        let mut table = TextTable::new(heads.into_iter().chain(evidence));
        for (k, branch) in self.branches.iter().enumerate() {
            let solved = &branch.solved;
            let mut cells = vec![
                k.to_string(),
                branch.energy.map_or_else(|| "-".into(), |energy| format!("{energy:.9e}")),
                solved.stability_index().map_or_else(|| "-".into(), |index| index.to_string()),
                engineering(solved.stability_margin()),
            ];
            cells.extend(solved.tip_position().iter().map(|x| format!("{:.6}", x * 1e3)));
            cells.push(solved.status().name().into());
            cells.push(if branch.is_from_rest { "yes" } else { "" }.into());
            if has_dead_moment {
                let evidence = branch.solved.evidence(branch.is_from_rest);
                cells.push(evidence.map_or("", StabilityEvidence::name).into());
            }
            table.row(cells);
        }
        write!(f, "equilibria\n{table}")
    }
}
