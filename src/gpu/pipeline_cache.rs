//! Compiled pipelines on disk, from run to run, where the driver hands them out. Any trouble with the file means no cache.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::{Mutex, PoisonError};
use xxhash_rust::xxh3::xxh3_64;

/// Where the cache is; empty means none.
const VARIABLE: &str = "RODSWEEP_CACHE";
/// Every plan adds its pipelines to the adapter's file, which starts anew beyond this (bytes).
const MOST: u64 = 64 << 20;
/// Bytes of the hash that a file begins with.
const HASH: usize = 8;

/// Pipelines of one adapter.
#[derive(Debug)]
pub(super) struct PipelineCache {
    pub raw: wgpu::PipelineCache,
    path: PathBuf,
    /// Hash of what the file holds.
    stored: Mutex<u64>,
}

/// The directory of the cache: what the environment variable `RODSWEEP_CACHE` says, else the system's place for such
/// files. `None` where the variable is empty or the system has no place.
pub fn cache_directory() -> Option<PathBuf> {
    let named = |name: &str| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    if env::var_os(VARIABLE).is_some() {
        return named(VARIABLE);
    }
    let usual = if cfg!(windows) {
        named("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        named("HOME").map(|home| home.join("Library/Caches"))
    } else {
        named("XDG_CACHE_HOME").or_else(|| named("HOME").map(|home| home.join(".cache")))
    };
    usual.map(|place| place.join("rodsweep"))
}

impl PipelineCache {
    pub fn open(device: &wgpu::Device, adapter: &wgpu::AdapterInfo) -> Option<PipelineCache> {
        if !device.features().contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let path = cache_directory()?.join(wgpu::util::pipeline_cache_key(adapter)?);
        let data = read(&path);
        let descriptor =
            wgpu::PipelineCacheDescriptor { label: Some("rodsweep"), data: data.as_deref(), fallback: true };
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        // SAFETY: the data is what `get_data` gave, as its hash shows; wgpu checks that adapter and driver are the same.
        #[allow(unsafe_code)]
        let raw = unsafe { device.create_pipeline_cache(&descriptor) };
        match pollster::block_on(scope.pop()) {
            None => Some(PipelineCache { raw, path, stored: Mutex::new(xxh3_64(&data.unwrap_or_default())) }),
            Some(_) => None,
        }
    }

    /// Writes what has been compiled since.
    pub fn store(&self) {
        let Some(data) = self.raw.get_data() else { return };
        let hash = xxh3_64(&data);
        let mut stored = self.stored.lock().unwrap_or_else(PoisonError::into_inner);
        if *stored != hash && write(&self.path, hash, &data).is_some() {
            *stored = hash;
        }
    }
}

/// What a file holds, if it is whole.
fn read(path: &Path) -> Option<Vec<u8>> {
    // What is no file, such as a pipe, might never end.
    let there = fs::metadata(path).ok()?;
    if !there.is_file() || there.len() > MOST {
        return None;
    }
    let bytes = fs::read(path).ok()?;
    let (hash, data) = bytes.split_at_checked(HASH)?;
    (hash == xxh3_64(data).to_le_bytes()).then(|| data.to_vec())
}

/// The file is replaced at once, so that another program reads the old one or the new one.
fn write(path: &Path, hash: u64, data: &[u8]) -> Option<()> {
    let directory = path.parent()?;
    fs::create_dir_all(directory).ok()?;
    let temporary = path.with_extension(format!("{}-{hash:016x}", process::id()));
    let written =
        fs::write(&temporary, [&hash.to_le_bytes(), data].concat()).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    written.ok()
}

#[cfg(test)]
mod tests {
    use super::{read, write};
    use std::fs;
    use xxhash_rust::xxh3::xxh3_64;

    #[test]
    fn a_damaged_file_is_none() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("deeper/cache");
        assert_eq!(read(&path), None);
        let data: Vec<u8> = (0..=255).collect();
        assert_eq!(write(&path, xxh3_64(&data), &data), Some(()));
        assert_eq!(read(&path), Some(data));
        let whole = fs::read(&path).expect("reads");
        for length in [0, 3, 8, whole.len() - 1] {
            fs::write(&path, &whole[..length]).expect("writes");
            // Nothing hashes to a number of its own.
            assert_eq!(read(&path), None, "{length} bytes");
        }
        let mut flipped = whole;
        flipped[100] ^= 1;
        fs::write(&path, flipped).expect("writes");
        assert_eq!(read(&path), None);
        assert_eq!(fs::read_dir(directory.path().join("deeper")).expect("lists").count(), 1);
    }
}
