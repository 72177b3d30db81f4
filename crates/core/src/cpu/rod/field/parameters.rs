//! What parameters change: numbers of the rod by their sources, numbers of the field by their slots. F6

use super::acting::Acting;
use super::crossing::Crossing;
use super::map::Map;
use super::space::{Dipole, Local, Space, gradient};
use crate::cpu::algebra::{Mat3, Vec3, axpy};
use crate::cpu::contact::wall::WallChange;
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::source::{Sources, rate_under};
use crate::cpu::simd::lane::Lane;
use crate::model::{Axis, Slot, SourceForm};

/// How a dipole outside of the rod changes.
#[derive(Clone, Copy, Debug)]
struct DipoleChange<L> {
    number: usize,
    moves: bool,
    dX: Vec3<L>,
    turns: bool,
    dM: Vec3<L>,
    /// A rotation of the edges of a cuboid.
    dw: Option<Vec3<L>>,
}

/// How a map changes.
#[derive(Clone, Copy, Debug)]
enum MapChange<L> {
    /// The number of the map, and its factor's rate.
    Scale(usize, L),
    /// The number of the map, and its place's rate.
    Place(usize, Vec3<L>),
}

/// How the field changes.
#[derive(Clone, Debug)]
struct FieldChange<L> {
    has_gradient: bool,
    gradient: [L; 5],
    has_origin: bool,
    origin: Vec3<L>,
    dipoles: Vec<DipoleChange<L>>,
    maps: Vec<MapChange<L>>,
}

/// Three parameters.
pub struct Parameters<L> {
    pub sources: Sources<L>,
    /// How many of the three there are.
    pub count: usize,
    /// The first segment where they act, if they change the field alone.
    pub begin_at: Option<usize>,
    /// Numbers of the field that each moves.
    field: [FieldChange<L>; 3],
    /// Change of the force at the tip.
    pub df_tip: Mat3<L>,
    /// How each moves the wall.
    pub wall: [WallChange<L>; 3],
}

impl<L: Lane> Parameters<L> {
    pub fn new(token: L::Token) -> Self {
        let zero = L::splat(token, 0.0);
        let none = Vec3::splat(zero);
        let (gradient, dipoles, maps) = ([zero; 5], Vec::new(), Vec::new());
        let still = FieldChange { has_gradient: false, gradient, has_origin: false, origin: none, dipoles, maps };
        let field = [still.clone(), still.clone(), still];
        Self {
            sources: Sources::new(token),
            count: 0,
            begin_at: None,
            field,
            df_tip: Mat3::zero(zero),
            wall: [WallChange::none(zero); 3],
        }
    }

    /// Fills in up to three derivatives of the program, from number `first` on, of a rod under this share of its loads.
    #[inline(always)]
    pub fn load(&mut self, problem: &Problem<'_, L>, first: usize, share: Option<L>) {
        let Problem { program, inputs, .. } = *problem;
        let token = problem.token();
        let zero = L::splat(token, 0.0);
        let none = Vec3::splat(zero);
        self.sources.load((problem.program, &problem.inputs), problem.rod, first, share);
        self.count = program.derivatives.len().saturating_sub(first).min(3);
        // At the first segment the base may have moved.
        self.begin_at = Some(program.acts_from[first / 3]).filter(|at| *at > 0 && !self.sources.changed);
        self.df_tip = Mat3::zero(zero);
        self.wall = [WallChange::none(zero); 3];
        for change in &mut self.field {
            (change.has_gradient, change.gradient) = (false, [zero; 5]);
            (change.has_origin, change.origin) = (false, none);
            change.dipoles.clear();
            change.maps.clear();
        }
        for (k, terms) in program.derivatives.iter().skip(first).take(3).enumerate() {
            let (change, wall) = (&mut self.field[k], &mut self.wall[k]);
            for (slot, entry) in terms {
                let rate = rate_under(share, *slot, program.entry(token, &inputs, *entry));
                if let Slot::SourcePosition(number, _) | Slot::SourceMoment(number, _) | Slot::SourceTurn(number, _) =
                    *slot
                {
                    // Slots of a dipole follow one another.
                    if change.dipoles.last().is_none_or(|last| last.number != number) {
                        let still = DipoleChange { number, moves: false, dX: none, turns: false, dM: none, dw: None };
                        change.dipoles.push(still);
                    }
                }
                match *slot {
                    Slot::TipForce(axis) => self.df_tip[k] = self.df_tip[k] + unit(axis, rate),
                    Slot::FieldGradient(entry) => {
                        change.has_gradient = true;
                        change.gradient[entry.index()] = change.gradient[entry.index()] + rate;
                    }
                    Slot::FieldOrigin(axis) => {
                        change.has_origin = true;
                        change.origin = change.origin + unit(axis, rate);
                    }
                    Slot::SourcePosition(_, axis) => {
                        if let Some(dipole) = change.dipoles.last_mut() {
                            dipole.moves = true;
                            dipole.dX[axis.index()] = dipole.dX[axis.index()] + rate;
                        }
                    }
                    Slot::SourceMoment(_, axis) => {
                        if let Some(dipole) = change.dipoles.last_mut() {
                            dipole.turns = true;
                            dipole.dM[axis.index()] = dipole.dM[axis.index()] + rate;
                        }
                    }
                    Slot::SourceTurn(_, axis) => {
                        if let Some(dipole) = change.dipoles.last_mut() {
                            dipole.dw = Some(dipole.dw.unwrap_or(none) + unit(axis, rate));
                        }
                    }
                    Slot::WallPosition(axis) => wall.position = wall.position + unit(axis, rate),
                    Slot::WallRotation(axis) => wall.turn = wall.turn + unit(axis, rate),
                    Slot::WallAnchor(axis) => wall.anchor = wall.anchor + unit(axis, rate),
                    Slot::WallRadius => wall.radius = wall.radius + rate,
                    Slot::WallTipRadius => wall.tip_radius = wall.tip_radius + rate,
                    Slot::WallCompliance => wall.compliance = wall.compliance + rate,
                    Slot::MapScale(map) => change.maps.push(MapChange::Scale(map, rate)),
                    Slot::MapPosition(map, axis) => change.maps.push(MapChange::Place(map, unit(axis, rate))),
                    _ => {}
                }
            }
        }
    }

    /// dB and dG mu at a point that stands still, by parameter `k`; `kept` is what each dipole does there. F6
    #[inline(always)]
    pub fn field(&self, space: &Space<L>, k: usize, x: Vec3<L>, mu: Vec3<L>, kept: &[Local<L>]) -> (Vec3<L>, Vec3<L>) {
        let (mut dB, mut dF) = (self.sources.dB[k], Vec3::splat(x.x.constant(0.0)));
        let change = &self.field[k];
        if change.has_gradient {
            let dG = gradient(change.gradient);
            dB = dB + dG * (x - space.origin);
            dF = dF + dG * mu;
        }
        if change.has_origin {
            dB = dB - space.G * change.origin;
        }
        for dipole in &change.dipoles {
            if dipole.moves {
                let local = &kept[dipole.number];
                dB = dB - local.G * dipole.dX;
                dF = dF - local.T3 * dipole.dX;
            }
            let of_field = space.dipoles[dipole.number];
            let r = x - of_field.X;
            if let Some(dw) = dipole.dw {
                let (turn_B, turn_F) = of_field.by_turn(r, mu);
                (dB, dF) = (dB + turn_B * dw, dF + turn_F * dw);
            }
            if dipole.turns {
                if of_field.form != SourceForm::Point {
                    let (unit, pull) = of_field.by_moment(r, mu);
                    (dB, dF) = (dB + unit * dipole.dM, dF + pull * dipole.dM);
                    continue;
                }
                let turned = Dipole { M: dipole.dM, ..of_field };
                dB = dB + turned.B(r);
                dF = dF + turned.G(r) * mu;
            }
        }
        for change in &change.maps {
            let (of_B, of_F) = change.at(change.map(space), x, mu);
            (dB, dF) = (dB + of_B, dF + of_F);
        }
        (dB, dF)
    }

    /// What parameter `k` changes of B, of the force and of the force times xi at a rigid segment that stands still. F6
    #[inline(always)]
    pub fn acting(&self, k: usize, crossing: &Crossing<'_, L>, acting: &Acting<L>) -> (Vec3<L>, Vec3<L>, Vec3<L>) {
        let Crossing { space, segment, points, before, .. } = crossing;
        let (mu, arm, mean) = (crossing.dipole(), before.t * segment.length, crossing.mean());
        let none = Vec3::splat(mean.constant(0.0));
        let (mut dB, mut dF, mut first) = (self.sources.dB[k], none, none);
        let change = &self.field[k];
        if change.has_gradient {
            let dG = gradient(change.gradient);
            dB = dB + dG * (axpy(mean, arm, before.p) - space.origin);
            (dF, first) = (dG * mu, dG * mu * mean);
        }
        if change.has_origin {
            dB = dB - space.G * change.origin;
        }
        for dipole in &change.dipoles {
            let of_dipole = &acting.dipoles[dipole.number];
            if dipole.moves {
                dB = dB - of_dipole.G * dipole.dX;
                (dF, first) = (dF - of_dipole.T3[0] * dipole.dX, first - of_dipole.T3[1] * dipole.dX);
            }
            if dipole.turns {
                dB = dB + of_dipole.unit * dipole.dM;
                (dF, first) = (dF + of_dipole.pull[0] * dipole.dM, first + of_dipole.pull[1] * dipole.dM);
            }
            if let Some(dw) = dipole.dw {
                dB = dB + of_dipole.turn_B * dw;
                (dF, first) = (dF + of_dipole.turn_F[0] * dw, first + of_dipole.turn_F[1] * dw);
            }
        }
        for change in &change.maps {
            let map = change.map(space);
            for (xi, share) in map.places(before.p, arm, points) {
                let (of_B, of_F) = change.at(map, axpy(xi, arm, before.p), mu);
                (dB, dF) = (axpy(share, of_B, dB), axpy(share, of_F, dF));
                first = axpy(share * xi, of_F, first);
            }
        }
        (dB, dF, first)
    }
}

impl<L: Lane> MapChange<L> {
    fn map<'a>(&self, space: &'a Space<L>) -> &'a Map<L> {
        let (MapChange::Scale(number, _) | MapChange::Place(number, _)) = *self;
        &space.maps[number]
    }

    /// The rates of B at a fixed point and of the force on a dipole there.
    #[inline(always)]
    fn at(&self, map: &Map<L>, x: Vec3<L>, mu: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        match *self {
            MapChange::Scale(_, rate) => {
                let local = map.local(x, 2);
                (local.B * rate, local.G * mu * rate)
            }
            MapChange::Place(_, dX) => {
                let local = map.local(x, 3);
                (-(local.G * dX * map.scale), -(local.T3(mu) * dX * map.scale))
            }
        }
    }
}

#[inline(always)]
fn unit<L: Lane>(axis: Axis, by: L) -> Vec3<L> {
    let mut v = Vec3::splat(by.constant(0.0));
    v[axis.index()] = by;
    v
}
