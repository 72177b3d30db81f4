//! Messages stay short: long names lose their middle, numbers get exponents, long lists lose their end.

use std::borrow::Cow;

/// Characters of a name that a message quotes at most: those of its head, a mark, those of its tail.
const HEAD: usize = 40;
const TAIL: usize = 19;
/// Entries that a message lists at most.
const MOST_LISTED: usize = 20;

/// A text of a user as a message quotes it: at most 60 characters, without its middle where it is longer.
pub fn short_name(text: &str) -> Cow<'_, str> {
    if text.char_indices().nth(HEAD + TAIL + 1).is_none() {
        return text.into();
    }
    let head = text.char_indices().nth(HEAD).map_or(0, |(at, _)| at);
    let tail = text.char_indices().rev().nth(TAIL - 1).map_or(text.len(), |(at, _)| at);
    format!("{}…{}", &text[..head], &text[tail..]).into()
}

/// A number as a message tells it: with an exponent where it is very large or very small.
pub fn short_number(number: f64) -> String {
    let size = number.abs();
    let is_plain = size == 0.0 || (1e-5..1e16).contains(&size) || !size.is_finite();
    if is_plain { number.to_string() } else { format!("{number:e}") }
}

/// Entries as a message lists them: the first twenty, and how many more there are.
pub fn short_list(mut entries: impl Iterator<Item = String>) -> String {
    let first: Vec<String> = entries.by_ref().take(MOST_LISTED).collect();
    match entries.count() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::{short_list, short_name, short_number};

    #[test]
    fn names_lose_their_middle() {
        let name = "segment[12].rest_curvature[3].value";
        assert_eq!(short_name(name), name);
        let longest = "ä".repeat(60);
        assert_eq!(short_name(&longest), longest);
        let long = format!("{}{}{}", "ä".repeat(40), "b".repeat(3_000_000), "µ".repeat(19));
        let short = short_name(&long);
        assert_eq!(short.chars().count(), 60);
        assert_eq!(short, format!("{}…{}", "ä".repeat(40), "µ".repeat(19)));
    }

    #[test]
    fn numbers_have_no_rows_of_zeros() {
        let told = [0.0, -0.25, 1e-5, 9.9e-6, 1e15, 1e16, -1e300, f64::INFINITY].map(short_number);
        assert_eq!(told, ["0", "-0.25", "0.00001", "9.9e-6", "1000000000000000", "1e16", "-1e300", "inf"]);
    }

    #[test]
    fn lists_have_an_end() {
        let list = |count: usize| short_list((0..count).map(|k| k.to_string()));
        assert_eq!(list(3), "0, 1, 2");
        assert!(list(20).ends_with(", 18, 19"));
        assert!(list(300_000).ends_with(", 18, 19 and 299980 more"));
    }
}
