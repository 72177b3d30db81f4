//! Long tests take some of their cases each day, and all of them in turn.

use std::time::{SystemTime, UNIX_EPOCH};

/// Days since 1970: the seed of today.
pub fn today() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).expect("a clock").as_secs() / 86_400
}

/// Today's cases: one in so many.
pub fn of_today<T>(cases: impl IntoIterator<Item = T>, parts: usize) -> Vec<T> {
    cases.into_iter().enumerate().filter(|(number, _)| is_of_today(*number, parts)).map(|(_, case)| case).collect()
}

/// Whether a case, by its number, is among today's: one in so many is.
pub fn is_of_today(number: usize, parts: usize) -> bool {
    (number + today() as usize).is_multiple_of(parts)
}
