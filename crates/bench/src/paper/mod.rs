//! The paper's method and those it was compared with, beside this library's CPU engine, all at a stated accuracy.
//!
//! ```no_run
//! use rodsweep_bench::paper::{PaperOptions, built_in_scene, compare};
//!
//! let comparison = compare(&built_in_scene()?, "P6", &PaperOptions::new().samples(10).repeats(1))?;
//! println!("{}", comparison.text());
//! # Ok::<(), rodsweep_bench::BenchError>(())
//! ```

mod cases;
mod continued;
mod measure;
mod methods;
mod rows;
mod settings;
mod text;

use crate::error::BenchError;
use crate::files::{create_directory, write_file};
use crate::machine;
use cases::Cases;
use rodsweep::cpu::InstructionSet;
use rodsweep::input::parse_scene;
use rodsweep::model::Scene;
use rodsweep::shipped::P6;
use rows::Row;
use std::path::{Path, PathBuf};

/// How much is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaperOptions {
    samples: usize,
    repeats: usize,
    seed: u64,
}

impl PaperOptions {
    /// 100 configurations, five repeats.
    pub fn new() -> PaperOptions {
        PaperOptions { samples: 100, repeats: 5, seed: 1 }
    }

    /// Random configurations.
    pub fn samples(self, samples: usize) -> PaperOptions {
        PaperOptions { samples, ..self }
    }

    /// How often each is timed.
    pub fn repeats(self, repeats: usize) -> PaperOptions {
        PaperOptions { repeats, ..self }
    }

    /// Seed of the configurations.
    pub fn seed(self, seed: u64) -> PaperOptions {
        PaperOptions { seed, ..self }
    }
}

impl Default for PaperOptions {
    fn default() -> Self {
        PaperOptions::new()
    }
}

/// What was measured, and where.
pub struct Comparison {
    scene: String,
    cases: Cases,
    rows: Vec<Row>,
    options: PaperOptions,
    machine: Vec<String>,
}

/// The catheter whose moduli and windings are known.
///
/// # Errors
///
/// None, as the scene is built in and reads.
pub fn built_in_scene() -> Result<Scene, BenchError> {
    let (name, text) = P6;
    Ok(parse_scene(Path::new(name), text)?)
}

/// Compares all methods on random currents of a scene, on one thread; errors call the scene `name`.
///
/// # Errors
///
/// A scene that the literature's methods do not model, that has no coil, or without any stable equilibrium.
pub fn compare(scene: &Scene, name: &str, options: &PaperOptions) -> Result<Comparison, BenchError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let (cases, rows) = pool.install(|| -> Result<_, BenchError> {
        let cases = cases::draw(scene, name, options.samples, options.seed)?;
        let rows = measure::measure(&cases, options.repeats)?;
        Ok((cases, rows))
    })?;
    Ok(Comparison { scene: scene.name.clone(), cases, rows, options: *options, machine: machine_lines() })
}

impl Comparison {
    /// Writes `paper.csv` and `paper.md` into a directory.
    ///
    /// # Errors
    ///
    /// What cannot be written.
    pub fn save(&self, directory: &Path) -> Result<[PathBuf; 2], BenchError> {
        create_directory(directory)?;
        let paths = ["paper.csv", "paper.md"].map(|name| directory.join(name));
        write_file(&paths[0], &self.csv())?;
        write_file(&paths[1], &self.markdown())?;
        Ok(paths)
    }
}

/// What ran, for the record.
fn machine_lines() -> Vec<String> {
    let commit = rodsweep::commit().map_or("commit unknown".into(), |commit| format!("commit {commit}"));
    let (processor, cores) = (machine::processor(), machine::cores());
    let set = InstructionSet::available()[0].name();
    vec![
        format!("rodsweep {} ({commit})", rodsweep::VERSION),
        format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        format!("{}, {cores} cores, {set}; one thread is used", processor.as_deref().unwrap_or("processor unknown")),
    ]
}
