//! What the fuzz targets share with the test `files`.

pub mod readers;

/// Reads the bytes by the reader of this name.
pub fn read(name: &str, bytes: &[u8]) {
    use std::sync::{Once, OnceLock};
    static PLACE: OnceLock<readers::Place> = OnceLock::new();
    static QUIET: Once = Once::new();
    // The Parquet crate panics on some damaged pages; the reader catches that, and only what it does not is found here.
    QUIET.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    let reader = readers::READERS.iter().find(|reader| reader.name == name).expect("a reader");
    (reader.read)(PLACE.get_or_init(readers::Place::new), bytes);
}
