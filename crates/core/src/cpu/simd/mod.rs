//! One number for each of several samples: registers, operators, functions apart, and numbers that count their operations.

pub mod apart;
pub mod counted;
pub mod lane;
pub mod operators;
