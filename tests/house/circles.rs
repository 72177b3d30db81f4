//! No circle of files: what a file imports does not lead back to it.
//!
//! A folder's `mod.rs` and a crate's root only show what lies below them, so they do not count; what they show is traced
//! to the file that has it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// Folders of one crate each, and the name by which the crate's own files may call it.
const CRATES: [&str; 5] = ["src", "crates/core/src", "crates/bench/src", "crates/cli/src", "python/src"];

/// A folder whose private files may refer to each other: the scene and its parameters say the same thing from two sides.
const ONE_DETAIL: [&str; 1] = ["crates/core/src/model/"];

type Module = Vec<String>;

/// The modules of a crate, and what they import of it.
#[derive(Default)]
struct Imports {
    /// File and code of each module.
    modules: BTreeMap<Module, (String, String)>,
    /// Where a name that a module shows has its home.
    shown: BTreeMap<Module, Module>,
}

impl Imports {
    fn new(files: Vec<(String, String)>, folder: &str) -> Imports {
        let mut imports = Imports::default();
        for (file, text) in files {
            let inner = file.strip_prefix(folder).unwrap_or(&file).trim_matches('/').trim_end_matches(".rs").to_owned();
            let mut module: Module = inner.split('/').map(str::to_owned).collect();
            if is_root(&file) {
                module.pop();
            }
            imports.modules.insert(module, (file, code(&text)));
        }
        let of_roots: Vec<(Module, Vec<Module>)> =
            imports.modules.iter().map(|(m, (_, code))| (m.clone(), uses(code))).collect();
        for (module, paths) in of_roots {
            for path in paths {
                let path: Module = path.into_iter().filter(|word| word != "self").collect();
                if let [home, .., name] = &path[..] {
                    let mut home_path = module.clone();
                    home_path.push(home.clone());
                    if imports.modules.contains_key(&home_path) {
                        let mut shown = module.clone();
                        shown.push(name.clone());
                        imports.shown.insert(shown, home_path);
                    }
                }
            }
        }
        imports
    }

    /// The module that a path from the crate's root leads to.
    fn home(&self, path: &[String]) -> Option<Module> {
        for length in (1..=path.len()).rev() {
            let start = &path[..length];
            if let Some(home) = self.shown.get(start) {
                let rest = &path[length..];
                let further: Module = home.iter().chain(start.last()).chain(rest).cloned().collect();
                return if self.shown.contains_key(&further[..home.len() + 1]) {
                    self.home(&further)
                } else {
                    Some(home.clone())
                };
            }
            if self.modules.contains_key(start) {
                return Some(start.to_vec());
            }
        }
        None
    }

    /// Which modules each module imports from; roots of folders left out.
    fn graph(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let is_leaf = |module: &Module| self.modules.get(module).is_some_and(|(file, _)| !is_root(file));
        let mut graph = BTreeMap::new();
        for (module, (_, code)) in self.modules.iter().filter(|(module, _)| is_leaf(module)) {
            let mut to = BTreeSet::new();
            for path in uses(code).into_iter().chain(paths(code)) {
                let above = path.iter().take_while(|word| *word == "super").count();
                let path: Module = match path.first().map(String::as_str) {
                    Some("crate") => path[1..].to_vec(),
                    Some("super") => {
                        let kept = module.len().saturating_sub(above);
                        module[..kept].iter().chain(&path[above..]).cloned().collect()
                    }
                    _ => continue,
                };
                let path: Module = path.into_iter().filter(|word| word != "self").collect();
                to.extend(self.home(&path).filter(|home| home != module && is_leaf(home)));
            }
            graph.insert(module.clone(), to);
        }
        graph
    }

    /// Files that lead back to themselves.
    fn circles(&self) -> Vec<String> {
        let graph = self.graph();
        let reach = |from: &Module| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
            while let Some(module) = open.pop() {
                for next in graph.get(&module).into_iter().flatten() {
                    if seen.insert(next.clone()) {
                        open.push(next.clone());
                    }
                }
            }
            seen
        };
        let in_circle: Vec<&Module> = graph.keys().filter(|module| reach(module).contains(*module)).collect();
        in_circle.iter().map(|module| self.modules[*module].0.clone()).collect()
    }
}

fn is_root(file: &str) -> bool {
    ["mod.rs", "lib.rs", "main.rs"].iter().any(|name| file == *name || file.ends_with(&format!("/{name}")))
}

/// Without comments, strings and the tests inside a file.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    let text = lines.collect::<Vec<_>>().join("\n");
    text.split('"').step_by(2).collect::<Vec<_>>().join("\"\"")
}

fn words(path: &str) -> Module {
    path.split("::").map(|word| word.split_whitespace().next().unwrap_or_default().to_owned()).collect()
}

/// Paths that `use` names, groups taken apart.
fn uses(code: &str) -> Vec<Module> {
    let mut found = Vec::new();
    for rest in code.split("use ").skip(1) {
        let tree = rest.split(';').next().unwrap_or_default();
        expand(&[], tree, &mut found);
    }
    found
}

fn expand(before: &[String], tree: &str, found: &mut Vec<Module>) {
    let tree = tree.trim();
    let Some((head, group)) = tree.split_once('{') else {
        found.push(before.iter().cloned().chain(words(tree)).filter(|word| !word.is_empty()).collect());
        return;
    };
    let before: Module = before.iter().cloned().chain(words(head)).filter(|word| !word.is_empty()).collect();
    let group = group.rsplit_once('}').map_or(group, |(inside, _)| inside);
    let (mut depth, mut start) = (0, 0);
    for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let part = &group[start.min(at)..at];
                if !part.trim().is_empty() {
                    expand(&before, part, found);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// Paths in the code that start at the crate or above the module.
fn paths(code: &str) -> Vec<Module> {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let all = code.split(|c| !is_path(c));
    all.filter(|path| path.starts_with("crate::") || path.starts_with("super::")).map(words).collect()
}

fn imports_of(folder: &str) -> Imports {
    let files = super::all_sources().into_iter().filter(|file| file.starts_with(&format!("{folder}/")));
    let files = files.filter(|file| file.ends_with(".rs"));
    let read = |file: String| (file.clone(), fs::read_to_string(super::root().join(file)).expect("a file"));
    Imports::new(files.map(read).collect(), folder)
}

#[test]
fn no_file_leads_back_to_itself() {
    for folder in CRATES {
        let imports = imports_of(folder);
        assert!(imports.modules.len() > 10, "{folder}: only {} files", imports.modules.len());
        let edges: usize = imports.graph().values().map(BTreeSet::len).sum();
        assert!(edges > imports.modules.len() / 2, "{folder}: only {edges} imports found");
        let mut circles = imports.circles();
        circles.retain(|file| !ONE_DETAIL.iter().any(|detail| file.starts_with(detail)));
        assert!(circles.is_empty(), "these files import each other in circles:\n{}", circles.join("\n"));
    }
}

#[test]
fn a_circle_is_found_by_whatever_path() {
    let file = |name: &str, text: &str| (format!("src/{name}"), text.to_owned());
    let files = |a: &str, b: &str| {
        vec![
            file("lib.rs", "pub mod room;"),
            file("room/mod.rs", "mod a;\nmod b;\npub use a::{A, other::B as C};\npub use b::Thing;"),
            file("room/a.rs", a),
            file("room/b.rs", b),
        ]
    };
    let circles = |a: &str, b: &str| Imports::new(files(a, b), "src").circles();
    assert_eq!(circles("use super::b::Thing;", "use super::a::A;"), ["src/room/a.rs", "src/room/b.rs"]);
    assert_eq!(circles("use crate::room::{\n    Thing,\n};", "fn f() { super::A::new() }").len(), 2);
    assert!(circles("use super::b::Thing;", "// use super::a::A;\nuse std::fmt;").is_empty());
    assert!(circles("use super::b::Thing;", "#[cfg(test)]\nmod tests { use super::super::a::A; }").is_empty());
}
