//! The bench files: those built in, or those of a directory.

use crate::BenchError;
use rodsweep::sweep::BenchSpec;
use std::path::Path;

/// Name and text; the first is the scene that targets are stated for.
const FILES: [(&str, &str); 8] = [
    ("benchmark.toml", include_str!("../../../sweeps/bench/benchmark.toml")),
    ("easy.toml", include_str!("../../../sweeps/bench/easy.toml")),
    ("p6.toml", include_str!("../../../sweeps/bench/p6.toml")),
    ("p35.toml", include_str!("../../../sweeps/bench/p35.toml")),
    ("weight.toml", include_str!("../../../sweeps/bench/weight.toml")),
    ("two_coils.toml", include_str!("../../../sweeps/bench/two_coils.toml")),
    ("heavy.toml", include_str!("../../../sweeps/bench/heavy.toml")),
    ("folds.toml", include_str!("../../../sweeps/bench/folds.toml")),
];
const SCENES: [(&str, &str); 3] = [
    ("../scenes/p6.toml", include_str!("../../../sweeps/scenes/p6.toml")),
    ("../scenes/p35.toml", include_str!("../../../sweeps/scenes/p35.toml")),
    ("../scenes/two_coil.toml", include_str!("../../../sweeps/scenes/two_coil.toml")),
];

pub fn built_in() -> Result<Vec<BenchSpec>, BenchError> {
    FILES.iter().map(|(name, text)| Ok(BenchSpec::parse(Path::new(name), text, &SCENES)?)).collect()
}

/// Every TOML file of a directory by name, `benchmark.toml` first.
pub fn read(directory: &Path) -> Result<Vec<BenchSpec>, BenchError> {
    let refused = |problem: String| BenchError::Usage(format!("{}: {problem}", directory.display()));
    let entries = std::fs::read_dir(directory).map_err(|error| refused(format!("{error}; name a directory")))?;
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort_by_key(|path| (path.file_name().is_some_and(|name| name != FILES[0].0), path.clone()));
    if paths.is_empty() {
        return Err(refused("it holds no bench file (.toml); see sweeps/bench for examples".into()));
    }
    paths.iter().map(|path| Ok(BenchSpec::read(path)?)).collect()
}
