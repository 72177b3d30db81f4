//! The figure of a replay: observed tips beside those of the model.

use crate::model::Vector;
use crate::report::{self, ReportError, TipPath};
use crate::study::{Replay, ReplayComparison};
use std::path::Path;

const NOWHERE: Vector = [f64::NAN; 3];

impl Replay {
    /// Draws observed tips and every tip of the model (.png or .svg), under a name for the title.
    ///
    /// # Errors
    ///
    /// Nothing to draw, a name that is neither, or a file that cannot be written.
    pub fn figure(&self, found: &ReplayComparison, name: &str, path: &Path) -> Result<(), ReportError> {
        let figure = TipPath {
            title: format!("{}: {name}, replayed", self.scene().name),
            desired: found.pairs.iter().map(|(seen, _)| seen.position).collect(),
            achieved: self.tips().iter().map(|tip| tip.unwrap_or(NOWHERE)).collect(),
            names: ["observed", "model"],
            ..TipPath::default()
        };
        report::write(&figure, path)
    }
}
