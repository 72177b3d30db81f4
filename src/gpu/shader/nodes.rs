//! What a plan fixes in the kernel by nodes, how long a sample takes and how much memory it needs.

use super::segments::integrated;
use super::settings::ITERATION_BUDGET;
use super::slots::slot_count;
use super::specialise::{Specialisation, Value};
use crate::model::{Plan, tolerances};

/// Numbers of a sample, and of each of its intervals: without derivatives, by forward columns, by reciprocity.
/// `shaders/multiple_shooting/memory.wgsl` says which they are.
const HEAD_NUMBERS: usize = 52;
const BARE_INTERVAL_NUMBERS: usize = 138;
const FORWARD_INTERVAL_NUMBERS: usize = 165;
const RECIPROCAL_INTERVAL_NUMBERS: usize = 174;

/// Steps between two nodes for the answer: as many as it takes. In f32 a method of fourth order needs no more.
const STEPS: [usize; 3] = [2, 4, 8];
/// Iterations of a turn for each interval, besides those over its steps and slots: elimination, changes of the nodes, tip.
const LOOPS: usize = 14;

fn interval_numbers(plan: &Plan) -> usize {
    match (plan.derivatives.is_empty(), plan.forward) {
        (true, _) => BARE_INTERVAL_NUMBERS,
        (false, true) => FORWARD_INTERVAL_NUMBERS,
        (false, false) => RECIPROCAL_INTERVAL_NUMBERS,
    }
}

/// What a sample of so many intervals holds on the device (bytes).
pub(crate) fn node_bytes(plan: &Plan, intervals: usize) -> u64 {
    ((HEAD_NUMBERS + intervals * interval_numbers(plan)) * size_of::<f32>()) as u64
}

/// Intervals such that a turn never exceeds the iterations that software runs; columns are no loops there.
pub(crate) fn most_intervals(plan: &Plan) -> usize {
    ITERATION_BUDGET / (LOOPS + STEPS[STEPS.len() - 1] + slot_count(plan))
}

/// Turns that a sample takes at most: to rest, along its path, for its answer and its rows.
pub(crate) fn most_turns(plan: &Plan) -> usize {
    let answer = STEPS.len() * (tolerances::NODE_CORRECTIONS + 1);
    1 + tolerances::NODE_PASS_LIMIT as usize + answer + plan.derivatives.len().div_ceil(3).max(1)
}

/// Intervals at most of a rod whose errors grow by `growth` powers of e, and that turns at rest (rad) and tapers (powers of e) by `shape`.
pub(crate) fn interval_bound(plan: &Plan, growth: f64, shape: f64, spacing: f64) -> usize {
    let segments = integrated(plan).len() as f64;
    // The shader's sum over panels is a finer one.
    let bound = (1.1 * growth + shape + 2.0 * segments) / spacing + 2.0 * segments + 2.0;
    if bound.is_finite() { bound as usize } else { usize::MAX }
}

/// Terms and constants of the kernel by nodes; other kernels have the terms, too.
pub(super) fn add_nodes(s: &mut Specialisation, plan: &Plan, is_by_nodes: bool) {
    let collects = is_by_nodes && s.terms.get("TRACES").is_some_and(|holds| *holds);
    s.term("NODES", is_by_nodes);
    s.term("DRIVES", !plan.derivatives.is_empty());
    s.term("COLLECTS_RESPONSES", collects);
    s.constant("HEAD_NUMBERS", Value::U32(HEAD_NUMBERS as u32));
    s.constant("INTERVAL_NUMBERS", Value::U32(interval_numbers(plan) as u32));
    s.constant("NODE_LEVELS", Value::U32(STEPS.len() as u32));
    s.constant("NODE_STEPS", Value::u32_array(STEPS));
    let epsilon = s.precision.epsilon();
    let good = tolerances::NODE_GOOD.max(100.0 * epsilon);
    for (name, value) in [
        ("NODE_AIM", tolerances::NODE_AIM),
        ("NODE_COLUMNS_GOOD", good),
        ("NODE_CONTRACTION", tolerances::NODE_CONTRACTION),
        ("NODE_CORRECTIONS", tolerances::NODE_CORRECTIONS as f64),
        ("NODE_FIRST_STEP", tolerances::NODE_FIRST_STEP),
        ("NODE_FOLD_PIVOT", tolerances::NODE_FOLD_PIVOT),
        ("NODE_ENOUGH", 64.0 * epsilon),
        ("NODE_GOOD", good),
        ("NODE_LEAST_RATIO", tolerances::NODE_LEAST_RATIO),
        ("NODE_MOST_RATIO", tolerances::NODE_MOST_RATIO),
        ("NODE_NEAR_PIVOT", tolerances::NODE_NEAR_PIVOT),
        ("SPENT", tolerances::SPENT),
        ("NODE_NEARBY", tolerances::NODE_NEARBY),
        ("NODE_PASS_LIMIT", tolerances::NODE_PASS_LIMIT),
        ("NODE_RETREAT", tolerances::NODE_RETREAT),
        ("NODE_ROUND_OFF", tolerances::NODE_ROUND_OFF),
        ("NODE_SMALLEST_FIRST_STEP", tolerances::NODE_SMALLEST_FIRST_STEP),
        ("NODE_SMALLEST_STEP", tolerances::NODE_SMALLEST_STEP),
        ("NODE_TRUST", plan.options.pace * tolerances::NODE_TRUST),
        ("NODE_USUAL", tolerances::NODE_USUAL),
    ] {
        s.constant(name, Value::Float(value));
    }
}
