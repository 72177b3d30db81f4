//! Operations that a plan takes: the kernels themselves, run on numbers that count.

use crate::cpu::equilibrium::path::rest_slope;
use crate::cpu::equilibrium::solve::{start_columns, write_derivatives};
use crate::cpu::rod::base::moment_columns;
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Workspace};
use crate::cpu::rod::program::{Inputs, Outputs, Program};
use crate::cpu::rod::segments::Rod;
use crate::cpu::rod::stability::stability_index;
use crate::cpu::simd::counted::{Counted, Operations, counted};
use crate::cpu::simd::lane::Lane;
use crate::model::{MOST_ROWS, Quantity};

/// Operations of each kind of pass over the rod, for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PassOperations {
    /// One Newton step while the path from rest is followed: coarse steps, three columns.
    pub path: Operations,
    /// One chord step: fine steps, no columns.
    pub chord: Operations,
    /// The last step: fine steps, every column and integral, the rows of the Jacobian.
    pub answer: Operations,
    /// For the error estimate: twice the fine steps, no columns.
    pub check: Operations,
    /// The stability index, part of the answer, where columns by base moment tell it.
    pub stability: Operations,
}

impl PassOperations {
    /// On a sample that takes so many passes, about one chord step, the check and the answer among them.
    pub fn of_sample(&self, passes: f64) -> f64 {
        let [path, chord, answer, check] = [self.path, self.chord, self.answer, self.check].map(|o| o.total() as f64);
        (passes - 3.0).max(0.0) * path + chord + answer + check
    }
}

/// Counts the passes over a rod whose varying entries, in the plan's units, are given.
pub(in crate::cpu) fn count_passes(program: &Program, inputs: &[f64]) -> PassOperations {
    let inputs = Inputs { data: inputs, stride: 1, offset: 0 };
    let mut rod = Rod::<Counted>::new(());
    let mut workspace = Workspace::new((), program);
    rod.load(program, (), &inputs);
    let problem = Problem { program, inputs, rod: &rod };
    for k in 0..workspace.sources.len() {
        workspace.sources[k].load((problem.program, &problem.inputs), problem.rod, 3 * k, None);
    }
    let one = Counted::splat((), 1.0);
    let m0 = rest_slope(&problem, &mut workspace).m0;
    let mut pass = |what: &mut dyn FnMut(&mut Workspace<Counted>)| {
        let before = counted();
        what(&mut workspace);
        counted().since(before)
    };
    let mut by_moment = |record: Record| {
        pass(&mut |workspace| {
            let columns = &mut [moment_columns(one)];
            let tip = shoot(&problem, &program.fine, one, m0, columns, record, workspace);
            if record == Record::Stability {
                stability_index(program.terms, &workspace.station, &tip, columns);
            }
        })
    };
    let (with_index, without) = (by_moment(Record::Stability), by_moment(Record::Nothing));
    PassOperations {
        stability: with_index.since(without),
        path: pass(&mut |workspace| {
            let columns = &mut [moment_columns(one)];
            shoot(&problem, &program.coarse, one, m0, columns, Record::Nothing, workspace);
        }),
        chord: pass(&mut |workspace| {
            shoot(&problem, &program.fine, one, m0, &mut [], Record::Nothing, workspace);
        }),
        answer: pass(&mut |workspace| {
            let mut columns = Vec::new();
            start_columns(&problem, m0, workspace, &mut columns);
            let tip = shoot(&problem, &program.fine, one, m0, &mut columns, Record::Traces, workspace);
            let mut rows = vec![0.0; Quantity::COUNT + MOST_ROWS * program.derivatives.len()];
            let mut out = Outputs { data: &mut rows, stride: 1, offset: 0 };
            write_derivatives(&problem, m0, &tip, &columns, workspace, &mut out);
        }),
        check: pass(&mut |workspace| {
            shoot(&problem, &program.check, one, m0, &mut [], Record::Nothing, workspace);
        }),
    }
}
