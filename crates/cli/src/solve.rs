//! `rodsweep solve`: one equilibrium with its Jacobian.

use super::args::SolveArguments;
use super::engine::{Engine, cpu_f64, second_attempt};
use super::{CommandError, Exit, branches, explain, plot, print, say, shape, solution_json};
use rodsweep::backend::BackendKind;
use rodsweep::model::{Batch, Parameter, Plan, PlanOptions, Quantity, Scene, SegmentKind, SegmentParameter, Solutions};
use rodsweep::report::engineering;
use rodsweep::sweep::{assign, read_scene, scene_notes};

/// Steps that are tried until the error estimate meets the tolerance.
const STEPS: [usize; 5] = [8, 16, 32, 64, 128];

/// One solved scene.
#[derive(Clone)]
pub struct Solved {
    pub scene: Scene,
    pub plan: Plan,
    pub batch: Batch,
    pub solutions: Solutions,
    pub engine: String,
}

pub fn solve(arguments: &SolveArguments) -> Result<Exit, CommandError> {
    if !(arguments.tolerance > 0.0 && arguments.tolerance < 1.0) {
        let text = format!("`--tolerance {}`: give a number between 0 and 1, such as 1e-9", arguments.tolerance);
        return Err(CommandError::Usage(text));
    }
    if let Some(path) = &arguments.plot {
        plot::check_extension(path)?;
    }
    let mut scene = read_scene(&arguments.scene)?;
    assign(&mut scene, &arguments.set)?;
    if let Some(text) = &arguments.shape {
        shape::arc_lengths(text, scene.total_length())?;
    }
    for note in scene_notes(&scene) {
        say(&format!("note: {note}"));
    }
    let wrt = match &arguments.wrt {
        Some(names) => parse_parameters(&scene, names)?,
        None => default_parameters(&scene),
    };
    let engine = Engine::choose_for_one(&arguments.engine, arguments.tolerance)?;
    let solved = solve_scene(scene, &wrt, &engine, arguments.tolerance)?;
    let text = match arguments.all_branches {
        true => branches::answer(&solved, &engine, arguments.json)?,
        false => answer(&solved, arguments)?,
    };
    print(&text)?;
    if let Some(path) = &arguments.plot {
        plot::draw(&solved, path)?;
        say(&format!("figure: {}", path.display()));
    }
    let converged = solved.solutions.status(0).is_converged();
    Ok(if converged { Exit::Done } else { Exit::Failed })
}

/// All that is asked for, as text or as JSON.
fn answer(solved: &Solved, arguments: &SolveArguments) -> Result<String, CommandError> {
    let poses = match &arguments.shape {
        Some(text) if solved.solutions.is_equilibrium(0) => {
            Some(shape::poses(solved, &shape::arc_lengths(text, solved.scene.total_length())?)?)
        }
        _ => None,
    };
    if arguments.json {
        let plan = if arguments.explain { Some(explain::json(solved)?) } else { None };
        return Ok(solution_json::text(solved, poses.map(|poses| shape::json(solved, &poses)), plan));
    }
    let mut text = describe(solved);
    if let Some(poses) = poses {
        text += &shape::text(&poses);
    }
    if arguments.explain {
        text += &explain::text(solved)?;
    }
    Ok(text)
}

fn parse_parameters(scene: &Scene, names: &[String]) -> Result<Vec<Parameter>, CommandError> {
    let mut parameters = Vec::new();
    for name in names.iter().map(|name| name.trim()).filter(|name| !name.is_empty()) {
        let parsed = Parameter::parse(scene, name).map_err(|error| CommandError::Usage(format!("`--wrt`: {error}")))?;
        parameters.extend(parsed);
    }
    Ok(parameters)
}

/// Every current, insertion and tip force: what a robot can move and what may push it.
fn default_parameters(scene: &Scene) -> Vec<Parameter> {
    let mut parameters: Vec<Parameter> = Parameter::all(scene)
        .into_iter()
        .filter(|p| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_))))
        .collect();
    if matches!(scene.segments[0].kind, SegmentKind::Flexible(_)) {
        parameters.push(Parameter::Insertion);
    }
    parameters.extend(rodsweep::model::Axis::ALL.map(Parameter::TipForce));
    parameters
}

fn solve_scene(scene: Scene, wrt: &[Parameter], engine: &Engine, tolerance: f64) -> Result<Solved, CommandError> {
    let tolerance = engine.tolerance(tolerance);
    let options = PlanOptions { tolerance, stepper: engine.steppers()[0], steps: STEPS[0], ..PlanOptions::default() };
    let plan = Plan::single(&scene, wrt, options)?;
    let batch = plan.batch(1, |_, _| {});
    let mut solved: Option<Solved> = None;
    for steps in STEPS {
        let plan = plan.with_options(PlanOptions { steps, ..options });
        // A kernel for each number of steps would have to be compiled.
        let mut backend = if engine.kind == BackendKind::Gpu { cpu_f64(&plan)? } else { engine.make(&plan)? };
        let solutions = backend.solve(&batch)?;
        let engine_name = backend.info().to_string();
        let met = solutions.status(0).is_success() && solutions.get(0, Quantity::ErrorEstimate) <= tolerance;
        let worse = solved.as_ref().is_some_and(|before| {
            before.solutions.status(0).is_success()
                && before.solutions.get(0, Quantity::ErrorEstimate) < solutions.get(0, Quantity::ErrorEstimate)
        });
        if !worse {
            solved = Some(Solved { scene: scene.clone(), plan, batch: batch.clone(), solutions, engine: engine_name });
        }
        if met || engine.kind == BackendKind::Reference {
            break;
        }
    }
    let mut solved = solved.ok_or_else(|| CommandError::Usage("nothing was solved".into()))?;
    if engine.kind == BackendKind::Gpu {
        let mut backend = engine.make(&solved.plan)?;
        solved.solutions = backend.solve(&batch)?;
        solved.engine = backend.info().to_string();
        if !solved.solutions.status(0).is_success() {
            solved.solutions = second_attempt(&solved.plan)?.solve(&batch)?;
            solved.engine = "cpu f64, after the GPU failed".into();
        }
    }
    Ok(solved)
}

/// The answer for a person.
fn describe(solved: &Solved) -> String {
    let Solved { plan, solutions, scene, .. } = solved;
    let status = solutions.status(0);
    let mut text =
        format!("{}: {} ({})\n", if scene.name.is_empty() { "rod" } else { &scene.name }, status.name(), solved.engine);
    if !status.is_converged() {
        let fraction = 100.0 * solutions.get(0, Quantity::LoadFraction);
        if !solutions.is_equilibrium(0) {
            text += &format!("no equilibrium at the full load; followed from rest to {fraction:.1} % of it\n");
            return text;
        }
        text += &format!("the path from rest ends at {fraction:.2} % of the load; an equilibrium beyond:\n");
    }
    let numbers = |v: [f64; 3], factor: f64, digits: usize| v.map(|x| format!("{:.*}", digits, x * factor)).join(", ");
    let m0 = solutions.vector(0, Quantity::BaseMoment);
    let u0 = rodsweep::model::base_curvature(&plan.sample_rod(&solved.batch, 0), m0);
    text += &format!("tip position       [mm]     {}\n", numbers(solutions.vector(0, Quantity::TipPosition), 1e3, 6));
    text += &format!("tip tangent                 {}\n", numbers(solutions.vector(0, Quantity::TipTangent), 1.0, 6));
    text += &format!("base curvature     [1/m]    {}\n", numbers(u0, 1.0, 6));
    text += &format!("base moment        [mN·m]   {}\n", numbers(m0, 1e3, 6));
    text += &format!(
        "stability margin            {:.4} ({})\n",
        solutions.get(0, Quantity::StabilityMargin),
        if solutions.get(0, Quantity::StabilityIndex) < 0.5 { "stable" } else { "unstable" }
    );
    text += &format!(
        "error estimate              {} of the length; residual {}, {} passes, {} steps of {}\n",
        engineering(solutions.get(0, Quantity::ErrorEstimate)),
        engineering(solutions.get(0, Quantity::Residual)),
        solutions.get(0, Quantity::Iterations),
        plan.options.steps,
        plan.options.stepper.name()
    );
    for (segment, flexible) in scene.segments.iter().filter_map(|s| match &s.kind {
        SegmentKind::Flexible(flexible) => Some((s, flexible)),
        SegmentKind::Rigid(_) => None,
    }) {
        let [x, y, z] = flexible.stiffness.principal().map(engineering);
        text += &format!("stiffness of {:<15}bending {x}, {y}, torsion {z} N·m²\n", segment.name);
    }
    if !plan.derivatives.is_empty() {
        let mut table =
            rodsweep::report::Table::new(["d/d", "x [m/unit]", "y", "z", "w.x [rad/unit]", "w.y", "w.z", "unit"]);
        for (k, derivative) in plan.derivatives.iter().enumerate() {
            let mut cells = vec![derivative.name.clone()];
            cells.extend((0..6).map(|row| format!("{:.6e}", solutions.derivative(0, k, row))));
            cells.push(derivative.parameter.unit().into());
            table.row(cells);
        }
        text += &format!("{table}");
    }
    text
}
