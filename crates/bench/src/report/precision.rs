//! Work against precision, and instruction sets, as tables.

use super::measured::{Report, WORK, fastest};
use super::summary::asked;
use super::text::{percent, ratio, table, time, whole};
use crate::record::Record;

const PAPER: &str = "literature: paper's form";

impl Report {
    /// Of an engine's peak; NaN where it is not known.
    fn of_peak(&self, record: &Record) -> f64 {
        let peak = self.part("peak").find(|peak| peak.engine_name() == record.engine_name());
        peak.map_or(f64::NAN, |peak| record.operations / record.seconds / peak.operations)
    }

    /// The paper's form's time at the same accuracy, over this record's.
    fn gain(&self, record: &Record, asked: f64) -> f64 {
        let theirs = self.points(&record.case, &record.work).filter(|other| other.engine == PAPER);
        fastest(theirs, asked).map_or(f64::NAN, |theirs| theirs.seconds / record.seconds)
    }

    /// Every scene: what it costs at growing accuracy, and what fails.
    pub(super) fn precision_section(&self) -> String {
        let best = self.best_set();
        let mut rows = Vec::new();
        let mut figures = String::new();
        for (case, title) in self.scenes() {
            if self.points(&case, "cold").next().is_none() {
                continue;
            }
            figures += &format!("\n![{title}](work-precision-{case}.png)\n");
            if self.points(&case, "cold").any(Record::is_literature) {
                figures += &format!("\n![{title}, Jacobian](work-precision-{case}-jacobian.png)\n");
            }
            for (work, name) in WORK.into_iter().filter(|(work, _)| self.points(&case, work).next().is_some()) {
                let of = |precision: &'static str, asked: f64| {
                    fastest(self.ours(&case, work, precision), asked).map_or("-".into(), |record| {
                        format!("{} ({} {})", time(record.seconds), record.method, record.size)
                    })
                };
                let ours = self.points(&case, work).filter(|record| !record.is_literature());
                let total = |of: fn(&Record) -> f64| ours.clone().map(of).sum::<f64>();
                rows.push(vec![
                    title.clone(),
                    name.into(),
                    of("f64", 1e-4),
                    of("f64", 1e-6),
                    of("f64", 1e-8),
                    of("f64", 1e-10),
                    of("f32", 1e-4),
                    of("f32", 4e-6),
                    format!(
                        "{} + {} of {}",
                        whole(total(|record| record.failed)),
                        whole(total(|record| record.elsewhere)),
                        whole(total(|record| record.samples))
                    ),
                ]);
            }
        }
        if rows.is_empty() {
            return String::new();
        }
        let headers = [
            "scene",
            "work",
            "f64, 1e-4",
            "f64, 1e-6",
            "f64, 1e-8",
            "f64, 1e-10",
            "f32, 1e-4",
            "f32, 4e-6",
            "failed + elsewhere",
        ];
        format!(
            "## Work against precision\n\nTime of a sample on one thread, {best}, in the fastest settings (stepper and steps \
             over the rod) whose tip error is below the head of the column for 95 % of the samples; the last column is over \
             all settings. In the figures each curve is one method with more and more steps, of the error 95 % are below.\n\n\
             {}\n{}\n![Scenes](scenes.png)\n{figures}\n![Median, 95 % and worst](spread.png)\n",
            table(&headers, &rows),
            self.scene_table()
        )
    }

    /// What the scenes are.
    fn scene_table(&self) -> String {
        let list = self.manifest["scenes"].as_array().cloned().unwrap_or_default();
        let row = |scene: &serde_json::Value| {
            let name = scene["name"].as_str().unwrap_or_default();
            let found = self.part("scene").find(|record| record.case == name);
            let of = |number: fn(&Record) -> f64| found.map_or(f64::NAN, number);
            let count = |key: &str| scene[key].as_array().map_or(0, Vec::len);
            let axes = scene["axes"].as_array().cloned().unwrap_or_default();
            let swept = |axis: &serde_json::Value| axis["parameters"][0].as_str().unwrap_or_default().to_owned();
            vec![
                scene["title"].as_str().unwrap_or_default().to_owned(),
                format!("{:.0} mm, {} segments", 1e3 * scene["length"].as_f64().unwrap_or(f64::NAN), scene["segments"]),
                axes.iter().map(swept).collect::<Vec<_>>().join(", "),
                format!("{} and {}", count("tip"), count("derivatives")),
                format!("{:.2}", of(|record| record.size)),
                format!("{}, {} left out", whole(of(|record| record.samples)), whole(of(|record| record.failed))),
            ]
        };
        let rows: Vec<Vec<String>> = list.iter().map(row).collect();
        let headers = ["scene", "rod", "swept", "derivatives, few and all", "mean tip angle (rad)", "samples"];
        table(&headers, &rows)
    }

    /// Instruction sets and precisions at stated errors.
    pub(super) fn sets_section(&self) -> String {
        let scene = self.first_scene();
        let engines: Vec<(String, String)> = self
            .sets()
            .iter()
            .flat_map(|set| ["f64", "f32"].map(|precision| (set.clone(), precision.to_owned())))
            .collect();
        let mut rows = Vec::new();
        for (work, name, precision, asked) in asked() {
            let mut row = vec![name.to_owned(), format!("{precision}, {asked:.0e}")];
            let of = |set: &str| {
                let ours = self.points(&scene, work);
                let ours = ours.filter(|record| record.engine == set && record.precision == precision);
                fastest(ours, asked).map_or("-".to_owned(), |record| {
                    let (gain, share) = (ratio(self.gain(record, asked)), percent(self.of_peak(record)));
                    format!("{:.0} ({gain}, {share})", 1e9 * record.seconds)
                })
            };
            row.extend(self.sets().iter().map(|set| of(set)));
            rows.push(row);
        }
        if rows.iter().all(|row| row[2..].iter().all(|cell| cell == "-")) {
            return String::new();
        }
        let mut headers = vec!["work".to_owned(), "asked of the tip".to_owned()];
        headers.extend(self.sets());
        let peak = |(set, precision): &(String, String)| {
            let peak = self.part("peak").find(|peak| peak.engine == *set && peak.precision == *precision)?;
            Some(format!("{set} {precision} {:.1}", 1e-9 * peak.operations))
        };
        let peaks: Vec<String> = engines.iter().filter_map(peak).collect();
        format!(
            "## Instruction sets\n\nNanoseconds a sample of the first scene, one thread, at the fastest settings that meet \
             the error; in brackets the time of the paper's form in scalar f64 at that error over this, and the share of the \
             peak of fused multiply-adds measured in the same run (GFLOP/s: {}). Operations are counted by running the \
             kernels on numbers that count; those of a path are its mean number of passes times one pass.\n\n{}\n\
             ![Instruction sets](instruction-sets.png)\n",
            peaks.join(", "),
            table(&headers, &rows)
        )
    }
}
