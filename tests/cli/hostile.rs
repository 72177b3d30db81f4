//! Names of users are data: through whatever door they come, none becomes a command, a control sequence or markup. Files are
//! files, and numbers have bounds.

use super::sandbox::{Output, Sandbox, json};
use crate::common::texts::SCENE;
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

/// What terminals, readers of XML, pages and shells obey, in TOML.
const NAME: &str = r#"\u001b[31mred\u001b]0;title\u0007 \u202e \u2028 \u0001 <b>&\"'$(touch BROKEN)`x` \u009b \u007f"#;

fn is_plain(text: &str) -> bool {
    text.chars().all(|c| !c.is_control() || c == '\n' || c == '\t') && !text.contains(['\u{202e}', '\u{2028}'])
}

fn told(output: &Output) {
    assert!(is_plain(&output.stdout) && is_plain(&output.stderr), "{:?} {:?}", output.stdout, output.stderr);
}

#[test]
fn hostile_names_through_every_door() {
    let sandbox = Sandbox::new();
    let scene = SCENE.replace("name = \"test\"", &format!("name = \"{NAME}\""));
    sandbox.write("scene.toml", &scene);
    let doors: [&[&str]; 9] = [
        &["solve", "scene.toml", "--plot", "rod.svg"],
        &["solve", "scene.toml", "--json"],
        &["solve", "scene.toml", "--explain"],
        &["run", "sweep.toml", "--out", "out", "--backend", "cpu"],
        &["status", "out"],
        &["figures", "out"],
        &["workspace", "sweep.toml", "--out", "w", "--voxel", "4mm"],
        &["sensitivity", "out", "--out", "s"],
        &["view", "out", "--export", "page.html"],
    ];
    for door in doors {
        let output = sandbox.run(door);
        told(&output);
        assert!((0..=3).contains(&output.code), "{door:?}: {}", output.stderr);
    }
    json(&sandbox.ok(&["solve", "scene.toml", "--json"]).stdout);
    let forbidden = |c: char| c < ' ' && c != '\n' && c != '\t' && c != '\r';
    let mut figures = 0;
    for folder in [".", "out", "w", "s"] {
        // A study that is refused writes nothing.
        for entry in fs::read_dir(sandbox.path(folder)).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "svg" || extension == "html" || extension == "vtp")
            {
                let text = String::from_utf8_lossy(&fs::read(&path).unwrap()).into_owned();
                let text = text.split("<AppendedData").next().unwrap_or_default();
                assert!(!text.contains(forbidden), "{}", path.display());
                assert!(!text.contains("<b>&\""), "{}", path.display());
                figures += 1;
            }
        }
    }
    assert!(figures > 3, "{figures}");
    assert!(!sandbox.path("BROKEN").exists());
    // Names of files, and what is typed.
    for arguments in [
        &["solve", "no\u{1b}[31m\u{7}such.toml"][..],
        &["solve", "scene.toml", "--set", "a\u{1b}[31m=1"],
        &["run", "sweep.toml", "--colour", "x\u{9b}31m"],
        &["status", "no\u{1b}such"],
        &["sol\u{1b}ve"],
        &["solve", "scene.toml", "--no\u{1b}flag"],
    ] {
        let output = sandbox.run(arguments);
        told(&output);
        assert_ne!(output.code, 0, "{arguments:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_line_break_in_a_name_is_no_command() {
    let sandbox = Sandbox::new();
    let hostile = "sweep\ntouch BROKEN\n#.toml";
    fs::copy(sandbox.path("sweep.toml"), sandbox.path(hostile)).unwrap();
    let submit = |sweep: &str, more: &[&str]| {
        sandbox.run(&[&["submit", "slurm", sweep, "--workers", "2", "--program", "/bin/true"], more].concat())
    };
    for (sweep, more) in [
        (hostile, &["--out", "out", "--write", "a"][..]),
        ("sweep.toml", &["--out", "out", "--write", "files\ntouch BROKEN\n#"]),
        ("sweep.toml", &["--out", "o\ntouch BROKEN\n#", "--write", "a"]),
        ("sweep.toml", &["--out", "out", "--write", "a", "--partition", "p\ntouch BROKEN"]),
        ("sweep.toml", &["--out", "out", "--write", "a", "--account", "a\rtouch BROKEN"]),
        ("sweep.toml", &["--out", "out", "--write", "a", "--run", "--quiet\ntouch BROKEN"]),
    ] {
        let output = submit(sweep, more);
        assert_eq!(output.code, 2, "{more:?}: {}", output.stderr);
        told(&output);
        assert!(!sandbox.path("a").exists(), "{more:?}");
    }
    // Every other character stays within its word.
    let names = "we$(touch BROKEN)ird `touch BROKEN` 'a\" ;touch BROKEN; # %j \\ &|";
    fs::copy(sandbox.path("sweep.toml"), sandbox.path(&format!("{names}.toml"))).unwrap();
    let output = submit(
        &format!("{names}.toml"),
        &["--out", names, "--write", "files", "--partition", "$(touch BROKEN)", "--run", "--colour '$(touch BROKEN)'"],
    );
    assert_eq!(output.code, 0, "{}", output.stderr);
    for script in ["worker.sh", "end.sh"] {
        let status =
            Command::new("bash").arg(sandbox.path("files").join(script)).current_dir(sandbox.path(".")).status();
        status.unwrap();
        let text = fs::read_to_string(sandbox.path("files").join(script)).unwrap();
        assert!(text.contains("--output=") && text.contains("#SBATCH --job-name='"), "{text}");
    }
    assert!(!sandbox.path("BROKEN").exists());
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused_at_every_door() {
    let sandbox = Sandbox::new();
    assert!(Command::new("mkfifo").arg(sandbox.path("pipe")).status().unwrap().success());
    for name in ["pipe.csv", "pipe.toml", "pipe.parquet"] {
        std::os::unix::fs::symlink("pipe", sandbox.path(name)).unwrap();
    }
    std::os::unix::fs::symlink("/dev/zero", sandbox.path("zero.csv")).unwrap();
    let map = |file: &str| format!("{SCENE}[[field_map]]\nname = \"map\"\nfile = \"{file}\"\n");
    sandbox.write("zero.toml", &map("zero.csv"));
    sandbox.write("piped.toml", &map("pipe.csv"));
    sandbox.write("device.toml", &map("/dev/zero"));
    sandbox.write("table.toml", "scene = \"scene.toml\"\n[sampling]\nmethod = \"table\"\nfile = \"pipe.csv\"\n");
    for arguments in [
        &["solve", "zero.toml"][..],
        &["solve", "piped.toml"],
        &["solve", "device.toml"],
        &["solve", "pipe"],
        &["solve", "/dev/zero"],
        &["run", "pipe", "--out", "out"],
        &["run", "table.toml", "--out", "out"],
        &["workspace", "pipe"],
        &["sensitivity", "pipe"],
        &["view", "pipe", "--no-open"],
        &["control", "scene.toml", "pipe.csv"],
        &["control", "scene.toml", "--targets", "pipe.parquet"],
        &["fit", "scene.toml", "pipe.csv"],
        &["import", "pipe"],
        &["submit", "slurm", "pipe", "--out", "o", "--workers", "1"],
    ] {
        let mut child = sandbox.command(arguments).stderr(std::process::Stdio::piped()).spawn().unwrap();
        let begin = Instant::now();
        let code = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status.code();
            }
            if begin.elapsed() > Duration::from_secs(60) {
                child.kill().unwrap();
                panic!("{arguments:?} waits");
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        assert_eq!(code, Some(2), "{arguments:?}");
    }
}

#[test]
fn numbers_have_bounds() {
    let sandbox = Sandbox::new();
    let axis = |from: &str, to: &str| crate::common::texts::sweep("loads.tip_force.x", from, to, 5);
    sandbox.write("wide.toml", &axis("-1.7e308", "1.7e308"));
    sandbox.write("beyond.toml", &axis("0", "2e60"));
    sandbox.write("targets.csv", "x,y,z\n1e300,0,0\n");
    sandbox.write("directions.csv", "x,y,z,tx,ty,tz\n0,0.01,0.09,1e200,1e200,0\n");
    sandbox.write("circle.toml", "shape = \"circle\"\nsize = 1e300\ncentre = [0, 0, 0.09]\n");
    sandbox.write(
        "wall.toml",
        &format!("{SCENE}[wall]\nkind = \"sphere\"\nside = \"inside\"\nposition = [0, 0, 0]\nradius = 1e300\n"),
    );
    sandbox.write(
        "stiff.toml",
        "shape = \"circle\"\nsize = 0.001\ncentre = [0, 0, 0.09]\n[[input]]\nparameter = \"tube.youngs_modulus\"\n\
         from = 0\nto = \"2 MPa\"\n",
    );
    sandbox.write("time.toml", "shape = \"circle\"\nsize = 0.001\ncentre = [0, 0, 0.09]\nduration = -1\n");
    sandbox
        .write("twice.toml", "shape = \"circle\"\nsize = 0.001\ncentre = [0, 0, 0.09]\ncoordinates = [\"x\", \"x\"]\n");
    for (arguments, words) in [
        (&["run", "wide.toml"][..], "at most 1e60 in size"),
        (&["run", "beyond.toml"], "at most 1e60 in size"),
        (&["solve", "scene.toml", "--set", "coil.current.x=1e61"], "at most 1e60 in size"),
        (&["control", "scene.toml", "--targets", "targets.csv"], "at most 1e60 in size"),
        (&["control", "scene.toml", "--targets", "directions.csv"], "at most 1e60 in size"),
        (&["control", "scene.toml", "circle.toml"], "at most 1e60 in size"),
        (&["control", "scene.toml", "time.toml"], "a time above zero"),
        (&["control", "scene.toml", "twice.toml"], "named twice"),
        (&["control", "scene.toml", "--targets", "ok.csv", "--input", "coil.current=1e300"], "at most 1e60 in size"),
        (&["control", "scene.toml", "--targets", "ok.csv", "--input", "insertion=-1..0.1"], "is no length"),
        (&["control", "scene.toml", "--targets", "ok.csv", "--input", "insertion=0.05..100"], "a hundred times"),
        (&["workspace", "sweep.toml", "--voxel", "1e-300"], "no length"),
        (&["workspace", "sweep.toml", "--reach", "1e300,0,0"], "at most 1e60 in size"),
        (&["workspace", "sweep.toml", "--vary", "tube.youngs_modulus=1..1e61:5"], "at most 1e60 in size"),
        (&["workspace", "sweep.toml", "--voxel", "1e61"], "at most 1e60 in size"),
        (&["solve", "wall.toml"], "`wall.radius` is 1e300: it must be at most 1e60 in size"),
        (
            &["control", "scene.toml", "--targets", "ok.csv", "--input", "tube.youngs_modulus=-1..1e9"],
            "at its lower limit `tube.youngs_modulus` is -1: it must be finite and greater than zero",
        ),
        (
            &["control", "scene.toml", "stiff.toml"],
            "`input[0].from`: at its lower limit `tube.youngs_modulus` is 0: it must be",
        ),
    ] {
        sandbox.write("ok.csv", "x,y,z\n0,0.01,0.09\n");
        let output = sandbox.run(arguments);
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{arguments:?}: {}", output.stderr);
        assert!(!output.stderr.contains("0000000000"), "{arguments:?}: {}", output.stderr);
    }
}

#[test]
fn settings_that_are_too_large_are_not_parsed() {
    let sandbox = Sandbox::new();
    sandbox.write("big.toml", &format!("{SCENE}# {}\n", "x".repeat(16 << 20)));
    for arguments in [
        &["solve", "big.toml"][..],
        &["run", "big.toml", "--out", "out"],
        &["check", "big.toml"],
        &["control", "scene.toml", "big.toml"],
        &["import", "big.toml"],
    ] {
        let output = sandbox.run(arguments);
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains("16 MiB"), "{arguments:?}: {}", output.stderr);
    }
}

#[test]
fn names_are_looked_up_in_proportion() {
    let sandbox = Sandbox::new();
    // An unknown name that is compared with every other takes its length times theirs.
    let columns: Vec<String> = (0..300_000).map(|column| format!("c{column}")).collect();
    let zeros = ",0".repeat(columns.len());
    sandbox.write("wide.csv", &format!("coil.current.x,{}\n0.1{zeros}\n", columns.join(",")));
    sandbox.write("long.csv", &format!("coil.current.x,{}\n0.1,0\n", "coil.current.".repeat(250_000)));
    fs::write(sandbox.path("nul.csv"), vec![0; 3_000_000]).unwrap();
    let table = |file: &str| {
        format!(
            "scene = \"scene.toml\"\n[sampling]\nmethod = \"table\"\nfile = \"{file}\"\nextra_columns = \"ignore\"\n"
        )
    };
    sandbox.write("wide.toml", &table("wide.csv"));
    sandbox.write("long.toml", &table("long.csv"));
    for sweep in ["wide.toml", "long.toml"] {
        let out = sweep.trim_end_matches(".toml");
        let output = sandbox.ok(&["run", sweep, "--out", out, "--backend", "cpu", "--no-figures"]);
        assert!(
            output.stderr.contains("that are ignored: `c") && output.stderr.len() < 5000,
            "{}",
            output.stderr.len()
        );
    }
    for table in ["wide.csv", "long.csv", "nul.csv"] {
        for arguments in [&["fit", "scene.toml", table][..], &["control", "scene.toml", "--replay", table]] {
            let output = sandbox.run(arguments);
            assert_eq!(output.code, 2, "{arguments:?}: {}", output.stderr.len());
            assert!(output.stderr.len() < 2000, "{arguments:?}: {}", output.stderr.len());
        }
    }
}

#[test]
fn work_is_in_proportion_to_what_is_there() {
    let sandbox = Sandbox::new();
    // A field map of 300,000 columns.
    let columns: Vec<String> = (0..300_000).map(|column| format!("c{column}")).collect();
    sandbox.write("wide.csv", &format!("{}\n0{}\n", columns.join(","), ",0".repeat(299_999)));
    sandbox.write("wide.toml", &format!("{SCENE}[[field_map]]\nname = \"map\"\nfile = \"wide.csv\"\n"));
    let begin = Instant::now();
    let output = sandbox.run(&["solve", "wide.toml"]);
    assert!(output.code == 2 && output.stderr.contains("is missing"), "{}", output.stderr);
    // Columns compared with one another take minutes.
    assert!(begin.elapsed() < Duration::from_secs(30));
    // A forged run of a billion parts.
    sandbox.ok(&["run", "sweep.toml", "--out", "out", "--backend", "cpu", "--no-figures"]);
    let mut run = json(&fs::read_to_string(sandbox.path("out/run.json")).unwrap());
    run["version"] = "0.1.0".into();
    run["sample_count"] = 1_000_000_000u64.into();
    run["chunk"] = 1.into();
    sandbox.write("out/run.json", &run.to_string());
    let mut status = sandbox.command(&["status", "out"]);
    limit_memory(&mut status);
    let output = status.output().unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("of 1000000000 parts done"), "{told} {}", String::from_utf8_lossy(&output.stderr));
    let mut merge = sandbox.command(&["merge", "out", "--out", "all"]);
    limit_memory(&mut merge);
    assert_eq!(merge.output().unwrap().status.code(), Some(1));
    let resumed = sandbox.run(&["run", "sweep.toml", "--out", "out", "--backend", "cpu", "--resume"]);
    assert_eq!(resumed.code, 2, "{}", resumed.stderr);
}

/// A gigabyte and a half of addresses: a list of a billion numbers does not fit.
fn limit_memory(command: &mut Command) {
    let program = command.get_program().to_owned();
    let arguments: Vec<_> = command.get_args().map(ToOwned::to_owned).collect();
    let folder = command.get_current_dir().map(ToOwned::to_owned);
    let mut limited = Command::new("bash");
    limited.args(["-c", "ulimit -v 4000000; exec \"$@\"", "bash"]).arg(program).args(arguments);
    if let Some(folder) = folder {
        limited.current_dir(folder);
    }
    *command = limited;
}

#[cfg(unix)]
#[test]
fn an_exported_page_is_replaced_whole_and_no_link_is_followed() {
    let sandbox = Sandbox::new();
    sandbox.write("outside.html", "mine");
    std::os::unix::fs::symlink("outside.html", sandbox.path("page.html")).unwrap();
    sandbox.ok(&["view", "scene.toml", "--export", "page.html"]);
    assert_eq!(fs::read_to_string(sandbox.path("outside.html")).unwrap(), "mine");
    assert!(fs::read_to_string(sandbox.path("page.html")).unwrap().starts_with("<!doctype html>"));
}

#[test]
fn a_study_survives_a_figure_with_nothing_to_draw() {
    let sandbox = Sandbox::new();
    // A rod that bends in a plane knows no torsion.
    let sweep = crate::common::texts::sweep("loads.tip_force.x", "1e-4", "1e-3", 5)
        .replace("method = \"grid\"", "method = \"sobol\"\nsamples = 64")
        .replace("points = 5\n", "")
        .replace("[\"tip_position\"]", "[\"tip_position\", \"stability\"]");
    let scene = SCENE.split("[[segment]]\nname = \"coil\"").next().unwrap().replace("\"3 T\"", "0");
    sandbox.write("scene.toml", &scene);
    let uncertain = "[[uncertain]]\nparameter = \"tube.shear_modulus\"\nrelative = \"5 %\"\n";
    sandbox.write("sweep.toml", &(sweep.replace("[\"coil.current\"]", "[]") + uncertain));
    let output = sandbox.ok(&["sensitivity", "sweep.toml", "--out", "out", "--backend", "cpu", "--json"]);
    assert!(json(&output.stdout)["indices"].is_array(), "{}", output.stdout);
    assert!(output.stderr.contains("is left out: nothing to draw"), "{}", output.stderr);
}

#[test]
fn an_axis_that_round_off_hides_is_refused() {
    let sandbox = Sandbox::new();
    let sweep = crate::common::texts::sweep("coil.current.x", "0.1", "0.10000000000000002", 5)
        .replace("method = \"grid\"", "method = \"sobol\"\nsamples = 64")
        .replace("points = 5\n", "");
    sandbox.write("sweep.toml", &sweep);
    let output = sandbox.run(&["sensitivity", "sweep.toml", "--out", "out", "--backend", "cpu"]);
    assert_eq!(output.code, 2, "{}", output.stderr);
    assert!(output.stderr.contains("round-off hides"), "{}", output.stderr);
}

#[test]
fn notices_travel_with_the_program() {
    let sandbox = Sandbox::new();
    let told = sandbox.ok(&["licenses"]).stdout;
    for words in ["rayon", "serde", "Apache License", "Liberation Sans", "SIL OPEN FONT LICENSE", "three.js"] {
        assert!(told.contains(words), "{words}");
    }
    sandbox.ok(&["view", "scene.toml", "--export", "page.html"]);
    assert!(fs::read_to_string(sandbox.path("page.html")).unwrap().contains("three.js authors"));
}

#[test]
fn voxels_that_are_too_coarse_are_blamed_and_not_the_scene() {
    let sandbox = Sandbox::new();
    let scene = crate::common::root().join("sweeps/scenes/p6.toml");
    let axis = |name: &str, from: &str, to: &str| {
        format!("[[axis]]\nparameter = \"{name}\"\nfrom = \"{from}\"\nto = \"{to}\"\n")
    };
    let axes = [
        axis("coil.current.x", "-0.3 A", "0.3 A"),
        axis("coil.current.y", "-0.3 A", "0.3 A"),
        axis("insertion", "85 mm", "100 mm"),
    ];
    let sampling = "[sampling]\nmethod = \"sobol\"\nsamples = 1024\n";
    sandbox.write("coarse.toml", &format!("scene = {:?}\n{sampling}{}", scene, axes.concat()));
    let arguments = ["workspace", "coarse.toml", "--voxel", "20mm", "--out", "w", "--json", "--backend", "cpu"];
    let output = sandbox.run(&arguments);
    assert_eq!(output.code, 3, "{}", output.stderr);
    assert!(output.stderr.contains("voxels too coarse: ") && !output.stderr.contains("check the scene"));
    let found = json(&output.stdout);
    let [low, high] = ["low", "high"].map(|end| found["volume"][end].as_f64().unwrap());
    assert!(low < high, "{}", found["volume"]);
    assert!(sandbox.path("w/workspace.json").exists() && sandbox.path("w/workspace.parquet").exists());
    let uncertain = "[[uncertain]]\nparameter = \"proximal.youngs_modulus\"\nrelative = \"5 %\"\n";
    let text = fs::read_to_string(sandbox.path("coarse.toml")).unwrap();
    sandbox.write("coarse.toml", &(text + uncertain));
    let designs = sandbox.run(&[&arguments[..], &["--robust", "--designs", "0"]].concat());
    assert!(designs.code == 2 && designs.stderr.contains("give at least one"), "{}", designs.stderr);
}

#[test]
fn a_study_as_json_writes_nothing_beside_the_rows() {
    let sandbox = Sandbox::new();
    let sweep = crate::common::texts::sweep("coil.current.z", "-0.1", "0.1", 5)
        .replace("method = \"grid\"", "method = \"sobol\"\nsamples = 64")
        .replace("points = 5\n", "");
    sandbox.write("sweep.toml", &sweep);
    sandbox.ok(&["run", "sweep.toml", "--out", "out", "--backend", "cpu", "--no-figures"]);
    let files = || {
        let mut names: Vec<_> = fs::read_dir(sandbox.path("out")).unwrap().map(|entry| entry.unwrap().path()).collect();
        names.sort();
        names
    };
    let before = files();
    let told = json(&sandbox.ok(&["sensitivity", "out", "--json", "--outputs", "tip.position.y"]).stdout);
    assert_eq!(files(), before);
    assert_eq!(told["checked"], "64 of 64 samples were checked against the reference");
}
