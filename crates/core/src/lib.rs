//! The part of the crate `rodsweep` that takes long to compile, so that an edit elsewhere need not wait for it: the
//! [`model`], the one trait of all engines ([`backend`]), and the CPU engine ([`cpu`]).
//!
//! Use the crate `rodsweep`, which shows these modules under the same names.

pub mod backend;
pub mod clock;
pub mod cpu;
pub mod model;
