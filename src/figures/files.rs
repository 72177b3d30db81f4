//! Figures as files of a result directory, wherever that lies.

use crate::report::{self, Figure, ReportError};
use crate::results::write_bytes;
use std::path::Path;

/// Writes a figure as PNG or SVG, by the extension of `path`, whole or not at all. An existing file is replaced.
pub(super) fn write(figure: &dyn Figure, path: &Path) -> Result<(), ReportError> {
    write_all(figure, &[path])
}

/// The same to several files: the figure is drawn once, and the files are written side by side.
pub(super) fn write_all(figure: &dyn Figure, paths: &[impl AsRef<Path> + Sync]) -> Result<(), ReportError> {
    report::write_with(figure, paths, &|path, bytes| write_bytes(path, bytes).map_err(std::io::Error::other))
}
