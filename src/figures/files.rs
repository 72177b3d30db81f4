//! Figures as files of a result directory, wherever that lies.

use crate::draw::{self, Figure, Marked, ReportError};
use crate::results::write_bytes;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// Writes a figure as PNG and SVG, by the extensions, whole or not at all. It is drawn once, files are written side by
/// side, and those that are there are replaced.
fn write_all(figure: &dyn Figure, paths: &[impl AsRef<Path> + Sync]) -> Result<(), ReportError> {
    draw::write_with(figure, paths, &|path, bytes| write_bytes(path, bytes).map_err(std::io::Error::other))
}

/// The same with a bar that says what speaks against what is shown, if anything does.
fn write_all_marked(
    figure: &dyn Figure,
    paths: &[impl AsRef<Path> + Sync],
    mark: Option<&str>,
) -> Result<(), ReportError> {
    match mark {
        Some(mark) => write_all(&Marked { figure, mark }, paths),
        None => write_all(figure, paths),
    }
}

/// The figures of a study: files that were written, and what was left out since there was nothing to draw.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// In the order in which they were drawn.
    pub files: Vec<PathBuf>,
    /// A sentence each.
    pub left_out: Vec<String>,
}

impl Drawn {
    /// Writes a figure to several files; one with nothing to draw is left out, and the study goes on.
    ///
    /// # Errors
    ///
    /// A file that cannot be written, or data that do not fit together.
    pub(super) fn write(
        &mut self,
        figure: &dyn Figure,
        paths: impl IntoIterator<Item = PathBuf>,
        mark: Option<&str>,
    ) -> Result<(), ReportError> {
        let paths: Vec<PathBuf> = paths.into_iter().collect();
        match write_all_marked(figure, &paths, mark) {
            Ok(()) => self.files.extend(paths),
            Err(ReportError::Empty { figure, reason }) => {
                let name = paths.first().and_then(|path| path.file_name()).unwrap_or_default().to_string_lossy();
                self.left_out.push(format!("{name} is left out: nothing to draw in {figure}: {reason}"));
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Takes in what else was drawn.
    pub(super) fn extend(&mut self, other: Drawn) {
        self.files.extend(other.files);
        self.left_out.extend(other.left_out);
    }
}

impl Deref for Drawn {
    type Target = [PathBuf];

    fn deref(&self) -> &[PathBuf] {
        &self.files
    }
}

impl IntoIterator for Drawn {
    type Item = PathBuf;
    type IntoIter = std::vec::IntoIter<PathBuf>;

    fn into_iter(self) -> Self::IntoIter {
        self.files.into_iter()
    }
}
