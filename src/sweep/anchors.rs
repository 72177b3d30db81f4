//! Anchors of a sweep: equilibria on a grid over its axes, from which its samples start.
//!
//! The grid follows from the sweep alone, whatever part of it is run, so that a sample depends on (sweep, index) alone.

use super::error::SweepError;
use crate::backend::BackendKind;
use crate::engines::cpu_f64;
use crate::model::{
    Anchor, AnchorAxis, Anchors, Axis, MOST_ANCHOR_AXES, Parameter, Plan, PlanOptions, Quantity, Scene, Solutions,
    Vector,
};
use crate::spec::{AxisSpec, BranchChoice, Distribution, Method, SweepSpec};
use std::sync::Arc;

/// One anchor for so many samples, at most.
const SAMPLES_EACH: f64 = 50.0;
/// Points of each axis, at least and at most, by number of axes.
const FEWEST: [usize; MOST_ANCHOR_AXES] = [9, 9, 9, 7];
const MOST: [usize; MOST_ANCHOR_AXES] = [257, 65, 25, 13];
/// A normal axis is covered so many standard deviations from its mean.
const COVERED: f64 = 3.5;
/// Where samples may start from fewer cells, anchors do not pay.
const LEAST_SHARE: f64 = 0.5;
/// A GPU has one more kernel to compile, and its grid is solved by the processor: fewer samples do not save that.
const FEWEST_ON_A_GPU: u64 = 1 << 20;
/// Rows of a derivative by which the base moment follows those of the tip.
const BASE_MOMENT_ROW: usize = 6;

/// The plan with the anchors of its sweep, where they pay.
///
/// # Errors
///
/// Anchors that cannot be solved.
pub fn with_anchors(spec: &SweepSpec, plan: Plan) -> Result<Plan, SweepError> {
    let Some(axes) = anchor_axes(spec, &plan) else { return Ok(plan) };
    Ok(match solve_anchors(&plan, axes)? {
        Some(grid) => plan.with_anchors(grid),
        None => plan,
    })
}

/// Whether a sweep wants anchors, and an engine of this kind saves by them.
pub(super) fn suit(spec: &SweepSpec, kind: BackendKind) -> bool {
    spec.anchors
        && match kind {
            BackendKind::Cpu => true,
            BackendKind::Gpu => spec.sample_count >= FEWEST_ON_A_GPU,
            // It follows every sample from rest.
            BackendKind::Reference => false,
        }
}

/// The grid of a sweep; `None` where it would not pay: few samples, many axes, no law, loads that keep none.
fn anchor_axes(spec: &SweepSpec, plan: &Plan) -> Option<Vec<AnchorAxis>> {
    let count = plan.axes.len();
    // An axis that gives several parameters values of their own is several axes of the plan.
    let is_plain = count == spec.axes.len() && (1..=MOST_ANCHOR_AXES).contains(&count);
    let follows = spec.method != Method::Table && spec.branch == BranchChoice::FromRest;
    // Rods beside a wall are solved without it first, if that is not swept itself.
    let is_of_wall = |parameter: &Parameter| matches!(parameter, Parameter::Wall(_));
    let is_free = !plan.terms.varying_field || plan.without_wall().is_some();
    let is_held = !is_free || plan.axes.iter().flatten().any(is_of_wall);
    if !is_plain || !follows || plan.terms.load_without_energy || is_held || plan.start.is_some() {
        return None;
    }
    let points = (spec.sample_count as f64 / SAMPLES_EACH).powf(1.0 / count as f64).floor() as usize;
    let points = points.min(MOST[count - 1]);
    if points < FEWEST[count - 1] {
        return None;
    }
    let axis = |axis: &AxisSpec| {
        let (from, to) = match axis.distribution {
            // Equal steps do not suit them.
            Distribution::LogUniform { .. } | Distribution::LogNormal { .. } | Distribution::Values(_) => return None,
            _ => axis.distribution.range(COVERED),
        };
        let rate = axis.rates(&spec.scene)[0];
        let (from, to) = ((rate * from).min(rate * to), (rate * from).max(rate * to));
        (to > from).then(|| AnchorAxis { from, spacing: (to - from) / (points - 1) as f64, points })
    };
    spec.axes.iter().map(axis).collect()
}

/// Solves the anchors of a sweep for a plan; `None` where samples may start from few of its cells.
fn solve_anchors(plan: &Plan, axes: Vec<AnchorAxis>) -> Result<Option<Arc<Anchors>>, SweepError> {
    let mut wrt: Vec<Parameter> = plan.axes.concat();
    wrt.extend(Axis::ALL.map(Parameter::TipMoment));
    let options = PlanOptions { base_moment_rows: true, ..plan.options };
    let scene = Scene { wall: None, ..plan.scene.clone() };
    let solver = Plan::new(&scene, &plan.axes, &wrt, options)?;
    let count: usize = axes.iter().map(|axis| axis.points).product();
    let batch = solver.batch(count, |anchor, values| {
        let mut rest = anchor;
        for (value, axis) in values.iter_mut().zip(&axes).rev() {
            *value = axis.from + axis.spacing * (rest % axis.points) as f64;
            rest /= axis.points;
        }
    });
    let solutions = cpu_f64(&solver)?.solve(&batch)?;
    let anchors: Vec<Anchor> = (0..count).map(|row| anchor(plan, &axes, &solutions, row)).collect();
    let grid = Anchors::new(axes, &anchors);
    Ok((grid.usable_share() >= LEAST_SHARE).then(|| Arc::new(grid)))
}

fn anchor(plan: &Plan, axes: &[AnchorAxis], solutions: &Solutions, row: usize) -> Anchor {
    let unit = plan.units.moment();
    let by = |derivative: usize| -> Vector {
        std::array::from_fn(|k| solutions.derivative(row, derivative, BASE_MOMENT_ROW + k))
    };
    let mut first = 0;
    let mut slopes = Vec::new();
    for (axis, parameters) in axes.iter().zip(&plan.axes) {
        let each: Vec<Vector> = (first..first + parameters.len()).map(by).collect();
        let total = |k: usize| each.iter().map(|slope| slope[k]).sum::<f64>();
        slopes.push(std::array::from_fn(|k| axis.spacing * total(k) / unit));
        first += parameters.len();
    }
    let is_good = solutions.status(row).is_success();
    Anchor {
        m0: solutions.vector(row, Quantity::BaseMoment).map(|m| m / unit),
        slopes,
        inverse: [first, first + 1, first + 2].map(by),
        margin: if is_good { solutions.get(row, Quantity::StabilityMargin) } else { -1.0 },
    }
}
