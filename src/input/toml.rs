//! Typed access to a TOML file in which every mistake is reported with file, line and key.

use super::error::{InputError, Problem};
use super::units::{Dimension, LARGEST, parse_quantity};
use crate::model::{Vector, closest, short_number};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml_edit::{Array, Document, Item, TableLike, Value};

/// First words of the keys that make a scene, alone or in a sweep.
const OF_SCENES: [&str; 11] =
    ["scene", "base", "field", "magnet", "coil_array", "field_map", "loads", "wall", "segment", "model", "insertion"];

/// A parsed file and the line of each of its keys.
pub struct Source {
    pub(super) file: PathBuf,
    pub(super) document: Document<String>,
    lines: BTreeMap<String, usize>,
}

/// One table of a file. Values are `None` where their key is not there.
#[derive(Clone)]
pub struct Reader<'a> {
    source: &'a Source,
    table: &'a dyn TableLike,
    path: String,
}

impl Source {
    /// Parses the text of a file; `file` names it in messages.
    ///
    /// # Errors
    ///
    /// A text that is no TOML.
    pub fn parse(file: &Path, text: &str) -> Result<Source, InputError> {
        let starts = LineStarts::of(text);
        let document = Document::parse(text.to_owned()).map_err(|error| InputError {
            file: file.into(),
            line: error.span().map(|span| starts.line_of(span.start)),
            key: String::new(),
            problem: Problem::Syntax(error.message().trim().replace('\n', ", ")).into(),
        })?;
        let mut lines = BTreeMap::new();
        index_table(&starts, document.as_table(), "", &mut lines);
        Ok(Source { file: file.into(), document, lines })
    }

    /// The table that is the whole file.
    pub fn root(&self) -> Reader<'_> {
        Reader { source: self, table: self.document.as_table(), path: String::new() }
    }

    /// Line of a key, or of the nearest table around it.
    pub fn line(&self, key: &str) -> Option<usize> {
        let mut key = key;
        loop {
            if let Some(line) = self.lines.get(key) {
                return Some(*line);
            }
            key = &key[..key.rfind(['.', '['])?];
        }
    }

    /// Whether the file has a key, by its full path such as `axis[0].points`.
    pub(crate) fn contains(&self, key: &str) -> bool {
        self.lines.contains_key(key)
    }

    /// A mistake at a key, by its full path.
    pub fn error(&self, key: impl Into<String>, problem: impl Into<Problem>) -> InputError {
        let key = key.into();
        InputError { file: self.file.clone(), line: self.line(&key), key, problem: Box::new(problem.into()) }
    }
}

/// Where the lines of a text begin, the first aside: a line is found by search, whatever the length of the text.
struct LineStarts(Vec<usize>);

impl LineStarts {
    fn of(text: &str) -> LineStarts {
        LineStarts(text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1).collect())
    }

    fn line_of(&self, at: usize) -> usize {
        1 + self.0.partition_point(|start| *start <= at)
    }
}

fn index_table(starts: &LineStarts, table: &dyn TableLike, path: &str, lines: &mut BTreeMap<String, usize>) {
    for (name, item) in table.iter() {
        let key = join(path, name);
        let span = table.key(name).and_then(|key| key.span()).or_else(|| item.span());
        if let Some(span) = span {
            lines.insert(key.clone(), starts.line_of(span.start));
        }
        if let Some(inner) = item.as_table_like() {
            index_table(starts, inner, &key, lines);
        } else if let Some(tables) = item.as_array_of_tables() {
            for (index, inner) in tables.iter().enumerate() {
                let key = format!("{key}[{index}]");
                if let Some(span) = inner.span() {
                    lines.insert(key.clone(), starts.line_of(span.start));
                }
                index_table(starts, inner, &key, lines);
            }
        } else if let Some(array) = item.as_array() {
            index_array(starts, array, &key, lines);
        }
    }
}

fn index_array(starts: &LineStarts, array: &Array, path: &str, lines: &mut BTreeMap<String, usize>) {
    for (index, value) in array.iter().enumerate() {
        let key = format!("{path}[{index}]");
        if let Some(span) = value.span() {
            lines.insert(key.clone(), starts.line_of(span.start));
        }
        match value {
            Value::InlineTable(table) => index_table(starts, table, &key, lines),
            Value::Array(array) => index_array(starts, array, &key, lines),
            _ => {}
        }
    }
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

impl<'a> Reader<'a> {
    /// The file that the table is of.
    pub fn source(&self) -> &'a Source {
        self.source
    }

    /// Full path of a key of this table; of the table itself for an empty name.
    pub fn key(&self, name: &str) -> String {
        if name.is_empty() { self.path.clone() } else { join(&self.path, name) }
    }

    /// A mistake at a key of this table.
    pub fn error(&self, name: &str, problem: impl Into<Problem>) -> InputError {
        self.source.error(self.key(name), problem)
    }

    /// The mistake that a key of this table is not there.
    pub fn missing(&self, name: &str, remedy: impl Into<String>) -> InputError {
        self.error(name, Problem::Missing { remedy: remedy.into() })
    }

    /// Whether the table has a key.
    pub fn has(&self, name: &str) -> bool {
        self.table.contains_key(name)
    }

    /// Every key of the table, in the order of the file.
    pub(crate) fn names(&self) -> Vec<String> {
        self.table.iter().map(|(name, _)| name.to_owned()).collect()
    }

    /// Refuses every key that is not in the list.
    ///
    /// # Errors
    ///
    /// The first unknown key, with the known one that is spelled nearly so.
    pub fn check_keys(&self, known: &[&'static str]) -> Result<(), InputError> {
        let Some((name, _)) = self.table.iter().find(|(name, _)| !known.contains(name)) else { return Ok(()) };
        let suggestion = closest(name, known.iter().copied());
        Err(self.error(name, Problem::UnknownKey { suggestion, known: known.to_vec() }))
    }

    fn wrong_type(&self, name: &str, expected: impl Into<String>, item: &Item) -> InputError {
        self.error(name, Problem::Type { expected: expected.into(), found: type_words(item.type_name()) })
    }

    /// A number (SI) or a string with a unit of the dimension of `unit`.
    ///
    /// # Errors
    ///
    /// A value of another type, with another dimension, or not finite.
    pub fn quantity(&self, name: &str, unit: &str) -> Result<Option<f64>, InputError> {
        self.table.get(name).map(|item| self.item_quantity(name, item.as_value(), item, unit)).transpose()
    }

    fn item_quantity(&self, name: &str, value: Option<&Value>, item: &Item, unit: &str) -> Result<f64, InputError> {
        let dimension = Dimension::of(unit);
        let words = || format!("{} such as {}", dimension.name(), dimension.example());
        let number = match value {
            Some(Value::Float(number)) => *number.value(),
            Some(Value::Integer(number)) => *number.value() as f64,
            Some(Value::String(text)) => {
                return parse_quantity(text.value(), dimension).map_err(|error| self.error(name, error));
            }
            Some(other) => {
                let found = type_words(other.type_name());
                return Err(self.error(name, Problem::Type { expected: words(), found }));
            }
            None => return Err(self.wrong_type(name, words(), item)),
        };
        // A scene checks its own numbers, and says it in its own words.
        let is_of_scene = || self.key(name).split(['.', '[']).next().is_some_and(|key| OF_SCENES.contains(&key));
        if number.abs() <= LARGEST || number.is_finite() && is_of_scene() {
            return Ok(number);
        }
        let bound = if number.is_finite() { "a number of at most 1e60 in size" } else { "a finite number" };
        Err(self
            .error(name, Problem::Range { value: format!("{number:e}"), expected: format!("{bound}, {}", words()) }))
    }

    /// Three quantities along x, y, z.
    pub(crate) fn vector(&self, name: &str, unit: &str) -> Result<Option<Vector>, InputError> {
        self.components(name, "three values along x, y, z", unit)
    }

    /// Two quantities along x, y.
    pub(crate) fn pair(&self, name: &str, unit: &str) -> Result<Option<[f64; 2]>, InputError> {
        self.components(name, "two values along x, y", unit)
    }

    fn components<const N: usize>(&self, name: &str, words: &str, unit: &str) -> Result<Option<[f64; N]>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        let expected = || format!("{words}, each {}", Dimension::of(unit).name());
        let Some(array) = item.as_array() else { return Err(self.wrong_type(name, expected(), item)) };
        if array.len() != N {
            let value = format!("a list of {}", array.len());
            return Err(self.error(name, Problem::Range { value, expected: expected() }));
        }
        let mut components = [0.0; N];
        for (index, value) in array.iter().enumerate() {
            components[index] = self.item_quantity(&format!("{name}[{index}]"), Some(value), item, unit)?;
        }
        Ok(Some(components))
    }

    pub(crate) fn quantities(&self, name: &str, unit: &str) -> Result<Option<Vec<f64>>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        let wrong = || self.wrong_type(name, format!("a list, each {}", Dimension::of(unit).name()), item);
        let array = item.as_array().ok_or_else(wrong)?;
        let of = |(k, value): (usize, &Value)| self.item_quantity(&format!("{name}[{k}]"), Some(value), item, unit);
        array.iter().enumerate().map(of).collect::<Result<_, _>>().map(Some)
    }

    /// Three rows of three quantities.
    pub(crate) fn matrix(&self, name: &str, unit: &str) -> Result<Option<[Vector; 3]>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        let wrong = || self.wrong_type(name, "three rows of three values", item);
        let array = item.as_array().ok_or_else(wrong)?;
        if array.len() != 3 {
            let value = format!("a list of {}", array.len());
            return Err(self.error(name, Problem::Range { value, expected: "three rows of three values".into() }));
        }
        let mut rows = [[0.0; 3]; 3];
        for (r, row) in array.iter().enumerate() {
            let row = row.as_array().filter(|row| row.len() == 3).ok_or_else(wrong)?;
            for (c, value) in row.iter().enumerate() {
                rows[r][c] = self.item_quantity(&format!("{name}[{r}][{c}]"), Some(value), item, unit)?;
            }
        }
        Ok(Some(rows))
    }

    /// A text in quotes.
    ///
    /// # Errors
    ///
    /// A value of another type.
    pub fn string(&self, name: &str) -> Result<Option<&'a str>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        item.as_str().map(Some).ok_or_else(|| self.wrong_type(name, "a text in quotes", item))
    }

    /// `true` or `false`.
    ///
    /// # Errors
    ///
    /// A value of another type.
    pub fn boolean(&self, name: &str) -> Result<Option<bool>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        item.as_bool().map(Some).ok_or_else(|| self.wrong_type(name, "true or false", item))
    }

    /// A whole number of at least `least`; a float without fraction such as 1e6 counts.
    pub fn count(&self, name: &str, least: u64) -> Result<Option<u64>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        let expected = || format!("a whole number of at least {least}");
        let number = match (item.as_integer(), item.as_float()) {
            (Some(number), _) => i128::from(number),
            (None, Some(number)) if number.fract() == 0.0 && number.abs() < 1.8e19 => number as i128,
            (None, Some(number)) => {
                return Err(self.error(name, Problem::Range { value: short_number(number), expected: expected() }));
            }
            _ => return Err(self.wrong_type(name, expected(), item)),
        };
        match u64::try_from(number) {
            Ok(number) if number >= least => Ok(Some(number)),
            _ => Err(self.error(name, Problem::Range { value: number.to_string(), expected: expected() })),
        }
    }

    /// A list of whole numbers of at least `least`.
    ///
    /// # Errors
    ///
    /// A value of another type, or a smaller number.
    pub fn counts(&self, name: &str, least: u64) -> Result<Option<Vec<u64>>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        let wrong = || self.wrong_type(name, format!("a list of whole numbers of at least {least}"), item);
        let array = item.as_array().ok_or_else(wrong)?;
        let number = |value: &Value| value.as_integer().and_then(|n| u64::try_from(n).ok()).filter(|n| *n >= least);
        array.iter().map(|value| number(value).ok_or_else(wrong)).collect::<Result<_, _>>().map(Some)
    }

    /// A list of texts.
    ///
    /// # Errors
    ///
    /// A value of another type.
    pub fn strings(&self, name: &str) -> Result<Option<Vec<&'a str>>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        let wrong = || self.wrong_type(name, "a list of texts in quotes", item);
        let array = item.as_array().ok_or_else(wrong)?;
        array.iter().map(|value| value.as_str().ok_or_else(wrong)).collect::<Result<_, _>>().map(Some)
    }

    /// A table inside this one.
    ///
    /// # Errors
    ///
    /// A value of another type.
    pub fn table(&self, name: &str) -> Result<Option<Reader<'a>>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(None) };
        match item.as_table_like() {
            Some(table) => Ok(Some(Reader { source: self.source, table, path: self.key(name) })),
            None => Err(self.wrong_type(name, format!("a table: [{}] or {{ ... }}", self.key(name)), item)),
        }
    }

    /// A list of tables: `[[name]]` blocks, or inline tables in a list.
    pub(crate) fn tables(&self, name: &str) -> Result<Vec<Reader<'a>>, InputError> {
        let Some(item) = self.table.get(name) else { return Ok(Vec::new()) };
        let wrong = || self.wrong_type(name, format!("[[{}]] blocks", self.key(name)), item);
        let reader = |(index, table): (usize, &'a dyn TableLike)| Reader {
            source: self.source,
            table,
            path: format!("{}[{index}]", self.key(name)),
        };
        if let Some(tables) = item.as_array_of_tables() {
            return Ok(tables.iter().map(|table| table as &dyn TableLike).enumerate().map(reader).collect());
        }
        let array = item.as_array().ok_or_else(wrong)?;
        let tables: Option<Vec<&dyn TableLike>> =
            array.iter().map(|value| value.as_inline_table().map(|table| table as &dyn TableLike)).collect();
        Ok(tables.ok_or_else(wrong)?.into_iter().enumerate().map(reader).collect())
    }

    /// Whether a value is one table.
    pub(crate) fn is_table(&self, name: &str) -> bool {
        self.table.get(name).is_some_and(|item| item.as_table_like().is_some())
    }

    /// Whether a value is a list.
    pub(crate) fn is_list(&self, name: &str) -> bool {
        self.table.get(name).is_some_and(Item::is_array)
    }

    /// Whether a value is a list that holds tables (nodes along a segment), or nothing.
    pub(crate) fn is_node_list(&self, name: &str) -> bool {
        let holds_nodes = |array: &Array| array.is_empty() || array.iter().any(Value::is_inline_table);
        self.table.get(name).is_some_and(|item| item.is_array_of_tables() || item.as_array().is_some_and(holds_nodes))
    }

    /// A list of at least one table, such as `node`.
    pub(crate) fn nodes(&self, name: &str, node: &str) -> Result<Vec<Reader<'a>>, InputError> {
        let array = self.table.get(name).and_then(Item::as_array);
        let other = array.and_then(|array| array.iter().enumerate().find(|(_, value)| !value.is_inline_table()));
        if let Some((index, value)) = other {
            let expected = format!("a node such as {node}");
            let found = type_words(value.type_name());
            return Err(self.error(&format!("{name}[{index}]"), Problem::Type { expected, found }));
        }
        let nodes = self.tables(name)?;
        if nodes.is_empty() {
            let expected = format!("at least one node such as {node}");
            return Err(self.error(name, Problem::Range { value: "an empty list".into(), expected }));
        }
        Ok(nodes)
    }
}

fn type_words(name: &str) -> &'static str {
    match name {
        "string" => "a text",
        "integer" | "float" => "a number",
        "boolean" => "true or false",
        "array" => "a list",
        "table" | "inline table" => "a table",
        "array of tables" => "a list of tables",
        _ => "a date or time",
    }
}

/// A text as TOML writes it.
pub fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}
