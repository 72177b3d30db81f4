//! An equilibrium in a field that varies in space: six unknowns at the base, force and moment. F5

pub mod answer;
pub mod arrival;
pub mod base_load;
pub mod chord;
pub mod curve;
pub mod fold;
pub mod path;
pub mod rest;
pub mod search;
