//! The README and the guide say what is true: their commands run, their examples are read, the files they name exist,
//! their numbers are filled in.

use crate::common::root;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// Samples of a sweep that a page runs whole.
const SAMPLES: &str = "16";
/// Where a path of ARCHITECTURE or of the guide may begin.
const BEGINNINGS: [&str; 7] =
    ["", "src", "src/reference", "crates/core/src", "crates/core/src/cpu", "crates/bench/src", "crates/cli/src"];
/// Words of a text that begin so are paths of the repository.
const OURS: [&str; 9] = ["src/", "crates/", "shaders/", "sweeps/", "tests/", "benches/", "docs/", ".ci/", "LICENSE"];

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The pages of the guide, such as `docs/solve.md`.
fn guide() -> Vec<String> {
    let entries =
        fs::read_dir(root().join("docs")).expect("the guide").map(|entry| entry.expect("an entry").file_name());
    let mut pages: Vec<String> = entries.map(|name| format!("docs/{}", name.to_string_lossy())).collect();
    pages.retain(|page| page.ends_with(".md"));
    pages.sort();
    assert!(pages.len() > 5, "{pages:?}");
    pages
}

/// The README and the guide: what users read.
fn pages() -> Vec<String> {
    std::iter::once("README.md".to_owned()).chain(guide()).collect()
}

/// Texts of the fenced blocks of one kind.
fn blocks(markdown: &str, kind: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut block: Option<(bool, String)> = None;
    for line in markdown.lines() {
        match (line.trim().strip_prefix("```"), &mut block) {
            (Some(_), Some((is_wanted, text))) => {
                if *is_wanted {
                    found.push(std::mem::take(text));
                }
                block = None;
            }
            (Some(fence), None) => block = Some((fence == kind, String::new())),
            (None, Some((_, text))) => {
                text.push_str(line);
                text.push('\n');
            }
            (None, None) => {}
        }
    }
    found
}

/// Lines of the blocks marked `sh`, without prompts.
fn commands(markdown: &str) -> Vec<String> {
    let text = blocks(markdown, "sh").concat();
    let lines = text.lines().map(|line| line.trim().trim_start_matches("$ ").to_owned());
    lines.filter(|line| !line.is_empty() && !line.starts_with('#')).collect()
}

/// Words of a line, as a shell takes them; quotes hold words together.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut quote) = (vec![String::new()], None);
    for c in line.chars() {
        match quote {
            Some(end) if c == end => quote = None,
            None if matches!(c, '"' | '\'') => quote = Some(c),
            None if c.is_whitespace() => words.push(String::new()),
            _ => words.last_mut().expect("a word").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Arguments of a line that calls the program.
fn arguments(command: &str) -> Option<Vec<String>> {
    let rest = ["cargo run --release -- ", "rodsweep "].iter().find_map(|start| command.strip_prefix(start))?;
    Some(words(rest))
}

/// What is added to a call so that it takes little time.
fn small(call: &[String]) -> Vec<&'static str> {
    let has = |word: &str| call.iter().any(|other| other == word);
    match call[0].as_str() {
        // Minutes, or nothing that a page could get wrong: understood is enough.
        "verify" | "bench" | "doctor" => vec!["--help"],
        "run" if has("--dry-run") || has("--limit") => vec![],
        "run" => vec!["--limit", SAMPLES],
        "workspace" if has("--robust") => vec!["--voxel", "12mm", "--no-figures"],
        "workspace" => vec!["--voxel", "8mm", "--no-figures"],
        "contact" if has("--robust") => vec!["--voxel", "8mm", "--designs", "4", "--no-figures"],
        "contact" => vec!["--voxel", "8mm", "--no-figures"],
        // Else it would wait for windows.
        "view" if !has("--export") => vec!["--help"],
        "sensitivity" => vec!["--limit", "256", "--no-figures"],
        "control" if has("--experiment") => vec!["--no-figures", "--catheters", "1"],
        "control" => vec!["--no-figures"],
        _ => vec![],
    }
}

/// A folder with the shipped sweeps and scenes, and the files that the guide takes for granted.
struct Desk {
    folder: TempDir,
}

impl Desk {
    fn new() -> Desk {
        let desk = Desk { folder: tempfile::tempdir().expect("a folder") };
        copy_folder(&root().join("sweeps"), &desk.path("sweeps"));
        for (from, to) in [
            ("set_1.txt", "CatheterParameterSet_1.txt"),
            ("spatial.txt", "CatheterSpatialConfiguration_1.txt"),
            ("circle.play", "circle_01_new.play"),
            ("calibration.yaml", "OctoMag_Calibration.yaml"),
        ] {
            fs::copy(root().join("tests/data/import").join(from), desk.path(to)).expect("a copy");
        }
        let markers = "s,x,y,z\n25 mm,-0.07 mm,-0.21 mm,25 mm\n50 mm,-0.27 mm,-0.86 mm,49.99 mm\n\
                       75 mm,-0.58 mm,-1.86 mm,74.97 mm\n,-0.8 mm,-2.65 mm,94.25 mm\n";
        desk.write("markers.csv", markers);
        desk.write("tips.csv", "x,y,z\n0,-5 mm,94 mm\n1 mm,-5 mm,94 mm\n");
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("a file");
    }

    fn run(&self, call: &[String]) -> Output {
        let mut program = Command::new(env!("CARGO_BIN_EXE_rodsweep"));
        program.current_dir(self.folder.path()).env("RODSWEEP_CACHE", self.path("cache"));
        program.args(call).args(small(call)).output().expect("the program")
    }

    /// Runs a call that a page shows.
    fn try_call(&self, page: &str, call: &[String]) {
        let output = self.run(call);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{page}: `rodsweep {}`: {}\n{text}", call.join(" "), output.status);
    }
}

/// Copies a folder with all that is in it; reports are left out.
fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder").map(|entry| entry.expect("an entry")) {
        let target = to.join(entry.file_name());
        match entry.path().is_dir() {
            true if entry.file_name() == "reports" => {}
            true => copy_folder(&entry.path(), &target),
            false => drop(fs::copy(entry.path(), target).expect("a copy")),
        }
    }
}

/// The name under which a page tells to save a block: its first line, such as `# rod.toml`.
fn saved_as(text: &str) -> Option<&str> {
    let name = text.lines().next()?.strip_prefix("# ")?;
    (name.ends_with(".toml") && !name.contains(' ')).then_some(name)
}

fn strings(call: &[&str]) -> Vec<String> {
    call.iter().map(|&word| word.to_owned()).collect()
}

/// Files of the repository that a text names: targets of links, and words that look like one of ours.
fn named_files(markdown: &str) -> (Vec<String>, Vec<String>) {
    let links = markdown.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    let links = links.filter(|target| !target.contains("://")).map(|target| target.split('#').next().unwrap_or(""));
    let is_word = |c: char| c.is_alphanumeric() || matches!(c, '/' | '.' | '_' | '-' | '*');
    let is_source = |word: &str| word.contains('/') && (word.ends_with(".rs") || word.ends_with(".wgsl"));
    let words = markdown.split(|c| !is_word(c)).map(|word| word.trim_end_matches('.'));
    let words = words.filter(|word| OURS.iter().any(|start| word.starts_with(start)) || is_source(word));
    let words = words.filter(|word| !word.contains('*') && !word.starts_with(['.', '/']) || word.starts_with(".ci/"));
    let sorted = |mut files: Vec<String>| {
        files.sort();
        files.dedup();
        files
    };
    let links = links.filter(|target| !target.is_empty()).map(str::to_owned).collect();
    (sorted(links), sorted(words.map(str::to_owned).collect()))
}

/// What a document names and the repository lacks. Links start from the document's folder.
fn missing_files(document: &str, markdown: &str, root: &Path) -> Vec<String> {
    let folder = root.join(document).parent().expect("a folder").to_path_buf();
    let (links, words) = named_files(markdown);
    let is_there = |word: &str| BEGINNINGS.iter().any(|beginning| root.join(beginning).join(word).exists());
    let lost_links = links.into_iter().filter(|link| !folder.join(link).exists());
    lost_links.chain(words.into_iter().filter(|word| !is_there(word))).collect()
}

/// Two pages at a time.
#[test]
fn every_command_runs() {
    let pages = pages();
    let some = |first: usize| pages.iter().skip(first).step_by(2).map(|page| try_page(page)).sum::<usize>();
    let count = std::thread::scope(|scope| {
        let others = scope.spawn(|| some(1));
        some(0) + others.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    assert!(count >= 30, "only {count} commands found");
}

/// Runs the commands of a page, which follow one another, and returns their number. Files that the page tells to save
/// are there.
fn try_page(page: &str) -> usize {
    let markdown = read(page);
    let commands = commands(&markdown);
    let desk = Desk::new();
    for text in blocks(&markdown, "toml") {
        if let Some(name) = saved_as(&text) {
            desk.write(name, &text);
        }
    }
    if commands.iter().any(|command| command.contains("--replay")) {
        desk.write("circle_01_new.csv", "coil.current.x,coil.current.y,coil.current.z\n0,0,0\n0.1,0,0\n0,0,0.1\n");
        desk.write("observed.csv", "point,x,y,z\n0,-1 mm,-3 mm,94 mm\n1,1 mm,-2 mm,94 mm\n2,-5 mm,20 mm,90 mm\n");
    }
    for command in &commands {
        match arguments(command) {
            Some(call) => desk.try_call(page, &call),
            None => assert!(
                ["cargo test --release", "cargo install --path crates/cli"].contains(&command.as_str()),
                "{page}: `{command}` is tried by no test"
            ),
        }
    }
    commands.len()
}

/// P6 under a plane.
fn scene_with_wall() -> String {
    let golden: serde_json::Value =
        serde_json::from_str(&read("tests/data/wall/p6-end-on.json")).expect("a golden file");
    golden["scene"].as_str().expect("a scene").to_owned()
}

#[test]
fn every_example_file_is_read() {
    let desk = Desk::new();
    let mut count = 0;
    for page in pages() {
        for (index, text) in blocks(&read(&page), "toml").into_iter().enumerate() {
            if text.contains("[dependencies]") {
                continue;
            }
            // Paths in a sweep start from its folder.
            let file = match saved_as(&text) {
                Some(name) => format!("sweeps/{name}"),
                None => format!("sweeps/{}-{index}.toml", page.replace(['/', '.'], "-")),
            };
            desk.write(&file, &text);
            let call = match &text {
                text if text.contains("[sampling]") => strings(&["run", &file, "--dry-run"]),
                text if text.contains("normal_force =") => {
                    desk.write("wall.toml", &scene_with_wall());
                    strings(&["control", "wall.toml", &file, "--max-failures", "0"])
                }
                text if text.starts_with("shape =") => strings(&["control", "sweeps/scenes/p6.toml", &file]),
                text if text.contains("[[segment]]") => strings(&["solve", &file]),
                _ => panic!("{page}: what is this?\n{text}"),
            };
            desk.try_call(&page, &call);
            count += 1;
        }
    }
    assert!(count >= 4, "only {count} files found");
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
    let others = ["src/ARCHITECTURE.md", "CHANGELOG.md"].map(str::to_owned);
    for document in pages().into_iter().chain(others) {
        let missing = missing_files(&document, &read(&document), root());
        assert!(missing.is_empty(), "{document} names files that do not exist: {missing:?}");
    }
}

#[test]
fn the_guide_lists_every_page() {
    let index = read("docs/README.md");
    for page in guide().iter().filter_map(|page| page.strip_prefix("docs/")).filter(|page| *page != "README.md") {
        assert!(index.contains(&format!("]({page})")), "docs/README.md leaves out {page}");
    }
}

#[test]
fn no_number_is_left_open() {
    for page in pages() {
        let text = read(&page);
        let is_open = |line: &&str| ["⟨", "⟩", "BUILD_TIME", "TEST_TIME"].iter().any(|mark| line.contains(mark));
        let open: Vec<&str> = text.lines().filter(is_open).collect();
        assert!(open.is_empty(), "{page}: measure and fill in:\n{}", open.join("\n"));
    }
}

#[test]
fn these_checks_can_fail() {
    let text = "See [a](src/none.rs#x), `sweeps/none.toml`, `sweep/none.rs`, `sweep/job.rs`. `src/lib.rs`.\n\
                ```sh\n$ rodsweep run a.toml --set insertion=\"90 mm\"\nls\n```\n```toml\na = 1\n```\n";
    let missing = missing_files("README.md", text, root());
    assert_eq!(missing, ["src/none.rs", "src/none.rs", "sweep/none.rs", "sweeps/none.toml"]);
    assert_eq!(missing_files("docs/a.md", "[a](../src/lib.rs) [b](lib.rs)", root()), ["lib.rs"]);
    let commands = commands(text);
    assert_eq!(commands[1], "ls");
    assert_eq!(arguments(&commands[0]).expect("a call"), ["run", "a.toml", "--set", "insertion=90 mm"]);
    assert_eq!(arguments(&commands[1]), None);
    assert_eq!(blocks(text, "toml"), ["a = 1\n"]);
    assert_eq!(saved_as("# rod.toml\na = 1\n"), Some("rod.toml"));
    assert_eq!(saved_as("# A rod.\n").or(saved_as("a = 1\n")), None);
    let output = Desk::new().run(&strings(&["run", "sweeps/none.toml"]));
    assert_eq!(output.status.code(), Some(2));
}
