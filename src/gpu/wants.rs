//! Terms that follow from what a plan differentiates by.

use super::slots::{integrated, slots};
use super::specialise::Specialisation;
use super::terms::{by_rotation, tableaux};
use crate::model::{Plan, Slot};

/// What is integrated besides the rod, what the columns leave behind and what forward columns need.
pub(super) fn add_wants(s: &mut Specialisation, plan: &Plan) {
    let terms = &plan.terms;
    let wants = |test: fn(&Slot) -> bool| slots(plan).any(|(_, slot, _)| test(&slot));
    let rest_curvature = wants(|slot| matches!(slot, Slot::RestCurvature(..) | Slot::RestCurvatureRise(..)));
    let stiffness = wants(|slot| matches!(slot, Slot::Stiffness(..) | Slot::StiffnessRise(..)));
    let shear = wants(|slot| matches!(slot, Slot::ShearCompliance(..)));
    let load = wants(|slot| matches!(slot, Slot::Load(..)));
    let weight = wants(|slot| matches!(slot, Slot::Weight(..)));
    let dipole = wants(|slot| matches!(slot, Slot::Dipole(..)));
    let magnet = wants(|slot| matches!(slot, Slot::DipolePerLength(..)));
    let field = (terms.dipole || terms.magnet) && wants(|slot| matches!(slot, Slot::FluxDensity(_)));
    let length = wants(|slot| matches!(slot, Slot::Length(_)));
    let tip_force = wants(|slot| matches!(slot, Slot::TipForce(_)));
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
    let tableaux = tableaux(plan);
    for (r, tableau) in tableaux.iter().enumerate() {
        let is_answer = r + 1 == tableaux.len();
        for (i, b) in tableau.b.iter().enumerate() {
            s.term(format!("COLLECTS[{r}][{i}]"), is_answer && *b != 0.0 && reciprocity && integrals);
        }
        // The path takes no columns of derivatives.
        (0..3).for_each(|k| s.term(format!("TAKES[{r}][{k}]"), k == 0 || k == by_rotation(plan) || is_answer));
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
