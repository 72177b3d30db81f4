//! Hard cases, what is right for each, and how an engine's answer is judged: the tests and `verify` judge by the same.
//!
//! ```
//! use rodsweep::engines::cpu_f64;
//! use rodsweep_bench::hard::{Setup, Verdict, cases};
//!
//! let case = cases().into_iter().find(|case| case.name() == "RS11_zero").expect("one of them");
//! let outcome = Setup::CPU_F64.solve(&case, &case.answer(), cpu_f64)?;
//! assert_eq!(outcome.verdict, Verdict::Ok);
//! # Ok::<(), rodsweep::backend::BackendError>(())
//! ```

mod case;
mod constructed;
mod documented;
mod golden;
mod setup;

pub use case::{Answer, Case, Truth};
pub use documented::{SHORTCOMINGS, Shortcoming};
pub use setup::{Outcome, Setup, Verdict};

/// Every case: the golden ones first, then those constructed here.
pub fn cases() -> Vec<Case> {
    let mut cases = golden::golden_cases();
    cases.extend(constructed::constructed_cases());
    cases
}
