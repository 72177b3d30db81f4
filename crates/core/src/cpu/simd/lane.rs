//! One number for each of several samples: a newtype over SIMD registers, chosen at run time.

use pulp::{Simd, WithSimd};
use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Lanes of the widest register.
pub const WIDEST: usize = 16;

/// The arithmetic of a kernel: as many samples side by side as the register holds.
pub trait Lane:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Send
    + Sync
    + 'static
{
    type Scalar: Scalar;
    type Mask: Copy + Send + Sync + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;
    type Token: Copy + Send + Sync;
    /// Samples in one register.
    const COUNT: usize;

    fn splat(token: Self::Token, value: f64) -> Self;
    fn token(self) -> Self::Token;
    /// `self * b + c`, rounded once where the hardware can.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `c - self * b`
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self;
    fn any(mask: Self::Mask) -> bool;
    fn load(token: Self::Token, from: &[Self::Scalar]) -> Self;
    fn store(self, to: &mut [Self::Scalar]);
    /// Runs `op` as a function of its own, compiled for the token's instruction set.
    fn vectorize<Op: WithSimd>(token: Self::Token, op: Op) -> Op::Output;

    /// Runs `op` as a function that the compiler never inlines into its callers; see [`apart`](super::apart).
    #[inline(never)]
    fn apart<Op: WithSimd>(token: Self::Token, op: Op) -> Op::Output {
        Self::vectorize(token, op)
    }

    /// The same number in every lane.
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self::splat(self.token(), value)
    }

    /// True where the number is neither infinite nor undefined.
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        self.abs().lt(self.constant(Self::Scalar::HUGE))
    }
}

/// f32 or f64.
pub trait Scalar: Copy + Default + Debug + PartialOrd + Send + Sync + 'static {
    /// Distance from 1 to the next number.
    const EPSILON: f64;
    /// Whether round-off hides nothing that lies next to a fold.
    const SHARP: bool = Self::EPSILON < 1e-10;
    /// Larger than any number a rod can produce.
    const HUGE: f64;
    fn from_f64(value: f64) -> Self;
    fn to_f64(self) -> f64;
}

impl Scalar for f64 {
    const EPSILON: f64 = f64::EPSILON;
    const HUGE: f64 = 1e300;
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

impl Scalar for f32 {
    const EPSILON: f64 = f32::EPSILON as f64;
    const HUGE: f64 = 1e37;
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

/// Vector registers of an instruction set, aligned in memory as the hardware likes it.
///
/// pulp's own are aligned as their elements are: then most AVX-512 loads and stores touch two cache lines.
pub trait Registers: Simd {
    type Alignment: Copy + Debug + Send + Sync;
}

macro_rules! registers {
    ($($set:ty, $alignment:ident, $bytes:literal;)*) => {$(
        #[derive(Clone, Copy, Debug)]
        #[repr(align($bytes))]
        pub struct $alignment;

        impl Registers for $set {
            type Alignment = $alignment;
        }
    )*};
}
registers!(pulp::Scalar, OneNumber, 8;);
#[cfg(target_arch = "x86_64")]
registers!(pulp::x86::V3, Avx2Register, 32; pulp::x86::V4, Avx512Register, 64;);
#[cfg(target_arch = "aarch64")]
registers!(pulp::aarch64::Neon, NeonRegister, 16;);

macro_rules! lane {
    ($lane:ident, $mask:ident, $scalar:ty, $register:ident, $bits:ident, $count:ident,
     $add:ident, $sub:ident, $mul:ident, $div:ident, $flip:ident, $mul_add:ident, $neg_mul_add:ident, $sqrt:ident,
     $abs:ident, $max:ident, $min:ident, $lt:ident, $select:ident, $splat:ident, $as_simd:ident, $as_mut_simd:ident,
     $and:ident, $or:ident, $xor:ident, $first_true:ident) => {
        #[derive(Clone, Copy, Debug)]
        pub struct $lane<S: Registers>(S, S::$register, [S::Alignment; 0]);

        #[derive(Clone, Copy, Debug)]
        pub struct $mask<S: Simd>(S, S::$bits);

        impl<S: Registers> Add for $lane<S> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self(self.0, self.0.$add(self.1, other.1), [])
            }
        }
        impl<S: Registers> Sub for $lane<S> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self(self.0, self.0.$sub(self.1, other.1), [])
            }
        }
        impl<S: Registers> Mul for $lane<S> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self(self.0, self.0.$mul(self.1, other.1), [])
            }
        }
        impl<S: Registers> Div for $lane<S> {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                Self(self.0, self.0.$div(self.1, other.1), [])
            }
        }
        impl<S: Registers> Neg for $lane<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                // The negation of pulp is not always inlined.
                Self(self.0, self.0.$flip(self.1, self.0.$splat(-0.0)), [])
            }
        }
        impl<S: Simd> BitAnd for $mask<S> {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                Self(self.0, self.0.$and(self.1, other.1))
            }
        }
        impl<S: Simd> BitOr for $mask<S> {
            type Output = Self;
            #[inline(always)]
            fn bitor(self, other: Self) -> Self {
                Self(self.0, self.0.$or(self.1, other.1))
            }
        }
        impl<S: Simd> Not for $mask<S> {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                let zero = self.0.$splat(0.0);
                let all = self.0.$lt(zero, self.0.$splat(1.0));
                Self(self.0, self.0.$xor(self.1, all))
            }
        }

        impl<S: Registers> Lane for $lane<S> {
            type Scalar = $scalar;
            type Mask = $mask<S>;
            type Token = S;
            const COUNT: usize = S::$count;

            #[inline(always)]
            fn splat(token: S, value: f64) -> Self {
                Self(token, token.$splat(value as $scalar), [])
            }
            #[inline(always)]
            fn token(self) -> S {
                self.0
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                Self(self.0, self.0.$mul_add(self.1, b.1, c.1), [])
            }
            #[inline(always)]
            fn neg_mul_add(self, b: Self, c: Self) -> Self {
                Self(self.0, self.0.$neg_mul_add(self.1, b.1, c.1), [])
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0, self.0.$sqrt(self.1), [])
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(self.0, self.0.$abs(self.1), [])
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self(self.0, self.0.$max(self.1, other.1), [])
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self(self.0, self.0.$min(self.1, other.1), [])
            }
            #[inline(always)]
            fn lt(self, other: Self) -> $mask<S> {
                $mask(self.0, self.0.$lt(self.1, other.1))
            }
            #[inline(always)]
            fn select(mask: $mask<S>, if_true: Self, if_false: Self) -> Self {
                Self(mask.0, mask.0.$select(mask.1, if_true.1, if_false.1), [])
            }
            #[inline(always)]
            fn any(mask: $mask<S>) -> bool {
                mask.0.$first_true(mask.1) < Self::COUNT
            }
            #[inline(always)]
            fn load(token: S, from: &[$scalar]) -> Self {
                Self(token, S::$as_simd(&from[..S::$count]).0[0], [])
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                S::$as_mut_simd(&mut to[..S::$count]).0[0] = self.1;
            }
            #[inline(always)]
            fn vectorize<Op: WithSimd>(token: S, op: Op) -> Op::Output {
                token.vectorize(op)
            }
        }
    };
}

lane!(
    F64,
    M64,
    f64,
    f64s,
    m64s,
    F64_LANES,
    add_f64s,
    sub_f64s,
    mul_f64s,
    div_f64s,
    xor_f64s,
    mul_add_e_f64s,
    negate_mul_add_e_f64s,
    sqrt_f64s,
    abs_f64s,
    max_f64s,
    min_f64s,
    less_than_f64s,
    select_f64s,
    splat_f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    and_m64s,
    or_m64s,
    xor_m64s,
    first_true_m64s
);
lane!(
    F32,
    M32,
    f32,
    f32s,
    m32s,
    F32_LANES,
    add_f32s,
    sub_f32s,
    mul_f32s,
    div_f32s,
    xor_f32s,
    mul_add_e_f32s,
    negate_mul_add_e_f32s,
    sqrt_f32s,
    abs_f32s,
    max_f32s,
    min_f32s,
    less_than_f32s,
    select_f32s,
    splat_f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    and_m32s,
    or_m32s,
    xor_m32s,
    first_true_m32s
);
