//! Error estimates, what checks cost, the accuracy of the reference, and how it was measured.

use super::costs::names;
use super::measured::{Report, fastest};
use super::summary::COMPARED;
use super::text::{error, percent, table, three, time, whole};
use crate::record::Record;

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

    /// What a check adds, as a share of what there is without it.
    fn check_cost(&self, case: &str, whole: &str, of: fn(&Record) -> f64) -> f64 {
        let find = |case: &str| self.part("trust").find(|record| record.case == case).map_or(f64::NAN, of);
        find(case) / (find(whole) - find(case))
    }

    /// In a sentence.
    pub(super) fn trust_line(&self) -> String {
        if self.part("trust").next().is_none() {
            return String::new();
        }
        let operations = |case: &str| percent(self.check_cost(case, "a sample", |record| record.operations));
        let seconds = |case: &str| percent(self.check_cost(case, "the map", |record| record.seconds));
        format!(
            "What trust costs, on the workspace map: the error estimate adds {} and the stability index {} to a sample's \
             operations; second attempts add {} and the spot check {} to the run's processor time.\n",
            operations("error estimate"),
            operations("stability index"),
            seconds("second attempts"),
            seconds("spot check")
        )
    }

    pub(super) fn checks_section(&self) -> String {
        let Some(map) = self.part("trust").find(|record| record.case == "the map") else { return String::new() };
        let row = |record: &Record| {
            let (cost, share) = if record.operations.is_nan() {
                let share = self.check_cost(&record.case, "the map", |record| record.seconds);
                (format!("{} a sample of the map", time(record.seconds)), share)
            } else {
                let share = self.check_cost(&record.case, "a sample", |record| record.operations);
                (format!("{} operations a sample", whole(record.operations)), share)
            };
            let of = match record.case.as_str() {
                "the map" | "a sample" => "all of it".to_owned(),
                _ => format!("{:.1} %", 100.0 * share),
            };
            vec![record.case.clone(), whole(record.samples), cost, of]
        };
        let rows: Vec<Vec<String>> = self.part("trust").map(row).collect();
        format!(
            "## What trust costs\n\nOn the workspace map ({} {}, {} steps), files included. Second attempts and the spot \
             check can be left out of a run: processor time of all threads with them, less that without, the median of \
             paired runs. No setting leaves out error estimate and stability index: they are counted in operations, the \
             index as what it makes of columns that Newton's method has anyway; the columns by base rotation, which doubtful \
             samples take, too, are not in it. The last column is over what is \
             left without.\n\n{}",
            map.engine_name(),
            map.method,
            map.size,
            table(&["what", "samples", "cost", "adds"], &rows)
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
             - Each point asks of Newton's iteration what its steps can give, not more.\n{}\
             - Warm starts are base moments of equilibria whose parameters differ by {} of each axis' range. One that \
             lies across a fold leads elsewhere, and is counted as that.\n\
             - A Jacobian's error is that of its norm (dp/L and w, parameters in natural units: what bends the mean rod by a \
             radian, its length, its stiffness), or of its worst column, relative to the column's own size, or to {} of its \
             largest over the samples where that is more. Weak columns, such as those by torsional stiffness, are the \
             worst. The literature's methods are measured on some 24 of the \
             samples.\n\
             - Samples without an answer from rest are left out before; failures on the others are counted.\n",
            self.given(),
            percent(self.manifest["near"].as_f64().unwrap_or(f64::NAN)),
            error(self.manifest["small_column"].as_f64().unwrap_or(f64::NAN)),
        );
        for note in self.manifest["notes"].as_array().into_iter().flatten() {
            text += &format!("- {}\n", note.as_str().unwrap_or_default());
        }
        text
    }

    /// What is left to do where the base moment is given.
    fn given(&self) -> String {
        let scene = self.first_scene();
        let passes = |work| fastest(self.ours(&scene, work, "f64"), COMPARED).map(|record| three(record.passes));
        let words = |(given, rest)| {
            format!(
                "- Integration + few columns: the base moment is given. The literature's methods integrate once; this \
                 program confirms the moment on its coarse grid and moves it to the fine one, {given} passes over the rod \
                 where it takes {rest} from rest, and its time includes stability and error estimate, as everywhere.\n"
            )
        };
        passes("given").zip(passes("tip")).map_or(String::new(), words)
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
