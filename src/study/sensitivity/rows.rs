//! Rows as a study reads them: part by part, by column, usable or not.

use super::inputs::Input;
use super::options::Options;
use super::outputs::Scalar;
use super::shapes::Shapes;
use crate::model::{Status, Vector};
use crate::results::{Results, ResultsError, Verdict};
use crate::spec::SweepSpec;
use crate::table::{Column, Table};

/// Where rows come from.
#[derive(Clone, Debug)]
pub(super) enum Source {
    Directory(Box<Results>),
    Memory(Box<SweepSpec>, Table),
}

/// Rows with what follows from them: the rod's shape, where an output asks for it.
pub(super) struct Rows<'a> {
    source: &'a Source,
    shapes: Option<Shapes>,
    columns: Vec<Column>,
}

/// Rows of a part.
pub(super) struct Block {
    pub samples: Vec<u64>,
    pub statuses: Vec<Status>,
    /// Whether a row's numbers are taken.
    pub usable: Vec<bool>,
    /// By input.
    pub inputs: Vec<Vec<f64>>,
    /// By scalar; NaN where there is none.
    pub values: Vec<Vec<f64>>,
    /// By scalar and input; empty for a scalar without slopes.
    pub slopes: Vec<Vec<Vec<f64>>>,
    /// By scalar and uncertain number; empty where the rows have none.
    pub uncertain: Vec<Vec<Vec<f64>>>,
}

/// How rows are read.
#[derive(Clone, Copy)]
pub(super) struct Reading<'a> {
    pub inputs: &'a [Input],
    /// Numbers that the rows hold at the scene's values.
    pub uncertain: &'a [Input],
    pub scalars: &'a [Scalar],
    /// Tip to take distances from (m).
    pub nominal: Option<Vector>,
    /// Whether unstable equilibria count.
    pub with_unstable: bool,
}

impl Source {
    /// What speaks against the rows: as their directory says, or whoever gave them.
    pub fn mark(&self, options: &Options) -> Result<Option<String>, ResultsError> {
        match (&options.mark, self) {
            (None, Source::Directory(results)) => Ok(results.verdict()?.and_then(|verdict| verdict.headline())),
            (mark, _) => Ok(mark.clone()),
        }
    }

    /// How many rows were checked against the reference, in a sentence.
    pub fn checked(&self, options: &Options) -> Result<String, ResultsError> {
        let verdict = match self {
            Source::Directory(results) if options.checked.is_none() => results.verdict()?.unwrap_or_default(),
            _ => Verdict::default(),
        };
        Ok(options.checked.clone().unwrap_or_else(|| verdict.checked_sentence()))
    }

    pub fn spec(&self) -> &SweepSpec {
        match self {
            Source::Directory(results) => results.spec(),
            Source::Memory(spec, _) => spec,
        }
    }

    pub fn columns(&self) -> &[Column] {
        match self {
            Source::Directory(results) => results.columns(),
            Source::Memory(_, rows) => &rows.columns,
        }
    }

    pub fn has_rows(&self) -> bool {
        match self {
            Source::Directory(results) => results.has_rows(),
            Source::Memory(..) => true,
        }
    }

    /// Gives every part to `take`, in order of samples, with the named columns at least.
    pub fn each(&self, names: &[String], mut take: impl FnMut(&Table)) -> Result<(), ResultsError> {
        match self {
            Source::Memory(_, rows) => take(rows),
            Source::Directory(results) => {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                for part in results.parts(&names)? {
                    take(&part?);
                }
            }
        }
        Ok(())
    }
}

impl<'a> Rows<'a> {
    pub fn new(source: &'a Source, shapes: Option<Shapes>) -> Rows<'a> {
        let mut columns = source.columns().to_vec();
        columns.extend(shapes.as_ref().map(Shapes::columns).unwrap_or_default());
        Rows { source, shapes, columns }
    }

    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// As [`Source::each`]; where there are shapes, parts of a part.
    pub fn each(&self, names: &[String], mut take: impl FnMut(&Table)) -> Result<(), ResultsError> {
        match &self.shapes {
            Some(shapes) => self.source.each(&shapes.read(names), |rows| shapes.each(rows, &mut take)),
            None => self.source.each(names, take),
        }
    }
}

impl Reading<'_> {
    pub fn read(&self, rows: &Table) -> Block {
        let is_usable = |status: &Status| status.is_success() || self.with_unstable && *status == Status::Unstable;
        let statuses = rows.statuses().to_vec();
        let usable: Vec<bool> = statuses.iter().map(is_usable).collect();
        let by = |scalar: &Scalar, inputs: &[Input]| -> Vec<Vec<f64>> {
            let slopes: Option<Vec<_>> = inputs.iter().map(|input| scalar.slopes(rows, input, self.nominal)).collect();
            slopes.unwrap_or_default()
        };
        let slopes = |scalar: &Scalar| if scalar.has_slopes { by(scalar, self.inputs) } else { Vec::new() };
        Block {
            samples: rows.samples().to_vec(),
            inputs: self.inputs.iter().map(|input| input.values(rows)).collect(),
            values: self.scalars.iter().map(|scalar| scalar.values(rows, &usable, self.nominal)).collect(),
            slopes: self.scalars.iter().map(slopes).collect(),
            uncertain: self.scalars.iter().map(|scalar| by(scalar, self.uncertain)).collect(),
            statuses,
            usable,
        }
    }
}
