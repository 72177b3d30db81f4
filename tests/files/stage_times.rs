//! Processor time of the stages of a run: all that they have done, and nothing twice.

use crate::arc::{options, small};
use crate::common::runs::{manifest_of, run_into};
use rodsweep::backend::{Backend, Precision};
use rodsweep::clock::{Busy, process_time, thread_time};
use rodsweep::cpu::Cpu;
use rodsweep::engines::cpu_f64;
use rodsweep::model::{BLOCK, Plan, PlanOptions};
use rodsweep::reference::Reference;
use rodsweep::results::Timings;
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::RunOptions;
use std::time::Duration;

fn stages(times: &Timings) -> [(&'static str, f64); 7] {
    [
        ("build", times.build),
        ("solve", times.solve),
        ("refine", times.refine),
        ("search", times.search),
        ("rows", times.rows),
        ("write", times.write),
        ("check", times.check),
    ]
}

#[test]
fn stages_of_a_run_take_no_more_than_the_process() {
    let Some(before) = process_time() else { return };
    // More than so few steps can give, so that there are second attempts.
    let spec = SweepSpec { tolerance: 1e-12, ..small("parquet") };
    let plan = spec.plan(PlanOptions { steps: 2, ..PlanOptions::default() }).expect("a plan");
    let mut engine = Cpu::new(&plan, Precision::F64).expect("an engine");
    let trusted = |plan: &Plan| Ok(Box::new(Reference::new(plan)) as Box<dyn Backend>);
    let options = RunOptions { trusted: Some(&trusted), refiners: vec![&cpu_f64], ..options() };
    let dir = tempfile::tempdir().expect("a folder");
    let summary = run_into(dir.path(), &spec, &mut engine, &options).expect("a run");
    assert!(summary.attempts > 0 && summary.spot_check.is_some(), "{summary:?}");
    let times = summary.processor.expect("a system that tells");
    for (name, seconds) in stages(&times) {
        assert_eq!(seconds > 0.0, name != "search", "{name}: {times:?}");
    }
    let sum: f64 = stages(&times).iter().map(|(_, seconds)| seconds).sum();
    let process = process_time().unwrap_or_default() - before;
    assert!(sum <= times.total && times.total <= process.as_secs_f64(), "{sum} of {process:?}: {times:?}");
    let manifest = manifest_of(dir.path());
    assert_eq!(manifest["timings"]["processor"], serde_json::to_value(times).expect("JSON"));
    assert!(manifest["timings"]["solve"].is_number() && manifest["timings"]["total"].is_number(), "{manifest}");
}

/// More was counted than the calling thread has done.
#[test]
fn work_of_other_threads_counts_where_it_was_begun() {
    if thread_time().is_none() {
        return;
    }
    let spec = small("parquet");
    let (plan, sampler) = (spec.plan(PlanOptions::default()).expect("a plan"), spec.sampler());
    let batch = || plan.batch(4 * BLOCK, |at, row| sampler.values(at as u64, row));
    let solved = batch();
    let mut engines: [Box<dyn Backend>; 2] =
        [Box::new(Cpu::new(&plan, Precision::F64).expect("an engine")), Box::new(Reference::new(&plan))];
    let [lanes, reference] = &mut engines;
    let mut works: [(&str, &mut dyn FnMut()); 3] = [
        ("batch", &mut || drop(batch())),
        ("lanes", &mut || drop(lanes.solve(&solved).expect("solutions"))),
        ("reference", &mut || drop(reference.solve(&solved).expect("solutions"))),
    ];
    for (name, work) in &mut works {
        let busy = Busy::new();
        let before = thread_time();
        let counting = busy.enter();
        work();
        drop(counting);
        let own = thread_time().zip(before).map_or(Duration::MAX, |(after, before)| after - before);
        assert!(busy.seconds() > Some(own.as_secs_f64()), "{name}: {busy:?}, of these {own:?} by the caller");
    }
}
