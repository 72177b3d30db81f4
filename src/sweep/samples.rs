//! Some samples of a batch, and which samples of the sweep they are.

use crate::spec::Selection;
use std::ops::Range;

/// Some samples of a batch.
pub(crate) enum Samples<'a> {
    /// At these places, one after the other from this sample of the sweep on.
    Following { places: Range<usize>, first: u64 },
    /// All of them: which samples of the sweep they are.
    Listed(&'a [u64]),
}

impl Samples<'_> {
    /// Their places in the batch.
    pub fn places(&self) -> Range<usize> {
        match self {
            Samples::Following { places, .. } => places.clone(),
            Samples::Listed(indices) => 0..indices.len(),
        }
    }

    /// The sweep's sample at a place.
    pub fn index(&self, at: usize) -> u64 {
        match self {
            Samples::Following { places, first } => first + at.saturating_sub(places.start) as u64,
            Samples::Listed(indices) => indices.get(at).copied().unwrap_or(0),
        }
    }

    /// Places of those that are chosen.
    pub fn chosen(&self, selection: Selection) -> Vec<usize> {
        match self {
            Samples::Following { places, first } => {
                let within = selection.within(*first..first + places.len() as u64);
                within.into_iter().map(|index| places.start + (index - first) as usize).collect()
            }
            Samples::Listed(indices) => {
                indices.iter().enumerate().filter(|(_, index)| selection.contains(**index)).map(|(at, _)| at).collect()
            }
        }
    }
}
