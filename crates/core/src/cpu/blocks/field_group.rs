//! A register of samples in a field that varies: their paths, their answers, a pass, each a kernel.

use super::kernels::{FollowVarying, InVarying, Kernels, Leg, Load};
use super::tools::Tools;
use crate::cpu::algebra::Vec3;
use crate::cpu::contact::free_tip::{FREE_PASSES_AT, write_free_tip};
use crate::cpu::contact::press::press;
use crate::cpu::contact::wall::Wall;
use crate::cpu::equilibrium::field::answer::solve_varying;
use crate::cpu::equilibrium::field::arrival::Led;
use crate::cpu::equilibrium::field::arrival::{TOUCHING_AT, VaryingPath};
use crate::cpu::equilibrium::field::chord::shoot;
use crate::cpu::equilibrium::field::curve::follow_bordered;
use crate::cpu::equilibrium::field::path::follow_varying;
use crate::cpu::equilibrium::field::rest::{Rest, set_out};
use crate::cpu::equilibrium::field::search::search_varying;
use crate::cpu::equilibrium::start::Start;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::{Pass, VaryingPasses, integrate};
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::{Inputs, Outputs};
use crate::cpu::rod::terms::Terms;
use crate::cpu::simd::lane::{Lane, Scalar};
use pulp::{Simd, WithSimd};

impl<L: Kernels> WithSimd for FollowVarying<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let FollowVarying { program, token, leg, varying, tools } = self;
        let Tools { rod, inputs, start, .. } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        let problem = Problem { program, inputs, rod };
        varying.space.load(&problem);
        let from = Inputs { data: start, stride: L::COUNT, offset: 0 };
        let mut end = match leg {
            Leg::SetOut => {
                let rest = set_out(&problem, varying);
                rest.store(&mut Outputs { data: start, stride: L::COUNT, offset: 0 });
                return;
            }
            Leg::Follow => follow_varying(&problem, None, &Rest::load(token, &from), varying),
            Leg::Wall => {
                let base = (rod.base_force(program.terms), from.vector(token, 0));
                VaryingPath::under_full_load(base, from.column(token, FREE_PASSES_AT))
            }
        };
        varying.wall = program.wall.as_ref().map(|wall| Wall::load(wall, &problem));
        press(&problem, None, leg == Leg::Wall, &mut end, varying);
        let mut out = Outputs { data: start, stride: L::COUNT, offset: 0 };
        end.store(&mut out);
        if let Some(wall) = &varying.wall {
            let zero = end.lambda.constant(0.0);
            out.store(TOUCHING_AT, L::select(wall.touching, wall.sign, zero));
        }
    }
}

impl<L: Kernels> WithSimd for InVarying<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let InVarying { program, token, led, varying, tools, mut out } = self;
        let Tools { rod, inputs, start, .. } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        let problem = Problem { program, inputs, rod };
        varying.space.load(&problem);
        varying.wall = program.wall.as_ref().map(|wall| Wall::load(wall, &problem));
        let end = if program.starts_near {
            let start = (Start::force(&problem), Start::load(&problem).m0);
            with_matrix_at_full_load(&problem, start, start.0.x.constant(0.0), varying)
        } else if program.searches {
            search_varying(&problem, varying)
        } else {
            match led {
                Led::Before => {
                    let from = Inputs { data: start, stride: L::COUNT, offset: 0 };
                    if let Some(wall) = &mut varying.wall {
                        let sign: L = from.column(token, TOUCHING_AT);
                        wall.touching = L::splat(token, 0.5).lt(sign.abs());
                        wall.sign = L::select(wall.touching, sign, wall.sign);
                    }
                    VaryingPath::load(token, &from)
                }
                Led::Free => {
                    let from = Inputs { data: start, stride: L::COUNT, offset: 0 };
                    return write_free_tip(&problem, &from, varying, &mut out);
                }
                Led::FreeCurve | Led::FreeWithCare => {
                    let from = Inputs { data: start, stride: L::COUNT, offset: 0 };
                    let base = (rod.base_force(program.terms), from.vector(token, 0));
                    with_matrix_at_full_load(&problem, base, from.column(token, FREE_PASSES_AT), varying)
                }
                Led::Curve { careful } if L::Scalar::SHARP => {
                    let rest = set_out(&problem, varying);
                    follow_bordered(&problem, careful, &rest, varying)
                }
                // In single precision no curve is followed.
                Led::Curve { .. } | Led::Ramp(_) => {
                    let grid = if let Led::Ramp(grid) = led { grid } else { &program.careful };
                    let rest = set_out(&problem, varying);
                    follow_varying(&problem, Some(grid), &rest, varying)
                }
            }
        };
        solve_varying(&problem, led, end, varying, &mut out);
    }
}

/// The full load, reached after so many passes, with the matrix of a pass on the fine grid.
#[inline(always)]
fn with_matrix_at_full_load<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    base: (Vec3<L>, Vec3<L>),
    passes: L,
    workspace: &mut VaryingWorkspace<L>,
) -> VaryingPath<L> {
    shoot(problem, &problem.program.fine, base, Carried::Base, workspace);
    let inverse = workspace.matrix.solve(&Mat6::identity(passes.constant(1.0)));
    VaryingPath { inverse, ..VaryingPath::under_full_load(base, passes) }
}

/// A pass over a rod in a field that varies, and the terms that it is compiled for.
pub struct PassVarying<'a, L: Lane, T>(pub Pass<'a, L>, pub T);

impl<L: Lane, T: Terms> WithSimd for PassVarying<'_, L, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        integrate(self.0, self.1);
    }
}
