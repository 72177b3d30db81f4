//! A register of samples in a field that varies: their paths, their answers, a pass, each a kernel.

use super::answer::solve_varying;
use super::arrival::{TOUCHING_AT, VaryingPath};
use super::curve::follow_bordered;
use super::pass::{Pass, integrate};
use super::path::follow_varying;
use super::press::press;
use super::rest::{Rest, set_out};
use super::search::search_varying;
use super::wall::Wall;
use crate::lanes::kernels::{FollowVarying, InVarying, Kernels, Led, Load};
use crate::lanes::lane::Lane;
use crate::lanes::problem::Problem;
use crate::lanes::program::{Inputs, Outputs};
use crate::lanes::terms::Terms;
use crate::lanes::tools::Tools;
use pulp::{Simd, WithSimd};

impl<L: Kernels> WithSimd for FollowVarying<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let FollowVarying { program, token, sets_out, varying, tools } = self;
        let Tools { rod, inputs, start, .. } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        let problem = Problem { program, inputs, rod };
        varying.space.load(&problem);
        if sets_out {
            let rest = set_out(&problem, varying);
            rest.store(&mut Outputs { data: start, stride: L::COUNT, offset: 0 });
        } else {
            let rest = Rest::load(token, &Inputs { data: start, stride: L::COUNT, offset: 0 });
            let mut end = follow_varying(&problem, None, &rest, varying);
            varying.wall = program.wall.as_ref().map(|wall| Wall::load(wall, &problem));
            press(&problem, None, &mut end, varying);
            let mut out = Outputs { data: start, stride: L::COUNT, offset: 0 };
            end.store(&mut out);
            if let Some(wall) = &varying.wall {
                let zero = end.lambda.constant(0.0);
                out.store(TOUCHING_AT, L::select(wall.touching, wall.sign, zero));
            }
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
        let end = if program.searches {
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
                Led::Curve => {
                    let rest = set_out(&problem, varying);
                    follow_bordered(&problem, &rest, varying)
                }
                Led::Ramp(grid) => {
                    let rest = set_out(&problem, varying);
                    follow_varying(&problem, Some(grid), &rest, varying)
                }
            }
        };
        solve_varying(&problem, !matches!(led, Led::Before), end, varying, &mut out);
    }
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
