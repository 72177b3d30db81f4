//! What a reader wants to know in a minute: how fast, at which error, against whom, and where it fails.

use super::measured::{Report, WORK, fastest};
use super::text::{error, ratio, table, time, whole};
use crate::record::Record;

/// The finest that is asked for, of f64.
const FINE: f64 = 1e-10;
/// What is asked of this program and others where they are compared.
pub(super) const COMPARED: f64 = 1e-6;

/// What the tables ask for: work, its name, precision, tip error.
pub(super) fn asked() -> Vec<(&'static str, &'static str, &'static str, f64)> {
    let mut all = Vec::new();
    for (work, name) in WORK {
        // With a whole Jacobian, f32 is asked for less.
        let f32_error = if matches!(work, "given" | "tip") { 2e-6 } else { 4e-6 };
        all.push((work, name, "f64", COMPARED));
        all.push((work, name, "f32", f32_error));
        if work == "cold" {
            all.push((work, name, "f64", FINE));
        }
    }
    all
}

impl Report {
    pub(super) fn summary(&self) -> String {
        let text = self.summary_text();
        if text.is_empty() { text } else { format!("## In a minute\n\n{text}") }
    }

    /// The same as the README has it, with the machine.
    pub fn readme(&self) -> String {
        let text = self.summary_text();
        if text.is_empty() { text } else { format!("{}\n\n{text}", self.machine()) }
    }

    fn summary_text(&self) -> String {
        let scene = self.first_scene();
        let mut rows = Vec::new();
        for (work, name, precision, asked) in asked() {
            let Some(record) = fastest(self.ours(&scene, work, precision), asked) else { continue };
            rows.push(vec![
                name.to_owned(),
                format!("{precision}, {asked:.0e}"),
                record.settings(),
                error(record.tip[1]),
                error(record.norm[1]),
                error(record.column[1]),
                time(record.seconds),
            ]);
        }
        if rows.is_empty() {
            return String::new();
        }
        let title = self.scenes().into_iter().next().map(|(_, title)| title).unwrap_or_default();
        let headers = ["work", "asked", "settings", "tip", "Jacobian", "worst column", "a sample"];
        let parts = [
            format!(
                "How fast, at which error: {title}, one thread, {}. Asked is a tip error (distance from the reference's \
                 tip over the rod's length) that 95 % of the samples stay below; of all settings that do, the fastest. In a \
                 sweep of a million samples they start from anchors. \
                 Its errors are those of 95 % of the samples, too: of the tip, of the Jacobian's norm and of its worst \
                 column, the latter two relative.\n\n{}",
                self.best_set(),
                table(&headers, &rows)
            ),
            self.against(),
            self.failures(),
            self.trust_line(),
        ];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("\n")
    }

    /// Everyone's time at the same error.
    fn against(&self) -> String {
        let scene = self.first_scene();
        let works: Vec<_> = WORK.into_iter().filter(|(work, _)| self.points(&scene, work).next().is_some()).collect();
        let best = |work: &'static str| fastest(self.ours(&scene, work, "f64"), COMPARED);
        let own = |work: &'static str| best(work).map_or("-".into(), |record| time(record.seconds));
        let mut rows =
            vec![std::iter::once("this program".to_owned()).chain(works.iter().map(|(work, _)| own(work))).collect()];
        for name in self.rival_names(&scene) {
            let cell = |work: &'static str| {
                // In a sweep they start from rest.
                let of = if work == "sweep" { "cold" } else { work };
                let theirs = fastest(self.rivals(&scene, of).filter(|record| record.engine == name), COMPARED);
                theirs.zip(best(work)).map(|(theirs, ours)| {
                    format!("{} ({})", time(theirs.seconds), ratio(theirs.seconds / ours.seconds))
                })
            };
            let cells: Vec<Option<String>> = works.iter().map(|(work, _)| cell(work)).collect();
            if cells.iter().any(Option::is_some) {
                let name = name.trim_start_matches("literature: ").to_owned();
                let cells = cells.into_iter().map(|cell| cell.unwrap_or("-".into()));
                rows.push(std::iter::once(name).chain(cells).collect::<Vec<String>>());
            }
        }
        if rows.len() < 2 {
            return String::new();
        }
        let headers: Vec<&str> = std::iter::once("f64").chain(works.iter().map(|(_, name)| *name)).collect();
        format!(
            "Against whom: on samples of the same sweep, one thread each, at the same tip error of {COMPARED:.0e}; in \
             brackets, over this program's time, which is the mean over 2,048 of them.\n\n{}",
            table(&headers, &rows)
        )
    }

    /// Where it fails, in a line each.
    fn failures(&self) -> String {
        let sum = |of: fn(&Record) -> f64| -> f64 {
            let ours = self.part("precision").filter(|record| !record.is_literature());
            ours.map(of).filter(|x| x.is_finite()).sum()
        };
        format!(
            "Where it fails: of {} solved samples in all measurements, coarsest steps included, {} have no success and {} \
             lie on another branch (below, by scene). {}\n",
            whole(sum(|record| record.samples)),
            whole(sum(|record| record.failed)),
            whole(sum(|record| record.elsewhere)),
            self.hard_summary()
        )
    }
}
