//! A box of inputs around a scene: some of its numbers vary by some percent to some tens of percent.

use super::numbers::Random;
use rodsweep::model::{Axis, MagnetParameter, Parameter, Scene, SegmentParameter, StiffnessAxis};
use rodsweep::spec::{AxisSpec, Distribution};

/// Axes of a box at most, and how far they reach, as a share of the largest component beside the number.
const MOST_AXES: usize = 4;
const REACH: (f64, f64) = (0.02, 0.4);

/// One to four axes; none where the scene has no number that can vary.
pub fn around(scene: &Scene, random: &mut Random) -> Vec<AxisSpec> {
    let mut left: Vec<Parameter> = Parameter::all(scene).into_iter().filter(|of| may_vary(scene, *of)).collect();
    let count = 1 + (random.unit() * (MOST_AXES as f64 - 0.001)) as usize;
    let mut axes = Vec::new();
    while axes.len() < count && !left.is_empty() {
        let parameter = left.swap_remove((random.unit() * left.len() as f64) as usize);
        let at = parameter.get(scene);
        let reach = random.between(REACH.0, REACH.1) * size(scene, parameter);
        let distribution = Distribution::Uniform { from: at - reach, to: at + reach };
        axes.push(AxisSpec { parameters: vec![parameter], distribution, scales: false, points: 0 });
    }
    axes
}

/// Numbers that are there, and whose change leaves a rod.
fn may_vary(scene: &Scene, parameter: Parameter) -> bool {
    use SegmentParameter as S;
    let is_kind = match parameter {
        Parameter::Insertion | Parameter::FluidDensity | Parameter::FieldOrigin(_) => false,
        Parameter::BasePosition(_) => scene.sources.varies(),
        Parameter::Segment(_, S::Stiffness(axis)) => axis == StiffnessAxis::Torsion,
        Parameter::Segment(_, of) => {
            matches!(of, S::Current(_) | S::Length | S::YoungsModulus | S::DipolePerLength(_) | S::RestCurvature(_))
        }
        _ => true,
    };
    is_kind && size(scene, parameter) > 0.0
}

/// Size of a number: of the vector that it is a component of.
fn size(scene: &Scene, parameter: Parameter) -> f64 {
    let largest = |of: &dyn Fn(Axis) -> Parameter| {
        Axis::ALL.into_iter().map(|axis| of(axis).get(scene).abs()).fold(0.0, f64::max)
    };
    use SegmentParameter as S;
    match parameter {
        Parameter::BaseRotation(_) => 1.0,
        Parameter::BasePosition(_) => 0.1 * scene.total_length(),
        Parameter::FluxDensity(_) => largest(&Parameter::FluxDensity),
        Parameter::TipForce(_) => largest(&Parameter::TipForce),
        Parameter::TipMoment(_) => largest(&Parameter::TipMoment),
        Parameter::Gravity(_) => largest(&Parameter::Gravity),
        Parameter::DistributedForce(_) => largest(&Parameter::DistributedForce),
        Parameter::InnerForce(force, _) => largest(&|axis| Parameter::InnerForce(force, axis)),
        Parameter::InnerMoment(load, _) => largest(&|axis| Parameter::InnerMoment(load, axis)),
        Parameter::ForceAlong(force, _) => largest(&|axis| Parameter::ForceAlong(force, axis)),
        Parameter::Segment(at, S::Current(_)) => largest(&|axis| Parameter::Segment(at, S::Current(axis))),
        Parameter::Segment(at, S::DipolePerLength(_)) => {
            largest(&|axis| Parameter::Segment(at, S::DipolePerLength(axis)))
        }
        Parameter::Segment(at, S::RestCurvature(_)) => {
            largest(&|axis| Parameter::Segment(at, S::RestCurvature(axis))).max(1.0 / scene.total_length())
        }
        Parameter::Magnet(_, MagnetParameter::Position(_)) => 0.3 * scene.total_length(),
        Parameter::Magnet(_, MagnetParameter::Rotation(_)) => 1.0,
        _ => parameter.get(scene).abs(),
    }
}
