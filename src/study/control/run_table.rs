//! A run of control as a table, as a file, as JSON.

use super::{ControlRun, Outcome, TargetResult};
use crate::model::Vector;
use crate::results::{Contact, ResultsError, verdict_metadata, write_table};
use crate::spec::ControlInput;
use crate::study::columns::Columns;
use crate::study::solve::contact_json;
use crate::table::Table;
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

const XYZ: [&str; 3] = ["x", "y", "z"];

impl ControlRun {
    /// One row a target: `point`, `time` where there is one, `target.*`, the inputs by name, `status`, `tip.*` and so on.
    pub fn table(&self) -> Table {
        let results = self.results();
        let mut columns = Columns::default();
        columns.counts("point", 0..results.len() as u64);
        if let Some(duration) = self.trajectory().duration {
            let step = duration / results.len() as f64;
            columns.numbers("time", "s", (0..results.len()).map(|k| step * k as f64));
        }
        for (a, axis) in XYZ.iter().enumerate().filter(|(a, _)| self.options().coordinates[*a]) {
            let values = results.iter().map(|result| result.target.position[a]);
            columns.numbers(format!("target.position.{axis}"), "m", values);
        }
        let has_tangent = results.iter().any(|result| result.target.tangent.is_some());
        if has_tangent {
            let tangents = results.iter().map(|result| result.target.tangent.unwrap_or([f64::NAN; 3]));
            columns.vectors("target.tangent", "", &tangents.collect::<Vec<Vector>>());
        }
        let has_force = results.iter().any(|result| result.target.normal_force.is_some());
        if has_force {
            let forces = results.iter().map(|result| result.target.normal_force.unwrap_or(f64::NAN));
            columns.numbers("target.normal_force", "N", forces);
        }
        for (k, input) in self.inputs().iter().enumerate() {
            let values = results.iter().map(|result| result.inputs[k]);
            columns.numbers(input.name(self.scene()), input.parameter.unit(), values);
        }
        columns.words("status", results.iter().map(|result| result.outcome.name().to_owned()));
        columns.vectors("tip.position", "m", &results.iter().map(|result| result.tip).collect::<Vec<Vector>>());
        columns.vectors("tip.tangent", "", &results.iter().map(|result| result.tangent).collect::<Vec<Vector>>());
        columns.numbers("tip_error", "m", results.iter().map(|result| self.tip_error(result)));
        if has_tangent {
            let errors = results.iter().map(|result| result.tangent_error().unwrap_or(f64::NAN));
            columns.numbers("tangent_error", "rad", errors);
        }
        if self.scene().wall.is_some() {
            self.contact_columns(&mut columns);
        }
        if has_force {
            let errors = results.iter().map(|result| self.force_error(result).unwrap_or(f64::NAN));
            columns.numbers("normal_force_error", "N", errors);
        }
        columns.numbers("residual", "m", results.iter().map(|result| result.residual));
        columns.counts("iterations", results.iter().map(|result| result.iterations as u64));
        columns.numbers("stability.margin", "", results.iter().map(|result| result.margin));
        columns.numbers("error_estimate", "", results.iter().map(|result| result.error_estimate));
        columns.flags("from_rest", results.iter().map(|result| result.from_rest));
        columns.numbers("seconds", "s", results.iter().map(|result| result.seconds));
        columns.finish()
    }

    /// Force and friction at the wall, by the names that they have in a run.
    fn contact_columns(&self, columns: &mut Columns) {
        let of = |number: fn(&Contact) -> f64| {
            self.results().iter().map(move |result| result.contact.as_ref().map_or(f64::NAN, number))
        };
        columns.flags("contact.touching", self.results().iter().map(|r| r.contact.is_some_and(|c| c.touching)));
        columns.numbers("contact.normal_force", "N", of(|contact| contact.normal_force));
        let force = |result: &TargetResult| result.contact.map_or([f64::NAN; 3], |contact| contact.force);
        columns.vectors("contact.force", "N", &self.results().iter().map(force).collect::<Vec<Vector>>());
        columns.numbers("contact.friction_ratio", "", of(|contact| contact.friction_ratio.unwrap_or(f64::NAN)));
        columns.numbers("contact.force_error", "N", of(|contact| contact.force_error));
    }

    /// Writes the table; CSV unless the name ends in `.parquet`. What is there is replaced.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ResultsError> {
        let metadata = [
            ("rodsweep.version", env!("CARGO_PKG_VERSION").to_owned()),
            ("rodsweep.scene", self.scene().name.clone()),
            ("rodsweep.trajectory", self.trajectory().name.clone()),
            ("rodsweep.engine", self.engine().to_owned()),
            verdict_metadata(self.mark()),
        ];
        write_table(path, &self.table(), &metadata)
    }

    /// The run as JSON, SI, all of it in memory; [`ControlRun::write_json`] is for long runs.
    pub fn to_json(&self) -> Value {
        serde_json::to_value(AsJson { run: self, simulation: None }).unwrap_or_default()
    }

    /// Writes the run as JSON, SI, one point after another; `simulation` is added under that name.
    ///
    /// # Errors
    ///
    /// A writer that takes no more.
    pub fn write_json(&self, simulation: Option<&Value>, to: &mut dyn Write) -> std::io::Result<()> {
        Ok(serde_json::to_writer_pretty(to, &AsJson { run: self, simulation })?)
    }

    fn point_json(&self, result: &TargetResult) -> Value {
        let mut point = json!({
            "target": { "position": result.target.position, "tangent": result.target.tangent },
            "inputs": result.inputs,
            "status": result.outcome.name(),
            "tip": { "position": result.tip, "tangent": result.tangent },
            "tip_error": self.tip_error(result),
            "tangent_error": result.tangent_error(),
            "residual": result.residual,
            "iterations": result.iterations,
            "stability_margin": result.margin,
            "error_estimate": result.error_estimate,
            "from_rest": result.from_rest,
            "seconds": result.seconds,
        });
        if let Some(force) = result.target.normal_force {
            point["target"]["normal_force"] = json!(force);
            point["normal_force_error"] = json!(self.force_error(result));
        }
        if let Some(contact) = result.contact {
            point["contact"] = contact_json(contact);
        }
        point
    }
}

/// A run that is written point by point.
struct AsJson<'a> {
    run: &'a ControlRun,
    simulation: Option<&'a Value>,
}

/// The points of a run, each made when it is written.
struct Points<'a>(&'a ControlRun);

impl Serialize for Points<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.results().iter().map(|result| self.0.point_json(result)))
    }
}

impl Serialize for AsJson<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let run = self.run;
        let input = |input: &ControlInput| json!({ "parameter": input.name(run.scene()), "low": input.low, "high": input.high });
        let has_force = run.results().iter().any(|result| result.target.normal_force.is_some());
        let position = XYZ.into_iter().zip(run.options().coordinates);
        let controlled = position.chain([("normal_force", has_force)]).filter(|(_, on)| *on).map(|(name, _)| name);
        let counts: BTreeMap<_, _> = Outcome::ALL.map(|outcome| (outcome.name(), run.count(outcome))).into();
        // In the order of a sorted map.
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("check", run.check())?;
        map.serialize_entry("coordinates", &controlled.collect::<Vec<_>>())?;
        map.serialize_entry("counts", &counts)?;
        map.serialize_entry("distrusted", &run.mark())?;
        map.serialize_entry("engine", run.engine())?;
        map.serialize_entry("inputs", &run.inputs().iter().map(input).collect::<Vec<_>>())?;
        map.serialize_entry("points", &Points(run))?;
        map.serialize_entry("seconds_of_a_step_alone", &run.seconds_of_a_lone_step())?;
        if let Some(simulation) = self.simulation {
            map.serialize_entry("simulation", simulation)?;
        }
        map.serialize_entry("tolerance", &run.options().tolerance)?;
        map.end()
    }
}
