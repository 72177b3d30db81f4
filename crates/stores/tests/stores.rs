//! Runs and workers in an object store, in memory: the tests of `tests/files` over what this crate installs.

#[path = "../../../tests/files/claims.rs"]
mod claims;
#[path = "../../../tests/files/stores.rs"]
mod stores;

/// The project's folder.
fn root() -> &'static std::path::Path {
    concat!(env!("CARGO_MANIFEST_DIR"), "/../..").as_ref()
}

/// A place in memory.
fn in_memory(name: &str) -> Option<std::path::PathBuf> {
    rodsweep_stores::install();
    Some(format!("memory://{name}").into())
}

#[test]
fn an_address_of_no_store_is_refused() {
    rodsweep_stores::install();
    let refused = |url: &str| rodsweep::results::store_at(url.as_ref()).expect_err(url).to_string();
    assert!(refused("ftp://host/results").contains("known are s3://"));
    assert!(refused("s3:///results").contains("name a bucket"));
}
