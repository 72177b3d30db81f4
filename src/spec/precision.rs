//! The arithmetic that a sweep file asks for.

use crate::backend::Precision;

/// A word of files and scripts that were written for versions with mixed precision: f64 takes its place.
pub const MIXED: &str = "mixed";
/// What is said to whoever uses it.
pub const MIXED_NOTE: &str = "mixed precision was taken out: f64 takes its place, and is as exact or more so";

/// What a sweep file says of its arithmetic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrecisionChoice {
    /// Nothing: f32 on a GPU where the tolerance allows, f64 elsewhere.
    #[default]
    Usual,
    /// The same, said.
    Auto,
    /// This one.
    Given(Precision),
}

impl PrecisionChoice {
    /// What takes the place of [`MIXED`].
    pub const IN_PLACE_OF_MIXED: PrecisionChoice = PrecisionChoice::Given(Precision::F64);

    /// What a file may say.
    pub const WORDS: [PrecisionChoice; 3] =
        [PrecisionChoice::Auto, PrecisionChoice::Given(Precision::F32), PrecisionChoice::Given(Precision::F64)];

    /// The word in sweep files; empty where nothing is said.
    pub fn name(self) -> &'static str {
        match self {
            PrecisionChoice::Usual => "",
            PrecisionChoice::Auto => "auto",
            PrecisionChoice::Given(precision) => precision.name(),
        }
    }
}
