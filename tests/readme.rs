//! The README says what is true: its commands parse, its files exist, its numbers are filled in.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// Lines of the fenced blocks marked `sh` or `console`, without prompts.
fn commands(markdown: &str) -> Vec<String> {
    let (mut found, mut inside) = (Vec::new(), false);
    for line in markdown.lines() {
        match line.trim().strip_prefix("```") {
            Some(kind) => inside = !inside && matches!(kind, "sh" | "console"),
            None if inside => found.push(line.trim().trim_start_matches("$ ").to_owned()),
            None => {}
        }
    }
    found
}

/// Arguments of a line that calls the program.
fn arguments(command: &str) -> Option<Vec<&str>> {
    let rest = ["cargo run --release -- ", "rodsweep "].iter().find_map(|start| command.strip_prefix(start))?;
    Some(rest.split_whitespace().map(|word| word.trim_matches(['"', '\''])).collect())
}

/// What a test adds so that the command is parsed but solves nothing.
fn harmless(arguments: &[&str]) -> Option<&'static str> {
    match arguments.first() {
        Some(&"run") if arguments.contains(&"--dry-run") => None,
        Some(&"run") => Some("--dry-run"),
        _ => Some("--help"),
    }
}

/// Files of the repository that a text names: links, and words in backticks or commands that look like one of ours.
fn named_files(markdown: &str) -> Vec<String> {
    let links = markdown.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    let links = links.filter(|target| !target.contains("://") && !target.starts_with('#'));
    let ours = ["src/", "sweeps/", "shaders/", "tests/", "benches/", ".ci/", "LICENSE"];
    let is_word = |c: char| c.is_alphanumeric() || matches!(c, '/' | '.' | '_' | '-' | '*');
    let words = markdown.split(|c| !is_word(c)).filter(|word| ours.iter().any(|start| word.starts_with(start)));
    let words = words.map(|word| word.trim_end_matches('.')).filter(|word| !word.contains('*'));
    let mut files: Vec<String> = links.chain(words).map(str::to_owned).collect();
    files.sort();
    files.dedup();
    files
}

fn missing_files(markdown: &str, root: &Path) -> Vec<String> {
    named_files(markdown).into_iter().filter(|file| !root.join(file).exists()).collect()
}

#[test]
fn every_command_is_understood() {
    let readme = read("README.md");
    let commands = commands(&readme);
    let calls: Vec<Vec<&str>> = commands.iter().filter_map(|command| arguments(command)).collect();
    assert!(calls.len() >= 5, "only {} commands found", calls.len());
    let out = tempfile::tempdir().expect("a folder");
    for call in calls {
        let mut program = Command::new(env!("CARGO_BIN_EXE_rodsweep"));
        program.current_dir(root()).args(&call).args(harmless(&call));
        if call[0] == "run" && !call.contains(&"--out") {
            // Results that happen to lie here are none of this test's business.
            program.arg("--out").arg(out.path().join("results"));
        }
        let output = program.output().expect("the program");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "`rodsweep {}`: {}\n{text}", call.join(" "), output.status);
    }
    assert_eq!(fs::read_dir(out.path()).expect("a folder").count(), 0, "a dry run wrote something");
}

#[test]
fn the_two_commands_are_those_of_ci() {
    let commands = commands(&read("README.md"));
    let starting = |start: &str| -> Vec<&String> { commands.iter().filter(|c| c.starts_with(start)).collect() };
    let [test] = starting("cargo test")[..] else { panic!("the README gives one test command") };
    assert_eq!(commands[0], "cargo run --release -- run sweeps/workspace.toml");
    assert_eq!(commands[1], *test);
    let ci = read(".ci/run");
    let tests: Vec<&str> = ci.lines().filter(|line| line.contains("cargo test")).collect();
    assert_eq!(tests, [format!("RODSWEEP_GPU=require {test}")]);
    assert!(ci.lines().any(|line| line.starts_with(&format!("{} --limit", commands[0]))), "CI runs the first command");
}

#[test]
fn every_file_named_exists() {
    for document in ["README.md", "src/ARCHITECTURE.md"] {
        let missing = missing_files(&read(document), &root());
        assert!(missing.is_empty(), "{document} names files that do not exist: {missing:?}");
    }
}

#[test]
fn no_number_is_left_open() {
    let readme = read("README.md");
    let open: Vec<&str> = readme.lines().filter(|line| line.contains(['⟨', '⟩'])).collect();
    assert!(open.is_empty(), "measure and fill in:\n{}", open.join("\n"));
}

#[test]
fn these_checks_can_fail() {
    let text = "See [a](src/none.rs), `sweeps/none.toml`. `src/lib.rs`.\n```sh\n$ rodsweep run a.toml\nls\n```\n";
    assert_eq!(missing_files(text, &root()), ["src/none.rs", "sweeps/none.toml"]);
    let commands = commands(text);
    assert_eq!(commands, ["rodsweep run a.toml", "ls"]);
    assert_eq!(arguments(&commands[0]).expect("a call"), ["run", "a.toml"]);
    assert_eq!(arguments(&commands[1]), None);
}
