//! What a plan fixes in the kernel for fields that vary in space, how long a sample takes and how much memory it needs.

use super::segments::{careful_steps, field_entries, integrated, path_steps};
use super::settings::ITERATION_BUDGET;
use super::slots::slots;
use super::specialise::{Specialisation, Value};
use crate::model::{CoilLoad, Entry, FIELD_DIPOLE_RECORD, FIELD_RECORD, Plan, Slot, tolerances};

/// Numbers of a sample, and of each of its intervals; `shaders/rod/field/memory.wgsl` says which they are.
const HEAD_NUMBERS: usize = 147;
const INTERVAL_NUMBERS: usize = 145;
/// Iterations of a turn for each interval besides those over stages and sources, where columns are no loops: elimination.
const LOOPS: usize = 8;

/// What a sample holds on the device (bytes).
pub(crate) fn varying_bytes(plan: &Plan) -> u64 {
    ((HEAD_NUMBERS + most_intervals(plan) * INTERVAL_NUMBERS) * size_of::<f32>()) as u64
}

/// Turns that a sample takes at most, without care and then with it.
pub(crate) fn most_turns(plan: &Plan) -> usize {
    // A load step that converges takes a second pass, for stability.
    let on_path = 1 + 2 * tolerances::NODE_PASS_LIMIT as usize;
    let answer = tolerances::FIELD_NEWTON_LIMIT as usize + 2;
    2 * (on_path + answer) + plan.derivatives.len().div_ceil(3)
}

/// Whether no turn exceeds the iterations that software runs.
pub(crate) fn fits(plan: &Plan) -> bool {
    let stages = plan.options.stepper.tableau().b.len();
    let sources = dipoles(plan).max(1);
    let evaluations = if plan.terms.magnet { stages * sources } else { 1 };
    // State and columns by parameters, or the columns of a transfer, each at every source; then the sources once more.
    let step = LOOPS + 5 + 4 * evaluations + sources;
    let rigid = LOOPS + 5 + 10 * points(plan).len() * sources;
    let steps: usize = integrated(plan).iter().map(|segment| 2 * segment.steps).sum();
    steps.max(most_intervals(plan)) * step + integrated(plan).len() * (1 + rigid) + sources <= ITERATION_BUDGET
}

/// Intervals of a pass with transfers: steps, and rigid segments.
fn most_intervals(plan: &Plan) -> usize {
    let segments = integrated(plan);
    let answer = segments.iter().map(|segment| segment.steps).sum::<usize>();
    let most = answer.max(path_steps(plan).iter().sum()).max(careful_steps(plan).iter().sum());
    most + segments.iter().filter(|segment| !segment.is_flexible).count()
}

fn dipoles(plan: &Plan) -> usize {
    plan.scene.rod().field.map_or(0, |field| field.dipoles.len())
}

/// The middle of a rigid segment, for the path, then the points where the field acts.
fn points(plan: &Plan) -> Vec<(f64, f64)> {
    [CoilLoad::Middle.points(), plan.scene.sources.coil_load.points()].concat()
}

/// Terms and constants of the kernel; other kernels have the term `VARYING_FIELD`, too.
pub(super) fn add_varying(s: &mut Specialisation, plan: &Plan) {
    s.term("VARYING_FIELD", plan.terms.varying_field);
    if !plan.terms.varying_field {
        return;
    }
    let number = |value: usize| Value::U32(value as u32);
    let wants = |test: fn(&Slot) -> bool| slots(plan).any(|(_, slot, _)| test(&slot));
    let gradient = field_entries(plan).take(5).any(|entry| plan.entries[entry] != Entry::Constant(0.0));
    let by_load = plan.forward && wants(|slot| matches!(slot, Slot::Load(..)));
    s.term("GRADIENT", gradient || wants(|slot| matches!(slot, Slot::FieldGradient(_) | Slot::FieldOrigin(_))));
    s.term("SOURCES", dipoles(plan) > 0);
    s.term("N_VARIES", plan.terms.load || plan.terms.magnet);
    s.term("DN_VARIES", plan.terms.magnet || by_load);
    s.term("BEYOND_RIGID", plan.first_beyond_rigid().is_some());
    // The force at the base is unknown; what loads the tip stands for itself.
    s.term("SOURCE_FORCE", false);
    s.constant("FIRST_FLEXIBLE", number(plan.first_beyond_rigid().unwrap_or(0)));
    s.constant("HEAD_NUMBERS", number(HEAD_NUMBERS));
    s.constant("INTERVAL_NUMBERS", number(INTERVAL_NUMBERS));
    s.constant("FIELD_RECORD", number(FIELD_RECORD));
    s.constant("FIELD_DIPOLE_RECORD", number(FIELD_DIPOLE_RECORD));
    s.constant("DIPOLE_COUNT", number(dipoles(plan).max(1)));
    let clearances = plan.scene.rod().field.map_or(Vec::new(), |field| field.dipoles);
    let clearances: Vec<f64> = clearances.iter().map(|dipole| dipole.clearance / plan.units.length).collect();
    s.constant("CLEARANCES", Value::float_array(if clearances.is_empty() { vec![0.0] } else { clearances }));
    s.constant("POINT_COUNT", number(points(plan).len()));
    s.constant("POINTS", Value::float_array(points(plan).iter().map(|(at, _)| *at)));
    s.constant("POINT_SHARES", Value::float_array(points(plan).iter().map(|(_, share)| *share)));
    for (name, value) in [
        ("FIELD_CHORD_LIMIT", tolerances::FIELD_CHORD_LIMIT),
        ("LITTLE_LOAD", tolerances::LITTLE_LOAD),
        ("FIELD_LITTLE_STEP", tolerances::FIELD_LITTLE_STEP),
        ("FIELD_LOAD_TOLERANCE", tolerances::FIELD_LOAD_TOLERANCE),
        ("PATH_TOLERANCE", tolerances::PATH_TOLERANCE),
        ("FIELD_SOFT", tolerances::FIELD_SOFT),
        ("FIELD_SOFT_RATIO", tolerances::FIELD_SOFT_RATIO),
        ("FIELD_TOLERANCE", tolerances::FIELD_TOLERANCE),
        ("FIELD_TELLING", tolerances::FIELD_TELLING),
        ("FIELD_NEAR_MARGIN", tolerances::FIELD_NEAR_MARGIN),
        ("NEAR_MARGIN", tolerances::NEAR_MARGIN),
        ("SPENT", tolerances::SPENT),
        ("FIELD_NEWTON_LIMIT", tolerances::FIELD_NEWTON_LIMIT),
    ] {
        s.constant(name, Value::Float(value));
    }
}
