//! Columns of points as one Arrow IPC stream.

use crate::error::Refusal;
use arrow_array::{ArrayRef, Float32Array, RecordBatch, UInt8Array, UInt32Array};
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{DataType, Field, Schema};
use std::collections::HashMap;
use std::sync::Arc;

/// A column on the wire: no nulls, NaN for none.
pub enum WireValues {
    /// Numbers for drawing.
    Single(Vec<f32>),
    /// Numbers of rows, points and corners.
    Index(Vec<u32>),
    /// Codes.
    Code(Vec<u8>),
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

/// The stream: a schema, one batch, the end.
///
/// # Errors
///
/// Columns that differ in length.
pub fn stream(columns: Vec<WireColumn>) -> Result<Vec<u8>, Refusal> {
    let mut fields = Vec::with_capacity(columns.len());
    let mut arrays: Vec<ArrayRef> = Vec::with_capacity(columns.len());
    for WireColumn { name, unit, values } in columns {
        let (kind, array): (DataType, ArrayRef) = match values {
            WireValues::Single(values) => (DataType::Float32, Arc::new(Float32Array::from(values))),
            WireValues::Index(values) => (DataType::UInt32, Arc::new(UInt32Array::from(values))),
            WireValues::Code(values) => (DataType::UInt8, Arc::new(UInt8Array::from(values))),
        };
        fields.push(Field::new(name, kind, false).with_metadata(HashMap::from([("unit".into(), unit)])));
        arrays.push(array);
    }
    let schema = Arc::new(Schema::new(fields));
    let batch = RecordBatch::try_new(Arc::clone(&schema), arrays).map_err(Refusal::failed)?;
    let mut writer = StreamWriter::try_new(Vec::new(), &schema).map_err(Refusal::failed)?;
    writer.write(&batch).map_err(Refusal::failed)?;
    writer.into_inner().map_err(Refusal::failed)
}
