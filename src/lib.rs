//! Batched static Cosserat rods with their Jacobians: parameter sweeps of magnetic catheters, on a GPU or the CPU.
//!
//! A [`model::Scene`] is what a user writes: one rod in one field. A [`model::Plan`] fixes what all samples of a sweep
//! share, a [`model::Batch`] holds what varies, a [`backend::Backend`] turns it into [`model::Solutions`].
//!
//! | layer | modules | know |
//! |---|---|---|
//! | 5 | the program `rodsweep` | everything: chooses the engine, prints, exits |
//! | 4 | [`report`] | [`model`] |
//! | 4 | [`study`] | [`model`], [`backend`] and [`sweep`] |
//! | 3 | [`sweep`] | [`model`], [`backend`] and [`table`] |
//! | 2 | [`reference`](mod@reference), [`lanes`], [`gpu`], [`baseline`] | [`model`] and [`backend`], not each other |
//! | 1 | [`backend`] | [`model`] |
//! | 1 | [`table`] | [`model`] |
//! | 0 | [`model`] | nothing |
//!
//! How it is built is told in [`architecture`], what it computes in [`equations`], how it is used in `README.md`.
// Units stand in brackets, such as [m]; they are no links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod engines;
pub mod figures;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod input;
pub mod reference;
pub mod report;
pub mod results;
pub mod shipped;
pub mod spec;
pub mod study;
pub mod sweep;
pub mod table;

pub use rodsweep_kernels::{backend, lanes, model};

/// Version of this library.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Commit that it was built from, where it is known.
pub const COMMIT: Option<&str> = option_env!("RODSWEEP_COMMIT");

#[doc = include_str!("ARCHITECTURE.md")]
pub mod architecture {}

#[doc = include_str!("EQUATIONS.md")]
pub mod equations {}

/// The examples of the README, as doc tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
