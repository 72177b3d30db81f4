//! `rodsweep bench`: speed against error on every engine of this machine. It measures into a table, `raw.csv`; report
//! and figures are made of that table, `manifest.json` and the table of peers beside it alone (`report/bench`), so that
//! `--render` can do it again.

mod clock;
mod device;
mod engines;
mod features;
mod files;
mod hard;
mod literature;
mod manifest;
mod map;
mod paper;
mod peak;
mod precision;
mod problem;
mod proof;
mod session;
mod throughput;

use super::args::{BenchArguments, BenchBackend};
use super::{BenchError, Exit, print, say};
use engines::Place;
use problem::Problem;
use crate::record::{Record, Report};
use rodsweep::report::{ReportError, write};
use rodsweep::sweep::BenchSpec;
use session::Session;
use std::path::{Path, PathBuf};

const RAW: &str = "raw.csv";
/// Written by `benches/peers/run`; a new measurement leaves it as it is.
const PEERS: &str = "peers.csv";
const MANIFEST: &str = "manifest.json";
const REPORT: &str = "report.md";

/// What can be measured beside the scenes.
const PARTS: [&str; 8] = ["peak", "reference", "features", "throughput", "device", "stages", "trust", "hard"];
/// Those that a GPU takes part in.
const ON_A_GPU: [&str; 2] = ["throughput", "device"];
/// Samples of a scene with `--quick`, and otherwise.
const FEW: usize = 64;
const MANY: usize = 256;

pub fn bench(arguments: &BenchArguments) -> Result<Exit, BenchError> {
    if arguments.paper {
        return paper::compare(arguments);
    }
    if let Some(directory) = &arguments.render {
        render(directory)?;
        return Ok(Exit::Done);
    }
    let specs = match &arguments.files {
        Some(directory) => files::read(directory)?,
        None => files::built_in()?,
    };
    let wants = Wants::new(arguments, &specs)?;
    let mut session = Session::new(arguments)?;
    let out = arguments.out.clone().unwrap_or_else(|| manifest::default_directory(&session));
    if out.join(RAW).exists() && !arguments.force {
        let remedy = format!("{} holds a report already; give another `--out`, or `--force`", out.display());
        return Err(BenchError::Usage(remedy));
    }
    measure(&specs, &wants, &mut session)?;
    create(&out)?;
    store(&out.join(RAW), &crate::record::to_csv(&session.records))?;
    store(&out.join(MANIFEST), &manifest::manifest(&session, &specs))?;
    render(&out)?;
    say(&format!("measured in {:.0} s", session.seconds()));
    Ok(Exit::Done)
}

/// What `--only` asks for: all where it names nothing.
struct Wants(Vec<String>);

impl Wants {
    fn new(arguments: &BenchArguments, specs: &[BenchSpec]) -> Result<Wants, BenchError> {
        let scenes = specs.iter().map(|spec| spec.name.as_str());
        let known: Vec<&str> = PARTS.into_iter().chain(scenes.clone()).collect();
        let only = &arguments.only;
        if only.is_empty() && arguments.backend == BenchBackend::Gpu {
            return Ok(Wants(ON_A_GPU.into_iter().chain(scenes).map(str::to_owned).collect()));
        }
        match only.iter().find(|name| !known.contains(&name.as_str())) {
            None => Ok(Wants(only.clone())),
            Some(name) => {
                Err(BenchError::Usage(format!("`--only {name}`: not known; use some of {}", known.join(", "))))
            }
        }
    }

    fn has(&self, name: &str) -> bool {
        self.0.is_empty() || self.names(name)
    }

    fn names(&self, name: &str) -> bool {
        self.0.iter().any(|other| other == name)
    }
}

fn measure(specs: &[BenchSpec], wants: &Wants, session: &mut Session) -> Result<(), BenchError> {
    if wants.has("peak") {
        peaks(session);
    }
    if wants.has("reference") {
        proof::closed_forms(session)?;
    }
    let most = if session.quick { FEW } else { MANY };
    for spec in specs {
        let (scene, first) = (wants.has(&spec.name), spec.name == specs[0].name);
        let throughput = first && wants.has("throughput");
        // In software it takes a minute to compile, and says little.
        let device = first && (wants.names("device") || wants.has("device") && session.has_hardware_gpu());
        if !(scene || throughput || device || wants.has("reference")) {
            continue;
        }
        session.say(&format!("{}: the reference", spec.title));
        let problem = Problem::new(spec, most)?;
        session.records.push(Record {
            size: problem.bend(),
            samples: problem.len() as f64,
            failed: problem.left_out as f64,
            ..Record::new("scene", spec.name.as_str())
        });
        if wants.has("reference") {
            proof::other_formulation(&problem, session)?;
        }
        if scene {
            session.say(&format!("{}: work against precision", spec.title));
            precision::measure(&problem, session)?;
            if spec.literature && session.has_cpu() {
                session.say(&format!("{}: the literature's methods", spec.title));
                literature::measure(&problem, session)?;
            }
        }
        if throughput {
            session.say("batches and threads");
            throughput::batches(&problem, session)?;
            if session.has_cpu() {
                throughput::threads(&problem, session)?;
            }
        }
        if device {
            session.say("the GPU by its own clock");
            device::measure(&problem, session)?;
        }
    }
    if wants.has("features") {
        session.say("features of a scene");
        features::measure(session)?;
    }
    if wants.has("stages") {
        session.say("the workspace map");
        map::stages(session)?;
    }
    if wants.has("trust") {
        session.say("what checks cost");
        map::trust(session)?;
    }
    if wants.has("hard") {
        session.say("hard cases");
        hard::measure(session);
    }
    Ok(())
}

fn peaks(session: &mut Session) {
    for engine in session.engines.clone() {
        let Place::Cpu(set) = engine.place else { continue };
        if let Some(operations) = session.one_thread.install(|| peak::peak(set, engine.precision)) {
            session.records.push(Record {
                engine: engine.name().into(),
                precision: engine.precision.to_string(),
                operations,
                seconds: 1.0,
                ..Record::new("peak", "fused multiply-adds")
            });
        }
    }
}

/// Writes report and figures from what a directory holds.
fn render(directory: &Path) -> Result<(), BenchError> {
    let read = |name: &str| -> Result<String, BenchError> {
        let path = directory.join(name);
        let refused = |error| BenchError::Usage(format!("{}: {error}; give a directory of `bench`", path.display()));
        std::fs::read_to_string(&path).map_err(refused)
    };
    let refused = |problem| BenchError::Usage(format!("{}: {problem}", directory.display()));
    let peers = if directory.join(PEERS).exists() { Some(read(PEERS)?) } else { None };
    let report = Report::read(&read(RAW)?, &read(MANIFEST)?, peers.as_deref()).map_err(refused)?;
    store(&directory.join(REPORT), &report.markdown())?;
    for (name, figure) in report.figures() {
        for extension in ["svg", "png"] {
            write(figure.as_ref(), &directory.join(format!("{name}.{extension}")))?;
        }
    }
    print(&report.readme())?;
    say(&format!("written: {}", directory.join(REPORT).display()));
    Ok(())
}

fn create(directory: &Path) -> Result<(), BenchError> {
    std::fs::create_dir_all(directory).map_err(|source| failed(directory.to_owned(), source))
}

fn store(path: &Path, text: &str) -> Result<(), BenchError> {
    std::fs::write(path, text).map_err(|source| failed(path.to_owned(), source))
}

fn failed(path: PathBuf, source: std::io::Error) -> BenchError {
    BenchError::Report(ReportError::Write { path, source })
}
