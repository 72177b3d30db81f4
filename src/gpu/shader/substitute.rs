//! Variables of unrolled loops and their values in a line.

/// A variable of an unrolled loop and its value; the suffix keeps its type.
pub(super) struct Bound {
    pub name: String,
    pub value: u32,
    pub suffix: &'static str,
}

/// Puts the values of loop variables into a line of code; comments stay.
pub(super) fn substitute(line: &str, bounds: &[Bound]) -> String {
    let (code, comment) = line.split_at(line.find("//").unwrap_or(line.len()));
    replace(code, bounds, |bound| format!("{}{}", bound.value, bound.suffix)) + comment
}

/// Puts the values of loop variables into the name of a term.
pub(super) fn substitute_plain(text: &str, bounds: &[Bound]) -> String {
    replace(text, bounds, |bound| bound.value.to_string())
}

/// A line of f32 code in f64; comments stay.
pub(super) fn in_f64(line: &str) -> String {
    let (code, comment) = line.split_at(line.find("//").unwrap_or(line.len()));
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let mut out = String::with_capacity(line.len());
    let mut rest = code;
    while let Some(start) = rest.find(is_word) {
        let mut end = rest[start..].find(|c| !is_word(c)).map_or(rest.len(), |length| start + length);
        let is_number = rest[start..].starts_with(|c: char| c.is_ascii_digit());
        // The sign of an exponent.
        if is_number && rest[start..end].ends_with('e') {
            end += 1 + rest[end + 1..].find(|c: char| !is_word(c)).unwrap_or(rest.len() - end - 1);
        }
        let word = &rest[start..end];
        let is_float = is_number && word.contains(['.', 'e']) && !word.ends_with('f') && !word.starts_with("0x");
        out.push_str(&rest[..start]);
        match word {
            "f32" => out.push_str("f64"),
            _ if is_float => out.extend([word, "lf"]),
            _ => out.push_str(word),
        }
        rest = &rest[end..];
    }
    out + rest + comment
}

fn replace(text: &str, bounds: &[Bound], literal: impl Fn(&Bound) -> String) -> String {
    if bounds.is_empty() {
        return text.into();
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find(is_word) {
        let end = rest[start..].find(|c| !is_word(c)).map_or(rest.len(), |length| start + length);
        out.push_str(&rest[..start]);
        let (word, is_member) = (&rest[start..end], out.ends_with('.'));
        rest = &rest[end..];
        match bounds.iter().find(|bound| bound.name == word) {
            Some(bound) if !is_member => out.push_str(&literal(bound)),
            _ if word.starts_with(|c: char| c.is_ascii_digit()) => out.push_str(word),
            _ => out.push_str(&paste(word, bounds)),
        }
    }
    out + rest
}

/// `name_i` with the value of i.
fn paste(word: &str, bounds: &[Bound]) -> String {
    let part = |(at, part): (usize, &str)| match bounds.iter().find(|bound| at > 0 && bound.name == part) {
        Some(bound) => bound.value.to_string(),
        None => part.to_owned(),
    };
    word.split('_').enumerate().map(part).collect::<Vec<_>>().join("_")
}
