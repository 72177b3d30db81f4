//! Parquet: one row group, zstd, byte-stream split for numbers, no dictionary.
//!
//! Units stand in the metadata of each field, as Arrow writes them.

mod read;
mod write;

pub use read::{Footer, footer, read};
pub use write::{encode, encode_into};

const FORMAT: &str = "Parquet";
