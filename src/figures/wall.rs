//! The wall of a scene beside one rod, and beside many.

use crate::draw::{DrawnWall, WallPress};
use crate::model::WallParameter::{Anchor, Friction};
use crate::model::{Parameter, Scene, TipOnWall};
use crate::study::{ControlRun, Solved};

/// The wall of a solved scene, with what it does to the tip.
pub(super) fn wall(solved: &Solved) -> Option<DrawnWall> {
    let wall = solved.scene().wall.as_ref()?;
    let is_held = matches!(wall.tip, TipOnWall::Sticks(_));
    let press = solved.contact().filter(|contact| contact.touching).map(|contact| WallPress {
        force: contact.force,
        normal: contact.normal,
        friction: wall.friction.filter(|_| is_held),
        friction_ratio: contact.friction_ratio,
    });
    Some(DrawnWall { wall: wall.rod_wall(), press })
}

/// The wall without forces; `None` where one of these parameters moves it.
pub(super) fn still_wall(scene: &Scene, varied: impl IntoIterator<Item = Parameter>) -> Option<DrawnWall> {
    let moves = |parameter: Parameter| matches!(parameter, Parameter::Wall(of) if !matches!(of, Anchor(_) | Friction));
    let wall = scene.wall.as_ref().filter(|_| !varied.into_iter().any(moves))?;
    Some(DrawnWall { wall: wall.rod_wall(), press: None })
}

/// The wall along the way of a rod that is commanded.
pub(super) fn wall_of_run(run: &ControlRun) -> Option<DrawnWall> {
    still_wall(run.scene(), run.inputs().iter().map(|input| input.parameter))
}
