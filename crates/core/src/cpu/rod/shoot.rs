//! One pass over the rod, base to tip, from a base moment: state, columns, and what they leave behind.

use super::column::{cross_free_columns, cross_rigid_columns, step_columns};
use super::columns::{By, Columns};
use super::problem::{Pass, Problem, Record, Tip, Workspace};
use super::section::{curvature, to_world, velocity};
use super::segments::{Crossing, Segment, State, cross_free, cross_rigid, moment};
use super::source::{Source, Sources};
use super::stability::{add_doubt, add_station, by_rotation};
use super::station::Station;
use super::step::{Step, step_rod};
use super::terms::Terms;
use super::trace::{collect_rigid, length_row, set_strains};
use crate::cpu::algebra::{Mat3, Vec3, axpy, cross, cross_sub, length};
use crate::cpu::rod::single_sample::{Beside, take_columns, take_integrals};
use crate::cpu::simd::lane::Lane;
use crate::model::step_at;
use crate::model::tolerances::{SHORTEST_INTERVAL, UNBUCKLED, UNBUCKLED_BETWEEN};
use pulp::{Simd, WithSimd};

/// A pass and the terms that it is compiled for.
pub struct WithTerms<'a, L: Lane, T>(pub Pass<'a, L>, pub T);

impl<L: Lane, T: Terms> WithSimd for WithTerms<'_, L, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let WithTerms(pass, terms) = self;
        let Pass { columns, workspace, .. } = pass;
        workspace.tip = integrate(Pass { columns, workspace: &mut *workspace, ..pass }, terms);
    }
}

#[inline(always)]
fn integrate<L: Lane>(pass: Pass<'_, L>, terms: impl Terms) -> Tip<L> {
    let Pass { problem, resolution, lambda, m0, columns, record, workspace } = pass;
    let Problem { program, rod, .. } = problem;
    let zero = lambda.constant(0.0);
    let mut state = State { p: Vec3::splat(zero), d1: rod.d1, t: rod.t, M: m0 };
    let mut n = rod.base_force(terms) * lambda;
    let mut s = zero;
    let shortest = rod.flexible_length() * zero.constant(SHORTEST_INTERVAL);
    let (counts, traces) = (matches!(record, Record::Stability | Record::Traces), record == Record::Traces);
    let moments = record == Record::Moments;
    workspace.moments.clear();
    let alone = counts && by_rotation(columns).is_none();
    let beside = Beside::new(workspace.alone, zero);
    if counts {
        workspace.station = Station::new(zero);
    }
    for (at, segment) in rod.segments.iter().enumerate() {
        let index = rod.first + at;
        let collect = program.collect[index];
        if traces && collect.any() {
            workspace.traces[index].iter_mut().for_each(|trace| trace.clear(collect, zero));
        }
        match segment {
            Segment::Flexible(flexible) => {
                if moments {
                    workspace.moments.push(moment(terms, state.p, state.M, n));
                }
                let (steps, ratio) = (resolution.steps[index], resolution.ratio(terms, index));
                let (start, share) = step_at(ratio, if ratio > 1.0 { steps.max(1) - 1 } else { 0 }, steps);
                let h = flexible.length * zero.constant(share);
                workspace.stages.set_step(resolution.tableau, h);
                if counts {
                    let most = if alone { UNBUCKLED } else { UNBUCKLED_BETWEEN };
                    let end = axpy(-(flexible.length * lambda), flexible.w, n);
                    let n = length(n).max(length(end));
                    add_doubt(terms, &mut workspace.station, rod, flexible, h, n, most);
                }
                let turns = if beside.is_some() { 1 } else { 3 };
                let mut step = Step { terms, rod, segment: flexible, lambda, h, start, share, n, turns };
                for k in 0..steps {
                    ((step.start, step.share), step.n) = (step_at(ratio, k, steps), n);
                    let stages = &mut workspace.stages;
                    if ratio != 1.0 {
                        step.h = flexible.length * zero.constant(step.share);
                        stages.set_step(resolution.tableau, step.h);
                    }
                    step_rod(&step, stages, &mut state);
                    if traces && collect.stiffness {
                        set_strains(terms, flexible, stages);
                    }
                    for (k, three) in columns.iter_mut().enumerate() {
                        let trace = match traces && collect.integrals() {
                            true => workspace.traces[index].get_mut(k),
                            false => None,
                        };
                        let put;
                        let mut source = forward_source(terms, &workspace.sources, three.by, k, index);
                        if let Some(beside) = beside {
                            beside.put_columns(three);
                            if let Some(own) = source {
                                put = beside.put_source(own);
                                source = Some(&put);
                            }
                        }
                        step_columns(&step, stages, trace, collect, source, three);
                        if beside.is_some() {
                            take_columns(three);
                        }
                    }
                    if terms.load() {
                        n = axpy(-step.h * lambda, flexible.w, n); // R1
                    }
                    if counts {
                        s = s + step.h;
                        let end = tip_of(terms, &state, n);
                        add_station(terms, &mut workspace.station, shortest, s, &end, columns);
                    }
                }
                if moments {
                    workspace.moments.push(moment(terms, state.p, state.M, n));
                }
                if traces && beside.is_some() {
                    for trace in &mut workspace.traces[index] {
                        take_integrals(collect, trace);
                    }
                }
                if traces && (collect.length || !workspace.sources.is_empty()) {
                    step.n = n;
                    end_flexible(&step, index, &state, collect.length, columns, workspace);
                }
            }
            Segment::Rigid(rigid) => {
                let (before, n_before) = (state, n);
                let force_arm = program.rigid_force_arm;
                let crossing = Crossing { terms, rod, segment: rigid, lambda, force_arm };
                cross_rigid(&crossing, &mut n, &mut state);
                for (k, three) in columns.iter_mut().enumerate() {
                    let trace = if traces && collect.any() { workspace.traces[index].get_mut(k) } else { None };
                    if let Some(trace) = trace {
                        collect_rigid(&crossing, &before, n, three, trace);
                    }
                    let source = forward_source(terms, &workspace.sources, three.by, k, index);
                    cross_rigid_columns(&crossing, n_before, &before, source, three);
                }
                if alone {
                    // A coil may make A negative, and the step beyond it positive again.
                    add_station(terms, &mut workspace.station, shortest, s, &tip_of(terms, &state, n), columns);
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
    tip_of(terms, &state, n)
}

#[inline(always)]
fn tip_of<L: Lane>(terms: impl Terms, state: &State<L>, n: Vec3<L>) -> Tip<L> {
    Tip { p: state.p, d1: state.d1, t: state.t, m: moment(terms, state.p, state.M, n), n }
}

/// The source on a segment of three columns, number `k`: forward columns follow those by base moment.
#[inline(always)]
fn forward_source<L>(terms: impl Terms, sources: &[Sources<L>], by: By, k: usize, index: usize) -> Option<&Source<L>> {
    if terms.general() && by == By::Parameters { Some(&sources[k - 1].segments[index]) } else { None }
}

/// What a length does at the distal end of a flexible segment: its row by reciprocity, or to forward columns.
#[inline(always)]
fn end_flexible<L: Lane, T: Terms>(
    step: &Step<'_, L, T>,
    index: usize,
    state: &State<L>,
    collect: bool,
    columns: &mut [Columns<L>],
    workspace: &mut Workspace<L>,
) {
    let Step { terms, rod, segment, n, .. } = *step;
    let m = moment(terms, state.p, state.M, n);
    let d2 = cross(state.t, state.d1);
    let omega = curvature(terms, &segment.section(terms, 1.0), state.d1, d2, state.t, m);
    let v = velocity(terms, segment, state.d1, d2, state.t, n);
    for (k, three) in columns.iter_mut().enumerate() {
        if collect && k < 3 {
            let row = length_row(terms, rod, segment, state, (m, n), (omega, v), three);
            workspace.traces[index][k].length = row;
        }
        if let Some(source) = forward_source(terms, &workspace.sources, three.by, k, index) {
            let mut slope = -cross(state.p, segment.w);
            if terms.general() && segment.has_magnet {
                slope = cross_sub(to_world(state.d1, d2, state.t, segment.mu), rod.B, slope);
            }
            source.lengthen(segment, (omega, v, slope), three);
        }
    }
}

/// dm of three columns at the tip.
#[inline(always)]
pub fn tip_moment_columns<L: Lane>(terms: impl Terms, tip: &Tip<L>, columns: &Columns<L>) -> Mat3<L> {
    columns.moment(terms, tip.p, tip.n)
}
