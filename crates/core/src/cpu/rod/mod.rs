//! A pass over the rod, from base to tip: section, step, columns, and the rows that follow from them. R1 to R6, J1 to J5, S1

pub mod base;
pub mod column;
pub mod columns;
pub mod field;
pub mod problem;
pub mod program;
pub mod rows;
pub mod section;
pub mod segments;
pub mod shoot;
pub mod single_sample;
pub mod source;
pub mod stability;
pub mod station;
pub mod step;
pub mod terms;
pub mod trace;
