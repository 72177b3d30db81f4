//! What this program is compared with: methods of the literature in the same run, and peers in Python beside it.

use super::measured::{Report, WORK, fastest};
use super::text::{error, ratio, table, time, whole};
use crate::record::Record;

impl Report {
    /// The literature's methods and the peers.
    pub(super) fn rivals<'a>(&'a self, case: &'a str, work: &'a str) -> impl Iterator<Item = &'a Record> + Clone {
        let all = self.part("precision").filter(|record| record.is_literature()).chain(self.part("peers"));
        all.filter(move |record| record.case == case && record.work == work)
    }

    /// In the order in which they came.
    pub(super) fn rival_names(&self, case: &str) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for record in WORK.iter().flat_map(|(work, _)| self.rivals(case, work)) {
            if !names.contains(&record.engine) {
                names.push(record.engine.clone());
            }
        }
        names
    }

    pub(super) fn rivals_section(&self) -> String {
        let scene = self.first_scene();
        let mut rows = Vec::new();
        for (work, name) in WORK {
            for record in self.points(&scene, work).filter(|record| record.is_literature()) {
                rows.push(vec![
                    name.to_owned(),
                    record.engine.trim_start_matches("literature: ").to_owned(),
                    record.settings(),
                    error(record.tip[1]),
                    error(record.tip[2]),
                    error(record.column[1]),
                    time(record.seconds),
                    format!("{} of {}", whole(record.failed + record.elsewhere), whole(record.samples)),
                ]);
            }
        }
        let peers = self.peers();
        if rows.is_empty() && peers.is_empty() {
            return String::new();
        }
        let headers = ["work", "method", "settings", "tip", "tip, worst", "worst column", "a sample", "lost"];
        let adaptive = if self.part("precision").any(|record| record.engine.ends_with("ode_solvers")) {
            " ode_solvers: the crate's adaptive DOP853 on position, rotation, moment and all columns together, under the \
             tolerance in the table."
        } else {
            ""
        };
        format!(
            "## What it is compared with\n\nMethods of the literature, on the first scene, in the same run: plain scalar \
             f64, one rod at a time, Newton's method on the base moment or curvature, from rest under growing loads. Paper's \
             form: nine numbers a column beside pose and curvature, RK4. Finite differences: the same integration, solved \
             again for each derivative.{adaptive} Errors are those of 95 % of the samples, but for the worst tip's.\n\n{}{peers}",
            table(&headers, &rows)
        )
    }

    /// What a researcher would write instead.
    fn peers(&self) -> String {
        let row = |record: &Record| {
            let ours = fastest(self.ours(&record.case, &record.work, &record.precision), record.tip[1]);
            vec![
                record.engine.clone(),
                record.settings(),
                error(record.tip[1]),
                error(record.column[1]),
                time(record.seconds),
                ratio(ours.map_or(f64::NAN, |ours| record.seconds / ours.seconds)),
                format!("{} of {}", whole(record.failed + record.elsewhere), whole(record.samples)),
            ]
        };
        let rows: Vec<Vec<String>> = self.part("peers").map(row).collect();
        if rows.is_empty() {
            return String::new();
        }
        let run = self.part("peers run").next();
        let measured = run.map_or(String::new(), |run| format!(" on {} ({}, {})", run.case, run.engine, run.status));
        let headers = ["peer", "settings", "tip", "worst column", "a sample", "over this program's", "lost"];
        format!(
            "\nPeers, measured by `benches/peers/run`{measured}, on samples of the same scene, from rest with the whole \
             Jacobian, one thread, processor time, compiling left out; the last column but one is over this program's time \
             at the same tip error. C++ by hand: variational equations, loops over columns that the compiler vectorises, \
             -O3 -march=native -ffast-math, a sample at a time. heyoka.py: Taylor's method, compiled, eight samples in a \
             register, sensitivities as part of the system. JAX in blocks: variational equations by hand on arrays over 64 \
             samples, jit. JAX: jit and vmap over all samples, forward mode. CasADi: CVODES with its forward sensitivities, a \
             sample at a time. SciPy: solve_ivp, fsolve, finite differences, a sample at a time.\n\n{}",
            table(&headers, &rows)
        )
    }
}
