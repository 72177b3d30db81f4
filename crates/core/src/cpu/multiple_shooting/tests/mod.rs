//! The method by nodes against other ways: a dense solve, and the energy of a chain.
#![allow(non_snake_case)]

mod chain;
mod elimination;
mod index;
mod memory;

use super::state::Nodes;
use crate::cpu::algebra::{Mat3, Vec3};
use crate::cpu::rod::problem::{Problem, Workspace};
use crate::cpu::rod::program::{Inputs, Program};
use crate::cpu::rod::segments::Rod;
use crate::cpu::rod::terms::ProgramTerms;
use crate::cpu::simd::lane::{F64, Lane};
use crate::model::{Parameter, Plan, PlanOptions, Scene, Stepper, Vector};
use nalgebra::{Matrix3, Vector3};

type L = F64<pulp::Scalar>;

fn lane(x: f64) -> L {
    L::splat(pulp::Scalar::new(), x)
}

fn number(x: L) -> f64 {
    let mut stored = [0.0];
    x.store(&mut stored);
    stored[0]
}

fn lanes(v: Vector3<f64>) -> Vec3<L> {
    Vec3 { x: lane(v.x), y: lane(v.y), z: lane(v.z) }
}

fn numbers(v: Vec3<L>) -> Vector3<f64> {
    Vector3::new(number(v.x), number(v.y), number(v.z))
}

fn matrix(m: Mat3<L>) -> Matrix3<f64> {
    Matrix3::from_columns(&[m.x, m.y, m.z].map(numbers))
}

fn vector(v: Vector) -> Vector3<f64> {
    Vector3::new(v[0], v[1], v[2])
}

/// One rod in a lane of its own.
struct Single {
    plan: Plan,
    program: Program,
    rod: Rod<L>,
}

impl Single {
    /// Of a scene, with derivatives by these parameters.
    fn new(scene: &Scene, wrt: &[&str]) -> Self {
        let parameters = |name: &&str| Parameter::parse(scene, name).expect("parameters");
        let wrt: Vec<Parameter> = wrt.iter().flat_map(parameters).collect();
        let plan = Plan::new(scene, &[], &wrt, PlanOptions::default()).expect("a plan");
        let mut program = Program::new(&plan, f64::EPSILON);
        program.terms = ProgramTerms::EVERY;
        let token = pulp::Scalar::new();
        let mut rod = Rod::new(token);
        rod.load(&program, token, &Inputs { data: &[], stride: 1, offset: 0 });
        Self { plan, program, rod }
    }

    fn problem(&self) -> Problem<'_, L> {
        let inputs = Inputs { data: &[], stride: 1, offset: 0 };
        Problem { program: &self.program, inputs, rod: &self.rod }
    }

    /// Its mesh laid, with so many steps of DOP853 in each interval.
    fn nodes(&self, spacing: f64, steps: usize) -> (Nodes<L>, Workspace<L>) {
        let token = pulp::Scalar::new();
        let mut nodes = Nodes::new(token, &self.program);
        nodes.mesh.cut(&self.problem(), spacing);
        nodes.resolve(Stepper::Dop853.tableau(), steps);
        (nodes, Workspace::new(token, &self.program))
    }
}

/// Numbers from -1 to 1 (SplitMix64).
struct Random(u64);

impl Random {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn matrix(&mut self) -> Mat3<L> {
        let mut column = || Vec3 { x: lane(self.number()), y: lane(self.number()), z: lane(self.number()) };
        Mat3 { x: column(), y: column(), z: column() }
    }
}
