//! Where the text of a TOML file holds a key and its value.

use super::toml::Source;
use std::ops::Range;
use toml_edit::{Item, TableLike, Value};

/// A step of a path such as `segment[1].length`.
enum Step<'a> {
    Name(&'a str),
    Index(usize),
}

/// What a path leads to.
enum Place<'a> {
    Table(&'a dyn TableLike),
    Item(&'a Item),
    Value(&'a Value),
}

impl<'a> Place<'a> {
    fn table(&self) -> Option<&'a dyn TableLike> {
        match *self {
            Place::Table(table) => Some(table),
            Place::Item(item) => item.as_table_like(),
            Place::Value(value) => value.as_inline_table().map(|table| table as &dyn TableLike),
        }
    }

    fn at(&self, index: usize) -> Option<Place<'a>> {
        match *self {
            Place::Table(_) => None,
            Place::Item(item) => match item.as_array_of_tables() {
                Some(tables) => tables.get(index).map(|table| Place::Table(table)),
                None => item.as_array()?.get(index).map(Place::Value),
            },
            Place::Value(value) => value.as_array()?.get(index).map(Place::Value),
        }
    }
}

/// Bytes of a key and of its value.
pub(super) struct Spans {
    /// `None` for an item of a list.
    pub key: Option<Range<usize>>,
    /// `None` for a table.
    pub value: Option<Range<usize>>,
}

/// Where the text holds a key and its value, by the key's full path.
pub(super) fn spans(source: &Source, path: &str) -> Option<Spans> {
    let (mut place, mut key) = (Place::Table(source.document.as_table()), None);
    for step in steps(path)? {
        (place, key) = match step {
            Step::Name(name) => {
                let table = place.table()?;
                (Place::Item(table.get(name)?), table.key(name).and_then(|key| key.span()))
            }
            Step::Index(index) => (place.at(index)?, None),
        };
    }
    let value = match place {
        Place::Table(_) => None,
        Place::Item(item) => item.as_value().and_then(Value::span),
        Place::Value(value) => value.span(),
    };
    Some(Spans { key, value })
}

fn steps(path: &str) -> Option<Vec<Step<'_>>> {
    let mut steps = Vec::new();
    for part in path.split('.') {
        let mut pieces = part.split('[');
        steps.push(Step::Name(pieces.next()?));
        for piece in pieces {
            steps.push(Step::Index(piece.strip_suffix(']')?.parse().ok()?));
        }
    }
    Some(steps)
}
