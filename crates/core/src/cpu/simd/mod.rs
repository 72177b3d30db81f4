//! One number for each of several samples: registers, operators, and numbers that count their operations.

pub mod counted;
pub mod lane;
pub mod operators;
