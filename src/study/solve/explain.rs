//! The plan that a scene is compiled to, and what it costs.

use super::{SolveError, Solved};
use crate::backend::{Backend, Precision};
use crate::cpu::{Cpu, Operations};
use crate::draw::{TextTable, engineering};
use crate::model::tolerances::PATH_STEPPER;
use crate::model::{FieldMap, Plan, SegmentPlan, Units};
use serde_json::{Value, json};
use std::fmt;

/// The plan of a scene: what is modelled, how it is differentiated, what a pass over the rod costs.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Explanation {
    /// What solves it, in words.
    pub engine: String,
    /// What may be modelled beyond bending and twisting, and whether it is.
    pub terms: Vec<(&'static str, bool)>,
    /// Number of parameters that it is differentiated by.
    pub derivative_count: usize,
    /// Whether each derivative has a column of its own; else all follow from `column_count` columns by reciprocity.
    pub is_forward: bool,
    /// Columns that derivatives take beyond the three by base moment.
    pub column_count: usize,
    /// Units in which the engine computes.
    pub units: Units,
    /// Distal segments that nothing loads; their shape is closed form.
    pub at_rest: Vec<String>,
    /// Fields sampled on grids, and how well they obey Maxwell's equations.
    pub maps: Vec<String>,
    /// The pieces of the segments, from the base.
    pub pieces: Vec<PlannedPiece>,
    /// The rungs of the CPU's ladder that the sample has taken, in their order; the last one has ended it.
    pub rungs: Vec<String>,
    /// Kinds of passes over the rod, and what each costs; none are counted in a field that varies in space.
    pub passes: Vec<PlannedPass>,
}

/// A piece of a segment, between two nodes of its stiffness or rest curvature.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlannedPiece {
    /// Name of the segment.
    pub segment: String,
    /// Its place in the segment, from 0.
    pub place: usize,
    /// Whether it bends.
    pub is_flexible: bool,
    /// Whether it is integrated; else it is rigid or at rest.
    pub is_integrated: bool,
    /// Steps that the plan has for it.
    pub steps: usize,
    /// What is particular about it, such as `dipole`.
    pub traits: Vec<&'static str>,
}

/// One kind of pass over the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlannedPass {
    /// What it is for.
    pub name: &'static str,
    /// Its method of integration.
    pub stepper: &'static str,
    /// Steps over the whole rod.
    pub steps: usize,
    /// Derivatives that go along.
    pub columns: usize,
    /// Its arithmetic, counted.
    pub operations: Operations,
}

impl Solved {
    /// The plan that the scene was compiled to, with the operations that it takes.
    ///
    /// # Errors
    ///
    /// A plan that the CPU engine, which counts, does not model.
    pub fn explain(&self) -> Result<Explanation, SolveError> {
        Explanation::of(self)
    }
}

impl Explanation {
    fn of(solved: &Solved) -> Result<Explanation, SolveError> {
        let plan = solved.plan();
        let derivative_count = plan.derivatives.len();
        Ok(Explanation {
            engine: solved.engine().into(),
            terms: terms(plan).into(),
            derivative_count,
            is_forward: plan.forward,
            column_count: derivative_columns(plan),
            units: plan.units,
            at_rest: segments_at_rest(solved),
            maps: solved.scene().sources.maps.iter().map(FieldMap::summary).collect(),
            pieces: pieces(solved),
            rungs: rungs(solved)?,
            passes: passes(solved)?,
        })
    }

    /// All of it as JSON.
    pub fn to_json(&self) -> Value {
        let terms: serde_json::Map<String, Value> =
            self.terms.iter().map(|(name, holds)| (name.replace(' ', "_"), json!(holds))).collect();
        let pass = |pass: &PlannedPass| {
            json!({
                "pass": pass.name,
                "stepper": pass.stepper,
                "steps": pass.steps,
                "columns": pass.columns,
                "additions": pass.operations.additions,
                "multiplications": pass.operations.multiplications,
                "fused": pass.operations.fused,
                "divisions": pass.operations.divisions,
                "operations": pass.operations.total(),
            })
        };
        json!({
            "engine": self.engine,
            "terms": terms,
            "derivatives": self.derivative_count,
            "sensitivity": if self.is_forward { "forward" } else { "reciprocity" },
            "at_rest": self.at_rest,
            "rungs": self.rungs,
            "steps": self.pieces.iter().map(|piece| piece.steps).collect::<Vec<_>>(),
            "passes": self.passes.iter().map(pass).collect::<Vec<_>>(),
        })
    }

    fn terms_that(&self, hold: bool) -> String {
        let names: Vec<&str> = self.terms.iter().filter(|(_, holds)| *holds == hold).map(|(name, _)| *name).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    }

    fn derivatives(&self) -> String {
        match self.derivative_count {
            0 => "none".into(),
            count if self.is_forward => format!("{count} by forward columns, one each"),
            count => format!("{count} by reciprocity, from {} columns more, whatever their number", self.column_count),
        }
    }
}

/// What a plan may model beyond bending and twisting: name, and whether it does.
fn terms(plan: &Plan) -> [(&'static str, bool); 11] {
    let terms = &plan.terms;
    [
        ("coils", terms.dipole),
        ("permanent magnets", terms.magnet),
        ("a field that varies in space", plan.scene.sources.varies()),
        ("internal force", terms.force || terms.varying_field),
        ("weight or force per length", terms.load),
        ("tip moment", terms.load_without_energy),
        ("different bending about x and y", terms.anisotropic),
        ("stiffness along a segment", terms.taper),
        ("rest curvature along a segment", terms.curvature_rise),
        ("shear and stretch", terms.shear),
        ("a wall that the tip may touch", terms.wall),
    ]
}

/// Beyond those by base moment: one a parameter, or by tip force and, for rows of the base moment, by base rotation.
fn derivative_columns(plan: &Plan) -> usize {
    match plan.derivatives.len() {
        0 => 0,
        count if plan.forward => count,
        _ if plan.options.base_moment_rows => 6,
        _ => 3,
    }
}

fn segments_at_rest(solved: &Solved) -> Vec<String> {
    let (scene, first) = (solved.scene(), solved.plan().free.map_or(usize::MAX, |free| free.segment));
    let is_at_rest = |index: &usize| scene.piece_indices(*index).start >= first;
    (0..scene.segments.len()).filter(is_at_rest).map(|index| scene.segments[index].name.clone()).collect()
}

fn pieces(solved: &Solved) -> Vec<PlannedPiece> {
    let plan = solved.plan();
    let first_at_rest = plan.free.map_or(usize::MAX, |free| free.segment);
    let mut pieces = Vec::new();
    for (index, segment) in solved.scene().segments.iter().enumerate() {
        for (place, at) in solved.scene().piece_indices(index).enumerate() {
            let of = &plan.segments[at];
            pieces.push(PlannedPiece {
                segment: segment.name.clone(),
                place,
                is_flexible: of.is_flexible,
                is_integrated: of.is_flexible && at < first_at_rest,
                steps: of.steps,
                traits: traits(of),
            });
        }
    }
    pieces
}

fn traits(segment: &SegmentPlan) -> Vec<&'static str> {
    let traits = [
        ("dipole", segment.has_dipole),
        ("magnet", segment.has_magnet),
        ("shears", segment.shears),
        ("stiffness varies", segment.tapers),
        ("rest curvature varies", segment.curvature_rises),
    ];
    traits.into_iter().filter(|(_, holds)| *holds).map(|(name, _)| name).collect()
}

/// Of the CPU engine in f64, which follows the sample again.
fn rungs(solved: &Solved) -> Result<Vec<String>, SolveError> {
    let mut engine = Cpu::new(solved.plan(), Precision::F64)?;
    engine.solve(solved.batch())?;
    Ok(engine.rungs().into_iter().map(|rung| rung.rung).collect())
}

fn passes(solved: &Solved) -> Result<Vec<PlannedPass>, SolveError> {
    let plan = solved.plan();
    if plan.terms.varying_field {
        // Its kernels are others, which nothing counts.
        return Ok(Vec::new());
    }
    let counted = Cpu::new(plan, Precision::F64)?.count_operations(solved.batch(), 0);
    let stepper = plan.options.stepper;
    let integrated = plan.free.map_or(plan.segments.len(), |free| free.segment);
    let steps = |of: &dyn Fn(usize) -> usize| plan.segments[..integrated].iter().map(|s| of(s.steps)).sum::<usize>();
    let (coarse, fine) = (steps(&|n| stepper.path_steps(n)), steps(&|n| n));
    let columns = 3 + derivative_columns(plan);
    let pass = |name, stepper, steps, columns, operations| PlannedPass { name, stepper, steps, columns, operations };
    Ok(vec![
        pass("on the path", PATH_STEPPER.name(), coarse, 3, counted.path),
        pass("chord step", stepper.name(), fine, 0, counted.chord),
        pass("answer and Jacobian", stepper.name(), fine, columns, counted.answer),
        pass("error estimate", stepper.name(), 2 * fine, 0, counted.check),
    ])
}

impl fmt::Display for Explanation {
    /// The plan in lines, a table of the pieces, a table of the passes.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "plan")?;
        let mut line = |name: &str, value: String| writeln!(f, "  {name:<16}{value}");
        let Units { length, force, field } = self.units;
        let [length, force, moment, field] = [length, force, self.units.moment(), field].map(engineering);
        line("solved by", self.engine.clone())?;
        line("terms", self.terms_that(true))?;
        line("left out", self.terms_that(false))?;
        line("derivatives", self.derivatives())?;
        line("units", format!("length {length} m, force {force} N, moment {moment} N·m, field {field} T"))?;
        line("rungs", self.rungs.join(", then "))?;
        if !self.at_rest.is_empty() {
            line("at rest", format!("{}: nothing loads it; its shape is closed form", self.at_rest.join(", ")))?;
        }
        for map in &self.maps {
            line("field", map.clone())?;
        }
        let mut segments = TextTable::new(["segment", "piece", "kind", "steps", "with"]);
        for piece in &self.pieces {
            let kind = if piece.is_flexible { "flexible" } else { "rigid" };
            let steps = if piece.is_integrated { piece.steps.to_string() } else { "-".into() };
            let place = (piece.place + 1).to_string();
            segments.row([piece.segment.clone(), place, kind.into(), steps, piece.traits.join(", ")]);
        }
        let mut passes = TextTable::new(["pass", "stepper", "steps", "columns", "+", "x", "fused", "/", "operations"]);
        for PlannedPass { name, stepper, steps, columns, operations } in &self.passes {
            let Operations { additions, multiplications, fused, divisions } = *operations;
            let counts = [additions, multiplications, fused, divisions, operations.total()];
            let mut cells = vec![name.to_string(), stepper.to_string(), steps.to_string(), columns.to_string()];
            cells.extend(counts.iter().map(u64::to_string));
            passes.row(cells);
        }
        if self.passes.is_empty() {
            return write!(f, "{segments}");
        }
        let heading = "operations of a pass over the rod (counted; a fused multiply and add is two)";
        write!(f, "{segments}{heading}\n{passes}")
    }
}
