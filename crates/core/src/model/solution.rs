//! What a backend returns for a batch.

use super::rotation::orthonormal;
use super::tolerances::FOLD_EVIDENCE;
use super::{Blocks, Plan, Status};

/// Columns of a solution before the derivatives; SI units, world frame unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Quantity {
    /// Tip position (m), three columns.
    TipPosition = 0,
    /// First director (body x) of the tip, three columns.
    TipD1 = 3,
    /// Tangent (body z) of the tip, three columns.
    TipTangent = 6,
    /// Internal moment at the base (N·m), three columns.
    BaseMoment = 9,
    /// |m(L) - l_tip| at the end of Newton's iteration, in units of the plan's moment.
    Residual = 12,
    /// Estimated error of tip position over rod length or of tip rotation (rad), whichever is larger.
    ErrorEstimate = 13,
    /// sqrt(3) over the Frobenius norm of (dr/dm0)^-1, negative when unstable: 1 at rest, 0 at a fold.
    StabilityMargin = 14,
    /// Number of negative eigenvalues of the second variation; 0 is stable, `NO_EQUILIBRIUM` is none.
    StabilityIndex = 15,
    /// Passes over the rod spent on Newton's iteration.
    Iterations = 16,
    /// Share of the full load reached from rest.
    LoadFraction = 17,
    /// A `Status` code.
    Status = 18,
    /// Estimated error of the derivatives: of the worst, (dp/L, w) over its norm. 1 and more say nothing.
    DerivativeError = 19,
    /// Estimated error of the load fraction of a fold that was seen as a turn of the load; 1: none was seen.
    LoadFractionError = 20,
}

impl Quantity {
    /// Columns before the first derivative.
    pub const COUNT: usize = 21;

    /// Its first column.
    pub fn column(self) -> usize {
        self as usize
    }
}

/// Columns of the contact with a wall, from [`Plan::contact_column`] on; SI units, world frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum ContactColumn {
    /// 1 where the wall presses; always of a held tip.
    Touching = 0,
    /// Between the tip's ball and the wall; negative where tissue yields (m).
    Gap = 1,
    /// Of the wall on the rod, along the normal (N).
    NormalForce = 2,
    /// Of the wall on the rod (N), three columns.
    Force = 3,
    /// From the wall to where the rod is, at the tip, three columns.
    Normal = 6,
    /// Least gap of the rod beyond where it first is before the wall, plus what tissue yields; 0 where the tip is nearest (m).
    BodyGap = 9,
    /// Estimated error of the force (N).
    ForceError = 10,
    /// Coefficient of friction; negative: none is given.
    Friction = 11,
}

impl ContactColumn {
    /// Columns before the first derivative.
    pub const COUNT: usize = 12;
}

/// Moment and force at the base: what tells an equilibrium of a rod. World frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseWrench {
    /// In N·m
    pub moment: [f64; 3],
    /// In N; `None` where the loads tell it, or it is not known. In a field that varies it then is what goes with that moment.
    pub force: Option<[f64; 3]>,
}

impl From<[f64; 3]> for BaseWrench {
    fn from(moment: [f64; 3]) -> Self {
        Self { moment, force: None }
    }
}

/// Stability index of a row whose numbers do not satisfy the equilibrium equations.
pub const NO_EQUILIBRIUM: f64 = -1.0;

/// Rows of one derivative: tip position (3), tip rotation w (3) and, if the plan says so, base moment (3). Those of the
/// curvature beyond rigid segments, where it has columns of its own, follow them.
pub const MOST_ROWS: usize = 9;

/// Solutions of a batch: one row a sample; `Quantity` columns, then [`Plan::rows`] columns for each derivative, then, if
/// the plan says so, the curvature at the start of the first flexible segment, the force at the base, and how the load of a
/// fold follows each parameter.
///
/// A derivative's rows are d(tip position) (m/unit), the world-frame virtual rotation w with dR = hat(w) R
/// (rad/unit) and d(base moment) (N·m/unit). Failed samples hold the last iterate or NaN.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solutions {
    /// One row a sample, [`Plan::output_count`] columns.
    pub values: Blocks<f64>,
    /// Of a derivative.
    rows: usize,
    /// First column of that curvature.
    own_curvature: Option<usize>,
    /// First column of the force at the base.
    base_force: Option<usize>,
    /// First column of how the load of a fold follows each parameter.
    fold: Option<usize>,
    /// First column of the contact with a wall.
    contact: Option<usize>,
}

impl Solutions {
    /// Room for the solutions of a batch of a plan.
    pub fn new(plan: &Plan, sample_count: usize) -> Self {
        let mut new = Self { values: Blocks::new(plan.output_count(), sample_count), ..Self::default() };
        new.arrange(plan);
        new
    }

    /// Makes room for those of another batch in the same memory; what it holds until they are written means nothing.
    pub fn reuse(&mut self, plan: &Plan, sample_count: usize) {
        self.values.reuse(plan.output_count(), sample_count);
        self.arrange(plan);
    }

    fn arrange(&mut self, plan: &Plan) {
        self.rows = plan.rows();
        self.own_curvature = plan.first_beyond_rigid().map(|_| plan.own_curvature_column());
        self.base_force = plan.base_force_column();
        self.fold = plan.fold_column();
        self.contact = plan.contact_column();
    }

    /// Rows of the table.
    pub fn sample_count(&self) -> usize {
        self.values.sample_count()
    }

    /// A number of a sample; of a vector, its x.
    pub fn get(&self, sample: usize, quantity: Quantity) -> f64 {
        self.values.get(sample, quantity.column())
    }

    /// Replaces a number of a sample; of a vector, its x.
    pub fn set(&mut self, sample: usize, quantity: Quantity, value: f64) {
        self.values.set(sample, quantity.column(), value);
    }

    /// Three columns of a sample, for example of `TipPosition`.
    pub fn vector(&self, sample: usize, quantity: Quantity) -> [f64; 3] {
        std::array::from_fn(|axis| self.values.get(sample, quantity.column() + axis))
    }

    /// Replaces three columns of a sample.
    pub fn set_vector(&mut self, sample: usize, quantity: Quantity, value: [f64; 3]) {
        for (axis, x) in value.into_iter().enumerate() {
            self.values.set(sample, quantity.column() + axis, x);
        }
    }

    /// A number of a sample's contact with the wall; of a vector, its x. Not a number where there is no wall.
    pub fn contact(&self, sample: usize, column: ContactColumn) -> f64 {
        self.contact.map_or(f64::NAN, |first| self.values.get(sample, first + column as usize))
    }

    /// Three columns of a sample's contact, for example of `Force`. Not numbers where there is no wall.
    pub fn contact_vector(&self, sample: usize, column: ContactColumn) -> [f64; 3] {
        let first = self.contact.map(|first| first + column as usize);
        std::array::from_fn(|axis| first.map_or(f64::NAN, |first| self.values.get(sample, first + axis)))
    }

    /// Column of how the normal force follows a derivative's parameter; those of the force along x, y, z are behind it.
    pub fn force_derivative_column(&self, derivative: usize) -> Option<usize> {
        Some(self.contact? + ContactColumn::COUNT + 4 * derivative)
    }

    /// How normal force and force follow a derivative's parameter, by its index (N/unit). Not a number where there is no wall.
    pub fn force_derivative(&self, sample: usize, derivative: usize) -> [f64; 4] {
        let first = self.force_derivative_column(derivative);
        std::array::from_fn(|k| first.map_or(f64::NAN, |first| self.values.get(sample, first + k)))
    }

    /// What became of a sample; `NonFinite` where the column holds no code.
    pub fn status(&self, sample: usize) -> Status {
        let code = self.get(sample, Quantity::Status);
        if code >= 0.0 { Status::from_code(code as u8).unwrap_or(Status::NonFinite) } else { Status::NonFinite }
    }

    /// Whether the row's numbers satisfy the equilibrium equations: those of a fold may be of an equilibrium beyond it.
    pub fn is_equilibrium(&self, sample: usize) -> bool {
        let status = self.status(sample);
        (status.is_converged() || status == Status::Fold) && self.get(sample, Quantity::StabilityIndex) >= 0.0
    }

    /// Whether the load was seen to turn at the end of a sample's path: a fold that no other solution need confirm.
    pub fn is_seen_fold(&self, sample: usize) -> bool {
        self.status(sample) == Status::Fold && self.get(sample, Quantity::LoadFractionError) < FOLD_EVIDENCE
    }

    /// Replaces what became of a sample.
    pub fn set_status(&mut self, sample: usize, status: Status) {
        self.set(sample, Quantity::Status, f64::from(status.code()));
    }

    /// Column of one row of a derivative.
    pub fn derivative_column(&self, derivative: usize, row: usize) -> usize {
        Quantity::COUNT + self.rows * derivative + row
    }

    /// Curvature at the start of the first flexible segment, body frame (1/m), where the base moment does not tell it.
    pub fn own_curvature(&self, sample: usize) -> Option<[f64; 3]> {
        let first = self.own_curvature?;
        Some(std::array::from_fn(|axis| self.values.get(sample, first + axis)))
    }

    /// Force at the base (N), where the field varies and the plan asks for it.
    pub fn base_force(&self, sample: usize) -> Option<[f64; 3]> {
        let first = self.base_force?;
        Some(std::array::from_fn(|axis| self.values.get(sample, first + axis)))
    }

    /// Column of how the load fraction of a fold follows a parameter (1/unit); the one behind it has the error of that. NaN where
    /// no turn of the load was seen.
    pub fn fold_derivative_column(&self, derivative: usize) -> Option<usize> {
        Some(self.fold? + 2 * derivative)
    }

    /// One row of a derivative: 0 to 2 tip position, 3 to 5 tip rotation, 6 to 8 base moment, 9 to 11 its own curvature.
    pub fn derivative(&self, sample: usize, derivative: usize, row: usize) -> f64 {
        self.values.get(sample, self.derivative_column(derivative, row))
    }

    /// Tip rotation, body to world, by rows; made orthonormal.
    pub fn tip_rotation(&self, sample: usize) -> [[f64; 3]; 3] {
        orthonormal(self.vector(sample, Quantity::TipD1), self.vector(sample, Quantity::TipTangent))
    }

    /// Copies one sample's row from another table of the same columns. Where only one of the two holds the force at the
    /// base, that and what follows it stay as they are.
    pub fn copy_row(&mut self, sample: usize, from: &Solutions, from_sample: usize) {
        let both = self.values.column_count().min(from.values.column_count());
        let common = if self.base_force == from.base_force { None } else { self.base_force.or(from.base_force) };
        for column in 0..common.unwrap_or(both).min(both) {
            self.values.set(sample, column, from.values.get(from_sample, column));
        }
    }
}
