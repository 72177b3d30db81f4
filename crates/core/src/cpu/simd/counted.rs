//! A number that counts what is done with it.

use super::lane::Lane;
use pulp::WithSimd;
use std::cell::Cell;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Arithmetic operations on one sample. Comparisons, choices and changes of sign are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Operations {
    /// And subtractions.
    pub additions: u64,
    /// Not those of fused operations.
    pub multiplications: u64,
    /// `a b + c`
    pub fused: u64,
    /// And square roots.
    pub divisions: u64,
}

impl Operations {
    /// Operations on numbers, a fused one being two.
    pub fn total(&self) -> u64 {
        self.additions + self.multiplications + 2 * self.fused + self.divisions
    }

    /// What came after `before`.
    pub fn since(self, before: Operations) -> Operations {
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

/// Counts one operation of a kind. What calls it is compiled once, not where it is used: speed is no matter here.
fn count(kind: impl FnOnce(&mut Operations) -> &mut u64) {
    let mut counted = COUNTED.get();
    *kind(&mut counted) += 1;
    COUNTED.set(counted);
}

/// What this thread has counted so far.
pub fn counted() -> Operations {
    COUNTED.get()
}

#[derive(Clone, Copy, Debug)]
pub struct Counted(f64);

#[derive(Clone, Copy)]
pub struct Mask(bool);

impl Add for Counted {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        count(|operations| &mut operations.additions);
        Self(self.0 + other.0)
    }
}

impl Sub for Counted {
    type Output = Self;
    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        count(|operations| &mut operations.additions);
        Self(self.0 - other.0)
    }
}

impl Mul for Counted {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        count(|operations| &mut operations.multiplications);
        Self(self.0 * other.0)
    }
}

impl Div for Counted {
    type Output = Self;
    #[inline(never)]
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

    #[inline(never)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        count(|operations| &mut operations.fused);
        Self(self.0.mul_add(b.0, c.0))
    }

    #[inline(never)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        (-self).mul_add(b, c)
    }

    #[inline(never)]
    fn sqrt(self) -> Self {
        count(|operations| &mut operations.divisions);
        Self(self.0.sqrt())
    }

    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(never)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    #[inline(never)]
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
