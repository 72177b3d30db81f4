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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Status;
    use arrow_array::Array;

    #[test]
    fn a_record_batch_holds_the_table() {
        let table = Table::new(vec![
            Column::new("sample", "", vec![u64::MAX, 1]),
            Column::new("tip.position.x", "m", vec![0.5, f64::NAN]),
            Column::new("status", "", vec![Status::Ok, Status::Fold]),
            Column::new("stable", "", vec![Some(true), None]),
        ]);
        let batch = table.to_record_batch().unwrap();
        assert_eq!(batch.schema().field(1).metadata()["unit"], "m");
        assert_eq!((batch.num_rows(), batch.column(1).null_count(), batch.column(3).null_count()), (2, 1, 1));
        let words = batch.column(2).as_any().downcast_ref::<StringArray>().unwrap();
        assert_eq!(words.value(1), "fold");
        let samples = batch.column(0).as_any().downcast_ref::<UInt64Array>().unwrap();
        assert_eq!(samples.value(0), u64::MAX);
    }
}
