//! Speed against error on every engine of this machine, into a flat table of records.
//!
//! ```no_run
//! use rodsweep_bench::measure::{Benchmark, MeasureOptions, built_in};
//! use std::path::Path;
//!
//! let options = MeasureOptions::new().quick(true).only(["easy", "peak"]);
//! let measured = Benchmark::new(built_in()?, &options)?.measure(&mut |line| eprintln!("{line}"))?;
//! measured.save(Path::new("report"))?;
//! # Ok::<(), rodsweep_bench::BenchError>(())
//! ```

mod clock;
mod device;
mod engines;
mod features;
mod files;
mod hard;
mod literature;
mod manifest;
mod map;
mod options;
mod parts;
mod peak;
mod precision;
mod problem;
mod proof;
mod session;
mod throughput;

pub use files::{built_in, read_directory};
pub use options::{Engines, MeasureOptions};

use crate::bench_file::BenchSpec;
use crate::error::BenchError;
use crate::files::{MANIFEST, RAW, create_directory, write_file};
use crate::record::{Record, to_csv};
use options::Selection;
use session::Session;
use std::path::{Path, PathBuf};

/// A measurement that is about to begin.
pub struct Benchmark {
    specs: Vec<BenchSpec>,
    selection: Selection,
    session: Session,
}

/// What was measured, and where.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Measured {
    /// One row a measurement.
    pub records: Vec<Record>,
    /// What ran on which machine, as JSON.
    pub manifest: String,
    /// How long it took (s).
    pub seconds: f64,
}

impl Benchmark {
    /// Prepares the engines for the scenes of some bench files.
    ///
    /// # Errors
    ///
    /// A name that is not known, or no engine to measure.
    pub fn new(specs: Vec<BenchSpec>, options: &MeasureOptions) -> Result<Benchmark, BenchError> {
        let selection = Selection::new(options, &specs)?;
        Ok(Benchmark { specs, selection, session: Session::new(options)? })
    }

    /// Where the report belongs by default: `sweeps/reports/`, the date, and what the machine has.
    pub fn default_directory(&self) -> PathBuf {
        manifest::default_directory(&self.session)
    }

    /// Measures; `progress` is told what is under way.
    ///
    /// # Errors
    ///
    /// A scene without answers, or an engine that breaks down where it should not.
    pub fn measure(self, progress: &mut dyn FnMut(&str)) -> Result<Measured, BenchError> {
        let Benchmark { specs, selection, mut session } = self;
        parts::measure_parts(&specs, &selection, &mut session, progress)?;
        let manifest = manifest::manifest(&session, &specs);
        Ok(Measured { manifest, seconds: session.seconds(), records: session.records })
    }
}

impl Measured {
    /// Writes the table and the manifest into a directory, for [`Report::open`](crate::report::Report::open).
    ///
    /// # Errors
    ///
    /// What cannot be written.
    pub fn save(&self, directory: &Path) -> Result<(), BenchError> {
        create_directory(directory)?;
        write_file(&directory.join(RAW), &to_csv(&self.records))?;
        write_file(&directory.join(MANIFEST), &self.manifest)
    }
}
