//! The hard cases on every engine.

use super::session::Session;
use crate::hard::{Case, Outcome, Setup, Verdict, cases};
use crate::record::Record;
use rodsweep::backend::{BackendError, BackendKind};

/// One case in so many where it is to be quick.
const QUICK: usize = 6;

pub fn measure(session: &mut Session) {
    let every = if session.quick { QUICK } else { 1 };
    let cases: Vec<Case> = cases().into_iter().step_by(every).collect();
    let answers: Vec<_> = cases.iter().map(Case::answer).collect();
    let mut setups = vec![Setup::REFERENCE, Setup::CPU_F64, Setup::CPU_F32];
    match &session.adapter {
        Some(adapter) if adapter.is_software() => session.note(
            "hard cases on the GPU in software: left out, for each compiles a kernel; `rodsweep verify --hard` has them"
                .into(),
        ),
        Some(adapter) => {
            setups.push(Setup::GPU_F32);
            setups.extend(adapter.has_f64.then_some(Setup::GPU_F64));
        }
        None => {}
    }
    for setup in setups {
        for (case, answer) in cases.iter().zip(&answers) {
            match setup.solve(case, answer, |plan| setup.engine().make(plan)) {
                Ok(outcome) => session.records.push(record(case, &setup, &outcome)),
                Err(BackendError::Unsupported { what, .. }) => {
                    session.note(format!("{}, {}: not modelled: {what}", setup.name(), case.name()));
                }
                Err(error) => session.note(format!("{}, {}: {error}", setup.name(), case.name())),
            }
        }
    }
}

fn record(case: &Case, setup: &Setup, outcome: &Outcome) -> Record {
    let (verdict, why) = match outcome.verdict {
        Verdict::Ok => ("ok", ""),
        Verdict::NoAnswer(why) => ("no answer", why),
        Verdict::GaveUp(why) => ("gave up", why.unwrap_or("not known before")),
        Verdict::Wrong => ("WRONG", ""),
    };
    let number = |x: f64| if outcome.status.is_success() { x } else { f64::NAN };
    Record {
        work: verdict.into(),
        engine: match setup.kind {
            BackendKind::Reference => "reference".into(),
            kind => kind.to_string(),
        },
        precision: setup.precision.to_string(),
        method: why.into(),
        status: outcome.status.name().into(),
        size: outcome.steps.map_or(f64::NAN, |steps| steps as f64),
        tip: [number(outcome.error); 3],
        estimate: number(outcome.estimate),
        seconds: outcome.seconds,
        passes: outcome.iterations,
        ..Record::new("hard", case.name())
    }
}
