//! How the samples of a sweep follow from their index: plain data for engines that make samples themselves.

/// The keys of one sampling method, prepared so that a sample takes as little as possible.
#[derive(Clone, Debug, PartialEq)]
pub enum RecipeMethod {
    /// Every combination of these values of the axes, SI; the first axis is the fastest.
    Grid(Vec<Vec<f64>>),
    /// Sobol' points, scrambled; the middle of the cell is taken.
    Sobol {
        /// Direction numbers of each axis, one a bit of the index.
        directions: Vec<Vec<u32>>,
        /// Key of the scrambling of each axis.
        keys: Vec<u32>,
    },
    /// Each axis has one sample in each of as many strata as there are samples.
    LatinHypercube {
        /// Of each axis the keys of the permutation's rounds.
        rounds: Vec<[u64; 6]>,
        /// Of each axis the key of the place within a stratum.
        jitter: Vec<u64>,
    },
    /// Of each axis the key of its hash.
    Uniform(Vec<u64>),
}

/// Axis values of a sample by its index.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleRecipe {
    /// How points follow from the index.
    pub method: RecipeMethod,
    /// From and to of each axis, SI.
    pub ranges: Vec<(f64, f64)>,
    /// Samples of the whole sweep, whatever part of it is solved.
    pub sample_count: u64,
}
