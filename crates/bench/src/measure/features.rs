//! What features of a scene cost: scenes that differ by one thing, on the CPU with its best instructions.

use super::clock::Clock;
use super::engines::Engine;
use super::problem::batch_of;
use super::session::Session;
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::backend::Precision;
use rodsweep::cpu::Cpu;
use rodsweep::model::{Parameter, PlanOptions, Quantity, Stepper};
use rodsweep::spec::SweepSpec;
use std::fmt::Write;
use std::path::Path;

const SAMPLES: usize = 512;
/// Over the rod: shared out evenly by 1, 2, 3, 4 and 6 segments.
const STEPS: usize = 12;
/// What may be differentiated by, in the order in which columns are added.
const WRT: [&str; 9] = [
    "coil1.current.x",
    "coil1.current.y",
    "coil1.current.z",
    "insertion",
    "tube1.rest_curvature.x",
    "tube1.rest_curvature.y",
    "tube1.rest_curvature.z",
    "tube1.stiffness.bending",
    "tube1.stiffness.torsion",
];
const COLUMNS: [usize; 6] = [0, 1, 3, 4, 7, 9];
const SEGMENTS: [usize; 5] = [1, 2, 3, 4, 6];
const COILS: [usize; 5] = [1, 2, 3, 4, 6];
const PLAIN: &str = "stiffness = { bending = 6e-5, torsion = 3e-5 }";

/// A rod by what it has.
struct Rod<'a> {
    tubes: usize,
    coils: usize,
    /// Replaces the plain stiffness of each tube, and adds keys.
    tube: &'a str,
    coil: &'a str,
    loads: &'a str,
    columns: usize,
}

const PLAINEST: Rod = Rod { tubes: 1, coils: 1, tube: PLAIN, coil: "", loads: "", columns: 3 };

/// Name, and how the plainest rod is changed.
const TERMS: [(&str, Rod); 9] = [
    ("plain", PLAINEST),
    ("tip force", Rod { loads: "tip_force = [5e-4, 3e-4, -5e-4]", ..PLAINEST }),
    ("tip moment", Rod { loads: "tip_moment = [2e-5, 0, 0]", ..PLAINEST }),
    (
        "weight",
        Rod {
            tube: "stiffness = { bending = 6e-5, torsion = 3e-5 }\nlinear_density = 2.9e-4",
            coil: "mass = \"58 mg\"\n",
            loads: "gravity = [9.81, 0, 0]",
            ..PLAINEST
        },
    ),
    ("anisotropy", Rod { tube: "stiffness = { bending_x = 6e-5, bending_y = 5e-5, torsion = 3e-5 }", ..PLAINEST }),
    (
        "taper",
        Rod {
            tube: "stiffness = [{ at = 0, bending = 7e-5, torsion = 3e-5 }, { at = \"120 mm\", bending = 5e-5, torsion = 2e-5 }]",
            ..PLAINEST
        },
    ),
    (
        "varying rest curvature",
        Rod {
            tube: "stiffness = { bending = 6e-5, torsion = 3e-5 }\nrest_curvature = [{ at = 0, value = [2, 0, 0] }, { at = \"120 mm\", value = [0, 2, 0] }]",
            ..PLAINEST
        },
    ),
    (
        "shear and stretch",
        Rod {
            tube: "stiffness = { bending = 6e-5, torsion = 3e-5 }\nstiffness_shear = \"40 N\"\nstiffness_axial = \"120 N\"",
            loads: "tip_force = [5e-4, 3e-4, -5e-4]",
            ..PLAINEST
        },
    ),
    (
        "magnet along the rod",
        Rod {
            tube: "stiffness = { bending = 6e-5, torsion = 3e-5 }\ndipole_per_length = [0, 0, \"1 mA·m\"]",
            ..PLAINEST
        },
    ),
];

impl Rod<'_> {
    /// The sweep over the first coil's currents.
    fn text(&self) -> String {
        let mut text = format!("[sampling]\nmethod = \"sobol\"\nsamples = {SAMPLES}\n");
        for axis in ["x", "y", "z"] {
            let _ = writeln!(text, "[[axis]]\nparameter = \"coil1.current.{axis}\"\nfrom = -0.15\nto = 0.15");
        }
        text += "[scene]\nname = \"feature\"\n[scene.field]\nflux_density = [0, 3, 0]\n[scene.loads]\n";
        text += self.loads;
        let pieces = self.tubes.max(self.coils);
        for piece in 1..=pieces {
            if piece <= self.tubes {
                let length = 0.12 / self.tubes as f64;
                let tube = self.tube;
                let _ = write!(
                    text,
                    "\n[[scene.segment]]\nname = \"tube{piece}\"\nkind = \"flexible\"\nlength = {length}\n{tube}\n"
                );
            }
            // One coil comes at the end, more follow a tube each.
            let at = if self.coils == 1 { pieces } else { piece };
            if piece == at {
                // The first is the one that is swept: it stays at the tip.
                let name = if self.coils == 1 { 1 } else { pieces + 1 - piece };
                let _ = write!(
                    text,
                    "\n[[scene.segment]]\nname = \"coil{name}\"\nkind = \"rigid\"\nlength = 0.01\n{}coil = {{ turns_area = \
                     [[1.4e-3, 0, 0], [0, 1.4e-3, 0], [0, 0, 1.6e-3]], current = [0, 0, 0] }}\n",
                    self.coil
                );
            }
        }
        text
    }
}

pub fn measure(session: &mut Session) -> Result<(), BenchError> {
    for (name, rod) in &TERMS {
        point("terms", name, f64::NAN, rod, session)?;
    }
    for columns in COLUMNS {
        point("columns", "columns", columns as f64, &Rod { columns, ..PLAINEST }, session)?;
    }
    for tubes in SEGMENTS {
        point("segments", "flexible segments", tubes as f64, &Rod { tubes, ..PLAINEST }, session)?;
    }
    for coils in COILS {
        let rod = Rod { tubes: coils, coils, ..PLAINEST };
        point("coils", "coils, each behind a flexible segment", coils as f64, &rod, session)?;
    }
    Ok(())
}

fn point(part: &str, name: &str, size: f64, rod: &Rod, session: &mut Session) -> Result<(), BenchError> {
    let mut spec = SweepSpec::parse(Path::new("feature.toml"), &rod.text())?;
    for name in &WRT[..rod.columns] {
        spec.wrt.extend(Parameter::parse(&spec.scene, name)?);
    }
    let sampler = spec.sampler();
    let mut rows = vec![vec![0.0; sampler.value_count()]; SAMPLES];
    rows.iter_mut().enumerate().for_each(|(index, row)| sampler.values(index as u64, row));
    let plan = spec.plan(PlanOptions { stepper: Stepper::Dop853, steps: STEPS, ..PlanOptions::default() })?;
    let batch = batch_of(&plan, SAMPLES, &rows);
    for precision in [Precision::F64, Precision::F32] {
        let engine = Engine::best(precision);
        let effort = session.effort;
        let (solutions, timing) = session.one_thread.install(|| -> Result<_, BenchError> {
            let mut backend = engine.make(&plan)?;
            let solutions = backend.solve(&batch)?;
            Ok((solutions, Clock::Processor.time(effort, || backend.solve(&batch))))
        })?;
        let passes = Cpu::new(&plan, precision)?.count_operations(&batch, 0);
        let failed = (0..SAMPLES).filter(|sample| !solutions.status(*sample).is_success()).count();
        let mean = |quantity| (0..SAMPLES).map(|at| solutions.get(at, quantity)).sum::<f64>() / SAMPLES as f64;
        session.records.push(Record {
            work: "cold".into(),
            engine: engine.name().into(),
            precision: precision.to_string(),
            method: plan.options.stepper.name().into(),
            size,
            samples: SAMPLES as f64,
            failed: failed as f64,
            seconds: timing.median / SAMPLES as f64,
            least: timing.least / SAMPLES as f64,
            spread: timing.spread(),
            passes: mean(Quantity::Iterations),
            ..Record::new(part, name)
        });
        if part == "terms" && name == "plain" && precision == Precision::F64 {
            for (pass, operations) in [
                ("a step along the path from rest", passes.path),
                ("a chord step on the fine grid", passes.chord),
                ("the answer, with its Jacobian and stability", passes.answer),
                ("the error estimate", passes.check),
            ] {
                let operations = operations.total() as f64;
                session.records.push(Record {
                    operations,
                    passes: mean(Quantity::Iterations),
                    ..Record::new("passes", pass)
                });
            }
        }
    }
    Ok(())
}
