//! Why a table cannot be read or written.

use crate::model::short_name;

/// Names what is wrong with a file; the path stands in the error of the caller.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The system refuses.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// Cut, overwritten, or of another format.
    #[error("is no whole {format} file: {reason}")]
    Damaged {
        /// As its users call it.
        format: &'static str,
        /// What did not fit.
        reason: String,
    },
    /// A column that tables do not hold, or that is not what was asked for.
    #[error("column `{}` is {found}; give {expected}", short_name(.column))]
    Kind {
        /// Its name.
        column: String,
        /// Such as `text`.
        found: &'static str,
        /// Such as `numbers`.
        expected: &'static str,
    },
    /// Packed in a way that this program cannot undo.
    #[error("is compressed with {codec}, which is not read; write it again with zstd or snappy")]
    Codec {
        /// Its name in lower case.
        codec: &'static str,
    },
    /// More numbers than are taken into memory.
    #[error(
        "holds {rows} rows of {columns} columns, which is more than the {most} numbers that are read from one table; split it"
    )]
    TooLarge {
        /// By the file's own word.
        rows: u64,
        /// That would be read.
        columns: u64,
        /// Numbers that are read at most.
        most: u64,
    },
    /// A table that the format cannot hold.
    #[error("cannot be written as {format}: {reason}")]
    Unwritable {
        /// As its users call it.
        format: &'static str,
        /// What did not fit.
        reason: String,
    },
}

/// A file that does not hold what its format promises.
pub(super) fn damaged(format: &'static str, reason: impl ToString) -> TableError {
    TableError::Damaged { format, reason: reason.to_string() }
}
