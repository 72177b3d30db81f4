//! Random sweeps of rods with short stretches.

use crate::random::{Random, RandomScenes};
use rodsweep::model::{Axis, Node, Parameter, Plan, PlanOptions, Profile, Scene, SegmentKind, Stiffness};
use rodsweep::spec::{
    AxisSpec, BranchChoice, Distribution, Format, Method, OutputQuantity, PrecisionChoice, SweepSpec, WorkspaceOptions,
};

/// Samples of a sweep: the pilot takes others than those that are looked at.
const SAMPLES: u64 = 1 << 20;

/// The sweep of a scene: two axes, up to four derivatives. `None` where short stretches make no scene of it.
pub fn random_sweep(kind: RandomScenes, seed: u64, number: u64) -> Option<SweepSpec> {
    let mut random = Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ number.wrapping_mul(0xd134_2543_de82_ef95));
    let mut scene = kind.scene(seed, number);
    roughen(&mut scene, &mut random);
    let all: Vec<Parameter> = Parameter::all(&scene).into_iter().filter(|p| parameter_is_plain(p, &scene)).collect();
    if all.is_empty() {
        return None;
    }
    let pick = |random: &mut Random| all[(random.unit() * all.len() as f64) as usize % all.len()];
    let mut wrt: Vec<Parameter> = Vec::new();
    for _ in 0..4 {
        let parameter = pick(&mut random);
        if !wrt.contains(&parameter) {
            wrt.push(parameter);
        }
    }
    let mut axes: Vec<AxisSpec> = Vec::new();
    for _ in 0..2 {
        let parameter = pick(&mut random);
        let value = parameter.get(&scene);
        let spread = if value == 0.0 { 0.1 } else { 0.2 * value.abs() };
        let is_new = axes.iter().all(|axis| !axis.parameters.contains(&parameter));
        if is_new && (value != 0.0 || matches!(parameter, Parameter::BaseRotation(_))) {
            let distribution = Distribution::Uniform { from: value - spread, to: value + spread };
            axes.push(AxisSpec { parameters: vec![parameter], distribution, scales: false, points: 0 });
        }
    }
    if axes.is_empty() {
        let distribution = Distribution::Uniform { from: -0.2, to: 0.2 };
        let parameters = vec![Parameter::BaseRotation(Axis::X)];
        axes.push(AxisSpec { parameters, distribution, scales: false, points: 0 });
    }
    let quantities = OutputQuantity::usual(&scene, &wrt);
    Some(SweepSpec {
        file: Default::default(),
        scene,
        method: Method::Uniform,
        // A number that TOML can hold.
        seed: random.bits() >> 1,
        sample_count: SAMPLES,
        axes,
        uncertain: Vec::new(),
        skeleton: None,
        table: None,
        tolerance: 1e-6,
        derivative_tolerance: 1e-3,
        branch: BranchChoice::FromRest,
        precision: PrecisionChoice::Usual,
        steps: None,
        anchors: false,
        allow_failures: None,
        quantities,
        wrt,
        single_derivatives: false,
        format: Format::Parquet,
        rows_in_folder: false,
        workspace: WorkspaceOptions::default(),
        notes: Vec::new(),
    })
}

/// Those that a scene has and that move the rod.
fn parameter_is_plain(parameter: &Parameter, scene: &Scene) -> bool {
    let mut probe = scene.clone();
    let is_set = parameter.set(&mut probe, parameter.get(scene)).is_ok();
    let is_entry = !matches!(parameter, Parameter::Insertion | Parameter::FluidDensity | Parameter::BasePosition(_));
    is_set && is_entry && Plan::new(scene, &[vec![*parameter]], &[*parameter], PlanOptions::default()).is_ok()
}

/// Gives a scene short stretches: tapers of up to a hundred times, kinks in rest curvature, short segments.
fn roughen(scene: &mut Scene, random: &mut Random) {
    for segment in &mut scene.segments {
        if random.chance(0.15) {
            segment.length *= random.between(0.02, 0.3);
        }
        let length = segment.length;
        let SegmentKind::Flexible(flexible) = &mut segment.kind else { continue };
        if random.chance(0.5) {
            let value = flexible.stiffness.principal();
            let factor = random.between(1.0 / 60.0, 1.0);
            let (stiff, soft) = (value, value.map(|k| k * factor));
            let (first, last) = if random.chance(0.5) { (stiff, soft) } else { (soft, stiff) };
            let at = length * random.within(0.05, 0.8);
            let width = (length * random.between(1e-3, 0.3)).min(0.95 * length - at).max(1e-4 * length);
            let nodes = vec![Node { at, value: first }, Node { at: at + width, value: last }];
            flexible.stiffness = Stiffness::Nodes(nodes);
        }
        if random.chance(0.3) {
            let turn = random.within(0.0, 2.0);
            let at = length * random.within(0.05, 0.8);
            let width = (length * random.between(1e-3, 0.3)).min(0.95 * length - at).max(1e-4 * length);
            let [first, last] = [0, 1].map(|_| random.vector(turn / length));
            flexible.rest_curvature =
                Profile::Nodes(vec![Node { at, value: first }, Node { at: at + width, value: last }]);
        }
    }
}
