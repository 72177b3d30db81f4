//! Columns of numbers for the page: a head in JSON that tells what they are, then their bytes.

use crate::error::Refusal;
use serde_json::json;

/// A column begins at a multiple of this (bytes), as the page's arrays of numbers must.
const ALIGNMENT: usize = 4;

/// A column on the wire: NaN for none.
pub enum WireValues {
    /// Numbers for drawing.
    Single(Vec<f32>),
    /// Numbers of rows, points and corners.
    Index(Vec<u32>),
    /// Codes.
    Code(Vec<u8>),
}

impl WireValues {
    fn kind(&self) -> &'static str {
        match self {
            WireValues::Single(_) => "f32",
            WireValues::Index(_) => "u32",
            WireValues::Code(_) => "u8",
        }
    }

    fn len(&self) -> usize {
        match self {
            WireValues::Single(values) => values.len(),
            WireValues::Index(values) => values.len(),
            WireValues::Code(values) => values.len(),
        }
    }

    fn write(&self, out: &mut Vec<u8>) {
        match self {
            WireValues::Single(values) => out.extend(values.iter().flat_map(|x| x.to_le_bytes())),
            WireValues::Index(values) => out.extend(values.iter().flat_map(|x| x.to_le_bytes())),
            WireValues::Code(values) => out.extend(values),
        }
    }
}

/// A named column with its unit.
pub struct WireColumn {
    /// As in the table.
    pub name: String,
    /// SI; empty for none.
    pub unit: String,
    /// All of one length.
    pub values: WireValues,
}

impl WireColumn {
    /// Numbers for drawing.
    pub fn single(name: &str, unit: &str, values: Vec<f32>) -> WireColumn {
        WireColumn { name: name.into(), unit: unit.into(), values: WireValues::Single(values) }
    }

    /// Whole numbers.
    pub fn index(name: &str, values: Vec<u32>) -> WireColumn {
        WireColumn { name: name.into(), unit: String::new(), values: WireValues::Index(values) }
    }
}

/// The length of the head (four bytes, the lowest first, as all numbers here), the head, and column after column. Head and columns are
/// filled up to multiples of four bytes.
///
/// # Errors
///
/// Columns that differ in length.
pub fn typed_columns(columns: &[WireColumn]) -> Result<Vec<u8>, Refusal> {
    let rows = columns.first().map_or(0, |column| column.values.len());
    if let Some(other) = columns.iter().find(|column| column.values.len() != rows) {
        let (name, length) = (&other.name, other.values.len());
        return Err(Refusal::failed(format!("column {name} has {length} rows, the first one has {rows}")));
    }
    let described =
        columns.iter().map(|column| json!({ "name": column.name, "unit": column.unit, "kind": column.values.kind() }));
    let mut head = json!({ "rows": rows, "columns": described.collect::<Vec<_>>() }).to_string().into_bytes();
    head.resize(head.len().next_multiple_of(ALIGNMENT), b' ');
    let length = u32::try_from(head.len()).map_err(Refusal::failed)?;
    let mut out = Vec::with_capacity(ALIGNMENT + head.len() + columns.len() * (4 * rows + ALIGNMENT));
    out.extend(length.to_le_bytes());
    out.extend(head);
    for column in columns {
        column.values.write(&mut out);
        out.resize(out.len().next_multiple_of(ALIGNMENT), 0);
    }
    Ok(out)
}
