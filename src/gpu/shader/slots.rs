//! The table that tells the kernel what to differentiate by: it follows the constants in their buffer.
//!
//! First where each list of slots starts, one for each segment, one for each derivative, and where the last ends.
//! Then the slots: derivative, kind, segment, axis and entry of the rate. An entry below the table is one of the
//! constants; past its start, a column of the inputs. Forward columns need no table, see `sources.rs`, but in a field that
//! varies in space: one list for each three of parameters, a slot's derivative being its column there.

use super::segments::{integrated, segments_vary};
use super::specialise::{Specialisation, Value};
use crate::model::{Axis, Entry, Plan, Slot};

/// The kinds of slots, by their code.
const KINDS: [&str; 20] = [
    "BASE_POSITION",
    "BASE_ROTATION",
    "FLUX_DENSITY",
    "TIP_FORCE",
    "TIP_MOMENT",
    "INSERTION",
    "LENGTH",
    "STIFFNESS",
    "STIFFNESS_RISE",
    "REST_CURVATURE",
    "REST_CURVATURE_RISE",
    "LOAD",
    "DIPOLE_PER_LENGTH",
    "SHEAR_COMPLIANCE",
    "DIPOLE",
    "WEIGHT",
    "FIELD_GRADIENT",
    "FIELD_ORIGIN",
    "SOURCE_POSITION",
    "SOURCE_MOMENT",
];

/// The kinds from here on belong to a segment.
const FIRST_OF_SEGMENT: usize = 6;

/// Slots to differentiate by, and the entries of their rates; not those of segments that are not integrated, which
/// change nothing.
pub(super) fn slots(plan: &Plan) -> impl Iterator<Item = (usize, Slot, usize)> {
    let count = integrated(plan).len();
    let terms = plan.derivatives.iter().enumerate();
    let terms =
        terms.flat_map(|(index, derivative)| derivative.terms.iter().map(move |(slot, entry)| (index, *slot, *entry)));
    terms.filter(move |(_, slot, _)| slot.segment().is_none_or(|segment| segment < count))
}

/// Where the table starts: behind the entries of the plan and their columns.
pub(super) fn slot_table_start(plan: &Plan) -> usize {
    plan.entries.len() * (1 + usize::from(segments_vary(plan)))
}

/// Numbers of one slot.
const SLOT_LENGTH: usize = 5;

/// The table; whole numbers, exact in f32.
pub(super) fn slot_table(plan: &Plan) -> Vec<f64> {
    let lists = match (plan.forward, plan.terms.varying_field) {
        (true, true) => lists_by_threes(plan),
        (true, false) => return Vec::new(),
        (false, _) => slot_lists(plan),
    };
    let mut at = slot_table_start(plan) + lists.len() + 1;
    let mut table = vec![at];
    for list in &lists {
        at += SLOT_LENGTH * list.len();
        table.push(at);
    }
    table.extend(lists.into_iter().flatten().flatten());
    table.into_iter().map(|number| number as f64).collect()
}

/// Slots in the table.
pub(super) fn slot_count(plan: &Plan) -> usize {
    if plan.forward { 0 } else { slot_lists(plan).iter().map(Vec::len).sum() }
}

/// The slots of each segment, then those of each derivative that belong to none.
fn slot_lists(plan: &Plan) -> Vec<Vec<[usize; SLOT_LENGTH]>> {
    let segments = integrated(plan);
    let mut lists = vec![Vec::new(); segments.len() + plan.derivatives.len()];
    for (index, slot, entry) in slots(plan) {
        let (kind, segment, axis) = parts(slot);
        let row = [index, kind, segment, axis, place_of_rate(plan, entry)];
        match slot {
            // Every magnet contributes.
            Slot::FluxDensity(_) => {
                let magnets = segments.iter().zip(&mut lists).filter(|(s, _)| s.has_dipole || s.has_magnet);
                magnets.for_each(|(_, list)| list.push(row));
            }
            _ if kind >= FIRST_OF_SEGMENT => lists[segment].push(row),
            _ => lists[segments.len() + index].push(row),
        }
    }
    lists
}

/// The slots of each three of parameters.
fn lists_by_threes(plan: &Plan) -> Vec<Vec<[usize; SLOT_LENGTH]>> {
    let mut lists = vec![Vec::new(); plan.derivatives.len().div_ceil(3)];
    for (index, slot, entry) in slots(plan) {
        let (kind, segment, axis) = parts(slot);
        lists[index / 3].push([index % 3, kind, segment, axis, place_of_rate(plan, entry)]);
    }
    lists
}

/// A constant, or past the start of the table a column of the inputs.
fn place_of_rate(plan: &Plan, entry: usize) -> usize {
    match plan.entries[entry] {
        Entry::Constant(_) => entry,
        Entry::Varying(column) => slot_table_start(plan) + column,
    }
}

/// The codes of the kinds, and which kinds a plan uses.
pub(super) fn add_slots(s: &mut Specialisation, plan: &Plan) {
    s.constant("SLOT_TABLE", Value::U32(slot_table_start(plan) as u32));
    s.constant("SLOT_LENGTH", Value::U32(SLOT_LENGTH as u32));
    for (code, name) in KINDS.iter().enumerate() {
        s.constant(format!("KIND_{name}"), Value::U32(code as u32));
        s.term(format!("WANT_{name}"), false);
    }
    s.term("SLOTS", !plan.derivatives.is_empty() && (!plan.forward || plan.terms.varying_field));
    for (_, slot, _) in slots(plan) {
        s.term(format!("WANT_{}", KINDS[parts(slot).0]), true);
    }
    s.term("VARYING_RATES", slots(plan).any(|(_, _, entry)| matches!(plan.entries[entry], Entry::Varying(_))));
}

/// Kind, segment and axis.
fn parts(slot: Slot) -> (usize, usize, usize) {
    let at = |kind: usize, axis: Axis| (kind, 0, axis.index());
    match slot {
        Slot::BasePosition(axis) => at(0, axis),
        Slot::BaseRotation(axis) => at(1, axis),
        Slot::FluxDensity(axis) => at(2, axis),
        Slot::FieldGradient(entry) => (16, 0, entry.index()),
        Slot::FieldOrigin(axis) => at(17, axis),
        Slot::SourcePosition(source, axis) => (18, source, axis.index()),
        Slot::SourceMoment(source, axis) => (19, source, axis.index()),
        // Plans of a field sampled on a grid, of an exact magnet, of a wall and of couples inside of the rod are refused; these move nothing, as the base does.
        Slot::Couple(_, axis)
        | Slot::SourceTurn(_, axis)
        | Slot::MapPosition(_, axis)
        | Slot::WallPosition(axis)
        | Slot::WallRotation(axis)
        | Slot::WallAnchor(axis) => at(0, axis),
        Slot::MapScale(_) | Slot::WallRadius | Slot::WallTipRadius | Slot::WallCompliance => at(0, Axis::X),
        Slot::TipForce(axis) => at(3, axis),
        Slot::TipMoment(axis) => at(4, axis),
        Slot::Insertion => (5, 0, 0),
        Slot::Length(segment) => (6, segment, 0),
        Slot::Stiffness(segment, axis) => (7, segment, axis.index()),
        Slot::StiffnessRise(segment, axis) => (8, segment, axis.index()),
        Slot::RestCurvature(segment, axis) => (9, segment, axis.index()),
        Slot::RestCurvatureRise(segment, axis) => (10, segment, axis.index()),
        Slot::Load(segment, axis) => (11, segment, axis.index()),
        Slot::DipolePerLength(segment, axis) => (12, segment, axis.index()),
        Slot::ShearCompliance(segment, axis) => (13, segment, axis.index()),
        Slot::Dipole(segment, axis) => (14, segment, axis.index()),
        Slot::Weight(segment, axis) => (15, segment, axis.index()),
    }
}
