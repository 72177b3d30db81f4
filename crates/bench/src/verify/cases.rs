//! What `verify` solves: the shipped scenes over their currents and loads, and random scenes.

use crate::error::BenchError;
use crate::random::{Chain, Random};
use rodsweep::input::parse_scene;
use rodsweep::model::{
    Batch, Parameter, Plan, PlanOptions, Scene, SegmentKind, SegmentParameter, StiffnessAxis, WallParameter,
};
use rodsweep::shipped::{CANTILEVER, P6, P35, ShippedFile, TIP_COIL, TWO_COIL};
use std::path::Path;

/// Samples of each shipped scene.
const SHIPPED_SAMPLES: usize = 32;
/// Random scenes of one chain share a plan: kernels are compiled once for so many.
const SAMPLES_PER_CHAIN: usize = 25;
/// Chains at most.
const MOST_CHAINS: usize = 8;

/// Scenes that differ in values only, with every derivative that is checked.
pub struct Case {
    pub name: String,
    pub plan: Plan,
    pub batch: Batch,
    /// Axis values of each sample, SI.
    pub rows: Vec<Vec<f64>>,
}

/// A scene file and the ranges its samples are drawn from: parameter or group, largest magnitude (SI).
struct Shipped {
    file: ShippedFile,
    ranges: &'static [(&'static str, f64)],
}

/// Currents bend each catheter by one to two radians.
const SHIPPED: [Shipped; 5] = [
    Shipped { file: CANTILEVER, ranges: &[("loads.tip_force", 0.05)] },
    Shipped { file: P35, ranges: &[("coil.current", 0.2)] },
    Shipped { file: P6, ranges: &[("coil.current", 0.2), ("loads.tip_force", 5e-4)] },
    Shipped { file: TIP_COIL, ranges: &[("coil.current", 0.05)] },
    Shipped { file: TWO_COIL, ranges: &[("coil1.current", 0.1), ("coil2.current", 0.1)] },
];

impl Case {
    /// Samples whose values `draw` chooses, axis by axis.
    pub fn new(
        scene: &Scene,
        axes: &[Parameter],
        wrt: &[Parameter],
        sample_count: usize,
        mut draw: impl FnMut(Parameter) -> f64,
    ) -> Result<Case, BenchError> {
        let rows: Vec<Vec<f64>> =
            (0..sample_count).map(|_| axes.iter().map(|parameter| draw(*parameter)).collect()).collect();
        let axes: Vec<Vec<Parameter>> = axes.iter().map(|parameter| vec![*parameter]).collect();
        let plan = Plan::new(scene, &axes, wrt, PlanOptions::default())?;
        let batch = plan.batch(sample_count, |sample, row| {
            if let Some(values) = rows.get(sample) {
                row.copy_from_slice(values);
            }
        });
        Ok(Case { name: scene.name.clone(), plan, batch, rows })
    }

    pub fn sample_count(&self) -> usize {
        self.rows.len()
    }

    /// The scene of one sample, named after it.
    pub fn scene(&self, sample: usize) -> Scene {
        let mut scene = self.plan.sample_scene(&self.rows[sample]);
        scene.name = format!("{}, sample {sample}", self.name);
        scene
    }
}

/// All cases: `samples` random scenes beside the shipped ones.
pub fn cases(samples: usize, seed: u64) -> Result<Vec<Case>, BenchError> {
    let mut random = Random(seed);
    let mut cases = Vec::new();
    for shipped in &SHIPPED {
        let (file, text) = shipped.file;
        let scene = parse_scene(Path::new(file), text)?;
        cases.push(shipped_case(&scene, shipped.ranges, &mut random)?);
        if shipped.file == P6 {
            // As published codes have it; derivatives take forward columns then.
            let name = "P6 without the force arm".into();
            let scene = Scene { rigid_force_arm: false, name, ..scene };
            cases.push(shipped_case(&scene, shipped.ranges, &mut random)?);
        }
    }
    let chains = samples.div_ceil(SAMPLES_PER_CHAIN).min(MOST_CHAINS);
    for chain in 0..chains {
        // Shares that differ by one at most and sum to the whole.
        let share = samples * (chain + 1) / chains - samples * chain / chains;
        cases.push(random_case(chain, share, &mut random)?);
    }
    Ok(cases)
}

fn shipped_case(scene: &Scene, ranges: &[(&str, f64)], random: &mut Random) -> Result<Case, BenchError> {
    let mut axes = Vec::new();
    let mut sizes = Vec::new();
    for (name, size) in ranges {
        for parameter in Parameter::parse(scene, name)? {
            axes.push(parameter);
            sizes.push(*size);
        }
    }
    let size = |parameter| axes.iter().position(|axis| *axis == parameter).map_or(0.0, |k| sizes[k]);
    let wrt = derivatives(scene);
    Case::new(scene, &axes, &wrt, SHIPPED_SAMPLES, |parameter| random.within(-1.0, 1.0) * size(parameter))
}

/// Samples of one random chain.
fn random_case(number: usize, sample_count: usize, random: &mut Random) -> Result<Case, BenchError> {
    let chain = Chain::new(number, random);
    let wrt = derivatives(chain.scene());
    Case::new(chain.scene(), &chain.parameters(), &wrt, sample_count, |parameter| chain.value(parameter, random))
}

/// Currents, lengths, insertion, tip force and moment, field, base pose, rest curvature, stiffness, weight.
fn derivatives(scene: &Scene) -> Vec<Parameter> {
    use SegmentParameter as S;
    let inserts = matches!(scene.segments[0].kind, SegmentKind::Flexible(_));
    let is_wanted = |parameter: &Parameter| match parameter {
        Parameter::Insertion => inserts,
        Parameter::Gravity(_) => scene.loads.gravity.is_some(),
        Parameter::DistributedForce(_) => scene.loads.distributed_force.is_some(),
        Parameter::FluidDensity | Parameter::Wall(WallParameter::Friction) => false,
        Parameter::BasePosition(_)
        | Parameter::BaseRotation(_)
        | Parameter::FluxDensity(_)
        | Parameter::FieldGradient(_)
        | Parameter::FieldOrigin(_)
        | Parameter::Magnet(..)
        | Parameter::ArrayCurrent(..)
        | Parameter::MapScale(_)
        | Parameter::MapPosition(..)
        | Parameter::Wall(_)
        | Parameter::TipForce(_)
        | Parameter::TipMoment(_)
        | Parameter::InnerForce(..)
        | Parameter::InnerMoment(..)
        | Parameter::ForceAlong(..) => true,
        Parameter::Segment(_, S::Stiffness(axis)) => *axis != StiffnessAxis::Bending,
        Parameter::Segment(_, of) => matches!(of, S::Length | S::RestCurvature(_) | S::Current(_)),
    };
    Parameter::all(scene).into_iter().filter(is_wanted).collect()
}
