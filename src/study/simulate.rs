//! A simulated experiment: commands computed for one catheter are played on others that differ from it, several times
//! over, and their tips are seen with noise. Nothing here is a measurement.

use super::MakeEngine;
use super::agreement::squares_after_alignment;
use super::columns::Columns;
use super::{ControlError, ControlRun};
use crate::engines::cpu_f64;
use crate::model::{Axis, Parameter, Plan, PlanOptions, Quantity, Scene, SegmentKind, SegmentParameter, Vector};
use crate::results::{ResultsError, write_table};
use crate::table::Table;
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::path::Path;

/// Trials with one catheter, as in the paper.
pub const TRIALS: usize = 10;
const STEPS: usize = 16;

/// How the played catheter differs from the modelled one: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Imperfection {
    /// Of rest curvature about x and y, each segment on its own (1/m).
    pub rest_curvature: f64,
    /// Of stiffness, all segments together, relative.
    pub stiffness: f64,
    /// Of the turns (or turns-area) of each axis, relative.
    pub winding: f64,
    /// Plastic change of the rest curvature from one trial to the next (1/m).
    pub drift: f64,
    /// Of an observed coordinate (m).
    pub noise: f64,
}

impl Default for Imperfection {
    fn default() -> Self {
        Self { rest_curvature: 0.5, stiffness: 0.1, winding: 0.03, drift: 0.05, noise: 3e-4 }
    }
}

impl Imperfection {
    /// A catheter as the model has it, seen without noise.
    pub const NONE: Imperfection =
        Imperfection { rest_curvature: 0.0, stiffness: 0.0, winding: 0.0, drift: 0.0, noise: 0.0 };

    /// In words that go on after "a catheter" or "catheters".
    pub fn in_words(&self) -> String {
        let Imperfection { rest_curvature, stiffness, winding, drift, noise } = self;
        format!(
            "whose rest curvature is off by {rest_curvature} 1/m, stiffness by {:.0} %, turns by {:.0} % (standard \
             deviations), drifting by {drift} 1/m a trial, seen with {:.1} mm of noise",
            100.0 * stiffness,
            100.0 * winding,
            1e3 * noise
        )
    }
}

/// What trials with one catheter gave.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Simulation {
    /// By how much such catheters differ.
    pub imperfection: Imperfection,
    /// What makes this one of them.
    pub seed: u64,
    /// Observed tips by trial and command (m); `None` where the catheter has no stable equilibrium from rest.
    pub trials: Vec<Vec<Option<Vector>>>,
    /// Over the trials, by command (m).
    pub mean: Vec<Option<Vector>>,
    /// Root mean square distance from the desired positions (m).
    pub rmse: f64,
    /// The same after the best rotation and translation of each trial (Kabsch) (m).
    pub aligned_rmse: f64,
    /// Root mean square distance of a trial's tip from the mean over the trials (m).
    pub repeatability: f64,
    /// Commands without a stable equilibrium, over all trials.
    pub lost: usize,
}

impl Simulation {
    /// One row a trial and command: `trial`, `point`, `tip.position.*`; no position where the tip is lost.
    pub fn table(&self) -> Table {
        let rows = || (0..self.trials.len()).flat_map(|trial| (0..self.trials[trial].len()).map(move |k| (trial, k)));
        let tips: Vec<Vector> = rows().map(|(trial, k)| self.trials[trial][k].unwrap_or([f64::NAN; 3])).collect();
        let mut columns = Columns::default();
        columns.counts("trial", rows().map(|(trial, _)| trial as u64));
        columns.counts("point", rows().map(|(_, k)| k as u64));
        columns.vectors("tip.position", "m", &tips);
        columns.finish()
    }

    /// Writes the table; CSV unless the name ends in `.parquet`. What is there is replaced.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ResultsError> {
        write_table(path, &self.table(), &[])
    }

    /// The numbers as JSON, SI.
    pub fn to_json(&self) -> Value {
        let Imperfection { rest_curvature, stiffness, winding, drift, noise } = self.imperfection;
        json!({
            "trials": self.trials.len(),
            "seed": self.seed,
            "rmse": self.rmse,
            "aligned_rmse": self.aligned_rmse,
            "repeatability": self.repeatability,
            "lost": self.lost,
            "imperfection": {
                "rest_curvature": rest_curvature, "stiffness": stiffness, "winding": winding, "drift": drift,
                "noise": noise,
            },
        })
    }
}

impl ControlRun {
    /// Plays the computed inputs several times on a catheter that a seed makes of the scene; on the CPU in f64.
    ///
    /// # Errors
    ///
    /// A scene that makes no plan, or an engine that fails.
    pub fn simulate(&self, imperfection: &Imperfection, trials: usize, seed: u64) -> Result<Simulation, ControlError> {
        let parameters: Vec<Parameter> = self.inputs().iter().map(|input| input.parameter).collect();
        let commands: Vec<Vec<f64>> = self.results().iter().map(|result| result.inputs.clone()).collect();
        let desired: Vec<Vector> = self.results().iter().map(|result| self.desired_tip(result)).collect();
        let path =
            CommandedPath { scene: self.scene(), parameters: &parameters, commands: &commands, desired: &desired };
        simulate(&path, imperfection, trials, seed, &mut |plan| cpu_f64(plan))
    }
}

/// Commands, and what they are for.
#[derive(Clone, Copy, Debug)]
pub struct CommandedPath<'a> {
    /// The catheter that the commands were computed for.
    pub scene: &'a Scene,
    /// What is commanded.
    pub parameters: &'a [Parameter],
    /// Values of the parameters by command, SI.
    pub commands: &'a [Vec<f64>],
    /// Where the tip should be at each command, world frame (m).
    pub desired: &'a [Vector],
}

/// Plays commands several times on a catheter that a seed makes of the scene.
///
/// # Errors
///
/// A scene that makes no plan, or an engine that fails.
pub fn simulate(
    path: &CommandedPath,
    imperfection: &Imperfection,
    trials: usize,
    seed: u64,
    make: &mut MakeEngine,
) -> Result<Simulation, ControlError> {
    let CommandedPath { scene, parameters, commands, desired } = *path;
    let mut random = Random(seed);
    let mut truth = scene.clone();
    disturb(&mut truth, imperfection, &mut random);
    let mut observed = Vec::new();
    for trial in 0..trials {
        if trial > 0 {
            bend(&mut truth, imperfection.drift, &mut random);
        }
        let see = |tip: Option<Vector>| {
            let noise: [f64; 3] = std::array::from_fn(|_| imperfection.noise * random.normal());
            tip.map(|tip| std::array::from_fn(|a| tip[a] + noise[a]))
        };
        observed.push(play(&truth, parameters, commands, make)?.into_iter().map(see).collect::<Vec<_>>());
    }
    Ok(Simulation { imperfection: *imperfection, seed, ..evaluate(observed, desired) })
}

/// Tips that commands lead to from rest (m); `None` where that is no stable equilibrium. `commands` holds the values of
/// the parameters, SI.
///
/// # Errors
///
/// A scene that makes no plan, or an engine that fails.
pub fn play(
    scene: &Scene,
    parameters: &[Parameter],
    commands: &[Vec<f64>],
    make: &mut MakeEngine,
) -> Result<Vec<Option<Vector>>, ControlError> {
    let axes: Vec<Vec<Parameter>> = parameters.iter().map(|parameter| vec![*parameter]).collect();
    let plan = Plan::new(scene, &axes, &[], PlanOptions { steps: STEPS, ..PlanOptions::default() })?;
    let batch = plan.batch(commands.len(), |i, row| row.copy_from_slice(&commands[i]));
    let solutions = make(&plan)?.solve(&batch)?;
    let tip = |row| solutions.status(row).is_success().then(|| solutions.vector(row, Quantity::TipPosition));
    Ok((0..commands.len()).map(tip).collect())
}

fn evaluate(trials: Vec<Vec<Option<Vector>>>, desired: &[Vector]) -> Simulation {
    let lost = trials.iter().flatten().filter(|tip| tip.is_none()).count();
    let (mut squares, mut aligned, mut spread, mut count, mut spread_count) = (0.0, 0.0, 0.0, 0, 0);
    for tips in &trials {
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> =
            tips.iter().zip(desired).filter_map(|(tip, to)| tip.map(|tip| (tip.into(), (*to).into()))).collect();
        squares += pairs.iter().map(|(tip, to)| (tip - to).norm_squared()).sum::<f64>();
        aligned += squares_after_alignment(&pairs);
        count += pairs.len();
    }
    let mut means = Vec::new();
    for command in 0..desired.len() {
        let tips: Vec<Vector3<f64>> = trials.iter().filter_map(|tips| tips[command].map(Vector3::from)).collect();
        let mean = tips.iter().sum::<Vector3<f64>>() / tips.len().max(1) as f64;
        spread += tips.iter().map(|tip| (tip - mean).norm_squared()).sum::<f64>();
        spread_count += tips.len();
        means.push((!tips.is_empty()).then(|| mean.into()));
    }
    let root = |sum: f64, count: usize| if count > 0 { (sum / count as f64).sqrt() } else { f64::NAN };
    Simulation {
        imperfection: Imperfection::NONE,
        seed: 0,
        rmse: root(squares, count),
        aligned_rmse: root(aligned, count),
        repeatability: root(spread, spread_count),
        lost,
        mean: means,
        trials,
    }
}

fn disturb(scene: &mut Scene, imperfection: &Imperfection, random: &mut Random) {
    bend(scene, imperfection.rest_curvature, random);
    let softer = (imperfection.stiffness * random.normal()).exp();
    for parameter in Parameter::all(scene) {
        use SegmentParameter as S;
        let Parameter::Segment(_, of) = parameter else { continue };
        let factor = match of {
            S::YoungsModulus | S::ShearModulus => softer,
            S::Stiffness(axis) | S::StiffnessNode(_, axis) if axis.axes().len() == 1 => softer,
            S::Turns(_) | S::TurnsArea(..) => (imperfection.winding * random.normal()).exp(),
            _ => continue,
        };
        let value = parameter.get(scene) * factor;
        // A stiffness that follows from a tube is changed by its moduli.
        let _ = parameter.set(scene, value);
    }
}

/// Changes the rest curvature of each flexible segment about x and y.
fn bend(scene: &mut Scene, deviation: f64, random: &mut Random) {
    for segment in 0..scene.segments.len() {
        let SegmentKind::Flexible(_) = scene.segments[segment].kind else { continue };
        let change = [deviation * random.normal(), deviation * random.normal()];
        for parameter in Parameter::all(scene) {
            use SegmentParameter::{RestCurvature, RestCurvatureNode};
            let Parameter::Segment(index, RestCurvature(axis) | RestCurvatureNode(_, axis)) = parameter else {
                continue;
            };
            if index == segment && axis != Axis::Z {
                let value = parameter.get(scene) + change[axis.index()];
                let _ = parameter.set(scene, value);
            }
        }
    }
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal (Box and Muller).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}
