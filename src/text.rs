//! Names are data: one function for each place that text of users goes to, so that no name becomes a command, a control
//! sequence or markup there. JSON is written by `serde_json`, tables by [`table`](crate::table).

use std::borrow::Cow;

/// Text for a terminal, or for a message: characters that a terminal obeys are written as `\u001b`, which JSON reads back.
/// Line breaks and tabs stay.
///
/// ```
/// assert_eq!(rodsweep::text::terminal("red\u{1b}[31m"), "red\\u001b[31m");
/// ```
pub fn terminal(text: &str) -> Cow<'_, str> {
    let is_plain = |c: char| !is_obeyed(c) || c == '\n' || c == '\t';
    if text.chars().all(is_plain) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if is_plain(c) { c.to_string() } else { format!("\\u{:04x}", c as u32) };
    Cow::Owned(text.chars().map(escaped).collect())
}

/// The same on one line: line breaks and tabs are written as `\u000a` and `\u0009`, too.
pub fn line(text: &str) -> String {
    terminal(text).replace('\n', "\\u000a").replace('\t', "\\u0009")
}

/// Text within SVG, HTML or other XML, and within their attributes. Characters that XML 1.0 does not know become U+FFFD.
///
/// ```
/// assert_eq!(rodsweep::text::xml("a < \"b\"\u{1}"), "a &lt; &quot;b&quot;\u{fffd}");
/// ```
pub fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' => out.push(c),
            c if is_obeyed(c) || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(char::REPLACEMENT_CHARACTER),
            c => out.push(c),
        }
    }
    out
}

/// One word of a POSIX shell, whatever it holds but NUL.
///
/// ```
/// assert_eq!(rodsweep::text::shell_word("it's"), r"'it'\''s'");
/// assert_eq!(rodsweep::text::shell_word("results/a-1"), "results/a-1");
/// ```
pub fn shell_word(word: &str) -> String {
    let is_safe = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_safe) { word.to_owned() } else { quoted(word) }
}

/// The same, always in quotes.
pub fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// The first character of a text that cannot stand in a line of a script or of its comments, such as a line break.
pub fn unfit_for_a_line(text: &str) -> Option<char> {
    text.chars().find(|c| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}'))
}

/// Control characters, separators of lines, and those that turn the direction of what follows.
fn is_obeyed(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::{line, quoted, shell_word, terminal, unfit_for_a_line, xml};

    /// Every character below U+3000, and then some.
    fn hostile() -> String {
        (0..0x3000).chain([0xfeff, 0xfffe, 0xffff, 0x1_f600]).filter_map(char::from_u32).collect()
    }

    #[test]
    fn no_control_character_is_left() {
        let text = hostile();
        let told = terminal(&text);
        assert!(told.chars().all(|c| !c.is_control() || c == '\n' || c == '\t'));
        assert!(!told.contains('\u{202e}') && !line(&text).contains(['\n', '\t', '\u{2028}']));
        assert_eq!(terminal("plain ä µ\n"), "plain ä µ\n");
        let again: String = serde_json::from_str(&terminal("\"a\\u001b\u{7f}b\"")).expect("JSON");
        assert_eq!(again, "a\u{1b}\u{7f}b");
        let marked = xml(&text);
        assert!(marked.chars().all(|c| c >= ' ' || c == '\n' || c == '\t'));
        assert!(!marked.contains(['<', '>', '"', '\'', '\u{ffff}']));
    }

    #[test]
    fn a_word_is_one_word() {
        for word in ["", "a b", "$(touch x)", "a\nb", "it's", "`x`", "-o", "a;b", "~", "a#b", "#"] {
            let quoted = quoted(word);
            assert!(quoted.starts_with('\'') && quoted.ends_with('\''));
            assert_eq!(quoted.replace(r"'\''", "\0").matches('\'').count(), 2, "{word}");
        }
        assert_eq!(shell_word("a b"), "'a b'");
        assert_eq!(unfit_for_a_line("a\nb"), Some('\n'));
        assert_eq!(unfit_for_a_line("a b'$;"), None);
    }
}
