//! The study on rows whose numbers are known: missing rows, threads, parts, grids, tables.

use crate::sensitivity::{p6, with_rows};
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::model::Status;
use rodsweep::results::Results;
use rodsweep::spec::SweepSpec;
use rodsweep::study::sensitivity::{EstimatorChoice, Index, Order, Sensitivity, SensitivityError, SensitivityJob};
use rodsweep::sweep::{ResultDirectory, SweepJob};
use rodsweep::table::{Column, Table};

const INPUTS: [&str; 3] = ["coil.turns.x", "coil.turns.y", "coil.turns.z"];

fn spec(sampling: &str, more: &str) -> SweepSpec {
    let axis = |name: &&str| format!("[[axis]]\nparameter = \"{name}\"\nfrom = 0\nto = 1\n{more}");
    let text =
        format!("scene = \"scenes/p6.toml\"\n[sampling]\n{sampling}\n{}", INPUTS.iter().map(axis).collect::<String>());
    let file = crate::common::root().join("sweeps/s.toml");
    SweepSpec::parse(&file, &text).unwrap_or_else(|error| panic!("{error}"))
}

/// x + 2 y + x z of the shares, with slopes; rows fail where `fails` says so.
fn rows(spec: &SweepSpec, fails: impl Fn(&[f64]) -> bool) -> Table {
    let sampler = spec.sampler();
    let mut values = vec![Vec::new(); 3];
    let (mut statuses, mut output, mut slopes) = (Vec::new(), Vec::new(), vec![Vec::new(); 3]);
    let mut u = [0.0; 3];
    for sample in 0..spec.sample_count {
        sampler.values(sample, &mut u);
        let [x, y, z] = u;
        values.iter_mut().zip(u).for_each(|(values, u)| values.push(u));
        let failed = fails(&u);
        statuses.push(if failed { Status::Fold } else { Status::Ok });
        let known = |value: f64| if failed { f64::NAN } else { value };
        output.push(known(x + 2.0 * y + x * z));
        slopes.iter_mut().zip([1.0 + z, 2.0, x]).for_each(|(slopes, slope)| slopes.push(known(slope)));
    }
    let mut columns = vec![Column::new("sample", "", (0..spec.sample_count).collect::<Vec<u64>>())];
    columns.extend(INPUTS.iter().zip(values).map(|(name, values)| Column::new(*name, "", values)));
    columns.push(Column::new("status", "", statuses));
    columns.push(Column::new("base_curvature.x", "1/m", output));
    let slope =
        |(name, slopes): (&&str, Vec<f64>)| Column::new(format!("d(base_curvature.x)/d({name})"), "1/m", slopes);
    columns.extend(INPUTS.iter().zip(slopes).map(slope));
    Table::new(columns)
}

fn job(spec: &SweepSpec, fails: impl Fn(&[f64]) -> bool) -> SensitivityJob {
    SensitivityJob::of_rows(spec.clone(), rows(spec, fails)).outputs(&["base_curvature.x"])
}

fn main_index(found: &Sensitivity, input: usize, order: Order) -> &Index {
    let is_meant = |index: &&Index| index.is_main && index.input == INPUTS[input] && index.order == order;
    found.indices.iter().find(is_meant).unwrap_or_else(|| panic!("no {order:?} of {input}"))
}

/// V and shares of x + 2 y + x z, uniform on the unit cube: first order and total by input.
fn truth() -> [[f64; 2]; 3] {
    let v = 1.0 / 12.0;
    // (1 + E z)² v, 4 v, (E x)² v, and v² of the product.
    let parts = [2.25 * v, 4.0 * v, 0.25 * v];
    let whole = parts.iter().sum::<f64>() + v * v;
    [[parts[0], parts[0] + v * v], [parts[1], parts[1]], [parts[2], parts[2] + v * v]]
        .map(|pair| pair.map(|p| p / whole))
}

#[test]
fn every_design_finds_the_shares() {
    for (sampling, more, estimator, tolerance) in [
        ("method = \"saltelli\"\nsamples = 1024", "", "azzini", 0.005),
        ("method = \"sobol\"\nsamples = 64", "", "chaos", 1e-9),
        ("method = \"latin_hypercube\"\nsamples = 64", "", "chaos", 1e-9),
        ("method = \"uniform\"\nsamples = 64", "", "chaos", 1e-9),
        ("method = \"grid\"", "points = 21\n", "grid", 0.01),
    ] {
        let spec = spec(sampling, more);
        let found = job(&spec, |_| false).run().unwrap_or_else(|error| panic!("{error}"));
        for (input, [first, total]) in truth().into_iter().enumerate() {
            for (order, expected) in [(Order::First, first), (Order::Total, total)] {
                let index = main_index(&found, input, order);
                assert_eq!(index.estimator, estimator);
                let off = (index.estimate.value - expected).abs();
                assert!(off < tolerance, "{sampling}: {order:?} of {input}: {:?}, not {expected}", index.estimate);
            }
        }
        if estimator != "grid" {
            let bounds: Vec<f64> = found.slopes.iter().map(|slopes| slopes.upper).collect();
            let holds = |(bound, [_, total]): (&f64, [f64; 2])| *bound > total;
            assert!(bounds.len() == 3 && bounds.iter().zip(truth()).all(holds), "{bounds:?}");
        }
    }
}

#[test]
fn missing_rows_are_told_and_nothing_is_put_in_their_place() {
    let spec = spec("method = \"saltelli\"\nsamples = 512\nseed = 2", "");
    for (share, withheld) in [(0.01, false), (0.04, false), (0.20, true)] {
        let corner = 1.0 - f64::powf(share, 0.5);
        let found = job(&spec, |u| u[0] > corner && u[1] > corner).run().unwrap_or_else(|error| panic!("{error}"));
        let failed = found.statuses.iter().find(|share| share.status == Status::Fold).expect("failures");
        assert!(failed.interval[0] < share && share < failed.interval[1] + 0.01, "{failed:?}");
        assert_eq!(found.rows - found.usable, failed.rows);
        let index = main_index(&found, 0, Order::Total);
        assert!(index.pairs < 512 && index.flag.starts_with("given success"), "{index:?}");
        assert!(found.notes.iter().any(|note| note.contains("given success")), "{:?}", found.notes);
        // x and y make it fail, z does not.
        let of = |input: usize| {
            let is_meant = |index: &&Index| {
                index.output == "failed" && index.order == Order::Total && index.input == INPUTS[input]
            };
            found.failure_indices.iter().find(is_meant).expect("an index").estimate.value
        };
        assert!(of(0) > 0.5 && of(1) > 0.5 && of(2) < 1e-9, "{} {} {}", of(0), of(1), of(2));
        assert_eq!(found.worst_cases.len(), 1);
        let chaos = found.indices.iter().filter(|index| index.estimator == "chaos");
        let is_withheld = |index: &Index| index.flag.starts_with("withheld") && index.estimate.value.is_nan();
        assert!(chaos.clone().count() > 0 && chaos.clone().all(|index| is_withheld(index) == withheld), "{share}");
    }
}

#[test]
fn threads_and_parts_change_nothing() {
    let spec = spec("method = \"saltelli\"\nsamples = 256\nseed = 5", "");
    let job = job(&spec, |u| u[0] + u[2] > 1.9);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| job.run().expect("a study").to_json())
    };
    assert_eq!(on(1), on(3));
    // The same rows in parts of a directory.
    let plain = SensitivityJob::of_sweep(p6([0.05, 0.10, -0.20], "method = \"sobol\"\nsamples = 64\nseed = 1"));
    let folder = tempfile::tempdir().expect("a folder");
    let run = SweepJob::new(plain.sweep()).engine(EngineRequest::of(BackendKind::Cpu)).spot_check(None);
    run.part_size(Some(16)).run(&mut ResultDirectory::new(folder.path())).expect("a run");
    let results = Results::open(folder.path()).expect("results");
    let by_parts = plain.clone().with_results(results).run().expect("a study");
    let whole = with_rows(plain).run().expect("a study");
    assert_eq!(by_parts.indices.len(), whole.indices.len());
    for (one, other) in by_parts.indices.iter().zip(&whole.indices) {
        let off = (one.estimate.value - other.estimate.value).abs();
        assert!(off < 1e-9 || one.estimate.value.is_nan() && other.estimate.value.is_nan(), "{one:?} {other:?}");
    }
}

#[test]
fn tables_are_taken_where_their_columns_are_independent() {
    let folder = tempfile::tempdir().expect("a folder");
    let sobol = spec("method = \"sobol\"\nsamples = 512", "");
    let scene = crate::common::root().join("sweeps/scenes/p6.toml");
    let table = |third: &dyn Fn(&[f64]) -> f64| {
        let (sampler, mut u) = (sobol.sampler(), [0.0; 3]);
        let mut text = INPUTS.join(",") + "\n";
        for sample in 0..512 {
            sampler.values(sample, &mut u);
            text += &format!("{:?},{:?},{:?}\n", u[0], u[1], third(&u));
        }
        std::fs::write(folder.path().join("table.csv"), text).expect("a file");
        let text = format!("scene = \"{}\"\n[sampling]\nmethod = \"table\"\nfile = \"table.csv\"\n", scene.display());
        SweepSpec::parse(&folder.path().join("s.toml"), &text).unwrap_or_else(|error| panic!("{error}"))
    };
    let found = job(&table(&|u| u[2]), |_| false).run().unwrap_or_else(|error| panic!("{error}"));
    for (input, [first, _]) in truth().into_iter().enumerate() {
        let index = main_index(&found, input, Order::First);
        assert!((index.estimate.value - first).abs() < 0.02, "{index:?}");
    }
    let error = job(&table(&|u| u[0] + 0.1 * u[2]), |_| false).run().expect_err("correlated columns");
    assert!(matches!(error, SensitivityError::Correlated { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("`coil.turns.x` and `coil.turns.z` are correlated"), "{text}");
    let slopes = job(&table(&|u| u[2]), |_| false).estimator(EstimatorChoice::PickFreeze(Default::default()));
    assert!(matches!(slopes.run(), Err(SensitivityError::NeedsDesign { .. })));
}

#[test]
fn a_pose_is_position_and_rotation_together() {
    let spec = p6([0.05, 0.10, -0.20], "method = \"saltelli\"\nsamples = 16\nseed = 1");
    let job = with_rows(SensitivityJob::of_sweep(spec).outputs(&["tip.pose", "tip.rotation", "tip.position"]));
    let found = job.run().unwrap_or_else(|error| panic!("{error}"));
    // Of a vector the index is the mean of its components', weighted with their variances.
    let total = |output: &str| {
        let is_meant = |index: &&Index| {
            index.output == output && index.order == Order::Total && index.input == INPUTS[2] && index.is_main
        };
        found.indices.iter().find(is_meant).unwrap_or_else(|| panic!("no {output}")).estimate.value
    };
    let (pose, parts) = (total("tip.pose"), [total("tip.position"), total("tip.rotation")]);
    assert!(parts[0].min(parts[1]) < pose && pose < parts[0].max(parts[1]), "{pose}, {parts:?}");
    // Derivatives of a rotation are not those of the rotation vector: nothing is made of them.
    assert!(found.slopes.iter().all(|slopes| !slopes.output.starts_with("tip.rotation")));
}

/// Prints how long a million rows of eight inputs and four outputs take.
#[test]
#[ignore = "a measurement, of a release build"]
fn a_million_rows() {
    let spec = p6([0.05, 0.10, -0.20], "method = \"sobol\"\nsamples = 1048576\nseed = 1");
    let prepared = SensitivityJob::of_sweep(spec).sweep();
    let (sampler, count) = (prepared.sampler(), prepared.sample_count as usize);
    let names: Vec<String> = prepared.axis_parameters().concat().iter().map(|p| p.name(&prepared.scene)).collect();
    let mut inputs = vec![vec![0.0; count]; names.len()];
    let mut row = vec![0.0; names.len()];
    for sample in 0..count {
        sampler.values(sample as u64, &mut row);
        inputs.iter_mut().zip(&row).for_each(|(column, value)| column[sample] = *value);
    }
    let output = |k: usize| -> Vec<f64> { (0..count).map(|row| inputs[k][row] * (1.0 + inputs[k + 1][row])).collect() };
    let outputs = ["tip.position.x", "tip.position.y", "tip.position.z", "stability.margin"];
    let mut columns = vec![Column::new("sample", "", (0..count as u64).collect::<Vec<u64>>())];
    columns.push(Column::new("status", "", vec![Status::Ok; count]));
    for (k, name) in outputs.iter().enumerate() {
        columns.push(Column::new(*name, "m", output(k + 4)));
        for (parameter, slopes) in names.iter().zip(&inputs).filter(|_| k < 3) {
            columns.push(Column::new(format!("d({name})/d({parameter})"), "m", slopes.clone()));
        }
    }
    columns.extend(names.iter().zip(&inputs).map(|(name, values)| Column::new(name.clone(), "", values.clone())));
    let job = SensitivityJob::of_rows(prepared, Table::new(columns)).outputs(&outputs);
    let clock = std::time::Instant::now();
    let found = job.run().unwrap_or_else(|error| panic!("{error}"));
    println!("{} rows, {} indices: {:.2} s", found.rows, found.indices.len(), clock.elapsed().as_secs_f64());
}
