//! Tables of numbers as other programs write them: which line names the columns, what parts the cells, units in the heads,
//! decimal commas. The guide's page on tables lists the layouts.

use super::error::{InputError, Problem, table_error};
use super::units::{Dimension, QuantityError, parse_quantity};
use crate::files;
use std::borrow::Cow;
use std::path::Path;

/// A table as text. The first line that is no comment names the columns, or the comment before it.
pub(crate) struct TextTable<'a> {
    /// Line of the names, from 1.
    pub line: usize,
    pub heads: Vec<Head<'a>>,
    text: &'a str,
    separator: Separator,
    has_decimal_comma: bool,
    /// Whether lines end with a separator.
    is_trailing: bool,
}

/// Name of a column, and the unit beside it: `insertion [mm]`, `insertion (mm)`.
pub(crate) struct Head<'a> {
    pub name: &'a str,
    pub unit: Option<&'a str>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Separator {
    Character(char),
    Blanks,
}

/// Text of a file: UTF-8, or UTF-16 with a byte order mark, with whatever ends its lines.
pub(crate) fn read_table_text(file: &Path) -> Result<String, InputError> {
    let unreadable = |reason: String| table_error(file, None, "", Problem::Unreadable(reason));
    let bytes = files::read(file).map_err(|problem| unreadable(problem.to_string()))?;
    decode(bytes).map_err(|reason| unreadable(reason.into()))
}

/// Text of bytes: UTF-8, or UTF-16 with a byte order mark.
pub(crate) fn decode(bytes: Vec<u8>) -> Result<String, &'static str> {
    let wide = |of: fn([u8; 2]) -> u16| {
        let (pairs, rest) = bytes[2..].as_chunks::<2>();
        let units: Vec<u16> = pairs.iter().map(|pair| of(*pair)).collect();
        String::from_utf16(&units).ok().filter(|_| rest.is_empty()).ok_or("it is damaged UTF-16 text")
    };
    let text = match bytes[..] {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes)?,
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes)?,
        _ => String::from_utf8(bytes).map_err(|_| "it is neither UTF-8 nor UTF-16 text")?,
    };
    // Lines that end with a carriage return alone.
    Ok(if text.contains('\n') { text } else { text.replace('\r', "\n") })
}

impl<'a> TextTable<'a> {
    /// The table in a text; `None` where there is no line but comments. `example` is a column's name.
    ///
    /// # Errors
    ///
    /// No line names the columns.
    pub fn new(file: &Path, text: &'a str, example: &str) -> Result<Option<TextTable<'a>>, InputError> {
        let mut comments = Vec::new();
        let mut first = None;
        for (line, content) in lines(text) {
            match comment_text(content) {
                Some(words) => comments.push((line, words)),
                None => {
                    first = Some((line, content));
                    break;
                }
            }
        }
        let Some((line, content)) = first else { return Ok(None) };
        // No name of a column is a number.
        let has_number = |cells: &[&str]| cells.iter().any(|cell| is_number(cell));
        let separator = Separator::of(content);
        let cells = separator.cells(content);
        if !has_number(&cells) {
            return Ok(Some(TextTable::below(text, line, cells, separator, separator)));
        }
        let width = cells.len();
        let names = comments.into_iter().rev().find_map(|(line, words)| {
            let ways = [separator, Separator::of(words)].map(|by| (by.cells(words), by));
            let fits = |(names, by): &(Vec<&str>, Separator)| {
                (names.len() == width || heads_of(names, *by).len() == width) && !has_number(names)
            };
            ways.into_iter().find(fits).map(|(names, by)| (line, names, by))
        });
        match names {
            Some((line, names, by)) => Ok(Some(TextTable::below(text, line, names, by, separator))),
            None => {
                let remedy = format!("no line names the columns: write their names above, such as {example}");
                Err(table_error(file, Some(line), "", Problem::Missing { remedy }))
            }
        }
    }

    /// The table in a text whose columns have no names but these; `None` where its first line is no row of so many numbers.
    pub fn unnamed(text: &'a str, names: &[&'static str]) -> Option<TextTable<'a>> {
        let (line, content) = lines(text).find(|(_, content)| comment_text(content).is_none())?;
        let separator = Separator::of(content);
        let cells = separator.cells(content);
        let is_row = cells.len() == names.len() && cells.iter().all(|cell| is_number(cell) || is_gap(cell));
        is_row.then(|| TextTable::below(text, line - 1, names.to_vec(), Separator::Character(','), separator))
    }

    /// Rows below the line whose cells name the columns.
    fn below(
        text: &'a str,
        line: usize,
        mut cells: Vec<&'a str>,
        by: Separator,
        separator: Separator,
    ) -> TextTable<'a> {
        let is_trailing = cells.len() > 1 && cells.last().is_some_and(|last| last.is_empty());
        if is_trailing {
            cells.pop();
        }
        let heads = heads_of(&cells, by);
        // One column has no separator: a blank stands before a unit.
        let separator = if heads.len() == 1 { Separator::Character(',') } else { separator };
        let rows = lines(text).filter(|(at, _)| *at > line).map(|(_, content)| content);
        let has_decimal_comma = separator != Separator::Character(',') && {
            let (mut comma, mut point) = (false, false);
            rows.for_each(|row| (comma, point) = (comma || row.contains(','), point || row.contains('.')));
            comma && !point
        };
        TextTable { line, heads, text, separator, has_decimal_comma, is_trailing }
    }

    /// Lines below the names with their numbers from 1, and their cells: as many as there are names.
    pub fn rows(&self, file: &Path) -> impl Iterator<Item = Result<(usize, Vec<&'a str>), InputError>> {
        let rows = lines(self.text).filter(|(line, content)| *line > self.line && comment_text(content).is_none());
        rows.map(move |(line, content)| {
            let mut cells = self.separator.cells(content);
            let expected = self.heads.len();
            if self.is_trailing && cells.len() == expected + 1 && cells[expected].is_empty() {
                cells.pop();
            }
            if cells.len() == expected {
                return Ok((line, cells));
            }
            Err(table_error(file, Some(line), "", Problem::Columns { found: cells.len(), expected }))
        })
    }

    /// Value of a cell in SI; a number alone has the unit of its column's head.
    pub fn quantity(&self, head: &Head, cell: &str, dimension: Dimension) -> Result<f64, QuantityError> {
        let cell = self.plain(cell);
        match head.unit {
            Some(unit) if is_number(&cell) => parse_quantity(&format!("{cell} {unit}"), dimension),
            _ => parse_quantity(&cell, dimension),
        }
    }

    /// A cell that is a number without a unit.
    pub fn number(&self, cell: &str) -> Option<f64> {
        cell.parse().ok().or_else(|| self.plain(cell).parse().ok())
    }

    /// A cell with a decimal point, and an exponent after `e`.
    fn plain<'c>(&self, cell: &'c str) -> Cow<'c, str> {
        let exponent = |at: usize| {
            let before = cell[..at].ends_with(|c: char| c.is_ascii_digit() || c == '.');
            let after = cell[at + 1..].trim_start_matches(['+', '-']);
            before && after.starts_with(|c: char| c.is_ascii_digit())
        };
        let comma = self.has_decimal_comma && cell.contains(',');
        let fortran = cell.find(['D', 'd']).filter(|at| exponent(*at));
        match (comma, fortran) {
            (false, None) => cell.into(),
            (true, None) => cell.replace(',', ".").into(),
            (_, Some(at)) => {
                let text = format!("{}e{}", &cell[..at], &cell[at + 1..]);
                if comma { text.replace(',', ".").into() } else { text.into() }
            }
        }
    }
}

impl<'a> Head<'a> {
    fn new(cell: &'a str) -> Head<'a> {
        let alone = Head { name: cell, unit: None };
        let Some(start) = cell.find(['[', '(']) else { return alone };
        // A bracket right behind a name, such as that of an index or a function, belongs to the name.
        let (name, unit) = cell.split_at(start);
        let is_apart = unit.starts_with('[') || name.ends_with(char::is_whitespace);
        match unit_alone(unit).filter(|_| is_apart && !name.trim().is_empty()) {
            Some(unit) => Head { name: name.trim(), unit: Some(unit) },
            None => alone,
        }
    }

    /// Whether other programs write it for the number of a row: pandas, `sample` of our own.
    pub fn is_index(name: &str) -> bool {
        matches!(name, "" | "sample") || name.starts_with("__index_level_") || name.starts_with("Unnamed: ")
    }
}

impl Separator {
    /// The separator of a line: a semicolon, else a tab, else a comma, else blanks.
    fn of(line: &str) -> Separator {
        let character = [';', '\t', ','].into_iter().find(|separator| line.contains(*separator));
        match character {
            Some(separator) => Separator::Character(separator),
            None if line.split_whitespace().nth(1).is_some() => Separator::Blanks,
            None => Separator::Character(','),
        }
    }

    /// Cells of a line without the blanks and quotes around them.
    fn cells(self, line: &str) -> Vec<&str> {
        match self {
            Separator::Blanks => line.split_whitespace().map(bare).collect(),
            Separator::Character(separator) => line.split(separator).map(bare).collect(),
        }
    }
}

/// Names of columns with their units.
fn heads_of<'a>(cells: &[&'a str], by: Separator) -> Vec<Head<'a>> {
    let mut heads: Vec<Head> = Vec::new();
    for cell in cells {
        match heads.last_mut() {
            // Between blanks the unit is a cell of its own.
            Some(head) if by == Separator::Blanks && head.unit.is_none() && unit_alone(cell).is_some() => {
                head.unit = unit_alone(cell);
            }
            _ => heads.push(Head::new(cell)),
        }
    }
    heads
}

fn bare(cell: &str) -> &str {
    cell.trim().trim_matches('"')
}

/// Lines that are not empty, without the blanks around them, with their numbers from 1.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    lines.filter(|(_, line)| !line.is_empty())
}

/// The words of the comment lines with their numbers from 1.
pub(crate) fn comments(text: &str) -> impl Iterator<Item = (usize, &str)> {
    lines(text).filter_map(|(line, content)| Some((line, comment_text(content)?)))
}

/// Whether a cell says that there is no value: it is empty, or a word such as `nan`.
pub(crate) fn is_gap(cell: &str) -> bool {
    cell.is_empty()
        || ["nan", "na", "n/a", "null", "-nan", "-nan(ind)"].iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// The words of a comment line; `None` where the line is no comment.
fn comment_text(line: &str) -> Option<&str> {
    line.starts_with(['#', '%']).then(|| line.trim_start_matches(['#', '%']).trim())
}

/// The unit that a text in brackets holds; `None` where it holds a number, which is an index.
fn unit_alone(text: &str) -> Option<&str> {
    let inner = [('[', ']'), ('(', ')')]
        .into_iter()
        .find_map(|(open, close)| text.trim().strip_prefix(open).and_then(|rest| rest.strip_suffix(close)))?;
    let inner = inner.trim();
    (!inner.is_empty() && inner.parse::<f64>().is_err()).then_some(inner)
}

/// Whether a cell is a number without a unit, whatever its decimal sign and the letter of its exponent.
fn is_number(cell: &str) -> bool {
    let plain = cell.trim().replace(',', ".").replace(['D', 'd'], "e");
    plain.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) && plain.parse::<f64>().is_ok()
}
