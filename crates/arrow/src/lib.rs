//! Tables as Arrow record batches, and back.

use arrow_array::types::ArrowPrimitiveType;
use arrow_array::types::{Float32Type, Float64Type};
use arrow_array::{Array, ArrayRef, BooleanArray, PrimitiveArray, RecordBatch, StringArray, UInt64Array};
use arrow_buffer::{BooleanBuffer, NullBuffer};
use arrow_schema::{ArrowError, Field, Schema};
use rodsweep::model::Status;
use rodsweep::table::{Column, Table, Values};
use std::collections::HashMap;
use std::sync::Arc;

/// A table as Arrow arrays, of the same kinds as in a Parquet file; its numbers are not copied. Each field's metadata carries its `unit`.
/// Where a number is none, NaN stands below the null.
///
/// # Errors
/// If the columns differ in length, or one is of a kind that Arrow has not.
pub fn record_batch(table: Table) -> Result<RecordBatch, ArrowError> {
    let (mut fields, mut arrays) = (Vec::new(), Vec::new());
    for Column { name, unit, values } in table.columns {
        let is_nullable = values.is_nullable();
        let array = array(&name, values)?;
        let unit = HashMap::from([("unit".to_owned(), unit)]);
        fields.push(Field::new(name, array.data_type().clone(), is_nullable).with_metadata(unit));
        arrays.push(array);
    }
    RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays)
}

/// The table of a batch that [`record_batch`] made; numbers are copied.
///
/// # Errors
/// A column of a kind that tables have not.
pub fn table(batch: &RecordBatch) -> Result<Table, ArrowError> {
    let schema = batch.schema();
    let columns = schema.fields().iter().zip(batch.columns()).map(|(field, array)| {
        let unit = field.metadata().get("unit").cloned().unwrap_or_default();
        Ok(Column { name: field.name().clone(), unit, values: values(field.name(), array)? })
    });
    Ok(Table { columns: columns.collect::<Result<_, ArrowError>>()? })
}

fn array(name: &str, values: Values) -> Result<ArrayRef, ArrowError> {
    Ok(match values {
        Values::Index(values) => Arc::new(UInt64Array::from(values)),
        Values::Double(values) => numbers::<Float64Type>(values, |x| x.is_nan()),
        Values::Single(values) => numbers::<Float32Type>(values, |x| x.is_nan()),
        Values::Status(values) => Arc::new(values.iter().map(|status| Some(status.name())).collect::<StringArray>()),
        Values::Text(values) => Arc::new(values.iter().map(Some).collect::<StringArray>()),
        Values::Flag(values) => Arc::new(values.into_iter().collect::<BooleanArray>()),
        _ => return Err(ArrowError::SchemaError(format!("column `{name}` has no kind of Arrow's"))),
    })
}

/// Numbers with nulls where there is none.
fn numbers<T: ArrowPrimitiveType>(values: Vec<T::Native>, is_none: fn(&T::Native) -> bool) -> ArrayRef {
    let nulls = values.iter().any(is_none).then(|| {
        let is_there = BooleanBuffer::collect_bool(values.len(), |row| !is_none(&values[row]));
        NullBuffer::new(is_there)
    });
    Arc::new(PrimitiveArray::<T>::new(values.into(), nulls))
}

fn values(name: &str, array: &ArrayRef) -> Result<Values, ArrowError> {
    let array = array.as_any();
    if let Some(array) = array.downcast_ref::<UInt64Array>() {
        return Ok(Values::Index(array.values().to_vec()));
    }
    if let Some(array) = array.downcast_ref::<PrimitiveArray<Float64Type>>() {
        return Ok(Values::Double(array.values().to_vec()));
    }
    if let Some(array) = array.downcast_ref::<PrimitiveArray<Float32Type>>() {
        return Ok(Values::Single(array.values().to_vec()));
    }
    if let Some(array) = array.downcast_ref::<BooleanArray>() {
        return Ok(Values::Flag(array.iter().collect()));
    }
    let Some(array) = array.downcast_ref::<StringArray>() else {
        return Err(ArrowError::SchemaError(format!("column `{name}` is of a kind that tables have not")));
    };
    let words: Vec<&str> = array.iter().map(Option::unwrap_or_default).collect();
    let status = |word: &&str| Status::ALL.into_iter().find(|status| status.name() == *word);
    match words.iter().map(status).collect::<Option<Vec<Status>>>().filter(|_| name == "status") {
        Some(statuses) => Ok(Values::Status(statuses)),
        None => Ok(Values::Text(words.into_iter().map(str::to_owned).collect())),
    }
}
