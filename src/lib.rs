//! Batched static Cosserat rods with their Jacobians: parameter sweeps of magnetic catheters, on a GPU or the CPU.
//!
//! A [`model::Scene`] is what a user writes: one rod in one field. A [`model::Plan`] fixes what all samples of a sweep
//! share, a [`model::Batch`] holds what varies, a [`backend::Backend`] turns it into [`model::Solutions`].
//!
//! | rooms, from the ground up | hold |
//! |---|---|
//! | [`clock`], [`model`], [`backend`], [`cpu`] | processor time; rods, plans and statuses; the trait of all engines; the CPU engine (`crates/core`) |
//! | [`reference`](mod@reference), `gpu` | the reference; the GPU engine (feature `gpu`) |
//! | [`files`], [`text`] | files that are replaced whole or not at all; text of users on its way to a terminal, a shell, a page |
//! | [`table`], [`spec`], [`input`] | tables and their formats; what is asked for, as plain data; text to data, and back |
//! | [`engines`] | the choice of an engine, and its reason |
//! | [`results`] | result directories: parts, identity, reading, merging |
//! | [`sweep`] | running a sweep: jobs, sinks, the check against the reference |
//! | [`study`] | questions that take more than one solution: solve, control, fit, simulation |
//! | [`draw`], [`figures`] | drawing plain data; the figures of runs and studies |
//! | [`shipped`] | files that the program brings along |
//!
//! What stands above names what stands below, never the other way; the engines do not name each other.
//!
//! How it is built is told in [`architecture`], what it computes in [`equations`], how it is used in `README.md`.

pub mod draw;
pub mod engines;
pub mod figures;
pub mod files;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod input;
pub mod reference;
pub mod results;
pub mod shipped;
pub mod spec;
pub mod study;
pub mod sweep;
pub mod table;
pub mod text;

pub use rodsweep_core::{backend, clock, cpu, model};

/// Licences and notices of this library and of everything that may be built into a program with it.
pub const NOTICES: &str = include_str!("../NOTICES.txt");

/// Version of this library.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
static COMMIT: std::sync::OnceLock<&str> = std::sync::OnceLock::new();

/// The commit that the running program was built from, for manifests and reports; `None` where no program has told it.
pub fn commit() -> Option<&'static str> {
    COMMIT.get().copied()
}

/// Tells the commit that the running program was built from. The first word counts.
pub fn set_commit(commit: &'static str) {
    // Told before: that stays.
    let _ = COMMIT.set(commit);
}

#[doc = include_str!("ARCHITECTURE.md")]
pub mod architecture {}

#[doc = include_str!("EQUATIONS.md")]
pub mod equations {}

/// The examples of the README, as doc tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// The examples of `docs/rust.md`, likewise.
#[cfg(doctest)]
#[doc = include_str!("../docs/rust.md")]
pub struct FromRust;
