//! WGSL functions that load one sample's numbers: from the constants that all samples share, or from the inputs.
//!
//! Base: `base_d1`, `base_t`, `flux_density`, `tip_force`, `tip_moment`, `base_position`. Segment j: `length_j` and the
//! vectors of its record, such as `stiffness_j`. Rest pose of an unloaded distal part: `free_p`, `free_d1`, `free_t`.
//! Rate k of derivative d: `rate_d_k`. All in the plan's units.

use super::slots::slot_table;
use super::specialise::Piece;
use crate::model::rod::{
    DIPOLE_AT, DIPOLE_PER_LENGTH_AT, LOAD_AT, REST_CURVATURE_AT, REST_CURVATURE_RISE_AT, SHEAR_COMPLIANCE_AT,
    STIFFNESS_AT, STIFFNESS_RISE_AT, WEIGHT_AT,
};
use crate::model::{Entry, Plan};
use std::fmt::Write;

/// Vectors of a flexible segment and their places in its record.
const FLEXIBLE_VECTORS: [(&str, usize); 7] = [
    ("stiffness", STIFFNESS_AT),
    ("stiffness_rise", STIFFNESS_RISE_AT),
    ("rest_curvature", REST_CURVATURE_AT),
    ("rest_curvature_rise", REST_CURVATURE_RISE_AT),
    ("load", LOAD_AT),
    ("dipole_per_length", DIPOLE_PER_LENGTH_AT),
    ("shear_compliance", SHEAR_COMPLIANCE_AT),
];
/// The same of a rigid segment.
const RIGID_VECTORS: [(&str, usize); 2] = [("dipole", DIPOLE_AT), ("weight", WEIGHT_AT)];

/// The loading functions of a plan.
pub fn record_functions(plan: &Plan) -> Piece {
    let mut text = String::new();
    let base = ["base_d1", "base_t", "flux_density", "tip_force", "tip_moment", "base_position"];
    for (at, name) in base.iter().enumerate() {
        vector(&mut text, plan, name, 3 * at);
    }
    for (index, segment) in plan.segments.iter().enumerate() {
        let at = segment.record;
        scalar(&mut text, plan, &format!("length_{index}"), at);
        let vectors: &[(&str, usize)] = if segment.is_flexible { &FLEXIBLE_VECTORS } else { &RIGID_VECTORS };
        for (name, place) in vectors {
            vector(&mut text, plan, &format!("{name}_{index}"), at + place);
        }
    }
    if let Some(free) = plan.free {
        for (at, name) in ["free_p", "free_d1", "free_t"].iter().enumerate() {
            vector(&mut text, plan, name, free.entry + 3 * at);
        }
    }
    for (index, derivative) in plan.derivatives.iter().enumerate() {
        for (term, (_, entry)) in derivative.terms.iter().enumerate() {
            scalar(&mut text, plan, &format!("rate_{index}_{term}"), *entry);
        }
    }
    Piece { name: "record functions of the plan".into(), text: text.into() }
}

/// Values of the constant entries in the plan's units, zero for varying ones; then the table of slots.
pub(super) fn constants(plan: &Plan) -> Vec<f32> {
    let value = |(entry, unit): (&Entry, f64)| match entry {
        Entry::Constant(value) => (value / unit) as f32,
        Entry::Varying(_) => 0.0,
    };
    plan.entries.iter().zip(plan.entry_units()).map(value).chain(slot_table(plan)).collect()
}

/// Unit of each input column.
pub(super) fn input_units(plan: &Plan) -> Vec<f64> {
    let mut units = vec![1.0; plan.input_count];
    for (entry, unit) in plan.entries.iter().zip(plan.entry_units()) {
        if let Entry::Varying(column) = entry {
            units[*column] = unit;
        }
    }
    units
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
