//! How the samples of a sweep were laid out, and what that allows.

use super::blocks::block_of;
use crate::spec::{DesignKind, Method, SaltelliDesign, SweepSpec};

/// The layout of a sweep's samples.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Design {
    /// Two matrices, and each with a column of the other.
    PickFreeze(SaltelliDesign),
    /// Every combination, by points of each axis.
    Grid(Vec<u64>),
    /// Samples of the inputs' laws.
    Sample,
}

/// The layout and the number of samples.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub design: Design,
    pub samples: u64,
}

impl Layout {
    /// Of the first samples only, where there is a limit.
    pub fn new(spec: &SweepSpec, limit: Option<u64>) -> Layout {
        let design = match spec.method {
            Method::Saltelli => Design::PickFreeze(SaltelliDesign { axis_count: spec.axes.len() }),
            Method::Grid => Design::Grid(spec.axes.iter().map(|axis| axis.points).collect()),
            _ => Design::Sample,
        };
        Layout { design, samples: limit.map_or(spec.sample_count, |limit| limit.min(spec.sample_count)) }
    }

    /// Base rows of a pick-freeze design.
    pub fn bases(&self) -> u64 {
        match &self.design {
            Design::PickFreeze(design) => self.samples.div_ceil(design.rows_per_base()),
            _ => 0,
        }
    }

    /// Samples that are drawn from the inputs' laws each for itself: of a pick-freeze design the rows of A and B.
    pub fn items(&self) -> u64 {
        match self.design {
            Design::PickFreeze(_) => 2 * self.bases(),
            _ => self.samples,
        }
    }

    /// The place of a sample among these.
    pub fn item(&self, sample: u64) -> Option<u64> {
        match self.design {
            Design::PickFreeze(design) => match design.kind(sample) {
                (base, DesignKind::A) => Some(2 * base),
                (base, DesignKind::B) => Some(2 * base + 1),
                _ => None,
            },
            _ => Some(sample),
        }
    }

    /// The block of such a place.
    pub fn block(&self, item: u64) -> usize {
        block_of(item, self.items())
    }
}
