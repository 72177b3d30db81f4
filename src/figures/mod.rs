//! Figures of results: what studies and runs have found, drawn with [`report`](crate::report).

mod run;
mod shape;

pub use run::{RunFigures, RunFiguresError};
pub use shape::{NothingToDraw, rod_shape};
