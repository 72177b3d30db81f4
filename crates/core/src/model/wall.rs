//! A wall that the tip may touch: what a user says of it, its numbers as the mechanics sees them, and its gap at a point. W1

use super::rotation::rotation_matrix;
use super::segment_chain::rotation_jacobian;
use super::validate::{check, check_finite, check_positive};
use super::vectors::dot;
use super::{Axis, Scene, SceneError, Slot, Units, Vector};

/// A wall that the tip may touch, as a user describes it; SI units, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Plane, sphere or cylinder.
    pub shape: WallShape,
    /// A point of a plane; the centre of a sphere; a point of a cylinder's axis (m)
    pub position: Vector,
    /// Rotation vector that turns normal or axis about `position` (rad)
    pub rotation: Vector,
    /// The tip is a ball about the rod's end (m)
    pub tip_radius: f64,
    /// Of the tissue (N/m); `None`: rigid.
    pub stiffness: Option<f64>,
    /// Coefficient that judges whether a tip holds; `None`: nothing is judged.
    pub friction: Option<f64>,
    /// Whether the tip slides on it, or where it is held.
    pub tip: TipOnWall,
}

/// The surface of a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WallShape {
    /// All points across a direction.
    Plane {
        /// Towards the rod; of any length but 0.
        normal: Vector,
    },
    /// All points at a distance from one.
    Sphere {
        /// In m
        radius: f64,
        /// Where the rod is.
        side: Side,
    },
    /// All points at a distance from a line.
    Cylinder {
        /// Along the line; of any length but 0.
        axis: Vector,
        /// In m
        radius: f64,
        /// Where the rod is.
        side: Side,
    },
}

/// On which side of a curved wall the rod is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// In a chamber or a vessel.
    #[default]
    Inside,
    /// Beside an obstacle.
    Outside,
}

/// What the tip may do on a wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TipOnWall {
    /// It slides without friction and may leave the wall.
    #[default]
    Slides,
    /// It is held at the point of the wall that is nearest to this one (m).
    Sticks(Vector),
}

/// A number of a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WallParameter {
    /// Component of its position (m).
    Position(Axis),
    /// Component of its rotation vector (rad).
    Rotation(Axis),
    /// Of a sphere or a cylinder (m).
    Radius,
    /// Of the ball at the tip (m).
    TipRadius,
    /// Of the tissue (N/m).
    Stiffness,
    /// Coefficient of friction.
    Friction,
    /// Component of where the tip is held (m).
    Anchor(Axis),
}

/// A wall as the mechanics sees it; SI units, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodWall {
    /// Its shape, and whether the tip is held.
    pub kind: WallKind,
    /// In m
    pub position: Vector,
    /// Turned normal or axis, of length 1.
    pub axis: Vector,
    /// Where the tip is held, before it is moved to the wall (m)
    pub anchor: Vector,
    /// In m
    pub radius: f64,
    /// In m
    pub tip_radius: f64,
    /// 1 / stiffness of the tissue; 0 where rigid (m/N)
    pub compliance: f64,
    /// Coefficient of friction; negative where none is given.
    pub friction: f64,
}

impl RodWall {
    /// The product of a free tip's principal compliances, that of the tissue added, over the cube of their sum: below it the rod counts as
    /// straight.
    pub const STRAIGHT: f64 = 1e-11;
    /// Compliance added where a straight rod is held, at the start of the way, over the sum of the tip's principal compliances.
    pub const SOFTNESS: f64 = 1e-3;
}

/// What of a wall is the same for all samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WallKind {
    /// Its surface.
    pub surface: Surface,
    /// The rod is outside of a sphere or a cylinder.
    pub outside: bool,
    /// The tip is held.
    pub sticks: bool,
    /// The tissue yields.
    pub yields: bool,
}

/// The surface of a wall by its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// All points across a direction.
    Plane,
    /// All points at a distance from one.
    Sphere,
    /// All points at a distance from a line.
    Cylinder,
}

/// Entries of the record of a wall: position, axis, anchor, radius, tip radius, compliance, friction.
pub const WALL_RECORD: usize = 13;

/// Gap, its gradient and its second derivatives at a point. W1
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Between the tip's ball and the wall; negative behind it (m)
    pub gap: f64,
    /// From the wall to where the rod is, of length 1.
    pub normal: Vector,
    /// How the normal follows the point (1/m)
    pub curvature: super::Matrix,
}

/// Of length 1.
fn unit(v: Vector) -> Vector {
    let size = dot(v, v).sqrt();
    v.map(|x| x / size)
}

impl Wall {
    /// As the mechanics sees it.
    pub fn rod_wall(&self) -> RodWall {
        let (surface, axis, radius, side) = match self.shape {
            WallShape::Plane { normal } => (Surface::Plane, normal, 0.0, Side::Inside),
            WallShape::Sphere { radius, side } => (Surface::Sphere, [0.0, 0.0, 1.0], radius, side),
            WallShape::Cylinder { axis, radius, side } => (Surface::Cylinder, axis, radius, side),
        };
        let turn = rotation_matrix(self.rotation);
        let axis = unit(axis);
        let (sticks, anchor) = match self.tip {
            TipOnWall::Slides => (false, [0.0; 3]),
            TipOnWall::Sticks(anchor) => (true, anchor),
        };
        let outside = side == Side::Outside;
        RodWall {
            kind: WallKind { surface, outside, sticks, yields: self.stiffness.is_some() },
            position: self.position,
            axis: std::array::from_fn(|row| dot(turn[row], axis)),
            anchor,
            radius,
            tip_radius: self.tip_radius,
            compliance: self.stiffness.map_or(0.0, |stiffness| 1.0 / stiffness),
            friction: self.friction.unwrap_or(-1.0),
        }
    }

    /// Checks its numbers, in the order a user wrote them.
    pub(super) fn validate(&self, scene: &Scene) -> Result<(), SceneError> {
        let direction = |name: &str, v: Vector| {
            check_finite(name, v)?;
            let size = dot(v, v).sqrt();
            check(name.into(), size, size > 0.0, "a direction: of any length but 0")?;
            check_positive(name.into(), size)
        };
        let not_negative = |name: &str, value: f64| {
            check(name.into(), value, value.is_finite() && value >= 0.0, "finite and not negative")
        };
        check_finite("wall.position", self.position)?;
        check_finite("wall.rotation", self.rotation)?;
        not_negative("wall.tip_radius", self.tip_radius)?;
        match self.shape {
            WallShape::Plane { normal } => direction("wall.normal", normal)?,
            WallShape::Sphere { radius, side } => self.check_radius(radius, side)?,
            WallShape::Cylinder { axis, radius, side } => {
                direction("wall.axis", axis)?;
                self.check_radius(radius, side)?;
            }
        }
        if let Some(stiffness) = self.stiffness {
            let is_possible = stiffness.is_finite() && stiffness > 0.0;
            let words = "finite and greater than zero; leave it out for a rigid wall";
            check("wall.stiffness".into(), stiffness, is_possible, words)?;
            check_positive("wall.stiffness".into(), stiffness)?;
        }
        if let Some(friction) = self.friction {
            not_negative("wall.friction", friction)?;
        }
        if let TipOnWall::Sticks(anchor) = self.tip {
            check_finite("wall.anchor", anchor)?;
        }
        if scene.loads.tip_moment.is_some() || scene.has_load_without_energy() {
            return Err(SceneError::NoEnergyBesideWall);
        }
        if scene.rigid_force_arm { Ok(()) } else { Err(SceneError::WallWithoutForceArm) }
    }

    fn check_radius(&self, radius: f64, side: Side) -> Result<(), SceneError> {
        check_positive("wall.radius".into(), radius)?;
        let fits = side == Side::Outside || radius > self.tip_radius;
        let words = "greater than `wall.tip_radius`: the tip's ball does not fit inside";
        check("wall.radius".into(), radius, fits, words)
    }
}

impl WallParameter {
    /// Those of a wall.
    pub fn all(wall: &Wall) -> Vec<WallParameter> {
        use WallParameter as W;
        let mut all = [W::Position, W::Rotation].iter().flat_map(|of| Axis::ALL.map(of)).collect::<Vec<_>>();
        if !matches!(wall.shape, WallShape::Plane { .. }) {
            all.push(W::Radius);
        }
        all.extend([W::TipRadius, W::Stiffness, W::Friction]);
        if matches!(wall.tip, TipOnWall::Sticks(_)) {
            all.extend(Axis::ALL.map(W::Anchor));
        }
        all
    }

    /// Path after `wall.`
    pub(super) fn path(self) -> String {
        match self {
            WallParameter::Position(axis) => format!("position.{}", axis.name()),
            WallParameter::Rotation(axis) => format!("rotation.{}", axis.name()),
            WallParameter::Radius => "radius".into(),
            WallParameter::TipRadius => "tip_radius".into(),
            WallParameter::Stiffness => "stiffness".into(),
            WallParameter::Friction => "friction".into(),
            WallParameter::Anchor(axis) => format!("anchor.{}", axis.name()),
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            WallParameter::Position(_)
            | WallParameter::Radius
            | WallParameter::TipRadius
            | WallParameter::Anchor(_) => "m",
            WallParameter::Rotation(_) => "rad",
            WallParameter::Stiffness => "N/m",
            WallParameter::Friction => "",
        }
    }

    /// Value, SI: an infinite stiffness of a rigid wall, no friction where none is given.
    pub(super) fn get(self, wall: &Wall) -> f64 {
        match self {
            WallParameter::Position(axis) => wall.position[axis.index()],
            WallParameter::Rotation(axis) => wall.rotation[axis.index()],
            WallParameter::Radius => match wall.shape {
                WallShape::Plane { .. } => f64::INFINITY,
                WallShape::Sphere { radius, .. } | WallShape::Cylinder { radius, .. } => radius,
            },
            WallParameter::TipRadius => wall.tip_radius,
            WallParameter::Stiffness => wall.stiffness.unwrap_or(f64::INFINITY),
            WallParameter::Friction => wall.friction.unwrap_or(0.0),
            WallParameter::Anchor(axis) => match wall.tip {
                TipOnWall::Slides => f64::NAN,
                TipOnWall::Sticks(anchor) => anchor[axis.index()],
            },
        }
    }

    pub(super) fn set(self, wall: &mut Wall, value: f64) {
        match (self, &mut wall.shape, &mut wall.tip) {
            (WallParameter::Position(axis), ..) => wall.position[axis.index()] = value,
            (WallParameter::Rotation(axis), ..) => wall.rotation[axis.index()] = value,
            (WallParameter::Radius, WallShape::Sphere { radius, .. } | WallShape::Cylinder { radius, .. }, _) => {
                *radius = value;
            }
            (WallParameter::TipRadius, ..) => wall.tip_radius = value,
            (WallParameter::Stiffness, ..) => wall.stiffness = (value != f64::INFINITY).then_some(value),
            (WallParameter::Friction, ..) => wall.friction = Some(value),
            (WallParameter::Anchor(axis), _, TipOnWall::Sticks(anchor)) => anchor[axis.index()] = value,
            (WallParameter::Radius | WallParameter::Anchor(_), ..) => {}
        }
    }

    /// Slots and rates.
    pub(super) fn chain(self, wall: &Wall) -> Vec<(Slot, f64)> {
        match self {
            WallParameter::Position(axis) => vec![(Slot::WallPosition(axis), 1.0)],
            WallParameter::Rotation(axis) => {
                let jacobian = rotation_jacobian(wall.rotation);
                Axis::ALL.map(|row| (Slot::WallRotation(row), jacobian[row.index()][axis.index()])).to_vec()
            }
            WallParameter::Radius => vec![(Slot::WallRadius, 1.0)],
            WallParameter::TipRadius => vec![(Slot::WallTipRadius, 1.0)],
            WallParameter::Stiffness => {
                vec![(Slot::WallCompliance, wall.stiffness.map_or(0.0, |stiffness| -1.0 / (stiffness * stiffness)))]
            }
            WallParameter::Friction => Vec::new(),
            WallParameter::Anchor(axis) => vec![(Slot::WallAnchor(axis), 1.0)],
        }
    }

    /// Entries of the record of a wall that it changes.
    pub(super) fn entries(self) -> Vec<usize> {
        match self {
            WallParameter::Position(axis) => vec![axis.index()],
            WallParameter::Rotation(_) => vec![3, 4, 5],
            WallParameter::Anchor(axis) => vec![6 + axis.index()],
            WallParameter::Radius => vec![9],
            WallParameter::TipRadius => vec![10],
            WallParameter::Stiffness => vec![11],
            WallParameter::Friction => vec![12],
        }
    }
}

impl RodWall {
    pub(super) fn write(&self, record: &mut Vec<f64>) {
        [self.position, self.axis, self.anchor].iter().for_each(|v| record.extend(v));
        record.extend([self.radius, self.tip_radius, self.compliance, self.friction]);
    }

    pub(super) fn read(&mut self, record: impl Fn(usize) -> f64) {
        let vector = |at: usize| -> Vector { [record(at), record(at + 1), record(at + 2)] };
        (self.position, self.axis, self.anchor) = (vector(0), vector(3), vector(6));
        (self.radius, self.tip_radius, self.compliance, self.friction) =
            (record(9), record(10), record(11), record(12));
    }

    /// Unit of each entry of the record.
    pub(super) fn record_units(units: &Units) -> [f64; WALL_RECORD] {
        let mut all = [units.length; WALL_RECORD];
        all[3..6].fill(1.0);
        (all[11], all[12]) = (units.length / units.force, 1.0);
        all
    }

    /// Whether its numbers describe a wall.
    pub(super) fn is_valid(&self) -> bool {
        let mut record = Vec::new();
        self.write(&mut record);
        let is_curved = self.kind.surface != Surface::Plane;
        let fits = !is_curved || self.radius > if self.kind.outside { 0.0 } else { self.tip_radius };
        record.iter().all(|x| x.is_finite()) && fits && self.tip_radius >= 0.0 && self.compliance >= 0.0
    }

    /// Gap at a point (m); not a number on a cylinder's axis and at a sphere's centre. W1
    pub fn gap(&self, at: Vector) -> Gap {
        let d: Vector = std::array::from_fn(|k| at[k] - self.position[k]);
        let sign = if self.kind.outside { 1.0 } else { -1.0 };
        let a = self.axis;
        let along = dot(a, d);
        let (arm, is_line) = match self.kind.surface {
            Surface::Plane => {
                return Gap { gap: along - self.tip_radius, normal: a, curvature: [[0.0; 3]; 3] };
            }
            Surface::Sphere => (d, 0.0),
            Surface::Cylinder => (std::array::from_fn(|k| d[k] - along * a[k]), 1.0),
        };
        let distance = dot(arm, arm).sqrt();
        let e = arm.map(|x| x / distance);
        let entry = |i: usize, j: usize| f64::from(u8::from(i == j)) - is_line * a[i] * a[j] - e[i] * e[j];
        Gap {
            gap: sign * (distance - self.radius) - self.tip_radius,
            normal: e.map(|x| sign * x),
            curvature: std::array::from_fn(|i| std::array::from_fn(|j| sign * entry(i, j) / distance)),
        }
    }

    /// The point of the wall that is nearest to another (m). W1
    pub fn foot(&self, at: Vector) -> Vector {
        let Gap { gap, normal, .. } = self.gap(at);
        std::array::from_fn(|k| at[k] - gap * normal[k])
    }
}
