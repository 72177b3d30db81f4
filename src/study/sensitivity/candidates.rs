//! Measurements of the tip that could be made: rows of the sweep with their derivatives by what is to be found.
//!
//! The tip's position is measured, and its tangent where a noise of that is given. The tangent is a direction: what is seen
//! of a virtual rotation w are its components along the tip's x and y.

use super::SensitivityError;
use super::design::Layout;
use super::inputs::slope_name;
use super::outputs::MARGIN;
use super::rows::Source;
use crate::model::{Matrix, Parameter, Scene, Vector, rotation_matrix};
use crate::spec::{AxisSpec, Selection, SweepSpec};
use crate::study::fit::is_scale;
use crate::table::{Column, Table};
use nalgebra::DMatrix;

/// Rows that are weighed against each other.
const MOST: u64 = 16_384;
const POSITION: [&str; 3] = ["tip.position.x", "tip.position.y", "tip.position.z"];
const ROTATION: [&str; 3] = ["tip.rotation.x", "tip.rotation.y", "tip.rotation.z"];

/// A number that is to be found; several parameters keep their ratio.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unknown {
    pub name: String,
    pub parameters: Vec<Parameter>,
    /// Values in the scene.
    pub values: Vec<f64>,
    /// Whether it counts by its logarithm.
    pub logarithmic: bool,
    /// What the sweep says of it; of a factor where it scales several parameters.
    pub prior: Option<AxisSpec>,
}

/// Standard deviations of what is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Noise {
    /// Of a coordinate of the tip (m).
    pub position: f64,
    /// Of the tip's tangent about either axis across it (rad), where it is measured.
    pub tangent: Option<f64>,
}

impl Noise {
    /// Numbers that one measurement gives.
    pub fn numbers(&self) -> usize {
        if self.tangent.is_some() { 5 } else { 3 }
    }

    /// What is measured over its noise: of slopes of the tip's position and virtual rotation, and the tip's rotation.
    pub fn weighed(&self, position: Vector, turn: Vector, rotation: &Matrix) -> Vec<f64> {
        let mut numbers: Vec<f64> = position.iter().map(|x| x / self.position).collect();
        if let Some(noise) = self.tangent {
            let along = |axis: usize| (0..3).map(|k| rotation[k][axis] * turn[k]).sum::<f64>();
            numbers.extend([along(0) / noise, along(1) / noise]);
        }
        numbers
    }
}

/// What could be measured.
pub(super) struct Candidates {
    pub samples: Vec<u64>,
    pub margins: Vec<f64>,
    /// Values of all parameters that vary, by row.
    pub commands: Vec<Vec<f64>>,
    /// By row: what is measured over its noise, by the scaled unknowns.
    pub matrices: Vec<DMatrix<f64>>,
}

impl Unknown {
    fn new(name: String, parameters: Vec<Parameter>, scene: &Scene, prior: Option<AxisSpec>) -> Unknown {
        let values: Vec<f64> = parameters.iter().map(|parameter| parameter.get(scene)).collect();
        let is_positive = parameters.iter().all(is_scale) && values.iter().all(|value| *value > 0.0);
        // Parameters that keep their ratio have a common factor.
        let logarithmic = is_positive || parameters.len() > 1;
        Unknown { name, parameters, values, logarithmic, prior }
    }

    /// Change of each parameter by the scaled unknown, at these values; curvatures count by the rod's length.
    pub fn rates(&self, values: &[f64], length: f64) -> Vec<f64> {
        let rate = |(parameter, value): (&Parameter, &f64)| match self.logarithmic {
            true => *value,
            false if parameter.unit() == "1/m" => 1.0 / length,
            false => 1.0,
        };
        self.parameters.iter().zip(values).map(rate).collect()
    }
}

/// What is to be found: named parameters (joined by `+` they keep their ratio), else what the sweep calls uncertain, else
/// every parameter with derivatives that no axis drives.
pub(super) fn unknowns(
    spec: &SweepSpec,
    columns: &[Column],
    names: &[String],
) -> Result<Vec<Unknown>, SensitivityError> {
    let scene = &spec.scene;
    let prior_of = |parameters: &[Parameter]| {
        let known = spec.uncertain.iter().find(|axis| axis.parameters == parameters);
        known.cloned()
    };
    let mut found = Vec::new();
    if names.is_empty() {
        for axis in &spec.uncertain {
            found.push(Unknown::new(axis.name(scene), axis.parameters.clone(), scene, Some(axis.clone())));
        }
        if found.is_empty() {
            let driven: Vec<Parameter> = spec.axis_parameters().concat();
            let free = spec.wrt.iter().filter(|parameter| !driven.contains(parameter));
            found.extend(free.map(|parameter| Unknown::new(parameter.name(scene), vec![*parameter], scene, None)));
        }
    }
    for name in names {
        let parts = name.split('+').map(|part| Parameter::parse(scene, part.trim()));
        let parts = parts.collect::<Result<Vec<_>, _>>()?;
        match &parts[..] {
            [group] if prior_of(group).is_none() => {
                let alone = |parameter: &Parameter| vec![*parameter];
                let each = group.iter().map(|parameter| (parameter.name(scene), alone(parameter)));
                found.extend(each.map(|(name, parameters)| {
                    let prior = prior_of(&parameters);
                    Unknown::new(name, parameters, scene, prior)
                }));
            }
            _ => {
                let parameters = parts.concat();
                let prior = prior_of(&parameters);
                let names: Vec<String> = parameters.iter().map(|parameter| parameter.name(scene)).collect();
                found.push(Unknown::new(names.join("+"), parameters, scene, prior));
            }
        }
    }
    if found.is_empty() {
        return Err(SensitivityError::NothingToIdentify);
    }
    let parameters = found.iter().flat_map(|unknown| &unknown.parameters).map(|parameter| parameter.name(scene));
    let has = |name: &String| columns.iter().any(|column| column.name == slope_name(POSITION[0], name));
    let missing: Vec<String> = parameters.filter(|name| !has(name)).collect();
    match missing.is_empty() {
        true => Ok(found),
        false => Err(SensitivityError::NoDerivatives { what: "the choice of measurements", names: missing }),
    }
}

impl Candidates {
    /// Rows that can be used and have the margin.
    pub fn read(
        source: &Source,
        layout: &Layout,
        unknowns: &[Unknown],
        noise: Noise,
        minimum_margin: f64,
    ) -> Result<Candidates, SensitivityError> {
        let spec = source.spec();
        let length = spec.scene.total_length();
        let selection = Selection::new(layout.samples, MOST, 3);
        let has_margins = source.columns().iter().any(|column| column.name == MARGIN);
        let commands: Vec<String> = spec.axis_parameters().concat().iter().map(|p| p.name(&spec.scene)).collect();
        let mut names: Vec<String> = vec!["sample".into(), "status".into()];
        names.extend(commands.iter().cloned());
        names.extend(has_margins.then(|| MARGIN.to_owned()));
        for parameter in unknowns.iter().flat_map(|unknown| &unknown.parameters) {
            let measured = POSITION.into_iter().chain(noise.tangent.iter().flat_map(|_| ROTATION));
            names.extend(measured.map(|of| slope_name(of, &parameter.name(&spec.scene))));
        }
        if noise.tangent.is_some() {
            let is_there = |name: &&str| source.columns().iter().any(|column| column.name == **name);
            if !ROTATION.iter().all(is_there) {
                return Err(SensitivityError::NoRotations);
            }
            names.extend(ROTATION.map(str::to_owned));
        }
        let mut found = Candidates { samples: vec![], margins: vec![], commands: vec![], matrices: vec![] };
        source.each(&names, |rows| {
            let margins = rows.numbers(MARGIN).unwrap_or_default();
            let columns: Vec<Vec<f64>> = commands.iter().map(|name| rows.numbers(name).unwrap_or_default()).collect();
            let positions = slopes(rows, POSITION, unknowns, &spec.scene, length);
            let turns = slopes(rows, ROTATION, unknowns, &spec.scene, length);
            let rotations = rows.vector_columns("tip.rotation");
            for (row, (sample, status)) in rows.samples().iter().zip(rows.statuses()).enumerate() {
                let margin = margins.get(row).copied().unwrap_or(f64::NAN);
                let is_safe = !has_margins || margin >= minimum_margin;
                let rotation = rotation_matrix(rotations.map_or([0.0; 3], |vector| vector.map(|x| x.number(row))));
                let vector = |slopes: &[Vec<f64>; 3]| -> Vector { std::array::from_fn(|axis| slopes[axis][row]) };
                let mut matrix = DMatrix::zeros(noise.numbers(), unknowns.len());
                for (mut column, (position, turn)) in matrix.column_iter_mut().zip(positions.iter().zip(&turns)) {
                    column.copy_from_slice(&noise.weighed(vector(position), vector(turn), &rotation));
                }
                let is_known = matrix.iter().all(|x| x.is_finite());
                if status.is_success() && is_safe && is_known && selection.contains(*sample) {
                    found.samples.push(*sample);
                    found.margins.push(margin);
                    found.commands.push(columns.iter().map(|column| column[row]).collect());
                    found.matrices.push(matrix);
                }
            }
        })?;
        Ok(found)
    }
}

/// Slopes of a vector by the scaled unknowns: by unknown and axis, over the rows; zero where there are none.
fn slopes(rows: &Table, of: [&str; 3], unknowns: &[Unknown], scene: &Scene, length: f64) -> Vec<[Vec<f64>; 3]> {
    let along = |unknown: &Unknown, axis: usize| {
        let mut sum = vec![0.0; rows.row_count()];
        for (parameter, rate) in unknown.parameters.iter().zip(unknown.rates(&unknown.values, length)) {
            let slopes = rows.numbers(&slope_name(of[axis], &parameter.name(scene))).unwrap_or_default();
            sum.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += rate * slope);
        }
        sum
    };
    unknowns.iter().map(|unknown| std::array::from_fn(|axis| along(unknown, axis))).collect()
}
