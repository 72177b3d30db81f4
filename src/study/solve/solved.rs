//! What came of one scene.

use crate::engines::Engine;
use crate::model::{
    BaseWrench, Batch, Matrix, Plan, Quantity, Rod, Scene, Solutions, Status, Vector, base_curvature, tip_curvature,
};
use crate::results::evidence::has_no_energy;
use crate::results::{Contact, StabilityEvidence, pressed};

/// A solved scene. SI units; vectors stand in the world frame unless said otherwise.
///
/// Where the rod has no equilibrium under its full load ([`Solved::is_equilibrium`]), numbers are NaN.
#[derive(Clone, Debug)]
pub struct Solved {
    plan: Plan,
    /// The one sample.
    batch: Batch,
    solutions: Solutions,
    /// Where more than the base moment is known of an equilibrium off the path.
    base_force: Option<Vector>,
    /// What was chosen to solve.
    engine: Engine,
    /// What has solved, in words.
    solved_by: String,
}

impl Solved {
    pub(super) fn new(plan: Plan, batch: Batch, solutions: Solutions, engine: Engine, solved_by: String) -> Solved {
        Solved { plan, batch, solutions, base_force: None, engine, solved_by }
    }

    /// The same rod at another of its equilibria.
    pub(super) fn at(&self, solutions: Solutions, base_force: Option<Vector>) -> Solved {
        Solved { solutions, base_force, ..self.clone() }
    }

    /// The scene that was solved.
    pub fn scene(&self) -> &Scene {
        &self.plan.scene
    }

    /// What the scene was compiled to: terms, steps, derivatives.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The mechanics of the scene: stiffness, loads, dipoles.
    pub fn rod(&self) -> Rod {
        self.plan.sample_rod(&self.batch, 0)
    }

    /// The rod as its shape follows from the base moment: the force of a wall acts as a dead force at its tip.
    pub fn pressed_rod(&self) -> Rod {
        pressed(self.rod(), self.scene(), self.contact().as_ref())
    }

    /// The row as the engine returned it, sample 0.
    pub fn solutions(&self) -> &Solutions {
        &self.solutions
    }

    /// The plan's inputs, one sample.
    pub(crate) fn batch(&self) -> &Batch {
        &self.batch
    }

    pub(super) fn chosen_engine(&self) -> &Engine {
        &self.engine
    }

    /// What has solved it, such as `cpu f64 (AVX-512, 2 threads)`.
    pub fn engine(&self) -> &str {
        &self.solved_by
    }

    /// What became of the rod on its way from rest.
    pub fn status(&self) -> Status {
        self.solutions.status(0)
    }

    /// Whether the path from rest leads to an equilibrium under the full load.
    pub fn is_converged(&self) -> bool {
        self.status().is_converged()
    }

    /// Whether the numbers belong to an equilibrium under the full load; where the path from rest ends at a fold, it is
    /// one beyond it.
    pub fn is_equilibrium(&self) -> bool {
        self.solutions.is_equilibrium(0)
    }

    /// Position of the tip (m).
    pub fn tip_position(&self) -> Vector {
        self.vector(Quantity::TipPosition)
    }

    /// Unit vector along the rod at its tip.
    pub fn tip_tangent(&self) -> Vector {
        self.vector(Quantity::TipTangent)
    }

    /// Rotation of the tip, body to world, 3 x 3 by rows; its third column is the tangent.
    pub fn tip_rotation(&self) -> Matrix {
        if self.is_equilibrium() { self.solutions.tip_rotation(0) } else { [[f64::NAN; 3]; 3] }
    }

    /// The rotation of the tip as a unit quaternion x, y, z, w, body to world; w is not negative.
    pub fn tip_quaternion(&self) -> [f64; 4] {
        if self.is_equilibrium() { quaternion(&self.tip_rotation()) } else { [f64::NAN; 4] }
    }

    /// Curvature at the end of the last flexible segment, body frame (1/m).
    pub fn tip_curvature(&self) -> Vector {
        if self.is_equilibrium() {
            tip_curvature(&self.rod(), self.tip_position(), &self.tip_rotation())
        } else {
            [f64::NAN; 3]
        }
    }

    /// Internal moment at the base (N·m).
    pub fn base_moment(&self) -> Vector {
        self.vector(Quantity::BaseMoment)
    }

    /// The same with the force at the base, where that is not told by the loads and known.
    pub fn base_wrench(&self) -> BaseWrench {
        BaseWrench { moment: self.base_moment(), force: self.base_force }
    }

    /// Curvature at the start of the first flexible segment, body frame (1/m).
    pub fn base_curvature(&self) -> Vector {
        if !self.is_equilibrium() {
            return [f64::NAN; 3];
        }
        let of_moment = || base_curvature(&self.rod(), self.base_moment());
        self.solutions.own_curvature(0).unwrap_or_else(of_moment)
    }

    /// How far from a fold: 1 at rest, 0 at a fold, negative when unstable.
    pub fn stability_margin(&self) -> f64 {
        self.number(Quantity::StabilityMargin)
    }

    /// Negative eigenvalues of the second variation, under a dead tip moment of its symmetric part: 0 is stable. `None` without equilibrium.
    pub fn stability_index(&self) -> Option<usize> {
        self.is_equilibrium().then(|| self.number(Quantity::StabilityIndex) as usize)
    }

    /// Whether the equilibrium is known to be elastically stable; [`Solved::stability_evidence`] says by what.
    pub fn is_stable(&self) -> bool {
        self.stability_index() == Some(0)
    }

    /// The evidence for its stability. `None` without equilibrium.
    pub fn stability_evidence(&self) -> Option<StabilityEvidence> {
        self.evidence(true)
    }

    /// The evidence where this is, or is not, the equilibrium from rest.
    pub(super) fn evidence(&self, is_from_rest: bool) -> Option<StabilityEvidence> {
        StabilityEvidence::of(&self.plan, (&self.batch, 0), (&self.solutions, 0), is_from_rest)
    }

    /// Whether a dead moment acts at the tip.
    pub(super) fn has_no_energy(&self) -> bool {
        has_no_energy(&self.plan, &self.batch, 0)
    }

    /// Estimated error of tip position over rod length or of tip rotation (rad), whichever is larger.
    pub fn error_estimate(&self) -> f64 {
        self.number(Quantity::ErrorEstimate)
    }

    /// Estimated error of the derivatives: of the worst, (dp/L, w) over its norm. NaN without derivatives.
    pub fn derivative_error(&self) -> f64 {
        if self.plan.derivatives.is_empty() { f64::NAN } else { self.number(Quantity::DerivativeError) }
    }

    /// What is left of the balance of moments at the tip (N·m).
    pub fn residual(&self) -> f64 {
        self.number(Quantity::Residual) * self.plan.units.moment()
    }

    /// Passes over the rod that it took.
    pub fn iterations(&self) -> usize {
        self.solutions.get(0, Quantity::Iterations) as usize
    }

    /// Contact of the tip with the wall; `None` without a wall or without equilibrium.
    pub fn contact(&self) -> Option<Contact> {
        Contact::of(&self.plan, &self.solutions, 0)
    }

    /// Share of the full load that was reached from rest; 1 where the rod has converged. Above 1 at a fold beside a wall: 1 plus the
    /// share of its way that the wall came, under the full load.
    pub fn load_fraction(&self) -> f64 {
        self.solutions.get(0, Quantity::LoadFraction)
    }

    fn number(&self, quantity: Quantity) -> f64 {
        if self.is_equilibrium() { self.solutions.get(0, quantity) } else { f64::NAN }
    }

    fn vector(&self, quantity: Quantity) -> Vector {
        if self.is_equilibrium() { self.solutions.vector(0, quantity) } else { [f64::NAN; 3] }
    }
}

/// Unit quaternion x, y, z, w of a rotation, w not negative.
fn quaternion(rotation: &Matrix) -> [f64; 4] {
    let r = rotation;
    // The largest component first, for its square root loses no digits.
    let four = [
        1.0 + r[0][0] - r[1][1] - r[2][2],
        1.0 - r[0][0] + r[1][1] - r[2][2],
        1.0 - r[0][0] - r[1][1] + r[2][2],
        1.0 + r[0][0] + r[1][1] + r[2][2],
    ];
    let (xy, xz, yz) = (r[0][1] + r[1][0], r[0][2] + r[2][0], r[1][2] + r[2][1]);
    let (xw, yw, zw) = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]);
    let largest = (0..4).max_by(|a, b| four[*a].total_cmp(&four[*b])).unwrap_or(3);
    let q = match largest {
        0 => [four[0], xy, xz, xw],
        1 => [xy, four[1], yz, yw],
        2 => [xz, yz, four[2], zw],
        _ => [xw, yw, zw, four[3]],
    };
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt().copysign(if q[3] < 0.0 { -1.0 } else { 1.0 });
    q.map(|x| x / norm)
}
