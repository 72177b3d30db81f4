//! Every equilibrium of a sweep, by the program.

use crate::sandbox::Sandbox;
use rodsweep::results::read_parquet_table;
use std::fs;

#[test]
fn the_program_says_what_it_found() {
    let sandbox = Sandbox::new();
    let scene = fs::read_to_string(sandbox.path("scene.toml")).unwrap();
    sandbox.write("scene.toml", &scene.replace("rest_curvature = [0, 0, 0]", "rest_curvature = [0, 3, 0]"));
    let sweep = fs::read_to_string(sandbox.path("sweep.toml")).unwrap().replace("\"from_rest\"", "\"all\"");
    sandbox.write("sweep.toml", &sweep.replace("0.1 A", "0.2 A"));
    let refused = sandbox.run(&["run", "sweep.toml", "--backend", "reference", "--out", "out"]);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    assert!(refused.errors()[0].contains("use `--backend cpu`") && !sandbox.path("out").exists());
    let output = sandbox.ok(&["run", "sweep.toml", "--backend", "cpu", "--out", "out", "--verbose"]);
    for word in ["status of ", "have an equilibrium", "equilibria: at most ", ", search ", "branches.png"] {
        assert!(output.stderr.contains(word), "{word}: {}", output.stderr);
    }
    assert!(sandbox.path("out/branches.png").is_file());
    let status = sandbox.ok(&["status", "out"]);
    assert!(status.stdout.contains("5 samples") && status.stdout.contains("every equilibrium: "), "{}", status.stdout);
    let without_rows = sweep.replace("\"parquet\"", "\"none\"").replace("derivatives = [\"coil.current\"]\n", "");
    sandbox.write("none.toml", &without_rows);
    sandbox.ok(&["run", "none.toml", "--backend", "cpu", "--out", "none"]);
    let table = read_parquet_table(&sandbox.path("none/tips.parquet")).unwrap();
    assert!(table.column("branch").is_some() && table.sample_count() == 5);
}
