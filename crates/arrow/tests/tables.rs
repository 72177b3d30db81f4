//! A table as a record batch, and back.

use arrow_array::cast::AsArray;
use arrow_array::{Array, types::UInt64Type};
use rodsweep::table::Column;

#[path = "../../../tests/common/table.rs"]
mod tables;
use tables::table;

#[test]
fn a_record_batch_holds_the_table() {
    let batch = rodsweep_arrow::record_batch(table()).expect("a batch");
    assert_eq!((batch.num_rows(), batch.num_columns()), (4, 8));
    assert_eq!(batch.schema().field(4).metadata()["unit"], "m/(N·m²)");
    assert_eq!(batch.column(0).as_primitive::<UInt64Type>().value(3), u64::MAX);
    assert_eq!((batch.column(3).null_count(), batch.column(5).null_count(), batch.column(6).null_count()), (2, 2, 0));
    assert_eq!(batch.column(2).as_string::<i32>().value(1), "step-limit");
}

#[test]
fn a_table_comes_back_from_its_record_batch() {
    let (before, batch) = (table(), rodsweep_arrow::record_batch(table()).expect("a batch"));
    let after = rodsweep_arrow::table(&batch).expect("a table");
    for (before, after) in before.columns.iter().zip(&after.columns) {
        assert_eq!((&before.name, &before.unit), (&after.name, &after.unit));
        let words = |column: &Column| format!("{:?}", column.values);
        assert_eq!(words(before), words(after));
    }
    assert_eq!(before.columns.len(), after.columns.len());
}
