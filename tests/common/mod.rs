//! What the tests of all engines share.
#![allow(dead_code, unused_imports, non_snake_case)]

pub mod check;
pub mod control;
pub mod dual;
pub mod golden;
pub mod random;
pub mod sandbox;
pub mod scenes;
pub mod strategy;
