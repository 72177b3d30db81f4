//! Scenes to look at again.

use crate::error::BenchError;
use rodsweep::input::write_scene;
use rodsweep::model::Scene;
use std::path::Path;

/// Writes a scene, and the directory that it lies in.
pub fn write_scene_file(path: &Path, scene: &Scene) -> Result<(), BenchError> {
    let directory = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    let written = directory.and_then(|()| std::fs::write(path, write_scene(scene)));
    written.map_err(|source| BenchError::Write { path: path.to_owned(), source })
}
