//! Points along the rods of many rows, integrated by the reference from the base moments that the rows hold.

use crate::model::{Batch, Parameter, Plan, PlanError, PlanOptions, Rod, Scene, Slot, Vector};
use crate::reference::{Pose, PoseDerivative, shape_with_derivatives};

/// Points at shares of a rod's length, for many rods of one scene whose base moments are known.
pub struct RodPoints {
    plan: Plan,
    slots: Vec<Slot>,
    /// Of the length, from 0 to 1.
    shares: Vec<f64>,
}

impl RodPoints {
    /// So many points at equal shares of the length, with slopes by `wrt`, of rods with these values varied. The last is
    /// the tip; the base is left out.
    ///
    /// # Errors
    ///
    /// A scene or parameters that make no plan.
    pub fn new(
        scene: &Scene,
        axes: &[Vec<Parameter>],
        wrt: &[Parameter],
        count: usize,
    ) -> Result<RodPoints, PlanError> {
        let shares = (1..=count).map(|k| k as f64 / count as f64).collect();
        RodPoints::at(scene, axes, wrt, shares)
    }

    /// Points at these shares of the length, from 0 at the base to 1 at the tip.
    ///
    /// # Errors
    ///
    /// A scene or parameters that make no plan.
    pub fn at(
        scene: &Scene,
        axes: &[Vec<Parameter>],
        wrt: &[Parameter],
        shares: Vec<f64>,
    ) -> Result<RodPoints, PlanError> {
        let plan = Plan::new(scene, axes, wrt, PlanOptions::default())?;
        Ok(RodPoints { slots: plan.slots(), plan, shares })
    }

    /// What [`RodPoints::of`] reads rods from: the values of each axis by row.
    pub fn batch(&self, rows: usize, values: impl Fn(usize, &mut [f64]) + Sync) -> Batch {
        self.plan.batch(rows, values)
    }

    /// The points of a row with its base moment (N·m, world frame); each has one derivative for each parameter. They are
    /// those of the point at this share of the length, whatever the material there. `None` where there is no such rod, and beside a
    /// wall, whose force the moment does not tell.
    pub fn of(&self, batch: &Batch, row: usize, m0: Vector) -> Option<Vec<Pose>> {
        if batch.bad[row] || !m0.iter().all(|x| x.is_finite()) {
            return None;
        }
        let rod = self.plan.sample_rod(batch, row);
        if rod.wall.is_some() {
            return None;
        }
        let length = rod.total_length();
        let at: Vec<f64> = self.shares.iter().map(|share| share * length).collect();
        let mut points = shape_with_derivatives(&rod, m0, &at, &self.slots)?;
        for (point, share) in points.iter_mut().zip(&self.shares) {
            for (slot, derivative) in self.slots.iter().zip(&mut point.derivatives) {
                slide(&rod, *slot, *share, point.arc_length, point.tangent, derivative);
            }
            point.derivatives = by_parameter(&self.plan, batch, row, &self.slots, &point.derivatives);
        }
        Some(points)
    }
}

/// From the position of a point of the material to that of the point at a share of the length, where the length changes.
fn slide(rod: &Rod, slot: Slot, share: f64, arc_length: f64, tangent: Vector, derivative: &mut PoseDerivative) {
    let carried = match slot {
        Slot::Insertion => 1.0,
        Slot::Length(segment) => {
            let end: f64 = rod.segments[..=segment].iter().map(|segment| segment.length()).sum();
            if arc_length > end { 1.0 } else { 0.0 }
        }
        _ => return,
    };
    derivative.dp.iter_mut().zip(tangent).for_each(|(dp, tangent)| *dp += (share - carried) * tangent);
}

/// Adds a multiple of one derivative to another.
pub(super) fn add(to: &mut PoseDerivative, rate: f64, of: &PoseDerivative) {
    for axis in 0..3 {
        to.dp[axis] += rate * of.dp[axis];
        to.w[axis] += rate * of.w[axis];
        to.du[axis] += rate * of.du[axis];
    }
}

/// The chain rule: from derivatives by slots to those by the plan's parameters.
pub(super) fn by_parameter(
    plan: &Plan,
    batch: &Batch,
    row: usize,
    slots: &[Slot],
    of_slots: &[PoseDerivative],
) -> Vec<PoseDerivative> {
    let total = |terms: &[(Slot, usize)]| {
        let mut sum = PoseDerivative::default();
        for (slot, entry) in terms {
            let rate = plan.entry(batch, row, *entry);
            let of_slot = slots.iter().position(|other| other == slot).map(|at| of_slots[at]).unwrap_or_default();
            add(&mut sum, rate, &of_slot);
        }
        sum
    };
    plan.derivatives.iter().map(|derivative| total(&derivative.terms)).collect()
}
