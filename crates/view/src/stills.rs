//! The stills, for browsers without WebGL: figures that lie in the directory, and the rod as it stands in the file.

use crate::error::Refusal;
use crate::rod;
use rodsweep::draw::{ImageFormat, encode};
use rodsweep::figures::rod_shape;
use rodsweep::model::Scene;
use std::path::{Path, PathBuf};

/// Name of the rod's own still.
pub const ROD: &str = "rod.png";
/// Most figures that are shown.
const MOST: usize = 24;
/// A figure is no larger (bytes).
const LARGEST: u64 = 32 << 20;

/// Figures by name; what is not in this list cannot be asked for.
pub struct Stills {
    files: Vec<(String, PathBuf)>,
}

impl Stills {
    /// The rod alone.
    pub fn of_scene() -> Stills {
        Stills { files: Vec::new() }
    }

    /// The PNG files that lie in a directory now; links are left out.
    pub fn of_directory(dir: &Path) -> Stills {
        let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
        let is_figure = |entry: &std::fs::DirEntry| {
            let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
            is_file && entry.metadata().is_ok_and(|metadata| metadata.len() <= LARGEST)
        };
        let mut files: Vec<(String, PathBuf)> = entries
            .filter(is_figure)
            .filter_map(|entry| Some((entry.file_name().to_str()?.to_owned(), entry.path())))
            .filter(|(name, _)| name.ends_with(".png") && name != ROD)
            .collect();
        // The map first.
        files.sort_by_key(|(name, _)| (name != "tips.png", name.clone()));
        files.truncate(MOST);
        Stills { files }
    }

    /// What may be asked for.
    pub fn names(&self) -> Vec<&str> {
        self.files.iter().map(|(name, _)| name.as_str()).chain([ROD]).collect()
    }

    /// A figure as PNG.
    ///
    /// # Errors
    ///
    /// A name that is not in the list, or a figure that is gone or cannot be drawn.
    pub fn read(&self, name: &str, scene: &Scene) -> Result<Vec<u8>, Refusal> {
        if name == ROD {
            let figure = rod_shape(&rod::solve(scene.clone())?).map_err(Refusal::wrong)?;
            return encode(&figure, ImageFormat::Png).map_err(Refusal::failed);
        }
        let path = self.files.iter().find(|(known, _)| known == name).map(|(_, path)| path);
        let path = path.ok_or_else(|| Refusal::absent(format!("no figure `{name}`")))?;
        rodsweep::files::read(path).map_err(|error| Refusal::failed(format!("`{name}` cannot be read: {error}")))
    }
}
