//! Where a search starts, and what it is kept away from.

use crate::cpu::algebra::Vec3;
use crate::cpu::rod::problem::Problem;
use crate::cpu::simd::lane::Lane;
use crate::model::{MOST_KNOWN, SEARCH_ENTRIES};

/// Base moments: of the start, and of known equilibria.
pub struct Start<L> {
    pub m0: Vec3<L>,
    pub known: [Vec3<L>; MOST_KNOWN],
}

impl<L: Lane> Start<L> {
    #[inline(always)]
    pub fn load(problem: &Problem<'_, L>) -> Self {
        let Problem { program, inputs, .. } = *problem;
        let token = problem.token();
        let entry = program.start.unwrap_or_default();
        let mut known = [Vec3::splat(L::splat(token, 0.0)); MOST_KNOWN];
        for (k, known) in known.iter_mut().enumerate() {
            *known = program.vector(token, &inputs, entry + 3 + 3 * k);
        }
        Self { m0: program.vector(token, &inputs, entry), known }
    }

    /// The force at the base to start from, in a field that varies; `FAR` where none is given.
    #[inline(always)]
    pub fn force(problem: &Problem<'_, L>) -> Vec3<L> {
        let Problem { program, inputs, .. } = *problem;
        program.vector(problem.token(), &inputs, program.start.unwrap_or_default() + SEARCH_ENTRIES)
    }
}
