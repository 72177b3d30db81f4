//! Figures of a run: where the tip goes, and where samples fail.

use super::files::Drawn;
use super::wall::still_wall;
use crate::draw::{
    AxisLabel, Cloud, Colour, Counts, Curves, FailureMap, Marker, Panel, ReportError, Series, Sheet, Surroundings,
    SweptAxis,
};
use crate::model::{Status, closest};
use crate::reference;
use crate::results::{Reduction, Results, ResultsError};
use crate::spec::SweepSpec;
use crate::table::{Column, Table, Values};
use std::path::{Path, PathBuf};

/// Points along the rod that is drawn in the cloud.
const ROD_POINTS: usize = 101;
/// Columns that colour the cloud, in order of preference; swept parameters follow.
const COLOURS: [&str; 2] = ["stability.margin", "error_estimate"];

/// Why a run could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunFiguresError {
    /// The results cannot be read.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// A figure cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The colour is no column without derivatives.
    #[error("no column `{name}` to colour by{}; use one of: {}", suggestion.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default(), known.join(", "))]
    Colour {
        /// What was asked for.
        name: String,
        /// The column whose name is nearest.
        suggestion: Option<String>,
        /// Columns that there are.
        known: Vec<String>,
    },
}

/// The figures of a run: a cloud of tips, equilibria where every one was asked for, statuses.
#[derive(Clone, Debug, Default)]
pub struct RunFigures {
    colour: Option<String>,
    mark: Option<String>,
}

impl RunFigures {
    /// The cloud is coloured by the stability margin where there is one.
    pub fn new() -> RunFigures {
        RunFigures::default()
    }

    /// Column that colours the cloud of tips.
    pub fn colour(self, column: Option<&str>) -> RunFigures {
        RunFigures { colour: column.map(str::to_owned), ..self }
    }

    /// What speaks against the rows: every figure says it.
    pub fn mark(self, mark: Option<String>) -> RunFigures {
        RunFigures { mark, ..self }
    }

    /// Whether a sweep writes the column of the colour, before anything is solved.
    ///
    /// # Errors
    ///
    /// It does not.
    pub fn check(&self, spec: &SweepSpec) -> Result<(), RunFiguresError> {
        match &self.colour {
            Some(name) if !spec.column_names().contains(name) => Err(no_colour(spec, name)),
            _ => Ok(()),
        }
    }

    /// Draws the results of a directory into a folder, for example the directory itself; returns the files.
    ///
    /// # Errors
    ///
    /// Results that cannot be read, or a figure that cannot be written.
    pub fn draw(&self, results: &Results, folder: &Path) -> Result<Vec<PathBuf>, RunFiguresError> {
        Ok(self.drawn(results, folder)?.files)
    }

    /// The same, with what was left out since there was nothing to draw.
    ///
    /// # Errors
    ///
    /// As [`RunFigures::draw`].
    pub fn drawn(&self, results: &Results, folder: &Path) -> Result<Drawn, RunFiguresError> {
        self.check(results.spec())?;
        let verdict = results.verdict()?;
        let mark = self.mark.clone().or_else(|| verdict.and_then(|verdict| verdict.headline()));
        let marked = RunFigures { mark, ..self.clone() };
        marked.drawn_reduction(results.spec(), &results.reduce_without_voxels()?, folder)
    }

    /// Draws what a run has kept of its rows; returns the files. Voxels are not drawn.
    ///
    /// # Errors
    ///
    /// A colour that is no column, or a figure that cannot be written.
    pub fn draw_reduction(
        &self,
        spec: &SweepSpec,
        reduction: &Reduction,
        folder: &Path,
    ) -> Result<Vec<PathBuf>, RunFiguresError> {
        Ok(self.drawn_reduction(spec, reduction, folder)?.files)
    }

    /// The same, with what was left out since there was nothing to draw.
    ///
    /// # Errors
    ///
    /// As [`RunFigures::draw_reduction`].
    pub fn drawn_reduction(
        &self,
        spec: &SweepSpec,
        reduction: &Reduction,
        folder: &Path,
    ) -> Result<Drawn, RunFiguresError> {
        let tips = &reduction.tips;
        let (cloud, rest) = rayon::join(
            || self.draw_cloud(spec, tips, folder),
            || draw_counts(spec, reduction, folder, self.mark.as_deref()),
        );
        let mut drawn = cloud?;
        drawn.extend(rest?);
        Ok(drawn)
    }

    fn draw_cloud(&self, spec: &SweepSpec, tips: &Table, folder: &Path) -> Result<Drawn, RunFiguresError> {
        let mut drawn = Drawn::default();
        if let Some(cloud) = cloud(spec, tips, self.colour.as_deref())? {
            drawn.write(&cloud, ["tips.png", "tips.svg"].map(|name| folder.join(name)), self.mark.as_deref())?;
        }
        Ok(drawn)
    }
}

/// Draws equilibria where every one was asked for, and statuses.
fn draw_counts(
    spec: &SweepSpec,
    reduction: &Reduction,
    folder: &Path,
    mark: Option<&str>,
) -> Result<Drawn, ReportError> {
    let tips = &reduction.tips;
    let mut drawn = Drawn::default();
    if let Some(panels) = branch_panels(spec, tips) {
        let path = folder.join("branches.png");
        let panels: Vec<&dyn Panel> = panels.iter().map(|panel| panel as &dyn Panel).collect();
        drawn.write(&Sheet { columns: 2, panels }, [path], mark)?;
    }
    let path = folder.join("statuses.png");
    let count = |status: Status| (status, reduction.counts[status.code() as usize]);
    let counts = Counts {
        title: if reduction.branches.is_some() { "Equilibria by status" } else { "Samples by status" }.into(),
        counts: Status::ALL.into_iter().map(count).collect(),
    };
    let map = if reduction.branches.is_some() { None } else { failure_map(tips) };
    let mut panels: Vec<&dyn Panel> = vec![&counts];
    if let Some(map) = &map {
        panels.push(map);
    }
    if reduction.sample_count > 0 {
        drawn.write(&Sheet { columns: panels.len(), panels }, [path], mark)?;
    }
    Ok(drawn)
}

fn no_colour(spec: &SweepSpec, name: &str) -> RunFiguresError {
    let known = spec.column_names();
    let suggestion = closest(name, known.iter().map(String::as_str));
    RunFiguresError::Colour { name: name.into(), suggestion, known }
}

/// Tip and energy of every equilibrium over the swept parameter; `None` where there is more than one, or no choice.
fn branch_panels(spec: &SweepSpec, tips: &Table) -> Option<Vec<Curves>> {
    let (position, from_rest) = (tips.vector_columns("tip.position")?, tips.column("from_rest")?);
    let ([_], Some(swept), status) = (&spec.axes[..], tips.columns.get(1), tips.statuses()) else { return None };
    let is_from_rest = |row: usize| from_rest.values.number(row) == 1.0;
    let is_stable = |row: usize| status[row].is_success();
    let panel = |name: &str, unit: &str, values: &Values| {
        let scatter = |name: &str, is_wanted: &dyn Fn(usize) -> bool| {
            let rows = (0..status.len()).filter(|row| status[*row].is_converged() && is_wanted(*row));
            let points = rows.map(|row| [swept.values.number(row), 1e3 * values.number(row)]).collect();
            Series::scatter(name, points, Marker::Circle)
        };
        Curves {
            title: name.into(),
            x: AxisLabel::linear(&swept.name, &swept.unit),
            y: AxisLabel::linear(name, unit),
            series: vec![
                scatter("unstable", &|row| !is_stable(row)).hollow().colour(Colour::SERIES[1]),
                scatter("stable", &|row| is_stable(row) && !is_from_rest(row)).colour(Colour::SERIES[0]),
                scatter("from rest", &|row| is_stable(row) && is_from_rest(row)).colour(Colour::SERIES[2]),
            ],
        }
    };
    let drawn = |column: &Values| (0..column.len()).any(|row| column.number(row).is_finite());
    let energy = tips.column("energy").map(|column| ("energy", "mJ", &column.values));
    let names = ["tip.position.x", "tip.position.y", "tip.position.z"];
    let columns = names.into_iter().zip(position).map(|(name, values)| (name, "mm", values)).chain(energy);
    let panels: Vec<Curves> =
        columns.filter(|(_, _, values)| drawn(values)).map(|(name, unit, values)| panel(name, unit, values)).collect();
    (!panels.is_empty()).then_some(panels)
}

/// A column's name as a figure says it; names of parameters stay.
fn words(column: &str) -> String {
    match column {
        "stability.margin" => "stability margin".into(),
        "error_estimate" | "load_fraction" | "derivative_error" => column.replace('_', " "),
        _ => column.into(),
    }
}

/// The tips that can be used; `None` where there are none.
fn cloud(spec: &SweepSpec, tips: &Table, colour: Option<&str>) -> Result<Option<Cloud>, RunFiguresError> {
    let Some(position) = tips.vector_columns("tip.position") else { return Ok(None) };
    let column = match colour {
        Some(name) => match tips.column(name) {
            Some(column) => column,
            None => return Err(no_colour(spec, name)),
        },
        None => match COLOURS.iter().find_map(|name| tips.column(name)).or(tips.columns.get(1)) {
            Some(column) => column,
            None => return Ok(None),
        },
    };
    let rows: Vec<usize> =
        tips.statuses().iter().enumerate().filter(|(_, status)| status.is_success()).map(|(row, _)| row).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    Ok(Some(Cloud {
        points: rows.iter().map(|row| position.map(|values| values.number(*row))).collect(),
        values: rows.iter().map(|row| column.values.number(*row)).collect(),
        quantity: words(&column.name),
        unit: column.unit.clone(),
        title: if spec.scene.name.is_empty() { "Tip positions".into() } else { spec.scene.name.clone() },
        map: None,
        rod: rod_of_scene(spec),
        surroundings: surroundings(spec),
        wall: still_wall(&spec.scene, spec.axis_parameters().concat()),
    }))
}

/// What makes the field of the scene vary, as it stands in the file; lines only where the sweep leaves the field alone.
fn surroundings(spec: &SweepSpec) -> Option<Surroundings> {
    let swept = spec.axes.iter().flat_map(|axis| &axis.parameters);
    Some(swept.fold(Surroundings::of(&spec.scene)?, |around, parameter| around.swept(*parameter)))
}

/// The rod of the scene as it stands in the file, before the sweep moves it.
fn rod_of_scene(spec: &SweepSpec) -> Option<Vec<[f64; 3]>> {
    let rod = spec.scene.rod();
    let equilibrium = reference::solve_rod(&rod, &[]);
    let length = rod.total_length();
    let at: Vec<f64> = (0..ROD_POINTS).map(|k| length * k as f64 / (ROD_POINTS - 1) as f64).collect();
    let poses = reference::shape(&rod, &equilibrium, &at);
    equilibrium.status.is_converged().then(|| poses.into_iter().map(|pose| pose.position).collect())
}

/// Failures over the first two swept parameters; `None` where there are not two, or nothing failed.
fn failure_map(tips: &Table) -> Option<FailureMap> {
    let status = tips.statuses();
    let end = tips.columns.iter().position(|column| column.name == "status")?;
    let swept = tips.columns.get(1..end)?;
    if status.iter().all(|status| status.is_success()) {
        return None;
    }
    let axis = |column: &Column| SweptAxis {
        label: column.name.clone(),
        unit: column.unit.clone(),
        values: (0..status.len()).map(|row| column.values.number(row)).collect(),
    };
    let [x, y, ..] = swept else { return None };
    Some(FailureMap { title: "Where samples fail".into(), x: axis(x), y: axis(y), status: status.to_vec() })
}
