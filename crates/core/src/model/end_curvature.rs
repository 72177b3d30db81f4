//! Curvature at either end of the flexible part of a rod; at the start, also how it moves with the rod's numbers.

use super::record::{BASE_D1_AT, BASE_T_AT, REST_CURVATURE_AT, STIFFNESS_AT};
use super::{Batch, FlexibleRod, Matrix, Plan, RigidRod, Rod, RodSegment, Slot, Vector};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number and its rate.
#[derive(Clone, Copy)]
struct Dual {
    value: f64,
    rate: f64,
}

impl Add for Dual {
    type Output = Dual;
    fn add(self, b: Dual) -> Dual {
        Dual { value: self.value + b.value, rate: self.rate + b.rate }
    }
}

impl Sub for Dual {
    type Output = Dual;
    fn sub(self, b: Dual) -> Dual {
        self + -b
    }
}

impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        Dual { value: -self.value, rate: -self.rate }
    }
}

impl Mul for Dual {
    type Output = Dual;
    fn mul(self, b: Dual) -> Dual {
        Dual { value: self.value * b.value, rate: self.rate * b.value + self.value * b.rate }
    }
}

impl Div for Dual {
    type Output = Dual;
    fn div(self, b: Dual) -> Dual {
        let value = self.value / b.value;
        Dual { value, rate: (self.rate - value * b.rate) / b.value }
    }
}

type DualVector = [Dual; 3];

/// u0 = u* + K^-1 R0^T m at the start of the first flexible segment, body frame (1/m).
///
/// `base_moment` is m at s = 0+, before any rigid segment; beyond one in a field that varies in space it does not tell
/// the curvature. NaN there, and for a rod without a flexible segment.
pub fn base_curvature(rod: &Rod, base_moment: Vector) -> Vector {
    propagate(rod, base_moment, None).map(|u| u.value)
}

impl Plan {
    /// [`base_curvature`] of one sample of a batch. Reads no more of its record than it takes; `rod` is a rod of this plan,
    /// memory for where that is all.
    pub fn base_curvature(&self, batch: &Batch, sample: usize, base_moment: Vector, rod: &mut Rod) -> Vector {
        let Some(first) = self.segments.first().filter(|segment| segment.is_flexible) else {
            self.read_sample_rod(batch, sample, rod);
            return base_curvature(rod, base_moment);
        };
        let vector = |at: usize| -> Vector { std::array::from_fn(|k| self.entry(batch, sample, at + k)) };
        let (d1, t) = (vector(BASE_D1_AT), vector(BASE_T_AT));
        let directors = [d1, cross(t, d1), t];
        let [stiffness, u_star] = [STIFFNESS_AT, REST_CURVATURE_AT].map(|at| vector(first.record + at));
        std::array::from_fn(|k| u_star[k] + dot(directors[k], base_moment) / stiffness[k]) // R1
    }
}

/// d(u0) by a slot, given d(base moment) by it.
pub fn base_curvature_rate(rod: &Rod, base_moment: Vector, slot: Slot, base_moment_rate: Vector) -> Vector {
    propagate(rod, base_moment, Some((slot, base_moment_rate))).map(|u| u.rate)
}

/// u at the end of the last flexible segment, from the tip backwards, body frame (1/m).
///
/// `tip_position` (m, world frame) counts where the field varies in space; `tip_rotation` is body to world, by rows.
/// NaN for a rod without a flexible segment.
pub fn tip_curvature(rod: &Rod, tip_position: Vector, tip_rotation: &Matrix) -> Vector {
    let directors: [Vector; 3] = std::array::from_fn(|col| std::array::from_fn(|row| tip_rotation[row][col]));
    let (mut m, mut n, mut p) = (rod.tip_moment, rod.tip_force, tip_position);
    for segment in rod.segments.iter().rev() {
        match *segment {
            RodSegment::Rigid(RigidRod { length, dipole, weight, couple, follows }) => {
                let in_world = |v: Vector| (0..3).fold([0.0; 3], |sum, k| add(sum, directors[k], v[k]));
                let mu_world = in_world(dipole);
                let [weight, couple] = [weight, couple].map(|v| if follows { in_world(v) } else { v });
                m = add(m, couple, 1.0);
                m = add(m, cross(mu_world, rod.flux_density), 1.0); // R3
                if rod.rigid_force_arm {
                    m = add(m, cross(directors[2], n), length); // R3
                    m = add(m, cross(directors[2], weight), 0.5 * length); // R3
                }
                n = add(n, weight, 1.0); // R1
                p = add(p, directors[2], -length);
                if let Some(field) = &rod.field {
                    for (xi, share) in field.coil_load.points() {
                        let arm = directors[2].map(|x| x * xi * length);
                        let (force, torque) = field.load(add(p, arm, 1.0), mu_world);
                        m = add(m, torque, *share); // F3, F4
                        if rod.rigid_force_arm {
                            m = add(m, cross(arm, force), *share);
                        }
                        n = add(n, force, *share);
                    }
                }
            }
            RodSegment::Flexible(flexible) => {
                let (stiffness, u_star) = (flexible.distal_stiffness(), flexible.distal_rest_curvature());
                return std::array::from_fn(|k| u_star[k] + dot(directors[k], m) / stiffness[k]); // R1
            }
        }
    }
    [f64::NAN; 3]
}

fn propagate(rod: &Rod, base_moment: Vector, by: Option<(Slot, Vector)>) -> DualVector {
    let slot = by.map(|(slot, _)| slot);
    let seed = |this: Slot| f64::from(u8::from(slot == Some(this)));
    let with = |v: Vector, rate: Vector| -> DualVector { std::array::from_fn(|k| Dual { value: v[k], rate: rate[k] }) };
    let seeded = |v: Vector, of: fn(super::Axis) -> Slot| with(v, super::Axis::ALL.map(|axis| seed(of(axis))));
    let seeded_on = |v: Vector, segment: usize, of: fn(usize, super::Axis) -> Slot| {
        with(v, super::Axis::ALL.map(|axis| seed(of(segment, axis))))
    };
    // Columns of the base rotation: d1, d2, t; a virtual rotation e turns each by e x d.
    let turn = super::Axis::ALL.map(|axis| seed(Slot::BaseRotation(axis)));
    let directors: [DualVector; 3] = std::array::from_fn(|col| {
        let d = std::array::from_fn(|row| rod.base_rotation[row][col]);
        with(d, [turn[1] * d[2] - turn[2] * d[1], turn[2] * d[0] - turn[0] * d[2], turn[0] * d[1] - turn[1] * d[0]])
    });
    let flux_density = seeded(rod.flux_density, Slot::FluxDensity);
    let mut n = seeded(rod.tip_force, Slot::TipForce);
    let one = Dual { value: 1.0, rate: 0.0 };
    let half = Dual { value: 0.5, rate: 0.0 };
    for (index, segment) in rod.segments.iter().enumerate() {
        n = match segment {
            RodSegment::Rigid(rigid) => add(n, seeded_on(rigid.weight, index, Slot::Weight), one),
            RodSegment::Flexible(flexible) => {
                let length = Dual { value: flexible.length, rate: seed(Slot::Length(index)) };
                add(n, seeded_on(flexible.load, index, Slot::Load), length)
            }
        };
    }
    let mut m = with(base_moment, by.map_or([0.0; 3], |(_, rate)| rate));
    for (index, segment) in rod.segments.iter().enumerate() {
        match segment {
            RodSegment::Rigid(_) if rod.field.is_some() => break,
            RodSegment::Rigid(rigid) => {
                let length = Dual { value: rigid.length, rate: seed(Slot::Length(index)) };
                let weight = seeded_on(rigid.weight, index, Slot::Weight);
                let mu = seeded_on(rigid.dipole, index, Slot::Dipole);
                let zero = [Dual { value: 0.0, rate: 0.0 }; 3];
                let mu_world = (0..3).fold(zero, |sum, k| add(sum, directors[k], mu[k]));
                n = add(n, weight, -one); // R1
                m = add(m, cross(mu_world, flux_density), -one); // R3
                if rod.rigid_force_arm {
                    m = add(m, cross(directors[2], n), -length); // R3
                    m = add(m, cross(directors[2], weight), -(half * length)); // R3
                }
            }
            RodSegment::Flexible(flexible) => {
                let mut stiffness = seeded_on(flexible.stiffness, index, Slot::Stiffness);
                let mut u_star = seeded_on(flexible.rest_curvature, index, Slot::RestCurvature);
                if slot == Some(Slot::Insertion) && index == 0 {
                    let (stiffness_slope, u_star_slope) = base_slopes(rod);
                    for k in 0..3 {
                        stiffness[k].rate -= stiffness_slope[k];
                        u_star[k].rate -= u_star_slope[k];
                    }
                }
                return std::array::from_fn(|k| u_star[k] + dot(directors[k], m) / stiffness[k]); // R1
            }
        }
    }
    [Dual { value: f64::NAN, rate: f64::NAN }; 3]
}

/// Slopes of stiffness and rest curvature where the rod leaves the base: nodes withdrawn behind it leave pieces without
/// length.
fn base_slopes(rod: &Rod) -> (Vector, Vector) {
    match rod.segments.iter().find(|segment| segment.length() > 0.0) {
        Some(RodSegment::Flexible(FlexibleRod { length, stiffness_rise, rest_curvature_rise, .. })) => {
            (stiffness_rise.map(|rise| rise / length), rest_curvature_rise.map(|rise| rise / length))
        }
        _ => ([0.0; 3], [0.0; 3]),
    }
}

fn add<T: Copy + Add<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3], factor: T) -> [T; 3] {
    std::array::from_fn(|k| a[k] + b[k] * factor)
}

fn dot<T: Copy + Add<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<T: Copy + Sub<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{
        Axis, Base, Flexible, Loads, Parameter, PlanOptions, Profile, Rigid, Scene, Segment, SegmentKind,
        SegmentParameter, Stiffness,
    };

    fn scene(first_is_rigid: bool) -> Scene {
        let flexible = SegmentKind::Flexible(Flexible {
            stiffness: Stiffness::Direct { bending_x: 1e-5, bending_y: 2e-5, torsion: 0.77e-5 },
            rest_curvature: Profile::Constant([3.0, -2.0, 0.5]),
            stiffness_shear: None,
            stiffness_axial: None,
            density: None,
            dipole_per_length: None,
            magnet: None,
        });
        let segment = |name: &str, length: f64, kind: SegmentKind| Segment { name: name.into(), length, kind };
        let mut segments = vec![segment("wire", 0.05, flexible)];
        if first_is_rigid {
            segments.insert(0, segment("hub", 0.02, SegmentKind::Rigid(Rigid::default())));
        }
        Scene {
            name: String::new(),
            base: Base::default(),
            flux_density: [0.0; 3],
            sources: Default::default(),
            loads: Loads { tip_force: Some([0.01, -0.02, 0.03]), ..Loads::default() },
            segments,
            inner_loads: Vec::new(),
            wall: None,
            inserted: 0.0,
            rigid_force_arm: true,
        }
    }

    #[test]
    fn that_of_a_sample_is_that_of_its_rod() {
        for first_is_rigid in [false, true] {
            let flexible = usize::from(first_is_rigid);
            let axes = [
                Parameter::BaseRotation(Axis::Y),
                Parameter::BaseRotation(Axis::Z),
                Parameter::Segment(flexible, SegmentParameter::RestCurvature(Axis::X)),
                Parameter::Segment(flexible, SegmentParameter::Length),
            ];
            let axes = axes.map(|parameter| vec![parameter]);
            let plan = Plan::new(&scene(first_is_rigid), &axes, &[], PlanOptions::default()).expect("the axes fit");
            let batch = plan.batch(20, |at, row| {
                let at = at as f64;
                row.copy_from_slice(&[0.1 * at - 0.9, 0.2 - 0.03 * at, at - 7.0, 0.03 + 0.001 * at]);
            });
            let mut memory = plan.scene.rod();
            for sample in 0..20 {
                let moment = [1e-4, -2e-4, 3e-5].map(|m| m * (1.0 + sample as f64));
                let of_sample = plan.base_curvature(&batch, sample, moment, &mut memory);
                let of_rod = base_curvature(&plan.sample_rod(&batch, sample), moment);
                assert_eq!(of_sample.map(f64::to_bits), of_rod.map(f64::to_bits), "{sample}");
            }
        }
    }
}
