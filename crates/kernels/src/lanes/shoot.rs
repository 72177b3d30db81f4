//! One pass over the rod, base to tip, from a base moment: state, columns, and what they leave behind.

use super::algebra::{Mat3, Vec3, axpy, cross, cross_sub};
use super::column::{By, Columns, cross_free_columns, cross_rigid_columns, step_columns};
use super::lane::Lane;
use super::program::{Program, Resolution};
use super::rod::{Rod, Segment, State, Terms, cross_free, cross_rigid, moment};
use super::section::{Flexible, curvature, to_world, velocity};
use super::source::{Source, Sources};
use super::stability::{Station, add_station};
use super::step::{Stages, Step, step_rod};
use super::trace::{Trace, collect_rigid, length_row, set_strains};
use crate::model::path::SHORTEST_INTERVAL;
use pulp::{Simd, WithSimd};
use std::marker::PhantomData;

/// Memory of a kernel, reused from group to group.
pub struct Workspace<L> {
    pub stages: Stages<L>,
    /// For each segment, one trace for each three columns.
    pub traces: Vec<[Trace<L>; 3]>,
    /// The last interval of the stability index.
    pub station: Station<L>,
    /// Of the forward columns, three parameters each.
    pub sources: Vec<Sources<L>>,
    /// All columns of a pass with derivatives.
    pub columns: Vec<Columns<L>>,
}

impl<L: Lane> Workspace<L> {
    pub fn new(token: L::Token, program: &Program) -> Self {
        let zero = Trace::zero(L::splat(token, 0.0));
        Self {
            stages: Stages::new(token, program.fine.tableau),
            traces: vec![[zero; 3]; program.all_segments],
            station: Station::new(L::splat(token, 0.0)),
            sources: (0..program.forward_threes()).map(|_| Sources::new(token)).collect(),
            columns: Vec::new(),
        }
    }
}

/// What a pass leaves in the workspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Record {
    Nothing,
    /// The stations of the stability index.
    Stability,
    /// The same, and the traces of the columns.
    Traces,
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

impl<L: Lane> Tip<L> {
    #[inline(always)]
    pub fn select(mask: L::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            p: Vec3::select(mask, if_true.p, if_false.p),
            d1: Vec3::select(mask, if_true.d1, if_false.d1),
            t: Vec3::select(mask, if_true.t, if_false.t),
            m: Vec3::select(mask, if_true.m, if_false.m),
            n: Vec3::select(mask, if_true.n, if_false.n),
        }
    }
}

/// Integrates the rod from base moment `m0` at load fraction `lambda`, `columns` with it.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub fn shoot<L: Lane, T: Terms>(
    program: &Program,
    resolution: &Resolution,
    rod: &Rod<L>,
    lambda: L,
    m0: Vec3<L>,
    columns: &mut [Columns<L>],
    record: Record,
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
    record: Record,
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
    let mut s = zero;
    let shortest = rod.flexible_length() * zero.constant(SHORTEST_INTERVAL);
    let (counts, traces) = (record != Record::Nothing, record == Record::Traces);
    if counts {
        workspace.station = Station::new(zero);
    }
    for (index, segment) in rod.segments.iter().enumerate() {
        let collect = program.collect[index];
        if traces && collect.any() {
            workspace.traces[index].iter_mut().for_each(|trace| trace.clear(collect, zero));
        }
        match segment {
            Segment::Flexible(flexible) => {
                let steps = resolution.steps[index];
                let share = 1.0 / steps.max(1) as f64;
                let h = flexible.length * zero.constant(share);
                let stages = &mut workspace.stages;
                stages.set_step(resolution.tableau, h);
                for k in 0..steps {
                    let step = Step { h, start: k as f64 * share, share, n };
                    step_rod::<L, T>(rod, flexible, lambda, &step, stages, &mut state);
                    if traces && collect.stiffness {
                        set_strains::<L, T>(flexible, stages);
                    }
                    for (k, three) in columns.iter_mut().enumerate() {
                        let trace = match traces && collect.integrals() {
                            true => workspace.traces[index].get_mut(k),
                            false => None,
                        };
                        let source = forward_source::<L, T>(&workspace.sources, three.by, k, index);
                        step_columns::<L, T>(rod, flexible, lambda, &step, stages, trace, collect, source, three);
                    }
                    if T::LOAD {
                        n = axpy(-h * lambda, flexible.w, n); // R1
                    }
                    if counts {
                        s = s + h;
                        let end = tip_of::<L, T>(&state, n);
                        add_station::<L, T>(&mut workspace.station, shortest, s, &end, columns);
                    }
                }
                if traces && (collect.length || !workspace.sources.is_empty()) {
                    end_flexible::<L, T>(rod, flexible, index, &state, n, collect.length, columns, workspace);
                }
            }
            Segment::Rigid(rigid) => {
                let before = state;
                let n_before = n;
                cross_rigid::<L, T>(rod, rigid, lambda, program.rigid_force_arm, &mut n, &mut state);
                for (k, three) in columns.iter_mut().enumerate() {
                    let trace = if traces && collect.any() { workspace.traces[index].get_mut(k) } else { None };
                    if let Some(trace) = trace {
                        collect_rigid::<L, T>(rod, rigid, &before, n, three, trace);
                    }
                    let source = forward_source::<L, T>(&workspace.sources, three.by, k, index);
                    cross_rigid_columns::<L, T>(
                        rod,
                        rigid,
                        lambda,
                        program.rigid_force_arm,
                        n_before,
                        &before,
                        source,
                        three,
                    );
                }
            }
        }
    }
    if let Some(free) = &rod.free {
        let before = state;
        cross_free(free, &mut state);
        for three in columns.iter_mut() {
            cross_free_columns(&before, state.p, three);
        }
    }
    tip_of::<L, T>(&state, n)
}

#[inline(always)]
fn tip_of<L: Lane, T: Terms>(state: &State<L>, n: Vec3<L>) -> Tip<L> {
    Tip { p: state.p, d1: state.d1, t: state.t, m: moment::<L, T>(state.p, state.M, n), n }
}

/// The source on a segment of three columns, number `k`: forward columns follow those by base moment.
#[inline(always)]
fn forward_source<L, T: Terms>(sources: &[Sources<L>], by: By, k: usize, index: usize) -> Option<&Source<L>> {
    if T::GENERAL && by == By::Parameters { Some(&sources[k - 1].segments[index]) } else { None }
}

/// What a length does at the distal end of a flexible segment: its row by reciprocity, or to forward columns.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn end_flexible<L: Lane, T: Terms>(
    rod: &Rod<L>,
    segment: &Flexible<L>,
    index: usize,
    state: &State<L>,
    n: Vec3<L>,
    collect: bool,
    columns: &mut [Columns<L>],
    workspace: &mut Workspace<L>,
) {
    let m = moment::<L, T>(state.p, state.M, n);
    let d2 = cross(state.t, state.d1);
    let omega = curvature::<L, T>(&segment.section::<T>(1.0), state.d1, d2, state.t, m);
    let v = velocity::<L, T>(segment, state.d1, d2, state.t, n);
    for (k, three) in columns.iter_mut().enumerate() {
        if collect && k < 3 {
            let row = length_row::<L, T>(rod, segment, state, (m, n), (omega, v), three);
            workspace.traces[index][k].length = row;
        }
        if let Some(source) = forward_source::<L, T>(&workspace.sources, three.by, k, index) {
            let mut slope = -cross(state.p, segment.w);
            if T::GENERAL && segment.has_magnet {
                slope = cross_sub(to_world(state.d1, d2, state.t, segment.mu), rod.B, slope);
            }
            source.lengthen(segment, (omega, v, slope), three);
        }
    }
}

/// dm of three columns at the tip.
#[inline(always)]
pub fn tip_moment_columns<L: Lane, T: Terms>(tip: &Tip<L>, columns: &Columns<L>) -> Mat3<L> {
    columns.moment::<T>(tip.p, tip.n)
}
