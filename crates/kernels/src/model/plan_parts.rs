//! What a plan decides once for all samples: units, terms, steps, what stays at rest, how to differentiate.

use super::record::record_offsets;
use super::rod::Slot;
use super::{
    FlexibleRod, Parameter, PlanError, Rigid, Rod, RodSegment, Scene, SegmentKind, SegmentParameter, SegmentPlan,
    Sensitivity, StiffnessAxis, Terms, Units, Vector,
};

/// Up to this many derivatives forward columns may be the cheaper way.
const FEW: usize = 3;

/// Length: the rod's. Moment: what bends the mean rod by one radian. Field: the scene's.
pub(super) fn natural_units(rod: &Rod) -> Units {
    let length = rod.total_length();
    let (mut flexible, mut compliance) = (0.0, 0.0);
    for segment in &rod.segments {
        if let RodSegment::Flexible(segment) = segment {
            let middle = |axis: usize| segment.stiffness[axis] + 0.5 * segment.stiffness_rise[axis];
            flexible += segment.length;
            compliance += segment.length / (middle(0) * middle(1)).sqrt();
        }
    }
    let stiffness = if compliance > 0.0 { flexible / compliance } else { 1.0 };
    let size = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut field = size(rod.flux_density);
    if let Some(varying) = &rod.field {
        field += size(varying.flux_density(rod.base_position));
        field += length * varying.gradient.iter().map(|g| g.abs()).fold(0.0, f64::max);
    }
    Units { length, force: stiffness / (length * length), field: if field > 0.0 { field } else { 1.0 } }
}

pub(super) fn terms_of(
    scene: &Scene,
    segments: &[SegmentPlan],
    rod: &Rod,
    swept: &[Parameter],
    differentiates: bool,
) -> Terms {
    let sweeps = |test: fn(&Parameter) -> bool| swept.iter().any(test);
    let load =
        scene.has_distributed_load() || sweeps(|p| matches!(p, Parameter::Gravity(_) | Parameter::DistributedForce(_)));
    // Under no force a rod does not shear, but the responses that reciprocity needs do. A field that varies is a force.
    let shears = segments.iter().any(|segment| segment.shears);
    let force = load
        || scene.loads.tip_force.is_some()
        || sweeps(|p| matches!(p, Parameter::TipForce(_)))
        || shears && (differentiates || scene.sources.varies());
    let differs = |segment: &RodSegment| match segment {
        RodSegment::Flexible(FlexibleRod { stiffness, stiffness_rise, .. }) => {
            stiffness[0] != stiffness[1] || stiffness_rise[0] != stiffness_rise[1]
        }
        RodSegment::Rigid(_) => false,
    };
    let one_sided = |parameter: &Parameter| {
        use SegmentParameter::{Stiffness, StiffnessNode};
        use StiffnessAxis::{BendingX, BendingY};
        matches!(
            parameter,
            Parameter::Segment(_, Stiffness(BendingX | BendingY) | StiffnessNode(_, BendingX | BendingY))
        )
    };
    Terms {
        force,
        load,
        magnet: segments.iter().any(|segment| segment.has_magnet),
        shear: force && shears,
        taper: segments.iter().any(|segment| segment.tapers),
        curvature_rise: segments.iter().any(|segment| segment.curvature_rises),
        anisotropic: rod.segments.iter().any(differs) || swept.iter().any(one_sided),
        tip_moment: scene.loads.tip_moment.is_some() || sweeps(|p| matches!(p, Parameter::TipMoment(_))),
        dipole: segments.iter().any(|segment| segment.has_dipole),
        varying_field: scene.sources.varies(),
    }
}

/// First segment of a distal part without force, couple or dipole, of constant rest curvature, on which no derivative
/// depends. Its stiffness does not matter.
pub(super) fn free_part(terms: &Terms, segments: &[SegmentPlan], chains: &[Vec<(Slot, f64)>]) -> Option<usize> {
    let wanted = |test: &dyn Fn(&Slot) -> bool| chains.iter().flatten().any(|(slot, _)| test(slot));
    let loaded = terms.force
        || terms.tip_moment
        || terms.varying_field
        || wanted(&|slot| matches!(slot, Slot::TipForce(_) | Slot::TipMoment(_)));
    let is_free = |index: usize| {
        let segment = &segments[index];
        let depends = wanted(&|slot| slot.segment() == Some(index) && !slot.is_compliance());
        !(segment.has_dipole || segment.has_magnet || segment.curvature_rises || depends)
    };
    let first = (0..segments.len()).rev().take_while(|index| !loaded && is_free(*index)).last()?;
    // A rod that is free altogether still has a base.
    let first = first.max(1);
    (first < segments.len()).then_some(first)
}

/// Whether derivatives come from forward columns: where reciprocity fails, and where it is dearer, for up to three
/// parameters that would need integrals along the rod, if the kernel of rarely used terms runs anyway.
pub(super) fn is_forward<'a>(
    scene: &Scene,
    terms: &Terms,
    derivatives: impl ExactSizeIterator<Item = &'a [(Slot, f64)]>,
    sensitivity: Sensitivity,
) -> Result<bool, PlanError> {
    let count = derivatives.len();
    // Even where no force acts, rows come from the response to a unit force, which would lack its arm.
    let is_self_adjoint = scene.rigid_force_arm;
    if terms.varying_field {
        return Ok(count > 0);
    }
    let is_cheaper = || {
        let mut slots = derivatives.flatten().map(|(slot, _)| slot);
        count <= FEW && terms.is_general() && slots.any(Slot::is_integral)
    };
    match sensitivity {
        Sensitivity::Auto => Ok(count > 0 && (!is_self_adjoint || is_cheaper())),
        Sensitivity::Forward => Ok(count > 0),
        Sensitivity::Reciprocity if is_self_adjoint => Ok(false),
        Sensitivity::Reciprocity => Err(PlanError::NoReciprocity),
    }
}

/// Shares the steps out by length; a piece of no length takes none, unless its length is swept.
pub(super) fn segment_plans(scene: &Scene, rod: &Rod, steps: usize, swept: &[Parameter]) -> Vec<SegmentPlan> {
    let flexible: f64 = rod.segments.iter().filter(|s| s.is_flexible()).map(RodSegment::length).sum();
    let offsets = record_offsets(&rod.segments);
    let mut plans = Vec::new();
    for (index, segment) in scene.segments.iter().enumerate() {
        let is_swept = swept.contains(&Parameter::Segment(index, SegmentParameter::Length))
            || index == 0 && swept.contains(&Parameter::Insertion);
        for (piece, at) in scene.pieces(index).iter().zip(scene.piece_indices(index)) {
            let plan = SegmentPlan { record: offsets[at], ..SegmentPlan::default() };
            plans.push(match &segment.kind {
                SegmentKind::Flexible(segment) => {
                    let share = if flexible > 0.0 { rod.segments[at].length() / flexible } else { 1.0 };
                    let share = (steps as f64 * share - 1e-9).ceil().max(f64::from(u8::from(is_swept)));
                    SegmentPlan {
                        is_flexible: true,
                        has_magnet: segment.dipole_per_length.is_some(),
                        shears: segment.stiffness_shear.is_some() || segment.stiffness_axial.is_some(),
                        tapers: segment.stiffness.profile().varies_on(piece),
                        curvature_rises: segment.rest_curvature.varies_on(piece),
                        steps: share as usize,
                        ..plan
                    }
                }
                SegmentKind::Rigid(Rigid { coil, dipole_per_length, .. }) => {
                    SegmentPlan { has_dipole: coil.is_some() || dipole_per_length.is_some(), ..plan }
                }
            });
        }
    }
    plans
}
