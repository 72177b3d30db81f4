//! One table for every format.

use rodsweep::model::Status;
use rodsweep::table::{Column, Table};

/// Every kind of values, with extremes and with rows that miss some.
pub fn table() -> Table {
    Table::new(vec![
        Column::new("sample", "", vec![0, 1, (1 << 53) + 1, u64::MAX]),
        Column::new("coil.current.x", "A", vec![0.1, -0.0, f64::MIN_POSITIVE, 1e300]),
        Column::new("status", "", vec![Status::Ok, Status::StepLimit, Status::Fold, Status::NonFinite]),
        Column::new("tip.position.x", "m", vec![f64::NAN, 1.0 / 3.0, f64::NAN, -5e-324]),
        Column::new("d(tip.position.x)/d(proximal.stiffness.bending)", "m/(N·m²)", vec![0.1_f32, f32::NAN, 3e38, -0.0]),
        Column::new("stable", "", vec![Some(true), None, Some(false), None]),
        Column::new("from_rest", "", vec![true, false, true, true]),
        Column::new("trajectory", "", ["a lap", "", "commas, \"quotes\"", "Ø 5\nlines"].map(str::to_owned).to_vec()),
    ])
}
