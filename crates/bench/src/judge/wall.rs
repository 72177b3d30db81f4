//! A wall that the tip is brought to: what it does to the tip while it comes, and in its place.

use nalgebra::{Matrix3, Vector3};
use rodsweep::model::{RodWall, Surface};

/// Stiffness of a spring before the wall, over that of the rod's stiffest element on the rod's whole length. The wall may be rigid, or
/// so stiff that rounding would hide the rod: what the spring takes is found again by multipliers.
const RIGID: f64 = 1e5;

/// A wall on its way: it sets out from where it lets the free tip be.
#[derive(Clone)]
pub struct Wall {
    surface: Surface,
    /// 1 outside of a sphere or a cylinder, -1 inside.
    side: f64,
    place: Vector3<f64>,
    /// Normal of a plane, axis of a cylinder.
    axis: Vector3<f64>,
    radius: f64,
    tip_radius: f64,
    /// Where the tip is held.
    held_at: Option<Vector3<f64>>,
    /// From there to the free tip; of a tip that slides, its depth behind the wall along x.
    way: Vector3<f64>,
    spring: f64,
    compliance: f64,
    /// The force at which the spring is as long as without one; of a tip that slides along x.
    force: Vector3<f64>,
}

/// Contact force F on the tip, its derivative D by the tip's position, and its slope by the share of the wall's way.
pub struct Push {
    pub F: Vector3<f64>,
    pub D: Matrix3<f64>,
    pub slope: Vector3<f64>,
}

impl Wall {
    /// Before a rod whose stiffest element would yield so little to a force at the tip (N/m).
    pub fn new(wall: &RodWall, stiffness_of_rod: f64) -> Wall {
        let mut all = Wall {
            surface: wall.kind.surface,
            side: if wall.kind.outside { 1.0 } else { -1.0 },
            place: wall.position.into(),
            axis: wall.axis.into(),
            radius: wall.radius,
            tip_radius: wall.tip_radius,
            held_at: None,
            way: Vector3::zeros(),
            spring: RIGID * stiffness_of_rod,
            compliance: wall.compliance,
            force: Vector3::zeros(),
        };
        if wall.kind.sticks {
            let anchor = wall.anchor.into();
            let (gap, normal, _) = all.gap(&anchor);
            all.held_at = Some(anchor - gap * normal);
        }
        all
    }

    /// The gap between wall and tip, its gradient and its Hessian.
    fn gap(&self, at: &Vector3<f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
        let d = at - self.place;
        let (arm, lines) = match self.surface {
            Surface::Plane => return (self.axis.dot(&d) - self.tip_radius, self.axis, Matrix3::zeros()),
            Surface::Sphere => (d, Matrix3::identity()),
            Surface::Cylinder => {
                let across = Matrix3::identity() - self.axis * self.axis.transpose();
                (across * d, across)
            }
        };
        let distance = arm.norm();
        let e = arm / distance;
        let bent = (lines - e * e.transpose()) / distance;
        (self.side * (distance - self.radius) - self.tip_radius, self.side * e, self.side * bent)
    }

    /// On its way from where it lets a free tip be; `None` where that does not meet it.
    pub fn met_by(self, tip: &Vector3<f64>) -> Option<Wall> {
        let way = self.held_at.map_or(Vector3::x() * -self.gap(tip).0, |held_at| tip - held_at);
        (self.held_at.is_some() || way.x > 0.0).then_some(Wall { way, ..self })
    }

    /// How far a tip is from where the wall, after a share of its way, would have it; of one that slides along x.
    fn off(&self, tip: &Vector3<f64>, share: f64) -> Vector3<f64> {
        let ahead = (1.0 - share) * self.way;
        match self.held_at {
            Some(held_at) => tip - held_at - ahead,
            None => Vector3::x() * self.gap(tip).0 + ahead,
        }
    }

    /// Force in spring and tissue, which are in series, after a share of the way.
    fn borne(&self, tip: &Vector3<f64>, share: f64) -> Vector3<f64> {
        (self.force - self.spring * self.off(tip, share)) / (1.0 + self.spring * self.compliance)
    }

    /// Force on a tip after a share of the way.
    pub fn push(&self, tip: &Vector3<f64>, share: f64) -> Push {
        let (borne, both) = (self.borne(tip, share), self.spring / (1.0 + self.spring * self.compliance));
        if self.held_at.is_some() {
            return Push { F: borne, D: Matrix3::from_diagonal_element(-both), slope: -both * self.way };
        }
        let (_, n, bent) = self.gap(tip);
        Push { F: borne.x * n, D: borne.x * bent - both * n * n.transpose(), slope: both * self.way.x * n }
    }

    /// How far off a tip is for the spring, once the wall is in its place.
    pub fn spring_length(&self, tip: &Vector3<f64>) -> f64 {
        (self.borne(tip, 1.0) - self.force).norm() / self.spring
    }

    /// The wall with this part of the spring's length taken back.
    pub fn harder(&self, tip: &Vector3<f64>, part: f64) -> Wall {
        Wall { force: self.force + part * (self.borne(tip, 1.0) - self.force), ..self.clone() }
    }

    /// Whether it presses a tip after a share of the way; one that is held may be pulled, too.
    pub fn presses(&self, tip: &Vector3<f64>, share: f64) -> bool {
        self.held_at.is_some() || self.borne(tip, share).x > 0.0
    }
}
