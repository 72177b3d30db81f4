//! One pass over the rod, base to tip, from the load at the base: state, transfers of its intervals, parameters. F5

use super::axis::{bent, straight};
use super::crossing::Crossing;
use super::ends::{base_columns, lengthen};
use super::index::{Interval, Transfer};
use super::matrix::Mat6;
use super::parameters::Parameters;
use super::program_field::FAR;
use super::state::{Columns, State};
use super::step::{Step, step_columns, step_rod};
use super::workspace::{Carried, VaryingWorkspace};
use crate::cpu::algebra::{Mat3, Vec3, columns_cross_sub, cross, hat, length};
use crate::cpu::contact::course::{PLACES, RIGID_PLACES};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::Resolution;
use crate::cpu::rod::segments::Segment;
use crate::cpu::rod::terms::Terms;
use crate::cpu::simd::lane::Lane;
use crate::model::step_at;

/// Each flexible segment has at most so many intervals, of several steps each where it takes more.
const INTERVALS: usize = 6;

/// A pass: the arguments of [`integrate`].
pub struct Pass<'a, L: Lane> {
    pub problem: Problem<'a, L>,
    pub resolution: &'a Resolution,
    pub lambda: L,
    /// Force and moment at the base.
    pub base: (Vec3<L>, Vec3<L>),
    pub what: Carried,
    /// Points of a rigid segment where the field acts, and their shares of its dipole.
    pub points: &'a [(f64, f64)],
    pub workspace: &'a mut VaryingWorkspace<L>,
}

/// A register type with passes in a field that varies.
pub trait VaryingPasses: Lane {
    fn varying_pass(pass: Pass<'_, Self>);
}

/// dr/d(n0, m0) from the canonical load at the tip, with moment `m` there.
#[inline(always)]
fn residual<L: Lane>(pose: &Mat6<L>, load: &Mat6<L>, m: Vec3<L>) -> Mat6<L> {
    let mut matrix = *load;
    let half = m.x.constant(0.5);
    for k in 0..6 {
        let w = Vec3 { x: pose.0[3][k], y: pose.0[4][k], z: pose.0[5][k] };
        let turned = cross(w, m * half);
        for row in 0..3 {
            matrix.0[3 + row][k] = matrix.0[3 + row][k] + turned[row];
        }
    }
    matrix
}

/// dm - w x m / 2 of three columns.
#[inline(always)]
fn canonical<L: Lane>(columns: &Columns<L>, m: Vec3<L>) -> Mat3<L> {
    columns_cross_sub(columns.w, m * m.x.constant(0.5), columns.dm)
}

/// Columns at the start of an interval: by force, by moment, by rotation and by displacement there.
#[inline(always)]
fn interval_columns<L: Lane>(m: Vec3<L>) -> [Columns<L>; 4] {
    let half = m.x.constant(0.5);
    let (zero, one) = (Mat3::zero(half), Mat3::identity(half));
    let none = Columns { w: zero, dp: zero, dm: zero, dn: zero };
    [
        Columns { dn: one, ..none },
        Columns { dm: one, ..none },
        Columns { w: one, dm: hat(m) * -half, ..none },
        Columns { dp: one, ..none },
    ]
}

/// Halfway over a step of this length.
#[inline(always)]
fn midway<L: Lane>(before: &State<L>, after: &State<L>, length: L) -> Vec3<L> {
    (before.p + after.p) * length.constant(0.5) + (before.t - after.t) * (length * length.constant(0.125))
}

/// Three columns of segment `index` by their number: `count` of its own, then those of parameters.
#[inline(always)]
fn numbered<'a, L>(
    k: usize,
    count: usize,
    index: usize,
    parameters: &'a [Parameters<L>],
    own: &'a mut [Columns<L>; 4],
    columns: &'a mut [Columns<L>],
) -> (Option<(&'a Parameters<L>, usize)>, &'a mut Columns<L>) {
    if k < count { (None, &mut own[k]) } else { (Some((&parameters[k - count], index)), &mut columns[k - count]) }
}

/// Integrates the rod; what it comes to is left in the workspace.
#[inline(always)]
pub fn integrate<L: Lane, T: Terms>(pass: Pass<'_, L>, terms: T) {
    let Pass { problem, resolution, lambda, base, what, points, workspace } = pass;
    let Problem { program, rod, .. } = problem;
    let VaryingWorkspace { space, room, acting, parameters, transfers, columns, first, moments, wall, .. } = workspace;
    let zero = lambda.constant(0.0);
    let mut state = State { p: Vec3::splat(zero), d1: rod.d1, t: rod.t, m: base.1, n: base.0 };
    let (mut pose, mut load) = (Mat6::zero(zero), Mat6::identity(zero));
    let (far, with_transfers) = (zero.constant(FAR), what.has_transfers());
    let (mut leeway, mut inside, mut travelled) = (far, far, zero);
    let mut own = interval_columns(state.m); // By the load at the base, or by the start of each interval.
    // What is not carried along stays as an earlier pass has left it.
    if with_transfers {
        transfers.clear();
    }
    moments.clear();
    if what == Carried::Watched
        && let Some(wall) = wall
    {
        wall.watch();
    }
    if what.has_parameters() {
        columns.clear();
        for parameters in parameters.iter() {
            columns.push(base_columns(&problem, parameters, &state));
        }
    }
    let threes = if what.has_parameters() { columns.len() } else { 0 };
    for (index, segment) in rod.segments.iter().enumerate() {
        match segment {
            Segment::Flexible(flexible) => {
                if what == Carried::Place {
                    moments.push((state.p, state.m));
                }
                let steps = resolution.steps[index];
                let (ratio, steady) = (resolution.ratio(terms, index), program.steady[index]);
                if what.has_parameters() && Some(index) == program.first_beyond_rigid {
                    if what.has_base() {
                        load.put(0, &own[0].dn, &own[0].dm);
                        load.put(3, &own[1].dn, &own[1].dm);
                    }
                    first.load(program.terms, (flexible, index), &state, &load, parameters, columns);
                }
                let joined = steps.div_ceil(INTERVALS);
                for k in 0..steps {
                    let (start, share) = step_at(ratio, k, steps);
                    let span = flexible.length * zero.constant(share);
                    if k == 0 || ratio != 1.0 {
                        room.stages.set_step(resolution.tableau, span);
                    }
                    let step = Step { terms, space, segment: flexible, lambda, start, share };
                    let before = state;
                    match steady {
                        true => step_rod::<L, T, true>(&step, room, what.has_columns(), &mut state),
                        false => step_rod::<L, T, false>(&step, room, what.has_columns(), &mut state),
                    }
                    let mut count = if what.has_base() { 2 } else { 0 };
                    if with_transfers {
                        if k % joined == 0 {
                            own = interval_columns(before.m);
                        }
                        // Without a magnet a displacement takes the interval along.
                        count = if flexible.has_magnet { 4 } else { 3 };
                    }
                    for k in 0..count + threes {
                        if k >= count && index < program.acts_from[k - count] {
                            continue;
                        }
                        let (by, three) = numbered(k, count, index, parameters, &mut own, columns);
                        match steady {
                            true => step_columns::<L, T, true>(&step, room, by, three),
                            false => step_columns::<L, T, false>(&step, room, by, three),
                        }
                    }
                    if with_transfers && ((k + 1) % joined == 0 || k + 1 == steps) {
                        let interval = if flexible.has_magnet { Interval::Magnetised } else { Interval::Free };
                        push(transfers, (&mut pose, &mut load), &own, state.m, interval);
                    }
                    if what == Carried::Watched
                        && let Some(wall) = wall
                    {
                        let course = |share, state: &State<L>| bent(terms, space, flexible, share, state);
                        wall.watch_step(&course(start, &before), &course(start + share, &state), span, PLACES);
                    }
                    if matches!(what, Carried::State | Carried::Watched) {
                        continue;
                    }
                    let middle = midway(&before, &state, span);
                    travelled = travelled + length(state.p - before.p);
                    let clearance = space.clearance(before.p, middle).min(space.clearance(middle, state.p));
                    leeway = leeway.min(clearance / travelled);
                }
                if what == Carried::Place {
                    moments.push((state.p, state.m));
                }
                for (parameters, three) in parameters.iter().zip(columns.iter_mut()).take(threes) {
                    lengthen(space, &problem, flexible, &state, &parameters.sources.segments[index].dL, three);
                }
            }
            Segment::Rigid(rigid) => {
                let force_arm = program.rigid_force_arm;
                let crossing = Crossing { space, segment: rigid, lambda, points, force_arm, before: state };
                let (after, mut begin, mut count) = (crossing.cross(), 0, if what.has_base() { 2 } else { 0 });
                if with_transfers {
                    own = interval_columns(state.m);
                    // Columns by the load need no crossing: it turns nothing.
                    if force_arm {
                        own[0].dm = hat(after.p - state.p) * lambda.constant(-1.0);
                    }
                    (begin, count) = (2, 4);
                }
                if count + threes > 0 {
                    acting.load(&crossing, threes > 0);
                }
                for k in begin..count + threes {
                    if k >= count && index < program.acts_from[k - count] {
                        continue;
                    }
                    let (by, three) = numbered(k, count, index, parameters, &mut own, columns);
                    crossing.cross_columns(&after, acting, by, three);
                }
                if with_transfers {
                    push(transfers, (&mut pose, &mut load), &own, after.m, Interval::Rigid);
                }
                let before = std::mem::replace(&mut state, after);
                if what == Carried::Watched
                    && let Some(wall) = wall
                {
                    wall.watch_step(&straight(&before), &straight(&state), rigid.length, RIGID_PLACES);
                }
                if matches!(what, Carried::State | Carried::Watched) {
                    continue;
                }
                if rigid.has_dipole {
                    inside = space.inside(state.p, space.inside(before.p, inside));
                }
                travelled = travelled + length(state.p - before.p);
                leeway = leeway.min(space.clearance(before.p, state.p) / travelled);
            }
        }
    }
    workspace.tip = state;
    if matches!(what, Carried::State | Carried::Watched) {
        return;
    }
    // A rod that is nowhere is near to nothing.
    leeway = leeway * travelled;
    (workspace.leeway, workspace.inside) = (L::select(leeway.is_finite(), leeway, far), inside);
    if what == Carried::Place {
        return;
    }
    let mut matrix = residual(&pose, &load, state.m);
    if what.has_base() {
        for (at, three) in [(0, &own[0]), (3, &own[1])] {
            pose.put(at, &three.dp, &three.w);
            matrix.put(at, &three.dn, &three.dm);
        }
    }
    (workspace.pose, workspace.matrix) = (pose, matrix);
}

/// Adds an interval with moment `m` at its end.
#[inline(always)]
fn push<L: Lane>(
    transfers: &mut Vec<Transfer<L>>,
    (pose, load): (&mut Mat6<L>, &mut Mat6<L>),
    [by_n, by_m, by_w, by_p]: &[Columns<L>; 4],
    m: Vec3<L>,
    interval: Interval,
) {
    let none = Mat6::zero(m.x);
    let (mut a, mut b, mut c, mut d) = (none, none, none, none);
    for (at, by) in [(0, by_p), (3, by_w)] {
        a.put(at, &by.dp, &by.w);
        c.put(at, &by.dn, &canonical(by, m));
    }
    for (at, by) in [(0, by_n), (3, by_m)] {
        b.put(at, &by.dp, &by.w);
        d.put(at, &by.dn, &canonical(by, m));
    }
    let transfer = Transfer { a, b, c, d, interval };
    (*pose, *load) = if transfers.is_empty() { (b, d) } else { transfer.beyond(pose, load) };
    transfers.push(transfer);
}
