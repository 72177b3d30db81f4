//! What changes with what: record entries and chain-rule coefficients that a swept parameter moves.

use super::rod::record_offsets;
use super::{CoilWinding, Parameter, Rigid, Rod, Scene, SegmentKind, SegmentParameter, StiffnessAxis};

/// Record entries that a swept parameter changes.
pub(super) fn touched_entries(parameter: Parameter, scene: &Scene, rod: &Rod, swept: &[Parameter]) -> Vec<usize> {
    let offsets = record_offsets(&rod.segments);
    // Length comes first in a segment's record; the load's three entries come last.
    let load = |segment: usize| offsets[segment] + rod.segments[segment].record_len() - 3;
    match parameter {
        Parameter::BaseRotation(_) => (0..6).collect(),
        Parameter::FluxDensity(axis) => vec![6 + axis.index()],
        Parameter::TipForce(axis) => vec![9 + axis.index()],
        Parameter::TipMoment(axis) => vec![12 + axis.index()],
        Parameter::BasePosition(axis) => vec![15 + axis.index()],
        Parameter::Insertion => vec![offsets[0]],
        Parameter::Gravity(axis) | Parameter::DistributedForce(axis) => {
            (0..offsets.len()).map(|segment| load(segment) + axis.index()).collect()
        }
        Parameter::FluidDensity => (0..offsets.len()).flat_map(|s| load(s)..load(s) + 3).collect(),
        Parameter::Segment(index, parameter) => {
            let at = offsets[index];
            let loads = load(index)..load(index) + 3;
            use SegmentParameter as S;
            match parameter {
                S::Length => std::iter::once(at).chain(loads).collect(),
                S::RestCurvature(axis) => vec![at + 4 + axis.index()],
                S::Stiffness(StiffnessAxis::Bending) => vec![at + 1, at + 2],
                S::Stiffness(StiffnessAxis::BendingX) => vec![at + 1],
                S::Stiffness(StiffnessAxis::BendingY) => vec![at + 2],
                S::Stiffness(StiffnessAxis::Torsion) => vec![at + 3],
                S::YoungsModulus | S::ShearModulus | S::PoissonRatio => (at + 1..at + 4).collect(),
                S::InnerRadius | S::OuterRadius => (at + 1..at + 4).chain(loads).collect(),
                S::Density | S::LinearDensity | S::Mass => loads.collect(),
                S::Current(axis) | S::Turns(axis) | S::Area(axis) => {
                    if is_aligned(scene, index, swept) {
                        vec![at + 1 + axis.index()]
                    } else {
                        (at + 1..at + 4).collect()
                    }
                }
                S::Alignment(_) => (at + 1..at + 4).collect(),
            }
        }
    }
}

/// Whether each current of a coil set moves one component of the dipole.
fn is_aligned(scene: &Scene, index: usize, swept: &[Parameter]) -> bool {
    let tilts = |p: &Parameter| matches!(p, Parameter::Segment(i, SegmentParameter::Alignment(_)) if *i == index);
    match &scene.segments[index].kind {
        SegmentKind::Rigid(Rigid { coil: Some(coil), .. }) => {
            matches!(coil.winding, CoilWinding::Axes { .. }) && coil.alignment == [0.0; 3] && !swept.iter().any(tilts)
        }
        _ => false,
    }
}

/// Whether sweeping `other` may change the chain-rule coefficients of `parameter`.
pub(super) fn changes_chain(parameter: Parameter, other: Parameter) -> bool {
    use Parameter as P;
    use SegmentParameter as S;
    match (parameter, other) {
        (P::BaseRotation(_), P::BaseRotation(_)) => true,
        // Densities weigh gravity's derivative; gravity weighs the derivative by densities.
        (P::Gravity(_), P::Segment(_, parameter)) => {
            matches!(parameter, S::Density | S::LinearDensity | S::Mass | S::Length | S::InnerRadius | S::OuterRadius)
        }
        (P::Gravity(_), P::FluidDensity) | (P::FluidDensity, P::Gravity(_)) => true,
        (P::FluidDensity, P::Segment(_, S::InnerRadius | S::OuterRadius)) => true,
        (P::Segment(..), P::Gravity(_) | P::FluidDensity) => true,
        (P::Segment(a, of), P::Segment(b, by)) => {
            let linear = |p: S| matches!(p, S::Current(_) | S::RestCurvature(_) | S::Stiffness(_));
            a == b && !(linear(of) && linear(by)) && !matches!(of, S::RestCurvature(_) | S::Stiffness(_))
        }
        _ => false,
    }
}
