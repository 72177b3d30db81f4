//! The methods in comparison, each at the resolution that its accuracy asks for.

use super::cases::{Case, Cases, batch, jacobian};
use super::rows::p95;
use super::settings::{CHAIN_TOLERANCES, TOLERANCE};
use crate::baseline::{Chain, Differences, Method, Paper, Rod, Scheme, from_rest};
use crate::error::BenchError;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{PlanOptions, Stepper};
use rodsweep::sweep::STEPS;

/// Resolutions that are tried, of the fixed steps and of the chain's joints.
const RK4_STEPS: [usize; 16] = [8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 1536];
const JOINTS: [usize; 13] = [4, 6, 8, 12, 16, 24, 32, 48, 64, 80, 96, 112, 128];
/// The finer chain is measured on one configuration in so many.
const FEW: usize = 10;

/// A baseline at its resolution.
pub struct Baseline {
    pub name: String,
    /// What 95 % of the tip errors are to stay below.
    pub tolerance: f64,
    pub resolution: String,
    pub method: Box<dyn Method>,
    /// Measured on every so many-th configuration.
    pub every: usize,
    /// Published times of one Jacobian and of one step of control (s).
    pub published: [Option<f64>; 2],
}

pub const PAPER: &str = "paper's 9-number form";
/// Integration step of the solver that the paper's group has published (m)
const PUBLISHED_STEP: f64 = 0.2e-3;

/// The first resolution whose tips meet the tolerance, or the last.
fn choose<M>(cases: &[&Case], length: f64, sizes: &[usize], tolerance: f64, make: M) -> usize
where
    M: Fn(&Rod, usize) -> Box<dyn Method>,
{
    let error = |case: &Case, size: usize| {
        let method = make(&case.rod, size);
        let Ok(unknowns) = from_rest(&*method, &case.rod) else { return f64::INFINITY };
        let p = method.tip(&case.rod, &unknowns).p;
        (0..3).map(|k| (p[k] - case.truth.tip.p[k]).powi(2)).sum::<f64>().sqrt() / length
    };
    let meets = |size: &&usize| {
        let mut errors: Vec<f64> = cases.iter().map(|case| error(case, **size)).collect();
        p95(&mut errors) <= tolerance
    };
    sizes.iter().find(meets).or(sizes.last()).copied().unwrap_or(1)
}

pub fn baselines(cases: &Cases) -> Vec<Baseline> {
    let all: Vec<&Case> = cases.list.iter().collect();
    let few: Vec<&Case> = cases.list.iter().step_by(FEW).collect();
    let rod = &cases.list[0].rod;
    let chain = |rod: &Rod, joints: usize| -> Box<dyn Method> { Box::new(Chain::new(rod, joints)) };
    let steps = choose(&all, cases.length, &RK4_STEPS, TOLERANCE, |rod, steps| Box::new(Paper::new(rod, steps)));
    let mut found: Vec<Baseline> = Vec::new();
    for (tolerance, every, published) in
        [(CHAIN_TOLERANCES[0], 1, [None, Some(95e-3)]), (CHAIN_TOLERANCES[1], FEW, [None, None])]
    {
        let joints = choose(if every == 1 { &all } else { &few }, cases.length, &JOINTS, tolerance, chain);
        let chain = Chain::new(rod, joints);
        found.push(Baseline {
            name: format!("chain of links, to {tolerance:.0e}"),
            tolerance,
            resolution: format!("{} links", chain.link_count()),
            method: Box::new(chain),
            every,
            published,
        });
    }
    let resolution = format!("RK4, {steps} steps");
    for (name, scheme, published) in [
        ("finite differences, forward", Scheme::Forward, [Some(5.5e-3), None]),
        ("finite differences, central", Scheme::Central, [None, None]),
        ("finite differences of one pass", Scheme::Integrations, [None, None]),
    ] {
        let method = Box::new(Differences::new(rod, steps, scheme));
        found.push(Baseline {
            name: name.into(),
            tolerance: TOLERANCE,
            resolution: resolution.clone(),
            method,
            every: 1,
            published,
        });
    }
    let method = Box::new(Paper::new(rod, steps));
    let published = [Some(2.0e-3), Some(4.1e-3)];
    found.push(Baseline { name: PAPER.into(), tolerance: TOLERANCE, resolution, method, every: 1, published });
    let flexible = cases.plan.scene.rod().segments.into_iter().filter(|segment| segment.is_flexible());
    let many = (flexible.map(|segment| segment.length()).sum::<f64>() / PUBLISHED_STEP).ceil() as usize;
    found.push(Baseline {
        name: "paper's form, 0.2 mm steps".into(),
        tolerance: TOLERANCE,
        resolution: format!("RK4, {many} steps"),
        method: Box::new(Paper::new(rod, many)),
        every: 1,
        published: [None, None],
    });
    found
}

/// The CPU engine in the settings with the fewest stages that meet the tolerance.
pub fn engine(cases: &Cases) -> Result<Cpu, BenchError> {
    let rows: Vec<Vec<f64>> = cases.list.iter().map(|case| case.values.clone()).collect();
    let batch = batch(&cases.plan, &rows);
    let all = Stepper::ALL.into_iter().flat_map(|stepper| STEPS.map(|steps| (stepper, steps)));
    let mut all: Vec<(Stepper, usize)> = all.filter(|(stepper, _)| stepper.order() > 4).collect();
    all.sort_by_key(|(stepper, steps)| stepper.stage_count() * steps);
    let mut engine = Cpu::new(&cases.plan, Precision::F64)?;
    for (stepper, steps) in all {
        let options = PlanOptions { tolerance: TOLERANCE, stepper, steps, ..cases.plan.options };
        engine = Cpu::new(&cases.plan.with_options(options), Precision::F64)?;
        let solutions = engine.solve(&batch)?;
        let error = |(sample, case): (usize, &Case)| {
            let found = jacobian(&solutions, sample, cases.inputs.len());
            cases.errors(case, &found)[0]
        };
        let mut errors: Vec<f64> = cases.list.iter().enumerate().map(error).collect();
        if p95(&mut errors) <= TOLERANCE {
            break;
        }
    }
    Ok(engine)
}
