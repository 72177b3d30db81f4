// From the path onto the fine grid without columns, and the error estimate, whose pass is the last step there. R4
// src/lanes/chord.rs

const CHORD_LIMIT: u32 = 0u; //@spec
const CHORD_TRUST: f32 = 0.0; //@spec
const DIFFERENCE: f32 = 0.0; //@spec
const ROUND_OFF: f32 = 0.0; //@spec

// Moves the base moment to the fine grid's equilibrium by steps with the path's inverse of W.
//
// From the second on they are secant steps along the one before (Broyden's update). The last is one on twice the
// fine steps; returns what it found. Where nothing `moves`, that is the only pass, and no step follows from it. All
// passes are one call: the code of a pass is long, and processors keep little of it at hand.
fn chord_steps(rod: Rod, end: ptr<function, PathEnd>, moves: bool) -> Tip {
    var tip: Tip;
    var last = vec3<f32>();
    var square = 1.0;
    // The nearer to a bifurcation, the less a step brings.
    let tolerance = margin((*end).inverse) * settings.chord_tolerance;
    var moving = moves && (*end).reached;
    var trusted = moving;
    for (var i = 0u; i <= CHORD_LIMIT; i++) {
        let checks = !moving || i == CHORD_LIMIT;
        tip = shoot(select(FINE, CHECK, checks), rod, 1.0, (*end).m0, NO_COLUMNS, false);
        let delta = chord_step((*end).inverse, tip.m - rod.l_tip, last, square);
        let size = length(delta);
        // A chord step that is not small says that the coarse grid was too coarse: Newton's method takes over.
        trusted = trusted && size < CHORD_TRUST;
        if trusted { (*end).m0 = (*end).m0 + delta; }
        if moves && (*end).reached { (*end).passes = (*end).passes + 1.0; }
        if checks { break; }
        last = delta;
        square = dot(delta, delta);
        moving = trusted && size >= tolerance;
    }
    return tip;
}

// A step with the path's inverse, corrected by the one before and its square.
fn chord_step(inverse: mat3x3<f32>, residual: vec3<f32>, last: vec3<f32>, square: f32) -> vec3<f32> {
    let delta = -(inverse * residual);
    return delta * (1.0 / (1.0 - dot(last, delta) / square));
}

// Difference to the equilibrium on twice as many steps, by a pass `check` near it, plus what round-off can do through
// dm0/dr.
fn error_estimate(
    rod: Rod, m0: vec3<f32>, check: Tip, by_moment: Columns, w_inverse: mat3x3<f32>,
    p: vec3<f32>, d1: vec3<f32>, t: vec3<f32>,
) -> f32 {
    let delta = -(w_inverse * (check.m - rod.l_tip));
    let turn = by_moment.w * delta;
    let dp = length(check.p + by_moment.dp * delta - p) / rod.length;
    let dd1 = length(check.d1 + cross(turn, check.d1) - d1);
    let dt = length(check.t + cross(turn, check.t) - t);
    let response = transpose(by_moment.w * w_inverse);
    let amplification = length(response[0]) + length(response[1]) + length(response[2]);
    let round_off = (1.0 + amplification) * (ROUND_OFF * EPSILON);
    return max(max(dp, dd1), dt) * DIFFERENCE + round_off * (1.0 + length(m0));
}
