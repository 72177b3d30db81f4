//! Work against precision as tables.

use super::text::{error, percent, ratio, table, time, whole};
use super::{Record, Report, fastest};

/// Kinds of work, what they are called, and the tip errors that are asked of f64 and f32.
const WORK: [(&str, &str, [f64; 2]); 3] = [
    ("tip", "tip + few columns, from rest", [1e-6, 2e-6]),
    ("cold", "equilibrium + Jacobian, from rest", [1e-6, 4e-6]),
    ("warm", "equilibrium + Jacobian, warm", [1e-6, 4e-6]),
];
/// The finest that the summary asks for, of f64.
const FINE: f64 = 1e-10;
const PAPER: &str = "literature: paper's form";
const DIFFERENCES: &str = "literature: finite differences";

/// What the tables ask for: work, its name, precision, tip error.
fn asked() -> Vec<(&'static str, &'static str, &'static str, f64)> {
    let mut all = Vec::new();
    for (work, name, [f64_error, f32_error]) in WORK {
        all.push((work, name, "f64", f64_error));
        all.push((work, name, "f32", f32_error));
    }
    all.insert(4, ("cold", WORK[1].1, "f64", FINE));
    all
}

impl Report {
    fn points<'a>(&'a self, case: &'a str, work: &'a str) -> impl Iterator<Item = &'a Record> + Clone {
        self.part("precision").filter(move |record| record.case == case && record.work == work)
    }

    /// Of an engine's peak; NaN where it is not known.
    fn of_peak(&self, record: &Record) -> f64 {
        let peak = self.part("peak").find(|peak| peak.engine_name() == record.engine_name());
        peak.map_or(f64::NAN, |peak| record.operations / record.seconds / peak.operations)
    }

    /// A literature method's time at the same accuracy, over this record's.
    fn gain(&self, record: &Record, method: &str, asked: f64) -> f64 {
        let theirs = self.points(&record.case, &record.work).filter(|other| other.engine == method);
        fastest(theirs, asked).map_or(f64::NAN, |theirs| theirs.seconds / record.seconds)
    }

    /// How fast, at which error, on what, against whom.
    pub(super) fn summary(&self) -> String {
        let table = self.summary_table();
        if table.is_empty() { table } else { format!("## In a minute\n\n{table}") }
    }

    /// The same as the README has it, with the machine.
    pub fn readme(&self) -> String {
        let table = self.summary_table();
        if table.is_empty() { table } else { format!("{}\n\n{table}", self.machine()) }
    }

    fn summary_table(&self) -> String {
        let (scene, best) = (self.first_scene(), self.best_set());
        let title = self.scenes().into_iter().next().map(|(_, title)| title).unwrap_or_default();
        let mut rows = Vec::new();
        for (work, name, precision, asked) in asked() {
            let ours = self.points(&scene, work);
            let ours = ours.filter(|record| record.engine == best && record.precision == precision);
            let Some(record) = fastest(ours, asked) else { continue };
            rows.push(vec![
                name.to_owned(),
                format!("{precision}, {:.0e}", asked),
                format!("{}, {} steps", record.method, record.size),
                error(record.tip[1]),
                error(record.norm[1]),
                error(record.column[1]),
                time(record.seconds),
                ratio(self.gain(record, PAPER, asked)),
                ratio(self.gain(record, DIFFERENCES, asked)),
                percent(self.of_peak(record)),
            ]);
        }
        if rows.is_empty() {
            return String::new();
        }
        let headers = [
            "work",
            "asked of the tip",
            "method",
            "tip p95",
            "Jacobian p95",
            "worst column p95",
            "a sample",
            "paper's form",
            "differences",
            "of peak",
        ];
        format!(
            "One thread, {best}, {title}: the fastest settings whose tips are as near to the reference's as \
             asked, position over length, for 95 % of the samples. Paper's form and finite differences are plain scalar f64 \
             at the same accuracy on the same samples, in units of this program's time.\n\n{}\n{}",
            table(&headers, &rows),
            self.failures()
        )
    }

    /// Where it fails, in a line each.
    fn failures(&self) -> String {
        let sum = |of: fn(&Record) -> f64| -> u64 {
            let ours = self.part("precision").filter(|record| !record.is_literature());
            ours.map(of).filter(|x| x.is_finite()).sum::<f64>() as u64
        };
        let (samples, failed, elsewhere) =
            (sum(|record| record.samples), sum(|record| record.failed), sum(|record| record.elsewhere));
        let hard = self.hard_summary();
        format!(
            "Where it fails: of {} solved samples in all measurements, coarsest steps included, {} have no success and {} \
             lie on another branch (below, by scene). {hard}\n",
            whole(samples as f64),
            whole(failed as f64),
            whole(elsewhere as f64)
        )
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
            for (work, name, _) in WORK {
                let of = |precision: &'static str, asked: f64| {
                    let ours = self.points(&case, work);
                    let ours = ours.filter(|record| record.engine == best && record.precision == precision);
                    fastest(ours, asked).map_or("-".into(), |record| {
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
                    let (gain, share) = (ratio(self.gain(record, PAPER, asked)), percent(self.of_peak(record)));
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
             ![Instruction sets](instruction-sets.png)\n\n{}",
            peaks.join(", "),
            table(&headers, &rows),
            self.literature_table()
        )
    }

    /// The literature's methods themselves.
    fn literature_table(&self) -> String {
        let scene = self.first_scene();
        let mut rows = Vec::new();
        for (work, name, _) in WORK {
            for record in self.points(&scene, work).filter(|record| record.is_literature()) {
                rows.push(vec![
                    name.to_owned(),
                    record.engine.trim_start_matches("literature: ").to_owned(),
                    format!("{} {}", record.method, record.size),
                    error(record.tip[1]),
                    error(record.tip[2]),
                    error(record.column[1]),
                    time(record.seconds),
                    format!("{} of {}", whole(record.failed + record.elsewhere), whole(record.samples)),
                ]);
            }
        }
        if rows.is_empty() {
            return String::new();
        }
        let headers =
            ["work", "literature's method", "steps", "tip p95", "tip worst", "column p95", "a sample", "lost"];
        format!("What it is compared with:\n\n{}{}", table(&headers, &rows), self.peers())
    }

    /// What a researcher would write instead.
    fn peers(&self) -> String {
        let best = self.best_set();
        let row = |record: &Record| {
            let ours = self.points(&record.case, &record.work);
            let ours = ours.filter(|ours| ours.engine == best && ours.precision == record.precision);
            let gain = fastest(ours, record.tip[1]).map_or(f64::NAN, |ours| record.seconds / ours.seconds);
            vec![
                record.engine.clone(),
                if record.size.is_nan() { record.method.clone() } else { format!("{} {}", record.method, record.size) },
                error(record.tip[1]),
                error(record.column[1]),
                time(record.seconds),
                ratio(gain),
                whole(record.samples),
            ]
        };
        let rows: Vec<Vec<String>> = self.part("peers").map(row).collect();
        if rows.is_empty() {
            return String::new();
        }
        let headers =
            ["peer", "steps or tolerance", "tip p95", "column p95", "a sample", "over this program's", "samples"];
        format!(
            "\nPeers, by `benches/peers/run` on samples of the same scene, from rest with the 6 x 17 Jacobian, one core, time \
             on the wall, compiling left out; the last but one column is over this program's time at the same tip error. \
             JAX: jit and vmap over all samples, forward mode. SciPy: shooting with finite differences.\n\n{}",
            table(&headers, &rows)
        )
    }
}
