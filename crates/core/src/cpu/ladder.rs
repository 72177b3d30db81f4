//! The ladder: the methods that lead samples to their equilibria, for which samples each is, what it decides, and which comes next.

use crate::backend::LadderLine;
use crate::cpu::simd::lane::Scalar;
use crate::model::{Status, WallKind};

/// A method. It is for the samples that those before it have left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rung {
    Anchors,
    LoadSteps,
    FieldSteps,
    FreeTip,
    ComingWall,
    LimpShooting,
    Curve,
    FieldCurve,
    FieldFineCurve,
    GuardedSteps,
    GuardedWall,
    FieldGuardedSteps,
    FieldFineSteps,
    MultipleShooting,
}

/// What of a plan and an engine decides which rungs there are.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// The field varies in space.
    pub varying: bool,
    /// Samples start from a given base moment.
    pub searches: bool,
    /// Every sample is solved by multiple shooting.
    pub by_nodes: bool,
    pub anchors: bool,
    /// Paths without care are all.
    pub bold: bool,
    /// The wall of a uniform field, without which the rods have been solved before.
    pub wall: Option<WallKind>,
}

impl Rung {
    /// Every rung, in the order in which samples meet them.
    pub const ALL: [Rung; 14] = [
        Rung::Anchors,
        Rung::LoadSteps,
        Rung::FieldSteps,
        Rung::FreeTip,
        Rung::ComingWall,
        Rung::LimpShooting,
        Rung::Curve,
        Rung::FieldCurve,
        Rung::FieldFineCurve,
        Rung::GuardedSteps,
        Rung::GuardedWall,
        Rung::FieldGuardedSteps,
        Rung::FieldFineSteps,
        Rung::MultipleShooting,
    ];

    /// What it is, for whom, and what it decides.
    pub fn line(self) -> LadderLine {
        let (rung, samples, decides) = match self {
            Rung::Anchors => ("anchors", "all, where the sweep has anchors", "`ok`"),
            Rung::LoadSteps => ("load steps", "all others, in a uniform field", "`ok`, `ramped`"),
            Rung::FieldSteps => ("load steps in a field", "all, in a field that varies in space", "`ramped`"),
            Rung::FreeTip => (
                "free tip beside a wall",
                "solved rods, where the tip slides, in a uniform field",
                "what it was, `through-wall`",
            ),
            Rung::ComingWall => (
                "a wall comes",
                "solved rods that it presses or holds, in a uniform field",
                "`ramped`, `through-wall`, `out-of-reach`",
            ),
            Rung::LimpShooting => {
                ("multiple shooting of limp rods", "rods whose growth exponent is above the limit", "`ramped`")
            }
            Rung::Curve => ("curve of equilibria", "all that are left, but for rods of much growth", "`fold`"),
            Rung::FieldCurve => ("curve in a field", "all that are left, in f64", "`fold`, `ramped`"),
            Rung::FieldFineCurve => {
                ("curve in a field, with care", "all that are left, in f64, without a wall", "`fold`, `ramped`")
            }
            Rung::GuardedSteps => ("guarded load steps", "all that are left", "`ramped`"),
            Rung::GuardedWall => {
                ("a wall comes, with care", "solved rods that are left, in a uniform field", "any but `not-converged`")
            }
            Rung::FieldGuardedSteps => (
                "guarded load steps in a field",
                "all that are left, in f32 or beside a wall",
                "any but `not-converged`",
            ),
            Rung::FieldFineSteps => ("guarded load steps on the fine grid", "all that are left", "any"),
            Rung::MultipleShooting => ("multiple shooting", "rods of much growth that are left", "any"),
        };
        LadderLine { rung, samples, decides }
    }
}

/// The ladder of the CPU engine.
pub fn ladder() -> [LadderLine; Rung::ALL.len()] {
    Rung::ALL.map(Rung::line)
}

impl Course {
    /// The rungs of a batch, from the first.
    pub fn rungs(&self) -> &'static [Rung] {
        use Rung::{
            Anchors, ComingWall, Curve, FieldCurve, FieldFineCurve, FieldFineSteps, FieldGuardedSteps, FieldSteps,
            FreeTip, GuardedSteps, GuardedWall, LimpShooting, LoadSteps, MultipleShooting,
        };
        match *self {
            Course { bold: true, wall: Some(WallKind { sticks: true, .. }), .. } => &[ComingWall],
            Course { bold: true, wall: Some(_), .. } => &[FreeTip, ComingWall],
            Course { bold: true, varying: true, .. } => &[FieldSteps],
            Course { bold: true, .. } => &[LoadSteps],
            Course { wall: Some(WallKind { sticks: true, .. }), .. } => {
                &[ComingWall, FieldCurve, GuardedWall, FieldGuardedSteps, FieldFineSteps]
            }
            Course { wall: Some(_), .. } => {
                &[FreeTip, ComingWall, FieldCurve, GuardedWall, FieldGuardedSteps, FieldFineSteps]
            }
            Course { varying: true, searches: true, .. } => &[FieldGuardedSteps],
            Course { varying: true, .. } => {
                &[FieldSteps, FieldCurve, FieldFineCurve, FieldGuardedSteps, FieldFineSteps]
            }
            Course { by_nodes: true, .. } => &[MultipleShooting],
            Course { anchors: true, .. } => &[Anchors, LoadSteps, LimpShooting, Curve, GuardedSteps, MultipleShooting],
            _ => &[LoadSteps, LimpShooting, Curve, GuardedSteps, MultipleShooting],
        }
    }
}

/// Whether a rung leaves a sample of this status to the next.
pub fn is_left<S: Scalar>(rung: Rung, status: S) -> bool {
    let is = |other: Status| status.to_f64() == f64::from(other.code());
    if is(Status::ThroughWall) || is(Status::OutOfReach) {
        return false;
    }
    let settled = match rung {
        Rung::LimpShooting => return !is(Status::Ramped),
        Rung::FieldCurve | Rung::FieldFineCurve => return !(is(Status::Ramped) || is(Status::Fold)),
        Rung::GuardedWall | Rung::FieldGuardedSteps => return is(Status::NotConverged),
        Rung::Anchors | Rung::LoadSteps | Rung::Curve | Rung::FieldSteps | Rung::FreeTip | Rung::ComingWall => {
            Status::Pending
        }
        Rung::GuardedSteps => Status::Fold,
        Rung::MultipleShooting | Rung::FieldFineSteps => return false,
    };
    // A status that is no number is not settled.
    let is_settled = status.to_f64() < f64::from(settled.code());
    !is_settled
}
