//! A small sweep, and a backend that solves it by a formula.

use crate::common::root;
use rodsweep::backend::{Backend, BackendError, BackendInfo, BackendKind, Precision};
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, RodSegment, Solutions, Status};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::RunOptions;
use std::fs;
use std::path::{Path, PathBuf};

/// The tip of a circular arc whose bend follows the coils' dipoles; every 97th dipole pattern fails.
pub struct Arc {
    pub plan: Plan,
    pub batch_size: usize,
    pub precision: Precision,
    /// Added to the tip along x [m].
    pub offset: f64,
    pub fails: bool,
}

impl Arc {
    pub fn new(plan: &Plan) -> Arc {
        Arc { plan: plan.clone(), batch_size: 700, precision: Precision::F64, offset: 0.0, fails: true }
    }
}

impl Backend for Arc {
    fn info(&self) -> BackendInfo {
        let device = "arc".into();
        BackendInfo { kind: BackendKind::Cpu, precision: self.precision, device, driver: String::new() }
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn batch_size(&self) -> usize {
        self.batch_size
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let mut solutions = Solutions::new(&self.plan, batch.sample_count());
        for at in 0..batch.sample_count() {
            let rod = self.plan.sample_rod(batch, at);
            let mut bend = [0.0; 2];
            for segment in &rod.segments {
                match segment {
                    RodSegment::Rigid(rigid) => {
                        let dipole = rigid.dipole;
                        bend = [bend[0] + 2e3 * dipole[2], bend[1] + 2e3 * dipole[0]];
                    }
                    RodSegment::Flexible(flexible) => bend[0] += 1e-3 / flexible.stiffness[0].max(1e-9) * 1e-3,
                }
            }
            let angle = (bend[0] * bend[0] + bend[1] * bend[1]).sqrt().max(1e-12);
            let (length, error) = (rod.total_length(), 1.0 / (self.plan.options.steps as f64).powi(8));
            let (sine, cosine) = angle.sin_cos();
            let [x, y] = bend.map(|b| b / angle);
            let out = length * (1.0 - cosine) / angle;
            let tip = [x * out + self.offset, y * out, length * (sine / angle + error)];
            solutions.set_vector(at, Quantity::TipPosition, tip);
            solutions.set_vector(at, Quantity::TipD1, [cosine * x * x + y * y, (cosine - 1.0) * x * y, -sine * x]);
            solutions.set_vector(at, Quantity::TipTangent, [x * sine, y * sine, cosine]);
            solutions.set_vector(at, Quantity::BaseMoment, [bend[0] * 1e-6, bend[1] * 1e-6, 0.0]);
            solutions.set(at, Quantity::StabilityMargin, 0.5);
            solutions.set(at, Quantity::ErrorEstimate, error);
            for derivative in 0..self.plan.derivatives.len() {
                for row in 0..self.plan.rows() {
                    let column = solutions.derivative_column(derivative, row);
                    solutions.values.set(at, column, tip[row % 3] * (1.0 + row as f64));
                }
            }
            let fails = self.fails && ((tip[0] * 1e9).abs() as u64).is_multiple_of(97);
            solutions.set_status(at, if fails { Status::NotConverged } else { Status::Ok });
        }
        Ok(solutions)
    }
}

/// Folder of the shipped sweeps.
pub fn shipped() -> PathBuf {
    root().join("sweeps")
}

const SMALL: &str = r#"
scene = "scenes/p6.toml"
[sampling]
method = "uniform"
samples = 5000
seed = 3
[[axis]]
parameter = "coil.current.x"
from = -0.1
to = 0.1
[[axis]]
parameters = ["proximal.youngs_modulus", "distal.youngs_modulus"]
from = "5 MPa"
to = "6 MPa"
[output]
derivatives = ["coil.current"]
"#;

/// Five thousand samples.
pub fn small(format: &str) -> SweepSpec {
    let text = format!("{SMALL}format = \"{format}\"\n");
    SweepSpec::parse(&shipped().join("small.toml"), &text).unwrap()
}

pub fn arc(spec: &SweepSpec) -> Arc {
    Arc::new(&spec.plan(PlanOptions::default()).unwrap())
}

/// Five parts.
pub fn options<'a>() -> RunOptions<'a> {
    RunOptions { chunk: 1000, ..RunOptions::new() }
}

/// Names of the parts, in order.
pub fn parts(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with("part-") && !name.ends_with(".json") && !name.contains(".bad"))
        .collect();
    names.sort();
    names
}

/// Every part's bytes.
pub fn contents(dir: &Path) -> Vec<(String, Vec<u8>)> {
    parts(dir).into_iter().map(|name| (name.clone(), fs::read(dir.join(name)).unwrap())).collect()
}
