//! Operations that a plan takes: the kernels themselves, run on numbers that count.

use super::base::moment_columns;
use super::lane::Lane;
use super::path::rest_slope;
use super::program::{Inputs, Outputs, Program};
use super::rod::{Rod, TermSet, Terms};
use super::shoot::{Record, Workspace, shoot};
use super::solve::{start_columns, write_derivatives};
use super::{algebra::Vec3, by_terms};
use crate::model::{MOST_ROWS, Quantity};
use pulp::WithSimd;
use std::cell::Cell;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Arithmetic operations on one sample. Comparisons, choices and changes of sign are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Operations {
    pub additions: u64,
    pub multiplications: u64,
    /// `a b + c`
    pub fused: u64,
    /// And square roots.
    pub divisions: u64,
}

/// Operations of each kind of pass over the rod, for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PassOperations {
    /// One Newton step while the path from rest is followed: coarse steps, three columns.
    pub path: Operations,
    /// One chord step: fine steps, no columns.
    pub chord: Operations,
    /// The last step: fine steps, every column and integral, the rows of the Jacobian.
    pub answer: Operations,
    /// For the error estimate: twice the fine steps, no columns.
    pub check: Operations,
}

impl Operations {
    /// Operations on numbers, a fused one being two.
    pub fn total(&self) -> u64 {
        self.additions + self.multiplications + 2 * self.fused + self.divisions
    }

    fn since(self, before: Operations) -> Operations {
        Operations {
            additions: self.additions - before.additions,
            multiplications: self.multiplications - before.multiplications,
            fused: self.fused - before.fused,
            divisions: self.divisions - before.divisions,
        }
    }
}

thread_local! {
    static COUNTED: Cell<Operations> = const { Cell::new(Operations { additions: 0, multiplications: 0, fused: 0, divisions: 0 }) };
}

/// Counts one operation of a kind.
fn count(kind: impl FnOnce(&mut Operations) -> &mut u64) {
    let mut counted = COUNTED.get();
    *kind(&mut counted) += 1;
    COUNTED.set(counted);
}

/// A number that counts what is done with it.
#[derive(Clone, Copy, Debug)]
struct Counted(f64);

#[derive(Clone, Copy)]
struct Mask(bool);

impl Add for Counted {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        count(|operations| &mut operations.additions);
        Self(self.0 + other.0)
    }
}

impl Sub for Counted {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        count(|operations| &mut operations.additions);
        Self(self.0 - other.0)
    }
}

impl Mul for Counted {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        count(|operations| &mut operations.multiplications);
        Self(self.0 * other.0)
    }
}

impl Div for Counted {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        count(|operations| &mut operations.divisions);
        Self(self.0 / other.0)
    }
}

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl BitAnd for Mask {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Mask {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Mask {
    type Output = Self;
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Lane for Counted {
    type Scalar = f64;
    type Mask = Mask;
    type Token = ();
    const COUNT: usize = 1;

    fn splat((): (), value: f64) -> Self {
        Self(value)
    }

    fn token(self) {}

    fn mul_add(self, b: Self, c: Self) -> Self {
        count(|operations| &mut operations.fused);
        Self(self.0.mul_add(b.0, c.0))
    }

    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        (-self).mul_add(b, c)
    }

    fn sqrt(self) -> Self {
        count(|operations| &mut operations.divisions);
        Self(self.0.sqrt())
    }

    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }

    fn lt(self, other: Self) -> Mask {
        Mask(self.0 < other.0)
    }

    fn select(mask: Mask, if_true: Self, if_false: Self) -> Self {
        if mask.0 { if_true } else { if_false }
    }

    fn any(mask: Mask) -> bool {
        mask.0
    }

    fn load((): (), from: &[f64]) -> Self {
        Self(from[0])
    }

    fn store(self, to: &mut [f64]) {
        to[0] = self.0;
    }

    fn vectorize<Op: WithSimd>((): (), op: Op) -> Op::Output {
        op.with_simd(pulp::Scalar::new())
    }
}

/// Counts the passes over a rod whose varying entries, in the plan's units, are given.
pub(super) fn count_passes(program: &Program, inputs: &[f64]) -> PassOperations {
    by_terms!(program, count_with_terms::<Counted>(program, inputs))
}

fn count_with_terms<L: Lane<Token = (), Scalar = f64>, T: Terms>(program: &Program, inputs: &[f64]) -> PassOperations {
    let inputs = Inputs { data: inputs, stride: 1, offset: 0 };
    let mut rod = Rod::<L>::new(());
    let mut workspace = Workspace::new((), program);
    rod.load(program, (), &inputs);
    for k in 0..workspace.sources.len() {
        workspace.sources[k].load(program, (), &inputs, &rod, 3 * k);
    }
    let one = L::splat((), 1.0);
    let m0: Vec3<L> = rest_slope::<L, T>(program, &rod, &mut workspace);
    let mut pass = |what: &mut dyn FnMut(&mut Workspace<L>)| {
        let before = COUNTED.get();
        what(&mut workspace);
        COUNTED.get().since(before)
    };
    PassOperations {
        path: pass(&mut |workspace| {
            let columns = &mut [moment_columns(one)];
            shoot::<L, T>(program, &program.coarse, &rod, one, m0, columns, Record::Nothing, workspace);
        }),
        chord: pass(&mut |workspace| {
            shoot::<L, T>(program, &program.fine, &rod, one, m0, &mut [], Record::Nothing, workspace);
        }),
        answer: pass(&mut |workspace| {
            let mut columns = Vec::new();
            start_columns::<L, T>(program, &rod, m0, workspace, &mut columns);
            let tip = shoot::<L, T>(program, &program.fine, &rod, one, m0, &mut columns, Record::Traces, workspace);
            let mut rows = vec![0.0; Quantity::COUNT + MOST_ROWS * program.derivatives.len()];
            let mut out = Outputs { data: &mut rows, stride: 1, offset: 0 };
            write_derivatives::<L, T>(program, (), &inputs, &rod, m0, &tip, &columns, workspace, &mut out);
        }),
        check: pass(&mut |workspace| {
            shoot::<L, T>(program, &program.check, &rod, one, m0, &mut [], Record::Nothing, workspace);
        }),
    }
}
