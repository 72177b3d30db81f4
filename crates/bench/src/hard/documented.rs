//! Where no answer is the right answer, and where the engines fall short.

use rodsweep::model::Status;

/// Why a case has no answer, and how an engine may put it.
pub struct End {
    pub case: &'static str,
    pub statuses: &'static [Status],
    pub why: &'static str,
}

/// A case with an answer that an engine does not find. `tests/hard.rs` notices when one comes or goes.
pub struct Shortcoming {
    /// Name of the case.
    pub case: &'static str,
    /// Name of the engine, as `Setup::name` has it.
    pub engine: &'static str,
    /// The status that the engine gives.
    pub status: Status,
    /// Why it finds none.
    pub why: &'static str,
}

const NO_BRANCH: &[Status] = &[Status::Fold, Status::Unstable];
const SHOOTING_ENDS: &[Status] = &[Status::StepLimit, Status::NotConverged, Status::NonFinite];

const ENDS: &[End] = &[
    End {
        case: "HC02_flip_above_aligned",
        statuses: NO_BRANCH,
        why: "a pitchfork at 0.999 of the load prefers no branch",
    },
    End { case: "HC08_bend270", statuses: NO_BRANCH, why: "index 2 from 0.376 of the load on" },
    End {
        case: "HC17b_limp_weight_1m",
        statuses: SHOOTING_ENDS,
        why: "single shooting ends; the CPU engine and the reference have nodes",
    },
    End {
        case: "RS09_limp_2000",
        statuses: SHOOTING_ENDS,
        why: "single shooting ends; the CPU engine and the reference have nodes",
    },
    End {
        case: "RS10_taut_20",
        statuses: SHOOTING_ENDS,
        why: "single shooting ends; the CPU engine and the reference have nodes",
    },
    End {
        case: "RS10_taut_30",
        statuses: SHOOTING_ENDS,
        why: "single shooting ends; the CPU engine and the reference have nodes",
    },
];

const ROUND_OFF: &str =
    "round-off of f32 times |dr/dm0|^2 spoils Newton's method and the stability index; f64 solves it";
const TWIST: &str = "EI / GJ = 1e3: what f32 leaves of the moment twists too far; f64 solves it";
const NEAR_FOLD: &str = "round-off over a margin of 2e-3 keeps Newton's step above its tolerance";

/// Those that are known.
pub const SHORTCOMINGS: &[Shortcoming] = &[
    Shortcoming { case: "HC11_torsion_soft_1e3", engine: "gpu f32", status: Status::NotConverged, why: TWIST },
    Shortcoming { case: "HC18_tension_stiff", engine: "gpu f32", status: Status::NotConverged, why: ROUND_OFF },
    Shortcoming { case: "RS09_limp_500", engine: "gpu f32", status: Status::NotConverged, why: ROUND_OFF },
    Shortcoming { case: "RS18_p6_near_1", engine: "gpu f32", status: Status::NotConverged, why: NEAR_FOLD },
];

pub fn end(case: &str) -> Option<&'static End> {
    ENDS.iter().find(|end| end.case == case)
}

pub fn shortcoming(case: &str, engine: &str, status: Status) -> Option<&'static Shortcoming> {
    SHORTCOMINGS.iter().find(|known| known.case == case && known.engine == engine && known.status == status)
}
