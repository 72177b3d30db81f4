//! Compiled pipelines on disk: they are found again, and a damaged or missing cache changes nothing.

use crate::common::root;
use rodsweep::gpu::testing::device_or_skip;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A run on the GPU with a cache, by the program; the part's bytes.
fn rows(cache: &str, out: &Path) -> Vec<u8> {
    let sweep = root().join("sweeps/workspace.toml");
    let output = Command::new(env!("CARGO_BIN_EXE_rodsweep"))
        .args(["run", "--backend", "gpu", "--precision", "f32", "--limit", "500", "--no-figures"])
        .arg(sweep)
        .arg("--out")
        .arg(out)
        .env("RODSWEEP_CACHE", cache)
        .output()
        .expect("runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && !said.contains("warning"), "{said}");
    fs::read(out.join("part-0000000000.parquet")).expect("a part")
}

fn files(directory: &Path) -> Vec<PathBuf> {
    fs::read_dir(directory).map(|entries| entries.flatten().map(|entry| entry.path()).collect()).unwrap_or_default()
}

#[test]
fn a_cache_is_kept_and_a_damaged_one_is_replaced() {
    let Some(device) = device_or_skip("a pipeline cache") else { return };
    if !device.adapter().has_pipeline_cache {
        return eprintln!("SKIPPED a pipeline cache: {} gives none out", device.adapter());
    }
    let directory = tempfile::tempdir().expect("a directory");
    let cache = directory.path().join("cache");
    let named = cache.to_string_lossy().into_owned();
    let out = |name: &str| directory.path().join(name);
    let expected = rows("", &out("without"));
    assert!(rows(&named, &out("first")) == expected);
    let kept = files(&cache);
    assert_eq!(kept.len(), 1, "{kept:?}");
    let whole = fs::read(&kept[0]).expect("reads");
    assert!(whole.len() > 8);
    assert!(rows(&named, &out("again")) == expected);
    assert_eq!(files(&cache), kept);
    for damaged in [whole[..whole.len() / 2].to_vec(), vec![0xff; whole.len()], Vec::new()] {
        fs::write(&kept[0], damaged).expect("writes");
        fs::remove_dir_all(out("again")).expect("removes");
        assert!(rows(&named, &out("again")) == expected);
        assert_eq!(files(&cache), kept);
        assert_eq!(fs::read(&kept[0]).expect("reads").len(), whole.len());
    }
    // No place to write to.
    let file = directory.path().join("file");
    fs::write(&file, "").expect("writes");
    assert!(rows(&file.to_string_lossy(), &out("nowhere")) == expected);
}
