//! The table of the hard cases, and the same as JSON.

use super::hard::{Cell, Column, HardCases};
use super::time::time;
use crate::hard::{Case, Outcome, Verdict};
use rodsweep::draw::{TextTable, engineering};
use serde_json::{Value, json};

impl HardCases {
    /// The table, why there is no answer where there is none, and a line for each engine.
    pub fn text(&self) -> String {
        let HardCases { cases, columns } = self;
        let heads = [
            "case",
            "engine",
            "status",
            "tip/L",
            "estimate",
            "limit",
            "steps",
            "iterations",
            "time/solve",
            "",
            "why hard",
        ];
        let mut table = TextTable::new(heads);
        for (index, case) in cases.iter().enumerate() {
            let mut name = case.name().to_owned();
            let mut why = case.why.clone();
            for column in columns {
                let mut cells = vec![std::mem::take(&mut name), column.setup.name()];
                let none = |verdict: &str| {
                    let dashes = std::iter::repeat_n("-".to_owned(), 7);
                    dashes.chain([verdict.to_owned()]).collect::<Vec<_>>()
                };
                cells.extend(match &column.cells[index] {
                    Cell::Solved(outcome) => outcome_cells(outcome).into(),
                    Cell::Skipped(_) => none("skipped"),
                    Cell::Failed(_) => none("FAILED"),
                });
                cells.push(std::mem::take(&mut why));
                table.row(cells);
            }
        }
        let mut text = format!("{table}\n");
        let mut notes: Vec<String> = Vec::new();
        for (index, case) in cases.iter().enumerate() {
            for column in columns {
                let at = format!("{}, {}", case.name(), column.setup.name());
                notes.extend(match &column.cells[index] {
                    Cell::Solved(outcome) => note(outcome, &at),
                    Cell::Failed(reason) => Some(format!("FAILED: {at}: {reason}")),
                    Cell::Skipped(_) => None,
                });
            }
        }
        text += &notes.iter().map(|note| format!("{note}\n")).collect::<String>();
        for column in columns {
            text += &format!("{}: {}\n", column.setup.name(), summary(column));
        }
        text
    }

    /// The same as JSON.
    pub fn json(&self) -> String {
        let HardCases { cases, columns } = self;
        let row = |case: &Case, column: &Column, outcome: &Outcome| -> Value {
            // JSON has no NaN.
            let number = |x: f64| if outcome.status.is_success() && x.is_finite() { json!(x) } else { Value::Null };
            let why = match outcome.verdict {
                Verdict::NoAnswer(why) => Some(why),
                Verdict::GaveUp(why) => why,
                Verdict::Ok | Verdict::Wrong => None,
            };
            json!({
                "case": case.name(),
                "hard": case.why,
                "engine": column.setup.kind.to_string(),
                "precision": column.setup.precision.to_string(),
                "status": outcome.status.name(),
                "error": number(outcome.error),
                "error_estimate": number(outcome.estimate),
                "limit": outcome.limit,
                "steps": outcome.steps,
                "iterations": outcome.iterations,
                "load_fraction": outcome.load_fraction,
                "seconds": outcome.seconds,
                "verdict": verdict(outcome),
                "why": why,
            })
        };
        let mut rows = Vec::new();
        for (index, case) in cases.iter().enumerate() {
            for column in columns {
                let engine = json!({
                    "case": case.name(),
                    "engine": column.setup.kind.to_string(),
                    "precision": column.setup.precision.to_string(),
                });
                rows.push(match &column.cells[index] {
                    Cell::Solved(outcome) => row(case, column, outcome),
                    Cell::Skipped(reason) => merged(engine, json!({ "skipped": reason })),
                    Cell::Failed(reason) => merged(engine, json!({ "failed": reason })),
                });
            }
        }
        let value = json!({
            "version": rodsweep::VERSION,
            "rows": rows,
            "within_limits": self.is_right(),
        });
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }
}

/// What a row has no room for.
fn note(outcome: &Outcome, at: &str) -> Option<String> {
    let share = outcome.load_fraction;
    match outcome.verdict {
        Verdict::NoAnswer(why) => Some(format!("no answer, rightly: {at}, at {share:.3} of the load: {why}")),
        Verdict::GaveUp(why) => {
            Some(format!("gave up: {at}, at {share:.3} of the load: {}", why.unwrap_or("not known before")))
        }
        Verdict::Ok | Verdict::Wrong => None,
    }
}

fn outcome_cells(outcome: &Outcome) -> [String; 8] {
    // Where there is no answer, the last iterate's tip says nothing.
    let number = |x: f64| if outcome.status.is_success() { engineering(x) } else { "-".into() };
    [
        outcome.status.name().into(),
        number(outcome.error),
        number(outcome.estimate),
        engineering(outcome.limit),
        outcome.steps.map_or("adaptive".into(), |steps| steps.to_string()),
        format!("{}", outcome.iterations),
        time(outcome.seconds),
        verdict(outcome).into(),
    ]
}

fn verdict(outcome: &Outcome) -> &'static str {
    match outcome.verdict {
        Verdict::Ok => "ok",
        Verdict::NoAnswer(_) => "no answer",
        Verdict::GaveUp(_) => "gave up",
        Verdict::Wrong => "WRONG",
    }
}

fn summary(column: &Column) -> String {
    let outcomes = || column.cells.iter().filter_map(Cell::outcome);
    let count = |is: fn(&Verdict) -> bool| outcomes().filter(|outcome| is(&outcome.verdict)).count();
    let mut text = format!(
        "{} ok, {} rightly without an answer, {} gave up, {} WRONG",
        count(|verdict| *verdict == Verdict::Ok),
        count(|verdict| matches!(verdict, Verdict::NoAnswer(_))),
        count(|verdict| matches!(verdict, Verdict::GaveUp(_))),
        count(|verdict| *verdict == Verdict::Wrong),
    );
    let (mut skipped, mut failed, mut why) = (0, 0, None);
    for cell in &column.cells {
        match cell {
            Cell::Solved(_) => {}
            Cell::Skipped(reason) => (skipped, why) = (skipped + 1, Some(reason)),
            Cell::Failed(_) => failed += 1,
        }
    }
    if failed > 0 {
        text += &format!(", {failed} FAILED");
    }
    if let Some(why) = why {
        text += &format!(", {skipped} skipped: {why}");
    }
    text
}

impl Cell {
    fn outcome(&self) -> Option<&Outcome> {
        match self {
            Cell::Solved(outcome) => Some(outcome),
            Cell::Skipped(_) | Cell::Failed(_) => None,
        }
    }
}

/// An object with the entries of another.
fn merged(mut object: Value, other: Value) -> Value {
    if let (Value::Object(object), Value::Object(other)) = (&mut object, other) {
        object.extend(other);
    }
    object
}
