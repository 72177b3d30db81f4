//! The figure of a replay: observed tips beside those of the model.

use crate::draw::TipPath;
use crate::model::Vector;
use crate::study::{Replay, ReplayComparison};

const NOWHERE: Vector = [f64::NAN; 3];

/// Observed tips and every tip of the model; `name` stands in the title.
pub fn replay(replay: &Replay, found: &ReplayComparison, name: &str) -> TipPath {
    TipPath {
        title: format!("{}: {name}, replayed", replay.scene().name),
        desired: found.pairs.iter().map(|(seen, _)| seen.position).collect(),
        achieved: replay.tips().iter().map(|tip| tip.unwrap_or(NOWHERE)).collect(),
        names: ["observed", "model"],
        ..TipPath::default()
    }
}
