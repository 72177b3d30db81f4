//! The study on P6 and on closed forms: indices, spreads, jumps, failures, chosen experiments, bad input.

use crate::common::root;
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::spec::SweepSpec;
use rodsweep::study::sensitivity::{EstimatorChoice, Index, Order, Sensitivity, SensitivityError, SensitivityJob};
use rodsweep::sweep::{Memory, SweepJob};
use rodsweep::table::Table;
use serde_json::Value;

/// The eight inputs of the golden files, by their names there.
const INPUTS: [(&str, &str); 8] = [
    ("E", "parameters = [\"proximal.youngs_modulus\", \"distal.youngs_modulus\"]"),
    ("G", "parameters = [\"proximal.shear_modulus\", \"distal.shear_modulus\"]"),
    ("kx", "parameter = \"proximal.rest_curvature.x\""),
    ("ky", "parameter = \"proximal.rest_curvature.y\""),
    ("Nx", "parameter = \"coil.turns.x\""),
    ("Ny", "parameter = \"coil.turns.y\""),
    ("Nz", "parameter = \"coil.turns.z\""),
    ("B", "parameter = \"field.flux_density.y\""),
];

pub fn golden(file: &str) -> Value {
    let text = std::fs::read_to_string(root().join("tests/data/analyses").join(file)).expect("a golden file");
    serde_json::from_str(&text).expect("JSON")
}

/// P6 at these currents, every input uniform within 10 %.
pub fn p6(current: [f64; 3], sampling: &str) -> SweepSpec {
    let axes: String = INPUTS.iter().map(|(_, what)| format!("[[axis]]\n{what}\nrelative = \"10 %\"\n")).collect();
    let text = format!("scene = \"scenes/p6.toml\"\n[sampling]\n{sampling}\n{axes}[solver]\ntolerance = 1e-7\n");
    let spec = SweepSpec::parse(&root().join("sweeps/sensitivity.toml"), &text);
    let mut spec = spec.unwrap_or_else(|error| panic!("{error}\n{text}"));
    let names: Vec<String> =
        ["x", "y", "z"].iter().zip(current).map(|(axis, value)| format!("coil.current.{axis}={value}")).collect();
    rodsweep::input::assign(&mut spec.scene, &names).expect("currents");
    spec
}

/// The job with its rows, on the CPU.
pub fn with_rows(job: SensitivityJob) -> SensitivityJob {
    let mut rows = Memory::new();
    let run = SweepJob::new(job.sweep()).engine(EngineRequest::of(BackendKind::Cpu)).spot_check(None);
    run.run(&mut rows).expect("a run");
    job.with_rows(rows.into_table())
}

pub fn study(spec: SweepSpec) -> Sensitivity {
    with_rows(SensitivityJob::of_sweep(spec)).run().unwrap_or_else(|error| panic!("{error}"))
}

/// Name of an input in a study, by its name in the golden files.
fn name(short: &str) -> String {
    let (_, what) = INPUTS.iter().find(|(name, _)| *name == short).expect("an input");
    let quoted: Vec<&str> = what.split('"').skip(1).step_by(2).collect();
    quoted.join("+")
}

pub fn index<'a>(found: &'a Sensitivity, output: &str, input: &str, order: Order, estimator: &str) -> &'a Index {
    let is_meant = |index: &&Index| {
        index.output == output && index.input == input && index.order == order && index.estimator == estimator
    };
    found.indices.iter().find(is_meant).unwrap_or_else(|| panic!("no {order:?} of {output} by {input}, {estimator}"))
}

fn half_width(index: &Index) -> f64 {
    0.5 * (index.estimate.high - index.estimate.low)
}

const OUTPUTS: [(&str, &str); 4] =
    [("x", "tip.position.x"), ("y", "tip.position.y"), ("z", "tip.position.z"), ("margin", "stability.margin")];

/// Pick-freeze indices lie within three joint errors of the golden ones.
fn compare_with_golden(found: &Sensitivity, golden: &Value) {
    for (short, output) in OUTPUTS {
        for (input, _) in INPUTS {
            let expected = &golden["outputs"][short][input];
            for (order, key) in [(Order::First, "S1_azzini"), (Order::Total, "ST_azzini")] {
                let found = index(found, output, &name(input), order, "azzini");
                let [value, error] = [&expected[key], &expected["ci95"][key]].map(|x| x.as_f64().expect("a number"));
                let bound = 3.0 * half_width(found).hypot(error);
                let off = (found.estimate.value - value).abs();
                assert!(off <= bound, "{output} {input} {key}: {:?}, golden {value} ± {error}", found.estimate);
            }
        }
    }
}

#[test]
fn p6_has_the_golden_indices() {
    let found = study(p6([0.05, 0.10, -0.20], "method = \"saltelli\"\nsamples = 256\nseed = 3"));
    let golden = golden("p6_sobol_smooth.json");
    compare_with_golden(&found, &golden);
    assert_eq!((found.rows, found.usable), (256 * 18, 256 * 18));
    for (short, output) in OUTPUTS.into_iter().take(3) {
        for (input, _) in INPUTS {
            let slopes = found.slopes.iter().find(|slopes| slopes.output == output && slopes.input == name(input));
            let slopes = slopes.expect("slopes");
            let expected = golden["outputs"][short][input]["dgsm_upper"].as_f64().expect("a number");
            assert!((slopes.upper - expected).abs() < 0.02 * expected + 1e-9, "{output} {input}: {}", slopes.upper);
            // Of so few rows it is chance.
            assert!(slopes.jump_share < 5e-3 && slopes.flag.is_empty(), "{output} {input}: {}", slopes.jump_share);
            // Polynomials agree with 294,912 solutions to their errors.
            let [first, total] =
                [Order::First, Order::Total].map(|order| index(&found, output, &name(input), order, "chaos"));
            for (index, key) in [(first, "S1_azzini"), (total, "ST_azzini")] {
                let expected = &golden["outputs"][short][input];
                let [value, error] = [&expected[key], &expected["ci95"][key]].map(|x| x.as_f64().expect("a number"));
                assert!(
                    (index.estimate.value - value).abs() < 2.0 * error + 1e-4,
                    "{output} {input} {key}: {:?}",
                    index.estimate
                );
            }
        }
    }
}

#[test]
fn slopes_of_128_rows_give_the_indices_of_p6() {
    let sampling = "method = \"sobol\"\nsamples = 128\nseed = 1";
    let found = study(p6([0.05, 0.10, -0.20], sampling));
    let more = study(p6([0.05, 0.10, -0.20], "method = \"sobol\"\nsamples = 1024\nseed = 2"));
    let mut worst: f64 = 0.0;
    for (_, output) in OUTPUTS.into_iter().take(3) {
        for (input, _) in INPUTS {
            for order in [Order::First, Order::Total] {
                let [few, many] = [&found, &more].map(|found| index(found, output, &name(input), order, "chaos"));
                assert!(few.is_main && few.flag.is_empty(), "{few:?}");
                worst = worst.max((few.estimate.value - many.estimate.value).abs());
            }
        }
    }
    println!("largest difference of an index from 128 rows: {worst:.1e}");
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn p6_jumps_are_found_and_withhold_what_rests_on_slopes() {
    let sampling = "method = \"sobol\"\nsamples = 8192\nseed = 5";
    let found = study(p6([-0.0001, -0.15, -0.02], sampling));
    let golden = golden("p6_jump_share.json");
    for (short, output) in OUTPUTS.into_iter().take(3) {
        for (input, _) in INPUTS {
            let of =
                |slopes: &&rodsweep::study::sensitivity::Slopes| slopes.output == output && slopes.input == name(input);
            let share = found.slopes.iter().find(of).expect("slopes").jump_share;
            let expected = golden["values"]["tear"][short][input].as_f64().expect("a number");
            let tolerance = if expected == 0.0 { 1e-3 } else { 0.02 };
            assert!((share - expected).abs() < tolerance, "{output} {input}: {share}, golden {expected}");
        }
    }
    let bound = found.slopes.iter().find(|slopes| slopes.output == "tip.position.x").expect("slopes");
    assert!(bound.upper.is_nan() && bound.flag.starts_with("withheld"), "{bound:?}");
    let spread = found.spreads.iter().find(|spread| spread.output == "tip.position.x").expect("a spread");
    assert!(spread.flag.starts_with("first order fails"), "{spread:?}");
    let lumps = spread.lumps.expect("two lumps");
    // 64.7 % of the tips lie at positive x; some of the others lie near zero.
    assert!((0.64..0.85).contains(&lumps.share_above) && lumps.at.abs() < 0.015, "{lumps:?}");
    assert!(
        found
            .indices
            .iter()
            .filter(|index| index.output == "tip.position.x" && index.is_main)
            .all(|index| index.estimator == "cosines")
    );
}

#[test]
fn spreads_are_the_golden_ones() {
    let golden = golden("p6_uncertainty.json");
    for (case, tolerance) in golden["cases"].as_array().expect("cases").iter().zip([0.01, 0.02, 0.02]) {
        let list = |value: &Value| -> Vec<f64> {
            value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
        };
        let current: [f64; 3] = list(&case["current"]).try_into().expect("three");
        let found = study(p6(current, "method = \"sobol\"\nsamples = 4096\nseed = 9"));
        let number = |value: &Value| value.as_f64().expect("a number");
        for (axis, (_, output)) in OUTPUTS.into_iter().take(3).enumerate() {
            let spread = found.spreads.iter().find(|spread| spread.output == output).expect("a spread");
            let near = |found: f64, expected: &Value, tolerance: f64, what: &str| {
                let expected = number(expected) * 1e-3;
                assert!(
                    (found - expected).abs() <= tolerance,
                    "{current:?} {output} {what}: {found}, golden {expected}"
                );
            };
            near(spread.nominal, &case["tip_nominal_mm"][axis], 1e-8, "nominal");
            near(spread.first_order, &case["first_order_sd_mm"][axis], 0.01 * spread.first_order, "first order");
            near(spread.deviation, &case["sd_mm"][axis], tolerance * spread.deviation, "sd");
        }
        let distance = found.spreads.iter().find(|spread| spread.output == "tip.distance").expect("a spread");
        let [_, _, _, median, _, q95, _] = distance.quantiles.map(|x| 1e3 * x);
        assert!((median / number(&case["distance_mm"]["q50"]) - 1.0).abs() < 0.03, "{median}");
        assert!((q95 / number(&case["distance_mm"]["q95"]) - 1.0).abs() < 0.02, "{q95}");
        assert!((found.margins[0] - number(&case["margin_nominal"])).abs() < 1e-6);
    }
}

#[test]
fn bad_questions_are_refused_with_a_remedy() {
    let sobol = "method = \"sobol\"\nsamples = 64\nseed = 1";
    let job = with_rows(SensitivityJob::of_sweep(p6([0.05, 0.10, -0.20], sobol)));
    let refused = |job: SensitivityJob| job.run().expect_err("a refusal").to_string();
    let unknown = refused(job.clone().outputs(&["tip.positon"]));
    assert!(unknown.contains("did you mean `tip.position`?"), "{unknown}");
    let unknown = refused(job.clone().inputs(&["coil.turn.x"]));
    assert!(unknown.contains("did you mean `coil.turns.x`?"), "{unknown}");
    let design = refused(job.clone().estimator(EstimatorChoice::PickFreeze(Default::default())));
    assert!(design.contains("method = \"saltelli\""), "{design}");
    let noise = refused(job.clone().choose(Some(4)).inputs(&["coil.turns.x"]));
    assert!(noise.contains("the noise"), "{noise}");
    let confidence = refused(job.clone().confidence(95.0));
    assert!(confidence.contains("such as 0.95"), "{confidence}");
    // Without derivatives.
    let spec = job.spec().clone();
    let rows = |spec: &SweepSpec, keep: &dyn Fn(&str) -> bool| -> Table {
        let mut rows = Memory::new();
        SweepJob::new(spec.clone())
            .engine(EngineRequest::of(BackendKind::Cpu))
            .spot_check(None)
            .run(&mut rows)
            .expect("a run");
        let mut rows = rows.into_table();
        rows.columns.retain(|column| keep(&column.name));
        rows
    };
    let plain = SensitivityJob::of_rows(spec.clone(), rows(&spec, &|name| !name.starts_with("d(")));
    let slopes = refused(plain.clone().estimator(EstimatorChoice::Slopes));
    assert!(slopes.contains("add `derivatives = [\"proximal.youngs_modulus\""), "{slopes}");
    let found = plain.run().expect("indices by values");
    assert!(found.notes.iter().any(|note| note.contains("derivatives = [")), "{:?}", found.notes);
    let choice = refused(plain.noise(Some(5e-4)).choose(Some(3)));
    assert!(choice.contains("nothing to identify") || choice.contains("derivatives"), "{choice}");
    // One row; all rows failed.
    let all = rows(&spec, &|_| true);
    let one = refused(SensitivityJob::of_rows(spec.clone(), all.select(&[0])));
    assert!(one.contains("1 of 1 rows can be used"), "{one}");
    let mut failed = all.clone();
    for column in &mut failed.columns {
        if let rodsweep::table::Values::Status(statuses) = &mut column.values {
            statuses.fill(rodsweep::model::Status::Fold);
        }
    }
    let none = refused(SensitivityJob::of_rows(spec.clone(), failed));
    assert!(none.contains("0 of 64 rows") && none.contains("64 fold"), "{none}");
    // An output that does not change.
    let mut constant = all.clone();
    for column in constant.columns.iter_mut().filter(|column| column.name == "stability.margin") {
        column.values = vec![0.5; 64].into();
    }
    let constant = refused(SensitivityJob::of_rows(spec.clone(), constant).outputs(&["stability.margin"]));
    assert!(constant.contains("`stability.margin` is 0.5 in every row"), "{constant}");
    // Every equilibrium.
    let every = SweepSpec { branch: rodsweep::spec::BranchChoice::All, ..spec };
    let error = SensitivityJob::of_rows(every, all).run().expect_err("a refusal");
    assert!(matches!(error, SensitivityError::EveryBranch) && error.is_usage());
}
