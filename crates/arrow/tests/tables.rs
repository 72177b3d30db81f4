//! A table as a record batch, and back.

use arrow_array::cast::AsArray;
use arrow_array::{Array, types::UInt64Type};
use rodsweep::model::Status;
use rodsweep::table::{Column, Table};

fn table() -> Table {
    Table::new(vec![
        Column::new("sample", "", vec![0, 1, (1 << 53) + 1, u64::MAX]),
        Column::new("status", "", vec![Status::Ok, Status::StepLimit, Status::Fold, Status::NonFinite]),
        Column::new("tip.position.x", "m", vec![f64::NAN, 1.0 / 3.0, f64::NAN, -5e-324]),
        Column::new("d(tip.position.x)/d(proximal.stiffness.bending)", "m/(N·m²)", vec![0.1_f32, f32::NAN, 3e38, -0.0]),
        Column::new("stable", "", vec![Some(true), None, Some(false), None]),
        Column::new("from_rest", "", vec![true, false, true, true]),
        Column::new("trajectory", "", ["a lap", "", "commas, \"quotes\"", "Ø 5\nlines"].map(str::to_owned).to_vec()),
    ])
}

#[test]
fn a_record_batch_holds_the_table() {
    let batch = rodsweep_arrow::record_batch(table()).expect("a batch");
    assert_eq!((batch.num_rows(), batch.num_columns()), (4, 7));
    assert_eq!(batch.schema().field(3).metadata()["unit"], "m/(N·m²)");
    assert_eq!(batch.column(0).as_primitive::<UInt64Type>().value(3), u64::MAX);
    assert_eq!((batch.column(2).null_count(), batch.column(4).null_count(), batch.column(5).null_count()), (2, 2, 0));
    assert_eq!(batch.column(1).as_string::<i32>().value(1), "step-limit");
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
