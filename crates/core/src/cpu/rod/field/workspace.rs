//! What a pass carries along, and what it leaves behind.

use super::acting::Acting;
use super::first::First;
use super::index::Transfer;
use super::matrix::Mat6;
use super::parameters::Parameters;
use super::space::Space;
use super::state::{Columns, State};
use super::step::Room;
use crate::cpu::algebra::Vec3;
use crate::cpu::contact::wall::Wall;
use crate::cpu::rod::program::Program;
use crate::cpu::rod::step::Stages;
use crate::cpu::simd::lane::Lane;

/// What a pass carries along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carried {
    /// The state alone.
    State,
    /// The same, and how near the rod comes to the wall.
    Watched,
    /// The same, and how near it comes to magnets.
    Place,
    /// Columns by the load at the base.
    Base,
    /// The transfer of every interval, and their product.
    Transfers,
    /// The same, and forward columns of the parameters.
    Parameters,
    /// Columns by the load at the base and of the parameters, without transfers.
    Columns,
}

impl Carried {
    pub fn has_columns(self) -> bool {
        !matches!(self, Carried::State | Carried::Watched | Carried::Place)
    }

    pub fn has_transfers(self) -> bool {
        matches!(self, Carried::Transfers | Carried::Parameters)
    }

    /// By the load at the base, all the way.
    pub fn has_base(self) -> bool {
        matches!(self, Carried::Base | Carried::Columns)
    }

    pub fn has_parameters(self) -> bool {
        matches!(self, Carried::Parameters | Carried::Columns)
    }
}

/// Memory of the kernel.
pub struct VaryingWorkspace<L: Lane> {
    pub space: Space<L>,
    pub room: Room<L>,
    /// Of a rigid segment.
    pub acting: Acting<L>,
    pub parameters: Vec<Parameters<L>>,
    /// Of the last pass: the tip, how its pose and its residual follow the load at the base, each interval.
    pub tip: State<L>,
    pub pose: Mat6<L>,
    pub matrix: Mat6<L>,
    pub transfers: Vec<Transfer<L>>,
    /// Its columns by parameters, three each.
    pub columns: Vec<Columns<L>>,
    /// Where the first flexible segment of the rod starts, if a rigid one comes before it.
    pub first: First<L>,
    /// How far the tip may move before any part of the rod is within the clearance of a magnet, if each moves in proportion to
    /// its share of the rod. Negative where one is.
    pub leeway: L,
    /// How far the magnetic parts of the rod are inside of every map.
    pub inside: L,
    /// Where the scene has one.
    pub wall: Option<Wall<L>>,
    /// Place and moment at both ends of every flexible segment, where a pass asks for [`What::Place`].
    pub moments: Vec<(Vec3<L>, Vec3<L>)>,
}

impl<L: Lane> VaryingWorkspace<L> {
    pub fn new(token: L::Token, program: &Program) -> Self {
        let zero = L::splat(token, 0.0);
        let v = Vec3::splat(zero);
        let threes = if program.field.is_some() { program.derivatives.len().div_ceil(3) } else { 0 };
        Self {
            space: Space::new(zero),
            room: Room::new(Stages::new(token, program.fine.tableau), zero),
            acting: Acting::new(zero),
            parameters: (0..threes).map(|_| Parameters::new(token)).collect(),
            tip: State { p: v, d1: v, t: v, m: v, n: v },
            pose: Mat6::zero(zero),
            matrix: Mat6::zero(zero),
            transfers: Vec::new(),
            columns: Vec::new(),
            first: First::new(zero),
            leeway: zero,
            inside: zero,
            wall: None,
            moments: Vec::new(),
        }
    }
}
