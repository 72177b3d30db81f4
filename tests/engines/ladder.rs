//! The ladder of methods: the guide's table is that of the code, and a sample takes the rungs that it says.

use crate::common::root;
use rodsweep::backend::{Backend, LadderLine, Precision};
use rodsweep::cpu::{Cpu, ladder};
use rodsweep::model::{PlanOptions, Status};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::ATTEMPTS;
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
