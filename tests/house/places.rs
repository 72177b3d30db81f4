//! Where formulas stand: files and names in the table of `src/EQUATIONS.md`, and the twin that each shader names.

use crate::{all_sources, root};
use std::fs;

const REFERENCE: [&str; 1] = ["src/reference/"];
const ENGINE: [&str; 2] = ["crates/core/src/cpu/", "crates/core/src/"];

/// Words between backticks.
fn quoted(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// Whether a source defines a function or a type of this name.
fn defines(text: &str, name: &str) -> bool {
    ["fn", "struct", "enum", "trait"].iter().any(|kind| {
        text.split(&format!("{kind} {name}"))
            .skip(1)
            .any(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    })
}

/// Text of a file below the first of these folders that has it.
fn text_of(folders: &[&str], file: &str) -> Option<String> {
    folders.iter().find_map(|folder| fs::read_to_string(root().join(folder).join(file)).ok())
}

/// Files of a cell that are missing, and names that their files lack. A name without a file belongs to the file before it.
fn lost(cell: &str, folders: &[&str]) -> Vec<String> {
    let mut text = String::new();
    let mut lost = Vec::new();
    for word in quoted(cell) {
        let mut name = Some(word);
        if word.contains(".rs") {
            let (file, function) = word.split_once(':').map_or((word, None), |(file, name)| (file, Some(name)));
            name = function;
            match text_of(folders, file) {
                Some(found) => text = found,
                None => lost.push(file.to_owned()),
            }
        }
        lost.extend(name.filter(|name| !defines(&text, name)).map(|_| word.to_owned()));
    }
    lost
}

/// Rows of the table: tag, cell of the reference, cell of the engine.
fn rows(equations: &str) -> Vec<[&str; 3]> {
    let (_, after) = equations.split_once("## Where each lives").expect("the table");
    let table = after.split("\n## ").next().unwrap_or(after);
    let cells = table.lines().filter(|line| line.starts_with("| ")).map(|line| line.split('|').collect::<Vec<_>>());
    cells.skip(1).map(|cells| [cells[1], cells[2], cells[3]]).collect()
}

#[test]
fn every_name_in_the_table_of_equations_exists() {
    let equations = fs::read_to_string(root().join("src/EQUATIONS.md")).expect("the equations");
    let rows = rows(&equations);
    assert!(rows.len() > 30, "{}", rows.len());
    let lost_in = |[tag, reference, engine]: &[&str; 3]| -> Vec<String> {
        let found = lost(reference, &REFERENCE).into_iter().chain(lost(engine, &ENGINE));
        found.map(|name| format!("{}: {name}", tag.trim())).collect()
    };
    let found: Vec<String> = rows.iter().flat_map(lost_in).collect();
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn a_lost_name_is_noticed() {
    assert_eq!(lost("`rod/step.rs:step_rod`, `step`", &ENGINE), ["step"]);
    assert_eq!(lost("`rod/steps.rs`; `rod/step.rs:step_rods`", &ENGINE), ["rod/steps.rs", "rod/step.rs:step_rods"]);
    assert!(lost("`flexible.rs:slope`; none", &REFERENCE).is_empty());
}

/// The first three lines of a shader name the Rust file that it is the twin of.
#[test]
fn every_twin_that_a_shader_names_exists() {
    let mut count = 0;
    for shader in all_sources().iter().filter(|file| file.ends_with(".wgsl")) {
        let text = fs::read_to_string(root().join(shader)).expect("a shader");
        let head = text.lines().take(3).flat_map(str::split_whitespace);
        for file in head.filter(|word| word.contains('/') && word.ends_with(".rs")) {
            assert!(root().join(file).is_file(), "{shader} names {file}");
            count += 1;
        }
    }
    assert!(count > 35, "{count}");
}
