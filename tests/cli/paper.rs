//! `bench --paper`: the comparison is printed and written, and what it cannot do is refused.

use crate::sandbox::Sandbox;

const ROWS: [&str; 11] = [
    "chain of links, to 1e-3",
    "chain of links, to 1e-4",
    "finite differences, forward",
    "finite differences, central",
    "finite differences of one pass",
    "paper's 9-number form",
    "paper's form, 0.2 mm steps",
    "this program, one a call",
    "this program, batches of 4096",
    "this program, continued, one a call",
    "this program, continued, 8 a call",
];

#[test]
fn bench_prints_the_papers_comparison() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["bench", "--paper", "--samples", "3", "--repeats", "1", "--out", "reports"]);
    for row in ROWS {
        let count = output.stdout.lines().filter(|line| line.starts_with(row)).count();
        assert!(count >= 2, "{row}: {}", output.stdout);
    }
    for published in ["2.00 ms", "5.50 ms", "4.10 ms", "95.00 ms"] {
        assert!(output.stdout.contains(published), "{published}: {}", output.stdout);
    }
    let read = |name: &str| std::fs::read_to_string(sandbox.path("reports").join(name)).expect("a report");
    let (csv, markdown) = (read("paper.csv"), read("paper.md"));
    assert_eq!(csv.lines().count(), 1 + ROWS.len(), "{csv}");
    assert!(ROWS.iter().all(|row| markdown.contains(&format!("| {row} |"))), "{markdown}");

    let output = sandbox.ok(&["bench", "--paper", "--samples", "12", "--repeats", "1", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON alone");
    let rows = value["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), ROWS.len());
    for row in rows {
        assert!(row["tip_error"]["p95"].as_f64() <= row["asked"].as_f64(), "{row}");
        assert_eq!((row["other_branch"].as_u64(), row["failed"].as_u64()), (Some(0), Some(0)), "{row}");
        let is_continued = row["method"].as_str().is_some_and(|name| name.contains("continued"));
        let what = if is_continued { "warm" } else { "cold" };
        assert!(row["seconds"][what]["measured"]["median"].as_f64() > Some(0.0), "{row}");
        assert!(row["seconds"]["control"]["measured"]["median"].as_f64() > Some(0.0), "{row}");
    }
}

#[test]
fn bench_refuses_what_it_cannot_do() {
    let sandbox = Sandbox::new();
    let scene = std::fs::read_to_string(sandbox.path("scene.toml")).expect("a scene");
    sandbox.write("couple.toml", &scene.replace("tip_force = [0, 0, 0]", "tip_moment = [\"1e-5 N·m\", 0, 0]"));
    sandbox.write("bare.toml", scene.split("[[segment]]\nname = \"coil\"").next().expect("the tube"));
    for (arguments, named) in [
        (&["bench", "--paper", "--scene", "couple.toml"][..], &["couple.toml", "loads.tip_moment"][..]),
        (&["bench", "--paper", "--scene", "bare.toml"], &["bare.toml", "coil"]),
        (&["bench", "--paper", "--scene", "none.toml"], &["none.toml"]),
        (&["bench", "--paper", "--samples", "0"], &["--samples", "1 to 100000"]),
    ] {
        let output = sandbox.run(arguments);
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.stderr);
        assert!(named.iter().all(|word| output.stderr.contains(word)), "{arguments:?}: {}", output.stderr);
    }
}
