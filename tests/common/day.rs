//! Long tests take some of their cases each day, and all of them in turn.

use std::time::{SystemTime, UNIX_EPOCH};

/// Whether a case, by its number, is among today's: one in so many is.
pub fn is_of_today(number: usize, parts: usize) -> bool {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).expect("a clock");
    (number + (since.as_secs() / 86_400) as usize).is_multiple_of(parts)
}
