//! Faults that the program meets from outside: signals, limits, names that are taken, directories that are damaged.

use crate::common::texts::SWEEP;
use crate::sandbox::Sandbox;
use std::fs;

const RUN: [&str; 7] = ["run", "sweep.toml", "--out", "out", "--quiet", "--no-figures", "--backend"];

fn run(more: &[&'static str]) -> Vec<&'static str> {
    [&RUN[..], &["cpu"], more].concat()
}

/// `solve` does not touch a picture that is there, nor what a link of its name leads to.
#[test]
fn pictures_are_not_overwritten_unasked() {
    let sandbox = Sandbox::new();
    let solve = ["solve", "scene.toml", "--plot", "rod.svg"];
    sandbox.ok(&solve);
    fs::write(sandbox.path("rod.svg"), "mine").unwrap();
    let refused = sandbox.run(&solve);
    assert_eq!((refused.code, refused.stdout.as_str()), (2, ""), "{}", refused.stderr);
    assert!(refused.errors()[0].contains("rod.svg") && refused.errors()[0].contains("`--force`"), "{}", refused.stderr);
    assert_eq!(fs::read(sandbox.path("rod.svg")).unwrap(), b"mine");
    sandbox.ok(&[&solve[..], &["--force"]].concat());
    assert!(fs::read(sandbox.path("rod.svg")).unwrap().starts_with(b"<"));
}

#[cfg(unix)]
#[test]
fn figures_replace_links_and_do_not_follow_them() {
    let sandbox = Sandbox::new();
    sandbox.ok(&["run", "sweep.toml", "--out", "out", "--backend", "cpu", "--quiet"]);
    fs::write(sandbox.path("outside"), "mine").unwrap();
    fs::remove_file(sandbox.path("out/tips.png")).unwrap();
    std::os::unix::fs::symlink(sandbox.path("outside"), sandbox.path("out/tips.png")).unwrap();
    sandbox.ok(&["figures", "out"]);
    assert_eq!(fs::read(sandbox.path("outside")).unwrap(), b"mine");
    assert!(fs::symlink_metadata(sandbox.path("out/tips.png")).unwrap().is_file());
}

#[test]
fn a_shape_of_too_many_points_is_refused() {
    let refused = Sandbox::new().run(&["solve", "scene.toml", "--shape", "9223372036854775807"]);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    assert!(refused.stderr.contains("at most 1,000,000 points"), "{}", refused.stderr);
}

#[test]
fn status_fails_where_a_part_is_damaged() {
    let sandbox = Sandbox::new();
    sandbox.ok(&run(&[]));
    let part = sandbox.path("out/part-0000000000.parquet");
    let whole = fs::read(&part).unwrap();
    fs::write(&part, &whole[..whole.len() / 2]).unwrap();
    let status = sandbox.run(&["status", "out"]);
    assert_eq!(status.code, 1, "{}", status.stdout);
    assert!(status.stdout.contains("damaged: out/part-0000000000.parquet"), "{}", status.stdout);
    sandbox.ok(&run(&["--resume"]));
    sandbox.ok(&["status", "out"]);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    /// Ends a run by a signal once it has written its first part; its exit code and what it said.
    fn ended_by(sandbox: &Sandbox, signal: &str, start: impl FnOnce(&mut Command) -> Child) -> (Option<i32>, String) {
        sandbox.write("sweep.toml", &SWEEP.replace("points = 5", "points = 2000000"));
        let _ = fs::remove_dir_all(sandbox.path("out"));
        let mut child = start(sandbox.command(&run(&[])).stdout(Stdio::null()).stderr(Stdio::piped()));
        let begin = Instant::now();
        while !sandbox.path("out/part-0000000000.parquet").exists() {
            assert!(begin.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none(), "no part");
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    }

    #[test]
    fn every_signal_that_ends_a_program_keeps_what_is_finished() {
        let sandbox = Sandbox::new();
        for signal in ["-TERM", "-HUP"] {
            let (code, said) = ended_by(&sandbox, signal, |command| command.spawn().unwrap());
            assert_eq!(code, Some(130), "{signal}: {said}");
            assert!(said.contains("interrupted; go on with") && said.contains("--resume"), "{said}");
            let manifest = fs::read_to_string(sandbox.path("out/manifest.json")).unwrap();
            assert!(manifest.contains("\"complete\": false"), "{manifest}");
            assert_eq!(hidden(&sandbox), Vec::<String>::new());
        }
    }

    /// A file that may not grow: an error and nothing half written, no death by SIGXFSZ.
    #[test]
    fn limits_of_files_are_errors() {
        let sandbox = Sandbox::new();
        let program = env!("CARGO_BIN_EXE_rodsweep");
        sandbox.write("sweep.toml", &SWEEP.replace("points = 5", "points = 5000"));
        let arguments = run(&[]).join(" ");
        let limited = format!("ulimit -f 16; exec {program} {arguments}");
        let mut command = Command::new("sh");
        let output = command.args(["-c", &limited]).current_dir(sandbox.path("")).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("part-0000000000.parquet: writing: File too large"), "{said}");
        assert_eq!(hidden(&sandbox), Vec::<String>::new());
        sandbox.ok(&run(&["--resume"]));
    }

    /// Temporary files that are left.
    fn hidden(sandbox: &Sandbox) -> Vec<String> {
        let names = fs::read_dir(sandbox.path("out")).unwrap().map(|entry| entry.unwrap().file_name());
        names.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.starts_with('.')).collect()
    }

    /// `nohup` means that a terminal which closes ends nothing.
    #[test]
    fn a_run_under_nohup_survives_its_terminal() {
        let sandbox = Sandbox::new();
        let program = env!("CARGO_BIN_EXE_rodsweep");
        let arguments = run(&[]).join(" ");
        let ignored = format!("trap '' HUP; exec {program} {arguments}");
        let (code, said) = ended_by(&sandbox, "-HUP", |command| {
            let mut shell = Command::new("sh");
            shell.args(["-c", &ignored]).current_dir(command.get_current_dir().unwrap());
            shell.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
        });
        assert_eq!(code, Some(0), "{said}");
    }

    /// A system that gives too few threads: here each wants a stack, and there is no memory for so many.
    #[test]
    fn threads_that_cannot_be_started_are_an_error() {
        let sandbox = Sandbox::new();
        let program = env!("CARGO_BIN_EXE_rodsweep");
        for arguments in [run(&[]).join(" "), "solve scene.toml".into()] {
            let limited = |kilobytes: usize| {
                let line = format!("ulimit -v {kilobytes}; RAYON_NUM_THREADS=20000 exec {program} {arguments}");
                Command::new("sh").args(["-c", &line]).current_dir(sandbox.path("")).output().unwrap()
            };
            // Memory may end while a thread that has begun maps its signal stack. There Rust's own library aborts.
            let aborts =
                |said: &[u8]| String::from_utf8_lossy(said).contains("failed to allocate an alternative stack");
            let mut outputs = (0..8).map(|at| limited(1_500_000 + 700 * at)).filter(|output| !aborts(&output.stderr));
            let output = outputs.next().expect("one of eight limits ends at a thread's own stack");
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{arguments}: {said}");
            let lines: Vec<&str> = said.lines().collect();
            assert!(lines.len() == 1 && lines[0].starts_with("error: cannot start threads: "), "{said}");
            assert!(lines[0].contains("RAYON_NUM_THREADS") && lines[0].contains("ulimit -u"), "{said}");
            assert!(!sandbox.path("out").exists());
        }
    }
}
