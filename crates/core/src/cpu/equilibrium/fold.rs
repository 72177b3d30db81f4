//! How the load of a fold follows the parameters. C7

use super::equations::further;
use super::path::PathEnd;
use crate::cpu::algebra::{Vec3, adjugate, dot, row_times};
use crate::cpu::rod::base::{base_slope, forward_columns, moment_columns};
use crate::cpu::rod::columns::Columns;
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Workspace};
use crate::cpu::rod::program::{Outputs, Program, Resolution};
use crate::cpu::rod::rows::{along, functional};
use crate::cpu::rod::shoot::tip_moment_columns;
use crate::cpu::rod::source::rate_under;
use crate::cpu::simd::lane::Lane;
use crate::model::Slot;
use crate::model::tolerances::{FOLD_SLOPE_NOISE, FOLD_SLOPE_PLACE};

/// A turn of the load, as its path has left it.
pub struct TurnedAt<L: Lane> {
    /// The samples whose load was seen to turn.
    lanes: L::Mask,
    m0: Vec3<L>,
    lambda: L,
    /// Along the curve: the direction in which the rod gives way.
    heading: Vec3<L>,
    load_error: L,
}

impl<L: Lane> TurnedAt<L> {
    #[inline(always)]
    pub fn new(end: &PathEnd<L>) -> Self {
        let PathEnd { m0, lambda, heading, load_error, turned, .. } = *end;
        Self { lanes: turned, m0, lambda, heading, load_error }
    }
}

/// Writes how the load of each fold follows every parameter, if the program asks for it: that on twice the fine steps. Samples
/// without a turn have none.
#[inline(always)]
pub fn write_fold_rows<L: Lane>(
    problem: &Problem<'_, L>,
    turned: &TurnedAt<L>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let program = problem.program;
    let Some(first) = program.fold else { return };
    if !L::any(turned.lanes) {
        leave_folds_empty(program, turned.lambda, out);
        return;
    }
    let rod = problem.rod.under(turned.lambda);
    let problem = Problem { rod: &rod, ..*problem };
    let coarse = slopes(&problem, &program.fine, turned, workspace);
    let fine = slopes(&problem, &program.check, turned, workspace);
    store_fold_slopes(first, (turned.lanes, turned.load_error), &coarse, &fine, out);
}

/// No numbers in those columns.
#[inline(always)]
pub fn leave_folds_empty<L: Lane>(program: &Program, of: L, out: &mut Outputs<'_, L::Scalar>) {
    if let Some(first) = program.fold {
        (0..2 * program.derivatives.len()).for_each(|k| out.store(first + k, of.constant(f64::NAN)));
    }
}

/// Stores slopes on the fine steps and on twice as many: the latter, and how far they may be off. That is their difference, what the
/// place of the turn may be off, and what the difference of residuals rounds.
#[inline(always)]
pub fn store_fold_slopes<L: Lane>(
    first: usize,
    (lanes, load_error): (L::Mask, L),
    coarse: &[L],
    fine: &[L],
    out: &mut Outputs<'_, L::Scalar>,
) {
    for (k, (coarse, fine)) in coarse.iter().zip(fine).enumerate() {
        let nothing = fine.constant(f64::NAN);
        let share = load_error.mul_add(fine.constant(FOLD_SLOPE_PLACE), fine.constant(FOLD_SLOPE_NOISE));
        let error = fine.abs().mul_add(share, (*fine - *coarse).abs());
        out.store(first + 2 * k, L::select(lanes, *fine, nothing));
        out.store(first + 2 * k + 1, L::select(lanes, error, nothing));
    }
}

/// d(lambda)/d(parameter) for each, on a rod under the load of its fold: by forward columns, or from the direction in which the rod
/// gives way, by reciprocity. C7
#[inline(always)]
fn slopes<L: Lane>(
    problem: &Problem<'_, L>,
    resolution: &Resolution,
    turned: &TurnedAt<L>,
    workspace: &mut Workspace<L>,
) -> Vec<L> {
    let Problem { program, rod, .. } = *problem;
    let TurnedAt { m0, lambda, heading, .. } = *turned;
    let one = lambda.constant(1.0);
    let mut columns = vec![moment_columns(one)];
    for k in 0..workspace.sources.len() {
        workspace.sources[k].load((problem.program, &problem.inputs), problem.rod, 3 * k, Some(lambda));
        columns.push(forward_columns(program.terms, rod, &workspace.sources[k], m0));
    }
    let tip = shoot(problem, resolution, one, m0, &mut columns, Record::Traces, workspace);
    let (adjugate, _) = adjugate(tip_moment_columns(program.terms, &tip, &columns[0]));
    // det W is zero: its adjugate is the product of both null vectors.
    let phi = row_times(heading, adjugate);
    let y = adjugate * phi;
    let rotation = columns[0].w * y;
    let mut slopes: Vec<L> = Vec::with_capacity(program.derivatives.len());
    for (sources, column) in workspace.sources.iter().zip(&columns[1..]) {
        let residual = tip_moment_columns(program.terms, &tip, column) - sources.dl_tip;
        let row = row_times(phi, residual);
        slopes.extend([-row.x, -row.y, -row.z]);
    }
    slopes.truncate(program.derivatives.len());
    if !program.forward {
        slopes.extend(
            (0..program.derivatives.len()).map(|index| work(problem, index, turned, y, &columns[0], workspace)),
        );
    }
    // r by a share of the load.
    let further = one.constant(further::<L>());
    let after = shoot(problem, resolution, one + further, m0, &mut [], Record::Nothing, workspace);
    let q = (after.m - tip.m - rod.l_tip * further) * (one / (further * lambda));
    let by_load = dot(if program.forward { phi } else { rotation }, q);
    slopes.iter_mut().for_each(|slope| *slope = *slope / by_load);
    slopes
}

/// What a parameter does to a rod that gives way along `y`: minus its residual times the rotation of the tip. J5, C7
#[inline(always)]
fn work<L: Lane>(
    problem: &Problem<'_, L>,
    index: usize,
    turned: &TurnedAt<L>,
    y: Vec3<L>,
    by_moment: &Columns<L>,
    workspace: &Workspace<L>,
) -> L {
    let Problem { program, inputs, rod } = *problem;
    let TurnedAt { m0, lambda, .. } = *turned;
    let mut sum = lambda.constant(0.0);
    for (slot, entry) in &program.derivatives[index] {
        let rate = rate_under(Some(lambda), *slot, program.entry(problem.token(), &inputs, *entry));
        sum = match *slot {
            Slot::BaseRotation(axis) => sum + dot(y, along(axis, rate)),
            Slot::Insertion => {
                let base = base_slope(program.terms, rod, m0, rod.base_force(program.terms));
                rate.mul_add(dot(y, base.omega), sum)
            }
            _ => rate.mul_add(dot(functional(*slot, rod, by_moment, workspace, 0), y), sum),
        };
    }
    sum
}
