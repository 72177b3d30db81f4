//! Where the text of a scene file holds the value of a parameter.

use super::toml::Source;
use std::ops::Range;
use toml_edit::{Item, Table, TableLike, Value};

/// Where the text holds the value of a scene's parameter, by the parameter's name; `None` where no single value is it.
pub(super) fn value_of(source: &Source, name: &str) -> Option<Range<usize>> {
    let (first, rest) = name.split_once('.').unwrap_or((name, ""));
    let root = source.document.as_table();
    if let Some((_, list)) = [("magnets", "magnet"), ("maps", "field_map")].into_iter().find(|(word, _)| *word == first)
    {
        let (name, rest) = rest.split_once('.')?;
        return below(named(root, list, name)?, rest);
    }
    if let Some(table) = ["segment", "coil_array"].into_iter().find_map(|list| named(root, list, first)) {
        let coil = || table.get("coil").and_then(Item::as_table_like).and_then(|coil| below(coil, rest));
        return below(table, rest).or_else(coil);
    }
    below(root, name)
}

/// The block of a list that has a name.
fn named<'a>(root: &'a Table, list: &str, name: &str) -> Option<&'a Table> {
    let mut tables = root.get(list)?.as_array_of_tables()?.iter();
    tables.find(|table| table.get("name").and_then(Item::as_str) == Some(name))
}

/// Where a table holds a value, by its path: keys, then the component of a list.
fn below(table: &dyn TableLike, path: &str) -> Option<Range<usize>> {
    let (key, rest) = path.split_once('.').unwrap_or((path, ""));
    let item = table.get(key)?;
    if let (Some(inner), false) = (item.as_table_like(), rest.is_empty()) {
        return below(inner, rest);
    }
    match item.as_value()? {
        Value::Array(array) => {
            let axis = ["x", "y", "z"].iter().position(|axis| *axis == rest);
            let index = axis.or_else(|| rest.parse::<usize>().ok()?.checked_sub(1))?;
            array.get(index)?.span()
        }
        Value::InlineTable(_) => None,
        value if rest.is_empty() => value.span(),
        _ => None,
    }
}
