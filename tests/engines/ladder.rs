//! The ladder of methods: the guide's table is that of the code, and a sample takes the rungs that it says.

use crate::common::root;
use rodsweep::backend::{Backend, BackendKind, LadderLine, Precision};
use rodsweep::cpu::{Cpu, ladder};
use rodsweep::engines::EngineRequest;
use rodsweep::model::{PlanOptions, Quantity, Status};
use rodsweep::reference::Reference;
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{ATTEMPTS, Memory, SweepJob};
use std::fs;

#[test]
fn the_guide_has_the_ladder_of_the_code() {
    let guide = fs::read_to_string(root().join("docs/method.md")).expect("the guide");
    let row = |LadderLine { rung, samples, decides }: &LadderLine| format!("| {rung} | {samples} | {decides} |");
    let rows: Vec<String> = ladder().iter().chain(&ATTEMPTS).map(row).collect();
    assert!(guide.contains(&rows.join("\n")), "docs/method.md should have\n{}", rows.join("\n"));
    for line in ladder().iter().chain(&ATTEMPTS) {
        for word in line.decides.split('`').skip(1).step_by(2) {
            assert!(Status::ALL.iter().any(|status| status.name() == word), "{word} is no status");
        }
    }
}

/// Rungs of one sample of a scene by the CPU in f64: names, and how many samples each has left.
fn rungs(scene: &str) -> Vec<(String, u64)> {
    let text = "scene = \"<scene>\"\n[sampling]\nmethod = \"sobol\"\nsamples = 1\n[[axis]]\nparameter = \"insertion\"\nfrom = 0.1\nto = 0.1001\n";
    let spec = SweepSpec::parse_with(&root().join("sweeps/s.toml"), text, &[("<scene>", scene)]).expect("a sweep");
    let plan = spec.plan(PlanOptions::default()).expect("a plan");
    let batch = plan.batch(1, |_, row| row[0] = 0.105);
    let mut lanes = Cpu::new(&plan, Precision::F64).expect("available");
    lanes.solve(&batch).expect("solved");
    lanes.rungs().into_iter().map(|rung| (rung.rung, rung.left)).collect()
}

#[test]
fn a_sample_takes_the_rungs_of_its_kind() {
    const SCENE: &str = r#"
[field]
flux_density = [0, FIELD, 0]
[[segment]]
name = "rod"
kind = "flexible"
length = "100 mm"
stiffness = { bending = 1e-4, torsion = 1e-4 }
[[segment]]
name = "magnet"
kind = "rigid"
length = "5 mm"
dipole_per_length = [0, 0, 1.0]
"#;
    assert_eq!(rungs(&SCENE.replace("FIELD", "0.1")), [("load steps".to_owned(), 0)]);
    // A rod that points nearly against its field snaps over: its load turns on the curve.
    let snaps = SCENE.replace("[0, FIELD, 0]", "[0, \"20 mT\", \"-0.9 T\"]");
    let taken = rungs(&snaps);
    assert_eq!(taken.first(), Some(&("load steps".to_owned(), 1)));
    assert!(taken.iter().any(|(rung, _)| rung == "curve of equilibria"), "{taken:?}");
    let beside = SCENE.replace("[0, FIELD, 0]", "[0, 0.1, 0]") + "[field.gradient]\nxx = 0.01\n";
    assert_eq!(rungs(&beside), [("load steps in a field".to_owned(), 0)]);
}

/// A wire with a magnet at its tip beside a large one, on too few steps.
const GUIDEWIRE: &str = r#"scene = "<scene>"
[sampling]
method = "sobol"
samples = 1024
[[axis]]
parameter = "magnets.arm.position.x"
from = "-100 mm"
to = "100 mm"
[[axis]]
parameter = "magnets.arm.position.z"
from = "0 mm"
to = "150 mm"
[[axis]]
parameter = "insertion"
from = "33 mm"
to = "63 mm"
[solver]
steps = 8
[output]
derivatives = ["magnets.arm.position.x"]
"#;

/// Rows that only miss the tolerance are not led from rest again, and what they become is where the reference is.
#[test]
fn a_row_above_the_tolerance_is_answered_from_its_own_load() {
    let scene = fs::read_to_string(root().join("tests/data/jumps/guidewire.scene.toml")).expect("there");
    let spec =
        SweepSpec::parse_with(&root().join("sweeps/s.toml"), GUIDEWIRE, &[("<scene>", &scene)]).expect("a sweep");
    let mut rows = Memory::new();
    let job = SweepJob::new(spec.clone()).engine(EngineRequest::of(BackendKind::Cpu)).spot_check(None).path_check(None);
    let summary = job.run(&mut rows).expect("a run");
    let answered = summary.rungs.iter().find(|rung| rung.rung == "answer on finer steps").expect("some are doubtful");
    assert!(answered.samples > 20 && 10 * answered.left < answered.samples, "{:?}", summary.rungs);

    let rows = rows.into_table();
    let refined: Vec<usize> = (0..1024).filter(|at| rows.statuses()[*at] == Status::Refined).collect();
    assert!(refined.len() as u64 >= answered.samples - answered.left, "{} refined", refined.len());
    let plan = spec.plan(PlanOptions::default()).expect("a plan");
    let sampler = spec.sampler();
    let batch = plan.batch(refined.len(), |at, row| {
        if let Some(sample) = refined.get(at) {
            sampler.values(*sample as u64, row);
        }
    });
    let truth = Reference::new(&plan).solve(&batch).expect("solved");
    let column = |name: &str| rows.numbers(name).expect(name);
    let tip = ["x", "y", "z"].map(|axis| column(&format!("tip.position.{axis}")));
    let slope = ["x", "y", "z"].map(|axis| column(&format!("d(tip.position.{axis})/d(magnets.arm.position.x)")));
    let (estimate, of_slope) = (column("error_estimate"), column("derivative_error"));
    for (row, at) in refined.into_iter().enumerate() {
        assert!(truth.status(row).is_success(), "sample {at}: {:?}", truth.status(row));
        let apart =
            |own: &[Vec<f64>; 3], other: [f64; 3]| (0..3).map(|k| (own[k][at] - other[k]).powi(2)).sum::<f64>().sqrt();
        let error = apart(&tip, truth.vector(row, Quantity::TipPosition)) / plan.scene.total_length();
        let allowed = estimate[at] + truth.get(row, Quantity::ErrorEstimate);
        assert!(estimate[at] <= 1e-6 && error <= allowed, "sample {at}: {error:.1e} against {allowed:.1e}");
        let exact = [0, 1, 2].map(|axis| truth.derivative(row, 0, axis));
        let size = exact.iter().map(|x| x * x).sum::<f64>().sqrt();
        let error = apart(&slope, exact) / size;
        let allowed = of_slope[at] + truth.get(row, Quantity::DerivativeError);
        assert!(error <= allowed.max(1e-6), "sample {at}: derivative {error:.1e} against {allowed:.1e}");
    }
}
