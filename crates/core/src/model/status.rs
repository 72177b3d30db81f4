//! What became of a sample. The codes are shared with WGSL and written beside every row.

/// Outcome of one sample. The first three carry a converged solution, `Unstable` a converged but elastically
/// unstable one, `ThroughWall` one whose rod is partly in a wall; the others carry no trustworthy numbers.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Status {
    /// Converged, directly from rest.
    Ok = 0,
    /// Converged after a second attempt in f64 or with more steps.
    Refined = 1,
    /// Converged by raising the loads in several steps.
    Ramped = 2,
    /// The path from rest ends at a fold before the full load.
    Fold = 3,
    /// Converged, but to an elastically unstable equilibrium.
    Unstable = 4,
    /// The allowed number of passes was used up.
    StepLimit = 5,
    /// Newton's method found no equilibrium.
    NotConverged = 6,
    /// The swept values make no rod (for example a negative length).
    BadParameter = 7,
    /// A number overflowed or became undefined.
    NonFinite = 8,
    /// Not solved yet. Never leaves a backend.
    #[default]
    Pending = 9,
    /// A part of the rod comes nearer to a magnet than its clearance, where a dipole no longer stands for it.
    TooNearMagnet = 10,
    /// A magnetic part of the rod leaves a field that is known on a grid only.
    OutsideMap = 11,
    /// Two paths from rest end at different equilibria, and a finer one has not decided which is right.
    Doubtful = 12,
    /// Converged, but another part of the rod than its tip is in the wall.
    ThroughWall = 13,
    /// The tip is to be held farther from the base than the rod is long.
    OutOfReach = 14,
}

impl Status {
    /// In the order of their codes.
    pub const ALL: [Status; 15] = [
        Status::Ok,
        Status::Refined,
        Status::Ramped,
        Status::Fold,
        Status::Unstable,
        Status::StepLimit,
        Status::NotConverged,
        Status::BadParameter,
        Status::NonFinite,
        Status::Pending,
        Status::TooNearMagnet,
        Status::OutsideMap,
        Status::Doubtful,
        Status::ThroughWall,
        Status::OutOfReach,
    ];

    /// The status of a code; `None` for a number that is no code.
    pub fn from_code(code: u8) -> Option<Status> {
        Self::ALL.get(code as usize).copied()
    }

    /// Its number in files and shaders.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The word written to files.
    pub fn name(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::Refined => "refined",
            Status::Ramped => "ramped",
            Status::Fold => "fold",
            Status::Unstable => "unstable",
            Status::StepLimit => "step-limit",
            Status::NotConverged => "not-converged",
            Status::BadParameter => "bad-parameter",
            Status::NonFinite => "non-finite",
            Status::Pending => "pending",
            Status::TooNearMagnet => "too-near-magnet",
            Status::OutsideMap => "outside-map",
            Status::Doubtful => "doubtful",
            Status::ThroughWall => "through-wall",
            Status::OutOfReach => "out-of-reach",
        }
    }

    /// Whether the row's numbers satisfy the equilibrium equations.
    pub fn is_converged(self) -> bool {
        matches!(self, Status::Ok | Status::Refined | Status::Ramped | Status::Unstable | Status::ThroughWall)
    }

    /// Whether the row can be used as it stands: converged and not known to be unstable.
    pub fn is_success(self) -> bool {
        matches!(self, Status::Ok | Status::Refined | Status::Ramped)
    }
}
