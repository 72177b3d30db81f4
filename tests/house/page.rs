//! The page: small sources, and a bundle with the licence of what it brings along.

use std::fs;

const PAGE: &str = "crates/view/page";
/// Lines of a file, as for Rust.
const FILE_LINES: usize = 400;

#[test]
fn its_sources_are_small() {
    let folder = super::root().join(PAGE).join("src");
    let files: Vec<_> = fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path()).collect();
    assert!(files.len() > 15, "only {} files found", files.len());
    for file in files {
        let lines = fs::read_to_string(&file).expect("a file").lines().count();
        assert!(lines <= FILE_LINES, "{}: {lines} lines, at most {FILE_LINES}: split it", file.display());
    }
}

#[test]
fn the_bundle_carries_its_licence() {
    let bundle = fs::read_to_string(super::root().join(PAGE).join("dist/page.js")).expect("page/build makes it");
    let head: String = bundle.chars().take(3000).collect();
    for words in
        ["three.js authors", "Permission is hereby granted, free of charge", "THE SOFTWARE IS PROVIDED \"AS IS\""]
    {
        assert!(head.contains(words), "`{words}` is missing");
    }
    // It must not end the script that holds it in an exported page.
    assert!(!bundle.contains("</script"));
}
