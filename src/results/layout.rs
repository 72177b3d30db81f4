//! Rows of a result: the sample, its parameters, its status, quantities, derivatives. Column by column out of solutions.

use super::contact::{Contact, ContactFlag, ContactNumber};
use super::evidence::{StabilityEvidence, may_have_no_energy};
use crate::backend::Precision;
use crate::clock::Busy;
use crate::model::{Batch, Parameter, Plan, Quantity, Solutions, Status, Vector, rotation_vector};
use crate::spec::Sampler;
use crate::spec::{BranchChoice, Format, OutputQuantity, SweepSpec};
use crate::table::{Column, Table, Values};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// Which columns a sweep writes and how they follow from solutions.
pub(crate) struct Layout {
    empty: Table,
    /// Of each column.
    sources: Vec<Source>,
}

/// Where a column's numbers come from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Source {
    Sample,
    /// Of the values of a sample.
    Axis(usize),
    Status,
    BranchNumber,
    Energy,
    FromRest,
    Balanced,
    /// A column of the solutions.
    Solution(usize),
    /// Whether the stability index is zero.
    Stable,
    /// The word for what that rests on.
    Evidence,
    /// Components of vectors that are no column of the solutions.
    TipRotation(usize),
    BaseCurvature(usize),
    /// Of a derivative: its number and row.
    Derivative(usize, usize),
    /// The load of a fold, its error, how it follows the parameter of this number, and the error of that.
    FoldLoad,
    FoldLoadError,
    FoldSlope(usize),
    FoldSlopeError(usize),
    /// Of the contact with the wall.
    Contact(ContactNumber),
    ContactFlag(ContactFlag),
    /// How the wall's force follows the parameter of this number: 0 is its normal component, 1 to 3 those along x, y, z.
    ForceSlope(usize, usize),
}

/// Rows to be written: consecutive ones of some solutions.
pub(crate) struct Rows<'a> {
    pub plan: &'a Plan,
    pub batch: &'a Batch,
    pub solutions: &'a Solutions,
    /// Of the solutions.
    pub range: Range<usize>,
    /// What is known of each row of the solutions, where samples may have several; else a row is its sample's.
    pub branches: Option<&'a [BranchCells]>,
}

/// What a row says about its place among the equilibria of its sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BranchCells {
    /// Of the batch.
    pub sample: usize,
    pub number: usize,
    pub energy: Option<f64>,
    pub from_rest: bool,
    pub balanced: bool,
}

/// Only where every equilibrium is asked for: its number in its sample, and whether the list may be complete.
pub(crate) const BRANCH_COLUMN: &str = "branch";
pub(crate) const BALANCED_COLUMN: &str = "balanced";

const VECTOR: [&str; 3] = [".x", ".y", ".z"];
const SCALAR: [&str; 1] = [""];
/// Rows of a derivative of the wall's force.
const FORCES: [&str; 4] = ["normal_force", "force.x", "force.y", "force.z"];
/// Rod lengths from which on a position is written in double precision: single then rounds by 1e-6 of the length.
const FAR: f64 = 8.0;
/// Rows that one thread works out at a time, where they take more than copying.
const GROUP: usize = 1024;

impl Rows<'_> {
    /// Sample of the batch of a row of the solutions.
    fn sample(&self, row: usize) -> usize {
        self.branches.map_or(row, |branches| branches[row].sample)
    }
}

impl SweepSpec {
    /// Names of the columns that are no derivatives.
    pub fn column_names(&self) -> Vec<String> {
        let layout = Layout::new(self, Precision::F64);
        plain_columns(layout.empty()).into_iter().map(str::to_owned).collect()
    }
}

impl Layout {
    pub fn new(spec: &SweepSpec, precision: Precision) -> Layout {
        let rows_are_written = spec.format != Format::None;
        let quantities = if rows_are_written { &spec.quantities[..] } else { &[OutputQuantity::TipPosition] };
        let wrt = if rows_are_written { &spec.wrt[..] } else { &[] };
        let mut columns = Vec::new();
        let mut sources = Vec::new();
        let mut add = |name: String, unit: &str, values, source| {
            columns.push(Column { name, unit: unit.into(), values });
            sources.push(source);
        };
        let number = || match precision {
            Precision::F32 => Values::Single(Vec::new()),
            Precision::F64 => Values::Double(Vec::new()),
        };
        add("sample".into(), "", Values::Index(Vec::new()), Source::Sample);
        for (axis, parameters) in spec.axis_parameters().iter().enumerate() {
            for parameter in parameters {
                let name = parameter.name(&spec.scene);
                add(name, parameter.unit(), Values::Double(Vec::new()), Source::Axis(axis));
            }
        }
        add("status".into(), "", Values::Status(Vec::new()), Source::Status);
        if spec.branch == BranchChoice::All {
            add(BRANCH_COLUMN.into(), "", Values::Index(Vec::new()), Source::BranchNumber);
            // Equilibria differ by less than single precision may show.
            add("energy".into(), "J", Values::Double(Vec::new()), Source::Energy);
            add("from_rest".into(), "", Values::Flag(Vec::new()), Source::FromRest);
            add(BALANCED_COLUMN.into(), "", Values::Flag(Vec::new()), Source::Balanced);
        }
        for quantity in quantities {
            let is_exact = precision != Precision::F32 || *quantity == OutputQuantity::TipPosition && is_base_far(spec);
            let number = || if is_exact { Values::Double(Vec::new()) } else { Values::Single(Vec::new()) };
            let mut group = |name: &str, unit, axes: &[&str], source: &dyn Fn(usize) -> Source| {
                for (axis, suffix) in axes.iter().enumerate() {
                    add(format!("{name}{suffix}"), unit, number(), source(axis));
                }
            };
            let of = |quantity: Quantity| move |axis| Source::Solution(quantity.column() + axis);
            match quantity {
                OutputQuantity::TipPosition => group("tip.position", "m", &VECTOR, &of(Quantity::TipPosition)),
                OutputQuantity::TipRotation => group("tip.rotation", "rad", &VECTOR, &Source::TipRotation),
                OutputQuantity::BaseCurvature => group("base_curvature", "1/m", &VECTOR, &Source::BaseCurvature),
                OutputQuantity::BaseMoment => group("base_moment", "N·m", &VECTOR, &of(Quantity::BaseMoment)),
                OutputQuantity::Stability => {
                    group("stability.margin", "", &SCALAR, &of(Quantity::StabilityMargin));
                    add("stable".into(), "", Values::Flag(Vec::new()), Source::Stable);
                    if may_have_no_energy(spec) {
                        add("stability.evidence".into(), "", Values::Text(Vec::new()), Source::Evidence);
                    }
                }
                OutputQuantity::ErrorEstimate => group("error_estimate", "", &SCALAR, &of(Quantity::ErrorEstimate)),
                OutputQuantity::Residual => group("residual", "", &SCALAR, &of(Quantity::Residual)),
                OutputQuantity::Iterations => group("iterations", "", &SCALAR, &of(Quantity::Iterations)),
                OutputQuantity::LoadFraction => group("load_fraction", "", &SCALAR, &of(Quantity::LoadFraction)),
                OutputQuantity::FoldLoad => {
                    add("fold.load".into(), "", Values::Double(Vec::new()), Source::FoldLoad);
                    add("fold.load_error".into(), "", Values::Double(Vec::new()), Source::FoldLoadError);
                    for (derivative, parameter) in wrt.iter().enumerate() {
                        let name = format!("d(fold.load)/d({})", parameter.name(&spec.scene));
                        let unit = quotient("1", parameter.unit());
                        let error = format!("error({name})");
                        add(name, &unit, Values::Double(Vec::new()), Source::FoldSlope(derivative));
                        add(error, &unit, Values::Double(Vec::new()), Source::FoldSlopeError(derivative));
                    }
                }
                OutputQuantity::Contact if spec.scene.wall.is_none() => {}
                OutputQuantity::Contact => {
                    let flag = |flag| (Values::Flag(Vec::new()), Source::ContactFlag(flag));
                    let of = |of| move |_| Source::Contact(of);
                    let (values, source) = flag(ContactFlag::Touching);
                    add("contact.touching".into(), "", values, source);
                    let mut group = |name: &str, unit, axes: &[&str], source: &dyn Fn(usize) -> Source| {
                        for (axis, suffix) in axes.iter().enumerate() {
                            add(format!("contact.{name}{suffix}"), unit, number(), source(axis));
                        }
                    };
                    group("gap", "m", &SCALAR, &of(ContactNumber::Gap));
                    group("normal_force", "N", &SCALAR, &of(ContactNumber::NormalForce));
                    group("force", "N", &VECTOR, &|axis| Source::Contact(ContactNumber::Force(axis)));
                    group("friction_ratio", "", &SCALAR, &of(ContactNumber::FrictionRatio));
                    let (values, source) = flag(ContactFlag::Holds);
                    add("contact.holds".into(), "", values, source);
                    let mut group = |name: &str, unit, number_of| {
                        add(format!("contact.{name}"), unit, number(), Source::Contact(number_of));
                    };
                    group("angle", "rad", ContactNumber::Angle);
                    group("body_gap", "m", ContactNumber::BodyGap);
                    group("force_error", "N", ContactNumber::ForceError);
                }
                // The last column.
                OutputQuantity::DerivativeError => {}
            }
        }
        for (derivative, parameter) in wrt.iter().enumerate() {
            let (name, unit) = (parameter.name(&spec.scene), parameter.unit());
            for (first, what, of) in [(0, "tip.position", "m"), (3, "tip.rotation", "rad")] {
                for (axis, suffix) in VECTOR.iter().enumerate() {
                    let source = Source::Derivative(derivative, first + axis);
                    let values = if spec.single_derivatives { Values::Single(Vec::new()) } else { number() };
                    add(format!("d({what}{suffix})/d({name})"), &quotient(of, unit), values, source);
                }
            }
            let tells_force = quantities.contains(&OutputQuantity::Contact) && spec.scene.wall.is_some();
            for (row, what) in FORCES.iter().enumerate().filter(|_| tells_force) {
                let values = if spec.single_derivatives { Values::Single(Vec::new()) } else { number() };
                let source = Source::ForceSlope(derivative, row);
                add(format!("d(contact.{what})/d({name})"), &quotient("N", unit), values, source);
            }
        }
        if quantities.contains(&OutputQuantity::DerivativeError) {
            add("derivative_error".into(), "", number(), Source::Solution(Quantity::DerivativeError.column()));
        }
        Layout { empty: Table { columns }, sources }
    }

    /// Columns of the solutions that are written in single precision.
    pub fn single_columns(&self) -> Vec<usize> {
        let pairs = self.empty.columns.iter().zip(&self.sources);
        let single = |(column, source): (&Column, &Source)| match (&column.values, source) {
            (Values::Single(_), Source::Solution(from)) => Some(*from),
            _ => None,
        };
        pairs.filter_map(single).collect()
    }

    /// Whether tip positions are written in single precision; `None`: they are not written.
    pub fn tip_is_single(&self) -> Option<bool> {
        let [x, ..] = self.empty.vector_columns("tip.position")?;
        Some(matches!(x, Values::Single(_)))
    }

    /// The columns without rows.
    pub fn empty(&self) -> &Table {
        &self.empty
    }

    /// Name, unit and kind of every column, as text.
    pub fn schema(&self) -> String {
        let columns = self.empty.columns.iter();
        columns.map(|column| format!("{} [{}] {}\n", column.name, column.unit, column.values.kind())).collect()
    }

    /// Adds rows to a table of these columns; `index` tells the sweep's sample of a sample of the batch.
    pub fn append(&self, table: &mut Table, rows: &Rows, sampler: &Sampler, index: &(dyn Fn(usize) -> u64 + Sync)) {
        let Rows { solutions, ref range, .. } = *rows;
        // A row that is no equilibrium carries no numbers; a number that is not finite is none.
        let known: Vec<bool> = range.clone().map(|row| solutions.is_equilibrium(row)).collect();
        let indices: Vec<u64> = range.clone().map(|row| index(rows.sample(row))).collect();
        let value_count = sampler.value_count();
        let busy = Busy::here();
        let mut axes = vec![0.0; indices.len() * value_count];
        let rows_of_axes = axes.par_chunks_exact_mut(value_count.max(1)).with_min_len(GROUP);
        rows_of_axes.zip(&indices).for_each_init(|| busy.enter(), |_, (values, index)| sampler.values(*index, values));
        let rotations = self.vectors(Source::TipRotation(0), range.len(), || {
            |at| rotation_vector(&solutions.tip_rotation(range.start + at))
        });
        let curvatures = self.vectors(Source::BaseCurvature(0), range.len(), || {
            let mut rod = rows.plan.scene.rod();
            move |at| {
                let row = range.start + at;
                let moment = solutions.vector(row, Quantity::BaseMoment);
                let of_moment = || rows.plan.base_curvature(rows.batch, rows.sample(row), moment, &mut rod);
                solutions.own_curvature(row).unwrap_or_else(of_moment)
            }
        });
        let cells = |row: usize| rows.branches.map(|branches| branches[row]);
        let vectors = |to: &mut Values, from: &[Vector], axis: usize| {
            extend(to, from.iter().zip(&known).map(|(v, is_known)| number(v[axis], *is_known)));
        };
        // A path that ends at a fold tells its load.
        let loads: Vec<bool> = match self.sources.contains(&Source::Solution(Quantity::LoadFraction.column())) {
            true => {
                range.clone().zip(&known).map(|(row, known)| *known || solutions.status(row) == Status::Fold).collect()
            }
            false => Vec::new(),
        };
        let solution = |to: &mut Values, column: usize| {
            let mut known = if column == Quantity::LoadFraction.column() { &loads[..] } else { &known[..] };
            for run in solutions.values.runs(column, range.clone()) {
                let (these, rest) = known.split_at(run.len());
                extend(to, run.iter().zip(these).map(|(x, is_known)| number(*x, *is_known)));
                known = rest;
            }
        };
        let has_contact =
            self.sources.iter().any(|source| matches!(source, Source::Contact(_) | Source::ContactFlag(_)));
        let contacts: Vec<Option<Contact>> = match has_contact {
            true => range.clone().map(|row| Contact::of(rows.plan, solutions, row)).collect(),
            false => Vec::new(),
        };
        let of_folds = |to: &mut Values, column: Option<usize>| {
            let value = |row| column.map_or(f64::NAN, |column| solutions.values.get(row, column));
            extend(to, range.clone().map(|row| number(value(row), solutions.status(row) == Status::Fold)));
        };
        table.columns.par_iter_mut().zip(&self.sources).for_each(|(column, source)| {
            let _busy = busy.enter();
            match (*source, &mut column.values) {
                (Source::Sample, Values::Index(to)) => to.extend(&indices),
                (Source::Axis(axis), to) => extend(to, axes.chunks_exact(value_count).map(|values| values[axis])),
                (Source::Status, Values::Status(to)) => to.extend(range.clone().map(|row| solutions.status(row))),
                (Source::BranchNumber, Values::Index(to)) => {
                    to.extend(range.clone().map(|row| cells(row).map_or(0, |cells| cells.number as u64)));
                }
                (Source::Energy, to) => {
                    let energy = |row| cells(row).and_then(|cells| cells.energy).unwrap_or(f64::NAN);
                    extend(to, range.clone().map(energy));
                }
                (Source::FromRest, Values::Flag(to)) => {
                    to.extend(range.clone().map(|row| cells(row).map(|cells| cells.from_rest)));
                }
                (Source::Balanced, Values::Flag(to)) => {
                    to.extend(range.clone().map(|row| cells(row).map(|cells| cells.balanced)));
                }
                (Source::Solution(from), to @ Values::Single(_)) if is_estimate(from) => {
                    let known = known.iter().zip(range.clone());
                    extend(to, known.map(|(is_known, row)| number(rounded_estimate(rows, row, from), *is_known)));
                }
                (Source::Solution(from), to) => solution(to, from),
                (Source::FoldLoad, to) => of_folds(to, Some(Quantity::LoadFraction.column())),
                (Source::FoldLoadError, to) => {
                    let error = |row: usize| solutions.get(row, Quantity::LoadFractionError);
                    extend(to, range.clone().map(|row| number(error(row), solutions.is_seen_fold(row))));
                }
                (Source::FoldSlope(derivative), to) => of_folds(to, solutions.fold_derivative_column(derivative)),
                (Source::FoldSlopeError(derivative), to) => {
                    of_folds(to, solutions.fold_derivative_column(derivative).map(|column| column + 1));
                }
                (Source::Derivative(derivative, row), to) => {
                    solution(to, solutions.derivative_column(derivative, row));
                }
                (Source::Contact(of), to) => {
                    let numbers = contacts.iter().map(|contact| contact.map_or(f64::NAN, |contact| contact.number(of)));
                    extend(to, numbers.map(|x| number(x, true)));
                }
                (Source::ContactFlag(of), Values::Flag(to)) => {
                    to.extend(contacts.iter().map(|contact| contact.and_then(|contact| contact.flag(of))));
                }
                (Source::ForceSlope(derivative, row), to) => match solutions.force_derivative_column(derivative) {
                    Some(first) => solution(to, first + row),
                    None => extend(to, known.iter().map(|_| f64::NAN)),
                },
                (Source::Stable, Values::Flag(to)) => {
                    let index = range.clone().map(|row| solutions.get(row, Quantity::StabilityIndex));
                    let stable =
                        |(index, is_known): (f64, &bool)| (*is_known && index.is_finite()).then_some(index == 0.0);
                    to.extend(index.zip(&known).map(stable));
                }
                (Source::Evidence, Values::Text(to)) => {
                    let of = |row: usize| {
                        let from_rest = cells(row).is_none_or(|cells| cells.from_rest);
                        StabilityEvidence::of(rows.plan, (rows.batch, rows.sample(row)), (solutions, row), from_rest)
                    };
                    to.extend(range.clone().map(|row| of(row).map_or("", StabilityEvidence::name).to_owned()));
                }
                (Source::TipRotation(axis), to) => vectors(to, &rotations, axis),
                (Source::BaseCurvature(axis), to) => vectors(to, &curvatures, axis),
                // Of the kinds that `new` has chosen, these are all.
                (_, _) => {}
            }
        });
    }

    /// A vector for each row, in parallel; none where no column needs them.
    fn vectors<F: FnMut(usize) -> Vector>(
        &self,
        needed_by: Source,
        count: usize,
        work: impl Fn() -> F + Sync + Send,
    ) -> Vec<Vector> {
        if !self.sources.contains(&needed_by) {
            return Vec::new();
        }
        let (mut vectors, busy) = (vec![[0.0; 3]; count], Busy::here());
        vectors.par_chunks_mut(GROUP).enumerate().for_each(|(group, vectors)| {
            let _busy = busy.enter();
            let mut vector = work();
            vectors.iter_mut().enumerate().for_each(|(at, to)| *to = vector(group * GROUP + at));
        });
        vectors
    }
}

/// Whether the base may lie so far from the origin that single precision, beside it, shows too little of the rod.
fn is_base_far(spec: &SweepSpec) -> bool {
    let far = FAR * spec.scene.total_length();
    let moves = |parameter: &Parameter| matches!(parameter, Parameter::BasePosition(_));
    spec.scene.base.position.iter().any(|x| x.abs() > far) || spec.axis_parameters().iter().flatten().any(moves)
}

fn is_estimate(column: usize) -> bool {
    [Quantity::ErrorEstimate, Quantity::DerivativeError].iter().any(|quantity| quantity.column() == column)
}

/// An estimated error of a row that is written in single precision. One that was solved again, in double, has none of the
/// round-off in it that single adds to the rotation vector, to the position beside the rod's length, and to a column.
fn rounded_estimate(rows: &Rows, row: usize, column: usize) -> f64 {
    let Rows { solutions, plan, .. } = *rows;
    let estimate = solutions.values.get(row, column);
    if solutions.status(row) != Status::Refined {
        return estimate;
    }
    let distance = solutions.vector(row, Quantity::TipPosition).iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_of_tip = column == Quantity::ErrorEstimate.column();
    let size = if is_of_tip { (distance / plan.units.length).max(PI) } else { 1.0 };
    estimate + size * f64::from(f32::EPSILON)
}

fn number(x: f64, is_known: bool) -> f64 {
    if is_known && x.is_finite() { x } else { f64::NAN }
}

/// Adds numbers to a column of numbers.
fn extend(to: &mut Values, numbers: impl Iterator<Item = f64>) {
    match to {
        Values::Double(to) => to.extend(numbers),
        Values::Single(to) => to.extend(numbers.map(|x| x as f32)),
        Values::Index(_) | Values::Status(_) | Values::Flag(_) | Values::Text(_) => {}
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

/// Names of the columns that are not derivatives.
pub(crate) fn plain_columns(columns: &Table) -> Vec<&str> {
    let names = columns.columns.iter().map(|column: &Column| column.name.as_str());
    names.filter(|name| !name.starts_with("d(") && !name.starts_with("error(")).collect()
}

#[cfg(test)]
mod tests {
    use super::{Layout, Rows};
    use crate::backend::Precision;
    use crate::model::{ContactColumn, PlanOptions, Quantity, Solutions, Status};
    use crate::spec::SweepSpec;
    use crate::table::{Table, Values};

    const SWEEP: &str = r#"[sampling]
method = "grid"
[[axis]]
parameter = "wall.position.z"
from = 0.05
to = 0.06
points = 4
[output]
derivatives = ["wall.position.z"]
[scene.wall]
kind = "plane"
position = [0, 0, 0.05]
normal = [0, 0, -1]
friction = 0.5
tip = "sticks"
anchor = [0, 0, 0.05]
[[scene.segment]]
name = "tube"
kind = "flexible"
length = 0.06
stiffness = { bending = 2e-5, torsion = 1.5e-5 }
"#;

    fn flags(table: &Table, name: &str) -> Vec<Option<bool>> {
        match &table.column(name).expect(name).values {
            Values::Flag(flags) => flags.clone(),
            other => panic!("{name} is {}", other.kind()),
        }
    }

    #[test]
    fn contacts_have_their_columns() {
        let spec = SweepSpec::parse("sweep.toml".as_ref(), SWEEP).expect("a sweep");
        let plan = spec.plan(PlanOptions::default()).expect("a plan");
        let sampler = spec.sampler();
        let batch = plan.batch(4, |at, row| sampler.values(at as u64, row));
        let mut solutions = Solutions::new(&plan, 4);
        let first = plan.contact_column().expect("a wall");
        // Pressed with enough friction and with too little, pulled, and without equilibrium.
        let rows = [
            (Status::Ok, [1e-3, 0.0, -4e-3]),
            (Status::ThroughWall, [3e-3, 0.0, -4e-3]),
            (Status::Ok, [0.0, 0.0, 4e-3]),
            (Status::OutOfReach, [0.0; 3]),
        ];
        for (row, (status, force)) in rows.into_iter().enumerate() {
            solutions.set_status(row, status);
            let index = if status == Status::OutOfReach { -1.0 } else { 0.0 };
            solutions.set(row, Quantity::StabilityIndex, index);
            solutions.set_vector(row, Quantity::TipTangent, [0.6, 0.0, 0.8]);
            let mut put = |column: ContactColumn, values: &[f64]| {
                let at = first + column as usize;
                values.iter().enumerate().for_each(|(k, x)| solutions.values.set(row, at + k, *x));
            };
            put(ContactColumn::Touching, &[1.0]);
            put(ContactColumn::Gap, &[-2e-4]);
            put(ContactColumn::NormalForce, &[-force[2]]);
            put(ContactColumn::Force, &force);
            put(ContactColumn::Normal, &[0.0, 0.0, -1.0]);
            put(ContactColumn::BodyGap, &[0.0]);
            put(ContactColumn::ForceError, &[1e-9]);
            put(ContactColumn::Friction, &[0.5]);
            let slopes = solutions.force_derivative_column(0).expect("a derivative");
            (0..4).for_each(|k| solutions.values.set(row, slopes + k, 10.0 + k as f64));
        }
        let layout = Layout::new(&spec, Precision::F64);
        let mut table = layout.empty().clone();
        let rows = Rows { plan: &plan, batch: &batch, solutions: &solutions, range: 0..4, branches: None };
        layout.append(&mut table, &rows, &sampler, &|at| at as u64);
        let column = |name: &str| &table.column(name).expect(name).values;
        assert_eq!(flags(&table, "contact.touching"), [Some(true), Some(true), Some(true), None]);
        assert_eq!(flags(&table, "contact.holds"), [Some(true), Some(false), Some(false), None]);
        let ratio = column("contact.friction_ratio");
        assert_eq!([ratio.number(0), ratio.number(1)], [0.25, 0.75]);
        assert!(ratio.number(2).is_nan() && ratio.number(3).is_nan());
        assert_eq!(column("contact.normal_force").number(1), 4e-3);
        assert_eq!(column("contact.force.x").number(1), 3e-3);
        assert_eq!(column("contact.gap").number(0), -2e-4);
        assert!((column("contact.angle").number(0) - 0.6f64.atan2(0.8)).abs() < 1e-15);
        assert!(column("contact.force.z").number(3).is_nan());
        let by = "/d(wall.position.z)";
        for (row, what) in ["normal_force", "force.x", "force.y", "force.z"].into_iter().enumerate() {
            let slope = table.column(&format!("d(contact.{what}){by}")).expect(what);
            assert_eq!((slope.unit.as_str(), slope.values.number(0)), ("N/m", 10.0 + row as f64));
            assert!(slope.values.number(3).is_nan());
        }
        let names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        let place = |name: &str| names.iter().position(|other| *other == name).expect("a column");
        let last_of_tip = place("d(tip.rotation.z)/d(wall.position.z)");
        assert_eq!(place("d(contact.normal_force)/d(wall.position.z)"), last_of_tip + 1);
        assert_eq!(names.last(), Some(&"derivative_error"));
    }
}
