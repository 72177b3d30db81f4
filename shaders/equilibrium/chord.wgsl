// From the path onto the fine grid without columns, and the pass on twice the steps, from which the answer comes. R4
// crates/core/src/cpu/equilibrium/chord.rs

const CHORD_LIMIT: u32 = 0u; //@spec
const CHORD_TRUST: f32 = 0.0; //@spec
//@if ANCHORED
const ANCHOR_TRUST: f32 = 0.0; //@spec
const ANCHOR_CONTRACTION: f32 = 0.0; //@spec
//@end
const DIFFERENCE: f32 = 0.0; //@spec
const SECOND_ORDER: f32 = 0.0; //@spec
const ROUND_OFF: f32 = 0.0; //@spec
const BEND_NOISE: f32 = 0.0; //@spec
const LITTLE_TURN: f32 = 0.0; //@spec
const STAGE_NOISE: f32 = 0.0; //@spec
const ROUNDED: f32 = 0.0; //@spec
const COLUMN_NOISE: f32 = 0.0; //@spec
const GROWTH_NOISE: f32 = 0.0; //@spec

// What a pass on twice the fine steps found, and from which base moment.
struct Check {
    m0: vec3<f32>,
    tip: Tip,
}

// Moves the base moment to the fine grid's equilibrium by steps with the path's inverse of W.
//
// From the second on they are secant steps along the one before (Broyden's update). The last is one on twice the
// fine steps; returns what it found. Where nothing `moves`, that is the only pass, and no step follows from it. All
// passes are one call: the code of a pass is long, and processors keep little of it at hand.
//@if ANCHORED
// A sample counts as led there only where its first step is short and each further one much shorter. Where its cell tells it
// `close`, the check is the first.
//@end
fn chord_steps(rod: Rod, end: ptr<function, PathEnd>, moves: bool) -> Check {
    var check: Check;
    var last = vec3<f32>();
    var square = 1.0;
    // The nearer to a bifurcation, the less a step brings.
    let tolerance = margin((*end).inverse) * settings.chord_tolerance;
    var moving = moves && (*end).reached;
    var trusted = moving;
    //@if ANCHORED
    moving = moving && !(*end).close;
    var bound = ANCHOR_TRUST;
    //@end
    for (var i = 0u; i <= CHORD_LIMIT; i++) {
        //@if ANCHORED
        // Samples that need no step before the check wait for their neighbours' first step, so that all of them check together.
        if moves && i == 0u && (*end).close { continue; }
        //@end
        let checks = !moving || i == CHORD_LIMIT;
        check = Check((*end).m0, shoot(select(FINE, CHECK, checks), rod, 1.0, (*end).m0, NO_COLUMNS, false));
        let delta = chord_step((*end).inverse, check.tip.m - rod.l_tip, last, square);
        let size = length(delta);
        // A chord step that is not small says that the coarse grid was too coarse: Newton's method takes over.
        //@if ANCHORED
        trusted = trusted && size < select(bound, ANCHOR_TRUST, checks);
        bound = size * ANCHOR_CONTRACTION;
        // What no chord steps certify goes the way from rest.
        let far = moving || (*end).close && !(size < tolerance);
        if moves && select(!trusted, far, checks) {
            (*end).reached = false;
            break;
        }
        //@else
        trusted = trusted && size < CHORD_TRUST;
        //@end
        if trusted { (*end).m0 = (*end).m0 + delta; }
        if moves && (*end).reached { (*end).passes = (*end).passes + 1.0; }
        if checks { break; }
        last = delta;
        square = dot(delta, delta);
        moving = trusted && size >= tolerance;
    }
    return check;
}

// A step with the path's inverse, corrected by the one before and its square.
fn chord_step(inverse: mat3x3<f32>, residual: vec3<f32>, last: vec3<f32>, square: f32) -> vec3<f32> {
    let delta = -(inverse * residual);
    return delta * (1.0 / (1.0 - dot(last, delta) / square));
}

// The step of the base moment to equilibrium, from a pass with the inverse of W on the fine grid.
fn newton_step(rod: Rod, tip: Tip, w_inverse: mat3x3<f32>) -> vec3<f32> {
    return -(w_inverse * (tip.m - rod.l_tip)); // J5
}

// Base moment and tip, and how far the tip and its derivatives may be from the truth.
struct Answered {
    m0: vec3<f32>,
    p: vec3<f32>,
    d1: vec3<f32>,
    t: vec3<f32>,
    error: f32,
    derivative_error: f32,
}

// The equilibrium on twice the fine steps: `check`, moved to first order by a step of the base moment. On the fine steps it
// is `tip` moved by `back`; where both differ by no more than round-off, fewer steps have less of it.
//
// The error: a share of the difference, the second order of the step, what round-off can do through dm0/dr. That of
// derivatives, whose columns are those at `m0`: see `DerivativeScale`.
fn answer(
    rod: Rod, check: Check, tip: Tip, back: vec3<f32>, by_moment: Columns, m0: vec3<f32>, w: mat3x3<f32>, w_inverse: mat3x3<f32>,
) -> Answered {
    let delta = newton_step(rod, check.tip, w_inverse);
    let answer = check.m0 + delta;
    var moved = moved_tip(check.tip, by_moment, delta);
    let fine = moved_tip(tip, by_moment, back);
    let dp = length(moved.p - fine.p) / rod.length;
    let difference = max(max(dp, length(moved.d1 - fine.d1)), length(moved.t - fine.t));
    let response = transpose(by_moment.w * w_inverse);
    let responses = 1.0 + length(response[0]) + length(response[1]) + length(response[2]);
    let bend = length(check.m0);
    let amplification = responses * (1.0 + bend);
    let is_rounded = difference < amplification * (ROUND_OFF * EPSILON) * ROUNDED;
    if is_rounded { moved = fine; }
    let share = select(settings.error_share, 1.0, is_rounded);
    let turn = by_moment.w * delta;
    let off = answer - m0;
    let second_order = dot(turn, turn) * SECOND_ORDER + amplification * dot(delta, delta);
    let far = max(bend - LITTLE_TURN, 0.0);
    let round_off = (far * (responses * BEND_NOISE) + amplification * STAGE_NOISE) * (ROUND_OFF * EPSILON);
    let error = difference * DIFFERENCE * share + round_off + second_order;
    // Columns are those at the base moment `m0`.
    let margin = margin(w_inverse);
    let both = difference + max(length(off) / margin, length(by_moment.w * off));
    let growth = dot(w[0], w[0]) + dot(w[1], w[1]) + dot(w[2], w[2]);
    let noise = amplification / margin * COLUMN_NOISE + growth * GROWTH_NOISE;
    let derivative_error = max(both * settings.derivative_share, settings.derivative_floor) + noise * EPSILON;
    return Answered(answer, moved.p, moved.d1, moved.t, error, derivative_error);
}

// Position and frame of a tip after a change of the base moment, to first order.
fn moved_tip(tip: Tip, by_moment: Columns, delta: vec3<f32>) -> Tip {
    let turn = by_moment.w * delta;
    return Tip(tip.p + by_moment.dp * delta, tip.d1 + cross(turn, tip.d1), tip.t + cross(turn, tip.t), tip.m, tip.n);
}
