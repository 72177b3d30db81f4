//! The kernels: entry points, the pieces they are made of, and what a plan fixes in them.

use super::emit::{EmitError, Source, emit};
use super::record::record_functions;
use super::specialise::{Piece, Specialisation, Value};
use super::tableau::Tableau;
use crate::model::{BLOCK, Plan, Quantity, ROWS, Slot, Status};
use std::borrow::Cow;

/// Invocations of a workgroup; a block of samples is a multiple.
pub const WORKGROUP_SIZE: u32 = 64;

/// A shader file, compiled in.
macro_rules! shader {
    ($stem:literal) => {
        Part::File(Piece {
            name: Cow::Borrowed(concat!("shaders/", $stem, ".wgsl")),
            text: Cow::Borrowed(include_str!(concat!("../../shaders/", $stem, ".wgsl"))),
        })
    };
}

/// One part of a kernel's source.
#[derive(Clone, Debug)]
pub enum Part {
    File(Piece),
    /// The functions that load a sample's record, generated for the plan.
    Record,
}

/// A row of the kernel table.
#[derive(Clone, Debug)]
pub struct KernelEntry {
    pub entry_point: &'static str,
    /// In the order in which they are joined.
    pub parts: &'static [Part],
}

/// Every kernel. The first solves a batch.
pub const KERNELS: &[KernelEntry] = &[];

/// Layout and loading of a sample's numbers: what every kernel starts with.
pub(super) const PRELUDE: &[Part] = &[shader!("batch"), Part::Record];

/// A kernel specialised for a plan.
#[derive(Clone, Debug)]
pub struct Kernel {
    pub entry_point: &'static str,
    pub source: Source,
}

impl Kernel {
    /// A row of the table, specialised.
    pub fn new(entry: &KernelEntry, plan: &Plan) -> Result<Self, EmitError> {
        let pieces: Vec<Piece> = entry.parts.iter().map(|part| part.piece(plan)).collect();
        Ok(Self { entry_point: entry.entry_point, source: emit(&pieces, &specialisation(plan))? })
    }

    /// A kernel of its own pieces after the prelude, for tests and trials.
    pub fn custom(entry_point: &'static str, pieces: &[Piece], plan: &Plan) -> Result<Self, EmitError> {
        let pieces: Vec<Piece> = PRELUDE.iter().map(|part| part.piece(plan)).chain(pieces.iter().cloned()).collect();
        Ok(Self { entry_point, source: emit(&pieces, &specialisation(plan))? })
    }
}

impl Part {
    fn piece(&self, plan: &Plan) -> Piece {
        match self {
            Part::File(piece) => piece.clone(),
            Part::Record => record_functions(plan),
        }
    }
}

/// Columns of the solutions of a plan.
pub(super) fn output_count(plan: &Plan) -> usize {
    Quantity::COUNT + ROWS * plan.derivatives.len()
}

/// Terms and constants that a plan fixes.
///
/// Terms: those of `Terms` in capitals; `RIGID_FORCE_ARM`, `DERIVATIVES`; for each segment j `FLEXIBLE[j]`,
/// `DIPOLE[j]`; for the tableau `A[i][j]`, `B[i]`, where not zero; for the slots to differentiate by
/// `WANT_TIP_FORCE` and so on, `WANT_LENGTH[j]` and so on.
pub fn specialisation(plan: &Plan) -> Specialisation {
    let mut s = Specialisation::default();
    s.constant("WORKGROUP", Value::U32(WORKGROUP_SIZE));
    s.constant("BLOCK", Value::U32(BLOCK as u32));
    s.constant("INPUT_COUNT", Value::U32(plan.input_count as u32));
    s.constant("OUTPUT_COUNT", Value::U32(output_count(plan) as u32));
    s.constant("STATUS_COLUMN", Value::U32(Quantity::Status.column() as u32));
    s.constant("DERIVATIVE_COLUMN", Value::U32(Quantity::COUNT as u32));
    s.constant("DERIVATIVE_COUNT", Value::U32(plan.derivatives.len() as u32));
    for status in Status::ALL {
        let name = format!("STATUS_{}", status.name().to_uppercase().replace('-', "_"));
        s.constant(name, Value::U32(u32::from(status.code())));
    }
    s.term("FORCE", plan.terms.force);
    s.term("LOAD", plan.terms.load);
    s.term("ANISOTROPIC", plan.terms.anisotropic);
    s.term("TIP_MOMENT", plan.terms.tip_moment);
    s.term("DIPOLE", plan.terms.dipole);
    s.term("RIGID_FORCE_ARM", plan.scene.rigid_force_arm);
    s.term("DERIVATIVES", !plan.derivatives.is_empty());
    add_segments(&mut s, plan);
    add_tableau(&mut s, Tableau::of(plan.options.stepper));
    add_slots(&mut s, plan);
    s
}

fn add_segments(s: &mut Specialisation, plan: &Plan) {
    s.constant("SEGMENT_COUNT", Value::U32(plan.segments.len() as u32));
    s.constant("STEPS", Value::u32_array(plan.segments.iter().map(|segment| segment.steps)));
    for (index, segment) in plan.segments.iter().enumerate() {
        s.term(format!("FLEXIBLE[{index}]"), segment.is_flexible);
        s.term(format!("DIPOLE[{index}]"), segment.has_dipole);
    }
}

fn add_tableau(s: &mut Specialisation, tableau: Tableau) {
    let stages = 0..tableau.stage_count();
    s.constant("STAGE_COUNT", Value::U32(tableau.stage_count() as u32));
    let row = |i: usize| Value::f32_array(stages.clone().map(|j| tableau.a(i, j)));
    s.constant("A", Value::Array(stages.clone().map(row).collect()));
    s.constant("B", Value::f32_array(tableau.b.iter().copied()));
    s.constant("C", Value::f32_array(stages.clone().map(|i| tableau.c(i))));
    for i in stages.clone() {
        s.term(format!("B[{i}]"), tableau.b[i] != 0.0);
        for j in stages.clone() {
            s.term(format!("A[{i}][{j}]"), tableau.a(i, j) != 0.0);
        }
    }
}

fn add_slots(s: &mut Specialisation, plan: &Plan) {
    for name in ["BASE_POSITION", "BASE_ROTATION", "FLUX_DENSITY", "TIP_FORCE", "TIP_MOMENT", "INSERTION"] {
        s.term(format!("WANT_{name}"), false);
    }
    for index in 0..plan.segments.len() {
        for name in ["LENGTH", "STIFFNESS", "REST_CURVATURE", "DIPOLE", "LOAD"] {
            s.term(format!("WANT_{name}[{index}]"), false);
        }
    }
    for (slot, _) in plan.derivatives.iter().flat_map(|derivative| &derivative.terms) {
        s.term(format!("WANT_{}", slot_name(*slot)), true);
    }
}

fn slot_name(slot: Slot) -> String {
    match slot {
        Slot::BasePosition(_) => "BASE_POSITION".into(),
        Slot::BaseRotation(_) => "BASE_ROTATION".into(),
        Slot::FluxDensity(_) => "FLUX_DENSITY".into(),
        Slot::TipForce(_) => "TIP_FORCE".into(),
        Slot::TipMoment(_) => "TIP_MOMENT".into(),
        Slot::Insertion => "INSERTION".into(),
        Slot::Length(j) => format!("LENGTH[{j}]"),
        Slot::Stiffness(j, _) => format!("STIFFNESS[{j}]"),
        Slot::RestCurvature(j, _) => format!("REST_CURVATURE[{j}]"),
        Slot::Dipole(j, _) => format!("DIPOLE[{j}]"),
        Slot::Load(j, _) => format!("LOAD[{j}]"),
    }
}
