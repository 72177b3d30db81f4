//! The figure of a fit: observed points, fitted points, fitted rods.

use super::centreline::centreline;
use crate::model::Parameter;
use crate::report::{self, ReportError, TipPath};
use crate::study::{Fit, FitJob};
use std::path::Path;

/// More rods than this are drawn as a choice.
const MOST_RODS: usize = 24;

impl Fit {
    /// Draws what was observed and what is fitted to it (.png or .svg), of the job that gave this fit.
    ///
    /// # Errors
    ///
    /// Nothing to draw, a name that is neither, or a file that cannot be written.
    pub fn figure(&self, job: &FitJob, path: &Path) -> Result<(), ReportError> {
        let observed = job.observed();
        let mut rods = Vec::new();
        let every = observed.shapes.len().div_ceil(MOST_RODS).max(1);
        for (shape, m0) in observed.shapes.iter().zip(&self.base_moments).step_by(every) {
            let mut scene = self.scene.clone();
            let values = observed.known.iter().copied().zip(shape.known.iter().copied());
            // The same values were set when the shapes were fitted.
            let _ = Parameter::set_all(&mut scene, values);
            rods.extend(centreline(&scene, *m0));
        }
        let figure = TipPath {
            title: format!("{}: fit of {} shapes", job.scene().name, observed.shapes.len()),
            desired: observed.shapes.iter().flat_map(|shape| shape.points.iter().map(|point| point.position)).collect(),
            achieved: self.positions.concat(),
            flagged: Vec::new(),
            rods,
            names: ["observed", "fitted"],
            order: false,
        };
        report::write(&figure, path)
    }
}
