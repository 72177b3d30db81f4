//! The rod in a field that varies, its state with the internal force, and what may change.

use super::field::{Field, FieldChange};
use crate::model::{Rod, RodField, Slot, Units};
use crate::reference::chain::{Chain, Variation, nu};
use nalgebra::{Matrix3, Vector3, Vector6};

/// A chain in a field that varies in space. Its own field is B0 and its own internal forces are not used.
#[derive(Clone, Debug)]
pub(super) struct Varying {
    pub chain: Chain,
    pub field: Field,
}

/// A direction in which it changes, the force at the base held but for `dn0`.
#[derive(Clone, Debug)]
pub(super) struct Change {
    pub of: Variation,
    pub dn0: Vector3<f64>,
    pub field: FieldChange,
}

/// Change of the state along a direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Column {
    pub w: Vector3<f64>,
    pub dp: Vector3<f64>,
    pub dm_body: Vector3<f64>,
    pub dn: Vector3<f64>,
}

/// State at one point of the rod.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub p: Vector3<f64>,
    pub R: Matrix3<f64>,
    pub m_body: Vector3<f64>,
    pub n: Vector3<f64>,
    pub columns: Vec<Column>,
}

/// The unknown: force (world frame) and moment (body frame) at the base. F5
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BaseLoad {
    pub n: Vector3<f64>,
    pub m_body: Vector3<f64>,
}

impl BaseLoad {
    pub(super) fn zero() -> Self {
        Self { n: Vector3::zeros(), m_body: Vector3::zeros() }
    }

    pub(super) fn moved(&self, step: &Vector6<f64>) -> Self {
        Self { n: self.n + step.fixed_rows::<3>(0), m_body: self.m_body + step.fixed_rows::<3>(3) }
    }

    pub(super) fn norm(&self) -> f64 {
        self.n.norm().hypot(self.m_body.norm())
    }
}

impl Varying {
    /// `None` for a rod in a uniform field without a wall.
    pub(super) fn new(rod: &Rod, units: &Units) -> Option<Self> {
        let chain = Chain::new(rod, units);
        let of_rod = rod.field.clone().or_else(|| rod.wall.map(|_| RodField::none()))?;
        let field = Field::new(&of_rod, chain.numbers.B, rod.base_position.into(), units);
        Some(Self { chain, field })
    }

    /// The same rod under a share of its loads, its dipoles among them; the field stays.
    pub(super) fn loaded(&self, lambda: f64) -> Self {
        Self { chain: self.chain.loaded(lambda), field: self.field.clone() }
    }

    /// Unit changes of the unknown.
    pub(super) fn base_changes(&self) -> Vec<Change> {
        let still = Change { of: self.chain.no_variation(), dn0: Vector3::zeros(), field: FieldChange::default() };
        let by_force = |k: usize| Change { dn0: Vector3::ith(k, 1.0), ..still.clone() };
        let mut all: Vec<Change> = (0..3).map(by_force).collect();
        all.extend(self.chain.base_moment_variations().map(|of| Change { of, ..still.clone() }));
        all
    }

    /// Growth of all loads together; `self` is the rod under its full load.
    pub(super) fn load_change(&self, lambda: f64) -> Change {
        let of = self.chain.load_variation(lambda);
        Change { of, dn0: Vector3::zeros(), field: FieldChange::default() }
    }

    /// Unit change of a slot, the load at the base held.
    pub(super) fn slot_change(&self, slot: Slot, base: &BaseLoad) -> Change {
        let mut of = self.chain.slot_variation(slot, base.m_body);
        if slot == Slot::Insertion {
            of.dp0 = self.tangent_base(base);
        }
        Change { of, dn0: Vector3::zeros(), field: FieldChange::of(slot) }
    }

    /// p' at the base.
    pub(super) fn tangent_base(&self, base: &BaseLoad) -> Vector3<f64> {
        let R0 = self.chain.R0;
        R0 * nu(self.chain.numbers.segments[0].C_se, R0.tr_mul(&base.n))
    }

    /// The state at the base.
    pub(super) fn base_state(&self, base: &BaseLoad, changes: &[Change]) -> State {
        let column = |c: &Change| Column { w: c.of.w0, dp: c.of.dp0, dm_body: c.of.dm0_body, dn: c.dn0 };
        let columns = changes.iter().map(column).collect();
        State { p: Vector3::zeros(), R: self.chain.R0, m_body: base.m_body, n: base.n, columns }
    }
}
