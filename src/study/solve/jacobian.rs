//! Derivatives of one solution.

use super::Solved;
use crate::model::{Quantity, Slot, Vector, base_curvature_rate};
use crate::reference::residual_by_base_moment;

/// Three rows (x, y, z), each with one number for each parameter.
pub type Rows = [Vec<f64>; 3];

/// Derivatives of a solution by the k parameters asked for, each 3 x k, SI per unit of the parameter.
///
/// All but [`Jacobian::residual`] are total: the rod stays in equilibrium while the parameter changes. NaN where there
/// is no equilibrium.
#[derive(Clone, Copy, Debug)]
pub struct Jacobian<'a> {
    solved: &'a Solved,
}

impl Solved {
    /// Derivatives by the parameters asked for.
    pub fn jacobian(&self) -> Jacobian<'_> {
        Jacobian { solved: self }
    }
}

impl Jacobian<'_> {
    /// Names of the parameters, in the order of the columns.
    pub fn names(&self) -> Vec<String> {
        self.solved.plan().derivatives.iter().map(|derivative| derivative.name.clone()).collect()
    }

    /// SI units of the parameters, such as `A`; empty for pure numbers.
    pub fn units(&self) -> Vec<&'static str> {
        self.solved.plan().derivatives.iter().map(|derivative| derivative.parameter.unit()).collect()
    }

    /// Number of parameters.
    pub fn len(&self) -> usize {
        self.solved.plan().derivatives.len()
    }

    /// Whether no derivatives were asked for.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// d(tip position) (m/unit)
    pub fn position(&self) -> Rows {
        self.rows(0)
    }

    /// The tip's virtual rotation w, world frame, with dR = hat(w) R (rad/unit)
    pub fn rotation(&self) -> Rows {
        self.rows(3)
    }

    /// d(base moment) (N·m/unit)
    pub fn base_moment(&self) -> Rows {
        self.rows(6)
    }

    /// d(curvature at the start of the first flexible segment), body frame (1/m/unit)
    pub fn base_curvature(&self) -> Rows {
        self.gather(|k| self.base_curvature_column(k))
    }

    /// d(force of the wall along its normal) (N/unit), one number for each parameter; `None` without a wall.
    pub fn normal_force(&self) -> Option<Vec<f64>> {
        let [normal, ..] = self.wall_force()?;
        Some(normal)
    }

    /// d(force of the wall), world frame (N/unit); `None` without a wall.
    pub fn force(&self) -> Option<Rows> {
        let [_, x, y, z] = self.wall_force()?;
        Some([x, y, z])
    }

    fn wall_force(&self) -> Option<[Vec<f64>; 4]> {
        self.solved.scene().wall?;
        let is_known = self.solved.is_equilibrium();
        let of = |k| if is_known { self.solved.solutions().force_derivative(0, k) } else { [f64::NAN; 4] };
        let columns: Vec<[f64; 4]> = (0..self.len()).map(of).collect();
        Some([0, 1, 2, 3].map(|row| columns.iter().map(|column| column[row]).collect()))
    }

    /// d(moment that is left at the tip), the base moment held (N·m/unit); `None` where the rod cannot be integrated or
    /// has no equilibrium, and beside a wall, where that moment alone tells nothing.
    pub fn residual(&self) -> Option<Rows> {
        if !self.solved.is_equilibrium() || self.solved.scene().wall.is_some() {
            return None;
        }
        let matrix = residual_by_base_moment(&self.solved.rod(), self.solved.base_moment())?;
        Some(self.gather(|k| {
            let dm0 = self.column(k, 6);
            matrix.map(|row| (0..3).map(|axis| -row[axis] * dm0[axis]).sum())
        }))
    }

    fn rows(&self, first: usize) -> Rows {
        self.gather(|k| self.column(k, first))
    }

    fn gather(&self, column: impl Fn(usize) -> Vector) -> Rows {
        let columns: Vec<Vector> = (0..self.len()).map(column).collect();
        [0, 1, 2].map(|row| columns.iter().map(|column| column[row]).collect())
    }

    /// Three rows of derivative k.
    fn column(&self, k: usize, first: usize) -> Vector {
        if !self.solved.is_equilibrium() {
            return [f64::NAN; 3];
        }
        std::array::from_fn(|axis| self.solved.solutions().derivative(0, k, first + axis))
    }

    /// d(u0) by parameter k: through the base moment, and directly.
    fn base_curvature_column(&self, k: usize) -> Vector {
        if self.solved.solutions().own_curvature(0).is_some() {
            return self.column(k, 9);
        }
        let (plan, rod) = (self.solved.plan(), self.solved.rod());
        let m0 = self.solved.solutions().vector(0, Quantity::BaseMoment);
        // A slot that stands in no term of u0: what is left is the base moment's part.
        let mut sum = base_curvature_rate(&rod, m0, Slot::Insertion, self.column(k, 6));
        for (slot, entry) in &plan.derivatives[k].terms {
            let rate = plan.entry(self.solved.batch(), 0, *entry);
            let direct = base_curvature_rate(&rod, m0, *slot, [0.0; 3]);
            for axis in 0..3 {
                sum[axis] += rate * direct[axis];
            }
        }
        sum
    }
}
