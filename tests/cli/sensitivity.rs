//! `rodsweep sensitivity`: files, JSON, exit codes, mistakes.

use crate::sandbox::{Sandbox, json};

/// The tube with uncertain stiffness and windings.
fn sweep(sampling: &str) -> String {
    let axis = |parameter: &str| format!("[[axis]]\nparameter = \"{parameter}\"\nrelative = \"10 %\"\n");
    format!(
        "scene = \"scene.toml\"\n[sampling]\n{sampling}\n[[axis]]\nparameter = \"coil.current.z\"\nfrom = \"50 mA\"\n\
         to = \"100 mA\"\n{}{}[solver]\ntolerance = 1e-6\n",
        axis("tube.youngs_modulus"),
        axis("coil.turns.z")
    )
}

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("saltelli.toml", &sweep("method = \"saltelli\"\nsamples = 32\nseed = 1"));
    sandbox.write("sobol.toml", &sweep("method = \"sobol\"\nsamples = 64\nseed = 1"));
    sandbox
}

#[test]
fn a_sweep_is_run_and_told_of_and_its_directory_again() {
    let sandbox = sandbox();
    let answer = sandbox.ok(&["sensitivity", "saltelli.toml", "--out", "out", "--backend", "cpu"]);
    assert!(answer.stdout.contains("tip.position.y, by azzini"), "{}", answer.stdout);
    for file in [
        "indices.csv",
        "dgsm.csv",
        "local.csv",
        "moments.csv",
        "failures.csv",
        "chaos.csv",
        "sensitivity.json",
        "indices.png",
    ] {
        assert!(sandbox.path("out").join(file).is_file(), "{file}");
    }
    let again = sandbox.ok(&["sensitivity", "out", "--json", "--no-figures", "--outputs", "tip.position.y", "--quiet"]);
    let found = json(&again.stdout);
    assert_eq!((&found["method"], &found["rows"]), (&"saltelli".into(), &(32 * 8).into()));
    let indices = found["indices"].as_array().expect("indices");
    assert!(indices.iter().all(|index| index["output"] == "tip.position.y"));
    let current = |index: &&serde_json::Value| index["input"] == "coil.current.z" && index["index"] == "ST";
    let total = indices.iter().find(current).expect("an index")["value"].as_f64().expect("a number");
    assert!(total > 0.5 && total < 1.0, "{total}");
    assert!(again.stderr.is_empty(), "{}", again.stderr);
    let csv = std::fs::read_to_string(sandbox.path("out").join("indices.csv")).expect("a table");
    assert!(csv.starts_with("output,input,index,estimator,main,value,low,high,pairs,rows,flag\n"), "{csv}");
    assert!(csv.contains("coil.current.z*tube.youngs_modulus,S2"), "{csv}");
}

#[test]
fn measurements_are_chosen_into_a_table_that_runs() {
    let sandbox = sandbox();
    let mut text = sweep("method = \"sobol\"\nsamples = 64\nseed = 1");
    text = text.split("[[axis]]\nparameter = \"tube").next().expect("one axis").to_owned();
    text += "[[uncertain]]\nparameter = \"tube.youngs_modulus\"\nrelative = \"10 %\"\n[[uncertain]]\n\
             parameter = \"tube.rest_curvature.y\"\ndistribution = \"normal\"\nstandard_deviation = 0.5\n";
    sandbox.write("calibration.toml", &text);
    let arguments = ["sensitivity", "calibration.toml", "--choose", "2", "--noise", "0.5mm", "--out", "out"];
    let answer = sandbox.ok(&[&arguments[..], &["--backend", "cpu"]].concat());
    assert!(answer.stdout.contains("chosen samples: "), "{}", answer.stdout);
    sandbox.write(
        "chosen.toml",
        "scene = \"scene.toml\"\n[sampling]\nmethod = \"table\"\nfile = \"out/design.csv\"\n[solver]\ntolerance = 1e-6\n",
    );
    sandbox.ok(&["run", "chosen.toml", "--out", "measured", "--backend", "cpu", "--no-figures", "--quiet"]);
}

#[test]
fn mistakes_name_the_flag_and_leave_no_files() {
    let sandbox = sandbox();
    for (arguments, expected) in [
        (
            &["sensitivity", "sobol.toml", "--outputs", "tip.positon"][..],
            "`--outputs`: no output `tip.positon`: did you mean",
        ),
        (&["sensitivity", "sobol.toml", "--inputs", "coil.curent.x"], "`--inputs`: no input `coil.curent.x`"),
        (&["sensitivity", "sobol.toml", "--estimator", "azzini"], "`--estimator`: azzini needs the design of"),
        (&["sensitivity", "sobol.toml", "--confidence", "95"], "`--confidence`: the confidence is 95"),
        (&["sensitivity", "sobol.toml", "--degree", "9"], "`--degree`: the degree is 9"),
        (&["sensitivity", "sobol.toml", "--choose", "3"], "--noise"),
        (&["sensitivity", "sobol.toml", "--noise", "1 A"], "`--noise 1 A`"),
        (&["sensitivity", "nothing.toml"], "nothing.toml"),
        (&["sensitivity", "."], "holds no run"),
    ] {
        let answer = sandbox.run(&[arguments, &["--backend", "cpu"]].concat());
        assert_eq!(answer.code, 2, "{arguments:?}: {}", answer.stderr);
        assert!(answer.stderr.contains(expected), "{arguments:?}: {}", answer.stderr);
        assert!(!sandbox.path("results").exists(), "{arguments:?}");
    }
    sandbox.write(
        "grid.toml",
        &sweep("method = \"grid\"")
            .replace("relative = \"10 %\"", "relative = \"10 %\"\npoints = 3\ndistribution = \"normal\""),
    );
    let grid = sandbox.run(&["sensitivity", "grid.toml"]);
    assert_eq!(grid.code, 2, "{}", grid.stderr);
}
