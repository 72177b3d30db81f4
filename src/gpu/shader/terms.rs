//! Terms and constants that a plan fixes in the shaders.

use super::anchors::add_anchors;
use super::derivative_terms::{add_columns, add_derivative_terms, has_integrals};
use super::nodes::add_nodes;
use super::segments::{careful_steps, integrated, path_steps};
use super::settings::{HANDOVER_COUNT, ITERATION_BUDGET, LANES, WORKGROUP_SIZE};
use super::slots::{add_slots, slot_count};
use super::sources::{add_sources, forward_threes};
use super::specialise::{Specialisation, Value};
use super::tableaux::{add_tableaux, tableaux};
use super::varying::add_varying;
use crate::backend::Precision;
use crate::model::tolerances;
use crate::model::{BLOCK, MOST_KNOWN, NO_EQUILIBRIUM, Plan, Quantity, SegmentPlan, Status, step_at};

/// What a kernel is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// `RAMPS`: it knows the ramp of few load steps.
    pub ramps: bool,
    /// `GUARDS`: it knows the guarded ramp.
    pub guards: bool,
    /// `LANES`: several invocations share a sample, each with a column of its own.
    pub lanes: bool,
    /// `UNROLLED`: each column has code of its own. Registers of a processor hold numbers only where code names them; a GPU
    /// runs out of room for the code.
    pub unrolled: bool,
    /// `NODES`: it solves by nodes all along the rod.
    pub nodes: bool,
    /// `ANCHORED`: it starts from anchors and leaves what they do not certify to another.
    pub anchored: bool,
}

impl Form {
    /// The whole kernel, its loops over columns as they are.
    pub const ROLLED: Form =
        Form { ramps: true, guards: true, lanes: false, unrolled: false, nodes: false, anchored: false };
}

/// Passes of a guarded ramp that is a kernel of its own: one in twenty takes more, folds among them, and holds up all others.
/// Second attempts on the CPU take those.
const GUARDED_PASSES: f64 = 64.0;

/// Intervals of the stability index over a segment at least, where it has as many steps.
const STATIONS_EACH: usize = 8;

/// Terms and constants of a plan.
///
/// Terms: those of `Terms` in capitals; `FREE`, `RIGID_FORCE_ARM`, `FORWARD`, `RECIPROCITY`; for each segment j
/// `FLEXIBLE[j]`; for tableau r `A[r][i][j]`, `B[r][i]`, where not zero; for the slots to
/// differentiate by `WANT_TIP_FORCE` and so on; for what the columns leave behind `COLLECT_STRAIN` and so on; for what
/// forward columns need `SOURCE_BEND` and so on. Those of the form.
pub fn specialisation(plan: &Plan, precision: Precision, form: Form) -> Specialisation {
    let mut s = Specialisation::new(precision);
    let number = |value: usize| Value::U32(value as u32);
    s.constant("WORKGROUP", Value::U32(WORKGROUP_SIZE));
    s.constant("BLOCK", number(BLOCK));
    s.constant("INPUT_COUNT", number(plan.input_count));
    s.constant("OUTPUT_COUNT", number(plan.output_count()));
    s.constant("DERIVATIVE_COLUMN", number(Quantity::COUNT));
    s.constant("DERIVATIVE_COUNT", number(plan.derivatives.len()));
    s.constant("ROWS", number(plan.rows()));
    add_columns(&mut s, plan, form.guards);
    s.term("UNROLLED", form.unrolled);
    for (name, quantity) in COLUMNS {
        s.constant(format!("{name}_COLUMN"), number(quantity.column()));
    }
    for status in Status::ALL {
        let name = format!("STATUS_{}", status.name().to_uppercase().replace('-', "_"));
        s.constant(name, Value::U32(u32::from(status.code())));
    }
    for (name, holds) in [
        ("F64", precision == Precision::F64),
        ("FORCE", plan.terms.force),
        ("LOAD", plan.terms.load),
        ("MAGNET", plan.terms.magnet),
        ("SHEAR", plan.terms.shear),
        ("TAPER", plan.terms.taper),
        ("CURVATURE_RISE", plan.terms.curvature_rise),
        ("ANISOTROPIC", plan.terms.anisotropic),
        ("LOAD_WITHOUT_ENERGY", plan.terms.load_without_energy),
        ("DIPOLE", plan.terms.dipole),
        ("RIGID", integrated(plan).iter().any(|segment| !segment.is_flexible)),
        ("FREE", plan.free.is_some()),
        ("RIGID_FORCE_ARM", plan.scene.rigid_force_arm),
        ("FORCE_WITHOUT_ARM", plan.terms.force && !plan.scene.rigid_force_arm),
        ("FORWARD", plan.forward),
    ] {
        s.term(name, holds);
    }
    add_segments(&mut s, plan);
    add_slots(&mut s, plan);
    add_sources(&mut s, plan);
    let tableaux = tableaux(plan, form.nodes);
    add_tableaux(&mut s, &tableaux);
    add_derivative_terms(&mut s, plan, &tableaux);
    add_nodes(&mut s, plan, form.nodes);
    add_varying(&mut s, plan);
    add_anchors(&mut s, plan, form.anchored);
    let limit = pass_limit(plan);
    add_path(&mut s, plan, if form.ramps { limit } else { limit.min(GUARDED_PASSES) });
    s.term("RAMPS", form.ramps);
    s.term("LANES", form.lanes);
    s.constant("LANES", Value::U32(LANES));
    s.constant("COLUMN_COUNT", Value::U32(if form.lanes { 1 } else { 3 }));
    s.constant("FIRST_PATH", Value::U32(u32::from(!form.ramps)));
    s.constant("LAST_PATH", Value::U32(u32::from(form.guards)));
    s.constant("HANDOVER_COUNT", number(HANDOVER_COUNT));
    s
}

const COLUMNS: [(&str, Quantity); 13] = [
    ("TIP_POSITION", Quantity::TipPosition),
    ("TIP_D1", Quantity::TipD1),
    ("TIP_TANGENT", Quantity::TipTangent),
    ("BASE_MOMENT", Quantity::BaseMoment),
    ("RESIDUAL", Quantity::Residual),
    ("ERROR_ESTIMATE", Quantity::ErrorEstimate),
    ("STABILITY_MARGIN", Quantity::StabilityMargin),
    ("STABILITY_INDEX", Quantity::StabilityIndex),
    ("ITERATIONS", Quantity::Iterations),
    ("LOAD_FRACTION", Quantity::LoadFraction),
    ("LOAD_FRACTION_ERROR", Quantity::LoadFractionError),
    ("STATUS", Quantity::Status),
    ("DERIVATIVE_ERROR", Quantity::DerivativeError),
];

fn add_segments(s: &mut Specialisation, plan: &Plan) {
    let segments = integrated(plan);
    let fine = segments.iter().map(|segment| segment.steps);
    s.constant("SEGMENT_COUNT", Value::U32(segments.len() as u32));
    s.constant("STEPS", Value::u32_array(fine));
    s.constant("COARSE_STEPS", Value::u32_array(path_steps(plan)));
    s.constant("CAREFUL_STEPS", Value::u32_array(careful_steps(plan)));
    s.constant("STATIONS_EACH", Value::U32(STATIONS_EACH as u32));
    s.constant("FIRST_ENTRY", Value::u32_array(segments.iter().map(|segment| segment.record)));
    let flags = |(index, segment): (usize, &SegmentPlan)| {
        let flags = [
            segment.is_flexible,
            segment.tapers,
            segment.shears && plan.terms.shear,
            segment.has_magnet,
            has_integrals(plan, index),
            plan.terms.varying_field && segment.has_dipole,
        ];
        flags.iter().enumerate().map(|(bit, holds)| usize::from(*holds) << bit).sum()
    };
    s.constant("FLAGS", Value::u32_array(segments.iter().enumerate().map(flags)));
    for (bit, name) in
        ["IS_FLEXIBLE", "TAPERS", "SHEARS", "HAS_MAGNET", "HAS_INTEGRALS", "HAS_DIPOLE"].iter().enumerate()
    {
        s.constant(*name, Value::U32(1 << bit));
    }
    let is_graded = segments.iter().any(|segment| segment.grading != 0);
    s.term("GRADED", is_graded);
    if is_graded {
        let fine: Vec<usize> = segments.iter().map(|segment| segment.steps).collect();
        let check = fine.iter().map(|steps| 2 * steps).collect();
        let grids = [("COARSE", path_steps(plan)), ("CAREFUL", careful_steps(plan)), ("", fine), ("CHECK", check)];
        for (grid, steps) in grids {
            let ratios: Vec<f64> = segments.iter().zip(&steps).map(|(segment, n)| segment.step_ratio(*n)).collect();
            let firsts: Vec<f64> = ratios.iter().zip(&steps).map(|(ratio, n)| step_at(*ratio, 0, *n).1).collect();
            s.constant(format!("{grid}_RATIO").trim_start_matches('_'), Value::float_array(ratios));
            s.constant(format!("{grid}_FIRST").trim_start_matches('_'), Value::float_array(firsts));
        }
    }
    for (index, segment) in segments.iter().enumerate() {
        s.term(format!("FLEXIBLE[{index}]"), segment.is_flexible);
    }
}

/// How to follow the path, as the CPU engine does; passes are fewer where loops may not run as long.
fn add_path(s: &mut Specialisation, plan: &Plan, most_passes: f64) {
    let numbers = [
        ("PATH_TOLERANCE", tolerances::PATH_TOLERANCE),
        ("CONTRACTION", tolerances::CONTRACTION),
        ("LOAD_STEP_TOLERANCE", tolerances::LOAD_STEP_TOLERANCE),
        ("FULL_LOAD_TOLERANCE", tolerances::FULL_LOAD_TOLERANCE),
        ("TRUST", plan.options.pace * tolerances::TRUST),
        ("FINE_TRUST", tolerances::FINE_TRUST),
        ("NEARBY", tolerances::NEARBY),
        ("CORRECTIONS", tolerances::CORRECTIONS),
        ("DEPARTURE", tolerances::DEPARTURE),
        ("DEPARTURE_AIM", tolerances::DEPARTURE_AIM),
        ("FIRST_BEND", plan.options.pace * tolerances::FIRST_BEND),
        ("RETREATS", tolerances::RETREATS),
        ("NEAR_MARGIN", tolerances::NEAR_MARGIN),
        ("SPENT", tolerances::SPENT),
        ("WIDENING", tolerances::WIDENING),
        ("AIM", tolerances::AIM),
        ("LEAST_RATIO", tolerances::LEAST_RATIO),
        ("MOST_RATIO", tolerances::MOST_RATIO),
        ("RETREAT", tolerances::RETREAT),
        ("SMALLEST_RAMP_STEP", tolerances::SMALLEST_RAMP_STEP),
        ("SMALLEST_GUARDED_STEP", tolerances::SMALLEST_GUARDED_STEP),
        ("SMALLEST_UNSYMMETRIC_STEP", tolerances::SMALLEST_UNSYMMETRIC_STEP),
        ("PASS_LIMIT", most_passes),
        ("SAFE_MARGIN", tolerances::SAFE_MARGIN),
        ("NARROW_MARGIN", tolerances::NARROW_MARGIN),
        ("FOLD_MARGIN", tolerances::FOLD_MARGIN),
        ("INDEX_NOISE", tolerances::INDEX_NOISE),
        ("UNBUCKLED", tolerances::UNBUCKLED),
        ("NO_EQUILIBRIUM", NO_EQUILIBRIUM),
        ("SEARCH_LIMIT", tolerances::SEARCH_LIMIT),
        ("SEARCH_STEP", tolerances::SEARCH_STEP),
        ("CHORD_TRUST", tolerances::CHORD_TRUST),
        ("SECOND_ORDER", tolerances::SECOND_ORDER),
        ("SHORTEST_INTERVAL", tolerances::SHORTEST_INTERVAL),
        ("EPSILON", s.precision.epsilon()),
        ("DIFFERENCE", tolerances::DIFFERENCE),
        ("ROUND_OFF", tolerances::ROUND_OFF),
        ("ROUNDED", tolerances::rounded(s.precision.epsilon(), plan.step_count())),
        ("COLUMN_NOISE", tolerances::COLUMN_NOISE),
        ("NODE_FLOOR", tolerances::NODE_FLOOR),
        ("FIELD_COLUMN_NOISE", tolerances::FIELD_COLUMN_NOISE),
        ("STAGE_NOISE", plan.stage_noise(s.precision.epsilon())),
        ("BEND_NOISE", plan.bend_noise()),
        ("LITTLE_TURN", tolerances::LITTLE_TURN),
        ("GROWTH_NOISE", tolerances::GROWTH_NOISE),
        ("REACH", tolerances::REACH),
    ];
    for (name, value) in numbers {
        s.constant(name, Value::Float(value));
    }
    s.term("SEARCH", plan.start.is_some());
    s.constant("MOST_KNOWN", Value::U32(MOST_KNOWN as u32));
    s.constant("CHORD_LIMIT", Value::U32(tolerances::CHORD_LIMIT as u32));
    s.constant("NEWTON_LIMIT", Value::U32(tolerances::NEWTON_LIMIT as u32));
}

/// Passes over the rod on one path, such that an invocation never exceeds the iterations that drivers run.
///
/// Samples that share a register also share its loops, whichever of them needs an iteration.
pub(crate) fn pass_limit(plan: &Plan) -> f64 {
    let segments = integrated(plan);
    let steps: usize = segments.iter().map(|segment| segment.steps).sum();
    let path_steps: usize = path_steps(plan).iter().sum();
    let careful_steps: usize = careful_steps(plan).iter().sum();
    let pass = |steps: usize| 1 + segments.len() + steps;
    // Loops over derivatives and their slots: for the rows, and while the columns pass over the segments.
    let gathered = plan.derivatives.len() + slot_count(plan);
    let rows = match forward_threes(plan) {
        0 => gathered,
        threes => threes + (threes - 1) * pass(steps),
    };
    let attempt = (tolerances::CHORD_LIMIT + 1) * pass(steps)
        + 2 * pass(2 * steps)
        + tolerances::NEWTON_LIMIT * (pass(steps) + gathered);
    let direct = (2 + tolerances::CORRECTIONS as usize) * pass(path_steps);
    // Each of the three paths may be the first that leads to an unstable equilibrium.
    let fixed = rows + 2 * pass(path_steps) + 3 * attempt + direct;
    // Both ramps in the first attempt, both in the second, the guarded one in the third; each pass with its index.
    let left = ITERATION_BUDGET.saturating_sub(fixed) / (2 * pass(path_steps) + 3 * pass(careful_steps));
    tolerances::PASS_LIMIT.min(left as f64)
}
