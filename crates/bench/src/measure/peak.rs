//! The most fused multiply-adds that one thread does in a second, measured: what a kernel could reach at best.

use super::clock::{Clock, Effort};
use pulp::{Simd, WithSimd};
use rodsweep::backend::Precision;
use rodsweep::cpu::InstructionSet;

/// Independent sums: enough to hide a latency of six cycles at two a cycle, and to stay in sixteen registers.
const SUMS: usize = 12;
const ROUNDS: usize = 100_000;

struct InF64(f64);
struct InF32(f32);

macro_rules! sums {
    ($name:ident, $lanes:ident, $splat:ident, $mul_add:ident, $sum:ident) => {
        impl WithSimd for $name {
            /// Lanes, and a number that keeps the work from being left out.
            type Output = (usize, f64);

            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
                let (factor, term) = (simd.$splat(self.0), simd.$splat(1e-3));
                let mut sums = [simd.$splat(1.0); SUMS];
                for _ in 0..ROUNDS {
                    for sum in &mut sums {
                        *sum = simd.$mul_add(*sum, factor, term);
                    }
                }
                let total: f64 = sums.iter().map(|sum| f64::from(simd.$sum(*sum))).sum();
                (S::$lanes, total)
            }
        }
    };
}
sums!(InF64, F64_LANES, splat_f64s, mul_add_e_f64s, reduce_sum_f64s);
sums!(InF32, F32_LANES, splat_f32s, mul_add_e_f32s, reduce_sum_f32s);

/// Operations on numbers in a second, a fused multiply-add being two; the best of several repeats.
pub fn peak(set: InstructionSet, precision: Precision) -> Option<f64> {
    let arch = set.arch()?;
    let mut lanes = 1;
    let effort = Effort { least: 15, most: 15, seconds: 0.0 };
    let timing = Clock::Processor.time(effort, || {
        let (found, total) = match precision {
            Precision::F64 => arch.dispatch(InF64(std::hint::black_box(0.999))),
            Precision::F32 => arch.dispatch(InF32(std::hint::black_box(0.999))),
        };
        lanes = found;
        total
    });
    Some((2 * SUMS * ROUNDS * lanes) as f64 / timing.least)
}
