//! Estimators of sensitivity indices on given rows: golden numbers, closed forms, coverage of intervals.

use crate::common::root;
use rodsweep::study::sensitivity::{
    BaseRow, Chaos, ChaosRows, Cosines, Estimator, Family, Harmonics, Measurements, PickFreeze, PickFreezeSums, Source,
    poincare_uniform,
};
use serde_json::Value;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Columns of a golden file by name.
#[derive(Clone)]
struct Columns(HashMap<String, Vec<f64>>);

impl Columns {
    fn column(&mut self, name: &str) -> &mut Vec<f64> {
        self.0.get_mut(name).expect("a column")
    }

    fn at(&self, name: &str, row: usize) -> f64 {
        self.0[name][row]
    }
}

fn columns(file: &str) -> Columns {
    let text = std::fs::read_to_string(root().join("tests/data/analyses").join(file)).expect("a golden file");
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let mut columns: HashMap<String, Vec<f64>> = names.iter().map(|name| ((*name).to_owned(), Vec::new())).collect();
    for line in lines {
        for (name, cell) in names.iter().zip(line.split(',')) {
            columns.get_mut(*name).expect("a column").push(cell.parse().expect("a number"));
        }
    }
    Columns(columns)
}

fn golden(file: &str) -> Value {
    let text = std::fs::read_to_string(root().join("tests/data/analyses").join(file)).expect("a golden file");
    serde_json::from_str(&text).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (found - expected).abs() / expected.abs().max(1.0);
    assert!(error <= tolerance, "{what}: {found} is not {expected}");
}

/// Inputs, lower end and width of the range of a golden function.
const FUNCTIONS: [(&str, usize, f64, f64); 2] = [("ishigami", 3, -PI, 2.0 * PI), ("g4", 4, 0.0, 1.0)];

#[test]
fn pick_freeze_estimators_give_the_golden_numbers() {
    for (name, inputs, ..) in FUNCTIONS {
        let data = columns(&format!("estimators_{name}.csv"));
        let expected = &golden("estimators.json")["expected"][name];
        for mode in ["complete", "missing"] {
            let mut data = data.clone();
            let mut numbers_of = &expected[mode];
            if mode == "missing" {
                for row in numbers_of["fA_rows"].as_array().expect("rows") {
                    data.column("fA")[row.as_u64().expect("a row") as usize] = f64::NAN;
                }
                for cell in numbers_of["fAB_cells"].as_array().expect("cells") {
                    let [row, input] = [0, 1].map(|k| cell[k].as_u64().expect("a place") as usize);
                    data.column(&format!("fAB{input}"))[row] = f64::NAN;
                }
                numbers_of = &numbers_of["values"];
            }
            let mut sums = PickFreezeSums::new(inputs, 1.25);
            for row in 0..64 {
                let of =
                    |kind: &str| -> Vec<f64> { (0..inputs).map(|k| data.at(&format!("{kind}{k}"), row)).collect() };
                let (ab, ba) = (of("fAB"), of("fBA"));
                sums.add(BaseRow { a: data.at("fA", row), b: data.at("fB", row), ab: &ab, ba: &ba });
            }
            near(sums.mean(), numbers_of["mean"].as_f64().expect("a mean"), 1e-12, "mean");
            near(sums.variance(), numbers_of["V"].as_f64().expect("a variance"), 1e-12, "variance");
            for estimator in Estimator::ALL {
                for (index, prefix) in [(0, "S1"), (1, "ST")] {
                    // Saltelli's total is Jansen's.
                    let word = if index == 1 && estimator == Estimator::Saltelli { "jansen" } else { estimator.name() };
                    let expected = numbers(&numbers_of[format!("{prefix}_{word}")]);
                    for (input, expected) in expected.into_iter().enumerate() {
                        let share = match index {
                            0 => sums.first(estimator, input),
                            _ => sums.total(estimator, input),
                        };
                        near(share.value(), expected, 1e-12, &format!("{name} {mode} {prefix}_{word} {input}"));
                    }
                }
            }
        }
    }
}

#[test]
fn cosines_and_chaos_give_the_golden_numbers() {
    for (name, inputs, low, width) in FUNCTIONS {
        let data = columns(&format!("estimators_{name}.csv"));
        let expected = &golden("estimators.json")["expected"][name];
        let given = &expected["given_data"];
        let values = &data.0["fA"];
        for input in 0..inputs {
            let mut cosines = Cosines::new(0.7, true);
            for (row, value) in values.iter().enumerate() {
                let at = Harmonics::new((data.at(&format!("A{input}"), row) - low) / width, width);
                cosines.add(row / 4, *value, data.at(&format!("gA{input}"), row), &at);
            }
            let cosines = cosines.finish();
            for (source, word) in [(Source::Values, "value"), (Source::Slopes, "slope"), (Source::Mix, "mix")] {
                let found = Cosines::first(&[&cosines], source, 4, 0.95).value;
                near(found, numbers(&given["cos"][word])[input], 1e-12, &format!("{name} {word} {input}"));
            }
            // The golden bounds divide by the population variance.
            let variance = cosines.variance() * 63.0 / 64.0;
            let bound = poincare_uniform(low, low + width) * cosines.slope_moments()[2] / variance;
            near(bound, numbers(&given["dgsm"])[input], 1e-12, "bound");
        }
        let rows = chaos_rows(&data, inputs, low, width);
        let chaos = &Chaos::fit(&vec![Family::Legendre; inputs], &rows, 3)[0];
        let expected = &expected["pce_degree3_with_slopes"];
        assert_eq!(chaos.basis.len() as u64, expected["terms"].as_u64().expect("a count"));
        near(chaos.mean(), expected["mean"].as_f64().expect("a mean"), 1e-9, "mean");
        near(chaos.variance(), expected["variance"].as_f64().expect("a variance"), 1e-9, "variance");
        for input in 0..inputs {
            near(chaos.first(input).value(), numbers(&expected["S1"])[input], 1e-9, "first order");
            near(chaos.total(input).value(), numbers(&expected["ST"])[input], 1e-9, "total");
        }
    }
}

fn chaos_rows(data: &Columns, inputs: usize, low: f64, width: f64) -> ChaosRows {
    let mut rows = ChaosRows { values: data.0["fA"].clone(), ..ChaosRows::default() };
    for row in 0..rows.values.len() {
        for input in 0..inputs {
            rows.points.push(2.0 * (data.at(&format!("A{input}"), row) - low) / width - 1.0);
            rows.slopes.push(0.5 * width * data.at(&format!("gA{input}"), row));
        }
    }
    rows
}

#[test]
fn bounds_are_those_of_the_closed_forms() {
    let truth = [7.719_587_940_719_255, 24.5, 10.987_305_069_432_05];
    let expected = [2.230_355_420_839_836_6, 7.078_578_316_640_654, 3.174_469_364_195_822_6];
    for (nu, bound) in truth.into_iter().zip(expected) {
        near(poincare_uniform(-PI, PI) * nu / 13.844_587_940_719_254, bound, 1e-12, "bound");
    }
}

#[test]
fn chosen_experiments_reach_the_golden_determinants() {
    let data = columns("p6_dopt_jacobians.csv");
    let golden = golden("p6_dopt.json");
    let names = ["lnE", "lnG", "kxL", "kyL", "lnN"];
    let mut candidates = Measurements::new(5);
    for row in 0..256 {
        let slope = |place: usize| data.at(&format!("d{}/d{}", ["x", "y", "z"][place / 5], names[place % 5]), row);
        candidates.push(&(0..15).map(slope).collect::<Vec<_>>());
    }
    let all: Vec<usize> = (0..256).collect();
    let trace: f64 = candidates.information(&all).iter().enumerate().map(|(k, row)| row[k]).sum();
    near(trace / numbers(&golden["eigenvalues_all"]).iter().sum::<f64>(), 1.0, 1e-8, "sum of the eigenvalues");
    let margins = columns("p6_dopt_candidates.csv").column("margin").clone();
    let safe: Vec<usize> = all.iter().copied().filter(|row| margins[*row] >= 0.3).collect();
    for (key, allowed) in [("designs", &all), ("with_margin_03", &safe)] {
        for count in [4, 6, 10] {
            let listed = &golden[key][count.to_string()];
            let choice = candidates.choose(allowed, count).expect("a choice");
            assert!(choice.rows.iter().all(|row| allowed.contains(row)) && choice.rows.len() == count);
            let rows: Vec<usize> = numbers(&listed["rows"]).into_iter().map(|row| row as usize).collect();
            let expected = listed["logdet"].as_f64().expect("a number");
            near(candidates.log_determinant(&rows), expected, 1e-7, "listed");
            let found = choice.log_determinant;
            assert!(found >= expected - 1e-6, "{key} {count}: {found} < {expected} {:?}", choice.rows);
            println!("{key} {count}: {found:.6}, listed {expected:.6}");
        }
    }
    let observed = candidates.observability(&all);
    near(observed.weakest.powi(2) / numbers(&golden["eigenvalues_all"])[0], 1.0, 1e-6, "weakest direction");
}

fn ishigami(x: &[f64]) -> f64 {
    x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
}

#[test]
fn blocks_add_up_to_the_whole() {
    let data = columns("estimators_ishigami.csv");
    let mut design = PickFreeze::new(3, 64, 3.0);
    let mut sums = PickFreezeSums::new(3, 3.0);
    for row in 0..64 {
        let of = |kind: &str| -> Vec<f64> { (0..3).map(|k| data.at(&format!("{kind}{k}"), row)).collect() };
        let (ab, ba) = (of("fAB"), of("fBA"));
        let all = [&[data.at("fA", row)], &ab[..], &[data.at("fB", row)], &ba[..]].concat();
        all.iter().enumerate().for_each(|(place, value)| design.push(row as u64, place, *value));
        sums.add(BaseRow { a: all[0], b: all[4], ab: &ab, ba: &ba });
        let x: Vec<f64> = (0..3).map(|k| data.at(&format!("A{k}"), row)).collect();
        near(data.at("fA", row), ishigami(&x), 1e-12, "the function");
    }
    let design = design.finish();
    for input in 0..3 {
        let found = PickFreeze::first(&[&design], Estimator::Azzini, input, 0.95);
        near(found.estimate.value, sums.first(Estimator::Azzini, input).value(), 1e-12, "first order");
        assert!(found.estimate.low < found.estimate.value && found.pairs == 64);
        // Twice the same output as a vector changes nothing.
        let vector = PickFreeze::first(&[&design, &design], Estimator::Azzini, input, 0.95);
        near(vector.estimate.value, found.estimate.value, 1e-12, "vector");
    }
}
