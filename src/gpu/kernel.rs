//! The kernels: entry points, the pieces they are made of, and what a plan fixes in them.

use super::emit::{EmitError, Source, emit};
use super::record::record_functions;
use super::sources::source_functions;
use super::specialise::Piece;
use super::terms::specialisation;
use crate::backend::Precision;
use crate::model::{Plan, Quantity, ROWS};
use std::borrow::Cow;

/// Invocations of a workgroup; a block of samples is a multiple.
pub const WORKGROUP_SIZE: u32 = 64;

/// A shader file, compiled in.
macro_rules! shader {
    ($stem:literal) => {
        Part::File(Piece {
            name: Cow::Borrowed(concat!("shaders/", $stem, ".wgsl")),
            text: Cow::Borrowed(include_str!(concat!("../../shaders/", $stem, ".wgsl"))),
        })
    };
}

/// One part of a kernel's source.
#[derive(Clone, Debug)]
pub enum Part {
    File(Piece),
    /// The functions that load a sample's record, generated for the plan.
    Record,
    /// The functions that load what parameters change, likewise.
    Sources,
}

/// A row of the kernel table.
#[derive(Clone, Debug)]
pub struct KernelEntry {
    pub entry_point: &'static str,
    /// In the order in which they are joined.
    pub parts: &'static [Part],
}

/// Every kernel. The first solves a batch.
pub const KERNELS: &[KernelEntry] = &[KernelEntry {
    entry_point: "solve",
    parts: &[
        shader!("batch"),
        Part::Record,
        shader!("plan"),
        shader!("algebra"),
        shader!("rod"),
        shader!("section"),
        shader!("step"),
        shader!("column"),
        shader!("source"),
        Part::Sources,
        shader!("trace"),
        shader!("base"),
        shader!("shoot"),
        shader!("stability"),
        shader!("slots"),
        shader!("rows"),
        shader!("path"),
        shader!("search"),
        shader!("solve"),
    ],
}];

/// Layout and loading of a sample's numbers: what every kernel starts with.
pub(super) const PRELUDE: &[Part] = &[shader!("batch"), Part::Record];

/// A kernel specialised for a plan.
#[derive(Clone, Debug)]
pub struct Kernel {
    pub entry_point: &'static str,
    pub precision: Precision,
    pub source: Source,
}

impl Kernel {
    /// A row of the table, specialised.
    pub fn new(entry: &KernelEntry, plan: &Plan, precision: Precision) -> Result<Self, EmitError> {
        let pieces: Vec<Piece> = entry.parts.iter().map(|part| part.piece(plan)).collect();
        Self::from_pieces(entry.entry_point, &pieces, plan, precision)
    }

    /// An f32 kernel of its own pieces after the prelude, for tests and trials.
    pub fn custom(entry_point: &'static str, pieces: &[Piece], plan: &Plan) -> Result<Self, EmitError> {
        let pieces: Vec<Piece> = PRELUDE.iter().map(|part| part.piece(plan)).chain(pieces.iter().cloned()).collect();
        Self::from_pieces(entry_point, &pieces, plan, Precision::F32)
    }

    fn from_pieces(
        entry_point: &'static str,
        pieces: &[Piece],
        plan: &Plan,
        precision: Precision,
    ) -> Result<Self, EmitError> {
        let source = emit(pieces, &specialisation(plan, precision))?;
        Ok(Self { entry_point, precision, source })
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

/// Columns of the solutions of a plan.
pub(super) fn output_count(plan: &Plan) -> usize {
    Quantity::COUNT + ROWS * plan.derivatives.len()
}
