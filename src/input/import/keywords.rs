//! Files of lines `keyword value value ...`; `#` begins a comment. Every mistake names file, line, keyword and remedy.

use super::super::error::{InputError, Problem};
use super::super::units::{Dimension, QuantityError, parse_quantity};
use crate::model::{closest, short_name};
use std::path::Path;

/// A number and its digits in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number<'a> {
    pub text: &'a str,
    pub value: f64,
}

/// Which numbers a keyword takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bound {
    Any,
    NotNegative,
    Positive,
}

/// A keyword whose values are numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Keyword {
    pub name: &'static str,
    pub unit: &'static str,
    pub bound: Bound,
}

#[derive(Clone, Debug)]
pub(crate) struct Line<'a> {
    pub number: usize,
    pub keyword: &'a str,
    pub values: Vec<&'a str>,
}

#[derive(Clone, Debug)]
pub(crate) struct KeywordFile<'a> {
    file: &'a Path,
    pub lines: Vec<Line<'a>>,
    pub comments: Vec<&'a str>,
}

/// A finite decimal number.
pub(crate) fn number(text: &str) -> Option<f64> {
    parse_quantity(text, Dimension::NUMBER).ok()
}

/// The bound on the size of a number, in words, where this text is a number beyond it; else empty.
pub(crate) fn size_words(text: &str) -> &'static str {
    match parse_quantity(text, Dimension::NUMBER) {
        Err(QuantityError::TooLarge { .. }) => " of at most 1e60 in size",
        _ => "",
    }
}

impl<'a> KeywordFile<'a> {
    /// Refuses keywords that are unknown or stand twice.
    pub(crate) fn parse(file: &'a Path, text: &'a str, known: &[&'static str]) -> Result<KeywordFile<'a>, InputError> {
        let mut found = KeywordFile { file, lines: Vec::new(), comments: Vec::new() };
        for (index, line) in text.lines().enumerate() {
            let (words, comment) = line.split_once('#').unwrap_or((line, ""));
            if !comment.trim().is_empty() {
                found.comments.push(comment.trim());
            }
            let mut words = words.split_whitespace();
            let Some(keyword) = words.next() else { continue };
            let line = Line { number: index + 1, keyword, values: words.collect() };
            let problem = if !known.contains(&keyword) {
                let suggestion = closest(keyword, known.iter().copied());
                Problem::UnknownKey { suggestion, known: known.to_vec() }
            } else if let Some(first) = found.line(keyword) {
                Problem::Conflict { with: format!("line {}", first.number), remedy: "keep one of the two".into() }
            } else {
                found.lines.push(line);
                continue;
            };
            return Err(InputError {
                file: file.into(),
                line: Some(line.number),
                key: keyword.into(),
                problem: problem.into(),
            });
        }
        Ok(found)
    }

    pub(crate) fn line(&self, keyword: &str) -> Option<&Line<'a>> {
        self.lines.iter().find(|line| line.keyword == keyword)
    }

    pub(crate) fn error(&self, keyword: &str, problem: Problem) -> InputError {
        let line = self.line(keyword).map(|line| line.number);
        InputError { file: self.file.into(), line, key: keyword.into(), problem: problem.into() }
    }

    /// Exactly `count` numbers; `meaning` says which, for messages.
    pub(crate) fn numbers(
        &self,
        keyword: &Keyword,
        count: usize,
        meaning: &str,
    ) -> Result<Vec<Number<'a>>, InputError> {
        let Keyword { name, unit, bound } = *keyword;
        let expected = if unit.is_empty() { "number".to_owned() } else { format!("number [{unit}]") };
        let list = format!("{count} {}, {meaning}", expected.replace("number", "numbers"));
        let Some(line) = self.line(name) else {
            // Nothing to list, nothing missing.
            let remedy = format!("add a line `{name}` with {list}");
            return if count == 0 { Ok(Vec::new()) } else { Err(self.error(name, Problem::Missing { remedy })) };
        };
        if line.values.len() != count {
            let value = format!("a list of {}", line.values.len());
            return Err(self.error(name, Problem::Range { value, expected: list }));
        }
        let (holds, requirement): (fn(f64) -> bool, _) = match bound {
            Bound::Any => (|_| true, ""),
            Bound::NotNegative => (|value| value >= 0.0, ", not negative"),
            Bound::Positive => (|value| value > 0.0, ", greater than zero"),
        };
        let mut numbers = Vec::new();
        for text in &line.values {
            let Some(value) = number(text).filter(|value| holds(*value)) else {
                let value = format!("\"{}\"", short_name(text));
                let expected = format!("a {expected}{}{requirement}", size_words(text));
                return Err(self.error(name, Problem::Range { value, expected }));
            };
            numbers.push(Number { text, value });
        }
        Ok(numbers)
    }
}
