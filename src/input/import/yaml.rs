//! As much YAML as calibrations are written in: maps and lists by indentation, scalars, lists in brackets.

use crate::model::short_name;
use std::collections::BTreeMap;

/// A value and the line that it begins in, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Node {
    Map(usize, BTreeMap<String, Node>),
    List(usize, Vec<Node>),
    /// Empty where nothing or `~` stands.
    Scalar(usize, String),
}

impl Node {
    pub(super) fn line(&self) -> Option<usize> {
        match self {
            Node::Map(line, _) | Node::List(line, _) | Node::Scalar(line, _) => Some(*line),
        }
    }

    pub(super) fn get(&self, name: &str) -> Option<&Node> {
        match self {
            Node::Map(_, entries) => entries.get(name),
            _ => None,
        }
    }

    /// Names of the entries of a map.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        let entries = if let Node::Map(_, entries) = self { Some(entries) } else { None };
        entries.into_iter().flat_map(BTreeMap::keys).map(String::as_str)
    }

    pub(super) fn list(&self) -> Option<&[Node]> {
        if let Node::List(_, nodes) = self { Some(nodes) } else { None }
    }

    pub(super) fn text(&self) -> Option<&str> {
        if let Node::Scalar(_, text) = self { Some(text.as_str()).filter(|text| !text.is_empty()) } else { None }
    }

    /// The first number that is finite and larger than this: its line and its text.
    pub(super) fn number_beyond(&self, largest: f64) -> Option<(usize, &str)> {
        match self {
            Node::Map(_, entries) => entries.values().filter_map(|node| node.number_beyond(largest)).min(),
            Node::List(_, nodes) => nodes.iter().find_map(|node| node.number_beyond(largest)),
            Node::Scalar(line, text) => {
                let number = text.parse::<f64>().ok().filter(|x| x.is_finite() && x.abs() > largest);
                number.map(|_| (*line, text.as_str()))
            }
        }
    }

    /// Finite numbers of a list; none where nothing stands.
    pub(super) fn numbers(&self) -> Option<Vec<f64>> {
        match self {
            Node::Scalar(_, text) if text.is_empty() => Some(Vec::new()),
            Node::List(_, nodes) => {
                let number = |node: &Node| node.text()?.parse::<f64>().ok().filter(|x| x.is_finite());
                nodes.iter().map(number).collect()
            }
            _ => None,
        }
    }
}

struct Line<'a> {
    number: usize,
    indent: usize,
    text: &'a str,
}

/// A mistake: its line and what is wrong.
type Mistake = (usize, String);

/// Nested blocks at most.
const DEEPEST: usize = 32;

pub(super) fn parse(text: &str) -> Result<Node, Mistake> {
    let mut lines = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = without_comment(line);
        let trimmed = content.trim();
        if trimmed.is_empty() || trimmed == "---" || trimmed.starts_with('%') {
            continue;
        }
        if trimmed == "..." {
            break;
        }
        let indent = content.len() - content.trim_start().len();
        if content[..indent].contains('\t') {
            return Err((index + 1, "it is indented by tabs, which YAML forbids: use blanks".into()));
        }
        lines.push(Line { number: index + 1, indent, text: trimmed });
    }
    let mut at = 0;
    let indent = lines.first().map_or(0, |line| line.indent);
    let node = block(&mut lines, &mut at, indent, 0)?;
    match lines.get(at) {
        None => Ok(node),
        Some(line) => Err((line.number, "the line is indented otherwise than those around it".into())),
    }
}

/// A line up to a `#` that begins a comment.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let mut before = ' ';
    for (at, c) in line.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            Some(_) => {}
            None if c == '"' || c == '\'' => quote = Some(c),
            None if c == '#' && before.is_whitespace() => return &line[..at],
            None => {}
        }
        before = c;
    }
    line
}

/// The lines of one indentation, and what is indented further below each.
fn block(lines: &mut [Line], at: &mut usize, indent: usize, depth: usize) -> Result<Node, Mistake> {
    let Some(first) = lines.get(*at) else { return Ok(Node::Scalar(1, String::new())) };
    let number = first.number;
    if depth > DEEPEST {
        return Err((number, "it is nested too deeply".into()));
    }
    let is_item = |line: &Line| line.text == "-" || line.text.starts_with("- ");
    if is_item(first) {
        let mut nodes = Vec::new();
        while let Some(line) = lines.get_mut(*at).filter(|line| line.indent == indent && is_item(line)) {
            let rest = line.text[1..].trim_start();
            if rest.is_empty() {
                let number = line.number;
                *at += 1;
                nodes.push(below(lines, at, indent, number, depth)?);
            } else if rest.starts_with("- ") || key(rest).is_some() {
                // The item is a block that begins in this line.
                (line.indent, line.text) = (indent + line.text.len() - rest.len(), rest);
                let inner = line.indent;
                nodes.push(block(lines, at, inner, depth + 1)?);
            } else {
                nodes.push(scalar(rest, line.number)?);
                *at += 1;
            }
        }
        return Ok(Node::List(number, nodes));
    }
    let mut entries = BTreeMap::new();
    while let Some(line) = lines.get(*at).filter(|line| line.indent == indent && !is_item(line)) {
        let number = line.number;
        let (name, rest) =
            key(line.text).ok_or((number, "the line is neither `name: value` nor `- value`".to_owned()))?;
        if entries.contains_key(name) {
            return Err((number, format!("`{}` is given twice: drop one", short_name(name))));
        }
        let name = name.to_owned();
        *at += 1;
        let node = if rest.is_empty() { below(lines, at, indent, number, depth)? } else { scalar(rest, number)? };
        entries.insert(name, node);
    }
    Ok(Node::Map(number, entries))
}

/// The block below a name: lines that are indented further, or items of a list at the same place.
fn below(lines: &mut [Line], at: &mut usize, indent: usize, number: usize, depth: usize) -> Result<Node, Mistake> {
    match lines.get(*at) {
        Some(line) if line.indent > indent => {
            let inner = line.indent;
            block(lines, at, inner, depth + 1)
        }
        Some(line) if line.indent == indent && line.text.starts_with("- ") && !is_item_before(lines, *at, indent) => {
            block(lines, at, indent, depth + 1)
        }
        _ => Ok(Node::Scalar(number, String::new())),
    }
}

/// Whether the line before is an item of the same list.
fn is_item_before(lines: &[Line], at: usize, indent: usize) -> bool {
    at > 0 && lines[at - 1].indent == indent && (lines[at - 1].text == "-" || lines[at - 1].text.starts_with("- "))
}

/// Name and value of `name: value`.
fn key(text: &str) -> Option<(&str, &str)> {
    if text.starts_with(['[', '"', '\'']) && !text.contains(": ") && !text.ends_with(':') {
        return None;
    }
    let (name, rest) = match text.strip_suffix(':') {
        Some(name) if !name.contains(": ") => (name, ""),
        _ => text.split_once(": ")?,
    };
    Some((bare(name), rest.trim()))
}

fn scalar(text: &str, line: usize) -> Result<Node, Mistake> {
    if let Some(inner) = text.strip_prefix('[') {
        let inner = inner.strip_suffix(']').ok_or((line, "a list in brackets has to end in its line".to_owned()))?;
        let parts = inner.split(',').map(str::trim).filter(|part| !part.is_empty());
        return Ok(Node::List(line, parts.map(|part| Node::Scalar(line, bare(part).into())).collect()));
    }
    if text.starts_with(['{', '&', '*', '|', '>', '!']) {
        return Err((
            line,
            format!("`{}` is YAML that is not read: write lists and maps line by line", short_name(text)),
        ));
    }
    let text = bare(text);
    Ok(Node::Scalar(line, if matches!(text, "~" | "null") { String::new() } else { text.into() }))
}

fn bare(text: &str) -> &str {
    let text = text.trim();
    let quoted = ['"', '\''].into_iter().find_map(|quote| text.strip_prefix(quote)?.strip_suffix(quote));
    quoted.unwrap_or(text)
}
