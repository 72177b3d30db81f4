//! Every equilibrium of one scene.

use super::{SolveError, Solved, breaking};
use crate::backend::BackendError;
use crate::draw::{TextTable, engineering};
use crate::model::vectors::norm;
use crate::model::{Plan, Rod, Solutions, Vector};
use crate::reference::{Reached, Reference, column_growth, energy_of, equilibrium_near};
use crate::results::StabilityEvidence;
use crate::sweep::branch_tools;
use crate::sweep::{Branch, BranchSearch};
use rayon::prelude::*;
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
    is_of_a_ring: bool,
}

/// Base moments, and points over the rod's length, closer than this belong to one equilibrium.
const SAME: f64 = 1e-6;
/// Columns that grow by more do not tell equilibria apart: they leave half the digits.
const MOST_GROWTH: f64 = 8192.0;

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

    /// Whether the rod and its loads are symmetric about the base's tangent, and it is an equilibrium turned about that by any angle:
    /// one of a ring of equilibria of equal energy. Its margin is 0, and it has no derivatives.
    pub fn is_of_a_ring(&self) -> bool {
        self.is_of_a_ring
    }

    /// As of [`Solved::to_json`], with energy, origin and stability index.
    pub fn to_json(&self) -> Value {
        let mut value = self.solved.to_json();
        value["energy"] = json!(self.energy);
        value["from_rest"] = json!(self.is_from_rest);
        if self.solved.has_no_energy() {
            let evidence = self.solved.evidence(self.is_from_rest);
            value["stability_evidence"] = json!(evidence.map(StabilityEvidence::name));
        }
        value["ring"] = json!(self.is_of_a_ring);
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
    /// An engine that cannot search: the reference, or a GPU that fails. A rod that is too limp or too taut for a search, or with a wall.
    pub fn all_branches(&self) -> Result<AllBranches, SolveError> {
        let engine = self.chosen_engine();
        let rod = self.rod();
        if rod.wall.is_none() && (rod.is_too_limp() || breaking::is_symmetric(&rod)) {
            return self.all_by_the_reference(&rod);
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
            let solved = self.at(solutions, base.force);
            all.branches.push(FoundBranch { solved, energy, is_from_rest, is_of_a_ring: false });
        }
        Ok(all)
    }

    /// By the reference, for rods whose growth exponent is large and whose columns are not, and for those that may form rings.
    fn all_by_the_reference(&self, rod: &Rod) -> Result<AllBranches, SolveError> {
        let own = self.is_equilibrium().then(|| self.base_moment());
        if let Some(m0) = own.filter(|_| rod.is_too_limp()) {
            self.check_growth(rod, m0)?;
        }
        let starts = breaking::starts(rod, self.moment_bound(), own);
        if let Some(m0) = starts.first().filter(|_| rod.is_too_limp()) {
            self.check_growth(rod, *m0)?;
        }
        let mut all = AllBranches { branches: Vec::new(), is_balanced: false, search_count: starts.len() };
        if self.is_converged() {
            let energy =
                equilibrium_near(rod, self.base_moment(), &[]).and_then(|own| energy_of(rod, &own.equilibrium));
            all.branches.push(FoundBranch { solved: self.clone(), energy, is_from_rest: true, is_of_a_ring: false });
        }
        let reached = starts.par_iter().filter_map(|m0| equilibrium_near(rod, *m0, &[])).collect();
        self.add(&mut all, rod, reached);
        Ok(all)
    }

    /// Refuses a rod whose columns grow too much from this base moment (N·m).
    fn check_growth(&self, rod: &Rod, m0: Vector) -> Result<(), SolveError> {
        let told = column_growth(rod, m0).unwrap_or(f64::INFINITY);
        if told <= MOST_GROWTH {
            return Ok(());
        }
        let growth = if told.is_finite() { told.ln() } else { rod.growth() };
        let what = format!(
            "the search for other equilibria of so limp or so taut a rod: errors grow by e^{growth:.0} from base to tip, so \
             that base moments do not tell equilibria apart"
        );
        let remedy = "ask for the equilibrium from rest".into();
        Err(BackendError::Unsupported { backend: self.chosen_engine().kind(), what, remedy }.into())
    }

    /// Adds what is new: of each ring one rod.
    fn add(&self, all: &mut AllBranches, rod: &Rod, found: Vec<Reached>) {
        let reference = Reference::new(self.plan());
        let unit = self.plan().units.moment();
        for Reached { equilibrium, neutral, .. } in found {
            let is_of_a_ring = neutral.is_some_and(|by| breaking::is_turn(rod, equilibrium.m0, by));
            let tip = equilibrium.p_tip;
            let is_known = |branch: &FoundBranch| {
                let apart = |a: Vector, b: Vector| norm([0, 1, 2].map(|k| a[k] - b[k]));
                let m0 = branch.solved.base_moment();
                let alone = apart(m0, equilibrium.m0) < SAME * (unit + norm(m0));
                let length = rod.total_length();
                // Rods of one ring have moments of one size and tips on one circle.
                let ring = is_of_a_ring
                    && branch.is_of_a_ring
                    && (norm(m0) - norm(equilibrium.m0)).abs() < SAME * (unit + norm(m0))
                    && breaking::is_on_circle(rod, tip, branch.solved.tip_position(), SAME * length);
                alone || ring
            };
            if all.branches.iter().any(is_known) {
                continue;
            }
            let with_derivatives = match neutral {
                None => equilibrium_near(rod, equilibrium.m0, reference.slots()).map(|reached| reached.equilibrium),
                Some(_) => None,
            };
            let equilibrium = with_derivatives.unwrap_or(equilibrium);
            let solutions = reference.solution_of(self.batch(), &equilibrium);
            let energy = energy_of(rod, &equilibrium);
            let solved = self.at(solutions, None);
            all.branches.push(FoundBranch { solved, energy, is_from_rest: false, is_of_a_ring });
        }
        let rank = |branch: &FoundBranch| {
            let index = branch.solved.stability_index().map_or(f64::INFINITY, |index| index as f64);
            [branch.energy.unwrap_or(f64::INFINITY), index]
        };
        all.branches.sort_by(|a, b| {
            let [a, b] = [rank(a), rank(b)];
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
        });
        // The rods of a ring add up to nothing.
        let alone = all.branches.iter().filter(|branch| !branch.is_of_a_ring);
        let sign = |index: usize| if index.is_multiple_of(2) { 1 } else { -1 };
        all.is_balanced = alone.filter_map(|branch| branch.solved.stability_index()).map(sign).sum::<i32>() == 1;
    }

    /// No base moment of an equilibrium is larger (N·m).
    fn moment_bound(&self) -> f64 {
        self.plan().moment_bound(self.batch(), 0).max(self.plan().units.moment())
    }
}

impl fmt::Display for AllBranches {
    /// A table with a line for each equilibrium; positions in mm.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let heads = ["branch", "energy [J]", "index", "margin", "x [mm]", "y", "z", "status", "from rest"];
        let has_no_energy = self.branches.iter().any(|branch| branch.solved.has_no_energy());
        let evidence = has_no_energy.then_some("evidence");
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
            if has_no_energy {
                let evidence = branch.solved.evidence(branch.is_from_rest);
                cells.push(evidence.map_or("", StabilityEvidence::name).into());
            }
            table.row(cells);
        }
        write!(f, "equilibria\n{table}")?;
        for (k, branch) in self.branches.iter().enumerate().filter(|(_, branch)| branch.is_of_a_ring) {
            let how = if branch.solved.is_stable() { "stable against everything else" } else { "unstable" };
            writeln!(
                f,
                "branch {k} is one of a ring: turned about the base's tangent by any angle it is an equilibrium, too; it is {how}"
            )?;
        }
        Ok(())
    }
}
