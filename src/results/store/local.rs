//! A directory as a store: temporary file, fsync, link or rename, fsync of the folder.

use super::{Entry, ROWS_FOLDER, Store, file_name, random_name};
use crate::files;
use crate::results::error::ResultsError;
use std::fs::{self, File};
use std::io::{Error, ErrorKind, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

/// Ends the name of a file that is being written: `.NAME.<32 digits>.writing`.
const TEMPORARY: &str = ".writing";
/// No writer takes that long.
const STALE: Duration = Duration::from_secs(3600);

/// A directory.
#[derive(Debug)]
pub struct Local {
    dir: PathBuf,
}

impl Local {
    pub fn new(dir: &Path) -> Local {
        Local { dir: dir.into() }
    }

    /// Writes a temporary file and hands it to `place`; what is lasting survives a power loss.
    fn write(
        &self,
        (name, bytes): (&str, &[u8]),
        is_lasting: bool,
        place: impl FnOnce(&Path, &Path) -> std::io::Result<bool>,
    ) -> Result<bool, ResultsError> {
        let path = self.path(name);
        let folder = path.parent().unwrap_or(&self.dir);
        let file_name = path.file_name().unwrap_or_default().to_string_lossy();
        let temporary = folder.join(format!(".{file_name}.{}{TEMPORARY}", random_name()));
        if name.contains('/') && !folder.is_dir() {
            // Folders of the store are made as they are needed; the directory itself is made by `prepare` alone.
            let _ = fs::create_dir(folder);
        }
        let written = File::create_new(&temporary).and_then(|mut file| {
            file.write_all(bytes)?;
            if is_lasting { file.sync_all() } else { Ok(()) }
        });
        let placed = written.and_then(|()| place(&temporary, &path));
        let _ = fs::remove_file(&temporary);
        let placed = placed.map_err(ResultsError::io(&path, "writing"))?;
        if is_lasting {
            sync_folder(folder).map_err(ResultsError::io(&path, "writing"))?;
        }
        Ok(placed)
    }

    fn open(&self, name: &str) -> Result<Option<File>, ResultsError> {
        let path = self.path(name);
        let io = ResultsError::io(&path, "reading");
        // Opening a pipe would wait for somebody to write to it.
        if let Some(what) = files::irregular(&path) {
            return Err(io(Error::other(format!("it is {what}"))));
        }
        match files::open(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            result => result.map(Some).map_err(io),
        }
    }

    /// Files of writers that died: by their names ours, and untouched for long before the newest file.
    fn remove_stale_temporaries(&self) -> Result<(), ResultsError> {
        let mut entries = self.list("")?;
        let rows = self.list(ROWS_FOLDER).unwrap_or_default();
        entries.extend(rows.into_iter().map(|entry| Entry { name: format!("{ROWS_FOLDER}/{}", entry.name), ..entry }));
        let newest = entries.iter().map(|entry| entry.modified).max();
        for entry in entries.iter().filter(|entry| entry.is_file && is_temporary(file_name(&entry.name))) {
            let age = newest.and_then(|newest| newest.duration_since(entry.modified).ok());
            if age.is_some_and(|age| age > STALE) {
                let _ = fs::remove_file(self.dir.join(&entry.name));
            }
        }
        Ok(())
    }
}

impl Store for Local {
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool, ResultsError> {
        self.write((name, bytes), true, link)
    }

    fn create_lightly(&self, name: &str, bytes: &[u8]) -> Result<bool, ResultsError> {
        self.write((name, bytes), false, link)
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), ResultsError> {
        self.write((name, bytes), true, |from, to| fs::rename(from, to).map(|()| true)).map(|_| ())
    }

    fn get(&self, name: &str) -> Result<Option<Vec<u8>>, ResultsError> {
        let Some(mut file) = self.open(name)? else { return Ok(None) };
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(ResultsError::io(&self.path(name), "reading"))?;
        Ok(Some(bytes))
    }

    fn get_range(&self, name: &str, range: Range<u64>) -> Result<Vec<u8>, ResultsError> {
        let path = self.path(name);
        let io = ResultsError::io(&path, "reading");
        let Some(mut file) = self.open(name)? else { return Err(io(ErrorKind::NotFound.into())) };
        let mut bytes = Vec::new();
        let read = || {
            file.seek(SeekFrom::Start(range.start))?;
            file.take(range.end.saturating_sub(range.start)).read_to_end(&mut bytes)
        };
        read().map_err(io)?;
        Ok(bytes)
    }

    fn head(&self, name: &str) -> Result<Option<Entry>, ResultsError> {
        let path = self.path(name);
        match fs::metadata(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(ResultsError::io(&path, "reading")(error)),
            Ok(metadata) => Ok(Some(entry(name, &metadata))),
        }
    }

    fn list(&self, folder: &str) -> Result<Vec<Entry>, ResultsError> {
        let dir = if folder.is_empty() { self.dir.clone() } else { self.dir.join(folder) };
        let entries = match fs::read_dir(&dir) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            result => result.map_err(ResultsError::io(&dir, "listing"))?,
        };
        let mut found = Vec::new();
        for item in entries {
            let item = item.map_err(ResultsError::io(&dir, "listing"))?;
            // What a link leads to, or the link itself.
            match fs::metadata(item.path()).or_else(|_| item.metadata()) {
                Ok(metadata) => found.push(entry(&item.file_name().to_string_lossy(), &metadata)),
                // Somebody else's temporary file.
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => return Err(ResultsError::io(&item.path(), "listing")(error)),
            }
        }
        Ok(found)
    }

    fn remove(&self, name: &str) -> Result<(), ResultsError> {
        let path = self.path(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(ResultsError::io(&path, "removing")(error)),
            _ => Ok(()),
        }
    }

    fn remove_folder(&self, name: &str) -> Result<(), ResultsError> {
        let path = self.path(name);
        match fs::remove_dir(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(ResultsError::io(&path, "removing")(error)),
            _ => Ok(()),
        }
    }

    fn rename(&self, from: &str, to: &str) -> Result<bool, ResultsError> {
        let (from, to) = (self.path(from), self.path(to));
        if files::is_taken(&to) {
            return Ok(false);
        }
        fs::rename(&from, &to).map_err(ResultsError::io(&from, "moving"))?;
        sync_folder(&self.dir).map_err(ResultsError::io(&from, "moving"))?;
        Ok(true)
    }

    fn prepare(&self) -> Result<(), ResultsError> {
        fs::create_dir_all(&self.dir).map_err(ResultsError::io(&self.dir, "making the result directory"))?;
        self.remove_stale_temporaries()
    }

    fn is_remote(&self) -> bool {
        false
    }

    fn place(&self) -> PathBuf {
        self.dir.clone()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }
}

fn entry(name: &str, metadata: &fs::Metadata) -> Entry {
    let modified = metadata.modified().unwrap_or(UNIX_EPOCH);
    Entry { name: name.into(), size: metadata.len(), modified, is_file: metadata.is_file() }
}

fn is_temporary(name: &str) -> bool {
    let inner = name.strip_prefix('.').and_then(|name| name.strip_suffix(TEMPORARY));
    inner.and_then(|inner| inner.rsplit_once('.')).is_some_and(|(name, digits)| {
        !name.is_empty() && digits.len() == 32 && digits.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'))
    })
}

/// Gives a file a name that is free; false: it is taken.
fn link(temporary: &Path, path: &Path) -> std::io::Result<bool> {
    match fs::hard_link(temporary, path) {
        Ok(()) => Ok(true),
        // Over a network the reply to a link that was made may have been lost, and the link asked for again.
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(is_same_file(temporary, path)),
        Err(error) if !has_no_links(&error) => Err(error),
        Err(_) if path.exists() => Ok(false),
        Err(_) => fs::rename(temporary, path).map(|()| true),
    }
}

/// Whether a file system knows no hard links; other errors are no reason to do without them.
fn has_no_links(error: &Error) -> bool {
    use ErrorKind::{InvalidInput, PermissionDenied, TooManyLinks, Unsupported};
    matches!(error.kind(), InvalidInput | PermissionDenied | TooManyLinks | Unsupported)
}

#[cfg(unix)]
fn is_same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |path: &Path| fs::symlink_metadata(path).map(|metadata| (metadata.dev(), metadata.ino())).ok();
    of(a).is_some() && of(a) == of(b)
}

#[cfg(not(unix))]
fn is_same_file(_: &Path, _: &Path) -> bool {
    false
}

/// Makes a new name in a folder survive a power loss, where the system can.
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let Ok(folder) = File::open(folder) else { return Ok(()) };
    match folder.sync_all() {
        Err(error) if !cannot_sync(&error) => Err(error),
        _ => Ok(()),
    }
}

/// Whether a system has no such thing for folders.
fn cannot_sync(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::PermissionDenied | ErrorKind::Unsupported)
}
