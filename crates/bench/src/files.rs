//! The files of a report, and writing them.

use crate::error::BenchError;
use std::path::Path;

/// What was measured.
pub const RAW: &str = "raw.csv";
/// What others have measured; a new measurement leaves it as it is.
pub const PEERS: &str = "peers.csv";
/// What ran where.
pub const MANIFEST: &str = "manifest.json";
/// The report itself.
pub const REPORT: &str = "report.md";

/// Makes a directory, and those around it.
pub fn create_directory(directory: &Path) -> Result<(), BenchError> {
    std::fs::create_dir_all(directory).map_err(|source| BenchError::Write { path: directory.to_owned(), source })
}

/// Writes a text whole or not at all; a file that is there is replaced.
pub fn write_file(path: &Path, text: &str) -> Result<(), BenchError> {
    rodsweep::files::replace(path, text.as_bytes())
        .map_err(|source| BenchError::Write { path: path.to_owned(), source })
}

/// Writes a text whole or not at all, and makes the directory that the file lies in.
pub fn write_in_directory(path: &Path, text: &str) -> Result<(), BenchError> {
    path.parent().map_or(Ok(()), create_directory)?;
    write_file(path, text)
}

/// Reads a text.
pub fn read_file(path: &Path) -> Result<String, BenchError> {
    rodsweep::files::read_text(path).map_err(|source| BenchError::Read { path: path.to_owned(), source })
}
