//! WGSL functions that load one sample's numbers: from the constants that all samples share, or from the inputs.
//!
//! Base: the vectors of its record (`model/record.rs`), such as `tip_force`. Segment j: `length_j` and the
//! vectors of its record, such as `stiffness_j`; the same by the first entry of a segment's record, so that code does
//! not grow with the segments: `record_length(at)`, `record_stiffness(at)`. Rest pose of an unloaded distal part: `free_p`, `free_d1`, `free_t`.
//! What of the field varies in space, by its place in that record: `record_field(at)`. Rate k of derivative d: `rate_d_k`. All in the plan's units.

use super::segments::{field_entries, integrated, segments_vary, varies};
use super::slots::slot_table;
use super::specialise::Piece;
use crate::model::record::{BASE_FIELDS, FLEXIBLE_FIELDS, RIGID_FIELDS};
use crate::model::{Entry, MOST_KNOWN, Plan, SegmentPlan};
use std::fmt::Write;

/// The loading functions of a plan.
pub(super) fn record_functions(plan: &Plan) -> Piece {
    let mut text = String::new();
    BASE_FIELDS.iter().for_each(|field| vector(&mut text, plan, field.name, field.at));
    segment_functions(&mut text, plan);
    for (index, segment) in plan.segments.iter().enumerate() {
        let at = segment.record;
        scalar(&mut text, plan, &format!("length_{index}"), at);
        for field in if segment.is_flexible { FLEXIBLE_FIELDS } else { RIGID_FIELDS } {
            vector(&mut text, plan, &format!("{}_{index}", field.name), at + field.at);
        }
    }
    if let Some(free) = plan.free {
        for (at, name) in ["free_p", "free_d1", "free_t"].iter().enumerate() {
            vector(&mut text, plan, name, free.entry + 3 * at);
        }
    }
    if let Some(start) = plan.start {
        vector(&mut text, plan, "start_moment", start);
        (0..MOST_KNOWN).for_each(|k| vector(&mut text, plan, &format!("known_moment_{k}"), start + 3 + 3 * k));
    }
    for (index, derivative) in plan.derivatives.iter().enumerate() {
        for (term, (_, entry)) in derivative.terms.iter().enumerate() {
            scalar(&mut text, plan, &format!("rate_{index}_{term}"), *entry);
        }
    }
    Piece { name: "record functions of the plan".into(), text: text.into() }
}

/// Values of the constant entries in the plan's units, zero for varying ones; where any number of a segment varies, one
/// more than the input column of each entry, zero for constant ones; then the table of slots.
pub(crate) fn constants(plan: &Plan) -> Vec<f64> {
    let value = |(entry, unit): (&Entry, f64)| match entry {
        Entry::Constant(value) => value / unit,
        Entry::Varying(_) => 0.0,
    };
    let mut constants: Vec<f64> = plan.entries.iter().zip(plan.entry_units()).map(value).collect();
    if segments_vary(plan) {
        let column = |entry: &Entry| match entry {
            Entry::Constant(_) => 0.0,
            Entry::Varying(column) => (column + 1) as f64,
        };
        constants.extend(plan.entries.iter().map(column));
    }
    constants.extend(slot_table(plan));
    constants
}

/// Unit of each input column.
pub(crate) fn input_units(plan: &Plan) -> Vec<f64> {
    let mut units = vec![1.0; plan.input_count];
    for (entry, unit) in plan.entries.iter().zip(plan.entry_units()) {
        if let Entry::Varying(column) = entry {
            units[*column] = unit;
        }
    }
    units
}

/// The functions that take the first entry of a segment's record.
fn segment_functions(text: &mut String, plan: &Plan) {
    // Writing to a string cannot fail.
    if segments_vary(plan) {
        let table = plan.entries.len();
        let _ = writeln!(text, "fn entry(at: u32) -> f32 {{");
        let _ = writeln!(text, "    let column = u32(constants[{table}u + at]);");
        let _ = writeln!(text, "    if column > 0u {{ return input(column - 1u); }}");
        let _ = writeln!(text, "    return constants[at];\n}}");
    }
    let varies_at = |flexible: Option<bool>, place: usize| {
        let of_kind = |segment: &&SegmentPlan| flexible.is_none_or(|flexible| segment.is_flexible == flexible);
        integrated(plan).iter().filter(of_kind).any(|segment| varies(plan, segment.record + place))
    };
    let number = |varies: bool, place: usize| match varies {
        true => format!("entry(at + {place}u)"),
        false => format!("constants[at + {place}u]"),
    };
    let _ = writeln!(text, "fn record_length(at: u32) -> f32 {{ return {}; }}", number(varies_at(None, 0), 0));
    if plan.terms.varying_field {
        let field = field_entries(plan);
        let number = number(field.clone().any(|entry| varies(plan, entry)), field.start);
        let _ = writeln!(text, "fn record_field(at: u32) -> f32 {{ return {number}; }}");
    }
    let fields = FLEXIBLE_FIELDS.iter().map(|field| (true, field));
    for (flexible, field) in fields.chain(RIGID_FIELDS.iter().map(|field| (false, field))) {
        let places = field.at..field.at + 3;
        let parts: Vec<_> = places.map(|place| number(varies_at(Some(flexible), place), place)).collect();
        let (name, parts) = (field.name, parts.join(", "));
        let _ = writeln!(text, "fn record_{name}(at: u32) -> vec3<f32> {{ return vec3<f32>({parts}); }}");
    }
}

fn expression(plan: &Plan, entry: usize) -> String {
    match plan.entries[entry] {
        Entry::Constant(_) => format!("constants[{entry}u]"),
        Entry::Varying(column) => format!("input({column}u)"),
    }
}

fn scalar(text: &mut String, plan: &Plan, name: &str, entry: usize) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "fn {name}() -> f32 {{ return {}; }}", expression(plan, entry));
}

fn vector(text: &mut String, plan: &Plan, name: &str, first: usize) {
    let parts: Vec<_> = (first..first + 3).map(|entry| expression(plan, entry)).collect();
    let _ = writeln!(text, "fn {name}() -> vec3<f32> {{ return vec3<f32>({}); }}", parts.join(", "));
}
