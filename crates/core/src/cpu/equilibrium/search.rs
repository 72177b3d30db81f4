//! Equilibria off the path: Newton's method under the full load from a given base moment. R4
//!
//! Steps of bounded length; a lane that has arrived is frozen while its neighbours go on.

use super::path::PathEnd;
use super::start::Start;
use crate::cpu::algebra::{Mat3, Vec3, axpy, dot, inverse, length, select_matrix};
use crate::cpu::rod::base::{moment_columns, rotation_columns};
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Workspace};
use crate::cpu::rod::program::Resolution;
use crate::cpu::rod::shoot::tip_moment_columns;
use crate::cpu::rod::stability::stability_index;
use crate::cpu::simd::lane::Lane;
use crate::model::tolerances::{PATH_TOLERANCE, SEARCH_LIMIT, SEARCH_STEP};

/// The equilibrium under the full load that a search from the base moment in the inputs comes to.
#[inline(always)]
pub fn search_start<L: Lane>(problem: &Problem<'_, L>, workspace: &mut Workspace<L>) -> PathEnd<L> {
    let Start { m0, known } = Start::load(problem);
    let everyone = !m0.x.lt(m0.x);
    search(problem, &problem.program.coarse, m0, everyone, &known, workspace)
}

/// The equilibrium that `wanted` lanes come to from `start`, away from `known` ones.
#[inline(always)]
pub fn search<L: Lane>(
    problem: &Problem<'_, L>,
    resolution: &Resolution,
    start: Vec3<L>,
    wanted: L::Mask,
    known: &[Vec3<L>],
    workspace: &mut Workspace<L>,
) -> PathEnd<L> {
    let Problem { program, rod, .. } = *problem;
    let one = rod.t.x.constant(1.0);
    let zero = one.constant(0.0);
    let none = one.lt(zero);
    let mut end = PathEnd {
        m0: start,
        inverse: Mat3::zero(one),
        lambda: one,
        heading: Vec3::splat(zero),
        passes: zero,
        reached: none,
        ramped: none,
        close: none,
        exhausted: none,
        fold: none,
        turned: none,
        load_error: one,
    };
    let mut failed = !wanted;
    loop {
        let active = !(end.reached | failed);
        if !L::any(active) {
            break;
        }
        let mut columns = [moment_columns(one)];
        let tip = shoot(problem, resolution, one, end.m0, &mut columns, Record::Nothing, workspace);
        let w_inverse = inverse(tip_moment_columns(program.terms, &tip, &columns[0]));
        let newton = -(w_inverse * (tip.m - rod.l_tip)); // R4
        let delta = newton * deflation(end.m0, newton, known);
        let size = length(delta);
        let arrived = size.lt(one.constant(PATH_TOLERANCE) * (one + length(end.m0)));
        let longest = one.constant(SEARCH_STEP);
        let factor = L::select(size.lt(longest), one, longest / size);
        // A start that is as good as this grid can tell stays for the fine grid.
        let moves = active & !(arrived & end.passes.lt(one));
        end.m0 = Vec3::select(moves, end.m0 + delta * factor, end.m0);
        end.inverse = select_matrix::<L>(active, w_inverse, end.inverse);
        end.passes = L::select(active, end.passes + one, end.passes);
        end.reached = end.reached | (active & arrived);
        failed = failed | (active & !(end.passes.lt(one.constant(SEARCH_LIMIT)) & size.is_finite()));
    }
    end
}

/// What becomes of Newton's step if the residual is multiplied by 1 + 1/d² for each known equilibrium at distance d.
#[inline(always)]
pub fn deflation<L: Lane>(m0: Vec3<L>, newton: Vec3<L>, known: &[Vec3<L>]) -> L {
    let one = m0.x.constant(1.0);
    let mut slope = one.constant(0.0);
    for equilibrium in known {
        let away = m0 - *equilibrium;
        let d2 = dot(away, away);
        slope = slope - dot(away, newton) * one.constant(2.0) / (d2 * (one + d2));
    }
    one / (one - slope)
}

#[inline(always)]
fn unit<L: Lane>(v: Vec3<L>) -> Vec3<L> {
    let tiny = v.x.constant(f64::from(f32::MIN_POSITIVE));
    v * (tiny.constant(1.0) / length(v).max(tiny))
}

/// Directions from a fold, in plan units of moment: on along the path, then to both sides.
const AWAY: [(f64, f64); 4] = [(1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (3.0, 0.0)];

/// For lanes that ended at a fold: a stable equilibrium under the full load beyond it. Those that find one are where
/// `PathEnd` then stands; returns them.
#[inline(always)]
pub fn snap<L: Lane>(problem: &Problem<'_, L>, end: &mut PathEnd<L>, workspace: &mut Workspace<L>) -> L::Mask {
    let program = problem.program;
    let one = end.lambda.constant(1.0);
    let fold = end.m0;
    let (along, across) = (unit(end.heading), unit(end.inverse * Vec3::splat(one)));
    let mut wanted = end.fold;
    for (forward, sideways) in AWAY {
        if !L::any(wanted) {
            break;
        }
        let start = axpy(one.constant(forward), along, axpy(one.constant(sideways), across, fold));
        let found = search(problem, &program.careful, start, wanted, &[], workspace);
        let mut columns = [moment_columns(one), rotation_columns(found.m0)];
        let tip = shoot(problem, &program.careful, one, found.m0, &mut columns, Record::Stability, workspace);
        let index = stability_index(program.terms, &workspace.station, &tip, &columns);
        let is_stable = wanted & found.reached & index.lt(one.constant(0.5));
        end.m0 = Vec3::select(is_stable, found.m0, end.m0);
        end.inverse = select_matrix::<L>(is_stable, found.inverse, end.inverse);
        end.passes = L::select(wanted, end.passes + found.passes + one, end.passes);
        wanted = wanted & !is_stable;
    }
    end.fold & !wanted
}
