//! Tips on a wall and tips before it: a surface and a body, of which a map can hold one.

use super::dimension::Dimension;
use super::error::WorkspaceError;
use super::step::Singular;
use super::tip_map::Tip;
use crate::model::{Scene, TipOnWall};

/// A sentence where some tips slide on a wall and others do not touch it; `None` where all do, or none.
///
/// # Errors
///
/// Half of the tips or more lie on the wall, and others fill a body before it.
pub(super) fn on_and_before(
    scene: &Scene,
    tips: &[Tip],
    dimension: &Dimension,
    input_count: usize,
) -> Result<Option<String>, WorkspaceError> {
    let slides = scene.wall.is_some_and(|wall| wall.tip == TipOnWall::Slides);
    let usable = || tips.iter().filter(|tip| tip.usable);
    let (all, touching) = (usable().count(), usable().filter(|tip| tip.normal_force > 0.0).count());
    if !slides || touching == 0 || touching == all {
        return Ok(None);
    }
    let fills = |tip: &&Tip| Singular::new(&tip.jacobian[..input_count]).values[2] > dimension.least;
    let before = usable().filter(|tip| tip.normal_force <= 0.0).filter(fills).count();
    if before == 0 {
        return Ok(None);
    }
    if 2 * touching >= all {
        return Err(WorkspaceError::OnAndBeforeWall { touching, before });
    }
    Ok(Some(format!(
        "{touching} of {all} samples touch the wall: what is measured is the body before it, which ends there"
    )))
}
