//! The answer: a workspace, its size with error, and what is known of its voxels.

use super::check::ChangeOfVariables;
use super::dimension::Dimension;
use super::growth::Grown;
use super::inputs::WorkspaceInput;
use super::lattice::CellMap;
use super::measures::{Ends, Estimate};
use super::pose::PoseRank;
use super::voxel_values::{Cause, VoxelValues};
use crate::model::Scene;
use crate::spec::SolutionMethod;
use crate::study::witness::WitnessCheck;

/// Values that differ by more than so many of their errors disagree.
const ERRORS: f64 = 3.0;
const NORMAL_95: f64 = 1.96;
/// Undecided voxels above this share leave a workspace in doubt.
const MOST_UNDECIDED: f64 = 0.01;

/// The independent value beside the grown one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// By change of variables.
    pub by_change_of_variables: ChangeOfVariables,
    /// Whether the two values agree within three of their errors.
    pub agrees: bool,
    /// Difference over the error of the difference.
    pub deviation: f64,
}

impl Check {
    pub(super) fn new(integral: ChangeOfVariables, size: &Estimate) -> Check {
        let below = integral.value < size.value;
        let one_sided = if below { size.value - size.low } else { size.high - size.value };
        let error = integral.standard_error.hypot(one_sided / NORMAL_95);
        let deviation = (integral.value - size.value) / error;
        Check { by_change_of_variables: integral, agrees: deviation.abs() <= ERRORS, deviation }
    }
}

/// A workspace.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Workspace {
    /// Point, curve, surface, body.
    pub dimension: Dimension,
    /// Rank of the whole pose; `None` where nobody asked.
    pub pose: Option<PoseRank>,
    /// Of a body (m³).
    pub volume: Option<Estimate>,
    /// Of a surface, or of the middle of a thin body (m²).
    pub area: Option<Estimate>,
    /// Of a curve (m).
    pub length: Option<Estimate>,
    /// The independent value; `None` where no family of inputs can be counted.
    pub check: Option<Check>,
    /// Voxels by how the search for them ended.
    pub ends: Ends,
    /// Good's estimate of the share of samples whose voxel was known before growth.
    pub coverage: f64,
    /// Equilibria that growth began from.
    pub seed_count: usize,
    /// Equilibria computed.
    pub solves: u64,
    /// By what they were computed.
    pub method: SolutionMethod,
    /// The same in words.
    pub engine: String,
    /// Least margin that counts.
    pub minimum_margin: f64,
    /// Whether every stable equilibrium counts.
    pub any_stable: bool,
    /// Whether rows only painted the centres near them.
    pub is_painted: bool,
    /// Of lattice and nets.
    pub seed: u64,
    /// The rod.
    pub scene: Scene,
    /// What is commanded.
    pub inputs: Vec<WorkspaceInput>,
    /// Rows in each voxel.
    pub counts: CellMap<u32>,
    /// What speaks against the rows that it began from; `None`: nothing that is known.
    pub mark: Option<String>,
    /// What the reference says of a share of its voxels.
    pub check_by_reference: WitnessCheck,
    /// Its voxels.
    pub grown: Grown,
    /// Of a thin body: its middle.
    pub surface: Option<Grown>,
    /// Of the reached voxels, in their order.
    pub values: VoxelValues,
    /// Signed distances to the boundary of all voxels (m), positive inside; empty for what is no body.
    pub distances: Vec<f64>,
    /// Of all voxels.
    pub causes: Vec<Cause>,
    /// Remarks for the user.
    pub notes: Vec<String>,
}

impl Workspace {
    /// Volume, area or length, whichever the dimension asks for.
    pub fn size(&self) -> Option<Estimate> {
        self.volume.or(self.area).or(self.length)
    }

    /// Whether the independent value disagrees, or too much is undecided.
    pub fn is_doubtful(&self) -> bool {
        let is_unseen = self.dimension.rank > 0 && self.grown.reached_count() == 0;
        is_unseen || self.check.is_some_and(|check| !check.agrees) || self.ends.undecided_share() > MOST_UNDECIDED
    }

    /// How often a point is reached by the family of the check, on average; `None` where nothing is reached.
    pub fn multiplicity(&self) -> Option<f64> {
        let (check, size) = (self.check?, self.size().filter(|size| size.value > 0.0)?);
        Some(check.by_change_of_variables.with_multiplicity / size.value)
    }
}
