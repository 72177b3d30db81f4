//! Results in object stores: S3, Google Cloud Storage, Azure, and, for tests, the memory of the process.
//!
//! After [`install`] an address such as `s3://bucket/prefix` may stand wherever [`rodsweep`] takes a result directory. The environment says
//! who asks, as it does for the tools of the stores.

mod objects;
mod profile;

use std::sync::Arc;

/// Makes object stores known to this process. To call it again changes nothing.
pub fn install() {
    rodsweep::results::install_object_stores(|place, url| Ok(Arc::new(objects::Objects::open(place, url)?)));
}
