//! WGSL functions that say what parameters change, for forward columns: `sources_k` at the ends of the rod, by the k-th
//! three of parameters, and `source_j_k` on segment j. `Sources` and `Source` are those of `shaders/rod/source.wgsl`.
//!
//! Which number of a source is not zero is known here, so that compilers see the zeros.

use super::segments::integrated;
use super::specialise::{Piece, Specialisation, Value};
use crate::model::{Axis, Plan, Slot};
use std::fmt::Write;

/// Threes of forward columns.
pub(super) fn forward_threes(plan: &Plan) -> usize {
    if plan.forward { plan.derivatives.len().div_ceil(3) } else { 0 }
}

/// The functions of a plan; nothing without forward columns.
pub(super) fn source_functions(plan: &Plan) -> Piece {
    let mut text = String::new();
    for three in 0..forward_threes(plan) {
        function(&mut text, &format!("sources_{three}"), "Sources", end_lines(plan, three));
        for segment in 0..integrated(plan).len() {
            let lines = segment_lines(plan, segment, three);
            if !lines.is_empty() {
                function(&mut text, &format!("source_{segment}_{three}"), "Source", lines);
            }
        }
    }
    Piece { name: "source functions of the plan".into(), text: text.into() }
}

/// Terms `SOURCE[j][k]` and the number of threes.
pub(super) fn add_sources(s: &mut Specialisation, plan: &Plan) {
    s.constant("FORWARD_THREES", Value::U32(forward_threes(plan) as u32));
    s.term("MANY_SOURCES", forward_threes(plan) > 1);
    let mut any = false;
    for segment in 0..integrated(plan).len() {
        for three in 0..forward_threes(plan) {
            let acts = !segment_lines(plan, segment, three).is_empty();
            s.term(format!("SOURCE[{segment}][{three}]"), acts);
            any |= acts;
        }
    }
    s.term("SEGMENT_SOURCES", any);
}

fn function(text: &mut String, name: &str, ty: &str, lines: Vec<String>) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "fn {name}() -> {ty} {{\n    var s: {ty};");
    lines.iter().for_each(|line| {
        let _ = writeln!(text, "    {line}");
    });
    let _ = writeln!(text, "    return s;\n}}");
}

/// Slots of three parameters: column, slot, and the function that loads its rate.
fn slots(plan: &Plan, three: usize) -> impl Iterator<Item = (usize, Slot, String)> {
    let derivatives = plan.derivatives.iter().enumerate().skip(3 * three).take(3);
    derivatives.flat_map(move |(index, derivative)| {
        let terms = derivative.terms.iter().enumerate();
        terms.map(move |(term, (slot, _))| (index - 3 * three, *slot, format!("rate_{index}_{term}()")))
    })
}

fn component(matrix: &str, column: usize, axis: Axis, rate: &str) -> String {
    let row = ["x", "y", "z"][axis.index()];
    format!("s.{matrix}[{column}].{row} += {rate};")
}

fn end_lines(plan: &Plan, three: usize) -> Vec<String> {
    let line = |(k, slot, rate): (usize, Slot, String)| match slot {
        Slot::BasePosition(axis) => Some(component("dp0", k, axis, &rate)),
        Slot::BaseRotation(axis) => Some(component("w0", k, axis, &rate)),
        Slot::TipForce(axis) => Some(component("dn0", k, axis, &rate)),
        Slot::TipMoment(axis) => Some(component("dl_tip", k, axis, &rate)),
        Slot::Insertion => Some(format!("s.insertion[{k}] += {rate};")),
        _ => None,
    };
    slots(plan, three).filter_map(line).collect()
}

fn segment_lines(plan: &Plan, segment: usize, three: usize) -> Vec<String> {
    let Some(here) = integrated(plan).get(segment) else { return Vec::new() };
    let mut lines = Vec::new();
    let mut flags = Vec::new();
    for (k, slot, rate) in slots(plan, three) {
        if let (Slot::FluxDensity(axis), true) = (slot, here.has_dipole || here.has_magnet) {
            lines.push(component("dB", k, axis, &rate));
            flags.push("magnetises");
        }
        if slot.segment() != Some(segment) {
            continue;
        }
        let (matrix, axis, flag) = match slot {
            Slot::Stiffness(_, axis) => ("dK", axis, "bends"),
            Slot::StiffnessRise(_, axis) => ("dK_rise", axis, "bends"),
            Slot::RestCurvature(_, axis) => ("du_star", axis, "bends"),
            Slot::RestCurvatureRise(_, axis) => ("du_star_rise", axis, "bends"),
            Slot::ShearCompliance(_, axis) => ("dC_se", axis, "shears"),
            Slot::Load(_, axis) | Slot::Weight(_, axis) => ("dload", axis, "loads"),
            Slot::DipolePerLength(_, axis) | Slot::Dipole(_, axis) => ("dmu", axis, "magnetises"),
            _ => {
                lines.push(format!("s.dL[{k}] += {rate};"));
                continue;
            }
        };
        lines.push(component(matrix, k, axis, &rate));
        flags.push(flag);
    }
    flags.sort_unstable();
    flags.dedup();
    lines.extend(flags.iter().map(|flag| format!("s.{flag} = true;")));
    lines
}
