//! Every derivative from nine columns: rows of the Jacobian by reciprocity. J5 and the table of model loads.

use super::algebra::{Mat3, Vec3, axpy, columns_cross_sub, cross, inverse, row_times, transpose};
use super::column::Columns;
use super::lane::Lane;
use super::program::Program;
use super::rod::{Rod, Segment, Terms, curvature};
use super::shoot::{Tip, Workspace, tip_moment_columns};
use crate::model::{ROWS, Slot};

/// A linear functional of the three threes of columns: by base moment, by base rotation, by tip force.
#[derive(Clone, Copy)]
struct Functional<L> {
    by_moment: Vec3<L>,
    by_rotation: Vec3<L>,
    by_force: Vec3<L>,
}

/// How the columns combine to the responses to a unit tip force, a unit tip moment and a unit base rotation.
pub struct Responses<L> {
    force: Mat3<L>,
    moment: Mat3<L>,
    rotation: Mat3<L>,
    /// dm0 by base rotation, less its canonical part.
    base_rotation: Mat3<L>,
}

impl<L: Lane> Responses<L> {
    /// Solves the (adjoint) tip condition dm(L) - w(L) x l_tip = unit for each load. J5
    #[inline(always)]
    pub fn new<T: Terms>(rod: &Rod<L>, tip: &Tip<L>, columns: &[Columns<L>; 3]) -> Self {
        let dm = |k: usize| tip_moment_columns::<L, T>(tip, &columns[k]);
        let adjoint = |k: usize| columns_cross_sub(columns[k].w, rod.l_tip, dm(k));
        let moment = inverse(adjoint(0));
        Self {
            force: -(moment * adjoint(2)),
            rotation: -(moment * adjoint(1)),
            moment,
            base_rotation: -(inverse(dm(0)) * dm(1)),
        }
    }

    /// Rows of a parameter whose load columns have functional `q`: tip position, tip rotation, base moment.
    #[inline(always)]
    fn rows(&self, q: &Functional<L>) -> [Vec3<L>; 3] {
        [
            q.by_force + row_times(q.by_moment, self.force),
            row_times(q.by_moment, self.moment),
            q.by_rotation + row_times(q.by_moment, self.rotation),
        ]
    }

    /// Rows of a virtual rotation of the base about a world axis given by its components.
    #[inline(always)]
    fn base_rotation_rows(&self, m0: Vec3<L>, axis: Vec3<L>) -> [Vec3<L>; 3] {
        let half = m0.x.constant(0.5);
        let canonical = cross(axis, m0) * half;
        [transpose(self.force) * axis, transpose(self.moment) * axis, canonical + self.base_rotation * axis]
    }
}

/// Writes the rows of every derivative: `ROWS` columns each, through `store(column, value)`.
#[inline(always)]
pub fn write_rows<L: Lane, T: Terms>(
    program: &Program,
    rod: &Rod<L>,
    m0: Vec3<L>,
    n0: Vec3<L>,
    columns: &[Columns<L>; 3],
    responses: &Responses<L>,
    workspace: &Workspace<L>,
    coefficient: impl Fn(usize) -> L,
    mut store: impl FnMut(usize, L),
) {
    let zero = Vec3::splat(m0.x.constant(0.0));
    for (index, terms) in program.derivatives.iter().enumerate() {
        let mut sum = Functional { by_moment: zero, by_rotation: zero, by_force: zero };
        let mut extra = [zero; 3];
        for (slot, entry) in terms {
            let rate = coefficient(*entry);
            let unit = |axis: usize| {
                let mut v = [rate.constant(0.0); 3];
                v[axis] = rate;
                Vec3 { x: v[0], y: v[1], z: v[2] }
            };
            match *slot {
                Slot::BasePosition(axis) => extra[0] = extra[0] + unit(axis.index()),
                Slot::BaseRotation(axis) => add(&mut extra, responses.base_rotation_rows(m0, unit(axis.index()))),
                Slot::Insertion => add(&mut extra, insertion_rows::<L, T>(rod, m0, n0, responses, rate)),
                _ => accumulate(*slot, rate, rod, columns, workspace, &mut sum),
            }
        }
        add(&mut extra, responses.rows(&sum));
        for (k, row) in extra.into_iter().enumerate() {
            let at = ROWS * index + 3 * k;
            store(at, row.x);
            store(at + 1, row.y);
            store(at + 2, row.z);
        }
    }
}

#[inline(always)]
fn add<L: Lane>(sum: &mut [Vec3<L>; 3], rows: [Vec3<L>; 3]) {
    for (sum, row) in sum.iter_mut().zip(rows) {
        *sum = *sum + row;
    }
}

/// More rod past the entry: the base is displaced by t and rotated by R0 u(0); the moment is that at the new base.
#[inline(always)]
fn insertion_rows<L: Lane, T: Terms>(
    rod: &Rod<L>,
    m0: Vec3<L>,
    n0: Vec3<L>,
    responses: &Responses<L>,
    rate: L,
) -> [Vec3<L>; 3] {
    let Segment::Flexible(first) = &rod.segments[0] else { return [Vec3::splat(rate.constant(0.0)); 3] };
    let d2 = cross(rod.t, rod.d1);
    let omega = curvature::<L, T>(first, rod.d1, d2, rod.t, m0);
    let mut rows = responses.base_rotation_rows(m0, omega * rate);
    rows[0] = axpy(rate, rod.t, rows[0]);
    if T::FORCE {
        rows[2] = axpy(rate, cross(rod.t, n0), rows[2]);
    }
    rows
}

/// Adds `rate` times the functional of a slot.
#[inline(always)]
fn accumulate<L: Lane>(
    slot: Slot,
    rate: L,
    rod: &Rod<L>,
    columns: &[Columns<L>; 3],
    workspace: &Workspace<L>,
    sum: &mut Functional<L>,
) {
    let row = |k: usize| -> Vec3<L> {
        match slot {
            Slot::TipForce(axis) => component(transpose(columns[k].dp), axis.index()),
            Slot::TipMoment(axis) => component(transpose(columns[k].w), axis.index()),
            Slot::FluxDensity(axis) => {
                let mut total = Vec3::splat(rate.constant(0.0));
                for trace in &workspace.traces {
                    total = total + trace[k].field[axis.index()];
                }
                total
            }
            Slot::Length(segment) => workspace.traces[segment][k].length,
            Slot::RestCurvature(segment, axis) => workspace.traces[segment][k].rest_curvature[axis.index()],
            Slot::Stiffness(segment, axis) => {
                let Segment::Flexible(flexible) = &rod.segments[segment] else {
                    return Vec3::splat(rate.constant(0.0));
                };
                let k_inverse = [flexible.compliance.x, flexible.compliance.y, flexible.compliance.z][axis.index()];
                workspace.traces[segment][k].stiffness[axis.index()] * -(k_inverse * k_inverse)
            }
            Slot::Dipole(segment, axis) => workspace.traces[segment][k].dipole[axis.index()],
            Slot::Load(segment, axis) => workspace.traces[segment][k].load[axis.index()],
            Slot::BasePosition(_) | Slot::BaseRotation(_) | Slot::Insertion => Vec3::splat(rate.constant(0.0)),
        }
    };
    sum.by_moment = axpy(rate, row(0), sum.by_moment);
    sum.by_rotation = axpy(rate, row(1), sum.by_rotation);
    sum.by_force = axpy(rate, row(2), sum.by_force);
}

#[inline(always)]
fn component<L: Lane>(rows: Mat3<L>, axis: usize) -> Vec3<L> {
    [rows.x, rows.y, rows.z][axis]
}
