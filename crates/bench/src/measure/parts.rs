//! Part by part: the scenes, and what is measured beside them.

use super::engines::Place;
use super::options::Selection;
use super::problem::Problem;
use super::session::Session;
use super::{device, features, hard, literature, map, peak, precision, proof, throughput};
use crate::bench_file::BenchSpec;
use crate::error::BenchError;
use crate::record::Record;
use std::time::Instant;

/// Samples of a scene in a quick measurement, and otherwise.
const FEW: usize = 64;
const MANY: usize = 256;

/// Measures the parts that are selected.
pub fn measure_parts(
    specs: &[BenchSpec],
    selection: &Selection,
    session: &mut Session,
    progress: &mut dyn FnMut(&str),
) -> Result<(), BenchError> {
    let begin = Instant::now();
    let mut say = |what: &str| progress(&format!("{:6.1} s  {what}", begin.elapsed().as_secs_f64()));
    if selection.has("peak") {
        peaks(session);
    }
    if selection.has("reference") {
        proof::closed_forms(session)?;
    }
    let most = if session.quick { FEW } else { MANY };
    for spec in specs {
        let (scene, first) = (selection.has(&spec.name), spec.name == specs[0].name);
        let throughput = first && selection.has("throughput");
        // In software it takes a minute to compile, and says little.
        let device = first && (selection.names("device") || selection.has("device") && session.has_hardware_gpu());
        if !(scene || throughput || device || selection.has("reference")) {
            continue;
        }
        say(&format!("{}: the reference", spec.title));
        let problem = Problem::new(spec, most)?;
        session.records.push(Record {
            size: problem.bend(),
            samples: problem.len() as f64,
            failed: problem.left_out as f64,
            ..Record::new("scene", spec.name.as_str())
        });
        if selection.has("reference") {
            proof::other_formulation(&problem, session)?;
        }
        if scene {
            say(&format!("{}: work against precision", spec.title));
            precision::measure(&problem, session)?;
            if spec.literature && session.has_cpu() {
                say(&format!("{}: the literature's methods", spec.title));
                literature::measure(&problem, session)?;
            }
        }
        if throughput {
            say("batches and threads");
            throughput::batches(&problem, session)?;
            if session.has_cpu() {
                throughput::threads(&problem, session)?;
            }
        }
        if device {
            say("the GPU by its own clock");
            device::measure(&problem, session)?;
        }
    }
    if selection.has("features") {
        say("features of a scene");
        features::measure(session)?;
    }
    if selection.has("stages") {
        say("the workspace map");
        map::stages(session)?;
    }
    if selection.has("trust") {
        say("what checks cost");
        map::trust(session)?;
    }
    if selection.has("hard") {
        say("hard cases");
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
