//! The stability table: hard cases by engine.

use super::costs::names;
use super::measured::Report;
use super::text::{error, table, time, whole};
use crate::record::Record;

const VERDICTS: [&str; 4] = ["ok", "no answer", "gave up", "WRONG"];

impl Report {
    fn count(&self, engine: &str, verdict: &str) -> usize {
        self.part("hard").filter(|record| record.engine_name() == engine && record.work == verdict).count()
    }

    /// In a sentence.
    pub(super) fn hard_summary(&self) -> String {
        let engines = names(self.part("hard"));
        let part = |engine: &String| {
            let of = |verdict| self.count(engine, verdict);
            format!("{engine} {} right, {} gave up, {} wrong", of("ok") + of("no answer"), of("gave up"), of("WRONG"))
        };
        let words: Vec<String> = engines.iter().map(part).collect();
        if words.is_empty() { String::new() } else { format!("Hard cases: {}.", words.join("; ")) }
    }

    pub(super) fn hard_section(&self) -> String {
        let engines = names(self.part("hard"));
        if engines.is_empty() {
            return String::new();
        }
        let count = |engine: &String| {
            let mut row = vec![engine.clone()];
            row.extend(VERDICTS.map(|verdict| self.count(engine, verdict).to_string()));
            row
        };
        let counts: Vec<Vec<String>> = engines.iter().map(count).collect();
        let mut cases: Vec<&str> = Vec::new();
        for record in self.part("hard") {
            if !cases.contains(&record.case.as_str()) {
                cases.push(&record.case);
            }
        }
        let mut headers = vec!["case".to_owned()];
        headers.extend(engines.iter().map(|engine| format!("{engine}: status, tip error, passes, time")));
        let cell = |record: &Record| {
            let mark = if record.work == "ok" { String::new() } else { format!("**{}**, ", record.work) };
            let steps = if record.size.is_nan() { String::new() } else { format!(", {} steps", record.size) };
            let (tip, passes) = (error(record.tip[0]), whole(record.passes));
            format!("{mark}{}, {tip}, {passes}, {}{steps}", record.status, time(record.seconds))
        };
        let row = |case: &&str| {
            let mut row = vec![(*case).to_owned()];
            for engine in &engines {
                let found = self.part("hard").find(|record| record.case == *case && record.engine_name() == *engine);
                row.push(found.map_or("-".into(), cell));
            }
            row
        };
        let rows: Vec<Vec<String>> = cases.iter().map(row).collect();
        let mut header = vec!["engine"];
        header.extend(VERDICTS);
        format!(
            "## Hard cases\n\nThe cases of `rodsweep verify --hard`: folds, flips, many equilibria, extreme units, limp and \
             taut rods. An engine is right where it finds the tip that the path from rest leads to (ok), or rightly says that \
             there is none (no answer).\n\n{}\n{}",
            table(&header, &counts),
            table(&headers, &rows)
        )
    }
}
