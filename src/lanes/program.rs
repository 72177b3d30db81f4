//! A plan made ready for the kernel: entries in the plan's units, steps, and what to collect for the derivatives.

use super::algebra::Vec3;
use super::lane::{Lane, Scalar};
use crate::model::path::{PATH_STEPPER, newton_tolerance};
use crate::model::{Entry, Plan, SegmentPlan, Slot, Tableau, Terms};

/// Where a number of the record comes from, in the plan's units.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    Constant(f64),
    Input(usize),
}

/// What a segment must collect while the columns pass over it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Collect {
    pub rest_curvature: bool,
    pub stiffness: bool,
    pub load: bool,
}

/// The steps of one integration.
#[derive(Clone, Debug)]
pub struct Resolution {
    pub tableau: &'static Tableau,
    /// Steps over each segment; zero for rigid ones.
    pub steps: Vec<usize>,
}

/// The kernel's view of a plan.
#[derive(Clone, Debug)]
pub struct Program {
    pub terms: Terms,
    pub rigid_force_arm: bool,
    pub sources: Vec<Source>,
    pub segments: Vec<SegmentPlan>,
    pub collect: Vec<Collect>,
    pub derivatives: Vec<Vec<(Slot, usize)>>,
    /// For following the path from rest.
    pub coarse: Resolution,
    /// For the answer.
    pub fine: Resolution,
    /// For the error estimate: twice the steps of `fine`.
    pub check: Resolution,
    /// Newton's last step must be below this, in the plan's units of moment.
    pub newton_tolerance: f64,
}

impl Program {
    pub fn new(plan: &Plan, epsilon: f64) -> Self {
        let mut sources: Vec<Source> = plan
            .entries
            .iter()
            .zip(plan.entry_units())
            .map(|(entry, unit)| match *entry {
                Entry::Constant(value) => Source::Constant(value / unit),
                Entry::Varying(column) => Source::Input(column),
            })
            .collect();
        // A base position only moves the result; the engine adds it at the end.
        sources[15..18].fill(Source::Constant(0.0));
        let mut collect = vec![Collect::default(); plan.segments.len()];
        for (slot, _) in plan.derivatives.iter().flat_map(|derivative| &derivative.terms) {
            match *slot {
                Slot::RestCurvature(segment, _) => collect[segment].rest_curvature = true,
                Slot::Stiffness(segment, _) => collect[segment].stiffness = true,
                Slot::Load(segment, _) => collect[segment].load = true,
                _ => {}
            }
        }
        let steps = |scale: &dyn Fn(usize) -> usize| plan.segments.iter().map(|s| scale(s.steps)).collect();
        let stepper = plan.options.stepper;
        let tableau = stepper.tableau();
        let coarse = steps(&|n| stepper.path_steps(n));
        Self {
            terms: plan.terms,
            rigid_force_arm: plan.scene.rigid_force_arm,
            sources,
            segments: plan.segments.clone(),
            collect,
            derivatives: plan.derivatives.iter().map(|derivative| derivative.terms.clone()).collect(),
            coarse: Resolution { tableau: PATH_STEPPER.tableau(), steps: coarse },
            fine: Resolution { tableau, steps: steps(&|n| n) },
            check: Resolution { tableau, steps: steps(&|n| 2 * n) },
            newton_tolerance: newton_tolerance(plan.options.tolerance, epsilon),
        }
    }

    /// Loads one entry for a group of samples: `inputs[column * stride + offset ..]`.
    #[inline(always)]
    pub fn entry<L: Lane>(&self, token: L::Token, inputs: &Inputs<'_, L::Scalar>, entry: usize) -> L {
        match self.sources[entry] {
            Source::Constant(value) => L::splat(token, value),
            Source::Input(column) => L::load(token, &inputs.data[column * inputs.stride + inputs.offset..]),
        }
    }

    /// Three entries in a row.
    #[inline(always)]
    pub fn vector<L: Lane>(&self, token: L::Token, inputs: &Inputs<'_, L::Scalar>, entry: usize) -> Vec3<L> {
        Vec3 {
            x: self.entry(token, inputs, entry),
            y: self.entry(token, inputs, entry + 1),
            z: self.entry(token, inputs, entry + 2),
        }
    }
}

/// Where a group's results go, in the plan's units, column by column.
pub struct Outputs<'a, S: Scalar> {
    pub data: &'a mut [S],
    pub stride: usize,
    pub offset: usize,
}

impl<S: Scalar> Outputs<'_, S> {
    #[inline(always)]
    pub fn store<L: Lane<Scalar = S>>(&mut self, column: usize, value: L) {
        value.store(&mut self.data[column * self.stride + self.offset..]);
    }

    #[inline(always)]
    pub fn store_vector<L: Lane<Scalar = S>>(&mut self, column: usize, value: Vec3<L>) {
        self.store(column, value.x);
        self.store(column + 1, value.y);
        self.store(column + 2, value.z);
    }
}

/// The varying entries of a group, in the plan's units, column by column.
#[derive(Clone, Copy)]
pub struct Inputs<'a, S: Scalar> {
    pub data: &'a [S],
    pub stride: usize,
    pub offset: usize,
}
