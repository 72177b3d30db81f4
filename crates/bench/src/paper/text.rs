//! The comparison as tables, CSV, Markdown and JSON.

use super::cases::{CURRENT, NEAR, REACH, SMALL_COLUMN};
use super::methods::PAPER;
use super::rows::{Row, Spread, TIMED};
use super::settings::{BATCH, CHAIN_TOLERANCES, TOGETHER, TOLERANCE};
use super::{Comparison, PaperOptions};
use rodsweep::draw::{TextTable, engineering};
use serde_json::{Value, json};

/// Beside published figures, too, though without any.
const OURS: &str = "this program, continued";
/// Headers of the times.
const HEADERS: [&str; 4] = ["Jacobian", "warm", "from rest", "control step"];

/// `35.1 µs`
fn time(seconds: f64) -> String {
    match seconds {
        s if s < 1e-6 => format!("{:.0} ns", s * 1e9),
        s if s < 1e-3 => format!("{:.1} µs", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}

/// Three digits: `26.7x`
fn ratio(ratio: f64) -> String {
    let digits = if ratio > 0.0 { (2.0 - ratio.log10().floor()).clamp(0.0, 6.0) as usize } else { 0 };
    format!("{ratio:.digits$}x")
}

/// The paper's method at the same thing in this run.
fn paper(rows: &[Row], what: usize) -> Option<f64> {
    rows.iter().find(|row| row.method == PAPER)?.times[what].map(|spread| spread.median)
}

fn accuracy(comparison: &Comparison) -> (Vec<String>, Vec<Vec<String>>) {
    let headers = [
        "method",
        "resolution",
        "samples",
        "asked",
        "tip p95",
        "tip max",
        "column p95",
        "column max",
        "other branch",
        "failed",
    ];
    let cells = |row: &Row| {
        let mut cells = vec![row.method.clone(), row.resolution.clone(), row.samples.to_string()];
        cells.push(format!("{:.0e}", row.tolerance));
        cells.extend(row.errors.iter().flatten().map(|error| engineering(*error)));
        cells.extend([row.other_branch.to_string(), row.failed.to_string()]);
        cells
    };
    (headers.map(String::from).to_vec(), comparison.rows.iter().map(cells).collect())
}

fn times(comparison: &Comparison) -> (Vec<String>, Vec<Vec<String>>) {
    let mut headers = vec!["method".to_owned()];
    for what in HEADERS {
        headers.extend([format!("{what} [µs]"), "ratio".into()]);
    }
    let micro = |seconds: f64| format!("{:.1}", 1e6 * seconds);
    let shown = |Spread { p5, median, p95 }: &Spread| format!("{} ({}–{})", micro(*median), micro(*p5), micro(*p95));
    let cells = |row: &Row| {
        let mut cells = vec![row.method.clone()];
        for (what, spread) in row.times.iter().enumerate() {
            let of_paper = spread.zip(paper(&comparison.rows, what)).map(|(spread, paper)| spread.median / paper);
            cells.extend([spread.as_ref().map_or("-".into(), shown), of_paper.map_or("-".into(), ratio)]);
        }
        cells
    };
    (headers, comparison.rows.iter().map(cells).collect())
}

fn published(comparison: &Comparison) -> (Vec<String>, Vec<Vec<String>>) {
    let headers = ["method", "what", "published", "ratio published", "measured here", "ratio here"];
    let mut rows = Vec::new();
    for what in [0, 3] {
        let reference = comparison.rows.iter().find(|row| row.method == PAPER).and_then(|row| row.published[what]);
        for row in &comparison.rows {
            let is_beside = row.published[what].is_some() || row.method.starts_with(OURS);
            let Some(ours) = row.times[what].filter(|_| is_beside) else { continue };
            let theirs = row.published[what];
            let of_reference = theirs.zip(reference).map(|(theirs, reference)| ratio(theirs / reference));
            let here = paper(&comparison.rows, what).map(|paper| ratio(ours.median / paper));
            rows.push(vec![
                row.method.clone(),
                HEADERS[what].into(),
                theirs.map_or("-".into(), time),
                of_reference.unwrap_or("-".into()),
                time(ours.median),
                here.unwrap_or("-".into()),
            ]);
        }
    }
    (headers.map(String::from).to_vec(), rows)
}

fn notes(comparison: &Comparison) -> Vec<String> {
    let Comparison { scene, cases, .. } = comparison;
    let PaperOptions { samples, repeats, seed } = comparison.options;
    let mm = 1e3 * cases.length;
    vec![
        format!(
            "{samples} random configurations (seed {seed}) of \"{scene}\": every current uniform within ±{CURRENT} A, \
             insertion {mm:.1} mm; {} left out, for they have no stable equilibrium on the path from rest.",
            cases.left_out
        ),
        format!(
            "Errors are against the reference: tip position over length; the worst column (dp/L, w), relative, those \
             below {SMALL_COLUMN:.0e} of what turns the tip by a radian against that. Inputs: {}.",
            cases.names.join(", ")
        ),
        format!(
            "Resolutions are the coarsest tried whose tip error is at most what is asked, {TOLERANCE:.0e}, for 95 % (else \
             the finest); of the chains of links {:.0e} and {:.0e}, the latter on every tenth configuration: their \
             effort grows at least with the square of the links, their error falls with it.",
            CHAIN_TOLERANCES[0], CHAIN_TOLERANCES[1]
        ),
        format!(
            "Times are medians over configurations (5 % – 95 %) of medians over {repeats} repeats, on one thread; ratios \
             are to the {PAPER} in this run. Jacobian: at a known equilibrium. Warm: equilibrium and Jacobian, from a \
             configuration whose currents differ by {:.0} mA. From rest: the same, loads raised from \
             zero by an eighth or less at a time. Control step: Jacobian, damped least \
             squares for {:.0} % of the length, equilibrium there.",
            1e3 * NEAR * CURRENT,
            100.0 * REACH
        ),
        format!(
            "This program checks stability and estimates its error every time. One a call and in batches it solves from \
             rest; continued it starts from the base moment near by, and in a control step from the one that the \
             derivatives predict, as `rodsweep control` does: one a call where a target is known when the last is \
             reached, {TOGETHER} a call along a known trajectory. Its control step is the update and one such solve with \
             Jacobian. Several a call are given per configuration, the spread of batches of {BATCH} is over repeats."
        ),
        "Steps of 0.2 mm are those of the solver that the paper's group has published: finer than what is asked \
         here."
            .into(),
        "Finite differences solve again for every input; those of one pass difference the integration and join the \
         columns by the implicit function theorem. The chain differences its moment balance by every joint angle."
            .into(),
        "All methods but this program are plain scalar f64 written for this comparison, not their authors' code; \
         published times are of the authors' code on the authors' machine."
            .into(),
    ]
}

fn table((headers, rows): (Vec<String>, Vec<Vec<String>>)) -> TextTable {
    let mut table = TextTable::new(headers);
    rows.into_iter().for_each(|row| {
        table.row(row);
    });
    table
}

impl Comparison {
    /// The tables as text.
    pub fn text(&self) -> String {
        let mut text = self.machine.join("\n") + "\n\n";
        text += &format!("Accuracy, measured here\n{}\n", table(accuracy(self)));
        text += &format!("Times, measured here\n{}\n", table(times(self)));
        text += &format!("Published figures beside them\n{}\n", table(published(self)));
        text + &notes(self).join("\n") + "\n"
    }

    /// The tables as Markdown.
    pub fn markdown(&self) -> String {
        let list = |lines: &[String]| lines.iter().map(|line| format!("- {line}\n")).collect::<String>();
        format!(
            "# Against the paper's method\n\n{}\n## Accuracy, measured here\n\n{}\n## Times, measured here\n\n{}\n\
             ## Published figures beside them\n\n{}\n## How\n\n{}",
            list(&self.machine),
            table(accuracy(self)).markdown(),
            table(times(self)).markdown(),
            table(published(self)).markdown(),
            list(&notes(self))
        )
    }

    /// One row a method.
    pub fn csv(&self) -> String {
        let mut text =
            "method,resolution,samples,asked,other_branch,failed,tip_p95,tip_max,column_p95,column_max".to_owned();
        for what in TIMED {
            text += &format!(",{what}_p5_s,{what}_median_s,{what}_p95_s,{what}_published_s");
        }
        text += "\n";
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.4e}"));
        for row in &self.rows {
            let Row { method, resolution, samples, tolerance, other_branch, failed, .. } = row;
            text += &format!("\"{method}\",\"{resolution}\",{samples},{tolerance:e},{other_branch},{failed}");
            row.errors.iter().flatten().for_each(|error| text += &format!(",{error:.3e}"));
            for (spread, published) in row.times.iter().zip(row.published) {
                let values = [spread.map(|s| s.p5), spread.map(|s| s.median), spread.map(|s| s.p95), published];
                values.into_iter().for_each(|value| text += &format!(",{}", number(value)));
            }
            text += "\n";
        }
        text
    }

    /// Everything as JSON.
    pub fn json(&self) -> String {
        let row = |row: &Row| -> Value {
            let times: serde_json::Map<String, Value> = TIMED
                .iter()
                .enumerate()
                .map(|(what, name)| {
                    let measured = row.times[what].map(|s| json!({ "p5": s.p5, "median": s.median, "p95": s.p95 }));
                    let of_paper = row.times[what].zip(paper(&self.rows, what));
                    let of_paper = of_paper.map(|(spread, paper)| spread.median / paper);
                    let value = json!({ "measured": measured, "ratio": of_paper, "published": row.published[what] });
                    ((*name).to_owned(), value)
                })
                .collect();
            let [tip, column] = row.errors;
            json!({
                "method": row.method,
                "resolution": row.resolution,
                "samples": row.samples,
                "asked": row.tolerance,
                "other_branch": row.other_branch,
                "failed": row.failed,
                "tip_error": { "p95": tip[0], "max": tip[1] },
                "column_error": { "p95": column[0], "max": column[1] },
                "seconds": times,
            })
        };
        let value = json!({
            "machine": self.machine,
            "scene": self.scene,
            "samples": self.options.samples,
            "left_out": self.cases.left_out,
            "repeats": self.options.repeats,
            "seed": self.options.seed,
            "tolerance": TOLERANCE,
            "chain_tolerances": CHAIN_TOLERANCES,
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
            "notes": notes(self),
        });
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }
}
