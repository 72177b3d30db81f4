//! What came of a trajectory or of many targets.

use super::ControlOptions;
use crate::model::{Parameter, Scene, Vector};
use crate::results::Contact;
use crate::spec::{ControlInput, Target, Trajectory};
use crate::study::witness::WitnessCheck;

/// How the search for one target ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Outcome {
    /// The tip is where it should be.
    Reached,
    /// The nearest point within the limits of the inputs.
    AtLimit,
    /// The nearest point that the tip can go to; no limit is in the way.
    Unreachable,
    /// Every step, however short, leads away, or to no stable equilibrium nearby.
    Stuck,
    /// The search was still on its way when it had used its equilibria up.
    IterationLimit,
    /// The tip is where it should be, but its error is estimated above the tolerance.
    Inaccurate,
}

impl Outcome {
    /// Every outcome.
    pub const ALL: [Outcome; 6] = [
        Outcome::Reached,
        Outcome::AtLimit,
        Outcome::Unreachable,
        Outcome::Stuck,
        Outcome::IterationLimit,
        Outcome::Inaccurate,
    ];

    /// The word written to files.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Reached => "reached",
            Outcome::AtLimit => "at-limit",
            Outcome::Unreachable => "unreachable",
            Outcome::Stuck => "stuck",
            Outcome::IterationLimit => "iteration-limit",
            Outcome::Inaccurate => "inaccurate",
        }
    }
}

/// What came of one target, SI. Where it is not reached, the nearest permitted point.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TargetResult {
    /// What was asked for.
    pub target: Target,
    /// Values of the inputs, in their order.
    pub inputs: Vec<f64>,
    /// Where the tip is, world frame (m).
    pub tip: Vector,
    /// Its unit tangent, world frame.
    pub tangent: Vector,
    /// What is left: controlled coordinates, and the tangent times its weight (m).
    pub residual: f64,
    /// How the search ended.
    pub outcome: Outcome,
    /// Equilibria with Jacobian that it took.
    pub iterations: usize,
    /// Stability margin of the equilibrium; positive where it is stable.
    pub margin: f64,
    /// Error of the integration at the tip, over the rod's length.
    pub error_estimate: f64,
    /// Internal moment at the base (N·m).
    pub base_moment: Vector,
    /// Contact of the tip with the wall; `None` without a wall.
    pub contact: Option<Contact>,
    /// Whether the loads, raised together from zero, lead to this equilibrium.
    pub from_rest: bool,
    /// Wall time of the search; of its share in a batch (s).
    pub seconds: f64,
}

/// What was asked of a rod and what came of it: inputs for every target.
#[derive(Clone, Debug)]
pub struct ControlRun {
    pub(super) scene: Scene,
    pub(super) trajectory: Trajectory,
    pub(super) inputs: Vec<ControlInput>,
    pub(super) options: ControlOptions,
    pub(super) results: Vec<TargetResult>,
    pub(super) engine: String,
    pub(super) in_order: bool,
    pub(super) seconds_of_a_lone_step: Option<f64>,
    pub(super) check: WitnessCheck,
}

impl ControlRun {
    /// The scene, with its own values.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What was asked for.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// What is commanded, within which limits.
    pub fn inputs(&self) -> &[ControlInput] {
        &self.inputs
    }

    /// The options in force.
    pub fn options(&self) -> &ControlOptions {
        &self.options
    }

    /// One a target, in the order of the targets.
    pub fn results(&self) -> &[TargetResult] {
        &self.results
    }

    /// The engine that solved, for a person.
    pub fn engine(&self) -> &str {
        &self.engine
    }

    /// What the reference says of a share of the results.
    pub fn check(&self) -> &WitnessCheck {
        &self.check
    }

    /// What speaks against the results; `None`: nothing that is known.
    pub fn mark(&self) -> Option<&str> {
        self.check.mark.as_deref()
    }

    /// Whether targets were followed in their order, rather than reached all at once.
    pub fn is_in_order(&self) -> bool {
        self.in_order
    }

    /// Time of a step where each target is known only when the last is reached (s); `None` unless it was measured.
    pub fn seconds_of_a_lone_step(&self) -> Option<f64> {
        self.seconds_of_a_lone_step
    }

    /// How many searches ended so.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.results.iter().filter(|result| result.outcome == outcome).count()
    }

    /// Targets that are not reached.
    pub fn missed_count(&self) -> usize {
        self.results.len() - self.count(Outcome::Reached)
    }

    /// Distance of the tip from its target in the controlled coordinates (m).
    pub fn tip_error(&self, result: &TargetResult) -> f64 {
        norm(self.options.controlled(std::array::from_fn(|a| result.tip[a] - result.target.position[a])))
    }

    /// By how much the normal force differs from its target's (N); `None` where it is free.
    pub fn force_error(&self, result: &TargetResult) -> Option<f64> {
        let contact = result.contact.as_ref()?;
        Some((contact.normal_force - result.target.normal_force?).abs())
    }

    /// Where the tip should be; where a coordinate is free, the target goes along with the tip (m).
    pub fn desired_tip(&self, result: &TargetResult) -> Vector {
        std::array::from_fn(|a| if self.options.coordinates[a] { result.target.position[a] } else { result.tip[a] })
    }

    /// The scene with the inputs of one target; `None` where they make no scene.
    pub fn commanded_scene(&self, result: &TargetResult) -> Option<Scene> {
        let mut scene = self.scene.clone();
        let values = self.inputs.iter().map(|input| input.parameter).zip(result.inputs.iter().copied());
        Parameter::set_all(&mut scene, values).ok()?;
        Some(scene)
    }

    /// One value a target, and on a closed trajectory the first of them once more at the end.
    pub(crate) fn closed<T: Copy>(&self, mut values: Vec<T>) -> Vec<T> {
        if self.trajectory.closed && self.in_order {
            values.extend(values.first().copied());
        }
        values
    }
}

impl TargetResult {
    /// Angle between the tip's tangent and the target's (rad); `None` where the target has none.
    pub fn tangent_error(&self) -> Option<f64> {
        let target = self.target.tangent?;
        let half = 0.5 * norm((0..3).map(|a| self.tangent[a] - target[a]));
        Some(2.0 * half.min(1.0).asin())
    }
}

fn norm(v: impl IntoIterator<Item = f64>) -> f64 {
    v.into_iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The median time of a step (s): a shared machine interrupts. `None` where no step was taken.
pub(super) fn median_step(results: &[TargetResult]) -> Option<f64> {
    let taken = results.iter().filter(|result| result.iterations > 0);
    let mut each: Vec<f64> = taken.map(|result| result.seconds / result.iterations as f64).collect();
    each.sort_by(f64::total_cmp);
    each.get(each.len() / 2).copied()
}
