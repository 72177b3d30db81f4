//! The outputs of a study: columns of the rows, vectors of them, the distance from the nominal tip.

use super::SensitivityError;
use super::inputs::{Input, slope_name};
use super::shapes::{SHAPE, is_shape, place};
use crate::model::{Vector, closest};
use crate::table::{Column, Table, Values};

/// The distance of the tip from where it is nominally.
pub(super) const DISTANCE: &str = "tip.distance";
/// The indicator of a failed row.
pub(super) const FAILED: &str = "failed";
/// The column of the margin.
pub(super) const MARGIN: &str = "stability.margin";
const POSITION: &str = "tip.position";
const ROTATION: &str = "tip.rotation";
/// Position and rotation together, the rotation times a length.
pub(super) const POSE: &str = "tip.pose";
const AXES: [&str; 3] = ["x", "y", "z"];

/// One number a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scalar {
    pub name: String,
    pub unit: String,
    pub kind: Kind,
    /// Whether its slopes by every input are known.
    pub has_slopes: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Column,
    Distance,
    /// A component of the rotation vector times a length (m).
    Turn(usize, f64),
    /// 1 where the row failed, else 0.
    Failed,
    /// 1 where the margin is below a limit, else 0; no value where the row failed.
    MarginBelow(f64),
}

/// What indices are given of: one scalar, or the components of a vector.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Output {
    pub name: String,
    pub unit: String,
    /// Among the scalars.
    pub components: Vec<usize>,
    /// Whether it tells which rows fail, or come near it.
    pub is_indicator: bool,
}

/// Scalars to be read and outputs to be told of.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Outputs {
    pub scalars: Vec<Scalar>,
    pub outputs: Vec<Output>,
}

impl Outputs {
    /// What is asked for by name, or what is usual; then the indicators.
    pub fn new(
        names: &[String],
        columns: &[Column],
        inputs: &[Input],
        margin_limit: f64,
        length: f64,
    ) -> Result<Outputs, SensitivityError> {
        let mut found = Outputs::default();
        let has = |name: &str| columns.iter().any(|column| column.name == name);
        let usual: Vec<String> = [POSITION, DISTANCE, MARGIN].map(str::to_owned).to_vec();
        let is_there = |name: &&String| has(name) || has(&format!("{POSITION}.x")) && name.as_str() != MARGIN;
        let names: Vec<&String> = match names.is_empty() {
            true => usual.iter().filter(is_there).collect(),
            false => names.iter().collect(),
        };
        for name in names {
            found.add(name, columns, inputs, length)?;
        }
        found.indicator(FAILED.into(), Kind::Failed);
        if has(MARGIN) {
            found.indicator(format!("{MARGIN} < {margin_limit}"), Kind::MarginBelow(margin_limit));
        }
        Ok(found)
    }

    fn add(&mut self, name: &str, columns: &[Column], inputs: &[Input], length: f64) -> Result<(), SensitivityError> {
        let find = |name: &str| columns.iter().find(|column| column.name == name && is_output(column, inputs));
        if let Some(column) = find(name) {
            self.column(column, columns, inputs);
            return Ok(());
        }
        if is_shape(name) {
            let points = columns.iter().filter(|column| place(&column.name).is_some());
            let components: Vec<usize> =
                points.map(|column| self.scalar(Scalar::of(column, columns, inputs))).collect();
            self.output(SHAPE, "m", components);
            return Ok(());
        }
        let parts: Vec<&Column> = AXES.iter().filter_map(|axis| find(&format!("{name}.{axis}"))).collect();
        if parts.len() == 3 {
            let components: Vec<usize> = parts.iter().map(|column| self.column(column, columns, inputs)).collect();
            self.output(name, &parts[0].unit, components);
            return Ok(());
        }
        let position = find(&format!("{POSITION}.x"));
        if let Some(column) = position.filter(|_| name == DISTANCE) {
            let has_slopes = AXES.iter().all(|axis| has_slopes(&format!("{POSITION}.{axis}"), columns, inputs));
            let scalar = Scalar { name: name.into(), unit: column.unit.clone(), kind: Kind::Distance, has_slopes };
            let at = self.scalar(scalar);
            self.output(name, &column.unit, vec![at]);
            return Ok(());
        }
        let vector =
            |of: &str| -> Vec<&Column> { AXES.iter().filter_map(|axis| find(&format!("{of}.{axis}"))).collect() };
        let (positions, rotations) = (vector(POSITION), vector(ROTATION));
        if name == POSE && positions.len() + rotations.len() == 6 {
            let mut components: Vec<usize> =
                positions.iter().map(|column| self.column(column, columns, inputs)).collect();
            for (axis, letter) in AXES.iter().enumerate() {
                let (name, kind) = (format!("{length} m · {ROTATION}.{letter}"), Kind::Turn(axis, length));
                components.push(self.scalar(Scalar { name, unit: "m".into(), kind, has_slopes: false }));
            }
            self.output(name, "m", components);
            return Ok(());
        }
        let mut known: Vec<String> =
            columns.iter().filter(|column| is_output(column, inputs)).map(|column| column.name.clone()).collect();
        let vectors: Vec<String> = known.iter().filter_map(|name| name.strip_suffix(".x").map(str::to_owned)).collect();
        known.extend(vectors);
        known.extend(position.map(|_| DISTANCE.to_owned()));
        known.extend((rotations.len() == 3).then(|| POSE.to_owned()));
        let suggestion = closest(name, known.iter().map(String::as_str));
        Err(SensitivityError::UnknownOutput { name: name.into(), suggestion, known })
    }

    fn column(&mut self, column: &Column, columns: &[Column], inputs: &[Input]) -> usize {
        let at = self.scalar(Scalar::of(column, columns, inputs));
        self.output(&column.name, &column.unit, vec![at]);
        at
    }

    fn scalar(&mut self, scalar: Scalar) -> usize {
        let known = self.scalars.iter().position(|other| other.name == scalar.name);
        known.unwrap_or_else(|| {
            self.scalars.push(scalar);
            self.scalars.len() - 1
        })
    }

    fn output(&mut self, name: &str, unit: &str, components: Vec<usize>) {
        if self.outputs.iter().all(|output| output.name != name) {
            self.outputs.push(Output { name: name.into(), unit: unit.into(), components, is_indicator: false });
        }
    }

    fn indicator(&mut self, name: String, kind: Kind) {
        self.scalars.push(Scalar { name: name.clone(), unit: String::new(), kind, has_slopes: false });
        let components = vec![self.scalars.len() - 1];
        self.outputs.push(Output { name, unit: String::new(), components, is_indicator: true });
    }

    /// Columns of the rows that are needed beside inputs and slopes.
    pub fn columns(&self) -> Vec<String> {
        let mut names: Vec<String> = vec!["sample".into(), "status".into()];
        for scalar in &self.scalars {
            match scalar.kind {
                Kind::Column => names.push(scalar.name.clone()),
                Kind::Distance => names.extend(AXES.iter().map(|axis| format!("{POSITION}.{axis}"))),
                Kind::Turn(axis, _) => names.push(format!("{ROTATION}.{}", AXES[axis])),
                Kind::MarginBelow(_) => names.push(MARGIN.into()),
                Kind::Failed => {}
            }
        }
        names
    }

    /// Columns of slopes by these inputs.
    pub fn slope_columns(&self, inputs: &[Input]) -> Vec<String> {
        let mut names = Vec::new();
        for scalar in self.scalars.iter().filter(|scalar| scalar.has_slopes) {
            let of: Vec<String> = match scalar.kind {
                Kind::Distance => AXES.iter().map(|axis| format!("{POSITION}.{axis}")).collect(),
                _ => vec![scalar.name.clone()],
            };
            for input in inputs {
                names.extend(of.iter().flat_map(|of| input.parameters.iter().map(|p| slope_name(of, p))));
            }
        }
        names
    }
}

impl Scalar {
    fn of(column: &Column, columns: &[Column], inputs: &[Input]) -> Scalar {
        let (name, unit) = (column.name.clone(), column.unit.clone());
        Scalar { name, unit, kind: Kind::Column, has_slopes: has_slopes(&column.name, columns, inputs) }
    }

    /// Its values in rows, whether usable or not; `nominal` is the nominal tip (m).
    pub fn values(&self, rows: &Table, is_usable: &[bool], nominal: Option<Vector>) -> Vec<f64> {
        let flag = |is_true: bool| if is_true { 1.0 } else { 0.0 };
        let mut values: Vec<f64> = match self.kind {
            Kind::Column => rows.numbers(&self.name).unwrap_or_default(),
            Kind::Distance => {
                let off = offsets(rows, nominal);
                off.into_iter().map(|[x, y, z]| (x * x + y * y + z * z).sqrt()).collect()
            }
            Kind::Turn(axis, length) => {
                let turns = rows.numbers(&format!("{ROTATION}.{}", AXES[axis])).unwrap_or_default();
                turns.into_iter().map(|turn| length * turn).collect()
            }
            Kind::Failed => return is_usable.iter().map(|usable| flag(!usable)).collect(),
            Kind::MarginBelow(limit) => {
                let margins = rows.numbers(MARGIN).unwrap_or_default();
                margins.into_iter().map(|margin| if margin.is_nan() { margin } else { flag(margin < limit) }).collect()
            }
        };
        values.iter_mut().zip(is_usable).filter(|(_, usable)| !**usable).for_each(|(value, _)| *value = f64::NAN);
        values
    }

    /// Its slopes by an input; `None` where they are not known.
    pub fn slopes(&self, rows: &Table, input: &Input, nominal: Option<Vector>) -> Option<Vec<f64>> {
        match self.kind {
            Kind::Column => input.slopes(rows, &self.name),
            Kind::Distance => {
                let mut parts = Vec::new();
                for axis in AXES {
                    parts.push(input.slopes(rows, &format!("{POSITION}.{axis}"))?);
                }
                let along = |(row, off): (usize, Vector)| {
                    let distance = off.iter().map(|x| x * x).sum::<f64>().sqrt();
                    let product: f64 = (0..3).map(|a| off[a] * parts[a][row]).sum();
                    if distance > 0.0 { product / distance } else { 0.0 }
                };
                Some(offsets(rows, nominal).into_iter().enumerate().map(along).collect())
            }
            Kind::Turn(..) | Kind::Failed | Kind::MarginBelow(_) => None,
        }
    }
}

/// Tips less the nominal tip (m); NaN where there is none.
fn offsets(rows: &Table, nominal: Option<Vector>) -> Vec<Vector> {
    let Some(columns) = rows.vector_columns(POSITION) else { return vec![[f64::NAN; 3]; rows.row_count()] };
    let nominal = nominal.unwrap_or([f64::NAN; 3]);
    (0..rows.row_count()).map(|row| std::array::from_fn(|a| columns[a].number(row) - nominal[a])).collect()
}

/// Numbers that are neither inputs nor slopes nor bookkeeping.
fn is_output(column: &Column, inputs: &[Input]) -> bool {
    let is_input = inputs.iter().any(|input| input.parameters.contains(&column.name));
    let is_number = matches!(column.values, Values::Double(_) | Values::Single(_) | Values::Flag(_));
    is_number && !is_input && !column.name.starts_with("d(")
}

/// Whether the rows have the slopes of a column by every input. Those of rotations are of the turning frame, not of the
/// rotation vector.
fn has_slopes(name: &str, columns: &[Column], inputs: &[Input]) -> bool {
    let mut parameters = inputs.iter().flat_map(|input| &input.parameters);
    !inputs.is_empty()
        && !name.starts_with(ROTATION)
        && parameters.all(|parameter| {
            let slope = slope_name(name, parameter);
            columns.iter().any(|column| column.name == slope)
        })
}
