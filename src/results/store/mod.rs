//! Where the files of a run lie: a directory, or a place in an object store. Everything in `results` goes through here.
//!
//! A name is that of a file, with at most one folder before it (`claims/0000000003-0`).

mod local;

use super::error::ResultsError;
use local::Local;
use std::collections::HashMap;
use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::SystemTime;

/// Whole files by name. A reader never sees half of one.
pub trait Store: Send + Sync + fmt::Debug {
    /// Puts a file in a place that is free; false: it was taken, and is as before.
    ///
    /// # Errors
    ///
    /// The store cannot be written. Whether the file is there is then not known.
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool, ResultsError>;

    /// As [`Store::create`], of a small file that a power loss may take away or empty.
    ///
    /// # Errors
    ///
    /// As [`Store::create`].
    fn create_lightly(&self, name: &str, bytes: &[u8]) -> Result<bool, ResultsError> {
        self.create(name, bytes)
    }

    /// Puts a file, in the place of another one, if there is one.
    ///
    /// # Errors
    ///
    /// As [`Store::create`].
    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), ResultsError>;

    /// A file; `None` where there is none of this name.
    ///
    /// # Errors
    ///
    /// The store cannot be read.
    fn get(&self, name: &str) -> Result<Option<Vec<u8>>, ResultsError>;

    /// Some bytes of a file; fewer, where it ends before.
    ///
    /// # Errors
    ///
    /// As [`Store::get`], or there is no such file.
    fn get_range(&self, name: &str, range: Range<u64>) -> Result<Vec<u8>, ResultsError>;

    /// Size and time of a file; `None` where there is none of this name.
    ///
    /// # Errors
    ///
    /// As [`Store::get`].
    fn head(&self, name: &str) -> Result<Option<Entry>, ResultsError>;

    /// What lies in a folder (`""`: the place itself), without what lies in folders below.
    ///
    /// # Errors
    ///
    /// As [`Store::get`].
    fn list(&self, folder: &str) -> Result<Vec<Entry>, ResultsError>;

    /// Removes a file; one that is not there is as good as removed.
    ///
    /// # Errors
    ///
    /// As [`Store::create`].
    fn remove(&self, name: &str) -> Result<(), ResultsError>;

    /// Removes a folder that is empty. Object stores have none.
    ///
    /// # Errors
    ///
    /// As [`Store::create`], or the folder holds something.
    fn remove_folder(&self, _name: &str) -> Result<(), ResultsError> {
        Ok(())
    }

    /// Moves a file to a name that is free; false: it is not.
    ///
    /// # Errors
    ///
    /// As [`Store::create`], or there is no such file.
    fn rename(&self, from: &str, to: &str) -> Result<bool, ResultsError>;

    /// Makes the place ready to be written, and removes what writers that died have left half-written.
    ///
    /// # Errors
    ///
    /// As [`Store::create`].
    fn prepare(&self) -> Result<(), ResultsError>;

    /// Whether bytes are far away, so that reading all of them has to be worth it.
    fn is_remote(&self) -> bool;

    /// Where it lies, as users know it.
    fn place(&self) -> PathBuf;

    /// A file as users know it.
    fn path(&self, name: &str) -> PathBuf;
}

/// Holds the parts of a run that asks for it, and nothing else that readers of tables take for rows.
pub(crate) const ROWS_FOLDER: &str = "rows";
/// Folder of a result directory for tables of studies, where rows of their format lie at its top.
pub(crate) const TABLES_FOLDER: &str = "tables";

/// Name of a file without its folder.
pub(crate) fn file_name(name: &str) -> &str {
    name.rsplit_once('/').map_or(name, |(_, name)| name)
}

/// What a store tells of a file without reading it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Without the folder.
    pub name: String,
    /// Bytes.
    pub size: u64,
    /// When it was written, by the clock of the store, and to be compared with other times of the same store only.
    pub modified: SystemTime,
    /// Otherwise a folder or something else.
    pub is_file: bool,
}

/// Whether a path is the address of an object store, such as `s3://bucket/prefix`.
pub fn is_url(path: &Path) -> bool {
    path.to_str().is_some_and(|text| text.contains("://"))
}

/// Whether a path names a place that may hold a run, rather than a file: a directory, or an address.
pub fn is_place(path: &Path) -> bool {
    is_url(path) || path.is_dir()
}

/// The store of a directory or an address: `file://`, and of an object store, such as `s3://`, after [`install_object_stores`].
///
/// # Errors
///
/// An address that is not understood, or of a store that cannot be reached.
pub fn store_at(place: &Path) -> Result<Arc<dyn Store>, ResultsError> {
    if !is_url(place) {
        return Ok(Arc::new(Local::new(place)));
    }
    let text = place.to_string_lossy();
    let address = |reason: &str| ResultsError::Address { url: place.into(), reason: reason.into() };
    match text.split_once("://") {
        Some(("file", path)) if path.starts_with('/') => Ok(Arc::new(Local::new(Path::new(path)))),
        Some(("file", _)) => Err(address("a path starts with a slash, as in file:///home/me/results")),
        _ => known_store(place, text.trim_end_matches('/')),
    }
}

/// Stores of addresses: connections are kept, and what is in memory stays there.
fn known_store(place: &Path, url: &str) -> Result<Arc<dyn Store>, ResultsError> {
    static KNOWN: Mutex<Option<HashMap<String, Arc<dyn Store>>>> = Mutex::new(None);
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let known = known.get_or_insert_default();
    if let Some(store) = known.get(url) {
        return Ok(store.clone());
    }
    let store = far_store(place, url)?;
    known.insert(url.to_owned(), store.clone());
    Ok(store)
}

/// Opens the store of an address: the place as it was given, and as text without a slash at its end.
pub type OpenStore = fn(&Path, &str) -> Result<Arc<dyn Store>, ResultsError>;

static OBJECT_STORES: OnceLock<OpenStore> = OnceLock::new();

/// Makes object stores known to this process; the crate `rodsweep-stores` has them. The first to be installed stay.
pub fn install_object_stores(open: OpenStore) {
    let _ = OBJECT_STORES.set(open);
}

fn far_store(place: &Path, url: &str) -> Result<Arc<dyn Store>, ResultsError> {
    let reason = "this program was built without object stores: build it with `cargo build --release -p rodsweep-cli \
                  --features stores`, or take the wheel or a released program";
    match OBJECT_STORES.get() {
        Some(open) => open(place, url),
        None => Err(ResultsError::Address { url: place.into(), reason: reason.into() }),
    }
}

/// The store and the name of a single file.
pub(crate) fn store_of(path: &Path) -> Result<(Arc<dyn Store>, String), ResultsError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Ok((store_at(folder)?, name))
}

/// 32 digits that nobody else has, on whatever machine.
pub(crate) fn random_name() -> String {
    // Keys of hash maps are the randomness that the standard library gives out.
    let word = || RandomState::new().hash_one(std::process::id());
    format!("{:016x}{:016x}", word(), word())
}
