//! A part of a sweep for one machine of several.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Part `index` (from 1) of `count`: every count-th chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// From 1.
    pub index: u64,
    /// Shards of the sweep.
    pub count: u64,
}

/// A text that names no shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("shard `{text}`: {reason}; write K/N with K from 1 to N, such as 2/8")]
#[non_exhaustive]
pub struct ShardError {
    /// As it was given.
    pub text: String,
    /// What is wrong with it.
    pub reason: &'static str,
}

impl Shard {
    /// The sweep as one part.
    pub const WHOLE: Shard = Shard { index: 1, count: 1 };

    /// Parses `K/N`, K from 1 to N.
    ///
    /// # Errors
    ///
    /// Another text.
    pub fn parse(text: &str) -> Result<Shard, ShardError> {
        let refused = |reason| ShardError { text: text.into(), reason };
        let (index, count) = text.split_once('/').ok_or_else(|| refused("it has no slash"))?;
        let number = |text: &str| text.trim().parse::<u64>().map_err(|_| refused("K and N are whole numbers"));
        let shard = Shard { index: number(index)?, count: number(count)? };
        if shard.index >= 1 && shard.index <= shard.count {
            Ok(shard)
        } else {
            Err(refused("K is not between 1 and N"))
        }
    }

    /// Whether a chunk belongs to it.
    pub fn owns(&self, chunk: u64) -> bool {
        chunk % self.count == self.index - 1
    }
}

impl Default for Shard {
    fn default() -> Shard {
        Shard::WHOLE
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}
