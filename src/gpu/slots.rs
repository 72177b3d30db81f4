//! The table that tells the kernel what to differentiate by: it follows the constants in their buffer.
//!
//! First the number of slots of each derivative, then for each slot kind, segment, axis and source of its rate. A
//! source below the table is an entry of the constants; past its start, a column of the inputs.

use super::specialise::{Specialisation, Value};
use crate::model::{Axis, Entry, Plan, Slot};

/// The kinds of slots, by their code.
const KINDS: [&str; 11] = [
    "BASE_POSITION",
    "BASE_ROTATION",
    "FLUX_DENSITY",
    "TIP_FORCE",
    "TIP_MOMENT",
    "INSERTION",
    "LENGTH",
    "STIFFNESS",
    "REST_CURVATURE",
    "DIPOLE",
    "LOAD",
];

/// Where the table starts: behind the entries of the plan.
pub(super) fn slot_table_start(plan: &Plan) -> usize {
    plan.entries.len()
}

/// The table; whole numbers, exact in f32.
pub(super) fn slot_table(plan: &Plan) -> Vec<f32> {
    let mut table: Vec<usize> = plan.derivatives.iter().map(|derivative| derivative.terms.len()).collect();
    for (slot, entry) in plan.derivatives.iter().flat_map(|derivative| &derivative.terms) {
        let (kind, segment, axis) = parts(*slot);
        let source = match plan.entries[*entry] {
            Entry::Constant(_) => *entry,
            Entry::Varying(column) => slot_table_start(plan) + column,
        };
        table.extend([kind, segment, axis, source]);
    }
    table.into_iter().map(|number| number as f32).collect()
}

/// The codes of the kinds, and which kinds a plan uses.
pub(super) fn add_slots(s: &mut Specialisation, plan: &Plan) {
    for (code, name) in KINDS.iter().enumerate() {
        s.constant(format!("SLOT_{name}"), Value::U32(code as u32));
        s.term(format!("WANT_{name}"), false);
    }
    let slots = || plan.derivatives.iter().flat_map(|derivative| &derivative.terms);
    for (slot, _) in slots() {
        s.term(format!("WANT_{}", KINDS[parts(*slot).0]), true);
    }
    s.term("VARYING_RATES", slots().any(|(_, entry)| matches!(plan.entries[*entry], Entry::Varying(_))));
}

/// Kind, segment and axis.
fn parts(slot: Slot) -> (usize, usize, usize) {
    let at = |kind: usize, axis: Axis| (kind, 0, axis.index());
    match slot {
        Slot::BasePosition(axis) => at(0, axis),
        Slot::BaseRotation(axis) => at(1, axis),
        Slot::FluxDensity(axis) => at(2, axis),
        Slot::TipForce(axis) => at(3, axis),
        Slot::TipMoment(axis) => at(4, axis),
        Slot::Insertion => (5, 0, 0),
        Slot::Length(segment) => (6, segment, 0),
        Slot::Stiffness(segment, axis) => (7, segment, axis.index()),
        Slot::RestCurvature(segment, axis) => (8, segment, axis.index()),
        Slot::Dipole(segment, axis) => (9, segment, axis.index()),
        Slot::Load(segment, axis) => (10, segment, axis.index()),
    }
}
