//! The ladder: the ways to an equilibrium, and which comes after which for samples that one has left.

use super::lane::Scalar;
use crate::model::Status;

/// How samples are led to their loads; each is for those that the one before has left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// From anchors, where the plan has any.
    Anchors,
    /// From rest.
    Rest,
    /// Along the curve of equilibria.
    Curve,
    /// From rest with care.
    Care,
    /// From rest, by nodes all along the rod: where errors grow so much that a single pass would tell nothing.
    Limp,
    /// The same: where no single pass has told enough.
    Nodes,
    /// From rest, in a field that varies in space.
    Varying,
    /// Along the curve of equilibria there.
    VaryingCurve,
    /// From rest there, in steps as short as it takes.
    VaryingCare,
    /// The same on the grid of the answer, where that is no less exact.
    VaryingFine,
}

impl Way {
    /// Every way, as numbered.
    pub const ALL: [Way; 10] = [
        Way::Anchors,
        Way::Rest,
        Way::Varying,
        Way::Limp,
        Way::Curve,
        Way::VaryingCurve,
        Way::Care,
        Way::VaryingCare,
        Way::VaryingFine,
        Way::Nodes,
    ];

    /// The name of the rung.
    pub fn name(self) -> &'static str {
        match self {
            Way::Anchors => "anchors",
            Way::Rest | Way::Varying => "load steps",
            Way::Limp => "multiple shooting of limp and taut rods",
            Way::Curve | Way::VaryingCurve => "curve of equilibria",
            Way::Care | Way::VaryingCare => "guarded load steps",
            Way::VaryingFine => "guarded load steps on the answer's grid",
            Way::Nodes => "multiple shooting",
        }
    }
}

/// Whether a sample of this status is left to the next way: one that is pending, and after care one without success.
pub fn is_for_next<S: Scalar>(way: Way, status: S) -> bool {
    let settled = match way {
        Way::Limp => return status.to_f64() != f64::from(Status::Ramped.code()),
        Way::VaryingCurve => {
            return ![Status::Ramped, Status::Fold].iter().any(|is| status.to_f64() == f64::from(is.code()));
        }
        Way::VaryingCare => return status.to_f64() == f64::from(Status::NotConverged.code()),
        Way::Anchors | Way::Rest | Way::Curve | Way::Varying => Status::Pending,
        Way::Care => Status::Fold,
        Way::Nodes | Way::VaryingFine => return false,
    };
    // A status that is no number is not settled.
    let is_settled = status.to_f64() < f64::from(settled.code());
    !is_settled
}
