//! `rodsweep bench --paper`: the paper's method and those it was compared with,
//! beside this program's CPU engine, all at a stated accuracy.

mod cases;
mod continued;
mod measure;
mod methods;
mod show;

use crate::cli::args::BenchArguments;
use crate::cli::{BenchError, Exit, print, say};
use cases::{Cases, draw};
use measure::{Row, measure};
use rodsweep::report::ReportError;
use rodsweep::sweep::{parse_scene, read_scene};
use std::path::{Path, PathBuf};

/// The prototype whose moduli and windings are known.
const SCENE: &str = include_str!("../../../../sweeps/scenes/p6.toml");
/// 95 % of the tips are this near to the reference's, over the length.
const TOLERANCE: f64 = 1e-6;
/// The same for the chain of links, which does not get there: its matrix grows with the square of the links.
const CHAIN_TOLERANCES: [f64; 2] = [1e-3, 1e-4];
/// Samples of a batch of the engine.
const BATCH: usize = 4096;

/// Configurations of a call where several are continued: the points that `rodsweep control` solves together.
const TOGETHER: usize = 8;

/// What was measured, and where.
struct Comparison {
    scene: String,
    cases: Cases,
    rows: Vec<Row>,
    samples: usize,
    repeats: usize,
    seed: u64,
    machine: Vec<String>,
}

pub fn compare(arguments: &BenchArguments) -> Result<Exit, BenchError> {
    let scene = match &arguments.scene {
        Some(file) => read_scene(file)?,
        None => parse_scene(Path::new("p6.toml"), SCENE)?,
    };
    let file = arguments.scene.as_ref().map_or("the built-in scene".into(), |file| file.display().to_string());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.map_err(|error| BenchError::Usage(format!("no thread to time on: {error}")))?;
    let (cases, rows) = pool.install(|| -> Result<_, BenchError> {
        let cases = draw(&scene, &file, arguments.samples, arguments.seed)?;
        let rows = measure(&cases, arguments.repeats)?;
        Ok((cases, rows))
    })?;
    let comparison = Comparison {
        scene: scene.name.clone(),
        cases,
        rows,
        samples: arguments.samples,
        repeats: arguments.repeats,
        seed: arguments.seed,
        machine: machine(),
    };
    if let Some(directory) = &arguments.out {
        let write = |name: &str, text: String| -> Result<(), BenchError> {
            let failed = |path: PathBuf, source| BenchError::Report(ReportError::Write { path, source });
            std::fs::create_dir_all(directory).map_err(|source| failed(directory.clone(), source))?;
            let path = directory.join(name);
            std::fs::write(&path, text).map_err(|source| failed(path.clone(), source))?;
            say(&format!("written: {}", path.display()));
            Ok(())
        };
        write("paper.csv", show::csv(&comparison))?;
        write("paper.md", show::markdown(&comparison))?;
    }
    print(&if arguments.json { show::json_text(&comparison) } else { show::text(&comparison) })?;
    Ok(Exit::Done)
}

/// What ran, for the record.
fn machine() -> Vec<String> {
    let commit = option_env!("RODSWEEP_COMMIT").map_or("commit unknown".into(), |commit| format!("commit {commit}"));
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpuinfo.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split(": ").nth(1));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let set = rodsweep::lanes::InstructionSet::available()[0].name();
    vec![
        format!("rodsweep {} ({commit})", env!("CARGO_PKG_VERSION")),
        format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        format!("{}, {cores} cores, {set}; one thread is used", model.unwrap_or("processor unknown")),
    ]
}
