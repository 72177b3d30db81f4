//! How the samples of a sweep follow from their index: plain data for engines that make samples themselves.

/// The keys of one sampling method, prepared so that a sample takes as little as possible.
#[derive(Clone, Debug, PartialEq)]
pub enum RecipeMethod {
    /// Every combination of these values of the axes, SI; the first axis is the fastest.
    Grid(Vec<Vec<f64>>),
    /// Of each axis the direction numbers and the key of the scrambling; the middle of the cell is taken.
    Sobol { directions: Vec<Vec<u32>>, keys: Vec<u32> },
    /// Of each axis the keys of the permutation's rounds and that of the place within a stratum.
    LatinHypercube { rounds: Vec<[u64; 6]>, jitter: Vec<u64> },
    /// Of each axis the key of its hash.
    Uniform(Vec<u64>),
}

/// Axis values of a sample by its index.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleRecipe {
    pub method: RecipeMethod,
    /// From and to of each axis, SI.
    pub ranges: Vec<(f64, f64)>,
    pub sample_count: u64,
}
