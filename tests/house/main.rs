//! House rules of `src/ARCHITECTURE.md`, kept by machine.

mod circles;
mod layering;
mod page;
mod places;

use std::fs;
use std::path::Path;

/// Folders of sources.
const FOLDERS: [&str; 9] = [
    "src",
    "shaders",
    "crates/core/src",
    "crates/arrow/src",
    "crates/stores/src",
    "crates/bench/src",
    "crates/view/src",
    "crates/cli/src",
    "python/src",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a package within the repository")
}

/// Every Rust and WGSL file, from the root, sorted.
fn all_sources() -> Vec<String> {
    let mut files = Vec::new();
    FOLDERS.iter().for_each(|folder| sources(Path::new(folder), &mut files));
    files.sort();
    files
}

fn sources(folder: &Path, found: &mut Vec<String>) {
    let root = root();
    for entry in fs::read_dir(root.join(folder)).expect("a folder").flatten() {
        let path = folder.join(entry.file_name());
        if entry.path().is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs" || extension == "wgsl") {
            found.push(path.to_string_lossy().replace('\\', "/"));
        }
    }
}
