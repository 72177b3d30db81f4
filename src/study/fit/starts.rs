//! Where a fit begins: at the scene, and where that may lead to another minimum, at shapes grown from the base.
//!
//! The residuals of a strongly bent rod have many minima, because distal points swing about the base. The points next to the base
//! have one, and those that follow are near where the rod that fits them leads.

use super::FitError;
use super::model::{Part, Search, State};
use crate::model::{Axis, Parameter, Profile, Scene, SegmentKind, SegmentParameter, ShearElasticity, Stiffness};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::DVector;
use std::f64::consts::TAU;

/// The rod grows by so many steps at most.
const MOST_STAGES: usize = 24;
/// Noise of a coordinate while the rod grows, over its length.
const STAGE_NOISE: f64 = 1e-3;
/// How far scaled parameters go in a step of growth where the points do not tell them, those of rest twist apart: a rod that bends alike
/// about both axes hardly shows how it is twisted.
const REACH: f64 = 6.0;
const TWIST_REACHES: [(f64, bool); 3] = [(0.3, true), (6.0, true), (6.0, false)];
/// Evaluations of a descent, over the number of parameters and one: from the scene, and from elsewhere.
pub(super) const PATIENCE: usize = 40;
pub(super) const LESS_PATIENCE: usize = 15;
/// Turns of the rods of constant curvature that are tried last.
const TURNS: [f64; 3] = [1.0, 2.0, 3.0];

/// Where a descent ended.
pub(super) struct End {
    pub x: DVector<f64>,
    pub state: State,
    /// Whether the method came to an end.
    pub converged: bool,
}

/// A start beside the scene.
#[derive(Clone, Copy, Debug)]
pub(super) enum Start {
    /// Points are taken in from the base to the tip; nodes beyond them follow the last one or stay.
    Grown { twist_reach: f64, extended: bool },
    /// The rod is a circle about an axis of its body.
    Circle { turns: f64, axis: Axis },
}

impl Start {
    /// All starts, in the order in which they are tried.
    pub(super) fn all() -> impl Iterator<Item = Start> {
        let grown = TWIST_REACHES.into_iter().map(|(twist_reach, extended)| Start::Grown { twist_reach, extended });
        let signed = TURNS.into_iter().flat_map(|turns| [turns, -turns]);
        let circles = signed.flat_map(|turns| [Axis::X, Axis::Y].map(|axis| Start::Circle { turns, axis }));
        grown.chain(circles)
    }

    /// Scaled parameters to begin from; `None` where this start changes nothing.
    pub(super) fn place(self, search: Search) -> (Search, Option<DVector<f64>>) {
        match self {
            Start::Grown { twist_reach, extended } => grow(search, twist_reach, extended),
            Start::Circle { turns, axis } => {
                let x = circle(&search, turns, axis);
                (search, x)
            }
        }
    }
}

/// Levenberg and Marquardt's method from scaled parameters to a minimum.
pub(super) fn descend<'a>(
    mut search: Search<'a>,
    from: &DVector<f64>,
    patience: usize,
) -> (Search<'a>, Result<End, FitError>) {
    search.worst = 0.0;
    search.set_params(from);
    if search.state.is_none() {
        let error = search.failure.take().unwrap_or_else(|| FitError::Failed("no start".into()));
        return (search, Err(error));
    }
    let method = LevenbergMarquardt::new().with_patience(patience).with_ftol(1e-15).with_xtol(1e-14).with_gtol(0.0);
    let (mut search, report) = method.minimize(search);
    let x = search.x.clone();
    search.set_params(&x);
    let end = match search.state.take() {
        Some(state) => Ok(End { x, state, converged: report.termination.was_successful() }),
        None => Err(FitError::Failed(format!("{:?}", report.termination))),
    };
    (search, end)
}

/// Takes in the points from the base to the tip.
fn grow(mut search: Search, twist_reach: f64, extended: bool) -> (Search, Option<DVector<f64>>) {
    let places = search.model.places();
    let mut cuts = places.clone();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|a, b| *a - *b < 1e-6);
    if cuts.len() < 2 {
        return (search, None);
    }
    let every = cuts.len().div_ceil(MOST_STAGES);
    let cuts: Vec<f64> = cuts.into_iter().skip(every - 1).step_by(every).collect();
    let sigma = std::mem::replace(&mut search.sigma, STAGE_NOISE * search.model.length);
    use SegmentParameter::{RestCurvature, RestCurvatureNode};
    let free = &search.model.problem().free;
    let reach = DVector::from_fn(free.len(), |k, _| match free[k][..] {
        [Parameter::Segment(_, RestCurvature(Axis::Z) | RestCurvatureNode(_, Axis::Z))] => twist_reach,
        _ => REACH,
    });
    let mut x = DVector::zeros(free.len());
    for cut in cuts {
        if search.is_spent() {
            break;
        }
        if extended {
            extend(&search, cut, &mut x);
        }
        let kept = places.iter().map(|place| *place <= cut + 1e-9).collect();
        search.part = Some(Part { kept, anchor: x.clone(), reach: reach.clone() });
        search.worst = 0.0;
        search.set_params(&x);
        if search.state.is_none() {
            break;
        }
        let method = LevenbergMarquardt::new().with_patience(5).with_ftol(1e-6).with_xtol(1e-6).with_gtol(0.0);
        search = method.minimize(search).0;
        if search.state.is_some() {
            x = search.x.clone();
        }
    }
    (search.part, search.sigma) = (None, sigma);
    (search, Some(x))
}

/// The scene with so many times the stiffness in everything.
pub(super) fn stiffened(scene: &Scene, by: f64) -> Scene {
    let mut scene = scene.clone();
    for segment in &mut scene.segments {
        let SegmentKind::Flexible(flexible) = &mut segment.kind else { continue };
        match &mut flexible.stiffness {
            Stiffness::Direct { bending_x, bending_y, torsion } => {
                [bending_x, bending_y, torsion].into_iter().for_each(|stiffness| *stiffness *= by);
            }
            Stiffness::Nodes(nodes) => nodes.iter_mut().flat_map(|node| &mut node.value).for_each(|value| *value *= by),
            Stiffness::Tube { youngs_modulus, shear, .. } => {
                *youngs_modulus *= by;
                if let ShearElasticity::Modulus(modulus) = shear {
                    *modulus *= by;
                }
            }
        }
        flexible.stiffness_shear.iter_mut().flatten().for_each(|stiffness| *stiffness *= by);
        flexible.stiffness_axial.iter_mut().for_each(|stiffness| *stiffness *= by);
    }
    scene
}

/// Sets curvature nodes beyond the cut to the node before them.
fn extend(search: &Search, cut: f64, x: &mut DVector<f64>) {
    use SegmentParameter::RestCurvatureNode;
    let problem = search.model.problem();
    for k in 0..x.len() {
        let [Parameter::Segment(segment, RestCurvatureNode(node, axis))] = problem.free[k][..] else { continue };
        let before: f64 = problem.scene.segments[..segment].iter().map(|segment| segment.length).sum();
        let SegmentKind::Flexible(flexible) = &problem.scene.segments[segment].kind else { continue };
        let Profile::Nodes(nodes) = &flexible.rest_curvature else { continue };
        if node == 0 || nodes.get(node).is_none_or(|node| (before + node.at) / search.model.length <= cut) {
            continue;
        }
        let previous = vec![Parameter::Segment(segment, RestCurvatureNode(node - 1, axis))];
        let Some(j) = problem.free.iter().position(|free| *free == previous) else { continue };
        let start = |k: usize| problem.free[k][0].get(&problem.scene);
        x[k] = x[j] + (start(j) - start(k)) * search.model.length;
    }
}

/// A rod of constant curvature about an axis of its body.
fn circle(search: &Search, turns: f64, axis: Axis) -> Option<DVector<f64>> {
    use SegmentParameter::{RestCurvature, RestCurvatureNode};
    let (problem, length) = (search.model.problem(), search.model.length);
    let about = |free: &[Parameter]| match free {
        [Parameter::Segment(_, RestCurvature(axis) | RestCurvatureNode(_, axis))] => Some(*axis),
        _ => None,
    };
    problem.free.iter().any(|free| about(free) == Some(axis)).then(|| {
        DVector::from_fn(problem.free.len(), |k, _| match about(&problem.free[k]) {
            Some(other) => {
                let wanted = if other == axis { TAU * turns } else { 0.0 };
                wanted - length * problem.free[k][0].get(&problem.scene)
            }
            None => 0.0,
        })
    })
}
