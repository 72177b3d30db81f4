//! How far the reference can be believed: closed forms, and another formulation with another integrator.

use super::problem::{Problem, shares};
use super::session::Session;
use crate::bench_file::Work;
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::input::parse_scene;
use rodsweep::model::{PlanOptions, Scene, Stepper, Vector};
use rodsweep::reference::solve_rod;
use std::path::Path;

const LENGTH: f64 = 0.2;
const EI: f64 = 6e-5;
/// Steps of the CPU engine in f64 that do not show, over the rod.
const FINE: [usize; 2] = [48, 96];

fn scene(loads: &str, rest_curvature: Vector) -> Result<Scene, BenchError> {
    let text = format!(
        "name = \"closed form\"\n[loads]\n{loads}\n[[segment]]\nname = \"rod\"\nkind = \"flexible\"\nlength = {LENGTH}\n\
         stiffness = {{ bending = {EI}, torsion = 3e-5 }}\nrest_curvature = {rest_curvature:?}\n"
    );
    Ok(parse_scene(Path::new("closed form"), &text)?)
}

/// Tip of a rod of constant curvature u in its body frame: a helix about u.
fn helix(u: Vector) -> Vector {
    let size = u.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (angle, axis) = (size * LENGTH, u.map(|x| x / size));
    let (sine, cosine) = angle.sin_cos();
    // The integral of the rotated tangent e3 (Rodrigues).
    let side = [axis[1], -axis[0], 0.0];
    std::array::from_fn(|k| {
        let tangent = if k == 2 { 1.0 } else { 0.0 };
        (sine * tangent + (1.0 - cosine) * side[k] + (angle - sine) * axis[2] * axis[k]) / size
    })
}

/// By how much EI/2 k² + f . t differs at the ends of an elastica pulled across at its tip, where k is 0; over the force.
fn first_integral(force: f64) -> Result<f64, BenchError> {
    let found = solve_rod(&scene(&format!("tip_force = [{force}, 0, 0]"), [0.0; 3])?.rod(), &[]);
    let curvature = found.m0[1] / EI;
    let tangent = found.R_tip[0][2];
    Ok((0.5 * EI * curvature * curvature - force * tangent).abs() / force)
}

pub fn closed_forms(session: &mut Session) -> Result<(), BenchError> {
    let bends: [Vector; 4] = [[5.0, 0.0, 0.0], [3.0, -4.0, 2.0], [0.1, 0.0, 9.0], [12.0, 6.0, -3.0]];
    let mut errors = Vec::new();
    for u in bends {
        let found = solve_rod(&scene("", u)?.rod(), &[]);
        errors.push(apart(found.p_tip, helix(u)) / LENGTH);
    }
    push("helices by rest curvature", &errors, session);
    let mut errors = Vec::new();
    for moment in [1e-5, 1e-4, 2e-4, 3e-4] {
        let found = solve_rod(&scene(&format!("tip_moment = [{moment}, 0, 0]"), [0.0; 3])?.rod(), &[]);
        errors.push(apart(found.p_tip, helix([moment / EI, 0.0, 0.0])) / LENGTH);
    }
    push("arcs under a tip moment", &errors, session);
    let mut errors = Vec::new();
    for force in [1e-3, 5e-3, 2e-2] {
        errors.push(first_integral(force)?);
    }
    push("first integral of the elastica under a tip force", &errors, session);
    Ok(())
}

fn push(name: &str, errors: &[f64], session: &mut Session) {
    session.records.push(Record {
        work: "closed form".into(),
        samples: errors.len() as f64,
        tip: shares(errors),
        ..Record::new("reference", name)
    });
}

/// The CPU engine in f64, with so many steps that twice as many change nothing, against the reference.
pub fn other_formulation(problem: &Problem, session: &mut Session) -> Result<(), BenchError> {
    for steps in FINE {
        let options = PlanOptions { tolerance: 1e-12, stepper: Stepper::Dop853, steps, ..PlanOptions::default() };
        let plan = problem.plan(Work::Cold, options)?;
        let found = Cpu::new(&plan, Precision::F64)?.solve(&problem.batch(Work::Cold, problem.len())?)?;
        let judged = problem.judge(Work::Cold, &found);
        let mut record = Record {
            work: "other formulation".into(),
            method: options.stepper.name().into(),
            size: steps as f64,
            ..Record::new("reference", problem.spec.name.as_str())
        };
        judged.write(&mut record);
        session.records.push(record);
    }
    Ok(())
}

fn apart(a: Vector, b: Vector) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
