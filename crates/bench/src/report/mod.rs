//! Speed against error: report and figures out of what was measured, `raw.csv` and `manifest.json`, of `peers.csv` where
//! there is one, and of nothing else: the same files give the same report anywhere.

mod costs;
mod figures;
mod hard;
mod precision;
mod rivals;
mod summary;
mod text;
mod trust;

use crate::files::{MANIFEST, PEERS, RAW, REPORT, read_file, write_file};
use crate::record::{Record, RecordError, from_csv};
use crate::{BenchError, ReportFileError};
use rodsweep::report::{Figure, write};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What was measured, and where.
pub struct Report {
    records: Vec<Record>,
    manifest: Value,
}

/// Kinds of work and the words for them.
const WORK: [(&str, &str); 4] = [
    ("given", "integration + few columns"),
    ("tip", "tip + few columns, from rest"),
    ("cold", "equilibrium + Jacobian, from rest"),
    ("warm", "equilibrium + Jacobian, warm"),
];
/// Runs differ by more than this: the machine was busy with something else.
const NOISY: f64 = 0.1;
/// What one thread that measures adds to the load average, and a little.
const OWN_LOAD: f64 = 1.6;
/// Of the samples so many may fail or be elsewhere, and the rest still counts as solved.
const MOST_LOST: f64 = 0.02;

impl Report {
    /// Whether a directory holds measurements already.
    pub fn is_in(directory: &Path) -> bool {
        directory.join(RAW).exists()
    }

    /// Reads the files of a directory.
    ///
    /// # Errors
    ///
    /// A file that is missing or cannot be understood.
    pub fn open(directory: &Path) -> Result<Report, BenchError> {
        let read = |name: &str| read_file(&directory.join(name));
        let peers = if directory.join(PEERS).exists() { Some(read(PEERS)?) } else { None };
        let report = Report::parse(&read(RAW)?, &read(MANIFEST)?, peers.as_deref());
        report.map_err(|source| BenchError::ReportFile { directory: directory.to_owned(), source })
    }

    /// Reads the texts of `raw.csv`, `manifest.json` and `peers.csv`.
    ///
    /// # Errors
    ///
    /// The text that cannot be understood.
    pub fn parse(raw: &str, manifest: &str, peers: Option<&str>) -> Result<Report, ReportFileError> {
        let table = |file| move |source: RecordError| ReportFileError::Table { file, source };
        let mut records = from_csv(raw).map_err(table(RAW))?;
        if let Some(peers) = peers {
            records.extend(from_csv(peers).map_err(table(PEERS))?);
        }
        Ok(Report { records, manifest: serde_json::from_str(manifest)? })
    }

    /// Writes the report and its figures, each as SVG and PNG, into a directory; where the report is.
    ///
    /// # Errors
    ///
    /// A figure that cannot be drawn, or a file that cannot be written.
    pub fn save(&self, directory: &Path) -> Result<PathBuf, BenchError> {
        let path = directory.join(REPORT);
        write_file(&path, &self.markdown())?;
        for (name, figure) in self.figures() {
            for extension in ["svg", "png"] {
                write(figure.as_ref(), &directory.join(format!("{name}.{extension}")))?;
            }
        }
        Ok(path)
    }

    /// The whole report.
    pub fn markdown(&self) -> String {
        let sections = [
            self.head(),
            self.summary(),
            self.precision_section(),
            self.rivals_section(),
            self.sets_section(),
            self.costs_section(),
            self.checks_section(),
            self.throughput_section(),
            self.hard_section(),
            self.estimate_section(),
            self.trust_section(),
        ];
        sections.into_iter().filter(|section| !section.is_empty()).collect::<Vec<_>>().join("\n")
    }

    /// Names without extension, and figures.
    pub fn figures(&self) -> Vec<(String, Box<dyn Figure>)> {
        let mut all = self.precision_figures();
        all.extend(self.cost_figures());
        all.extend(self.trust_figures());
        all
    }

    fn head(&self) -> String {
        format!(
            "# Speed against error\n\n{} Where error is on the x axis, lower and further left is better.\n",
            self.machine()
        )
    }

    /// What ran where, and how quiet it was there.
    fn machine(&self) -> String {
        let word = |key: &str| self.manifest[key].as_str().unwrap_or("unknown").to_owned();
        let gpu = self.manifest["gpu"].as_str().map_or("no GPU".to_owned(), |gpu| format!("GPU: {gpu}"));
        let quick = if self.manifest["quick"] == true { " with `--quick`: few samples and steps" } else { "" };
        format!(
            "Measured on {} by `rodsweep bench` {} (commit {}){quick}, in {} s. {}, {} cores, {}, {}; {gpu}. {}",
            word("date"),
            word("version"),
            word("commit"),
            self.manifest["seconds"],
            word("processor"),
            self.manifest["cores"],
            self.sets().join(", "),
            word("system"),
            self.noise(),
        )
    }

    /// How steady the times are.
    fn noise(&self) -> String {
        let ours = self.records.iter().filter(|record| !record.is_peer());
        let timed: Vec<&Record> = ours.filter(|record| record.spread.is_finite()).collect();
        let noisy = timed.iter().filter(|record| record.spread > NOISY).count();
        let share = noisy as f64 / timed.len().max(1) as f64;
        let load = self.manifest["load_average"].as_f64().filter(|load| *load > OWN_LOAD);
        let others =
            load.map_or(String::new(), |load| format!(" It ended at a load average of {load}, much of it others'."));
        let quiet = share <= 0.1 && load.is_none();
        let verdict = if quiet { "Quiet enough" } else { "The machine was not quiet: trust ratios more than times" };
        format!(
            "{verdict}: in {noisy} of {} measurements the median of the repeats is more than {:.0} % above the least.{others}",
            timed.len(),
            100.0 * NOISY
        )
    }

    fn part<'a>(&'a self, part: &'a str) -> impl Iterator<Item = &'a Record> + Clone {
        self.records.iter().filter(move |record| record.part == part)
    }

    /// Measurements of a scene.
    fn points<'a>(&'a self, case: &'a str, work: &'a str) -> impl Iterator<Item = &'a Record> + Clone {
        self.part("precision").filter(move |record| record.case == case && record.work == work)
    }

    /// This program's, with the best instructions.
    fn ours<'a>(
        &'a self,
        case: &'a str,
        work: &'a str,
        precision: &'a str,
    ) -> impl Iterator<Item = &'a Record> + Clone {
        let best = self.best_set();
        self.points(case, work).filter(move |record| record.engine == best && record.precision == precision)
    }

    /// Instruction sets of the CPU, the best first.
    fn sets(&self) -> Vec<String> {
        let list = self.manifest["instruction_sets"].as_array().cloned().unwrap_or_default();
        list.iter().filter_map(|set| set.as_str().map(str::to_owned)).collect()
    }

    fn best_set(&self) -> String {
        self.sets().into_iter().next().unwrap_or_default()
    }

    fn steppers(&self) -> Vec<String> {
        let list = self.manifest["steppers"].as_array().cloned().unwrap_or_default();
        list.iter().filter_map(|stepper| stepper["name"].as_str().map(str::to_owned)).collect()
    }

    /// Name and title of each scene.
    fn scenes(&self) -> Vec<(String, String)> {
        let list = self.manifest["scenes"].as_array().cloned().unwrap_or_default();
        let word = |scene: &Value, key: &str| scene[key].as_str().unwrap_or_default().to_owned();
        list.iter().map(|scene| (word(scene, "name"), word(scene, "title"))).collect()
    }

    /// The scene that targets are stated for.
    fn first_scene(&self) -> String {
        self.scenes().into_iter().next().map(|(name, _)| name).unwrap_or_default()
    }
}

impl Record {
    /// Method, and steps or tolerance.
    fn settings(&self) -> String {
        match self.size {
            size if size.is_nan() => self.method.clone(),
            size if size < 1.0 => format!("{} to {size:.0e}", self.method),
            size => format!("{}, {size} steps", self.method),
        }
    }

    /// Whether it solved nearly all samples.
    fn is_sound(&self) -> bool {
        self.failed + self.elsewhere <= MOST_LOST * self.samples
    }

    fn is_literature(&self) -> bool {
        self.engine.starts_with("literature")
    }

    /// Measured by `benches/peers`.
    fn is_peer(&self) -> bool {
        self.part == "peers"
    }

    fn is_gpu(&self) -> bool {
        self.engine.starts_with("GPU")
    }
}

/// The fastest whose tips are, for 95 % of the samples, as near as asked.
fn fastest<'a>(records: impl Iterator<Item = &'a Record>, asked: f64) -> Option<&'a Record> {
    let meets = |record: &&Record| record.is_sound() && record.tip[1] <= asked;
    records.filter(meets).min_by(|a, b| a.seconds.total_cmp(&b.seconds))
}
