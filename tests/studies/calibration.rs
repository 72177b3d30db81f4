//! Which measurements tell the parameters of P6: Jacobians, information, choice, the worst over what is uncertain.

use crate::common::root;
use crate::sensitivity::{golden, with_rows};
use rodsweep::spec::SweepSpec;
use rodsweep::study::sensitivity::{Chosen, SensitivityError, SensitivityJob};

/// What is to be found, as the golden files have it.
const UNKNOWNS: [&str; 5] = [
    "proximal.youngs_modulus+distal.youngs_modulus",
    "proximal.shear_modulus+distal.shear_modulus",
    "proximal.rest_curvature.x",
    "proximal.rest_curvature.y",
    "coil.turns.x+coil.turns.y+coil.turns.z",
];
const PRIOR: &str = "
[[uncertain]]
parameters = [\"proximal.youngs_modulus\", \"distal.youngs_modulus\"]
relative = \"10 %\"
[[uncertain]]
parameter = \"proximal.rest_curvature.x\"
from = 0.24
to = 1.24
";

fn lines(file: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(root().join("tests/data/analyses").join(file)).expect("a golden file");
    text.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect()
}

/// The golden candidates as the table of a sweep.
fn candidates(more: &str) -> SensitivityJob {
    let folder = tempfile::tempdir().expect("a folder");
    let mut table = "coil.current.x,coil.current.y,coil.current.z\n".to_owned();
    for row in lines("p6_dopt_candidates.csv") {
        table += &format!("{:?},{:?},{:?}\n", row[0], row[1], row[2]);
    }
    std::fs::write(folder.path().join("candidates.csv"), table).expect("a file");
    let scene = root().join("sweeps/scenes/p6.toml");
    let text = format!(
        "scene = \"{}\"\n[sampling]\nmethod = \"table\"\nfile = \"candidates.csv\"\n{more}\n[solver]\ntolerance = 1e-8\n",
        scene.display()
    );
    let spec = SweepSpec::parse(&folder.path().join("sweep.toml"), &text).unwrap_or_else(|error| panic!("{error}"));
    SensitivityJob::of_sweep(spec)
}

fn chosen(found: &rodsweep::study::sensitivity::Sensitivity) -> &Chosen {
    found.identification.as_ref().and_then(|found| found.chosen.as_ref()).expect("a choice")
}

#[test]
fn the_golden_measurements_are_chosen() {
    let golden = golden("p6_dopt.json");
    let job = with_rows(candidates("").inputs(&UNKNOWNS).noise(Some(5e-4)));
    // The golden Jacobians are those of the tip over this noise.
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
    };
    for (margin, key) in [(0.0, "designs"), (0.3, "with_margin_03")] {
        for count in [4, 6, 10] {
            let found = job.clone().minimum_margin(margin).choose(Some(count)).run().unwrap_or_else(|e| panic!("{e}"));
            let told = found.identification.as_ref().expect("identification");
            if margin == 0.0 {
                for (found, expected) in told.all.eigenvalues.iter().zip(numbers(&golden["eigenvalues_all"])) {
                    assert!((found / expected - 1.0).abs() < 2e-5, "{found}, golden {expected}");
                }
            }
            let expected = golden[key][count.to_string()]["logdet"].as_f64().expect("a number");
            let log_determinant = chosen(&found).information.log_determinant;
            assert!(log_determinant > expected - 1e-4, "{key} {count}: {log_determinant}, golden {expected}");
            assert!(chosen(&found).margins.iter().all(|found| *found >= margin));
            assert_eq!(chosen(&found).worst, None);
        }
    }
    let found = job.clone().minimum_margin(0.0).choose(Some(4)).run().expect("a choice");
    let told = found.identification.as_ref().expect("identification");
    assert_eq!(told.parameters, UNKNOWNS);
    assert_eq!(told.logarithmic, [true, true, false, false, true]);
    let weakest = &told.all.directions.last().expect("directions").weights;
    for (found, expected) in weakest.iter().zip(numbers(&golden["weakest"])) {
        assert!((found.abs() - expected.abs()).abs() < 1e-3, "{weakest:?}");
    }
    // In the words of a fit: scaling stiffness and windings alike changes little.
    let words = told.all.findings.join("; ") + &chosen(&found).information.findings.join("; ");
    assert!(words.contains("coil.turns.x+coil.turns.y+coil.turns.z"), "{words}");
    let sd = chosen(&found).information.deviations[0];
    assert!((sd - 0.66).abs() < 0.01, "{sd}");
    let few = job.choose(Some(1000)).run().expect_err("too many");
    assert!(matches!(few, SensitivityError::TooFewCandidates { asked: 1000, .. }), "{few}");
}

#[test]
fn the_worst_end_is_told_and_the_choice_is_a_table_to_run() {
    let job = with_rows(candidates(PRIOR).noise(Some(5e-4)).choose(Some(3)));
    let found = job.run().unwrap_or_else(|error| panic!("{error}"));
    let told = found.identification.as_ref().expect("identification");
    assert_eq!(told.parameters, [UNKNOWNS[0], UNKNOWNS[2]]);
    let chosen = chosen(&found);
    let (worst, end) = chosen.worst.as_ref().expect("ends");
    assert!(*worst < chosen.information.log_determinant && worst.is_finite(), "{worst}");
    assert!(end.contains("low") || end.contains("high"), "{end}");
    // The table is one that a sweep reads.
    let folder = tempfile::tempdir().expect("a folder");
    let files = found.write(folder.path()).expect("files");
    assert!(
        files.iter().any(|file| file.ends_with("design.csv")) && files.iter().any(|file| file.ends_with("fisher.csv"))
    );
    let table =
        rodsweep::input::read_input_table(&folder.path().join("design.csv"), &job.spec().scene).expect("a table");
    assert_eq!((table.row_count(), table.parameters().len()), (3, 3));
}
