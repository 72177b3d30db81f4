//! Figures of control: the tip's path, the inputs, rods along the way, the rod in motion.

use super::centreline::centreline;
use super::field;
use super::files::Drawn;
use super::rod_motion::rod_motion;
use super::wall::wall_of_run;
use crate::draw::{AxisLabel, Colour, Curves, Figure, Panel, ReportError, Series, Sheet, TipPath};
use crate::model::{Parameter, SegmentParameter, Vector};
use crate::study::{ControlRun, Outcome, TargetResult};
use std::path::Path;

/// Rods that are drawn.
const RODS: usize = 12;
/// More targets than this are drawn as a choice.
const MOST_DRAWN: usize = 4000;
const FILES: [&str; 4] = ["trajectory.png", "inputs.png", "rods.png", "motion.svg"];

/// Draws `trajectory.png` into a directory that is there, and of targets in order `inputs.png`, `rods.png` and
/// `motion.svg`. What has nothing to draw is left out.
///
/// # Errors
///
/// A file that cannot be written.
pub fn draw_control(run: &ControlRun, dir: &Path) -> Result<Drawn, ReportError> {
    let path = tip_path(run);
    let mut drawn = Drawn::default();
    let mut write = |figure: &dyn Figure, name: &str| drawn.write(figure, [dir.join(name)], run.mark());
    write(&path, FILES[0])?;
    if !run.is_in_order() {
        return Ok(drawn);
    }
    let panels = input_panels(run);
    let columns = panels.len().min(2);
    write(&Sheet { columns, panels: panels.iter().map(|panel| panel as &dyn Panel).collect() }, FILES[1])?;
    let frames = run.results().iter().step_by(run.results().len().div_ceil(RODS).max(1));
    let at = |point: &TargetResult| {
        let scene = run.commanded_scene(point)?;
        Some((centreline(&scene, point.base_moment, point.contact.as_ref())?, field::moved(run, &scene)))
    };
    let (rods, magnets) = frames.filter_map(at).unzip();
    let surroundings = field::still(run);
    write(&TipPath { rods, magnets, surroundings, flagged: Vec::new(), ..path }, FILES[2])?;
    if let Some(motion) = rod_motion(run) {
        write(&motion, FILES[3])?;
    }
    Ok(drawn)
}

fn tip_path(run: &ControlRun) -> TipPath {
    let every = run.results().len().div_ceil(MOST_DRAWN).max(1);
    let points: Vec<&TargetResult> = run.results().iter().step_by(every).collect();
    let missed = points.iter().filter(|point| point.outcome != Outcome::Reached);
    TipPath {
        title: format!("{}: {}", run.scene().name, run.trajectory().name),
        desired: run.closed(points.iter().map(|point| run.desired_tip(point)).collect::<Vec<Vector>>()),
        achieved: run.closed(points.iter().map(|point| point.tip).collect()),
        flagged: missed.map(|point| run.desired_tip(point)).collect(),
        names: ["desired", "achieved by the model"],
        order: run.is_in_order(),
        wall: wall_of_run(run),
        ..TipPath::default()
    }
}

/// Points of a line, at most twice [`MOST_DRAWN`]: of each stretch its least and its largest, so that no peak is lost.
fn thinned(count: usize, of: &dyn Fn(usize) -> f64, at: &dyn Fn(usize) -> f64) -> Vec<[f64; 2]> {
    if count <= 2 * MOST_DRAWN {
        return (0..count).map(|k| [at(k), of(k)]).collect();
    }
    let mut points = Vec::with_capacity(2 * MOST_DRAWN);
    for stretch in 0..MOST_DRAWN {
        let places = stretch * count / MOST_DRAWN..(stretch + 1) * count / MOST_DRAWN;
        let least = places.clone().min_by(|a, b| of(*a).total_cmp(&of(*b)));
        let largest = places.max_by(|a, b| of(*a).total_cmp(&of(*b)));
        if let (Some(least), Some(largest)) = (least, largest) {
            let ends = [least.min(largest), least.max(largest)];
            points.extend(ends.into_iter().take(if least == largest { 1 } else { 2 }).map(|k| [at(k), of(k)]));
        }
    }
    points
}

/// A line over the points, with its name.
type Line<'a> = dyn Fn(String, &dyn Fn(&TargetResult) -> f64) -> Series + 'a;

/// Normal force of the wall, where there is one: that of the model over the desired one.
fn force_panel(run: &ControlRun, x: &AxisLabel, series: &Line) -> Option<Curves> {
    run.scene().wall?;
    let of_contact = |point: &TargetResult| point.contact.map_or(f64::NAN, |contact| 1e3 * contact.normal_force);
    let mut lines = vec![series("of the model".into(), &of_contact).colour(Colour::BLUE)];
    if run.results().iter().any(|point| point.target.normal_force.is_some()) {
        let desired = |point: &TargetResult| 1e3 * point.target.normal_force.unwrap_or(f64::NAN);
        lines.insert(0, series("desired".into(), &desired).colour(Colour::ORANGE).width(2.6));
    }
    let y = AxisLabel::linear("normal force", "mN");
    Some(Curves { title: "Force of the wall".into(), x: x.clone(), y, series: lines })
}

/// Currents over time; other inputs, forces of a wall and the error below.
fn input_panels(run: &ControlRun) -> Vec<Curves> {
    let step = run.trajectory().duration.map(|duration| duration / run.results().len() as f64);
    let x = if step.is_some() { AxisLabel::linear("time", "s") } else { AxisLabel::linear("point", "") };
    let at = |k: usize| step.unwrap_or(1.0) * k as f64;
    let series = |name: String, of: &dyn Fn(&TargetResult) -> f64| {
        Series::line(name, thinned(run.results().len(), &|k| of(&run.results()[k]), &at))
    };
    let is_current =
        |k: &usize| matches!(run.inputs()[*k].parameter, Parameter::Segment(_, SegmentParameter::Current(_)));
    let mut panels = Vec::new();
    let currents: Vec<usize> = (0..run.inputs().len()).filter(is_current).collect();
    if !currents.is_empty() {
        let of = |k: &usize| series(run.inputs()[*k].name(run.scene()), &|point| 1e3 * point.inputs[*k]);
        panels.push(Curves {
            title: "Currents".into(),
            x: x.clone(),
            y: AxisLabel::linear("current", "mA"),
            series: currents.iter().map(of).collect(),
        });
    }
    for k in (0..run.inputs().len()).filter(|k| !is_current(k)) {
        let (name, unit) = (run.inputs()[k].name(run.scene()), run.inputs()[k].parameter.unit());
        let (factor, unit) = if unit == "m" { (1e3, "mm") } else { (1.0, unit) };
        panels.push(Curves {
            title: name.clone(),
            x: x.clone(),
            y: AxisLabel::linear(name, unit),
            series: vec![series(String::new(), &|point| factor * point.inputs[k])],
        });
    }
    panels.extend(force_panel(run, &x, &series));
    panels.push(Curves {
        title: "Tip error of the model".into(),
        x,
        y: AxisLabel::logarithmic("tip error", "m"),
        series: vec![series(String::new(), &|point| run.tip_error(point).max(1e-16))],
    });
    panels
}

#[cfg(test)]
mod tests {
    use super::{MOST_DRAWN, thinned};

    #[test]
    fn long_lines_are_thinned_and_peaks_stay() {
        let of = |k: usize| if k == 777_777 { 9.0 } else { (k as f64 * 1e-4).sin() };
        let points = thinned(1_000_000, &of, &|k| k as f64);
        assert!(points.len() <= 2 * MOST_DRAWN && points.contains(&[777_777.0, 9.0]));
        assert!(points.windows(2).all(|pair| pair[0][0] < pair[1][0]));
        assert_eq!(thinned(5, &of, &|k| k as f64).len(), 5);
    }
}
