//! The figure of a fit: observed points, fitted points, fitted rods.

use super::centreline::centreline;
use super::wall::still_wall;
use crate::draw::{Surroundings, TipPath};
use crate::model::{Parameter, Vector};
use crate::study::{Fit, FitJob};

/// More rods than this are drawn as a choice.
const MOST_RODS: usize = 24;

/// What was observed and what is fitted to it, of the job that gave this fit.
pub fn fit(fit: &Fit, job: &FitJob) -> TipPath {
    let observed = job.observed();
    let mut rods = Vec::new();
    let every = observed.shapes.len().div_ceil(MOST_RODS).max(1);
    let shapes = observed.shapes.iter().zip(&fit.base_moments).zip(&fit.contacts);
    for ((shape, m0), contact) in shapes.step_by(every) {
        let mut scene = fit.scene.clone();
        let values = observed.known.iter().copied().zip(shape.known.iter().copied());
        // The same values were set when the shapes were fitted.
        let _ = Parameter::set_all(&mut scene, values);
        rods.extend(centreline(&scene, *m0, contact.as_ref()));
    }
    let points = observed.shapes.iter().flat_map(|shape| &shape.points);
    let surroundings = Surroundings::of(&fit.scene);
    TipPath {
        title: format!("{}: fit of {} shapes", job.scene().name, observed.shapes.len()),
        desired: points.map(|point| point.position).collect::<Vec<Vector>>(),
        achieved: fit.positions.concat(),
        rods,
        names: ["observed", "fitted"],
        wall: still_wall(&fit.scene, observed.known.iter().copied()),
        surroundings: surroundings
            .map(|around| observed.known.iter().fold(around, |around, known| around.swept(*known))),
        ..TipPath::default()
    }
}
