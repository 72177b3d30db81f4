//! A third judge of the branch from rest, in another formulation than the engines and the reference: the energy of a rod of
//! elements is minimised, and the minimum is followed while the loads grow.
//!
//! Unknown are rotations at the ends of elements. Positions are sums of tangents. A load step follows the tangent and counts only
//! where Newton's first correction is small at every node and all pivots of the Hessian are positive; under a dead tip moment,
//! which has no energy, where the product of their determinants is. So the path cannot leave its
//! branch but at a fold, where the load step shrinks to nothing. The judge is sure only where two resolutions agree: halved
//! load steps on twice the elements. It decides between branches; it is no measure of accuracy.
//!
//! Under its full load the rod may meet a wall. That comes from where it lets the free tip be, and the minimum is followed on. The wall
//! presses by a spring, which is taken back once it is in its place.
//!
//! ```
//! use rodsweep::input::parse_scene;
//! use rodsweep::shipped::TIP_COIL;
//! use rodsweep_bench::judge::{Word, judge};
//!
//! let scene = parse_scene(TIP_COIL.0.as_ref(), TIP_COIL.1)?;
//! assert!(matches!(judge(&scene.rod()), Word::Arrives { .. }));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![allow(non_snake_case)]

mod chain;
mod field;
mod hessian;
mod load;
mod path;
mod state;
mod turn;
mod uniform;
mod varying;
mod wall;

use chain::Chain;
use path::{Followed, follow};
use rodsweep::model::{Matrix, Rod, Vector, rotation_angle};
use turn::{exp, log, matrix_of};

/// Tips further apart than this share of the length lie on different branches.
pub const OTHER_PLACE: f64 = 2e-3;
/// Tips turned further apart than this lie on different branches (rad).
pub const OTHER_TURN: f64 = 2e-2;
/// Forces of a wall further apart than this share of them are those of different branches.
pub const OTHER_FORCE: f64 = 0.05;

/// Elements of a rod and the trust (rad) of each resolution, from coarse to fine.
const RESOLUTIONS: [(usize, f64); 6] = [(32, 0.02), (64, 0.01), (128, 0.01), (256, 0.01), (512, 0.005), (1024, 0.005)];
/// Two resolutions agree where their tips are nearer than this share of the length, and this turn (rad). Their errors fall with
/// the square of the elements' length: what is left after extrapolation is far less.
const SAME_PLACE: f64 = 3e-3;
const SAME_TURN: f64 = 2e-2;
/// Two resolutions agree where their contact forces differ by less than this share.
const SAME_FORCE: f64 = 0.05;
/// Two ends agree where they are so near, over the larger of the load and [`LEAST_LOAD`]: next to a cusp a chain of few elements ends
/// where the rod goes on.
const SAME_LOAD: f64 = 1e-4;
const LEAST_LOAD: f64 = 0.05;
/// An end beyond this load may be none under the full load.
const NEARLY_FULL: f64 = 0.999;

/// The verdict of the judge on a rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Word {
    /// The path from rest reaches the full load.
    Arrives {
        /// Tip, world frame (m)
        position: Vector,
        /// Body to world, by rows.
        rotation: Matrix,
        /// Contact force of the wall on the tip (N); zero without contact.
        force: Vector,
    },
    /// The path from rest ends at this share of the full load.
    Ends {
        /// From 0 to 1; while a wall comes, 1 more than the share of its way.
        load: f64,
    },
    /// Resolutions differ, the rod comes too near to a magnet, or it has what the judge does not model: a field sampled on a
    /// grid, an exact magnet, a couple or a load that turns with the rod, or, in a field that varies or at a wall, a tip moment without
    /// the arm of forces.
    Unsure,
}

impl Word {
    /// Whether a tip lies on the branch on which the judge arrives; `None` where the judge does not say.
    pub fn agrees_with(&self, position: Vector, rotation: &Matrix, length: f64) -> Option<bool> {
        match self {
            Word::Arrives { position: own, rotation: turned, .. } => {
                let apart = (0..3).map(|k| (own[k] - position[k]).powi(2)).sum::<f64>().sqrt();
                Some(apart <= OTHER_PLACE * length && rotation_angle(turned, rotation) <= OTHER_TURN)
            }
            Word::Ends { .. } => Some(false),
            Word::Unsure => None,
        }
    }
}

/// Follows a rod from rest to its full load, finer until two resolutions agree.
pub fn judge(rod: &Rod) -> Word {
    let length = chain::length(rod);
    let mut last: Option<Followed> = None;
    for (elements, trust) in RESOLUTIONS {
        let Some(chain) = Chain::new(rod, elements) else { return Word::Unsure };
        let found = follow(chain, trust);
        if let Some(word) = last.and_then(|last| agreed(&last, &found, length)) {
            return word;
        }
        last = Some(found);
    }
    Word::Unsure
}

/// The limit to which two resolutions point, where they agree.
fn agreed(coarse: &Followed, fine: &Followed, length: f64) -> Option<Word> {
    match (coarse, fine) {
        (Followed::Arrives { p, q, force }, Followed::Arrives { p: fine_p, q: fine_q, force: fine_force }) => {
            let (dp, w) = (fine_p - p, log(&(fine_q * q.conjugate())));
            let df = fine_force - force;
            let is_same =
                dp.norm() < SAME_PLACE * length && w.norm() < SAME_TURN && df.norm() <= SAME_FORCE * fine_force.norm();
            let (position, rotation) = (fine_p + dp / 3.0, matrix_of(&(exp(&(w / 3.0)) * fine_q)));
            let rows = std::array::from_fn(|row| std::array::from_fn(|col| rotation[(row, col)]));
            let force = (fine_force + df / 3.0).into();
            is_same.then_some(Word::Arrives { position: position.into(), rotation: rows, force })
        }
        (&Followed::Ends(load), &Followed::Ends(fine)) => {
            let limit = fine + (fine - load) / 3.0;
            // An end while the wall comes lies between 1 and 2.
            let most = if fine > 1.0 { 1.0 + NEARLY_FULL } else { NEARLY_FULL };
            let is_same = (fine - load).abs() < SAME_LOAD * fine.max(LEAST_LOAD) && limit < most;
            is_same.then_some(Word::Ends { load: limit })
        }
        _ => None,
    }
}
