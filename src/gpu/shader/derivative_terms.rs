//! Terms and constants that follow from what a plan differentiates by.

use super::segments::integrated;
use super::slots::slots;
use super::specialise::{Specialisation, Value};
use crate::model::{Plan, Slot, Tableau};

/// Which threes of columns there are, and which of them the answer takes.
pub(super) fn add_columns(s: &mut Specialisation, plan: &Plan, guards: bool) {
    let reciprocity = !plan.forward && !plan.derivatives.is_empty();
    let rotates = rotates(plan);
    let (moment, derived, rotation) = (1, 1 << 1, 1 << by_rotation(plan));
    let answer = moment + if plan.derivatives.is_empty() { 0 } else { derived } + if rotates { rotation } else { 0 };
    s.constant("THREES", Value::U32(by_rotation(plan) + u32::from(guards || rotates)));
    s.constant("TRACED", Value::U32(if rotates { 3 } else { 2 }));
    s.constant("BY_ROTATION", Value::U32(by_rotation(plan)));
    s.constant("STABILITY_COLUMNS", Value::U32(moment + rotation));
    s.constant("ANSWER_COLUMNS", Value::U32(answer));
    s.term("RECIPROCITY", reciprocity);
    s.term("ROTATES", rotates);
    s.term("GUARDS", guards);
    s.term("ROTATION", guards || rotates);
    s.term("BASE_MOMENT_ROWS", plan.options.base_moment_rows);
}

/// Whether the pass of the answer takes columns by base rotation, which count the whole stability index.
pub(super) fn rotates(plan: &Plan) -> bool {
    !plan.forward && !plan.derivatives.is_empty() && plan.options.base_moment_rows
}

/// Place of the columns by base rotation.
fn by_rotation(plan: &Plan) -> u32 {
    if plan.derivatives.is_empty() { 1 } else { 2 }
}

/// What is integrated besides the rod, what the columns leave behind and what forward columns need.
pub(super) fn add_derivative_terms(s: &mut Specialisation, plan: &Plan, tableaux: &[&Tableau]) {
    let terms = &plan.terms;
    let has = |test: fn(&Slot) -> bool| slots(plan).any(|(_, slot, _)| test(&slot));
    let rest_curvature = has(|slot| matches!(slot, Slot::RestCurvature(..) | Slot::RestCurvatureRise(..)));
    let stiffness = has(|slot| matches!(slot, Slot::Stiffness(..) | Slot::StiffnessRise(..)));
    let shear = has(|slot| matches!(slot, Slot::ShearCompliance(..)));
    let load = has(|slot| matches!(slot, Slot::Load(..)));
    let weight = has(|slot| matches!(slot, Slot::Weight(..)));
    let dipole = has(|slot| matches!(slot, Slot::Dipole(..)));
    let magnet = has(|slot| matches!(slot, Slot::DipolePerLength(..)));
    let field = (terms.dipole || terms.magnet) && has(|slot| matches!(slot, Slot::FluxDensity(_)));
    let length = has(|slot| matches!(slot, Slot::Length(_)));
    let tip_force = has(|slot| matches!(slot, Slot::TipForce(_)));
    let integrals = rest_curvature || stiffness || shear || load || magnet || field && terms.magnet;
    let on_rigid = weight || dipole || field || length;

    let (forward, reciprocity) = (plan.forward, !plan.forward);
    // Kernels integrate M where anything but coils changes it, and dM also where a derivative does.
    s.term("M_VARIES", terms.load || terms.magnet);
    s.term("DM_VARIES", terms.load || terms.magnet || forward && (load || magnet));
    s.term("COLLECT_STRAIN", reciprocity && (rest_curvature || stiffness));
    s.term("COLLECT_LOAD", reciprocity && (load || weight));
    s.term("COLLECT_DIPOLE", reciprocity && (dipole || magnet));
    s.term("COLLECT_FIELD", reciprocity && field);
    s.term("COLLECT_RIGID", reciprocity && on_rigid);
    s.term("COLLECTS", reciprocity && integrals);
    s.term("TRACES", reciprocity && (integrals || on_rigid));
    s.term("SOURCE_FORCE", forward && (tip_force || load || weight || length && terms.load));
    s.term("SOURCE_LOAD", forward && load);
    s.term("SOURCE_BEND", forward && (rest_curvature || stiffness));
    s.term("SOURCE_REST_CURVATURE", forward && rest_curvature);
    s.term("SOURCE_STIFFNESS", forward && stiffness);
    s.term("SOURCE_MAGNET", forward && (magnet || field && terms.magnet));
    s.term("SOURCE_DIPOLE", forward && dipole);
    for (r, tableau) in tableaux.iter().enumerate() {
        let is_answer = r + 1 == tableaux.len();
        for (i, b) in tableau.b.iter().enumerate() {
            s.term(format!("COLLECTS[{r}][{i}]"), is_answer && *b != 0.0 && reciprocity && integrals);
        }
    }
}

/// Whether derivatives need integrals along a segment.
pub(super) fn has_integrals(plan: &Plan, index: usize) -> bool {
    let segment = &integrated(plan)[index];
    let here = |slot: Slot| match slot {
        Slot::FluxDensity(_) => segment.has_magnet,
        Slot::Length(_) => false,
        slot => slot.segment() == Some(index),
    };
    segment.is_flexible && !plan.forward && slots(plan).any(|(_, slot, _)| here(slot))
}
