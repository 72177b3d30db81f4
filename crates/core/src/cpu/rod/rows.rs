//! Every derivative from six columns, nine with those of the base moment: rows of the Jacobian by reciprocity. J5 and
//! the table of model loads.

use super::base::base_slope;
use super::columns::Columns;
use super::problem::{Problem, Tip, Workspace};
use super::program::{Outputs, Program};
use super::segments::Rod;
use super::shoot::tip_moment_columns;
use super::stability::by_rotation;
use super::terms::Terms;
use crate::cpu::algebra::{Mat3, Vec3, axpy, columns_cross_sub, cross, inverse, outer, row_times, transpose};
use crate::cpu::simd::lane::Lane;
use crate::model::{Axis, Quantity, Slot};

/// A linear functional of the threes of columns: by base moment, by tip force, by base rotation.
#[derive(Clone, Copy)]
struct Functional<L> {
    by_moment: Vec3<L>,
    by_force: Vec3<L>,
    by_rotation: Vec3<L>,
}

/// How the columns combine to the responses to a unit tip force, a unit tip moment and a unit base rotation; of the
/// last, zero where the base moment is not differentiated.
pub struct Responses<L> {
    pub force: Mat3<L>,
    pub moment: Mat3<L>,
    pub rotation: Mat3<L>,
    /// The base moments of the first two.
    pub base: [Mat3<L>; 2],
    /// dm0 by base rotation, less its canonical part.
    pub base_rotation: Mat3<L>,
}

impl<L: Lane> Responses<L> {
    /// Solves the (adjoint) tip condition dm(L) - w(L) x l_tip = unit for each load. J5
    #[inline(always)]
    pub fn new(terms: impl Terms, rod: &Rod<L>, tip: &Tip<L>, columns: &[Columns<L>]) -> Self {
        let (by_moment, by_force) = (&columns[0], &columns[1]);
        let dm_moment = tip_moment_columns(terms, tip, by_moment);
        let dm_force = tip_moment_columns(terms, tip, by_force);
        let moment = inverse(columns_cross_sub(by_moment.w, rod.l_tip, dm_moment));
        let force = -(moment * columns_cross_sub(by_force.w, rod.l_tip, dm_force));
        let (mut rotation, mut base_rotation) = (Mat3::zero(tip.m.x), Mat3::zero(tip.m.x));
        if let Some(by_rotation) = by_rotation(columns) {
            let dm_rotation = tip_moment_columns(terms, tip, by_rotation);
            rotation = -(moment * columns_cross_sub(by_rotation.w, rod.l_tip, dm_rotation));
            base_rotation = -(inverse(dm_moment) * dm_rotation);
        }
        Self { force, moment, rotation, base: [force, moment], base_rotation }
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
        [transpose(self.base[0]) * axis, transpose(self.base[1]) * axis, canonical + self.base_rotation * axis]
    }
}

/// Writes the rows of every derivative.
#[inline(always)]
pub fn write_rows<L: Lane>(
    problem: &Problem<'_, L>,
    m0: Vec3<L>,
    columns: &[Columns<L>],
    responses: &Responses<L>,
    workspace: &Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, inputs, rod } = *problem;
    let token = problem.token();
    let zero = Vec3::splat(m0.x.constant(0.0));
    for (index, terms) in program.derivatives.iter().enumerate() {
        let mut sum = Functional { by_moment: zero, by_force: zero, by_rotation: zero };
        let mut extra = [zero; 3];
        for (slot, entry) in terms {
            let rate: L = program.entry(token, &inputs, *entry);
            match *slot {
                Slot::BasePosition(axis) => extra[0] = extra[0] + along(axis, rate),
                Slot::BaseRotation(axis) => {
                    extra = add(extra, responses.base_rotation_rows(m0, along(axis, rate)));
                }
                Slot::Insertion => extra = add(extra, insertion_rows(program.terms, rod, m0, responses, rate)),
                _ => {
                    let by_moment = functional(*slot, rod, &columns[0], workspace, 0);
                    let by_force = functional(*slot, rod, &columns[1], workspace, 1);
                    sum.by_moment = axpy(rate, by_moment, sum.by_moment);
                    sum.by_force = axpy(rate, by_force, sum.by_force);
                    if program.base_moment_rows {
                        let by_rotation = functional(*slot, rod, &columns[2], workspace, 2);
                        sum.by_rotation = axpy(rate, by_rotation, sum.by_rotation);
                    }
                }
            }
        }
        store_rows(program, index, &add(extra, responses.rows(&sum)), out);
    }
}

/// `rate` along a world axis.
#[inline(always)]
pub fn along<L: Lane>(axis: Axis, rate: L) -> Vec3<L> {
    let zero = rate.constant(0.0);
    match axis {
        Axis::X => Vec3 { x: rate, y: zero, z: zero },
        Axis::Y => Vec3 { x: zero, y: rate, z: zero },
        Axis::Z => Vec3 { x: zero, y: zero, z: rate },
    }
}

#[inline(always)]
fn add<L: Lane>(a: [Vec3<L>; 3], b: [Vec3<L>; 3]) -> [Vec3<L>; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// More rod past the entry: the base is displaced by p' and rotated by R0 u(0); the moment is that at the new base.
#[inline(always)]
fn insertion_rows<L: Lane>(
    terms: impl Terms,
    rod: &Rod<L>,
    m0: Vec3<L>,
    responses: &Responses<L>,
    rate: L,
) -> [Vec3<L>; 3] {
    let base = base_slope(terms, rod, m0, rod.base_force(terms));
    let mut rows = responses.base_rotation_rows(m0, base.omega * rate);
    rows[0] = axpy(rate, base.v, rows[0]);
    rows[2] = axpy(rate, base.torque, rows[2]);
    rows
}

/// Stores the rows of one derivative: tip position, tip rotation and, where they are wanted, base moment.
#[inline(always)]
pub fn store_rows<L: Lane>(program: &Program, index: usize, rows: &[Vec3<L>; 3], out: &mut Outputs<'_, L::Scalar>) {
    let count = if program.base_moment_rows { 3 } else { 2 };
    for (k, row) in rows.iter().enumerate().take(count) {
        out.store_vector(Quantity::COUNT + 3 * (count * index + k), *row);
    }
}

/// Writes the rows of every derivative from forward columns. J5
#[inline(always)]
pub fn write_forward_rows<L: Lane>(
    problem: &Problem<'_, L>,
    m0: Vec3<L>,
    tip: &Tip<L>,
    columns: &[Columns<L>],
    workspace: &Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let terms = program.terms;
    let torque = base_slope(terms, rod, m0, rod.base_force(terms)).torque;
    let by_moment = &columns[0];
    let w_inverse = inverse(tip_moment_columns(terms, tip, by_moment));
    for (three, (sources, column)) in workspace.sources.iter().zip(&columns[1..]).enumerate() {
        let residual = tip_moment_columns(terms, tip, column) - sources.dl_tip;
        let dm0 = -(w_inverse * residual);
        let position = column.dp + by_moment.dp * dm0;
        let rotation = column.w + by_moment.w * dm0;
        let base_moment = outer(torque, sources.insertion, dm0);
        let columns = [
            [position.x, rotation.x, base_moment.x],
            [position.y, rotation.y, base_moment.y],
            [position.z, rotation.z, base_moment.z],
        ];
        for (k, rows) in columns.iter().enumerate().take(program.derivatives.len() - 3 * three) {
            store_rows(program, 3 * three + k, rows, out);
        }
    }
}

/// The functional of a slot on three columns, number `k` in the traces.
#[inline(always)]
pub fn functional<L: Lane>(
    slot: Slot,
    rod: &Rod<L>,
    columns: &Columns<L>,
    workspace: &Workspace<L>,
    k: usize,
) -> Vec3<L> {
    let zero = rod.t.x.constant(0.0);
    match slot {
        Slot::TipForce(axis) => component(transpose(columns.dp), axis),
        Slot::TipMoment(axis) => component(transpose(columns.w), axis),
        Slot::FluxDensity(axis) => {
            let mut total = Vec3::splat(zero);
            for trace in workspace.traces.iter().take(rod.segments.len()) {
                total = total + trace[k].field[axis.index()];
            }
            total
        }
        Slot::Length(segment) => workspace.traces[segment][k].length,
        Slot::RestCurvature(segment, axis) => workspace.traces[segment][k].rest_curvature[axis.index()],
        Slot::RestCurvatureRise(segment, axis) => workspace.traces[segment][k].rest_curvature_rise[axis.index()],
        Slot::Stiffness(segment, axis) => workspace.traces[segment][k].stiffness[axis.index()],
        Slot::StiffnessRise(segment, axis) => workspace.traces[segment][k].stiffness_rise[axis.index()],
        Slot::ShearCompliance(segment, axis) => workspace.traces[segment][k].shear_compliance[axis.index()],
        Slot::Load(segment, axis) | Slot::Weight(segment, axis) => workspace.traces[segment][k].load[axis.index()],
        Slot::Dipole(segment, axis) | Slot::DipolePerLength(segment, axis) => {
            workspace.traces[segment][k].dipole[axis.index()]
        }
        Slot::BasePosition(_) | Slot::BaseRotation(_) | Slot::Insertion => Vec3::splat(zero),
        // In a field that varies in space, with a wall, and under loads without energy, columns go forward.
        Slot::Couple(..)
        | Slot::FieldGradient(_)
        | Slot::FieldOrigin(_)
        | Slot::SourcePosition(..)
        | Slot::SourceMoment(..)
        | Slot::SourceTurn(..)
        | Slot::MapScale(_)
        | Slot::MapPosition(..)
        | Slot::WallPosition(_)
        | Slot::WallRotation(_)
        | Slot::WallRadius
        | Slot::WallTipRadius
        | Slot::WallCompliance
        | Slot::WallAnchor(_) => Vec3::splat(zero),
    }
}

#[inline(always)]
fn component<L: Lane>(rows: Mat3<L>, axis: Axis) -> Vec3<L> {
    match axis {
        Axis::X => rows.x,
        Axis::Y => rows.y,
        Axis::Z => rows.z,
    }
}
