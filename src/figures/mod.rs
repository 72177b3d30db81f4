//! Figures of results: what studies and runs have found, drawn with [`report`](crate::report).

mod run;

pub use run::{RunFigures, RunFiguresError};
