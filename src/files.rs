//! Files that are replaced whole or not at all, and read only where they are files.

use std::collections::hash_map::RandomState;
use std::fs::{self, File};
use std::hash::{BuildHasher, Hasher};
use std::io::{Error, Result, Write};
use std::path::{Path, PathBuf};

/// Writes a file whole or not at all: beside its place, to the disk, then renamed.
///
/// What has its name is replaced, be it a link: where that leads stays as it is. A device or a pipe is written to.
///
/// # Errors
///
/// A file that cannot be written; then nothing is left of it.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    if is_stream(path) {
        return File::options().write(true).open(path)?.write_all(bytes);
    }
    let temporary = temporary(path);
    let mut file = File::create_new(&temporary)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    drop(file);
    let placed = written.and_then(|()| fs::rename(&temporary, path));
    if placed.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    placed
}

/// Reads a file. A pipe in its place is refused, since it may never end.
///
/// # Errors
///
/// What is no file, or cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    match irregular(path) {
        Some(what) => Err(Error::other(format!("it is {what}"))),
        None => fs::read(path),
    }
}

/// What has this name, in words, if it is there and no file.
pub fn irregular(path: &Path) -> Option<&'static str> {
    let there = path.symlink_metadata().ok()?;
    match path.metadata() {
        Err(_) if there.is_symlink() => Some("a link that leads nowhere"),
        Ok(there) if there.is_dir() => Some("a directory"),
        Ok(there) if !there.is_file() => Some("a pipe or a device"),
        _ => None,
    }
}

/// Whether a name is taken, be it by a link that leads nowhere.
pub fn is_taken(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Neither a file nor a directory, links followed.
fn is_stream(path: &Path) -> bool {
    path.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// A hidden name beside a file that nobody else takes.
fn temporary(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Seeded by the system, anew for each.
    let random = RandomState::new().build_hasher().finish();
    path.with_file_name(format!(".{name}.tmp-{random:016x}"))
}

#[cfg(test)]
mod tests {
    use super::{is_taken, replace};
    use std::fs;

    #[test]
    fn a_file_is_replaced_and_a_failure_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a directory");
        let path = folder.path().join("figure.svg");
        replace(&path, b"old").expect("writes");
        replace(&path, b"new").expect("writes");
        assert_eq!(fs::read(&path).expect("reads"), b"new");
        let directory = folder.path().join("directory");
        fs::create_dir(&directory).expect("makes");
        assert!(replace(&directory, b"text").is_err());
        assert!(replace(&folder.path().join("none/figure.svg"), b"text").is_err());
        assert_eq!(fs::read_dir(folder.path()).expect("lists").count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_replaced_and_not_followed() {
        let folder = tempfile::tempdir().expect("a directory");
        let [outside, link, dangling] = ["outside", "link", "dangling"].map(|name| folder.path().join(name));
        fs::write(&outside, "mine").expect("writes");
        std::os::unix::fs::symlink(&outside, &link).expect("links");
        std::os::unix::fs::symlink("nowhere", &dangling).expect("links");
        assert!(is_taken(&dangling) && !is_taken(&folder.path().join("none")));
        for link in [&link, &dangling] {
            replace(link, b"figure").expect("writes");
            assert!(fs::symlink_metadata(link).expect("is there").is_file());
        }
        assert_eq!(fs::read(&outside).expect("reads"), b"mine");
        assert_eq!(fs::read_dir(folder.path()).expect("lists").count(), 3);
    }
}
