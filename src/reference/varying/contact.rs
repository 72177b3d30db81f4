//! The tip on a wall: the conditions that tell the wall's force, and how they change. W1 to W4
//!
//! The force is an unknown of its own beside the load at the base: its size where the tip slides, its components where it is
//! held. In the units of the chain, positions from the base.

use super::passage::Passage;
use super::state::Column;
use crate::model::{Axis, Rod, RodWall, Slot, Status, Surface, Units, Vector};
use nalgebra::{DMatrix, DVector, Dyn, LU, Matrix3, Vector3, Vector6};

/// No part of the rod but its tip may be farther in the wall, as a share of the length.
const IN_THE_WALL: f64 = 1e-6;
/// Nearer to a cylinder's axis or a sphere's centre, over the length, the normal is not told.
const AT_CENTRE: f64 = 1e-9;

/// Gap, normal, and how the normal follows the point. W1
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    pub g: f64,
    pub n: Vector3<f64>,
    pub G: Matrix3<f64>,
}

/// A wall, and where on it the tip is held.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    wall: RodWall,
    /// Where the tip is held.
    foot: Vector3<f64>,
}

/// A wall that presses with a force.
#[derive(Clone, Debug)]
pub(super) struct Touch {
    pub contact: Contact,
    /// Along the normal, or the components of the force.
    pub strength: DVector<f64>,
    /// What its conditions are shifted by while the wall comes. W4
    pub shift: DVector<f64>,
    /// Compliance added to that of the tissue while a held tip is drawn to its point. W4
    pub softness: f64,
}

/// What the wall does to displacements of the tip.
#[derive(Clone, Debug)]
pub(super) struct Hold {
    /// Directions in which it gives way by the compliance.
    pub directions: Vec<Vector3<f64>>,
    pub compliance: f64,
    /// Twice the energy of a displacement by the wall's curvature.
    pub curvature: Matrix3<f64>,
}

/// How gap, normal, foot and compliance change where the tip stands still.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WallChange {
    dg: f64,
    dn: Vector3<f64>,
    dfoot: Vector3<f64>,
    dc: f64,
}

/// Newton's system of a rod: of its tip and, where a wall presses, of the wall.
pub(super) struct Balance {
    pub residual: DVector<f64>,
    matrix: DMatrix<f64>,
    factors: LU<f64, Dyn, Dyn>,
}

fn joined(first: &Vector6<f64>, then: &[f64]) -> DVector<f64> {
    DVector::from_iterator(6 + then.len(), first.iter().chain(then).copied())
}

impl Contact {
    pub(super) fn new(wall: &RodWall, base: Vector, units: &Units) -> Self {
        let place = |p: Vector| std::array::from_fn(|k| (p[k] - base[k]) / units.length);
        let wall = RodWall {
            position: place(wall.position),
            anchor: place(wall.anchor),
            radius: wall.radius / units.length,
            tip_radius: wall.tip_radius / units.length,
            compliance: wall.compliance * units.force / units.length,
            ..*wall
        };
        Self { wall, foot: wall.foot(wall.anchor).into() }
    }

    /// `None` for a rod without a wall.
    pub(super) fn of(rod: &Rod, units: &Units) -> Option<Self> {
        Some(Self::new(rod.wall.as_ref()?, rod.base_position, units))
    }

    pub(super) fn sticks(&self) -> bool {
        self.wall.kind.sticks
    }

    pub(super) fn compliance(&self) -> f64 {
        self.wall.compliance
    }

    pub(super) fn gap(&self, at: Vector3<f64>) -> Gap {
        let found = self.wall.gap(at.into());
        Gap { g: found.gap, n: found.normal.into(), G: Matrix3::from_fn(|row, col| found.curvature[row][col]) }
    }

    /// Whether gap and normal are told at a point.
    pub(super) fn has_normal(&self, at: Vector3<f64>) -> bool {
        let Gap { g, n, G } = self.gap(at);
        // Also false for NaN.
        let is_far = G.amax() * AT_CENTRE <= 1.0;
        is_far && g.is_finite() && n.iter().all(|x| x.is_finite())
    }

    /// Why a tip cannot be held there, if it cannot. The rod is of length 1.
    pub(super) fn refusal(&self) -> Option<Status> {
        match self.sticks() {
            true if !self.has_normal(self.wall.anchor.into()) => Some(Status::BadParameter),
            true if self.compliance() == 0.0 && self.foot.norm() > 1.0 => Some(Status::OutOfReach),
            _ => None,
        }
    }

    /// How far a tip there is from where the wall wants it, and how that falls as the wall comes. W4
    pub(super) fn distance(&self, p_free: Vector3<f64>) -> DVector<f64> {
        match self.sticks() {
            true => DVector::from_column_slice((p_free - self.foot).as_slice()),
            false => DVector::from_element(1, self.gap(p_free).g.abs()),
        }
    }

    /// Compliance added at the start of the way, from that of the free tip. It is zero unless the rod is straight: no force on the end of
    /// such a rod draws that inward, unless it buckles. W4
    pub(super) fn softness(&self, dp_df: &Matrix3<f64>) -> f64 {
        let size = dp_df.trace();
        let held = dp_df + Matrix3::from_diagonal_element(self.compliance());
        let is_straight = held.determinant() < RodWall::STRAIGHT * size.powi(3);
        if self.sticks() && is_straight { RodWall::SOFTNESS * size } else { 0.0 }
    }

    /// Whether another part of the rod than its tip is in the wall.
    pub(super) fn is_through(body_gap: f64) -> bool {
        body_gap < -IN_THE_WALL
    }

    /// Unit change of a slot, for a tip at `p`.
    pub(super) fn change(&self, slot: Slot, p: Vector3<f64>) -> WallChange {
        let (dg, dn) = self.gap_change(slot, p);
        let dc = if slot == Slot::WallCompliance { 1.0 } else { 0.0 };
        if !self.sticks() {
            return WallChange { dg, dn, dc, ..WallChange::default() };
        }
        let anchor = Vector3::from(self.wall.anchor);
        let Gap { g, n, G } = self.gap(anchor);
        let da = if let Slot::WallAnchor(axis) = slot { unit(axis) } else { Vector3::zeros() };
        let (dg_anchor, dn_anchor) = self.gap_change(slot, anchor);
        let dfoot = da - n * (n.dot(&da) + dg_anchor) - g * (G * da + dn_anchor);
        WallChange { dg, dn, dfoot, dc }
    }

    /// dg and dn at a point that stands still.
    fn gap_change(&self, slot: Slot, at: Vector3<f64>) -> (f64, Vector3<f64>) {
        let Gap { n, G, .. } = self.gap(at);
        let none = Vector3::zeros();
        match slot {
            Slot::WallPosition(axis) => (-n.dot(&unit(axis)), -G * unit(axis)),
            Slot::WallRotation(axis) => {
                let moved = unit(axis).cross(&(at - Vector3::from(self.wall.position)));
                (-n.dot(&moved), unit(axis).cross(&n) - G * moved)
            }
            Slot::WallRadius if self.wall.kind.surface == Surface::Plane => (0.0, none),
            Slot::WallRadius => (if self.wall.kind.outside { -1.0 } else { 1.0 }, none),
            Slot::WallTipRadius => (-1.0, none),
            _ => (0.0, none),
        }
    }
}

fn unit(axis: Axis) -> Vector3<f64> {
    Vector3::ith(axis.index(), 1.0)
}

impl Touch {
    /// A wall that does not press yet, with its conditions shifted so that they hold where the tip is.
    pub(super) fn before(contact: Contact, p_free: Vector3<f64>) -> Self {
        let shift = contact.distance(p_free);
        Self { contact, strength: DVector::zeros(shift.len()), shift, softness: 0.0 }
    }

    /// The wall in its place, pressing with the force that the rod has at its end beyond that of the loads.
    pub(super) fn of_force(contact: Contact, p: Vector3<f64>, f: Vector3<f64>) -> Self {
        let strength = match contact.sticks() {
            true => DVector::from_column_slice(f.as_slice()),
            false => DVector::from_element(1, f.dot(&contact.gap(p).n)),
        };
        let shift = DVector::zeros(strength.len());
        Self { contact, strength, shift, softness: 0.0 }
    }

    pub(super) fn count(&self) -> usize {
        self.strength.len()
    }

    pub(super) fn set_out(&self, shift: DVector<f64>, softness: f64) -> Self {
        Self { shift, softness, ..self.clone() }
    }

    fn compliance(&self) -> f64 {
        self.contact.compliance() + self.softness
    }

    pub(super) fn moved(&self, step: &DVector<f64>) -> Self {
        Self { strength: &self.strength + step.rows(6, self.count()), ..self.clone() }
    }

    /// Force on a tip at `p`. W2
    pub(super) fn force(&self, p: Vector3<f64>) -> Vector3<f64> {
        match self.contact.sticks() {
            true => Vector3::new(self.strength[0], self.strength[1], self.strength[2]),
            false => self.strength[0] * self.contact.gap(p).n,
        }
    }

    /// The rows of the tip with the wall's force, then those of the wall. W3
    fn residual(&self, passage: &Passage) -> DVector<f64> {
        let (p, c) = (passage.tip.p, self.compliance());
        let mut r = passage.residual;
        let unforced: Vector3<f64> = r.fixed_rows::<3>(0) - self.force(p);
        r.fixed_rows_mut::<3>(0).copy_from(&unforced);
        let mut own = c * &self.strength;
        match self.contact.sticks() {
            true => {
                own -= &self.shift;
                own += DVector::from_column_slice((p - self.contact.foot).as_slice());
            }
            false => own[0] += self.contact.gap(p).g + self.shift[0],
        }
        joined(&r, own.as_slice())
    }

    /// How those change with a column at the tip, and with the wall.
    pub(super) fn change(
        &self,
        p: Vector3<f64>,
        column: &Column,
        dresidual: &Vector6<f64>,
        of: &WallChange,
    ) -> DVector<f64> {
        let mut r = *dresidual;
        if self.contact.sticks() {
            let own: Vector3<f64> = column.dp - of.dfoot + of.dc * self.force(p);
            return joined(&r, own.as_slice());
        }
        let (Gap { n, G, .. }, lambda) = (self.contact.gap(p), self.strength[0]);
        let turned: Vector3<f64> = r.fixed_rows::<3>(0) - lambda * (G * column.dp + of.dn);
        r.fixed_rows_mut::<3>(0).copy_from(&turned);
        joined(&r, &[n.dot(&column.dp) + of.dg + of.dc * lambda])
    }

    /// How they change with the force, column k.
    fn by_strength(&self, p: Vector3<f64>, k: usize) -> DVector<f64> {
        let direction = if self.contact.sticks() { Vector3::ith(k, 1.0) } else { self.contact.gap(p).n };
        let mut by = DVector::zeros(6 + self.count());
        by.rows_mut(0, 3).copy_from(&-direction);
        by[6 + k] = self.compliance();
        by
    }

    /// Change of force along the normal and of the force, by those of the tip, the force and the wall.
    pub(super) fn force_change(
        &self,
        p: Vector3<f64>,
        dp: Vector3<f64>,
        by: &DVector<f64>,
        of: &WallChange,
    ) -> (f64, Vector3<f64>) {
        let Gap { n, G, .. } = self.contact.gap(p);
        let dn = G * dp + of.dn;
        if self.contact.sticks() {
            let df = Vector3::new(by[6], by[7], by[8]);
            return (n.dot(&df) + dn.dot(&self.force(p)), df);
        }
        (by[6], by[6] * n + self.strength[0] * dn)
    }

    /// What the wall does to displacements of a tip at `p`.
    pub(super) fn hold(&self, p: Vector3<f64>) -> Hold {
        let compliance = self.compliance();
        if self.contact.sticks() {
            let directions = (0..3).map(|k| Vector3::ith(k, 1.0)).collect();
            return Hold { directions, compliance, curvature: Matrix3::zeros() };
        }
        let Gap { n, G, .. } = self.contact.gap(p);
        Hold { directions: vec![n], compliance, curvature: -self.strength[0] * G }
    }
}

impl Balance {
    /// The system of a passage, the first six columns of which must be those of the load at the base.
    pub(super) fn new(passage: &Passage, touch: Option<&Touch>) -> Self {
        let none = [0.0; 0];
        let residual = touch.map_or_else(|| joined(&passage.residual, &none), |touch| touch.residual(passage));
        let mut columns: Vec<DVector<f64>> =
            (0..6).map(|k| Self::change(passage, touch, k, &WallChange::default())).collect();
        if let Some(touch) = touch {
            columns.extend((0..touch.count()).map(|k| touch.by_strength(passage.tip.p, k)));
        }
        let matrix = DMatrix::from_columns(&columns);
        let factors = matrix.clone().lu();
        Self { residual, matrix, factors }
    }

    /// How the residual changes with a column of the passage.
    pub(super) fn change(passage: &Passage, touch: Option<&Touch>, column: usize, of: &WallChange) -> DVector<f64> {
        let (at, dresidual) = (&passage.tip.columns[column], &passage.dresidual[column]);
        touch.map_or_else(|| joined(dresidual, &[]), |touch| touch.change(passage.tip.p, at, dresidual, of))
    }

    /// Change of the unknown that makes up for a change of the residual; `None` where the system is singular.
    pub(super) fn answer(&self, change: &DVector<f64>) -> Option<DVector<f64>> {
        self.factors.solve(&-change)
    }

    /// Newton's step.
    pub(super) fn step(&self) -> Option<DVector<f64>> {
        self.answer(&self.residual)
    }

    pub(super) fn inverse(&self) -> Option<DMatrix<f64>> {
        self.matrix.clone().try_inverse()
    }

    /// d(m0)/d(l_tip), with the wall in its place. W5
    pub(super) fn moment_inverse(&self) -> Option<Matrix3<f64>> {
        Some(self.inverse()?.fixed_view::<3, 3>(3, 3).into())
    }

    pub(super) fn determinant(&self) -> f64 {
        self.matrix.determinant()
    }
}

/// The part of an unknown that is the load at the base.
pub(super) fn of_base(unknown: &DVector<f64>) -> Vector6<f64> {
    unknown.fixed_rows::<6>(0).into()
}
