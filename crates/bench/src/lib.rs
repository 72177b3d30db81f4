//! Measures and verifies `rodsweep`: speed against error, every engine against the reference, hard cases, and the
//! methods of the literature beside the engines.
//!
//! It is a crate of its own because programs that only solve rods need none of it. Functions return data or text, and
//! tell a closure what is under way; printing is left to the caller.
//!
//! | module | what it does |
//! |---|---|
//! | [`measure`] | measures speed against error into a table of [`record`]s |
//! | [`report`] | makes report and figures of such a table, and of nothing else |
//! | [`paper`] | the paper's method and those it was compared with, beside the CPU engine |
//! | [`verify`] | every engine against the reference, on the shipped scenes, on random ones and on hard ones |
//! | [`hard`] | hard cases, and how an answer is judged |
//! | [`judge`] | a third judge of the branch from rest: a minimum of the energy, followed in the load |
//! | [`baseline`] | methods of the literature in plain scalar f64 |
//! | [`random`] | reproducible random numbers, rods and scenes |
//!
//! ```
//! use rodsweep::engines::witness;
//! use rodsweep_bench::hard::{Setup, Verdict, cases};
//!
//! let case = &cases()[0];
//! let outcome = Setup::REFERENCE.solve(case, &case.answer(), |plan| Ok(witness(plan)))?;
//! assert_eq!(outcome.verdict, Verdict::Ok);
//! # Ok::<(), rodsweep::backend::BackendError>(())
//! ```
// Units stand in brackets, such as [m]; they are no links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod baseline;
mod bench_file;
mod error;
mod files;
pub mod hard;
pub mod judge;
mod machine;
pub mod measure;
pub mod paper;
pub mod random;
pub mod record;
pub mod report;
pub mod verify;

pub use bench_file::{BenchSpec, Sets, Work};
pub use error::{BenchError, ReportFileError};
