//! Tables as Arrow record batches.

use super::{Column, Table, Values};
use arrow_array::{ArrayRef, BooleanArray, Float32Array, Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow_schema::{ArrowError, DataType, Field, Schema};
use std::collections::HashMap;
use std::sync::Arc;

impl Table {
    /// The table as Arrow arrays, of the same kinds as in a Parquet file. Each field's metadata carries its `unit`.
    ///
    /// # Errors
    /// If the columns differ in length.
    pub fn to_record_batch(&self) -> Result<RecordBatch, ArrowError> {
        let schema = Schema::new(self.columns.iter().map(field).collect::<Vec<Field>>());
        RecordBatch::try_new(Arc::new(schema), self.columns.iter().map(|column| array(&column.values)).collect())
    }
}

fn field(column: &Column) -> Field {
    let kind = match column.values {
        Values::Index(_) => DataType::UInt64,
        Values::Double(_) => DataType::Float64,
        Values::Single(_) => DataType::Float32,
        Values::Status(_) | Values::Text(_) => DataType::Utf8,
        Values::Flag(_) => DataType::Boolean,
    };
    let unit = HashMap::from([("unit".to_owned(), column.unit.clone())]);
    Field::new(&column.name, kind, column.values.is_nullable()).with_metadata(unit)
}

fn array(values: &Values) -> ArrayRef {
    match values {
        Values::Index(values) => Arc::new(UInt64Array::from(values.clone())),
        Values::Double(values) => {
            Arc::new(values.iter().map(|x| (!x.is_nan()).then_some(*x)).collect::<Float64Array>())
        }
        Values::Single(values) => {
            Arc::new(values.iter().map(|x| (!x.is_nan()).then_some(*x)).collect::<Float32Array>())
        }
        Values::Status(values) => Arc::new(values.iter().map(|status| Some(status.name())).collect::<StringArray>()),
        Values::Text(values) => Arc::new(values.iter().map(Some).collect::<StringArray>()),
        Values::Flag(values) => Arc::new(values.iter().copied().collect::<BooleanArray>()),
    }
}
