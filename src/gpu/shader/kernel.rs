//! The kernels: entry points, the pieces they are made of, and what a plan fixes in them.

use super::anchors::has_anchors;
use super::derivative_terms::rotates;
use super::emit::{EmitError, Source, emit};
use super::generator::{Generator, TERMS};
use super::record::record_functions;
use super::sources::source_functions;
use super::specialise::{Piece, Specialisation, Value};
use super::terms::{Form, specialisation};
use super::voxel_request::voxel_margin;
use crate::backend::Precision;
use crate::model::Plan;
use std::borrow::Cow;

/// A shader file, compiled in.
macro_rules! shader {
    ($stem:literal) => {
        Part::File(Piece {
            name: Cow::Borrowed(concat!("shaders/", $stem, ".wgsl")),
            text: Cow::Borrowed(include_str!(concat!("../../../shaders/", $stem, ".wgsl"))),
        })
    };
}

/// One part of a kernel's source.
#[derive(Clone, Debug)]
pub enum Part {
    /// A shader file.
    File(Piece),
    /// The functions that load a sample's record, generated for the plan.
    Record,
    /// The functions that load what parameters change, likewise.
    Sources,
}

/// A row of the kernel table.
#[derive(Clone, Debug)]
pub struct KernelEntry {
    /// Name of the function that the device runs.
    pub entry_point: &'static str,
    /// In the order in which they are joined.
    pub parts: &'static [&'static [Part]],
}

/// A rod: its numbers, a pass over it with columns, and the rows that follow.
const ROD: &[Part] = &[
    shader!("batch"),
    Part::Record,
    shader!("plan"),
    shader!("algebra"),
    shader!("rod/segments"),
    shader!("rod/section"),
    shader!("rod/step"),
    shader!("rod/column"),
    shader!("rod/source"),
    Part::Sources,
    shader!("rod/trace"),
    shader!("rod/base"),
    shader!("rod/shoot"),
    shader!("rod/stability"),
    shader!("slots"),
    shader!("rod/rows"),
];

/// Ways to an equilibrium, from rest, from a start or from anchors, and what is said of it.
const EQUILIBRIUM: &[Part] = &[
    shader!("equilibrium/path"),
    shader!("equilibrium/search"),
    shader!("equilibrium/anchors"),
    shader!("equilibrium/chord"),
    shader!("equilibrium"),
    shader!("lists"),
    shader!("lanes"),
];

/// Every kernel for batches. The first solves one.
pub const KERNELS: &[KernelEntry] =
    &[KernelEntry { entry_point: "solve", parts: &[ROD, EQUILIBRIUM, &[shader!("equilibrium/solve")]] }];

/// Its parts as kernels of their own, one after the other.
const FOLLOW: KernelEntry =
    KernelEntry { entry_point: "follow", parts: &[ROD, EQUILIBRIUM, HANDOVER, &[shader!("stages/path")]] };
const FOLLOW_WITH_CARE: KernelEntry =
    KernelEntry { entry_point: "follow_with_care", parts: &[ROD, EQUILIBRIUM, HANDOVER, &[shader!("stages/guarded")]] };
const APPROACH: KernelEntry =
    KernelEntry { entry_point: "approach", parts: &[ROD, EQUILIBRIUM, HANDOVER, &[shader!("stages/check")]] };
const CONCLUDE: KernelEntry =
    KernelEntry { entry_point: "answer_sample", parts: &[ROD, EQUILIBRIUM, HANDOVER, &[shader!("stages/columns")]] };
const HANDOVER: &[Part] = &[shader!("handover")];

/// Takes samples one turn further by nodes.
const NODES: &[Part] = &[
    shader!("memory"),
    shader!("multiple_shooting/memory"),
    shader!("multiple_shooting/mesh"),
    shader!("multiple_shooting/interval"),
    shader!("multiple_shooting/drives"),
    shader!("multiple_shooting/elimination"),
    shader!("multiple_shooting/margin"),
    shader!("multiple_shooting/state"),
    shader!("multiple_shooting/newton"),
    shader!("multiple_shooting/responses"),
    shader!("multiple_shooting/path"),
    shader!("multiple_shooting/answer"),
];

/// Takes samples in a field that varies in space one turn further.
const VARYING: &[Part] = &[
    shader!("batch"),
    Part::Record,
    shader!("plan"),
    shader!("algebra"),
    shader!("rod/segments"),
    shader!("rod/section"),
    shader!("rod/step"),
    shader!("rod/column"),
    shader!("rod/source"),
    shader!("slots"),
    shader!("memory"),
    shader!("rod/field/memory"),
    shader!("rod/field/matrix"),
    shader!("rod/field/space"),
    shader!("rod/field/parameters"),
    shader!("rod/field/step"),
    shader!("rod/field/crossing"),
    shader!("rod/field/ends"),
    shader!("rod/field/first"),
    shader!("rod/field/index"),
    shader!("rod/field/pass"),
    shader!("equilibrium/field/path"),
    shader!("equilibrium/field/answer"),
    shader!("equilibrium/field/turn"),
];

/// Entry point of kernels that take samples one turn further, pass by pass.
const TURN: &str = "advance";

/// Makes the samples of a sweep from their index.
const GENERATE: &[Part] = &[shader!("wide"), shader!("generate")];

/// Counts solved samples in voxels.
const REDUCE: &[Part] = &[shader!("reduce")];

/// Layout and loading of a sample's numbers: what every kernel starts with.
const PRELUDE: &[Part] = &[shader!("batch"), Part::Record];

/// A kernel specialised for a plan.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Name of the function that the device runs.
    pub entry_point: &'static str,
    /// In which it computes.
    pub precision: Precision,
    /// The same from the plan's anchors, where it has any: it comes first and leaves to this one what they do not certify.
    pub anchored: Option<Box<Kernel>>,
    /// What hardware runs in its place.
    pub stages: Option<Box<Stages>>,
    /// Complete WGSL.
    pub source: Source,
}

/// A kernel cut into short ones, which run one after the other. Processors of a GPU keep little code at hand, and few
/// registers; samples that need care would hold up their neighbours.
#[derive(Clone, Debug)]
pub struct Stages {
    /// Chord steps and check from anchors, where the plan has any.
    pub anchored: Option<Kernel>,
    /// The path from rest in few load steps.
    pub path: Kernel,
    /// The guarded path, where the ramp leads to no stable equilibrium. In f32 on several invocations a sample, so that
    /// few samples are done soon; in f64 on one, which suits the many doubtful samples of a large sweep in f32.
    pub guarded: Kernel,
    /// Chord steps and check at the end of a path.
    pub check: Kernel,
    /// The pass with all columns, and the row.
    pub columns: Kernel,
    /// The pass with all columns in later rounds, where the stability index may need columns of its own.
    pub columns_again: Kernel,
}

impl Kernel {
    /// A row of the table, specialised.
    ///
    /// `unrolled`: for a GPU that is software, see [`Form`].
    pub fn new(entry: &KernelEntry, plan: &Plan, precision: Precision, unrolled: bool) -> Result<Self, EmitError> {
        let make = |form| Self::emitted(entry.entry_point, entry.parts, plan, &specialisation(plan, precision, form));
        let anchored = Form { guards: false, unrolled, anchored: true, ..Form::ROLLED };
        let anchored = has_anchors(plan).then(|| make(anchored)).transpose()?.map(Box::new);
        // A search knows one way only.
        let has_stages = plan.start.is_none();
        let stages = has_stages.then(|| Stages::new(plan, precision)).transpose()?.map(Box::new);
        Ok(Self { anchored, stages, ..make(Form { unrolled, ..Form::ROLLED })? })
    }

    /// The kernel that takes samples one turn further by nodes, in f32.
    ///
    /// `unrolled`: for a GPU that is software, see [`Form`].
    pub fn nodes(plan: &Plan, unrolled: bool) -> Result<Self, EmitError> {
        let form = Form { unrolled, nodes: true, ..Form::ROLLED };
        Self::emitted(TURN, &[ROD, NODES], plan, &specialisation(plan, Precision::F32, form))
    }

    /// The kernel that takes samples in a field that varies in space one turn further, in f32.
    ///
    /// `unrolled`: for a GPU that is software, see [`Form`].
    pub fn varying(plan: &Plan, unrolled: bool) -> Result<Self, EmitError> {
        let form = Form { guards: false, unrolled, ..Form::ROLLED };
        Self::emitted(TURN, &[VARYING], plan, &specialisation(plan, Precision::F32, form))
    }

    /// Whether it takes samples one turn further, so that they need many dispatches and memory that outlasts them.
    pub fn takes_turns(&self) -> bool {
        self.entry_point == TURN
    }

    /// The kernel that makes samples.
    pub fn generate(plan: &Plan, generator: &Generator, precision: Precision) -> Result<Self, EmitError> {
        let mut s = specialisation(plan, precision, Form::ROLLED);
        TERMS.iter().for_each(|term| s.term(*term, *term == generator.term));
        let numbers = [
            ("AXIS_COUNT", generator.axis_count),
            ("AXIS_WORDS", generator.axis_words),
            ("COLUMNS_AT", generator.columns_at),
            ("COMMON_AT", generator.common_at),
        ];
        numbers.iter().for_each(|(name, value)| s.constant(*name, Value::U32(*value as u32)));
        Self::emitted("generate", &[GENERATE], plan, &s)
    }

    /// The kernel that counts samples in voxels.
    pub fn reduce(plan: &Plan, precision: Precision) -> Result<Self, EmitError> {
        let mut s = specialisation(plan, precision, Form::ROLLED);
        s.constant("VOXEL_MARGIN", Value::Float(voxel_margin(precision)));
        Self::emitted("reduce", &[REDUCE], plan, &s)
    }

    fn emitted(
        entry_point: &'static str,
        parts: &[&[Part]],
        plan: &Plan,
        specialisation: &Specialisation,
    ) -> Result<Self, EmitError> {
        Self::from_pieces(entry_point, &pieces(parts, plan), specialisation)
    }

    /// An f32 kernel of its own pieces after the prelude, for tests and trials.
    pub fn custom(entry_point: &'static str, pieces: &[Piece], plan: &Plan) -> Result<Self, EmitError> {
        let pieces: Vec<Piece> = PRELUDE.iter().map(|part| part.piece(plan)).chain(pieces.iter().cloned()).collect();
        Self::from_pieces(entry_point, &pieces, &specialisation(plan, Precision::F32, Form::ROLLED))
    }

    fn from_pieces(
        entry_point: &'static str,
        pieces: &[Piece],
        specialisation: &Specialisation,
    ) -> Result<Self, EmitError> {
        let source = emit(pieces, specialisation)?;
        Ok(Self { entry_point, precision: specialisation.precision, anchored: None, stages: None, source })
    }
}

impl Stages {
    /// Whether the guarded ramp takes several invocations a sample.
    pub fn is_on_lanes(&self) -> bool {
        self.guarded.entry_point == FOLLOW_WITH_CARE.entry_point
    }

    /// Each with its name.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &Kernel)> {
        let others = [
            ("path", &self.path),
            ("guarded", &self.guarded),
            ("check", &self.check),
            ("columns", &self.columns),
            ("columns-again", &self.columns_again),
        ];
        self.anchored.iter().map(|kernel| ("check-anchored", kernel)).chain(others)
    }

    fn new(plan: &Plan, precision: Precision) -> Result<Self, EmitError> {
        let make = |entry: &KernelEntry, form| {
            Kernel::emitted(entry.entry_point, entry.parts, plan, &specialisation(plan, precision, form))
        };
        let quick = Form { guards: false, ..Form::ROLLED };
        let anchored = Form { anchored: true, ..quick };
        let guarded = Form { ramps: false, ..Form::ROLLED };
        let columns = make(&CONCLUDE, quick)?;
        let columns_again = if rotates(plan) { columns.clone() } else { make(&CONCLUDE, Form::ROLLED)? };
        Ok(Self {
            anchored: has_anchors(plan).then(|| make(&APPROACH, anchored)).transpose()?,
            path: make(&FOLLOW, quick)?,
            guarded: match precision {
                Precision::F32 => make(&FOLLOW_WITH_CARE, Form { lanes: true, ..guarded })?,
                Precision::F64 => make(&FOLLOW, guarded)?,
            },
            check: make(&APPROACH, quick)?,
            columns,
            columns_again,
        })
    }
}

impl Part {
    fn piece(&self, plan: &Plan) -> Piece {
        match self {
            Part::File(piece) => piece.clone(),
            Part::Record => record_functions(plan),
            Part::Sources => source_functions(plan),
        }
    }
}

fn pieces(parts: &[&[Part]], plan: &Plan) -> Vec<Piece> {
    parts.iter().copied().flatten().map(|part| part.piece(plan)).collect()
}
