//! The wall of a plan. W1

use crate::model::record::wall_offset;
use crate::model::{Plan, Surface, WallKind};

/// The wall of a program.
#[derive(Clone, Copy, Debug)]
pub struct ProgramWall {
    /// First entry of its record.
    pub entry: usize,
    pub kind: WallKind,
}

impl ProgramWall {
    /// That of a plan with a wall.
    pub fn new(plan: &Plan) -> Self {
        let rod = plan.scene.rod();
        let usual = WallKind { surface: Surface::Plane, outside: false, sticks: false, yields: false };
        Self { entry: wall_offset(&rod), kind: rod.wall.map_or(usual, |wall| wall.kind) }
    }
}
