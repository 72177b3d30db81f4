//! Joins shader pieces into one WGSL source that knows the origin of each line.
//!
//! Directives:
//! `//@if NAME`, `//@if !NAME`, `//@else`, `//@end`: keep or drop lines by a named term.
//! `const NAME: T = value; //@spec`: the value of this specialisation instead.
//! `for (var i = A; i < B; i++) { //@unroll` ... `} //@end`: one copy of the body, in braces, for each value of i.
//! `//@unroll NAME`: the same where this term holds, else the loop as it is written.
//! `//@repeat i COUNT` ... `//@end`: the same for declarations, without braces, for i from 0 below COUNT.
//! In f64 every `f32` is an `f64`, literals included.
//! In a copy the word `i` is a literal, and `name_i` is `name_3`; `//@if NAME[i]` asks for the term `NAME[3]`.

use super::specialise::{Piece, Specialisation, Value};
use super::substitute::{Bound, in_f64, substitute, substitute_plain};
use crate::backend::Precision;
use std::borrow::Cow;
use std::ops::Range;

/// Complete WGSL, each line with its origin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// WGSL.
    pub text: String,
    names: Vec<Cow<'static, str>>,
    /// Piece and line of each line of the text.
    origins: Vec<(usize, usize)>,
}

/// A directive that cannot be followed, at its place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{piece}:{line}: {kind}")]
#[non_exhaustive]
pub struct EmitError {
    /// Name of the piece.
    pub piece: String,
    /// From 1.
    pub line: usize,
    /// What is wrong.
    pub kind: EmitErrorKind,
}

/// What is wrong with a directive.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each message says it")]
pub enum EmitErrorKind {
    #[error("no directive is named `{0}`")]
    UnknownDirective(String),
    #[error("no term is named `{0}`")]
    UnknownTerm(String),
    #[error("no constant is named `{0}`")]
    UnknownConstant(String),
    #[error("this block has no `//@end`")]
    NoEnd,
    #[error("`{0}` stands outside a block")]
    Stray(&'static str),
    #[error("`//@spec` needs `const NAME: T = value;`")]
    BadConstant,
    #[error("`//@unroll` needs `for (var i = A; i < B; i++) {{`, A and B literals or constants")]
    BadLoop,
    #[error("`//@repeat` needs a name and a count, a literal or a constant")]
    BadRepeat,
}

impl Source {
    /// Piece and line, from 1, of a line of the text, from 1.
    pub fn origin(&self, line: usize) -> Option<(&str, usize)> {
        let (piece, line) = *self.origins.get(line.checked_sub(1)?)?;
        Some((&self.names[piece], line))
    }
}

/// Joins pieces, in order, into one source.
pub fn emit(pieces: &[Piece], specialisation: &Specialisation) -> Result<Source, EmitError> {
    let mut source = Source::default();
    for (index, piece) in pieces.iter().enumerate() {
        source.names.push(piece.name.clone());
        let lines: Vec<&str> = piece.text.lines().collect();
        let mut emitter = Emitter { lines: &lines, piece: index, specialisation, source: &mut source };
        let at = |(line, kind): Trouble| EmitError { piece: piece.name.to_string(), line: line + 1, kind };
        emitter.block(0..lines.len(), &mut Vec::new()).map_err(at)?;
    }
    Ok(source)
}

/// Line, from 0, and what is wrong there.
type Trouble = (usize, EmitErrorKind);

fn unknown_term(name: &str, at: usize) -> Trouble {
    (at, EmitErrorKind::UnknownTerm(name.into()))
}

struct Emitter<'a> {
    lines: &'a [&'a str],
    piece: usize,
    specialisation: &'a Specialisation,
    source: &'a mut Source,
}

impl Emitter<'_> {
    fn block(&mut self, range: Range<usize>, bounds: &mut Vec<Bound>) -> Result<(), Trouble> {
        let mut at = range.start;
        while at < range.end {
            let line = self.lines[at];
            let Some((code, directive)) = line.split_once("//@") else {
                self.push(substitute(line, bounds), at);
                at += 1;
                continue;
            };
            match directive.split_whitespace().next() {
                Some("if") => {
                    let (middle, end) = self.find_end(at, range.end)?;
                    let name = substitute_plain(directive.trim_start_matches("if").trim(), bounds);
                    if self.holds(&name).ok_or_else(|| unknown_term(&name, at))? {
                        self.block(at + 1..middle.unwrap_or(end), bounds)?;
                    } else if let Some(middle) = middle {
                        self.block(middle + 1..end, bounds)?;
                    }
                    at = end;
                }
                Some("unroll") => {
                    let (_, end) = self.find_end(at, range.end)?;
                    let (name, values, suffix) = self.parse_loop(&substitute(code, bounds), at)?;
                    let term = directive.trim_start_matches("unroll").trim();
                    let is_unrolled = term.is_empty() || self.holds(term).ok_or_else(|| unknown_term(term, at))?;
                    if !is_unrolled {
                        self.push(substitute(code.trim_end(), bounds), at);
                        self.block(at + 1..end, bounds)?;
                        self.push("}".into(), end);
                        at = end + 1;
                        continue;
                    }
                    for value in values {
                        bounds.push(Bound { name: name.clone(), value, suffix });
                        self.push(format!("{{ // {name} = {value}"), at);
                        self.block(at + 1..end, bounds)?;
                        self.push("}".into(), end);
                        bounds.pop();
                    }
                    at = end;
                }
                Some("repeat") => {
                    let (_, end) = self.find_end(at, range.end)?;
                    let words: Vec<&str> = directive.split_whitespace().collect();
                    let [_, name, count] = words[..] else { return Err((at, EmitErrorKind::BadRepeat)) };
                    let (count, suffix) = self.bound(count).ok_or((at, EmitErrorKind::BadRepeat))?;
                    for value in 0..count {
                        bounds.push(Bound { name: name.into(), value, suffix });
                        self.block(at + 1..end, bounds)?;
                        bounds.pop();
                    }
                    at = end;
                }
                Some("spec") => {
                    let text = self.specialise(code, at)?;
                    self.push(text, at);
                }
                Some("else") => return Err((at, EmitErrorKind::Stray("//@else"))),
                Some("end") => return Err((at, EmitErrorKind::Stray("//@end"))),
                other => return Err((at, EmitErrorKind::UnknownDirective(other.unwrap_or_default().into()))),
            }
            at += 1;
        }
        Ok(())
    }

    fn push(&mut self, text: String, line: usize) {
        let text = match self.specialisation.precision {
            Precision::F32 => text,
            Precision::F64 => in_f64(&text),
        };
        self.source.text.push_str(&text);
        self.source.text.push('\n');
        self.source.origins.push((self.piece, line + 1));
    }

    /// The `//@else` and the `//@end` of the block that starts at `start`.
    fn find_end(&self, start: usize, limit: usize) -> Result<(Option<usize>, usize), Trouble> {
        let (mut depth, mut middle) = (0, None);
        for at in start..limit {
            let directive = self.lines[at].split_once("//@").and_then(|(_, rest)| rest.split_whitespace().next());
            match directive {
                Some("if" | "unroll" | "repeat") => depth += 1,
                Some("else") if depth == 1 => middle = Some(at),
                Some("end") if depth == 1 => return Ok((middle, at)),
                Some("end") => depth -= 1,
                _ => {}
            }
        }
        Err((start, EmitErrorKind::NoEnd))
    }

    fn holds(&self, name: &str) -> Option<bool> {
        match name.strip_prefix('!') {
            Some(name) => self.specialisation.terms.get(name).map(|holds| !holds),
            None => self.specialisation.terms.get(name).copied(),
        }
    }

    fn specialise(&self, code: &str, at: usize) -> Result<String, Trouble> {
        let bad = || (at, EmitErrorKind::BadConstant);
        let (name, _) =
            code.trim().strip_prefix("const ").and_then(|rest| rest.split_once([':', '='])).ok_or_else(bad)?;
        let name = name.trim();
        let unknown = || (at, EmitErrorKind::UnknownConstant(name.into()));
        let value = self.specialisation.constants.get(name).ok_or_else(unknown)?;
        let precision = self.specialisation.precision;
        Ok(format!("const {name}: {} = {};", value.wgsl_type(precision), value.wgsl(precision)))
    }

    /// Variable, values and literal suffix of `for (var i = A; i < B; i++) {`.
    fn parse_loop(&self, code: &str, at: usize) -> Result<(String, Range<u32>, &'static str), Trouble> {
        let parse = || {
            let head = code.trim().strip_prefix("for")?.trim().strip_prefix('(')?;
            let (head, _) = head.rsplit_once(')').filter(|(_, brace)| brace.trim() == "{")?;
            let [init, test, step] = head.split(';').collect::<Vec<_>>().try_into().ok()?;
            let (name, first) = init.trim().strip_prefix("var ")?.split_once('=')?;
            let name = name.split(':').next()?.trim();
            let (tested, last) = test.split_once('<')?;
            let stepped = step.trim().strip_suffix("++")?;
            if tested.trim() != name || stepped.trim() != name {
                return None;
            }
            let (first, suffix) = self.bound(first.trim())?;
            let (last, _) = self.bound(last.trim())?;
            Some((name.to_owned(), first..last, suffix))
        };
        parse().ok_or((at, EmitErrorKind::BadLoop))
    }

    /// An integer literal or a constant, and the suffix of its type.
    fn bound(&self, text: &str) -> Option<(u32, &'static str)> {
        if let Some(Value::U32(value)) = self.specialisation.constants.get(text) {
            return Some((*value, "u"));
        }
        match text.strip_suffix('u') {
            Some(digits) => Some((digits.parse().ok()?, "u")),
            None => Some((text.parse().ok()?, "")),
        }
    }
}
