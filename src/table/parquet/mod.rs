//! Parquet: one row group, zstd, byte-stream split for numbers, no dictionary.
//!
//! Units stand in the metadata of each field, as Arrow writes them.

mod ranges;
mod read;
mod seal;
mod thrift;
mod write;

pub use ranges::ByteSource;
pub use read::{Footer, footer, footer_length, read, read_from, read_numbers};
pub use seal::is_sealed;
pub use write::{Encoder, encode};

const FORMAT: &str = "Parquet";
