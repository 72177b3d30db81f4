//! The paper's experiment, simulated, beside what it measured: four trajectories, each played on catheters that differ
//! from the model.

use super::columns::Columns;
use super::{ControlError, ControlEvent, ControlJob, ControlRun, Imperfection, Outcome, Simulation, TRIALS};
use crate::input::{InputError, parse_trajectory};
use crate::results::{ResultsError, write_table};
use crate::spec::Trajectory;
use crate::table::Table;
use serde_json::{Value, json};
use std::path::Path;

const FILES: [(&str, &str); 4] = [
    ("circle.toml", include_str!("../../sweeps/trajectories/circle.toml")),
    ("lemniscate.toml", include_str!("../../sweeps/trajectories/lemniscate.toml")),
    ("rectangle.toml", include_str!("../../sweeps/trajectories/rectangle.toml")),
    ("butterfly.toml", include_str!("../../sweeps/trajectories/butterfly.toml")),
];

/// What the paper measured on one trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Measured {
    /// Root mean square errors (mm): the two numbers that it gives, by Table I and by the text on Fig. 5.
    pub rmse: [f64; 2],
    /// After rigid alignment (mm), where it is known.
    pub aligned_rmse: Option<f64>,
}

/// What the paper measured, in the order of the trajectories: circle, lemniscate, rectangle, butterfly.
pub const MEASURED: [Measured; 4] = [
    Measured { rmse: [4.34, 2.84], aligned_rmse: Some(1.81) },
    Measured { rmse: [6.49, 5.33], aligned_rmse: None },
    Measured { rmse: [4.60, 5.97], aligned_rmse: None },
    Measured { rmse: [3.66, 6.44], aligned_rmse: None },
];

/// The paper's experiment, to be simulated.
///
/// ```no_run
/// use rodsweep::input::read_scene;
/// use rodsweep::study::{ControlJob, Experiment};
///
/// let scene = read_scene("sweeps/scenes/p35.toml".as_ref())?;
/// let found = Experiment::new(ControlJob::new(scene))?.catheters(20).seed(1).run()?;
/// for played in &found.trajectories {
///     let [low, median, high] = played.quantiles_mm(|simulation| simulation.rmse);
///     println!("{}: {median:.2} mm ({low:.2}-{high:.2})", played.run.trajectory().name);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Experiment {
    job: ControlJob,
    trajectories: Vec<Trajectory>,
    imperfection: Imperfection,
    catheters: usize,
    seed: u64,
}

impl Experiment {
    /// The shipped trajectories, followed by a job.
    ///
    /// # Errors
    ///
    /// A scene that has not what the trajectories command.
    pub fn new(job: ControlJob) -> Result<Experiment, InputError> {
        let read = |(file, text): (&str, &str)| parse_trajectory(Path::new(file), text, job.scene());
        let trajectories = FILES.into_iter().map(read).collect::<Result<_, _>>()?;
        Ok(Experiment { job, trajectories, imperfection: Imperfection::default(), catheters: 20, seed: 1 })
    }

    /// Simulated catheters, one at least.
    pub fn catheters(self, catheters: usize) -> Experiment {
        Experiment { catheters: catheters.max(1), ..self }
    }

    /// Seed of the first catheter; the others count on from it.
    pub fn seed(self, seed: u64) -> Experiment {
        Experiment { seed, ..self }
    }

    /// By how much the catheters differ from the scene.
    pub fn imperfection(self, imperfection: Imperfection) -> Experiment {
        Experiment { imperfection, ..self }
    }

    /// Follows every trajectory and plays it on every catheter.
    ///
    /// # Errors
    ///
    /// As [`ControlJob::follow`].
    pub fn run(&self) -> Result<ExperimentRun, ControlError> {
        let seeds: Vec<u64> = (0..self.catheters as u64).map(|k| self.seed.wrapping_add(k)).collect();
        let mut trajectories = Vec::new();
        for (trajectory, measured) in self.trajectories.iter().zip(MEASURED) {
            let run = self.job.follow(trajectory)?;
            let play = |seed: &u64| run.simulate(&self.imperfection, TRIALS, *seed);
            let simulations = seeds.iter().map(play).collect::<Result<_, _>>()?;
            self.job.tell(ControlEvent::Played { name: trajectory.name.clone() });
            trajectories.push(PlayedTrajectory { run, simulations, measured });
        }
        Ok(ExperimentRun { imperfection: self.imperfection, seeds, trajectories })
    }
}

/// One trajectory and what the catheters made of it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PlayedTrajectory {
    /// The inputs that the model computes.
    pub run: ControlRun,
    /// One a catheter.
    pub simulations: Vec<Simulation>,
    /// By the paper, on its own prototype.
    pub measured: Measured,
}

impl PlayedTrajectory {
    /// Targets that the model reaches.
    pub fn reached(&self) -> usize {
        self.run.count(Outcome::Reached)
    }

    /// Tips without a stable equilibrium, over all catheters and trials.
    pub fn lost(&self) -> usize {
        self.simulations.iter().map(|simulation| simulation.lost).sum()
    }

    /// What 10, 50 and 90 % of the catheters stay below (mm), of a length (m).
    pub fn quantiles_mm(&self, of: impl Fn(&Simulation) -> f64) -> [f64; 3] {
        let mut values: Vec<f64> = self.simulations.iter().map(|simulation| 1e3 * of(simulation)).collect();
        values.sort_by(f64::total_cmp);
        [0.1, 0.5, 0.9].map(|share| {
            let at = share * (values.len() - 1) as f64;
            let (below, above) = (values[at.floor() as usize], values[at.ceil() as usize]);
            below + at.fract() * (above - below)
        })
    }
}

/// What the simulated experiment gave.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ExperimentRun {
    /// By how much the catheters differ from the scene.
    pub imperfection: Imperfection,
    /// One a catheter.
    pub seeds: Vec<u64>,
    /// In the order of [`MEASURED`].
    pub trajectories: Vec<PlayedTrajectory>,
}

impl ExperimentRun {
    /// The catheter in the middle by the sum of its mean square errors: its place among the seeds.
    pub fn median_catheter(&self) -> usize {
        let square = |k: usize| self.trajectories.iter().map(|played| played.simulations[k].rmse.powi(2)).sum::<f64>();
        let mut order: Vec<usize> = (0..self.seeds.len()).collect();
        order.sort_by(|a, b| square(*a).total_cmp(&square(*b)));
        order[(order.len() - 1) / 2]
    }

    /// One row a trajectory and catheter: `trajectory`, `seed`, `rmse`, `aligned_rmse`, `repeatability` (m), `lost`.
    pub fn table(&self) -> Table {
        let rows: Vec<(&str, &Simulation)> = self
            .trajectories
            .iter()
            .flat_map(|played| {
                played.simulations.iter().map(|simulation| (played.run.trajectory().name.as_str(), simulation))
            })
            .collect();
        let mut columns = Columns::default();
        columns.words("trajectory", rows.iter().map(|row| row.0.to_owned()));
        columns.counts("seed", rows.iter().map(|row| row.1.seed));
        columns.numbers("rmse", "m", rows.iter().map(|row| row.1.rmse));
        columns.numbers("aligned_rmse", "m", rows.iter().map(|row| row.1.aligned_rmse));
        columns.numbers("repeatability", "m", rows.iter().map(|row| row.1.repeatability));
        columns.counts("lost", rows.iter().map(|row| row.1.lost as u64));
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

    /// The numbers as JSON, SI: quantiles as [`PlayedTrajectory::quantiles_mm`], in metres.
    pub fn to_json(&self) -> Value {
        let quantities: [fn(&Simulation) -> f64; 3] = [|s| s.rmse, |s| s.aligned_rmse, |s| s.repeatability];
        let value = |played: &PlayedTrajectory| {
            let [rmse, aligned, repeatability] = quantities.map(|of| played.quantiles_mm(of).map(|x| 1e-3 * x));
            json!({
                "name": played.run.trajectory().name,
                "points": played.run.results().len(),
                "reached": played.reached(),
                "lost": played.lost(),
                "rmse": rmse,
                "aligned_rmse": aligned,
                "repeatability": repeatability,
                "measured_rmse": played.measured.rmse.map(|x| 1e-3 * x),
                "measured_aligned_rmse": played.measured.aligned_rmse.map(|x| x / 1e3),
            })
        };
        let trajectories: Vec<Value> = self.trajectories.iter().map(value).collect();
        json!({ "simulation": true, "trials": TRIALS, "seeds": self.seeds, "trajectories": trajectories })
    }
}
