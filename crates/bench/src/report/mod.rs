//! Speed against error: report and figures out of what was measured, `raw.csv` and `manifest.json`, of `peers.csv` where
//! there is one, and of nothing else: the same files give the same report anywhere.

mod costs;
mod figures;
mod hard;
mod head;
mod measured;
mod precision;
mod rivals;
mod summary;
mod text;
mod trust;

pub use measured::Report;

use crate::error::{BenchError, ReportFileError};
use crate::files::{MANIFEST, PEERS, RAW, REPORT, read_file, write_file};
use crate::record::{RecordError, from_csv};
use rodsweep::draw::{Figure, write};
use std::path::{Path, PathBuf};

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
}
