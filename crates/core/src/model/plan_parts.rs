//! What a plan decides once for all samples: units, terms, steps, what stays at rest, how to differentiate.

use super::record::record_offsets;
use super::rod::Slot;
use super::{
    FlexibleRod, Frame, Parameter, PlanError, PlanOptions, Rod, RodSegment, Scene, SegmentKind, SegmentParameter,
    SegmentPlan, Sensitivity, StiffnessAxis, Terms, Units, Vector,
};

/// Up to this many derivatives forward columns may be the cheaper way.
const FEW: usize = 3;
/// A piece along which stiffness doubles or halves takes at least this share of the steps for each time it does.
const OCTAVE_SHARE: f64 = 1.0 / 6.0;
/// Stiffness that changes by fewer octaves along a piece asks for no steps of its own.
const FEW_OCTAVES: f64 = 1.0;
/// More octaves are not followed.
const MOST_OCTAVES: f64 = 40.0;
/// A piece takes at least this share of the steps, times its share in the rod's rest curvature.
const BEND_SHARE: f64 = 0.5;
/// Rest curvature that bends a piece by less asks for no steps of its own (rad).
const LITTLE_BEND: f64 = 1.0;

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
        scene.has_inner_load() || sweeps(|p| matches!(p, Parameter::Gravity(_) | Parameter::DistributedForce(_)));
    // Under no force a rod does not shear, but the responses that reciprocity needs do. A field that varies is a force.
    let shears = segments.iter().any(|segment| segment.shears);
    let force = load
        || scene.loads.tip_force.is_some()
        || sweeps(|p| matches!(p, Parameter::TipForce(_)))
        || shears && (differentiates || scene.has_unknown_force());
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
        load_without_energy: scene.loads.tip_moment.is_some()
            || sweeps(|p| matches!(p, Parameter::TipMoment(_)))
            || scene.has_load_without_energy(),
        dipole: segments.iter().any(|segment| segment.has_dipole),
        varying_field: scene.has_unknown_force(),
        wall: scene.wall.is_some(),
    }
}

/// First segment of a distal part without force, couple or dipole, of constant rest curvature, on which no derivative
/// depends. Its stiffness does not matter.
pub(super) fn free_part(terms: &Terms, segments: &[SegmentPlan], chains: &[Vec<(Slot, f64)>]) -> Option<usize> {
    let wanted = |test: &dyn Fn(&Slot) -> bool| chains.iter().flatten().any(|(slot, _)| test(slot));
    let loaded = terms.force
        || terms.load_without_energy
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

/// Shares the steps out by length; a piece of no length takes none, unless its length is swept. A piece takes more where
/// stiffness changes much along it, or where much of the rod's rest curvature lies in it.
pub(super) fn segment_plans(scene: &Scene, rod: &Rod, options: &PlanOptions, swept: &[Parameter]) -> Vec<SegmentPlan> {
    let steps = options.steps as f64;
    let flexible: f64 = rod.segments.iter().filter(|s| s.is_flexible()).map(RodSegment::length).sum();
    let all_bend: f64 = rod.segments.iter().map(rest_bend).sum();
    let offsets = record_offsets(&rod.segments);
    let mut plans = Vec::new();
    for (index, segment) in scene.segments.iter().enumerate() {
        let is_swept = swept.contains(&Parameter::Segment(index, SegmentParameter::Length))
            || index == 0 && swept.contains(&Parameter::Insertion);
        for (piece, at) in scene.pieces(index).iter().zip(scene.piece_indices(index)) {
            let plan = SegmentPlan { record: offsets[at], ..SegmentPlan::default() };
            plans.push(match &segment.kind {
                _ if let Some(load) = piece.force => {
                    let load = &scene.inner_loads[load];
                    SegmentPlan { has_couple: load.has_couple(), follows: load.frame == Frame::Body, ..plan }
                }
                SegmentKind::Flexible(segment) => {
                    let share = if flexible > 0.0 { rod.segments[at].length() / flexible } else { 1.0 };
                    let grading = if share > 0.0 { grading(&rod.segments[at]) } else { 0 };
                    let bend = rest_bend(&rod.segments[at]);
                    let bend = if bend > LITTLE_BEND { BEND_SHARE * bend / all_bend } else { 0.0 };
                    let octaves = f64::from(grading.abs()) / 8.0;
                    let share = share.max(OCTAVE_SHARE * octaves).max(bend);
                    let steps = (steps * share - 1e-9).ceil().max(f64::from(u8::from(is_swept)));
                    SegmentPlan {
                        is_flexible: true,
                        has_magnet: segment.is_magnet(),
                        shears: segment.stiffness_shear.is_some() || segment.stiffness_axial.is_some(),
                        tapers: segment.stiffness.profile().varies_on(piece),
                        curvature_rises: segment.rest_curvature.varies_on(piece),
                        steps: steps as usize * options.refinement.max(1),
                        grading,
                        ..plan
                    }
                }
                SegmentKind::Rigid(rigid) => {
                    SegmentPlan { has_dipole: rigid.coil.is_some() || rigid.is_magnet(), ..plan }
                }
            });
        }
    }
    plans
}

/// By how many eighths of an octave stiffness grows along a piece, about the axis where it changes most; zero where that is
/// little.
fn grading(segment: &RodSegment) -> i16 {
    let RodSegment::Flexible(flexible) = segment else { return 0 };
    let (near, far) = (flexible.stiffness, flexible.distal_stiffness());
    let octaves = (0..3).map(|axis| (far[axis] / near[axis]).log2()).filter(|octaves| octaves.is_finite());
    let most = octaves.fold(0.0, |most: f64, octaves| if octaves.abs() > most.abs() { octaves } else { most });
    let most = most.clamp(-MOST_OCTAVES, MOST_OCTAVES);
    if most.abs() > FEW_OCTAVES { (8.0 * most).round() as i16 } else { 0 }
}

/// How far the rest curvature of a piece turns it (rad).
fn rest_bend(segment: &RodSegment) -> f64 {
    let RodSegment::Flexible(flexible) = segment else { return 0.0 };
    let size = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let bend = flexible.length * size(flexible.rest_curvature).max(size(flexible.distal_rest_curvature()));
    if bend.is_finite() { bend } else { 0.0 }
}
