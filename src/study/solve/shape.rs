//! Points along one solved rod, and how they move with the parameters.

use super::{Rows, SolveError, Solved};
use crate::draw::TextTable;
use crate::model::{Axis, Matrix, Rod, Scene, Slot, Vector};
use crate::reference::{Pose, PoseDerivative, shape_with_derivatives};
use crate::study::rod_points::{add, by_parameter};
use serde_json::{Value, json};
use std::fmt;

/// Points that draw a segment of an ordinary rod, and how many more for each power of e by which errors grow along it.
const SMOOTH: usize = 41;
const SMOOTH_BY_GROWTH: f64 = 4.0;
const MOST_SMOOTH: usize = 1001;
/// How far beyond the tip a point may lie, over the rod's length.
const ROUNDING: f64 = 1e-12;

/// Points along a rod in equilibrium, integrated by the reference. SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    names: Vec<String>,
    points: Vec<Pose>,
}

/// Arc lengths of so many points evenly spaced over a length (m), both ends among them.
///
/// # Errors
///
/// Fewer than 2 points.
pub fn evenly_spaced(length: f64, count: usize) -> Result<Vec<f64>, SolveError> {
    if count < 2 {
        return Err(SolveError::TooFewPoints { count });
    }
    Ok((0..count).map(|k| length * k as f64 / (count - 1) as f64).collect())
}

/// Arc lengths of so many points along each segment, from end to end (m). Rounding does not lead beyond the tip.
pub fn along_segments(scene: &Scene, count: usize) -> Vec<f64> {
    let tip = scene.rod().total_length();
    let mut start = 0.0;
    let mut at = Vec::with_capacity(count * scene.segments.len());
    for index in 0..scene.segments.len() {
        let length = scene.segment_length(index);
        let share = |k: usize| k as f64 / count.saturating_sub(1).max(1) as f64;
        at.extend((0..count).map(|k| (start + length * share(k)).min(tip)));
        start += length;
    }
    at
}

/// Points along each segment that draw a rod smoothly: the limper or tauter it is, the sharper it bends at its clamp.
pub fn smooth_count(rod: &Rod) -> usize {
    (SMOOTH + (SMOOTH_BY_GROWTH * rod.growth()) as usize).min(MOST_SMOOTH)
}

impl Solved {
    /// Points at arc lengths from the base (m), in the order given, with their derivatives.
    ///
    /// # Errors
    ///
    /// A rod without equilibrium, or a point that is not on it.
    pub fn shape(&self, arc_lengths: &[f64]) -> Result<Shape, SolveError> {
        Shape::of(self, arc_lengths)
    }

    /// So many points evenly spaced from base to tip, at least 2, with their derivatives.
    ///
    /// # Errors
    ///
    /// As [`Solved::shape`], or fewer than 2 points.
    pub fn evenly(&self, count: usize) -> Result<Shape, SolveError> {
        self.shape(&evenly_spaced(self.scene().total_length(), count)?)
    }
}

impl Shape {
    fn of(solved: &Solved, arc_lengths: &[f64]) -> Result<Shape, SolveError> {
        let length = solved.scene().total_length();
        let on_rod = 0.0..=length * (1.0 + ROUNDING);
        if let Some(arc_length) = arc_lengths.iter().copied().find(|at| !on_rod.contains(at)) {
            return Err(SolveError::OffTheRod { arc_length, length });
        }
        if !solved.is_equilibrium() {
            return Err(SolveError::NoEquilibrium { status: solved.status() });
        }
        let mut slots = solved.plan().slots();
        // Beside a wall slots tell what happens under a dead force at the tip, which then follows the parameters, too.
        let slopes = solved.jacobian().force();
        let of_force = slots.len();
        slots.extend(slopes.iter().flat_map(|_| Axis::ALL.map(Slot::TipForce)));
        let poses = shape_with_derivatives(&solved.pressed_rod(), solved.base_wrench(), arc_lengths, &slots);
        let mut points = poses.ok_or(SolveError::NotIntegrable)?;
        for point in &mut points {
            let (of_slots, by_force) = point.derivatives.split_at(of_force);
            let mut derivatives = by_parameter(solved.plan(), solved.batch(), 0, &slots[..of_force], of_slots);
            if let Some(slopes) = &slopes {
                for (k, derivative) in derivatives.iter_mut().enumerate() {
                    for (axis, by_force) in by_force.iter().enumerate() {
                        add(derivative, slopes[axis][k], by_force);
                    }
                }
            }
            point.derivatives = derivatives;
        }
        Ok(Shape { names: solved.jacobian().names(), points })
    }

    /// The points, in the order asked for. Each has one derivative for each of [`Shape::names`].
    pub fn points(&self) -> &[Pose] {
        &self.points
    }

    /// Names of the parameters of the derivatives.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// From the base (m), one for each of n points.
    pub fn arc_lengths(&self) -> Vec<f64> {
        self.points.iter().map(|point| point.arc_length).collect()
    }

    /// World frame (m), n x 3.
    pub fn positions(&self) -> Vec<Vector> {
        self.points.iter().map(|point| point.position).collect()
    }

    /// Body to world, by rows, n x 3 x 3.
    pub fn rotations(&self) -> Vec<Matrix> {
        self.points.iter().map(|point| point.rotation).collect()
    }

    /// Body frame, zero in rigid segments (1/m), n x 3.
    pub fn curvatures(&self) -> Vec<Vector> {
        self.points.iter().map(|point| point.curvature).collect()
    }

    /// d(position) (m/unit), n x 3 x k for k parameters.
    pub fn position_jacobian(&self) -> Vec<Rows> {
        self.rows(|derivative| derivative.dp)
    }

    /// The points' virtual rotations w, world frame, with dR = hat(w) R (rad/unit), n x 3 x k.
    pub fn rotation_jacobian(&self) -> Vec<Rows> {
        self.rows(|derivative| derivative.w)
    }

    /// d(curvature), body frame (1/m/unit), n x 3 x k.
    pub fn curvature_jacobian(&self) -> Vec<Rows> {
        self.rows(|derivative| derivative.du)
    }

    /// All of it as JSON; derivatives are `jacobian.*[point][row][parameter]`.
    pub fn to_json(&self) -> Value {
        json!({
            "arc_length": self.arc_lengths(),
            "position": self.positions(),
            "rotation": self.rotations(),
            "curvature": self.curvatures(),
            "jacobian": {
                "parameters": self.names,
                "position": self.position_jacobian(),
                "rotation": self.rotation_jacobian(),
                "curvature": self.curvature_jacobian(),
            },
        })
    }

    fn rows(&self, of: impl Fn(&PoseDerivative) -> Vector) -> Vec<Rows> {
        let of_point = |point: &Pose| [0, 1, 2].map(|row| point.derivatives.iter().map(|d| of(d)[row]).collect());
        self.points.iter().map(of_point).collect()
    }
}

impl fmt::Display for Shape {
    /// A table with a line for each point; lengths in mm, curvatures in 1/m.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = TextTable::new(["s [mm]", "x [mm]", "y", "z", "u.x [1/m]", "u.y", "u.z"]);
        for point in &self.points {
            let mut cells = vec![format!("{:.3}", point.arc_length * 1e3)];
            cells.extend(point.position.iter().map(|x| format!("{:.6}", x * 1e3)));
            cells.extend(point.curvature.iter().map(|u| format!("{u:.6}")));
            table.row(cells);
        }
        write!(f, "shape\n{table}")
    }
}
