//! The report of `bench` is made of its files alone, the README's table with it; and `bench` measures what it says.

use crate::common::root;
use crate::sandbox::Sandbox;
use rodsweep_bench::BenchSpec;
use rodsweep_bench::record::{Record, RecordError, from_csv, to_csv};
use rodsweep_bench::report::Report;
use std::fs;
use std::path::Path;

/// The report whose table `docs/benchmarks.md` shows.
const COMMITTED: &str = "sweeps/reports/2026-11-25-2-core-avx512";
const BEGIN: &str = "<!-- bench: begin -->\n";
const END: &str = "<!-- bench: end -->\n";

fn read(file: impl AsRef<Path>) -> String {
    let path = root().join(file);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn committed(name: &str) -> String {
    read(Path::new(COMMITTED).join(name))
}

/// What `benches/peers/run` has measured, where it has.
fn peers() -> Option<String> {
    let path = Path::new(COMMITTED).join("peers.csv");
    root().join(&path).exists().then(|| read(path))
}

#[test]
fn the_guide_shows_the_committed_data() {
    let readme = read("docs/benchmarks.md");
    let (_, rest) = readme.split_once(BEGIN).expect("a place for the table");
    let (shown, _) = rest.split_once(END).expect("an end of the table");
    let report =
        Report::parse(&committed("raw.csv"), &committed("manifest.json"), peers().as_deref()).expect("a report");
    let fresh = report.readme();
    assert!(fresh.matches("\n| ").count() > 4, "{fresh}");
    assert!(shown == fresh, "put this between the marks, as `bench --render {COMMITTED}` prints it:\n{fresh}");
}

#[test]
fn the_committed_report_is_that_of_its_data() {
    let sandbox = Sandbox::new();
    fs::create_dir(sandbox.path("report")).expect("a folder");
    for name in ["raw.csv", "manifest.json"] {
        sandbox.write(&format!("report/{name}"), &committed(name));
    }
    if let Some(peers) = peers() {
        sandbox.write("report/peers.csv", &peers);
    }
    let output = sandbox.ok(&["bench", "--render", "report"]);
    assert!(read("docs/benchmarks.md").contains(&output.stdout), "{}", output.stdout);
    let fresh = fs::read_to_string(sandbox.path("report/report.md")).expect("a report");
    assert!(fresh == committed("report.md"), "run `rodsweep bench --render {COMMITTED}`");
    let figures: Vec<&str> = fresh.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    assert!(figures.len() >= 12, "{figures:?}");
    for figure in figures {
        let vector = figure.replace(".png", ".svg");
        for name in [figure, &vector] {
            assert!(root().join(COMMITTED).join(name).exists(), "{name} is not committed");
        }
        let drawn = fs::read_to_string(sandbox.path("report").join(&vector)).expect("a figure");
        assert!(drawn == committed(&vector), "{vector}: run `rodsweep bench --render {COMMITTED}`");
    }
}

#[test]
fn the_table_reads_back() {
    let raw = committed("raw.csv");
    let records = from_csv(&raw).expect("a table");
    assert!(records.len() > 500, "{} records", records.len());
    let again = from_csv(&to_csv(&records)).expect("a table");
    // NaN is not equal to itself, but is written like itself.
    assert!(format!("{records:?}") == format!("{again:?}"), "numbers are lost on the way");
    let odd = Record { status: "a \"b\", c".into(), seconds: 1.25e-6, ..Record::new("part", "case, one") };
    let back = from_csv(&to_csv(std::slice::from_ref(&odd))).expect("a table");
    assert_eq!((back[0].case.as_str(), back[0].status.as_str(), back[0].seconds), ("case, one", "a \"b\", c", 1.25e-6));
    assert!(back[0].size.is_nan());
    // What is damaged is told by line and column.
    let damaged = to_csv(&[odd]).replace("1.2500e-6", "quick");
    let number = RecordError::Number { line: 2, column: "seconds", cell: "quick".into() };
    assert_eq!(from_csv(&damaged), Err(number));
    assert_eq!(from_csv("a,b\n"), Err(RecordError::Header));
    assert!(from_csv(&raw[..raw.len() - 5]).is_err());
}

#[test]
fn bench_measures_what_it_says() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["bench", "--quick", "--only", "easy,peak", "--out", "report"]);
    assert!(output.stderr.contains("report.md"), "{}", output.stderr);
    let raw = fs::read_to_string(sandbox.path("report/raw.csv")).expect("a table");
    let records = from_csv(&raw).expect("a table");
    let peaks = records.iter().filter(|record| record.part == "peak").map(|record| record.operations);
    assert!(peaks.clone().count() >= 2 && peaks.into_iter().all(|peak| peak > 0.0 && peak.is_finite()));
    let points: Vec<&Record> = records.iter().filter(|record| record.part == "precision").collect();
    for work in ["tip", "cold", "warm"] {
        for (precision, limit) in [("f64", 1e-12), ("f32", 1e-5)] {
            let of = || points.iter().filter(|record| record.work == work && record.precision == precision);
            let best = of().map(|record| record.tip[1]).fold(f64::INFINITY, f64::min);
            assert!(best < limit, "{work} {precision}: {best}");
            assert!(of().all(|record| record.failed == 0.0 && record.elsewhere == 0.0), "{work} {precision}");
            assert!(of().all(|record| record.seconds > 0.0 && record.operations > 1000.0), "{work} {precision}");
            assert!(of().all(|record| record.bounded == record.samples), "{work} {precision}");
            assert!(of().all(|record| record.column[0] <= record.column[1] && record.column[1] <= record.column[2]));
        }
    }
    // A second report does not take the place of the first.
    let output = sandbox.run(&["bench", "--quick", "--only", "peak", "--out", "report"]);
    assert_eq!(output.code, 2);
    assert!(output.stderr.contains("--force"), "{}", output.stderr);
}

/// A bench file of a few samples, for what `benchmark.toml` measures beyond the other scenes.
#[test]
fn others_are_measured_on_the_same_samples() {
    let sandbox = Sandbox::new();
    fs::create_dir(sandbox.path("files")).expect("a folder");
    let file = read("sweeps/bench/benchmark.toml").replace("samples = 256", "samples = 16");
    let file = file.replace("instruction_sets = \"all\"", "instruction_sets = \"best\"");
    sandbox.write("files/small.toml", &file.replace("software_gpu = true", "software_gpu = false"));
    sandbox.ok(&["bench", "--quick", "--files", "files", "--only", "small", "--out", "report"]);
    let raw = fs::read_to_string(sandbox.path("report/raw.csv")).expect("a table");
    let records = from_csv(&raw).expect("a table");
    let of = |engine: &str, work: &str| -> Vec<&Record> {
        let engine = |record: &&Record| record.engine.contains(engine) && record.precision == "f64";
        records.iter().filter(engine).filter(|record| record.part == "precision" && record.work == work).collect()
    };
    for work in ["given", "tip", "cold", "warm"] {
        let crate_of = of("literature: ode_solvers", work);
        assert!(crate_of.len() >= 3, "{work}: {crate_of:?}");
        for record in &crate_of {
            assert_eq!((record.failed, record.elsewhere), (0.0, 0.0), "{work} to {:e}", record.size);
            assert!(record.tip[2] < 5.0 * record.size, "{work} to {:e}: {:e}", record.size, record.tip[2]);
        }
    }
    // Where the base moment is given there is no path to follow, for this program as for the others.
    let passes = |engine: &str, work: &str| of(engine, work).iter().map(|record| record.passes).fold(0.0, f64::max);
    let ours = |work: &str| {
        let ours = of("", work).into_iter().filter(|record| !record.engine.starts_with("literature"));
        ours.map(|record| record.passes).filter(|passes| !passes.is_nan()).fold(0.0, f64::max)
    };
    assert!(ours("sweep") < 0.7 * ours("cold"), "{} and {} passes", ours("sweep"), ours("cold"));
    assert!(ours("given") < 0.7 * ours("tip"), "{} and {} passes", ours("given"), ours("tip"));
    for engine in ["literature: paper's form", "literature: ode_solvers"] {
        let (given, tip) = (passes(engine, "given"), passes(engine, "tip"));
        assert!(given == 1.0 && tip > 2.0 * given, "{engine}: {given} and {tip} passes");
    }
    let report = fs::read_to_string(sandbox.path("report/report.md")).expect("a report");
    for row in ["| this program |", "| paper's form |", "| finite differences |", "| ode_solvers |"] {
        assert!(report.contains(row), "{row}: {report}");
    }
}

#[test]
fn checks_have_a_price() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["bench", "--quick", "--only", "trust,peak", "--out", "report"]);
    let raw = fs::read_to_string(sandbox.path("report/raw.csv")).expect("a table");
    let records = from_csv(&raw).expect("a table");
    let find = |case: &str| records.iter().find(|r| r.part == "trust" && r.case == case).expect("a row");
    let [map, attempts, check] = ["the map", "second attempts", "spot check"].map(find);
    assert!(map.samples > 10_000.0 && map.seconds > 0.0, "{map:?}");
    // Differences of times of runs with and without: of any sign on a busy machine.
    assert!(attempts.seconds.is_finite() && check.seconds.is_finite(), "{attempts:?} {check:?}");
    // Few samples are solved again, and fewer by the scalar reference, whose samples take a hundred times as long.
    assert!(attempts.samples < 0.02 * map.samples, "{attempts:?}");
    assert!(check.samples == 256.0 && check.samples < 0.02 * map.samples, "{check:?}");
    let [sample, estimate, index] = ["a sample", "error estimate", "stability index"].map(|case| find(case).operations);
    assert!(estimate > 1000.0 && index > 100.0 && estimate + index < 0.6 * sample, "{estimate} {index} {sample}");
    let report = fs::read_to_string(sandbox.path("report/report.md")).expect("a report");
    assert!(report.contains("## What trust costs") && output.stderr.contains("what checks cost"), "{report}");
}

#[test]
fn peers_stay_beside_a_new_measurement() {
    let sandbox = Sandbox::new();
    let measure =
        |more: &[&str]| sandbox.run(&[&["bench", "--quick", "--only", "peak", "--out", "report"], more].concat());
    assert_eq!(measure(&[]).code, 0);
    let peer = Record {
        work: "cold".into(),
        engine: "heyoka.py 1.2.3".into(),
        precision: "f64".into(),
        method: "Taylor".into(),
        size: 1e-6,
        tip: [1e-8; 3],
        seconds: 46e-6,
        spread: 0.5,
        ..Record::new("peers", "benchmark")
    };
    let run = Record { status: "Python 3.11".into(), ..Record::new("peers run", "2026-01-02") };
    let peers = to_csv(&[run, peer]);
    sandbox.write("report/peers.csv", &peers);
    let output = measure(&["--force"]);
    assert_eq!(output.code, 0, "{}", output.stderr);
    assert!(fs::read_to_string(sandbox.path("report/peers.csv")).is_ok_and(|text| text == peers));
    let report = fs::read_to_string(sandbox.path("report/report.md")).expect("a report");
    for words in ["| heyoka.py 1.2.3 | Taylor to 1e-6 |", "2026-01-02", "Python 3.11", "in 0 of 0 measurements"] {
        assert!(report.contains(words), "{words}: {report}");
    }
    // What is damaged is told by file and line.
    sandbox.write("report/peers.csv", &peers.replace("4.6000e-5", "quick"));
    let output = sandbox.run(&["bench", "--render", "report"]);
    assert!(output.code == 2 && output.stderr.contains("peers.csv: line 3"), "{}", output.stderr);
}

#[test]
fn the_built_in_files_are_those_of_the_repository() {
    let sandbox = Sandbox::new();
    let mut names: Vec<String> = fs::read_dir(root().join("sweeps/bench"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .map(|path| BenchSpec::read(&path).unwrap_or_else(|error| panic!("{error}")).name)
        .collect();
    names.sort();
    // Where a name is wrong, the list is printed.
    let output = sandbox.run(&["bench", "--only", "nothing"]);
    assert_eq!(output.code, 2);
    for name in &names {
        assert!(output.stderr.contains(name.as_str()), "{name} is not built in: {}", output.stderr);
    }
    let built_in = output.stderr.trim().rsplit("hard, ").next().map_or(0, |list| list.split(", ").count());
    assert_eq!(built_in, names.len(), "{}", output.stderr);
}

#[test]
fn mistakes_are_named() {
    let sandbox = Sandbox::new();
    let file = read("sweeps/bench/heavy.toml");
    for (index, (from, to, named)) in [
        ("work = [\"tip\"", "work = [\"top\"", "bench.work[0]"),
        ("tip = [\"coil.current\"]", "tip = [\"coil.curent\"]", "bench.tip[0]"),
        ("tip = [\"coil.current\"]\n", "", "bench.tip"),
        ("title =", "titel =", "bench.titel"),
        ("title =", "steps = [4, 2]\ntitle =", "bench.steps"),
        ("title =", "steppers = [\"euler\"]\ntitle =", "bench.steppers[0]"),
        ("[bench]", "[solver]", "solver.title"),
    ]
    .into_iter()
    .enumerate()
    {
        let folder = format!("files{index}");
        fs::create_dir(sandbox.path(&folder)).expect("a folder");
        assert!(file.contains(from), "{from}");
        sandbox.write(&format!("{folder}/wrong.toml"), &file.replace(from, to));
        let output = sandbox.run(&["bench", "--files", &folder, "--out", "report"]);
        assert_eq!(output.code, 2, "{named}: {}", output.stderr);
        let line = output.errors().join("\n");
        assert!(line.contains("wrong.toml:") && line.contains(&format!("`{named}`")), "{named}: {line}");
    }
    fs::create_dir(sandbox.path("empty")).expect("a folder");
    for (arguments, named) in [
        (["bench", "--files", "empty"], "empty"),
        (["bench", "--files", "nowhere"], "nowhere"),
        (["bench", "--render", "empty"], "raw.csv"),
    ] {
        let output = sandbox.run(&arguments);
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(named), "{arguments:?}: {}", output.stderr);
    }
    assert!(!sandbox.path("report").exists());
}
