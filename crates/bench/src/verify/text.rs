//! The table of the chain, and the same as JSON.

use super::Verification;
use super::compare::{Largest, Limits};
use super::links::{F32, F64, Row};
use super::time::time;
use rodsweep::draw::{TextTable, engineering};
use serde_json::{Value, json};

impl Verification {
    /// The table, with limits, what was skipped, and where replays lie.
    pub fn text(&self) -> String {
        let Verification { runs, rows, cases, .. } = self;
        let mut table = TextTable::new([
            "engine",
            "method",
            "against",
            "shows",
            "scenes",
            "samples",
            "converged",
            "position/L",
            "rotation",
            "base moment",
            "derivative",
            "worst by",
            "gave up",
            "other",
            "time/sample",
            "",
        ]);
        for row in rows {
            let run = &runs[row.link.run];
            let against = row.link.against.map_or("-".into(), |against| runs[against].setup.name());
            let mut cells = vec![run.setup.name(), run.setup.method(), against, row.link.cause.into()];
            if row.sample_count == 0 {
                cells.extend(std::iter::repeat_n("-".to_owned(), 11));
                cells.push(row.verdict(runs).into());
                table.row(cells);
                continue;
            }
            let share = 100.0 * row.converged as f64 / row.sample_count.max(1) as f64;
            cells.extend([row.case_count.to_string(), row.sample_count.to_string(), format!("{share:.1} %")]);
            let d = &row.differences;
            match row.link.against {
                None => cells.extend(std::iter::repeat_n("-".to_owned(), 7)),
                Some(_) => {
                    cells.extend([&d.position, &d.rotation, &d.moment, &d.derivative].map(|l| engineering(l.error)));
                    cells.push(row.worst_parameter(cases).unwrap_or("-".into()));
                    cells.extend([d.gave_up.to_string(), d.other.to_string()]);
                }
            }
            cells.push(row.seconds_per_sample(runs).map_or("-".into(), time));
            cells.push(row.verdict(runs).into());
            table.row(cells);
        }
        let mut text = format!("{table}\n");
        let mut named: Vec<String> = Vec::new();
        for run in runs {
            let name = run.setup.name();
            if let (Some(info), false) = (&run.info, named.contains(&name)) {
                text += &format!(
                    "{name}: {}{}\n",
                    info.device,
                    if info.driver.is_empty() { String::new() } else { format!(", {}", info.driver) }
                );
                named.push(name);
            }
        }
        text += "f64 and f32, and cpu and gpu, are compared at the same steps\n";
        text += &limits_text("f64", &F64);
        text += &limits_text("f32", &F32);
        text += "gave up: converged by the other engine only (`run` solves such samples again in f64); other: another \
                 branch, or an answer where the other engine has none\n";
        for run in runs {
            let some = if run.info.is_some() { " some scenes" } else { "" };
            if let Some(reason) = &run.skipped {
                text += &format!("skipped: {}{some}: {reason}\n", run.setup.name());
            }
            if let Some(reason) = &run.failed {
                text += &format!("FAILED: {}: {reason}\n", run.setup.name());
            }
        }
        for row in rows {
            if let Some(path) = &row.replay {
                text += &format!("beyond its limit: {}; replay: {}\n", runs[row.link.run].setup.name(), path.display());
            }
        }
        text += "`verify --hard` tries cases with folds, flips, many equilibria and extreme units\n";
        text
    }

    /// The same as JSON.
    pub fn json(&self) -> String {
        let Verification { options, runs, rows, cases } = self;
        let limits = |l: &Limits| json!({ "pose": l.pose, "base_moment": l.moment, "derivative": l.derivative, "small_column": l.small_column });
        let row = |row: &Row| -> Value {
            let run = &runs[row.link.run];
            let d = &row.differences;
            let measured = row.link.against.is_some() && d.compared > 0;
            let number = |largest: &Largest| if measured { json!(largest.error) } else { Value::Null };
            json!({
                "engine": run.setup.kind.to_string(),
                "precision": run.setup.precision.to_string(),
                "device": run.info.as_ref().map(|info| info.device.clone()),
                "driver": run.info.as_ref().map(|info| info.driver.clone()),
                "method": run.setup.method(),
                "against": row.link.against.map(|against| runs[against].setup.name()),
                "shows": row.link.cause,
                "scenes": row.case_count,
                "samples": row.sample_count,
                "converged": row.converged,
                "compared": d.compared,
                "position": number(&d.position),
                "rotation": number(&d.rotation),
                "base_moment": number(&d.moment),
                "derivative": number(&d.derivative),
                "worst_parameter": row.worst_parameter(cases),
                "gave_up": d.gave_up,
                "other": d.other,
                "seconds_per_sample": row.seconds_per_sample(runs),
                "limits": limits(&row.limits),
                "within_limits": row.is_within(runs),
                "skipped": run.skipped,
                "failed": run.failed,
                "replay": row.replay.as_ref().map(|path| path.display().to_string()),
            })
        };
        let value = json!({
            "version": rodsweep::VERSION,
            "seed": options.seed,
            "random_scenes": options.samples,
            "rows": rows.iter().map(row).collect::<Vec<_>>(),
            "within_limits": self.is_within_limits(),
        });
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }
}

fn limits_text(precision: &str, limits: &Limits) -> String {
    let Limits { pose, moment, derivative, small_column } = *limits;
    let small = if small_column < 1.0 {
        format!("columns below {small_column:.0e} of their natural size against that")
    } else {
        "columns below their natural size against that".into()
    };
    format!("limits {precision}: pose {pose:.0e}, base moment {moment:.0e}, derivative {derivative:.0e} ({small})\n")
}
