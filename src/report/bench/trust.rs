//! Error estimates, the accuracy of the reference, and how it was measured.

use super::costs::names;
use super::text::{error, percent, table, time, whole};
use super::{Record, Report};

impl Report {
    pub(super) fn estimate_section(&self) -> String {
        let ours = || self.part("precision").filter(|record| record.bounded.is_finite());
        let row = |engine: &String| {
            let of = || ours().filter(|record| record.engine_name() == *engine);
            let bounded: f64 = of().map(|record| record.bounded).sum();
            let samples: f64 = of().map(|record| record.samples - record.failed - record.elsewhere).sum();
            vec![
                engine.clone(),
                whole(samples),
                whole(samples - bounded),
                format!("{:.3} %", 100.0 * bounded / samples),
            ]
        };
        let rows: Vec<Vec<String>> = names(ours()).iter().map(row).collect();
        if rows.is_empty() {
            return String::new();
        }
        format!(
            "## Error estimates\n\nOf every success, at all steps and on all scenes: whether the true error, of position \
             over length or of rotation, is within the row's own estimate.\n\n{}\n![Error estimates](estimates.png)\n",
            table(&["engine", "successes", "beyond the estimate", "bounded"], &rows)
        )
    }

    /// How far the numbers themselves can be believed.
    pub(super) fn trust_section(&self) -> String {
        let mut text = "## How far to trust this report\n".to_owned();
        let row = |record: &Record| {
            let steps = if record.size.is_nan() { String::new() } else { format!(", {} steps", record.size) };
            vec![
                record.case.clone(),
                format!("{}{steps}", record.work),
                whole(record.samples),
                error(record.tip[0]),
                error(record.tip[2]),
                error(record.column[2]),
            ]
        };
        let rows: Vec<Vec<String>> = self.part("reference").map(row).collect();
        if !rows.is_empty() {
            let headers = ["what", "against", "samples", "tip, median", "tip, worst", "column, worst"];
            text += &format!(
                "\nErrors are against the reference: adaptive, scalar f64, in the literature's form. In this run it was held \
                 against closed forms, and against the CPU engine in f64 with so many steps that twice as many change \
                 nothing: another formulation and another integrator, without shared arithmetic.\n\n{}",
                table(&headers, &rows)
            );
        }
        text += &self.setups();
        let clock = self.manifest["clock"].as_str().unwrap_or("time");
        text += &format!(
            "\nHow it was measured:\n\n\
             - CPU: {clock}, on one thread, batches of all samples of a scene; GPU and throughput: time on the wall (a GPU in \
             software takes all cores). Inputs and results in memory. A time is the median over repeats after a first call, \
             which is left out and reported above.\n\
             - Each point asks of Newton's iteration what its steps can give, not more.\n\
             - Warm starts are base moments of equilibria whose parameters differ by {} of each axis' range. One that \
             lies across a fold leads elsewhere, and is counted as that.\n\
             - A Jacobian's error is that of its norm (dp/L and w, parameters in natural units: what bends the mean rod by a \
             radian, its length, its stiffness), or of its worst column, relative to the column's own size, or to {} of its \
             largest over the samples where that is more. Weak columns, such as those by torsional stiffness, are the \
             worst. The literature's methods are measured on some 24 of the \
             samples.\n\
             - Samples without an answer from rest are left out before; failures on the others are counted.\n",
            percent(self.manifest["near"].as_f64().unwrap_or(f64::NAN)),
            error(self.manifest["small_column"].as_f64().unwrap_or(f64::NAN)),
        );
        for note in self.manifest["notes"].as_array().into_iter().flatten() {
            text += &format!("- {}\n", note.as_str().unwrap_or_default());
        }
        text
    }

    /// What a first call costs beyond the others.
    fn setups(&self) -> String {
        let timed = || self.part("precision").filter(|record| record.setup.is_finite());
        let row = |engine: &String| {
            let mut all: Vec<f64> =
                timed().filter(|record| record.engine_name() == *engine).map(|record| record.setup).collect();
            all.sort_by(f64::total_cmp);
            let at = |share: f64| all.get((share * (all.len().max(1) - 1) as f64).round() as usize).copied();
            let cell = |share: f64| at(share).map_or("-".into(), time);
            vec![engine.clone(), cell(0.5), cell(1.0)]
        };
        let rows: Vec<Vec<String>> = names(timed()).iter().map(row).collect();
        if rows.is_empty() {
            return String::new();
        }
        format!(
            "\nLeft out of all times: preparing an engine (on a GPU: compiling) and what a first call takes longer.\n\n{}",
            table(&["engine", "median", "longest"], &rows)
        )
    }
}
