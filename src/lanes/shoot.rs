//! One pass over the rod, base to tip, from a base moment: state, columns, and what they leave behind.

use super::algebra::{Mat3, Vec3, axpy, cross, hat};
use super::column::{Columns, Trace, collect_coil, column_moment, cross_rigid_columns, length_row, step_columns};
use super::lane::Lane;
use super::program::{Program, Resolution};
use super::rod::{Rod, Segment, State, Terms, cross_rigid, curvature, moment};
use super::step::{Stages, step_rod};
use pulp::{Simd, WithSimd};
use std::marker::PhantomData;

/// Memory of a kernel, reused from group to group.
pub struct Workspace<L> {
    pub stages: Stages<L>,
    /// For each segment, one trace for each three columns.
    pub traces: Vec<[Trace<L>; 3]>,
    /// w of the first two threes (base moment, base rotation) at the ends of the steps.
    pub stations: Vec<[Mat3<L>; 2]>,
}

impl<L: Lane> Workspace<L> {
    pub fn new(token: L::Token, program: &Program) -> Self {
        let zero = Trace::zero(L::splat(token, 0.0));
        Self {
            stages: Stages::new(token, program.fine.tableau),
            traces: vec![[zero; 3]; program.segments.len()],
            stations: Vec::new(),
        }
    }
}

/// The distal end of the rod after a pass.
#[derive(Clone, Copy, Debug)]
pub struct Tip<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub m: Vec3<L>,
    pub n: Vec3<L>,
}

/// Three columns at the base: by the base moment.
#[inline(always)]
pub fn moment_columns<L: Lane>(one: L) -> Columns<L> {
    let zero = zero_matrix(one);
    Columns { w: zero, dp: zero, dM: identity(one), unit_force: false }
}

/// Three columns at the base: by a virtual rotation of the base, in canonical form (dm = w x m0 / 2).
#[inline(always)]
pub fn rotation_columns<L: Lane>(m0: Vec3<L>) -> Columns<L> {
    let half = m0.x.constant(0.5);
    Columns { w: identity(half), dp: zero_matrix(half), dM: hat(m0) * -half, unit_force: false }
}

/// Three columns at the base: by the tip force.
#[inline(always)]
pub fn force_columns<L: Lane>(one: L) -> Columns<L> {
    let zero = zero_matrix(one);
    Columns { w: zero, dp: zero, dM: zero, unit_force: true }
}

#[inline(always)]
fn identity<L: Lane>(of: L) -> Mat3<L> {
    let (o, i) = (of.constant(0.0), of.constant(1.0));
    Mat3 { x: Vec3 { x: i, y: o, z: o }, y: Vec3 { x: o, y: i, z: o }, z: Vec3 { x: o, y: o, z: i } }
}

#[inline(always)]
fn zero_matrix<L: Lane>(of: L) -> Mat3<L> {
    let zero = Vec3::splat(of.constant(0.0));
    Mat3 { x: zero, y: zero, z: zero }
}

/// Integrates the rod from base moment `m0` at load fraction `lambda`, `columns` with it.
///
/// With `record` set the columns leave traces and stations in the workspace.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub fn shoot<L: Lane, T: Terms>(
    program: &Program,
    resolution: &Resolution,
    rod: &Rod<L>,
    lambda: L,
    m0: Vec3<L>,
    columns: &mut [Columns<L>],
    record: bool,
    workspace: &mut Workspace<L>,
) -> Tip<L> {
    let pass = Pass { program, resolution, rod, lambda, m0, columns, record, workspace, terms: PhantomData::<T> };
    L::vectorize(lambda.token(), pass)
}

/// The arguments of [`shoot`]: one compiled function however often it is called.
struct Pass<'a, L: Lane, T: Terms> {
    program: &'a Program,
    resolution: &'a Resolution,
    rod: &'a Rod<L>,
    lambda: L,
    m0: Vec3<L>,
    columns: &'a mut [Columns<L>],
    record: bool,
    workspace: &'a mut Workspace<L>,
    terms: PhantomData<T>,
}

impl<L: Lane, T: Terms> WithSimd for Pass<'_, L, T> {
    type Output = Tip<L>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Tip<L> {
        integrate::<L, T>(self)
    }
}

#[inline(always)]
fn integrate<L: Lane, T: Terms>(pass: Pass<'_, L, T>) -> Tip<L> {
    let Pass { program, resolution, rod, lambda, m0, columns, record, workspace, .. } = pass;
    let zero = lambda.constant(0.0);
    let mut state = State { p: Vec3::splat(zero), d1: rod.d1, t: rod.t, M: m0 };
    let mut n = rod.base_force::<T>() * lambda;
    if record {
        workspace.stations.clear();
        workspace.stations.push([columns[0].w, columns[1].w]);
    }
    for (index, segment) in rod.segments.iter().enumerate() {
        let collect = program.collect[index];
        if record {
            workspace.traces[index] = [Trace::zero(zero); 3];
        }
        match segment {
            Segment::Flexible(flexible) => {
                let steps = resolution.steps[index];
                if steps == 0 {
                    continue;
                }
                let h = flexible.length * zero.constant(1.0 / steps as f64);
                let stages = &mut workspace.stages;
                stages.set_step(resolution.tableau, h);
                let integrates = record && (collect.rest_curvature || collect.stiffness || collect.load);
                for _ in 0..steps {
                    step_rod::<L, T>(flexible, lambda, h, n, stages, &mut state);
                    for (k, three) in columns.iter_mut().enumerate() {
                        let trace = if integrates { Some(&mut workspace.traces[index][k]) } else { None };
                        step_columns::<L, T>(flexible, lambda, stages, trace, collect, three);
                    }
                    if T::LOAD {
                        n = axpy(-h * lambda, flexible.w, n); // R1
                    }
                    if record {
                        workspace.stations.push([columns[0].w, columns[1].w]);
                    }
                }
                if record {
                    let m = moment::<L, T>(state.p, state.M, n);
                    let d2 = cross(state.t, state.d1);
                    let omega = curvature::<L, T>(flexible, state.d1, d2, state.t, m);
                    for (three, trace) in columns.iter().zip(&mut workspace.traces[index]) {
                        trace.length = length_row::<L, T>(&state, m, n, flexible.w, Some(omega), three);
                    }
                }
            }
            Segment::Rigid(rigid) => {
                for (k, three) in columns.iter_mut().enumerate() {
                    if record {
                        collect_coil(rod, rigid, lambda, &state, three, &mut workspace.traces[index][k]);
                    }
                    cross_rigid_columns::<L, T>(rod, rigid, lambda, program.rigid_force_arm, n, &state, three);
                    if record && collect.load {
                        collect_rigid_load(rigid.length, state.t, three, &mut workspace.traces[index][k]);
                    }
                }
                cross_rigid::<L, T>(rod, rigid, lambda, program.rigid_force_arm, &mut n, &mut state);
                if record {
                    let m = moment::<L, T>(state.p, state.M, n);
                    for (three, trace) in columns.iter().zip(&mut workspace.traces[index]) {
                        trace.length = length_row::<L, T>(&state, m, n, rigid.w, None, three);
                    }
                }
            }
        }
    }
    Tip { p: state.p, d1: state.d1, t: state.t, m: moment::<L, T>(state.p, state.M, n), n }
}

/// Integral of dp over a rigid segment, from the columns at its distal end.
#[inline(always)]
fn collect_rigid_load<L: Lane>(length: L, t: Vec3<L>, columns: &Columns<L>, trace: &mut Trace<L>) {
    let half = length * length.constant(0.5);
    let middle = super::algebra::columns_axpy(-half, super::algebra::columns_cross(columns.w, t), columns.dp);
    let rows = super::algebra::transpose(middle * length);
    trace.load = [rows.x, rows.y, rows.z];
}

/// dm of three columns at the tip.
#[inline(always)]
pub fn tip_moment_columns<L: Lane, T: Terms>(tip: &Tip<L>, columns: &Columns<L>) -> Mat3<L> {
    column_moment::<L, T>(columns.unit_force, tip.p, tip.n, columns.dp, columns.dM)
}
