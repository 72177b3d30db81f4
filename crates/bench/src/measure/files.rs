//! The bench files: those built in, or those of a directory.

use crate::bench_file::BenchSpec;
use crate::error::BenchError;
use rodsweep::shipped::{self, P6, P35, TWO_COIL};
use std::path::Path;

/// The shipped bench files, first the one that targets are stated for.
///
/// # Errors
///
/// None, as they read.
pub fn built_in() -> Result<Vec<BenchSpec>, BenchError> {
    let scenes = [("../scenes/p6.toml", P6.1), ("../scenes/p35.toml", P35.1), ("../scenes/two_coil.toml", TWO_COIL.1)];
    shipped::BENCH.iter().map(|(name, text)| Ok(BenchSpec::parse(Path::new(name), text, &scenes)?)).collect()
}

/// Every TOML file of a directory by name, `benchmark.toml` first.
///
/// # Errors
///
/// A directory that cannot be listed or has no such file, or a mistake in one.
pub fn read_directory(directory: &Path) -> Result<Vec<BenchSpec>, BenchError> {
    let entries = std::fs::read_dir(directory)
        .map_err(|source| BenchError::Directory { directory: directory.to_owned(), source })?;
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let (first, _) = shipped::BENCH[0];
    paths.sort_by_key(|path| (path.file_name().is_some_and(|name| name != first), path.clone()));
    if paths.is_empty() {
        return Err(BenchError::NoBenchFiles { directory: directory.to_owned() });
    }
    paths.iter().map(|path| Ok(BenchSpec::read(path)?)).collect()
}
