//! Rows of a result as columns: the sample, its parameters, its status, quantities, derivatives.

use super::spec::{BranchChoice, Format, OutputQuantity, SweepSpec};
use crate::backend::Precision;
use crate::model::{Batch, Plan, Quantity, Solutions, Status, Vector, base_curvature};

/// Values of one column; NaN stands for "none".
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    Index(Vec<u64>),
    Double(Vec<f64>),
    Single(Vec<f32>),
    Status(Vec<Status>),
    Flag(Vec<Option<bool>>),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub name: String,
    /// SI; empty for none.
    pub unit: String,
    pub values: Values,
}

/// Columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    pub columns: Vec<Column>,
}

impl Values {
    pub fn len(&self) -> usize {
        match self {
            Values::Index(values) => values.len(),
            Values::Double(values) => values.len(),
            Values::Single(values) => values.len(),
            Values::Status(values) => values.len(),
            Values::Flag(values) => values.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// As a number: NaN for none, 1 and 0 for flags, the code for a status.
    pub fn number(&self, row: usize) -> f64 {
        match self {
            Values::Index(values) => values[row] as f64,
            Values::Double(values) => values[row],
            Values::Single(values) => f64::from(values[row]),
            Values::Status(values) => f64::from(values[row].code()),
            Values::Flag(values) => values[row].map_or(f64::NAN, f64::from),
        }
    }

    fn push(&mut self, value: f64) {
        match self {
            Values::Index(values) => values.push(value as u64),
            Values::Double(values) => values.push(value),
            Values::Single(values) => values.push(value as f32),
            Values::Status(values) => values.push(Status::from_code(value as u8).unwrap_or_default()),
            Values::Flag(values) => values.push((!value.is_nan()).then_some(value != 0.0)),
        }
    }

    /// Same kind, no rows.
    fn empty(&self) -> Values {
        match self {
            Values::Index(_) => Values::Index(Vec::new()),
            Values::Double(_) => Values::Double(Vec::new()),
            Values::Single(_) => Values::Single(Vec::new()),
            Values::Status(_) => Values::Status(Vec::new()),
            Values::Flag(_) => Values::Flag(Vec::new()),
        }
    }

    pub(super) fn append_row(&mut self, from: &Values, row: usize) {
        match (self, from) {
            (Values::Index(to), Values::Index(from)) => to.push(from[row]),
            (to, from) => to.push(from.number(row)),
        }
    }

    fn append(&mut self, other: &Values) {
        match (self, other) {
            (Values::Index(to), Values::Index(from)) => to.extend(from),
            (Values::Double(to), Values::Double(from)) => to.extend(from),
            (Values::Single(to), Values::Single(from)) => to.extend(from),
            (Values::Status(to), Values::Status(from)) => to.extend(from),
            (Values::Flag(to), Values::Flag(from)) => to.extend(from),
            (to, from) => (0..from.len()).for_each(|row| to.push(from.number(row))),
        }
    }
}

impl Table {
    pub fn row_count(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// One column as numbers, NaN for none.
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let values = &self.column(name)?.values;
        Some((0..values.len()).map(|row| values.number(row)).collect())
    }

    pub fn samples(&self) -> &[u64] {
        match self.columns.iter().find_map(|column| match &column.values {
            Values::Index(values) if column.name == "sample" => Some(values),
            _ => None,
        }) {
            Some(values) => values,
            None => &[],
        }
    }

    /// Distinct samples; rows of one stand together.
    pub fn sample_count(&self) -> u64 {
        let samples = self.samples();
        samples.len().min(1) as u64 + samples.windows(2).filter(|pair| pair[0] != pair[1]).count() as u64
    }

    pub fn statuses(&self) -> &[Status] {
        match self.columns.iter().find_map(|column| match &column.values {
            Values::Status(values) => Some(values),
            _ => None,
        }) {
            Some(values) => values,
            None => &[],
        }
    }

    /// Three columns `name.x`, `name.y`, `name.z`.
    pub fn vector_columns(&self, name: &str) -> Option<[&Values; 3]> {
        let of = |axis: &str| self.column(&format!("{name}.{axis}")).map(|column| &column.values);
        Some([of("x")?, of("y")?, of("z")?])
    }

    /// The same columns without rows.
    pub fn empty(&self) -> Table {
        let empty = |column: &Column| Column {
            name: column.name.clone(),
            unit: column.unit.clone(),
            values: column.values.empty(),
        };
        Table { columns: self.columns.iter().map(empty).collect() }
    }

    /// Adds the rows of a table of the same columns.
    pub fn append(&mut self, other: &Table) {
        if self.columns.is_empty() {
            *self = other.clone();
            return;
        }
        for (to, from) in self.columns.iter_mut().zip(&other.columns) {
            to.values.append(&from.values);
        }
    }
}

/// Which columns a sweep writes and how they follow from solutions.
pub(super) struct Layout {
    empty: Table,
    quantities: Vec<OutputQuantity>,
    derivative_count: usize,
    has_branches: bool,
    /// Axis of each parameter column.
    parameter_axes: Vec<usize>,
}

/// One solution of a sample of a batch.
#[derive(Clone, Copy)]
pub(super) struct SolvedRow<'a> {
    pub plan: &'a Plan,
    pub batch: &'a Batch,
    /// Sample of the batch.
    pub sample: usize,
    pub solutions: &'a Solutions,
    pub row: usize,
    pub branch: BranchCells,
}

/// What a row says about its place among the equilibria of its sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BranchCells {
    pub number: usize,
    pub energy: Option<f64>,
    pub from_rest: bool,
    pub balanced: bool,
}

/// Only where every equilibrium is asked for: its number in its sample, and whether the list may be complete.
pub(super) const BRANCH_COLUMN: &str = "branch";
pub(super) const BALANCED_COLUMN: &str = "balanced";

const XYZ: [&str; 3] = ["x", "y", "z"];

impl Layout {
    pub fn new(spec: &SweepSpec, precision: Precision) -> Layout {
        let rows_are_written = spec.format != Format::None;
        let quantities = if rows_are_written { spec.quantities.clone() } else { vec![OutputQuantity::TipPosition] };
        let wrt = if rows_are_written { &spec.wrt[..] } else { &[] };
        let mut columns = Vec::new();
        let mut add = |name: String, unit: &str, values| columns.push(Column { name, unit: unit.into(), values });
        let number = || match precision {
            Precision::F32 => Values::Single(Vec::new()),
            Precision::F64 => Values::Double(Vec::new()),
        };
        add("sample".into(), "", Values::Index(Vec::new()));
        let mut parameter_axes = Vec::new();
        for (axis, parameters) in spec.axes.iter().enumerate() {
            for parameter in &parameters.parameters {
                add(parameter.name(&spec.scene), parameter.unit(), Values::Double(Vec::new()));
                parameter_axes.push(axis);
            }
        }
        add("status".into(), "", Values::Status(Vec::new()));
        let has_branches = spec.branch == BranchChoice::All;
        if has_branches {
            add(BRANCH_COLUMN.into(), "", Values::Index(Vec::new()));
            // Equilibria differ by less than single precision may show.
            add("energy".into(), "J", Values::Double(Vec::new()));
            add("from_rest".into(), "", Values::Flag(Vec::new()));
            add(BALANCED_COLUMN.into(), "", Values::Flag(Vec::new()));
        }
        for quantity in &quantities {
            let mut vector = |name: &str, unit| {
                for axis in XYZ {
                    add(format!("{name}.{axis}"), unit, number());
                }
            };
            match quantity {
                OutputQuantity::TipPosition => vector("tip.position", "m"),
                OutputQuantity::TipRotation => vector("tip.rotation", "rad"),
                OutputQuantity::BaseCurvature => vector("base_curvature", "1/m"),
                OutputQuantity::BaseMoment => vector("base_moment", "N·m"),
                OutputQuantity::Stability => {
                    add("stability.margin".into(), "", number());
                    add("stable".into(), "", Values::Flag(Vec::new()));
                }
                OutputQuantity::ErrorEstimate => add("error_estimate".into(), "", number()),
                OutputQuantity::Residual => add("residual".into(), "", number()),
                OutputQuantity::Iterations => add("iterations".into(), "", number()),
                OutputQuantity::LoadFraction => add("load_fraction".into(), "", number()),
            }
        }
        for parameter in wrt {
            let (name, unit) = (parameter.name(&spec.scene), parameter.unit());
            for (what, of) in [("tip.position", "m"), ("tip.rotation", "rad")] {
                for axis in XYZ {
                    add(format!("d({what}.{axis})/d({name})"), &quotient(of, unit), number());
                }
            }
        }
        Layout { empty: Table { columns }, quantities, derivative_count: wrt.len(), has_branches, parameter_axes }
    }

    /// The columns without rows.
    pub fn empty(&self) -> &Table {
        &self.empty
    }

    /// Name, unit and kind of every column, as text.
    pub fn schema(&self) -> String {
        let kind = |values: &Values| match values {
            Values::Index(_) => "u64",
            Values::Double(_) => "f64",
            Values::Single(_) => "f32",
            Values::Status(_) => "string",
            Values::Flag(_) => "bool",
        };
        let columns = self.empty.columns.iter();
        columns.map(|column| format!("{} [{}] {}\n", column.name, column.unit, kind(&column.values))).collect()
    }

    /// Adds a row of one sample: `values` of its axes, and a solution.
    pub fn push(&self, table: &mut Table, index: u64, values: &[f64], solved: &SolvedRow) {
        let SolvedRow { plan, batch, sample, solutions, row: at, branch } = *solved;
        let status = solutions.status(at);
        let mut columns = table.columns.iter_mut().map(|column| &mut column.values);
        if let Some(Values::Index(samples)) = columns.next() {
            samples.push(index);
        }
        let mut put = |value: f64| {
            if let Some(column) = columns.next() {
                column.push(value);
            }
        };
        for axis in &self.parameter_axes {
            put(values[*axis]);
        }
        put(f64::from(status.code()));
        if self.has_branches {
            put(branch.number as f64);
            put(branch.energy.unwrap_or(f64::NAN));
            put(f64::from(branch.from_rest));
            put(f64::from(branch.balanced));
        }
        // A row that is no equilibrium carries no numbers; a number that is not finite is none.
        let is_known = solutions.is_equilibrium(at);
        let known = |value: f64| if is_known && value.is_finite() { value } else { f64::NAN };
        let scalar = |quantity| known(solutions.get(at, quantity));
        for quantity in &self.quantities {
            match quantity {
                OutputQuantity::TipPosition => {
                    solutions.vector(at, Quantity::TipPosition).into_iter().for_each(|x| put(known(x)));
                }
                OutputQuantity::TipRotation => {
                    rotation_vector(&solutions.tip_rotation(at)).into_iter().for_each(|x| put(known(x)));
                }
                OutputQuantity::BaseCurvature => {
                    let rod = plan.sample_rod(batch, sample);
                    let u = base_curvature(&rod, solutions.vector(at, Quantity::BaseMoment));
                    u.into_iter().for_each(|x| put(known(x)));
                }
                OutputQuantity::BaseMoment => {
                    solutions.vector(at, Quantity::BaseMoment).into_iter().for_each(|x| put(known(x)));
                }
                OutputQuantity::Stability => {
                    put(scalar(Quantity::StabilityMargin));
                    let index = scalar(Quantity::StabilityIndex);
                    put(if index.is_nan() { f64::NAN } else { f64::from(u8::from(index == 0.0)) });
                }
                OutputQuantity::ErrorEstimate => put(scalar(Quantity::ErrorEstimate)),
                OutputQuantity::Residual => put(scalar(Quantity::Residual)),
                OutputQuantity::Iterations => put(scalar(Quantity::Iterations)),
                OutputQuantity::LoadFraction => put(scalar(Quantity::LoadFraction)),
            }
        }
        for derivative in 0..self.derivative_count {
            for row in 0..6 {
                put(known(solutions.derivative(at, derivative, row)));
            }
        }
    }
}

/// Unit of a derivative: `m/A`, `m/(kg/m)`.
fn quotient(of: &str, by: &str) -> String {
    match by {
        "" => of.into(),
        _ if by.contains(['/', '·']) => format!("{of}/({by})"),
        _ => format!("{of}/{by}"),
    }
}

/// Rotation vector of a rotation matrix, angle up to pi, by way of the quaternion (no loss near 0 or pi).
pub fn rotation_vector(r: &[[f64; 3]; 3]) -> Vector {
    let trace = r[0][0] + r[1][1] + r[2][2];
    // Four times w² and the squares of x, y, z: divide by the largest.
    let squares = [1.0 + 2.0 * r[0][0] - trace, 1.0 + 2.0 * r[1][1] - trace, 1.0 + 2.0 * r[2][2] - trace];
    let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let largest = (0..3).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    let (mut w, mut v);
    if 1.0 + trace >= squares[largest] {
        (w, v) = (1.0 + trace, skew);
    } else {
        w = skew[largest];
        v = std::array::from_fn(|k| if k == largest { squares[k] } else { r[k][largest] + r[largest][k] });
    }
    if w < 0.0 {
        w = -w;
        v = v.map(|x: f64| -x);
    }
    let sine = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    // Below the bound atan2(s, w)/s is 1/w to the last bit.
    let scale = if sine < 1e-9 * w { 2.0 / w } else { 2.0 * sine.atan2(w) / sine };
    v.map(|x| x * scale)
}

/// Angle of the rotation between two orthonormal frames [rad].
pub fn rotation_angle(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> f64 {
    let relative: [[f64; 3]; 3] =
        std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| a[k][r] * b[k][c]).sum()));
    let v = rotation_vector(&relative);
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}
