//! A chain of rigid links with elastic joints, in the manner of the finite-element and finite-difference models that
//! controllers used before Hao and others: moment balance at every joint, all joint angles unknown, numerical Jacobians.
//!
//! A flexible segment is cut into cells of length h: half a link, a joint, half a link, so that the error falls with
//! h². The joint's angles theta (a rotation vector, about x, y and the axis) carry the moment K (theta / h - u*). C1, R3

use super::differences::{SHARP, rotation_between};
use super::method::{self, Column, Jacobian, Method, NewtonStep, Tip};
use super::rod::{Input, Rod, Segment};
use nalgebra::{DMatrix, DVector, Dyn, LU, Matrix3, Rotation3, Vector3};

/// Step by which joint angles are differenced: the square root of epsilon, for angles below a radian (rad).
const ANGLE: f64 = 1.5e-8;
/// Step of inputs in units of what bends the rod by a radian: central differences.
const INPUT: f64 = 6e-6;
/// Corrections of an equilibrium that is solved again.
const CORRECTIONS: usize = 6;

/// A chain with a number of joints for each segment.
#[derive(Clone, Debug)]
pub struct Chain {
    joints: Vec<usize>,
}

/// A piece of the chain, base to tip.
#[derive(Clone, Copy)]
enum Piece {
    /// Length, dipole (body), weight (world).
    Link(f64, Vector3<f64>, Vector3<f64>),
    /// Cell length, K, u*.
    Joint(f64, Vector3<f64>, Vector3<f64>),
}

/// A pose of the chain.
struct Shape {
    /// Of each piece; of a joint half way through its turn.
    R: Vec<Matrix3<f64>>,
    p_tip: Vector3<f64>,
    R_tip: Matrix3<f64>,
}

impl Chain {
    /// `joints` in the flexible part of the rod, shared out by length.
    pub fn new(rod: &Rod, joints: usize) -> Chain {
        Chain { joints: rod.shares(joints) }
    }

    /// Rigid links: one more than joints.
    pub fn link_count(&self) -> usize {
        self.joints.iter().sum::<usize>() + 1
    }

    fn pieces(&self, rod: &Rod) -> Vec<Piece> {
        let mut pieces = Vec::with_capacity(3 * self.link_count());
        for (segment, joints) in rod.segments.iter().zip(&self.joints) {
            match segment {
                Segment::Flexible(flexible) => {
                    let h = flexible.length / *joints as f64;
                    let half = Piece::Link(0.5 * h, Vector3::zeros(), 0.5 * h * flexible.load);
                    for _ in 0..*joints {
                        pieces.extend([half, Piece::Joint(h, flexible.K, flexible.u_star), half]);
                    }
                }
                Segment::Rigid(rigid) => pieces.push(Piece::Link(rigid.length, rigid.mu, rigid.weight)),
            }
        }
        pieces
    }

    fn shape(rod: &Rod, pieces: &[Piece], angles: &DVector<f64>) -> Shape {
        let mut shape = Shape { R: Vec::with_capacity(pieces.len()), p_tip: rod.p0, R_tip: rod.R0 };
        let mut joint = 0;
        for piece in pieces {
            match piece {
                Piece::Link(length, ..) => {
                    shape.p_tip += *length * shape.R_tip.column(2);
                    shape.R.push(shape.R_tip);
                }
                Piece::Joint(..) => {
                    let half = Rotation3::new(0.5 * angles.fixed_rows::<3>(3 * joint)).into_inner();
                    let middle = shape.R_tip * half;
                    shape.R.push(middle);
                    shape.R_tip = middle * half;
                    joint += 1;
                }
            }
        }
        shape
    }

    /// What is left of the moment balance at every joint, in the frame half way through its turn.
    fn residual(rod: &Rod, pieces: &[Piece], angles: &DVector<f64>) -> DVector<f64> {
        let shape = Self::shape(rod, pieces, angles);
        let mut residual = DVector::zeros(angles.len());
        let mut joint = angles.len() / 3;
        let mut m = Vector3::zeros();
        let mut n = rod.f_tip;
        for (piece, R) in pieces.iter().zip(&shape.R).rev() {
            match piece {
                Piece::Link(length, mu, weight) => {
                    let arm: Vector3<f64> = *length * R.column(2);
                    m += (R * mu).cross(&rod.B) + arm.cross(&(n + 0.5 * weight)); // R3
                    n += weight;
                }
                Piece::Joint(h, K, u_star) => {
                    joint -= 1;
                    let theta = angles.fixed_rows::<3>(3 * joint);
                    let balance = R.tr_mul(&m) - K.component_mul(&(theta / *h - u_star)); // C1
                    residual.fixed_rows_mut::<3>(3 * joint).copy_from(&balance);
                }
            }
        }
        residual
    }

    /// The residual and its derivative by the joint angles, differenced column by column.
    fn linearise(rod: &Rod, pieces: &[Piece], angles: &DVector<f64>) -> (DVector<f64>, LU<f64, Dyn, Dyn>) {
        let residual = Self::residual(rod, pieces, angles);
        let mut matrix = DMatrix::zeros(angles.len(), angles.len());
        let mut changed = angles.clone();
        for k in 0..angles.len() {
            changed[k] = angles[k] + ANGLE;
            let column = (Self::residual(rod, pieces, &changed) - &residual) / (changed[k] - angles[k]);
            matrix.set_column(k, &column);
            changed[k] = angles[k];
        }
        (residual, matrix.lu())
    }

    /// The tip of a chain near by, in equilibrium again.
    fn again(&self, rod: &Rod, angles: &DVector<f64>, matrix: &LU<f64, Dyn, Dyn>) -> Option<Shape> {
        let pieces = self.pieces(rod);
        let mut angles = angles.clone();
        let mut last = f64::INFINITY;
        for _ in 0..CORRECTIONS {
            let step = matrix.solve(&-Self::residual(rod, &pieces, &angles))?;
            let size = step.lp_norm(1);
            // Also ends on NaN.
            let shrinks = size < 0.5 * last && size > SHARP;
            if !shrinks {
                break;
            }
            angles += step;
            last = size;
        }
        Some(Self::shape(rod, &pieces, &angles))
    }
}

impl Method for Chain {
    fn rest(&self, rod: &Rod) -> Vec<f64> {
        let angles = |piece: Piece| match piece {
            Piece::Link(..) => None,
            Piece::Joint(h, _, u_star) => Some(h * u_star),
        };
        self.pieces(rod).into_iter().filter_map(angles).flat_map(|angles| [angles.x, angles.y, angles.z]).collect()
    }

    fn newton_step(&self, rod: &Rod, unknowns: &[f64]) -> Option<NewtonStep> {
        let (residual, matrix) = Self::linearise(rod, &self.pieces(rod), &DVector::from_column_slice(unknowns));
        let step = matrix.solve(&-residual)?;
        Some(NewtonStep { size: step.lp_norm(1), step: step.as_slice().to_vec() })
    }

    fn tip(&self, rod: &Rod, unknowns: &[f64]) -> Tip {
        let shape = Self::shape(rod, &self.pieces(rod), &DVector::from_column_slice(unknowns));
        method::tip(shape.p_tip, &shape.R_tip)
    }

    fn jacobian(&self, rod: &Rod, unknowns: &[f64], inputs: &[Input]) -> Option<Jacobian> {
        let angles = DVector::from_column_slice(unknowns);
        let pieces = self.pieces(rod);
        let (_, matrix) = Self::linearise(rod, &pieces, &angles);
        let mut columns = Vec::with_capacity(inputs.len());
        for input in inputs {
            let by = INPUT * rod.scale(input);
            let there = self.again(&rod.moved(input, by), &angles, &matrix)?;
            let back = self.again(&rod.moved(input, -by), &angles, &matrix)?;
            let dp = (there.p_tip - back.p_tip) / (2.0 * by);
            let w = rotation_between(&back.R_tip, &there.R_tip) / (2.0 * by);
            columns.push(Column { dp: dp.into(), w: w.into() });
        }
        let shape = Self::shape(rod, &pieces, &angles);
        Some(Jacobian { tip: method::tip(shape.p_tip, &shape.R_tip), columns })
    }
}
