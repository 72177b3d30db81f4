//! `rodsweep fit`: numbers of a scene from observed shapes, with intervals, and what cannot be told apart.

use super::args::FitArguments;
use super::engine::cpu_f64;
use super::{CommandError, Exit, plot, print, say};
use rodsweep::model::{Parameter, Scene, SegmentParameter, Vector};
use rodsweep::reference::shape_with_derivatives;
use rodsweep::report::{self, Table, TipPath, engineering};
use rodsweep::study::{self, Fit, FitProblem, Fitted, ObservedPoint, ObservedShape, Strength};
use rodsweep::sweep::{Dimension, SweepError, parse_quantity, read_scene, read_shapes, scene_notes, write_scene};
use serde_json::{Value, json};
use std::path::Path;

/// Points along a rod that is drawn, and the most rods.
const ROD_POINTS: usize = 81;
const MOST_RODS: usize = 24;

pub fn fit(arguments: &FitArguments) -> Result<Exit, CommandError> {
    if let Some(path) = &arguments.plot {
        plot::check_extension(path)?;
    }
    if let Some(path) = arguments.out.as_ref().filter(|path| path.exists() && !arguments.force) {
        let text = "is already there: overwrite it with `--force`, or choose another name with `--out`";
        return Err(CommandError::Usage(format!("{} {text}", path.display())));
    }
    let scene = read_scene(&arguments.scene)?;
    let (known, rows) = read_shapes(&arguments.shapes, &scene)?;
    let free = free_parameters(arguments, &scene)?;
    if let Some(name) = known.iter().find(|known| free.iter().flatten().any(|free| free == *known)) {
        let name = name.name(&scene);
        return Err(CommandError::Usage(format!("`--free`: {name} is a column of known values; drop one of the two")));
    }
    for note in scene_notes(&scene) {
        say(&format!("note: {note}"));
    }
    let point = |(arc_length, position): (Option<f64>, Vector)| ObservedPoint { arc_length, position };
    let shape = |rows: rodsweep::sweep::ShapeRows| ObservedShape {
        known: rows.known,
        points: rows.points.into_iter().map(point).collect(),
    };
    let shapes = rows.into_iter().map(shape).collect();
    let problem = FitProblem { scene, free, known, shapes, noise: noise(arguments)? };
    let fit = study::fit(&problem, &mut |plan| cpu_f64(plan))?;
    print(&if arguments.json { json_text(&fit) } else { text(&fit, &problem) })?;
    if let Some(path) = &arguments.out {
        let io =
            |error: std::io::Error| SweepError::Io { path: path.clone(), action: "writing", reason: error.to_string() };
        std::fs::write(path, write_scene(&fit.scene)).map_err(io)?;
        say(&format!("scene: {}", path.display()));
    }
    if let Some(path) = &arguments.plot {
        draw(&fit, &problem, path)?;
        say(&format!("figure: {}", path.display()));
    }
    Ok(if fit.converged { Exit::Done } else { Exit::Failed })
}

fn noise(arguments: &FitArguments) -> Result<Option<f64>, CommandError> {
    let Some(text) = &arguments.noise else { return Ok(None) };
    let wrong = |why: String| CommandError::Usage(format!("`--noise {text}`: {why}"));
    let length = parse_quantity(text, Dimension::of("m")).map_err(|error| wrong(error.to_string()))?;
    if length > 0.0 { Ok(Some(length)) } else { Err(wrong("give a positive length, such as \"0.2 mm\"".into())) }
}

fn free_parameters(arguments: &FitArguments, scene: &Scene) -> Result<Vec<Vec<Parameter>>, CommandError> {
    let Some(names) = &arguments.free else {
        let about_x_or_y = |parameter: &Parameter| {
            use SegmentParameter::{RestCurvature, RestCurvatureNode};
            use rodsweep::model::Axis::Z;
            matches!(parameter, Parameter::Segment(_, RestCurvature(axis) | RestCurvatureNode(_, axis)) if *axis != Z)
        };
        return Ok(Parameter::all(scene).into_iter().filter(about_x_or_y).map(|parameter| vec![parameter]).collect());
    };
    let parse = |name: &str| {
        Parameter::parse(scene, name.trim()).map_err(|error| CommandError::Usage(format!("`--free`: {error}")))
    };
    let mut free: Vec<Vec<Parameter>> = Vec::new();
    for text in names.iter().filter(|name| !name.trim().is_empty()) {
        let parts: Vec<Vec<Parameter>> = text.split('+').map(parse).collect::<Result<_, _>>()?;
        match &parts[..] {
            [group] => free.extend(group.iter().map(|parameter| vec![*parameter])),
            _ => free.push(parts.concat()),
        }
    }
    let all: Vec<&Parameter> = free.iter().flatten().collect();
    if let Some(twice) = all.iter().enumerate().find(|(k, parameter)| all[..*k].contains(parameter)) {
        return Err(CommandError::Usage(format!("`--free`: {} is named twice", twice.1.name(scene))));
    }
    Ok(free)
}

fn text(fit: &Fit, problem: &FitProblem) -> String {
    let mut table = Table::new(["parameter", "start", "fitted", "± 95 %", "unit"]);
    for Fitted { name, unit, start, value, deviation, interval } in &fit.parameters {
        let half = if deviation.is_finite() { engineering(0.5 * (interval[1] - interval[0])) } else { "open".into() };
        table.row([name.clone(), format!("{start:.6e}"), format!("{value:.6e}"), half, (*unit).to_owned()]);
    }
    let mut text = format!(
        "{}: {} shapes, {} coordinates, {} evaluations\n{table}",
        if fit.converged { "fitted" } else { "not converged" },
        problem.shapes.len(),
        fit.observations,
        fit.evaluations
    );
    let how = if problem.noise.is_some() { "as given" } else { "estimated" };
    text += &format!(
        "points off the model by {} m (rms); noise of a coordinate {} m ({how})\n",
        engineering(fit.rms),
        engineering(fit.noise)
    );
    let values: Vec<String> = fit.directions.iter().map(|d| engineering(d.singular_value)).collect();
    text += &format!("singular values of the scaled sensitivities over the noise: {}\n", values.join(", "));
    for finding in &fit.findings {
        text += &format!("identifiability: {finding}\n");
    }
    text
}

fn json_text(fit: &Fit) -> String {
    let number = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    let parameter = |fitted: &Fitted| {
        json!({
            "name": fitted.name, "unit": fitted.unit, "start": fitted.start, "value": fitted.value,
            "deviation": number(fitted.deviation), "interval_95": fitted.interval.map(number),
        })
    };
    let word = |strength: Strength| match strength {
        Strength::Determined => "determined",
        Strength::Weak => "weak",
        Strength::Ridge => "ridge",
    };
    let directions = fit.directions.iter().map(|direction| {
        json!({
            "singular_value": number(direction.singular_value), "weights": direction.weights,
            "strength": word(direction.strength),
        })
    });
    let value = json!({
        "converged": fit.converged,
        "parameters": fit.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "covariance": fit.covariance,
        "directions": directions.collect::<Vec<_>>(),
        "findings": fit.findings,
        "rms": fit.rms,
        "noise": fit.noise,
        "observations": fit.observations,
        "evaluations": fit.evaluations,
    });
    serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
}

fn draw(fit: &Fit, problem: &FitProblem, path: &Path) -> Result<(), CommandError> {
    let mut rods = Vec::new();
    let every = problem.shapes.len().div_ceil(MOST_RODS).max(1);
    for (shape, m0) in problem.shapes.iter().zip(&fit.base_moments).step_by(every) {
        let mut scene = fit.scene.clone();
        let values = problem.known.iter().copied().zip(shape.known.iter().copied());
        // The same values were set when the shapes were read.
        let _ = Parameter::set_all(&mut scene, values);
        let length = scene.total_length();
        let at: Vec<f64> = (0..ROD_POINTS).map(|k| length * k as f64 / (ROD_POINTS - 1) as f64).collect();
        if let Some(poses) = shape_with_derivatives(&scene.rod(), *m0, &at, &[]) {
            rods.push(poses.into_iter().map(|pose| pose.position).collect());
        }
    }
    let figure = TipPath {
        title: format!("{}: fit of {} shapes", problem.scene.name, problem.shapes.len()),
        desired: problem.shapes.iter().flat_map(|shape| shape.points.iter().map(|point| point.position)).collect(),
        achieved: fit.positions.concat(),
        flagged: Vec::new(),
        rods,
        names: ["observed", "fitted"],
        order: false,
    };
    Ok(report::write(&figure, path)?)
}
