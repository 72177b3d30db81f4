//! The kernels of every register type: functions of their own, compiled for one register type, a pass also for one set of terms.
//!
//! Each lies in a module, since modules are what rustc shares out among code generation units.

use super::kernels::{Answer, ByNodes, Follow, FollowNodes, FollowVarying, InVarying, Job, Kernels, Load};
use crate::cpu::equilibrium::path::PathEnd;
use crate::cpu::rod::field;
use crate::cpu::rod::field::pass::VaryingPasses;
use crate::cpu::rod::problem::{PassKernel, Passes};
use crate::cpu::rod::terms::ProgramTerms;
use crate::cpu::simd::counted::Counted;
use crate::cpu::simd::lane::{F32, F64};

/// A pass of some terms.
macro_rules! pass {
    ($module:ident, $terms:ty) => {
        mod $module {
            use super::L;
            use crate::cpu::rod::problem::Pass;
            use crate::cpu::rod::shoot::WithTerms;
            use crate::cpu::rod::terms::*;
            use crate::cpu::simd::lane::Lane;

            pub fn run(pass: Pass<'_, L>) {
                let terms = <$terms>::of(pass.problem.program.terms);
                L::vectorize(pass.lambda.token(), WithTerms(pass, terms))
            }
        }
    };
}

/// The passes of a register type: for every set of common terms, or one for all.
macro_rules! passes {
    (by_terms) => {
        pass!(plain, Isotropic<false, false>);
        pass!(force, Isotropic<true, false>);
        pass!(load, Isotropic<true, true>);
        pass!(anisotropic, Anisotropic<false, false>);
        pass!(anisotropic_load, Anisotropic<true, false>);
        pass!(general, Anisotropic<false, true>);
        pass!(general_load, Anisotropic<true, true>);

        pub fn pass(terms: ProgramTerms) -> PassKernel<L> {
            let ProgramTerms { force, load, anisotropic, general } = terms;
            match (general, anisotropic, load, force) {
                (true, _, false, _) => general::run,
                (true, _, true, _) => general_load::run,
                (_, true, false, _) => anisotropic::run,
                (_, true, true, _) => anisotropic_load::run,
                (_, _, true, _) => load::run,
                (_, _, _, true) => force::run,
                _ => plain::run,
            }
        }
    };
    (together) => {
        pass!(every, ProgramTerms);

        pub fn pass(_: ProgramTerms) -> PassKernel<L> {
            every::run
        }
    };
}

/// A kernel outside of passes.
macro_rules! kernel {
    ($module:ident, $argument:ident, $result:ty) => {
        pub mod $module {
            use super::L;
            use crate::cpu::blocks::kernels::$argument;
            #[allow(unused_imports)]
            use crate::cpu::equilibrium::path::PathEnd;
            #[allow(unused_imports)]
            use crate::cpu::simd::lane::Lane;

            pub fn run(argument: $argument<'_, L>) -> $result {
                L::vectorize(argument.token(), argument)
            }
        }
    };
}

/// A pass in a field that varies, of some terms.
macro_rules! varying_pass {
    ($module:ident, $terms:ty) => {
        pub mod $module {
            use super::L;
            use crate::cpu::blocks::field_group::PassVarying;
            use crate::cpu::rod::field::pass::Pass;
            use crate::cpu::rod::terms::*;
            use crate::cpu::simd::lane::Lane;

            pub fn run(pass: Pass<'_, L>) {
                let terms = <$terms>::of(pass.problem.program.terms);
                L::vectorize(pass.lambda.token(), PassVarying(pass, terms))
            }
        }
    };
}

/// All kernels of a register type, and the type of its paths on the coarse grid.
macro_rules! kernels {
    ($module:ident, $lane:ty, $coarse:ty, $passes:ident) => {
        mod $module {
            use super::*;
            type L = $lane;

            passes!($passes);
            kernel!(load_rods, Load, ());
            kernel!(follow, Follow, PathEnd<L>);
            kernel!(answer, Answer, ());
            kernel!(follow_nodes, FollowNodes, ());
            kernel!(by_nodes, ByNodes, ());
            kernel!(follow_varying, FollowVarying, ());
            kernel!(in_varying, InVarying, ());
            varying_pass!(varying_plain, Isotropic<true, true>);
            varying_pass!(varying_every, ProgramTerms);

            pub mod job {
                use super::L;
                use crate::cpu::blocks::block::AsKernel;
                use crate::cpu::blocks::kernels::Job;
                use crate::cpu::simd::lane::Lane;

                pub fn run(token: <L as Lane>::Token, job: Job<'_, <L as Lane>::Scalar>) {
                    L::vectorize(token, AsKernel::<L>(token, job))
                }
            }
        }

        impl Passes for $lane {
            fn pass(terms: ProgramTerms) -> PassKernel<Self> {
                $module::pass(terms)
            }
        }

        impl VaryingPasses for $lane {
            fn varying_pass(pass: field::pass::Pass<'_, Self>) {
                match pass.problem.program.terms.anisotropic {
                    true => $module::varying_every::run(pass),
                    false => $module::varying_plain::run(pass),
                }
            }
        }

        impl Kernels for $lane {
            type Coarse = $coarse;

            fn job(token: Self::Token, job: Job<'_, Self::Scalar>) {
                $module::job::run(token, job)
            }
            fn load_rods(load: Load<'_, Self>) {
                $module::load_rods::run(load)
            }
            fn follow(follow: Follow<'_, Self>) -> PathEnd<Self> {
                $module::follow::run(follow)
            }
            fn answer(answer: Answer<'_, Self>) {
                $module::answer::run(answer)
            }
            fn follow_nodes(follow: FollowNodes<'_, Self>) {
                $module::follow_nodes::run(follow)
            }
            fn by_nodes(by_nodes: ByNodes<'_, Self>) {
                $module::by_nodes::run(by_nodes)
            }
            fn follow_varying(follow: FollowVarying<'_, Self>) {
                $module::follow_varying::run(follow)
            }
            fn in_varying(in_varying: InVarying<'_, Self>) {
                $module::in_varying::run(in_varying)
            }
        }
    };
}

// Machines without vector units are served, not tuned for: f32 would not be quicker there.
kernels!(scalar_f64, F64<pulp::Scalar>, F64<pulp::Scalar>, together);

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::*;
    use pulp::x86::{V3, V4};
    kernels!(avx2_f64, F64<V3>, F32<V3>, by_terms);
    kernels!(avx2_f32, F32<V3>, F32<V3>, by_terms);
    kernels!(avx512_f64, F64<V4>, F32<V4>, by_terms);
    kernels!(avx512_f32, F32<V4>, F32<V4>, by_terms);
}

#[cfg(target_arch = "aarch64")]
mod arm {
    use super::*;
    use pulp::aarch64::Neon;
    kernels!(neon_f64, F64<Neon>, F32<Neon>, by_terms);
    kernels!(neon_f32, F32<Neon>, F32<Neon>, by_terms);
}

/// For counting operations.
mod counted {
    use super::*;
    type L = Counted;
    passes!(together);

    impl Passes for Counted {
        fn pass(terms: ProgramTerms) -> PassKernel<Self> {
            pass(terms)
        }
    }
}
