//! Error estimates are bounds where grids tell little: short tapers, magnets near by, loose tolerances. The right values come
//! from a solver that shares nothing with this program, or from its reference (`tests/data/attack/estimates`).

use crate::common::day::{of_today, today};
use crate::common::root;
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::engines::{EngineRequest, F32_TOLERANCE};
use rodsweep::model::{rotation_angle, rotation_matrix};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{Memory, SweepJob};
use rodsweep::table::Table;
use rodsweep_bench::random::RandomScenes;
use rodsweep_bench::verify::search_estimates;
use serde_json::Value;

/// An estimate may be so many times below the true error.
const SLACK: f64 = 1.05;
const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-9];

#[test]
fn of_tips_along_a_short_taper() {
    check("short_taper");
}

#[test]
fn of_columns_along_a_short_taper() {
    check("short_taper_columns");
}

#[test]
fn beside_a_magnet() {
    check("one_magnet");
}

#[test]
fn between_two_magnets() {
    check("two_magnets");
}

#[test]
fn of_three_soft_tubes() {
    check("three_tubes");
}

#[test]
fn of_a_taper_about_one_axis_before_a_short_tube() {
    check("one_axis_taper");
}

#[test]
fn of_a_magnet_at_the_tip_as_long_as_another_is_far() {
    check("long_magnet");
}

#[test]
fn of_a_rod_soft_in_torsion_beside_a_magnet() {
    check("soft_torsion");
}

/// The last tube is forty times softer than the one before, and the column by its torsional stiffness is small: in f32 it is off by 0.6 %.
#[test]
fn of_a_small_column_in_f32() {
    let spec = sweep_of("small_column");
    let rows = |precision, tolerance| rows_of(&spec, (BackendKind::Cpu, precision), tolerance, 64);
    let (ours, right) = (rows(Precision::F32, 1e-3), rows(Precision::F64, 1e-9));
    let estimates = ours.numbers("derivative_error").expect("a column");
    let length = spec.scene.total_length();
    let mut worst = 0.0f64;
    for parameter in &spec.wrt {
        let name = parameter.name(&spec.scene);
        for (at, estimate) in estimates.iter().enumerate() {
            let column = |rows: &Table| {
                let [position, rotation] =
                    ["tip.position", "tip.rotation"].map(|tip| vector_of_column(rows, tip, &name, at));
                [position.map(|x| x / length), rotation].concat()
            };
            let (ours, right) = (column(&ours), column(&right));
            let error = norm(&difference(&ours, &right));
            assert!(error <= estimate * norm(&right), "row {at}, by {name}: {error:e}, not {estimate:e}");
            worst = worst.max(error / norm(&right).max(f64::MIN_POSITIVE));
        }
    }
    assert!(worst > 1e-3, "the column is not small: {worst:e}");
    assert!(estimates.iter().all(|estimate| *estimate < 0.1), "estimates say nothing");
}

/// Along the sweep the difference between two grids passes through zero where the error does not: rows were off by 1.6 times their
/// estimate.
#[test]
fn where_two_grids_agree_by_chance() {
    check_poses("sign_change", Precision::F64);
}

/// The soft end turns by 16 rad in a few steps: in f32 rows were off by three times their estimate.
#[test]
fn of_a_rod_that_turns_far_in_f32() {
    check_poses("turned_far", Precision::F32);
}

/// Tips of a sweep at a loose tolerance against the reference.
fn check_poses(name: &str, precision: Precision) {
    let spec = sweep_of(name);
    let ours = rows_of(&spec, (BackendKind::Cpu, precision), 1e-3, 16);
    let right = rows_of(&spec, (BackendKind::Reference, Precision::F64), 1e-3, 16);
    let length = spec.scene.total_length();
    let estimates = ours.numbers("error_estimate").expect("a column");
    for (at, estimate) in estimates.iter().enumerate() {
        let [ours, right] = [&ours, &right].map(|rows| {
            ["tip.position", "tip.rotation"]
                .map(|tip| ["x", "y", "z"].map(|axis| rows.numbers(&format!("{tip}.{axis}")).expect("a column")[at]))
        });
        let apart = norm(&difference(&ours[0], &right[0])) / length;
        let error = apart.max(rotation_angle(&rotation_matrix(ours[1]), &rotation_matrix(right[1])));
        assert!(error <= *estimate, "{name}, row {at}: off by {error:e}, not {estimate:e}");
        // A row that is five powers of ten better than asked need not tell how much better.
        let most = (100.0 * error).max(1e-8);
        assert!(*estimate < most, "{name}, row {at}: off by {error:e}, and {estimate:e} says nothing");
    }
}

fn sweep_of(name: &str) -> SweepSpec {
    let file = root().join("tests/data/attack/estimates").join(name).join("sweep.toml");
    SweepSpec::read(&file).expect("the sweep reads")
}

/// The first rows of a sweep by an engine.
fn rows_of(spec: &SweepSpec, (engine, precision): (BackendKind, Precision), tolerance: f64, limit: u64) -> Table {
    let spec = SweepSpec { tolerance, ..spec.clone() };
    let request = EngineRequest::of(engine).precision(Some(precision));
    let mut rows = Memory::new();
    SweepJob::new(spec).engine(request).spot_check(None).limit(Some(limit)).run(&mut rows).expect("solved");
    rows.into_table()
}

/// Every row of a case, in both precisions, at every second tolerance each day.
fn check(name: &str) {
    let folder = root().join("tests/data/attack/estimates").join(name);
    let expected = std::fs::read_to_string(folder.join("expected.json")).expect("the case is there");
    let expected: Value = serde_json::from_str(&expected).expect("JSON");
    let spec = SweepSpec::read(&folder.join("sweep.toml")).expect("the sweep reads");
    for precision in [Precision::F64, Precision::F32] {
        // An engine in f32 is held to no better tolerance than this, so all that are smaller make one run.
        let least = if precision == Precision::F32 { F32_TOLERANCE } else { 0.0 };
        let mut tolerances = TOLERANCES.map(|tolerance| tolerance.max(least)).to_vec();
        tolerances.dedup();
        for tolerance in of_today(tolerances, 2) {
            let spec = SweepSpec { tolerance, ..spec.clone() };
            let request = EngineRequest::of(BackendKind::Cpu).precision(Some(precision));
            let mut rows = Memory::new();
            SweepJob::new(spec).engine(request).spot_check(None).run(&mut rows).expect("solved");
            compare(&format!("{name}, {precision}, tolerance {tolerance:e}"), &rows.into_table(), &expected);
        }
    }
}

fn compare(title: &str, rows: &Table, expected: &Value) {
    let length = expected["length"].as_f64().expect("a length");
    let truths = expected["rows"].as_array().expect("rows");
    let floor = |what: &str| expected["accuracy"][what].as_f64().unwrap_or(0.0);
    let numbers = |name: &str| rows.numbers(name).unwrap_or_else(|| panic!("{title}: no column {name}"));
    let vector = |name: &str, at: usize| ["x", "y", "z"].map(|axis| numbers(&format!("{name}.{axis}"))[at]);
    assert_eq!(rows.row_count(), truths.len(), "{title}");
    for (at, truth) in truths.iter().enumerate() {
        let status = rows.statuses()[at];
        assert!(status.is_success(), "{title}, row {at}: {status:?}");
        let right = |name: &str| three(&truth[name]);
        let apart = norm(&difference(&vector("tip.position", at), &right("tip_position"))) / length;
        let [ours, theirs] = [vector("tip.rotation", at), right("tip_rotation")].map(rotation_matrix);
        let error = apart.max(rotation_angle(&ours, &theirs));
        let estimate = numbers("error_estimate")[at];
        assert!(error <= SLACK * estimate + floor("tip"), "{title}, row {at}: tip off by {error:e}, not {estimate:e}");
        for (name, right) in truth["derivatives"].as_object().into_iter().flatten() {
            let column = |tip: &str| vector_of_column(rows, tip, name, at);
            let ours = [column("tip.position").map(|x| x / length), column("tip.rotation")].concat();
            let theirs = [three(&right[0]).map(|x| x / length), three(&right[1])].concat();
            let error = norm(&difference(&ours, &theirs)) / norm(&theirs);
            let estimate = numbers("derivative_error")[at];
            let allowed = SLACK * estimate + floor("derivatives");
            assert!(error <= allowed, "{title}, row {at}: column by {name} off by {error:e}, not {estimate:e}");
        }
    }
}

fn vector_of_column(rows: &Table, tip: &str, name: &str, at: usize) -> [f64; 3] {
    ["x", "y", "z"].map(|axis| rows.numbers(&format!("d({tip}.{axis})/d({name})")).expect("a column")[at])
}

fn three(value: &Value) -> [f64; 3] {
    std::array::from_fn(|axis| value[axis].as_f64().expect("a number"))
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Random sweeps of the day's seed: no pose is off by more than its estimate, and columns hardly ever are, by little.
#[test]
fn of_random_sweeps_of_the_day() {
    let seed = today();
    for (kind, rods) in [(RandomScenes::Uniform, 128), (RandomScenes::Sampled, 32)] {
        let found = search_estimates(kind, (rods, 0), seed, BackendKind::Cpu, &mut |_| {}).expect("solved");
        let told = format!("verify --random {rods} --seed {seed} --estimates {}\n{}", kind.option(), found.text());
        let json: Value = serde_json::from_str(&found.json()).expect("JSON");
        for setup in json["setups"].as_array().expect("setups") {
            let number = |of: &str, what: &str| setup[of][what].as_f64().expect("a number");
            assert_eq!(number("poses", "beyond"), 0.0, "{told}");
            assert_eq!(number("poses", "missed"), 0.0, "{told}");
            assert!(number("columns", "beyond") <= 0.01 * number("columns", "rows"), "{told}");
            assert!(number("columns", "worst") <= 2.0, "{told}");
        }
    }
}
