//! Scenes to look at again.

use crate::error::BenchError;
use crate::files::write_in_directory;
use rodsweep::input::write_scene;
use rodsweep::model::Scene;
use std::path::Path;

/// Writes a scene, and the directory that it lies in.
pub fn write_scene_file(path: &Path, scene: &Scene) -> Result<(), BenchError> {
    write_in_directory(path, &write_scene(scene))
}
