//! Files that are replaced whole or not at all, and read only where they are files.

use std::collections::hash_map::RandomState;
use std::fs::{self, File};
use std::hash::{BuildHasher, Hasher};
use std::io::{Error, Read, Result, Write};
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

/// A bound on the size of files that are read whole.
struct Bound {
    bytes: u64,
    /// The message for a larger file, with its remedy.
    remedy: &'static str,
}

/// Tables, sampled fields, pictures.
const OF_DATA: Bound = Bound { bytes: 4 << 30, remedy: "it is larger than 4 GiB; give a smaller file" };
/// Text by which a person tells something. Once parsed it takes a hundred times its size in memory.
const OF_SETTINGS: Bound = Bound {
    bytes: 16 << 20,
    remedy: "it is larger than 16 MiB, too large for a scene, a sweep or another file of settings; put tables of samples, \
             targets and sampled fields into files of their own, and name them here",
};

/// Opens a file for reading: every reader of this program opens its files here. A pipe or a device in its place is
/// refused, since it may never begin, or never end.
///
/// # Errors
///
/// What is no file, or cannot be opened.
pub fn open(path: &Path) -> Result<File> {
    let refused = |what: &str| Err(Error::other(format!("it is {what}; give a file")));
    if let Some(what) = irregular(path) {
        return refused(what);
    }
    let file = File::open(path)?;
    // Somebody may have put another thing there meanwhile.
    if file.metadata()?.is_file() { Ok(file) } else { refused("a pipe or a device") }
}

/// Reads a file of at most 4 GiB, see [`open`].
///
/// # Errors
///
/// What is no file, is larger, or cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    read_within(path, &OF_DATA)
}

fn read_within(path: &Path, bound: &Bound) -> Result<Vec<u8>> {
    let file = open(path)?;
    let refused = || Err(Error::other(bound.remedy));
    if file.metadata()?.len() > bound.bytes {
        return refused();
    }
    let mut bytes = Vec::new();
    // A file may grow while it is read, and some file systems tell no length.
    file.take(bound.bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > bound.bytes { refused() } else { Ok(bytes) }
}

/// The text of a file, see [`read`].
///
/// # Errors
///
/// As [`read`], or a file that is not UTF-8 text.
pub fn read_text(path: &Path) -> Result<String> {
    utf8(read(path)?)
}

/// The text of a file of settings: a scene, a sweep, a trajectory, a calibration. It has at most 16 MiB, see [`open`].
///
/// # Errors
///
/// The path names no file, the file is larger or cannot be read, or it is not UTF-8 text.
pub fn read_settings(path: &Path) -> Result<String> {
    utf8(read_within(path, &OF_SETTINGS)?)
}

fn utf8(bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|_| Error::other("it is not UTF-8 text"))
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
    use std::path::Path;

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

    #[test]
    fn what_is_too_large_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().expect("a directory");
        // Holes: such a file takes no room on the disk.
        let file = |name: &str, bytes: u64| {
            let path = folder.path().join(name);
            fs::File::create(&path).and_then(|file| file.set_len(bytes)).expect("a file");
            path
        };
        let [settings, table] = [file("scene.toml", 16 << 20), file("table.csv", (16 << 20) + 1)];
        assert_eq!(super::read_settings(&settings).expect("reads").len(), 16 << 20);
        assert_eq!(super::read(&table).expect("reads").len(), (16 << 20) + 1);
        let told = super::read_settings(&table).expect_err("too large").to_string();
        assert!(told.contains("16 MiB") && told.contains("files of their own"), "{told}");
        if !cfg!(unix) {
            // Elsewhere such a file takes room.
            return;
        }
        // More than memory holds.
        let huge = file("huge.csv", 1 << 40);
        for told in [super::read(&huge).map(|_| ()), super::read_text(&huge).map(|_| ())] {
            assert!(told.expect_err("too large").to_string().contains("4 GiB"));
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_refused_at_once() {
        let folder = tempfile::tempdir().expect("a directory");
        let [pipe, link] = ["pipe", "link"].map(|name| folder.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        std::os::unix::fs::symlink("/dev/zero", &link).expect("links");
        for path in [&pipe, &link, Path::new("/dev/zero"), folder.path()] {
            assert!(super::open(path).is_err() && super::read(path).is_err(), "{}", path.display());
        }
        fs::write(folder.path().join("file"), b"\xff").expect("writes");
        assert_eq!(super::read(&folder.path().join("file")).expect("reads"), b"\xff");
        assert!(super::read_text(&folder.path().join("file")).is_err());
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
