//! Recorded commands through the model, beside the tips that were observed.

use super::columns::Columns;
use super::witness::{CheckError, Claim, WitnessCheck};
use super::{Agreement, ControlError, agreement, play};
use crate::engines::cpu_f64;
use crate::model::{Parameter, Scene, Vector};
use crate::results::{ResultsError, write_table};
use crate::spec::{InputTable, ObservedTip};
use crate::table::Table;
use serde_json::{Value, json};
use std::path::Path;

const NOWHERE: Vector = [f64::NAN; 3];

/// Where recorded commands lead the tip, by the model.
///
/// ```no_run
/// use rodsweep::input::{read_input_table, read_observed_tips, read_scene};
/// use rodsweep::study::Replay;
///
/// let scene = read_scene("p6.toml".as_ref())?;
/// let commands = read_input_table("lap.csv".as_ref(), &scene)?;
/// let observed = read_observed_tips("seen.csv".as_ref(), commands.row_count())?;
/// let replay = Replay::new(scene, commands)?;
/// let found = replay.compare(&observed)?;
/// println!("{:.2} mm off, {:.2} after alignment", 1e3 * found.agreement.rmse, 1e3 * found.agreement.aligned_rmse);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Replay {
    scene: Scene,
    commands: InputTable,
    tips: Vec<Option<Vector>>,
    check: WitnessCheck,
}

impl Replay {
    /// Plays every row from rest; on the CPU in f64.
    ///
    /// # Errors
    ///
    /// A scene that makes no plan, an engine that fails, or no row with a stable equilibrium.
    pub fn new(scene: Scene, commands: InputTable) -> Result<Replay, ControlError> {
        let rows: Vec<Vec<f64>> = (0..commands.row_count()).map(|row| commands.row(row).to_vec()).collect();
        let tips = play(&scene, commands.parameters(), &rows, &mut |plan| cpu_f64(plan))?;
        if tips.iter().all(Option::is_none) {
            return Err(ControlError::NothingPlayed);
        }
        let axes: Vec<Vec<Parameter>> = commands.parameters().iter().map(|parameter| vec![*parameter]).collect();
        let mut claim = |row: usize| Some(Claim { inputs: rows[row].clone(), tip: tips[row]?, error_estimate: 0.0 });
        let check = WitnessCheck::of(&scene, &axes, tips.len(), &mut claim).map_err(|error| match error {
            CheckError::Plan(error) => ControlError::from(error),
            CheckError::Backend(error) => error.into(),
        })?;
        Ok(Replay { scene, commands, tips, check })
    }

    /// A share of the states, solved again by the reference.
    pub fn check(&self) -> &WitnessCheck {
        &self.check
    }

    /// The scene, with its own values.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Tips by row (m); `None` where there is no stable equilibrium from rest.
    pub fn tips(&self) -> &[Option<Vector>] {
        &self.tips
    }

    /// Rows without a stable equilibrium from rest.
    pub fn lost(&self) -> usize {
        self.tips.iter().filter(|tip| tip.is_none()).count()
    }

    /// One row a command: `point`, the commands by name, `tip.position.*`.
    pub fn table(&self) -> Table {
        let rows = 0..self.commands.row_count();
        let mut columns = Columns::default();
        columns.counts("point", rows.clone().map(|k| k as u64));
        for (k, parameter) in self.commands.parameters().iter().enumerate() {
            let values = rows.clone().map(|row| self.commands.row(row)[k]);
            columns.numbers(parameter.name(&self.scene), parameter.unit(), values);
        }
        columns.vectors("tip.position", "m", &self.tips.iter().map(|tip| tip.unwrap_or(NOWHERE)).collect::<Vec<_>>());
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

    /// The tips as JSON (m).
    pub fn to_json(&self) -> Value {
        json!({
            "states": self.tips.len(),
            "lost": self.lost(),
            "tips": self.tips,
            "check": self.check,
            "distrusted": self.check.mark,
        })
    }

    /// How well observed tips agree with the model's.
    ///
    /// # Errors
    ///
    /// No observed tip that belongs to a row with a stable equilibrium.
    ///
    /// # Panics
    ///
    /// If a tip belongs to a row that there is not.
    pub fn compare(&self, observed: &[ObservedTip]) -> Result<ReplayComparison, ControlError> {
        let pair = |seen: &ObservedTip| Some((seen.position, self.tips[seen.command]?));
        let pairs: Vec<(Vector, Vector)> = observed.iter().filter_map(pair).collect();
        let agreement = agreement(&pairs).ok_or(ControlError::NothingToCompare)?;
        let pair = |seen: &ObservedTip| (*seen, self.tips[seen.command]);
        Ok(ReplayComparison { agreement, compared: pairs.len(), pairs: observed.iter().map(pair).collect() })
    }
}

/// Observed tips beside those of the model.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ReplayComparison {
    /// Of the tips that could be compared, observed less model.
    pub agreement: Agreement,
    /// Tips that could be compared: the model has a stable equilibrium.
    pub compared: usize,
    /// Every observed tip and that of the model (m).
    pub pairs: Vec<(ObservedTip, Option<Vector>)>,
}

impl ReplayComparison {
    /// Observed less model, as it is and without the mean offset: `point`, `observed.*`, `residual.*`, `distance`,
    /// `distance_without_offset` (m).
    pub fn table(&self) -> Table {
        let apart = |(seen, tip): &(ObservedTip, Option<Vector>)| -> Vector {
            let tip = tip.unwrap_or(NOWHERE);
            std::array::from_fn(|a| seen.position[a] - tip[a])
        };
        let residuals: Vec<Vector> = self.pairs.iter().map(apart).collect();
        let norm = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let without = |v: &Vector| norm(std::array::from_fn(|a| v[a] - self.agreement.offset[a]));
        let mut columns = Columns::default();
        columns.counts("point", self.pairs.iter().map(|(seen, _)| seen.command as u64));
        columns.vectors("observed", "m", &self.pairs.iter().map(|(seen, _)| seen.position).collect::<Vec<_>>());
        columns.vectors("residual", "m", &residuals);
        columns.numbers("distance", "m", residuals.iter().map(|v| norm(*v)));
        columns.numbers("distance_without_offset", "m", residuals.iter().map(without));
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

    /// The agreement as JSON (m).
    pub fn to_json(&self) -> Value {
        let Agreement { rmse, offset, centred_rmse, aligned_rmse } = self.agreement;
        json!({
            "count": self.compared, "rmse": rmse, "offset": offset, "rmse_without_offset": centred_rmse,
            "aligned_rmse": aligned_rmse,
        })
    }
}
