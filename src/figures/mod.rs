//! Drawings of results: they take what a study or a sweep returns and give a [`Figure`](crate::report::Figure).

mod shape;

pub use shape::{NothingToDraw, rod_shape};
