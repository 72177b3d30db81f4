//! Broken files through the program: exit code 2, one message with file, line, key and remedy, nothing written.

use crate::common::texts::{SCENE, SWEEP, sweep};
use crate::sandbox::Sandbox;

/// A mistake: what to replace by what; line and key of the message (0 and "" for none); a word of the remedy.
struct Broken {
    what: &'static str,
    from: &'static str,
    to: &'static str,
    line: usize,
    key: &'static str,
    remedy: &'static str,
}

const fn broken(
    what: &'static str,
    from: &'static str,
    to: &'static str,
    line: usize,
    key: &'static str,
    remedy: &'static str,
) -> Broken {
    Broken { what, from, to, line, key, remedy }
}

#[rustfmt::skip]
const SCENES: &[Broken] = &[
    broken("unknown key", "length = \"80 mm\"", "lenght = \"80 mm\"", 11, "segment[0].lenght", "did you mean `length`?"),
    broken("unknown table", "[loads]", "[load]", 6, "load", "did you mean `loads`?"),
    broken("wrong unit", "length = \"80 mm\"", "length = \"80 mA\"", 11, "segment[0].length", "give a length"),
    broken("negative length", "length = \"80 mm\"", "length = \"-80 mm\"", 11, "segment[0].length", "must be"),
    broken("zero stiffness", "youngs_modulus = \"5 MPa\"", "youngs_modulus = 0", 13, "segment[0].youngs_modulus", "greater than zero"),
    broken("NaN", "flux_density = [0, \"3 T\", 0]", "flux_density = [0, nan, 0]", 5, "field.flux_density[1]", "give a finite number"),
    broken("syntax error", "name = \"test\"", "name = \"test", 1, "", "TOML"),
    broken("duplicate names", "name = \"coil\"", "name = \"tube\"", 17, "segment[1].name", "give each its own name"),
    broken("two elasticities", "shear_modulus = \"2 MPa\"", "shear_modulus = \"2 MPa\"\npoisson_ratio = 0.3", 14, "segment[0].shear_modulus", "keep one"),
    broken("gravity without mass", "mass = \"58 mg\"\n", "", 0, "", ""),
    broken("missing length", "length = \"80 mm\"\n", "", 8, "segment[0].length", "give the segment's length"),
    broken("two components", "tip_force = [0, 0, 0]", "tip_force = [0, 0]", 7, "loads.tip_force", "three values"),
    broken("insertion too short", "[base]", "insertion = \"10 mm\"\n[base]", 2, "insertion", "give more"),
    broken("hollow inside out", "inner_radius = \"0.5 mm\"", "inner_radius = \"5 mm\"", 12, "segment[0].tube", "must be"),
];

#[rustfmt::skip]
const SWEEPS: &[Broken] = &[
    broken("unknown parameter", "\"coil.current.x\"", "\"coil.curent.x\"", 6, "axis[0].parameter", "did you mean `coil.current.x`?"),
    broken("empty grid", "points = 5", "points = 0", 9, "axis[0].points", "at least 1"),
    broken("1e12 samples", "points = 5", "points = 1_000_000_000_000", 5, "axis", "lower the number of samples"),
    broken("missing scene file", "\"scene.toml\"", "\"none.toml\"", 1, "scene", "the path starts from the folder"),
    broken("syntax error", "method = \"grid\"", "method = ", 3, "", "TOML"),
    broken("unknown method", "\"grid\"", "\"gird\"", 3, "sampling.method", "did you mean `grid`?"),
    broken("table beside axes", "method = \"grid\"", "method = \"table\"\nfile = \"none.csv\"", 6, "axis", "remove [[axis]]"),
    broken("zero tolerance", "tolerance = 1e-6", "tolerance = 0", 11, "solver.tolerance", "give a number"),
    broken("unknown quantity", "\"tip_position\"", "\"tip_positon\"", 14, "output.quantities[0]", "did you mean `tip_position`?"),
    broken("unknown derivative", "[\"coil.current\"]", "[\"coil.voltage\"]", 15, "output.derivatives[0]", "no parameter"),
    broken("unknown format", "\"parquet\"", "\"parket\"", 16, "output.format", "did you mean `parquet`?"),
    broken("NaN", "from = \"-0.1 A\"", "from = nan", 7, "axis[0].from", "give a finite number"),
    broken("wrong unit", "from = \"-0.1 A\"", "from = \"-0.1 T\"", 7, "axis[0].from", "give a current"),
    broken("unknown key", "seed = 7", "sede = 7", 4, "sampling.sede", "did you mean `seed`?"),
    broken("unknown branch", "\"from_rest\"", "\"every\"", 12, "solver.branch", "use one of: from_rest, all"),
    broken("no axis", "[[axis]]\nparameter = \"coil.current.x\"\nfrom = \"-0.1 A\"\nto = \"0.1 A\"\npoints = 5\n", "", 0, "axis", "add an [[axis]]"),
    broken("zero voxel", "voxel = \"1 mm\"", "voxel = 0", 18, "workspace.voxel", "greater than zero"),
];

/// Exit code 2, one error line that starts with the file and names line, key and remedy; no output.
fn check(sandbox: &Sandbox, arguments: &[&str], file: &str, broken: &Broken) {
    let output = sandbox.run(arguments);
    let Broken { what, line, key, remedy, .. } = broken;
    let errors = output.errors();
    assert_eq!(output.code, 2, "{what}: {}", output.stderr);
    assert_eq!(output.stdout, "", "{what}");
    assert_eq!(output.stderr.lines().count(), 1, "{what}: {}", output.stderr);
    assert_eq!(errors.len(), 1, "{what}: {}", output.stderr);
    let place = if *line > 0 { format!("{file}:{line}:") } else { file.to_owned() };
    assert!(errors[0].starts_with(&format!("error: {place}")), "{what}: {}", errors[0]);
    assert!(errors[0].contains(key) && errors[0].contains(remedy), "{what}: {}", errors[0]);
    assert!(!sandbox.path("out").exists(), "{what}");
    assert!(!sandbox.path("results").exists(), "{what}");
}

const RUN: [&str; 4] = ["run", "sweep.toml", "--out", "out"];

fn replaced(text: &str, broken: &Broken) -> String {
    assert!(text.contains(broken.from), "{}", broken.from);
    text.replacen(broken.from, broken.to, 1)
}

#[test]
fn broken_scenes() {
    for broken in SCENES {
        let mut text = replaced(SCENE, broken);
        if broken.what == "gravity without mass" {
            text = text.replace("tip_force = [0, 0, 0]", "gravity = [0, 0, -9.81]");
        }
        let sandbox = Sandbox::new();
        sandbox.write("scene.toml", &text);
        check(&sandbox, &["solve", "scene.toml"], "scene.toml", broken);
        check(&sandbox, &RUN, "scene.toml", broken);
    }
}

#[test]
fn broken_sweeps() {
    for broken in SWEEPS {
        let sandbox = Sandbox::new();
        sandbox.write("sweep.toml", &replaced(SWEEP, broken));
        check(&sandbox, &RUN, "sweep.toml", broken);
        check(&sandbox, &["run", "sweep.toml", "--dry-run"], "sweep.toml", broken);
    }
}

#[test]
fn scenes_of_the_wrong_segments() {
    let sandbox = Sandbox::new();
    let blocks: Vec<&str> = SCENE.split("[[segment]]").collect();
    let scene = |segments: &[&str]| {
        let blocks: String = segments.iter().map(|block| format!("[[segment]]{block}")).collect();
        sandbox.write("scene.toml", &format!("{}{blocks}", blocks_head(SCENE)));
    };
    scene(&[]);
    check(&sandbox, &RUN, "scene.toml", &broken("missing segment", "", "", 0, "segment", "add a [[segment]]"));
    scene(&[blocks[2]]);
    check(&sandbox, &RUN, "scene.toml", &broken("no flexible segment", "", "", 8, "segment", "at least one flexible"));
    scene(&[blocks[2], blocks[1]]);
    sandbox.write("sweep.toml", &sweep("insertion", "\"50 mm\"", "\"90 mm\"", 3));
    let rigid =
        broken("insertion into a rigid segment", "", "", 6, "axis[0].parameter", "needs a flexible first segment");
    check(&sandbox, &RUN, "sweep.toml", &rigid);
    sandbox.write("sweep.toml", SWEEP);
    let output = sandbox.run(&["solve", "scene.toml", "--wrt", "insertion"]);
    assert_eq!((output.code, output.errors().len()), (2, 1), "{}", output.stderr);
    let output = sandbox.run(&["solve", "scene.toml", "--set", "insertion=0.1"]);
    assert_eq!((output.code, output.errors().len()), (2, 1), "{}", output.stderr);
}

fn blocks_head(text: &str) -> &str {
    text.split("[[segment]]").next().unwrap_or_default()
}

#[test]
fn broken_tables() {
    let sandbox = Sandbox::new();
    sandbox.write("sweep.toml", "scene = \"scene.toml\"\n[sampling]\nmethod = \"table\"\nfile = \"inputs.csv\"\n");
    let missing = broken("missing table", "", "", 4, "sampling.file", "the path starts from the folder");
    check(&sandbox, &RUN, "sweep.toml", &missing);
    for (text, broken) in [
        ("coil.curent.x\n1\n", broken("unknown column", "", "", 1, "coil.curent.x", "did you mean `coil.current.x`?")),
        ("coil.current.x\n1\n2 T\n", broken("wrong unit", "", "", 3, "coil.current.x", "give a current")),
        ("coil.current.x,insertion\n1,0.08\n2\n", broken("short line", "", "", 3, "", "mend the line")),
        ("coil.current.x\n", broken("no rows", "", "", 0, "", "has no rows")),
    ] {
        sandbox.write("inputs.csv", text);
        check(&sandbox, &RUN, "inputs.csv", &broken);
    }
}

#[test]
fn broken_commands() {
    let sandbox = Sandbox::new();
    for (arguments, words) in [
        (&["solve", "none.toml"][..], "none.toml: cannot be read"),
        (&["run", "none.toml"], "none.toml: cannot be read"),
        (&["solve", "."], "cannot be read"),
        (&["run", "sweep.toml", "--shard", "3/2"], "`--shard`: shard `3/2`: K is not between 1 and N"),
        (&["run", "sweep.toml", "--shard", "half"], "write K/N"),
        (&["run", "sweep.toml", "--limit", "0"], "--limit"),
        (&["run", "sweep.toml", "--colour", "tip.colour"], "no such column"),
        (&["run", "sweep.toml", "--precision", "half"], "possible values: f32, f64, auto"),
        (&["status", "none"], "none holds no run of rodsweep"),
    ] {
        let output = sandbox.run(arguments);
        assert_eq!((output.code, output.errors().len()), (2, 1), "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{}", output.stderr);
        assert!(!sandbox.path("results").exists(), "{arguments:?}");
    }
}

#[test]
fn a_directory_of_another_sweep() {
    let sandbox = Sandbox::new();
    sandbox.ok(&[&RUN[..], &["--quiet", "--no-figures"]].concat());
    let list = || {
        let entries = std::fs::read_dir(sandbox.path("out")).unwrap().map(|entry| entry.unwrap());
        let mut all: Vec<_> = entries.map(|entry| (entry.path(), std::fs::read(entry.path()).unwrap())).collect();
        all.sort();
        all
    };
    let before = list();
    sandbox.write("sweep.toml", &SWEEP.replace("to = \"0.1 A\"", "to = \"0.2 A\""));
    for more in [&["--quiet"][..], &["--quiet", "--resume"]] {
        let output = sandbox.run(&[&RUN[..], more].concat());
        assert_eq!((output.code, output.errors().len()), (2, 1), "{}", output.stderr);
        assert!(output.stderr.contains("out holds another run"), "{}", output.stderr);
        assert!(output.stderr.contains("`[[axis]] coil.current.x.to`: 0.2 A, was 0.1 A"), "{}", output.stderr);
        assert!(output.stderr.contains("`--force` replaces it, `--out DIR` keeps both"), "{}", output.stderr);
        assert!(!output.stderr.contains("error share"), "{}", output.stderr);
    }
    assert!(before == list());
}
