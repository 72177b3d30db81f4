//! The literature's methods on the same samples, in plain scalar f64, one rod at a time.

use super::clock::Clock;
use super::problem::{Judged, Problem};
use super::session::Session;
use crate::baseline::{
    Adaptive, BaselineError, Column, Differences, Input, Jacobian, Method, NewtonStep, Paper, Rod, Scheme, Tip,
    from_rest, solve,
};
use crate::bench_file::Work;
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::model::PlanOptions;
use std::cell::Cell;

/// Samples that they are measured on: they take long.
const SAMPLES: usize = 24;
const STEPS: [usize; 9] = [8, 12, 16, 24, 32, 64, 128, 256, 512];
/// Finer ones do not help differences, whose own error remains.
const DIFFERENCE_STEPS: [usize; 4] = [16, 24, 32, 64];
/// What the adaptive crate is asked for, of a step.
const TOLERANCES: [f64; 7] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10, 1e-12];

/// A method at one of its settings.
struct Contender {
    name: &'static str,
    stepper: &'static str,
    /// Steps over the rod, or a tolerance.
    size: f64,
    method: Box<dyn Method>,
}

/// Counts passes: steps of Newton's method, tips and Jacobians.
struct Counted<'a> {
    method: &'a dyn Method,
    passes: Cell<u64>,
}

impl Counted<'_> {
    fn count(&self) {
        self.passes.set(self.passes.get() + 1);
    }
}

impl Method for Counted<'_> {
    fn rest(&self, rod: &Rod) -> Vec<f64> {
        self.method.rest(rod)
    }

    fn newton_step(&self, rod: &Rod, unknowns: &[f64]) -> Option<NewtonStep> {
        self.count();
        self.method.newton_step(rod, unknowns)
    }

    fn tip(&self, rod: &Rod, unknowns: &[f64]) -> Tip {
        self.count();
        self.method.tip(rod, unknowns)
    }

    fn jacobian(&self, rod: &Rod, unknowns: &[f64], inputs: &[Input]) -> Option<Jacobian> {
        self.count();
        self.method.jacobian(rod, unknowns, inputs)
    }
}

/// Rods with starts for all of them.
struct Rods {
    /// Sample of each.
    samples: Vec<usize>,
    here: Vec<Rod>,
    near: Vec<Rod>,
    inputs: Vec<Input>,
}

/// Measures one scene, if the methods model it.
pub fn measure(problem: &Problem, session: &mut Session) -> Result<(), BenchError> {
    // They have no anchors, and a base moment that is given is used for derivatives.
    let works = problem.spec.work.iter().copied().filter(|work| *work != Work::Sweep);
    for work in works {
        let rods = match rods(problem, work) {
            Ok(rods) => rods,
            Err(reason) => {
                session.note(format!("the literature's methods, {}: {reason}", problem.spec.name));
                return Ok(());
            }
        };
        for contender in contenders(&rods.here[0], work, session.quick) {
            point(problem, work, &contender, &rods, session)?;
        }
    }
    Ok(())
}

/// Every method at growing accuracy; every second setting where it is to be quick.
fn contenders(rod: &Rod, work: Work, quick: bool) -> Vec<Contender> {
    let every = if quick { 2 } else { 1 };
    let mut all = Vec::new();
    for steps in STEPS.into_iter().skip(every - 1).step_by(every) {
        let (name, method) = ("literature: paper's form", Box::new(Paper::new(rod, steps)));
        all.push(Contender { name, stepper: "rk4", size: steps as f64, method });
    }
    if work == Work::Cold {
        for steps in DIFFERENCE_STEPS.into_iter().step_by(every) {
            let (name, method) =
                ("literature: finite differences", Box::new(Differences::new(rod, steps, Scheme::Forward)));
            all.push(Contender { name, stepper: "rk4", size: steps as f64, method });
        }
    }
    for tolerance in TOLERANCES.into_iter().step_by(every) {
        let (name, method) = ("literature: ode_solvers", Box::new(Adaptive::new(tolerance)));
        all.push(Contender { name, stepper: "dop853", size: tolerance, method });
    }
    all
}

fn rods(problem: &Problem, work: Work) -> Result<Rods, String> {
    let plan = problem.plan(Work::Cold, PlanOptions::default()).map_err(|error| error.to_string())?;
    let samples: Vec<usize> = (0..problem.len()).step_by(problem.len().div_ceil(SAMPLES)).collect();
    let rods = |rows: &[Vec<f64>]| -> Result<Vec<Rod>, _> {
        samples.iter().map(|sample| Rod::new(&plan.sample_scene(&rows[*sample]))).collect()
    };
    let inputs: Result<Vec<Input>, _> =
        problem.wrt(work).iter().map(|parameter| Input::new(*parameter, &plan.scene)).collect();
    let text = |error: BaselineError| error.to_string();
    let (here, near) = (rods(&problem.rows).map_err(text)?, rods(&problem.near).map_err(text)?);
    Ok(Rods { samples, here, near, inputs: inputs.map_err(text)? })
}

fn point(
    problem: &Problem,
    work: Work,
    contender: &Contender,
    rods: &Rods,
    session: &mut Session,
) -> Result<(), BenchError> {
    let method = &Counted { method: contender.method.as_ref(), passes: Cell::new(0) };
    let solved =
        |rods: &[Rod]| -> Vec<Option<Vec<f64>>> { rods.iter().map(|rod| from_rest(method, rod).ok()).collect() };
    let known = match work {
        Work::Given => solved(&rods.here),
        Work::Warm => solved(&rods.near),
        Work::Tip | Work::Cold | Work::Sweep => vec![None; rods.here.len()],
    };
    let one = |(rod, known): (&Rod, &Option<Vec<f64>>)| -> Option<Jacobian> {
        let unknowns = match work {
            Work::Given => known.clone()?,
            Work::Warm => solve(method, rod, known.as_ref()?)?,
            Work::Tip | Work::Cold | Work::Sweep => from_rest(method, rod).ok()?,
        };
        method.jacobian(rod, &unknowns, &rods.inputs)
    };
    let all = || rods.here.iter().zip(&known).map(one).collect::<Vec<_>>();
    method.passes.set(0);
    let found = all();
    let passes = method.passes.get();
    let timing = Clock::Processor.time(session.effort, all);
    let mut judged = Judged::default();
    for (found, sample) in found.into_iter().zip(&rods.samples) {
        let Some(Jacobian { tip, columns }) = found else {
            judged.failed += 1;
            continue;
        };
        let length = problem.length(*sample);
        let column = |column: &Column| {
            let [a, b, c] = column.dp.map(|x| x / length);
            [a, b, c, column.w[0], column.w[1], column.w[2]]
        };
        let columns: Vec<[f64; 6]> = columns.iter().map(column).collect();
        problem.add(work, *sample, tip.p, &columns, &mut judged);
    }
    let count = rods.here.len() as f64;
    let mut record = Record {
        work: work.name().into(),
        engine: contender.name.into(),
        precision: "f64".into(),
        method: contender.stepper.into(),
        size: contender.size,
        seconds: timing.median / count,
        least: timing.least / count,
        spread: timing.spread(),
        ..Record::new("precision", problem.spec.name.as_str())
    };
    judged.write(&mut record);
    record.passes = passes as f64 / count;
    session.records.push(record);
    Ok(())
}
