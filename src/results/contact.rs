//! The contact of a row's tip with the wall, and what follows from it.

use crate::model::{ContactColumn, Plan, Quantity, Rod, Scene, Solutions, TipOnWall, Vector, Wall};

/// The contact of a tip with the wall of its scene; SI units, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Contact {
    /// Whether the wall presses; always of a held tip.
    pub touching: bool,
    /// Between the tip's ball and the wall; negative where tissue yields (m).
    pub gap: f64,
    /// Of the wall on the rod, along the normal; a wall that holds the tip may pull (N).
    pub normal_force: f64,
    /// Of the wall on the rod (N).
    pub force: Vector,
    /// From the wall to where the rod is, at the tip.
    pub normal: Vector,
    /// Force along the wall over the normal force: the least coefficient of friction that holds the tip. `None` where the wall does
    /// not press.
    pub friction_ratio: Option<f64>,
    /// Whether the wall's friction holds the tip; `None` of a sliding tip, and where no coefficient is given.
    pub holds: Option<bool>,
    /// Between the direction into the wall and the tip's tangent: 0 where the rod meets the wall at a right angle (rad).
    pub angle: f64,
    /// Least gap of the rod beyond where it first is before the wall, plus what tissue yields; 0 where the tip is nearest (m).
    pub body_gap: f64,
    /// Estimated error of the force (N).
    pub force_error: f64,
}

/// A number of a contact that has a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ContactNumber {
    Gap,
    NormalForce,
    /// Along x, y or z.
    Force(usize),
    FrictionRatio,
    Angle,
    BodyGap,
    ForceError,
}

/// A yes or no of a contact that has a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ContactFlag {
    Touching,
    Holds,
}

impl Contact {
    /// What a column holds of it; NaN where that is not known.
    pub(crate) fn number(&self, number: ContactNumber) -> f64 {
        match number {
            ContactNumber::Gap => self.gap,
            ContactNumber::NormalForce => self.normal_force,
            ContactNumber::Force(axis) => self.force[axis],
            ContactNumber::FrictionRatio => self.friction_ratio.unwrap_or(f64::NAN),
            ContactNumber::Angle => self.angle,
            ContactNumber::BodyGap => self.body_gap,
            ContactNumber::ForceError => self.force_error,
        }
    }

    /// The same of a yes or no.
    pub(crate) fn flag(&self, flag: ContactFlag) -> Option<bool> {
        match flag {
            ContactFlag::Touching => Some(self.touching),
            ContactFlag::Holds => self.holds,
        }
    }

    /// That of a row of some solutions of a plan; `None` where the scene has no wall, or the row is no equilibrium.
    pub(crate) fn of(plan: &Plan, solutions: &Solutions, row: usize) -> Option<Contact> {
        Contact::beside(plan.scene.wall.as_ref(), solutions, row)
    }

    /// That of a row beside a wall; `None` without one, or where the row is no equilibrium.
    pub(crate) fn beside(wall: Option<&Wall>, solutions: &Solutions, row: usize) -> Option<Contact> {
        let wall = wall?;
        if !solutions.is_equilibrium(row) {
            return None;
        }
        let is_held = matches!(wall.tip, TipOnWall::Sticks(_));
        let number = |column| solutions.contact(row, column);
        let vector = |column| solutions.contact_vector(row, column);
        let (normal_force, force) = (number(ContactColumn::NormalForce), vector(ContactColumn::Force));
        let (normal, friction) = (vector(ContactColumn::Normal), number(ContactColumn::Friction));
        // A tip that slides has no force along the wall but for round-off.
        let friction_ratio = match is_held {
            true => friction_ratio(&force, normal_force, &normal),
            false => (normal_force > 0.0).then_some(0.0),
        };
        let holds = (is_held && friction >= 0.0).then(|| friction_ratio.is_some_and(|ratio| ratio <= friction));
        Some(Contact {
            touching: number(ContactColumn::Touching) == 1.0,
            gap: number(ContactColumn::Gap),
            normal_force,
            force,
            normal,
            friction_ratio,
            holds,
            angle: angle(&normal, &solutions.vector(row, Quantity::TipTangent)),
            body_gap: number(ContactColumn::BodyGap),
            force_error: number(ContactColumn::ForceError),
        })
    }
}

/// The rod of a scene as its shape follows from the base moment: the force of the wall acts as a dead force at its tip.
pub(crate) fn pressed(mut rod: Rod, scene: &Scene, contact: Option<&Contact>) -> Rod {
    let Some(contact) = contact else { return rod };
    rod.wall = None;
    for (axis, force) in contact.force.into_iter().enumerate() {
        rod.tip_force[axis] += force;
    }
    if !scene.sources.varies() {
        rod.field = None;
    }
    rod
}

/// Force along the wall over the normal force, where that presses.
fn friction_ratio(force: &Vector, normal_force: f64, normal: &Vector) -> Option<f64> {
    let along: Vector = std::array::from_fn(|k| force[k] - normal_force * normal[k]);
    (normal_force > 0.0).then(|| size(&along) / normal_force)
}

/// Between the direction into the wall and a tangent; exact near 0 and near a right angle, as an arc cosine is not.
fn angle(normal: &Vector, tangent: &Vector) -> f64 {
    let [a, b] = [normal, tangent];
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let along: f64 = (0..3).map(|k| -a[k] * b[k]).sum();
    size(&cross).atan2(along)
}

fn size(v: &Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::{angle, friction_ratio};
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_tip_that_points_into_the_wall_has_no_angle() {
        assert_eq!(angle(&[0.0, 0.0, -1.0], &[0.0, 0.0, 1.0]), 0.0);
        assert_eq!(angle(&[0.0, 0.0, -1.0], &[1.0, 0.0, 0.0]), FRAC_PI_2);
        let tilt: f64 = 1e-9;
        assert_eq!(angle(&[0.0, 0.0, -1.0], &[tilt.sin(), 0.0, tilt.cos()]), tilt);
    }

    #[test]
    fn friction_is_needed_where_the_wall_presses() {
        let normal = [0.0, 0.0, -1.0];
        assert_eq!(friction_ratio(&[3.0, 4.0, -10.0], 10.0, &normal), Some(0.5));
        assert_eq!(friction_ratio(&[3.0, 4.0, 10.0], -10.0, &normal), None);
        assert_eq!(friction_ratio(&[0.0; 3], 0.0, &normal), None);
    }
}
