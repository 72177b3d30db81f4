//! House rules of `src/ARCHITECTURE.md`, kept by machine: layers, owners of crates, sizes of files.

use std::fs;

/// What each room may name, besides itself; from the bottom up, so that nothing names what stands above it.
///
/// The engines `reference`, `cpu` and `gpu` are blind to each other: a shared mistake would cancel itself.
const ROOMS: [(&str, &[&str]); 24] = [
    ("clock", &[]),
    ("model", &["clock"]),
    ("backend", &["model"]),
    ("cpu", &["clock", "model", "backend"]),
    ("reference", &["clock", "model", "backend"]),
    ("gpu", &["clock", "model", "backend"]),
    ("shipped", &[]),
    ("files", &[]),
    ("text", &[]),
    ("draw", &["model", "files", "text"]),
    ("table", &["clock", "model", "files", "text"]),
    ("spec", &["model", "backend"]),
    ("input", &["model", "files", "table", "spec"]),
    ("engines", &["model", "backend", "reference", "cpu", "gpu"]),
    ("results", &["clock", "model", "backend", "files", "text", "table", "spec", "input"]),
    ("sweep", &["clock", "model", "backend", "reference", "table", "spec", "input", "engines", "results"]),
    (
        "study",
        &[
            "model",
            "backend",
            "reference",
            "cpu",
            "files",
            "draw",
            "table",
            "spec",
            "input",
            "engines",
            "results",
            "sweep",
        ],
    ),
    ("figures", &["model", "reference", "draw", "table", "spec", "results", "study"]),
    ("arrow", &["model", "table"]),
    ("stores", &["results"]),
    ("bench", &["*"]),
    (
        "view",
        &[
            "model",
            "reference",
            "files",
            "text",
            "draw",
            "table",
            "spec",
            "input",
            "engines",
            "results",
            "study",
            "figures",
        ],
    ),
    ("cli", &["*"]),
    ("python", &["*"]),
];
/// Crates that belong to one part of the source.
const OWNERS: [(&str, &[&str]); 30] = [
    ("wgpu", &["src/gpu/"]),
    ("naga", &["src/gpu/"]),
    ("pollster", &["src/gpu/"]),
    ("pulp", &["crates/core/src/cpu/", "crates/bench/src/measure/peak.rs"]),
    ("nix", &["crates/core/src/clock.rs"]),
    (
        "nalgebra",
        &[
            "src/reference/",
            "src/study/",
            "crates/bench/src/baseline/",
            "crates/bench/src/judge/",
            "crates/bench/src/random/",
            "crates/core/src/cpu/multiple_shooting/tests/",
        ],
    ),
    ("ode_solvers", &["crates/bench/src/baseline/adaptive.rs"]),
    ("levenberg_marquardt", &["src/study/fit/"]),
    ("parquet", &["src/table/"]),
    ("bytes", &["src/table/"]),
    ("zstd", &["src/table/"]),
    ("arrow_array", &["crates/arrow/src/", "python/src/"]),
    ("object_store", &["crates/stores/src/"]),
    ("tokio", &["crates/stores/src/", "crates/view/src/server/"]),
    ("flatbuffers", &["src/table/"]),
    ("foldhash", &["src/results/reduce.rs"]),
    ("flate2", &["src/table/", "crates/view/src/export/"]),
    ("hyper", &["crates/view/src/server/"]),
    ("getrandom", &["crates/view/src/server/", "crates/view/src/error.rs"]),
    ("zip", &["src/table/"]),
    ("toml_edit", &["src/input/"]),
    ("tiny_skia", &["src/draw/"]),
    ("ab_glyph", &["src/draw/"]),
    ("clap", &["crates/cli/src/"]),
    ("clap_complete", &["crates/cli/src/"]),
    ("indicatif", &["crates/cli/src/"]),
    ("ctrlc", &["crates/cli/src/signals.rs"]),
    ("libc", &["crates/cli/src/signals.rs"]),
    ("pyo3", &["python/src/"]),
    ("numpy", &["python/src/"]),
];
/// Lines of a file, and of a kernel: every shader, and the files of `cpu` that have a twin among them.
const FILE_LINES: usize = 1000;
const KERNEL_LINES: usize = 1000;
const CPU: &str = "crates/core/src/cpu/";
const NO_KERNELS: [&str; 3] = ["mod.rs", "simd/lane.rs", "rod/program.rs"];

/// Everything that breaks a rule in one file, as `file:line: rule`.
fn violations(file: &str, text: &str) -> Vec<String> {
    let mut found = size_violation(file, text);
    if file.ends_with(".rs") {
        let code = without_comments_and_strings(text);
        found.extend(layer_violations(file, &code));
        found.extend(owner_violations(file, &code));
    }
    found
}

fn size_violation(file: &str, text: &str) -> Vec<String> {
    let is_kernel = file.ends_with(".wgsl") || file.strip_prefix(CPU).is_some_and(|name| !NO_KERNELS.contains(&name));
    let limit = if is_kernel { KERNEL_LINES } else { FILE_LINES };
    let lines = text.lines().count();
    if lines > limit { vec![format!("{file}:{limit}: {lines} lines, at most {limit}: split it")] } else { Vec::new() }
}

fn layer_violations(file: &str, code: &str) -> Vec<String> {
    let path = module_path(file);
    let Some((own, allowed)) = path.first().and_then(|own| room(own)) else { return Vec::new() };
    let mut found = Vec::new();
    for (at, name) in named_modules(code, &path) {
        let is_allowed = name == own || allowed == ["*"] || allowed.contains(&name.as_str());
        if room(&name).is_some() && !is_allowed {
            found.push(format!("{file}:{}: `{own}` may not name `{name}` (layers point down)", line(code, at)));
        }
    }
    found
}

fn owner_violations(file: &str, code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (name, owners) in OWNERS.iter().filter(|(_, owners)| !owners.iter().any(|owner| file.starts_with(owner))) {
        for (at, _) in words(code).filter(|(_, word)| word == name) {
            let (before, after) = (code[..at].trim_end(), code[at + name.len()..].trim_start());
            let is_path =
                after.starts_with("::") && (!before.ends_with("::") || before.trim_end_matches(':').is_empty());
            let is_import = ["use", "crate", "use ::"].iter().any(|word| before.ends_with(word)) && !is_path;
            if is_path || is_import {
                let owners = owners.join(", ");
                found.push(format!("{file}:{}: only {owners} may name the crate `{name}`", line(code, at)));
            }
        }
    }
    found
}

fn room(module: &str) -> Option<(&'static str, &'static [&'static str])> {
    ROOMS.iter().find(|(name, _)| *name == module).map(|(name, allowed)| (*name, *allowed))
}

/// `src/results/read.rs` is `results::read`; what lies in `crates/bench`, `crates/cli` and `python` belongs to rooms of
/// that name.
fn module_path(file: &str) -> Vec<String> {
    let file = file.trim_end_matches(".rs");
    let other = file.strip_prefix("crates/").or(file.starts_with("python/").then_some(file));
    let (crate_room, inner) = match other.and_then(|rest| rest.split_once("/src/")) {
        Some(("core", inner)) => (None, inner),
        Some((name, inner)) => (Some(name), inner),
        None => (None, file.trim_start_matches("src/")),
    };
    let mut path: Vec<String> = crate_room.into_iter().chain(inner.split('/')).map(str::to_owned).collect();
    if path.last().is_some_and(|last| last == "mod") {
        path.pop();
    }
    path
}

/// Top-level modules that the code of module `path` names: by `crate::`, `rodsweep::` or enough `super::`.
fn named_modules(code: &str, path: &[String]) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (at, word) in words(code) {
        let after_root = match word {
            _ if code[..at].trim_end().ends_with("::") => continue,
            "crate" | "rodsweep" => &code[at + word.len()..],
            "super" => {
                let (mut rest, mut depth) = (&code[at + word.len()..], 1);
                while let Some(next) =
                    rest.trim_start().strip_prefix("::").and_then(|r| r.trim_start().strip_prefix("super"))
                {
                    (rest, depth) = (next, depth + 1);
                }
                if depth < path.len() {
                    continue;
                }
                rest
            }
            _ => continue,
        };
        let Some(tail) = after_root.trim_start().strip_prefix("::") else { continue };
        let start = code.len() - tail.len();
        let names = first_names(tail);
        found.extend(names.into_iter().map(|(offset, name)| (start + offset, name)));
    }
    found
}

/// The first name of a path, or of each path of `{a::b, c}`.
fn first_names(tail: &str) -> Vec<(usize, String)> {
    let grouped = tail.trim_start().starts_with('{');
    let (mut names, mut depth, mut expects) = (Vec::new(), 0, !grouped);
    let mut skip_to = 0;
    for (at, c) in tail.char_indices().filter(|(_, c)| !c.is_whitespace()) {
        match c {
            '{' => {
                depth += 1;
                expects = grouped && depth == 1;
            }
            '}' => depth -= 1,
            ',' => expects = grouped && depth == 1,
            _ if expects && at >= skip_to => {
                let name: String = tail[at..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                skip_to = at + name.len();
                names.push((at, name));
                expects = false;
            }
            _ => {}
        }
        if !grouped && !names.is_empty() || grouped && depth == 0 {
            break;
        }
    }
    names
}

/// Every word with its position.
fn words(code: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    code.split(move |c| !is_word(c)).filter(|word| !word.is_empty()).map(|word| (word.as_ptr() as usize, word)).map({
        let start = code.as_ptr() as usize;
        move |(at, word)| (at - start, word)
    })
}

fn line(code: &str, at: usize) -> usize {
    1 + code[..at].matches('\n').count()
}

/// Comments and the contents of strings as blanks; every line keeps its number.
fn without_comments_and_strings(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = bytes.to_vec();
    let mut blank = |from: usize, to: usize| {
        for byte in &mut out[from..to] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
    };
    let find = |from: usize, what: &str| text[from..].find(what).map_or(text.len(), |k| from + k + what.len());
    let mut at = 0;
    while at < bytes.len() {
        let starts = |what: &str| bytes[at..].starts_with(what.as_bytes());
        let end = if starts("//") {
            text[at..].find('\n').map_or(text.len(), |k| at + k)
        } else if starts("/*") {
            find(at, "*/")
        } else if starts("r#\"") {
            find(at + 3, "\"#")
        } else if starts("\"") {
            let mut end = at + 1;
            while end < bytes.len() && bytes[end] != b'"' {
                end += if bytes[end] == b'\\' { 2 } else { 1 };
            }
            (end + 1).min(bytes.len())
        } else if starts("'\"'") || starts("'\\") {
            find(at + 2, "'")
        } else {
            at += 1;
            continue;
        };
        blank(at, end);
        at = end;
    }
    String::from_utf8(out).expect("only whole characters were blanked")
}

#[test]
fn the_house_rules_hold() {
    let files = super::all_sources();
    assert!(files.len() > 200, "only {} files found", files.len());
    let read = |file: &String| fs::read_to_string(super::root().join(file)).expect("a file");
    let found: Vec<String> = files.iter().flat_map(|file| violations(file, &read(file))).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn every_room_is_known() {
    for file in super::all_sources() {
        let path = module_path(&file);
        let is_root = path.first().is_some_and(|first| ["lib", "main", "shaders"].contains(&first.as_str()));
        assert!(is_root || path.first().is_some_and(|own| room(own).is_some()), "{file} belongs to no room");
    }
    for (at, (own, allowed)) in ROOMS.iter().enumerate() {
        let below = &ROOMS[..at];
        let known = |name: &&str| *name == "*" || below.iter().any(|(other, _)| other == name);
        assert!(allowed.iter().all(known), "`{own}` names what stands above it");
    }
}

#[test]
fn an_import_that_points_up_is_found() {
    let check = |file: &str, text: &str| violations(file, text);
    let found = check("crates/core/src/model/rod.rs", "//! A rod.\n\nuse crate::cpu::Cpu;\n");
    assert_eq!(found, ["crates/core/src/model/rod.rs:3: `model` may not name `cpu` (layers point down)"]);
    let found = check(
        "src/results/read.rs",
        "use crate::model::Plan;\nuse crate::{\n    backend::Backend,\n    sweep::SweepJob,\n};",
    );
    assert_eq!(found, ["src/results/read.rs:4: `results` may not name `sweep` (layers point down)"]);
    // Engines are blind to each other, by whatever path.
    assert_eq!(check("crates/core/src/cpu/rod/step.rs", "fn f() { crate::reference::solve_rod() }").len(), 1);
    assert_eq!(check("src/reference/chain.rs", "use super::super::gpu::Gpu;").len(), 1);
    assert_eq!(check("src/gpu/mod.rs", "use crate::cpu::{self, Cpu};").len(), 1);
    assert_eq!(check("src/draw/axes.rs", "use crate::backend::Precision;").len(), 1);
    assert_eq!(check("src/study/fit.rs", "use crate::figures::RunFigures;").len(), 1);
    assert_eq!(check("src/spec/sweep.rs", "use crate::input::InputError;").len(), 1);
}

#[test]
fn imports_that_point_down_pass() {
    let check = |file: &str, text: &str| violations(file, text);
    let none: [String; 0] = [];
    let text = "use crate::{backend::Backend, model::{Batch, Plan}};";
    assert_eq!(check("crates/core/src/cpu/mod.rs", text), none);
    let text = "use super::rod::Rod; // not crate::gpu\nconst A: &str = \"crate::gpu\";";
    assert_eq!(check("crates/core/src/cpu/rod/step.rs", text), none);
    assert_eq!(check("src/results/read.rs", "use super::parts::PartInfo;\nuse crate::results::x;"), none);
    assert_eq!(check("crates/cli/src/run.rs", "use rodsweep::{gpu::Gpu, cpu::Cpu};"), none);
}

#[test]
fn a_crate_out_of_place_is_found() {
    let check = |file: &str, text: &str| violations(file, text);
    let found = check("src/sweep/run.rs", "\nuse parquet::file;\n");
    assert_eq!(found, ["src/sweep/run.rs:2: only src/table/ may name the crate `parquet`"]);
    assert_eq!(check("crates/core/src/cpu/rod/segments.rs", "fn f(x: nalgebra::Vector3<f64>) {}").len(), 1);
    assert_eq!(check("src/draw/mod.rs", "use ::wgpu::Device;").len(), 1);
    assert_eq!(check("src/reference/mod.rs", "use wgpu;").len(), 1);
    assert!(check("src/table/parquet/read.rs", "use parquet::file;").is_empty());
    assert!(check("src/gpu/shader/check.rs", "use wgpu::naga;").is_empty());
    assert!(check("src/input/number_table.rs", "use crate::table::parquet::read; let zip = 1;").is_empty());
}

#[test]
fn a_file_that_is_too_long_is_found() {
    let long = "\n".repeat(FILE_LINES + 1);
    assert_eq!(violations("src/sweep/run.rs", &long).len(), 1);
    assert_eq!(violations("crates/core/src/cpu/rod/step.rs", &long[..KERNEL_LINES + 1]).len(), 1);
    assert_eq!(violations("shaders/rod/step.wgsl", &long[..KERNEL_LINES + 1]).len(), 1);
    assert!(violations("crates/core/src/cpu/rod/step.rs", &long[..KERNEL_LINES]).is_empty());
}

/// Floors of the CPU engine, from the ground up: a folder names only those before it. `contact` stands beside `rod` and `equilibrium`, whose
/// passes watch the wall and whose boundary conditions it changes.
const FLOORS: [(&str, &[&str]); 6] = [
    ("simd", &[]),
    ("rod", &["simd", "contact"]),
    ("equilibrium", &["simd", "rod", "contact"]),
    ("multiple_shooting", &["simd", "rod", "equilibrium"]),
    ("contact", &["simd", "rod", "equilibrium"]),
    ("blocks", &["simd", "rod", "equilibrium", "multiple_shooting", "contact"]),
];

#[test]
fn floors_of_the_cpu_engine_point_down() {
    for (floor, below) in FLOORS {
        let folder = format!("{CPU}{floor}/");
        let files: Vec<String> = super::all_sources().into_iter().filter(|file| file.starts_with(&folder)).collect();
        assert!(!files.is_empty(), "{floor} has no file");
        for file in files.iter().filter(|file| !file.contains("/tests")) {
            let code = without_comments_and_strings(&fs::read_to_string(super::root().join(file)).expect("a file"));
            for path in code.split("crate::cpu::").skip(1) {
                let named = path.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default();
                let is_floor = FLOORS.iter().any(|(other, _)| *other == named);
                assert!(
                    !is_floor || named == floor || below.contains(&named),
                    "{file}: `{floor}` may not name `{named}`"
                );
            }
        }
    }
}
