//! Mixed precision: columns, rows and stability in f32, twice as many samples side by side; base moment and pose by passes
//! over the rod alone in f64, on twice the fine steps. R4, J5
//!
//! What f32 leaves in doubt is solved in f64 from where its path ended.

mod block;

pub use block::Handed;

use super::algebra::{Mat3, Vec3, length};
use super::chord::{Check, answer, approach, check_pass, newton_step};
use super::column::Columns;
use super::group::{Load, Tools, load_end};
use super::kernels::Kernels;
use super::lane::Lane;
use super::path::{Path, PathEnd};
use super::problem::{Problem, Workspace};
use super::program::{Inputs, Outputs, Program};
use super::shoot::Tip;
use super::solve::{newton, write_answer, write_derivatives, write_verdict};
use super::stability::margin;
use crate::model::path::{HIDDEN_SHARE, ROUND_OFF, SETTLE_LIMIT, SETTLED_SHARE, SINGLE_STEP};
use crate::model::{Plan, Quantity, Status};
use pulp::{Simd, WithSimd};

/// Numbers that [`settle`] needs of an answer: base moment, Newton's last step, tip, columns by base moment, W and its
/// inverse.
const HANDED_COLUMNS: usize = 3 + 3 + 9 + 18 + 18;

/// A register type of single precision.
pub trait Single: Kernels {
    fn columns(columns: ColumnsOnly<'_, Self>);
}

/// Solves one group from where its `path` ended and writes its rows to `out`, but for pose, base moment and their errors:
/// what these are made of goes to `handed`.
#[inline(always)]
fn solve_columns<L: Lane>(
    problem: &Problem<'_, L>,
    path: Path,
    mut end: PathEnd<L>,
    workspace: &mut Workspace<L>,
    (out, handed): (&mut Outputs<'_, L::Scalar>, &mut Outputs<'_, L::Scalar>),
) {
    let nobody = end.lambda.lt(end.lambda);
    let steps = approach(problem, path, &mut end, nobody, workspace);
    if path == Path::Anchored {
        // What no chord steps certify goes the way from rest.
        end.reached = steps.trusted & !steps.moving;
    }
    let found = newton(problem, &mut end, workspace);
    let columns = std::mem::take(&mut workspace.columns);
    write_verdict(problem, path, &end, &found, &columns, workspace, out);
    write_derivatives(problem, end.m0, &found.tip, &columns, workspace, out);
    let Tip { p, d1, t, .. } = found.tip;
    let Columns { w, dp, .. } = columns[0];
    let vectors = [end.m0, found.delta, p, d1, t, dp.x, dp.y, dp.z, w.x, w.y, w.z];
    let (w, inverse) = (found.w, found.w_inverse);
    let vectors = vectors.into_iter().chain([w.x, w.y, w.z, inverse.x, inverse.y, inverse.z]);
    vectors.enumerate().for_each(|(k, vector)| handed.store_vector(3 * k, vector));
    workspace.columns = columns;
}

/// Writes base moment, pose and their errors of samples with an answer in f32: from there by passes on twice the fine steps,
/// the last moved to first order. What does not end there becomes `Pending`.
#[inline(always)]
fn settle<L: Lane>(
    problem: &Problem<'_, L>,
    epsilon: f64,
    handed: &Inputs<'_, L::Scalar>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let token = problem.token();
    let one = L::splat(token, 1.0);
    let vector = |column: usize| handed.vector::<L>(token, column);
    let matrix = |column: usize| Mat3 { x: vector(column), y: vector(column + 3), z: vector(column + 6) };
    let (m0, back) = (vector(0), vector(3));
    let tip = Tip { p: vector(6), d1: vector(9), t: vector(12), m: m0, n: m0 };
    let mut by_moment = super::base::moment_columns(one);
    (by_moment.dp, by_moment.w) = (matrix(15), matrix(24));
    let (w, w_inverse) = (matrix(33), matrix(42));
    let pending = one.constant(f64::from(Status::Pending.code()));
    let (status, passes): (L, L) = (out.load(token, Quantity::Status), out.load(token, Quantity::Iterations));
    let solved = status.lt(pending);
    let first_order = margin(&w_inverse) * one.constant(SETTLED_SHARE * program.newton_tolerance.sqrt());
    let bound = (one.constant(program.newton_tolerance) * (one + length(m0))).max(first_order);
    let still = one.constant(program.turn_tolerance);
    let is_short = |delta: Vec3<L>| length(delta).lt(bound) & length(by_moment.w * delta).lt(still);

    let mut check = check_pass(problem, m0 + back, workspace);
    let mut delta = newton_step(rod, &check.tip, &w_inverse);
    let mut count = one;
    for _ in 1..SETTLE_LIMIT {
        let far = solved & !is_short(delta);
        if !L::any(far) {
            break;
        }
        let next = check_pass(problem, check.m0 + delta, workspace);
        delta = Vec3::select(far, newton_step(rod, &next.tip, &w_inverse), delta);
        check = Check::select(far, next, check);
        count = L::select(far, count + one, count);
    }
    let size = length(delta);
    let settled = is_short(delta);

    let mut answered = answer(problem, &check, (&tip, back), &by_moment, (m0, &w, &w_inverse));
    // Round-off of the tip on the fine steps may hide how far that is off; columns move the pose with an error of their own.
    let noise = answered.noise * one.constant(epsilon);
    let hidden = one.constant(ROUND_OFF * epsilon * HIDDEN_SHARE);
    let moved = size * (noise + length(answered.m0 - m0) / margin(&w_inverse));
    answered.error = answered.error + answered.amplification * (hidden + moved);
    answered.derivative_error = answered.derivative_error + noise;
    write_answer(&answered, length(w * delta), out);
    out.store(Quantity::Iterations.column(), passes + count);
    out.store(Quantity::Status.column(), L::select(solved & !settled, pending, status));
}

/// That of columns in f32, beside `program`; `None`: searches and fields that vary are solved in f64 throughout.
pub fn single_program(plan: &Plan, program: &Program) -> Option<Program> {
    if program.field.is_some() || program.searches {
        return None;
    }
    let single = Program::new(plan, f32::EPSILON.into());
    Some(Program { terms: program.terms, chord_tolerance: SINGLE_STEP, first_order_tolerance: SINGLE_STEP, ..single })
}

/// The arguments of [`solve_columns`].
pub struct ColumnsOnly<'a, L: Lane> {
    pub program: &'a Program,
    pub token: L::Token,
    pub path: Path,
    pub tools: &'a mut Tools<L>,
    pub out: Outputs<'a, L::Scalar>,
    pub handed: Outputs<'a, L::Scalar>,
}

impl<L: Lane> ColumnsOnly<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}

impl<L: Kernels> WithSimd for ColumnsOnly<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let ColumnsOnly { program, token, path, tools, mut out, mut handed } = self;
        let Tools { rod, workspace, inputs, start } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        let start = Inputs { data: start, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        let end = load_end(token, &start);
        solve_columns(&Problem { program, inputs, rod }, path, end, workspace, (&mut out, &mut handed));
    }
}

/// The arguments of [`settle`].
pub struct Settle<'a, L: Lane> {
    pub program: &'a Program,
    pub token: L::Token,
    /// Of the columns.
    pub epsilon: f64,
    pub handed: &'a [L::Scalar],
    pub tools: &'a mut Tools<L>,
    pub out: Outputs<'a, L::Scalar>,
}

impl<L: Lane> Settle<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}

impl<L: Kernels> WithSimd for Settle<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Settle { program, token, epsilon, handed, tools, mut out } = self;
        let Tools { rod, workspace, inputs, .. } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        let handed = Inputs { data: handed, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        settle(&Problem { program, inputs, rod }, epsilon, &handed, workspace, &mut out);
    }
}
