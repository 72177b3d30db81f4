//! Controllers of the P6 prototype and what they are asked for.

use crate::common::root;
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::input::read_scene;
use rodsweep::model::{Parameter, Plan, Scene};
use rodsweep::spec::{ControlInput, Target};

pub fn p6() -> Scene {
    read_scene(&root().join("sweeps/scenes/p6.toml")).expect("the scene")
}

pub fn inputs(scene: &Scene, limits: &[(&str, f64, f64)]) -> Vec<ControlInput> {
    let of = |(name, low, high): &(&str, f64, f64)| -> Vec<ControlInput> {
        let parameters = Parameter::parse(scene, name).expect("parameters");
        parameters.into_iter().map(|parameter| ControlInput::new(parameter, *low, *high)).collect()
    };
    limits.iter().flat_map(of).collect()
}

/// With the best instructions of this machine.
pub fn cpu(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::new(plan, Precision::F64)?))
}

pub fn positions(positions: impl IntoIterator<Item = [f64; 3]>) -> Vec<Target> {
    positions.into_iter().map(Target::at).collect()
}

pub fn circle(centre: [f64; 3], radius: f64, count: usize) -> Vec<Target> {
    positions((0..count).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
        [centre[0] + radius * cos, centre[1] + radius * sin, centre[2]]
    }))
}
