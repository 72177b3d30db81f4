//! How the load of a fold follows the parameters, in a field that varies. C7
#![allow(clippy::needless_range_loop)]

use super::arrival::VaryingPath;
use super::curve::load_by_residual;
use crate::cpu::equilibrium::equations::further;
use crate::cpu::equilibrium::fold::{leave_folds_empty, store_fold_slopes};
use crate::cpu::rod::field::pass::{Pass, VaryingPasses};
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::{Outputs, Resolution};

/// Writes how the load of each fold follows every parameter, if the program asks for it: that on twice the fine steps. Samples
/// without a turn have none. The field of the workspace is weakened to that of the folds.
#[inline(always)]
pub fn write_fold_rows<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    end: &VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let program = problem.program;
    let (Some(first), Some(field)) = (program.fold, &program.field) else { return };
    if !L::any(end.turned) {
        leave_folds_empty(program, end.lambda, out);
        return;
    }
    let rod = problem.rod.under(end.lambda);
    let problem = Problem { rod: &rod, ..*problem };
    workspace.space.weaken(end.lambda);
    for k in 0..workspace.parameters.len() {
        workspace.parameters[k].load(&problem, 3 * k, Some(end.lambda));
    }
    let coarse = slopes(&problem, (&program.fine, &field.fine_points), end, workspace);
    let fine = slopes(&problem, (&program.check, &field.check_points), end, workspace);
    store_fold_slopes(first, (end.turned, end.load_error), &coarse, &fine, out);
}

/// d(lambda)/d(parameter) for each, by forward columns on a rod under the load of its fold. C7
#[inline(always)]
fn slopes<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    (resolution, points): (&Resolution, &[(f64, f64)]),
    end: &VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
) -> Vec<L> {
    let Problem { program, rod, .. } = *problem;
    let one = end.lambda.constant(1.0);
    let zero = one.constant(0.0);
    let further = one.constant(further::<L>());
    let pass = |lambda: L, what: Carried, workspace: &mut VaryingWorkspace<L>| {
        L::varying_pass(Pass { problem: *problem, resolution, lambda, base: end.base, what, points, workspace });
        let tip = &workspace.tip;
        let (n, m) = (tip.n - rod.f_tip * lambda, tip.m - rod.l_tip * lambda);
        [n.x, n.y, n.z, m.x, m.y, m.z]
    };
    let after = pass(one + further, Carried::State, workspace);
    let before = pass(one, Carried::Columns, workspace);
    let mut matrix = [[zero; 7]; 7];
    for k in 0..6 {
        matrix[k][..6].copy_from_slice(&workspace.matrix.0[k]);
        matrix[k][6] = (after[k] - before[k]) / (further * end.lambda);
    }
    let (n, m) = end.along;
    matrix[6] = [n.x, n.y, n.z, m.x, m.y, m.z, zero];
    let by_residual = load_by_residual(&matrix);
    let mut slopes = Vec::with_capacity(program.derivatives.len());
    for (parameters, columns) in workspace.parameters.iter().zip(&workspace.columns) {
        for k in 0..parameters.count {
            let (dn, dm) = (columns.dn[k] - parameters.df_tip[k], columns.dm[k] - parameters.sources.dl_tip[k]);
            let residual = [dn.x, dn.y, dn.z, dm.x, dm.y, dm.z];
            slopes.push(residual.iter().zip(&by_residual).fold(zero, |sum, (r, by)| r.mul_add(*by, sum)));
        }
    }
    slopes
}
