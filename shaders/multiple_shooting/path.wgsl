// The path from rest by nodes: load steps on all of them together, each on the stable branch. N4
// crates/core/src/cpu/multiple_shooting/path.rs

const CORRECTIONS: f32 = 0.0; //@spec
const SPENT: f32 = 0.0; //@spec
const WIDENING: f32 = 0.0; //@spec
const NODE_AIM: f32 = 0.0; //@spec
const NODE_CONTRACTION: f32 = 0.0; //@spec
const NODE_FIRST_STEP: f32 = 0.0; //@spec
const NODE_FOLD_PIVOT: f32 = 0.0; //@spec
const NODE_LEAST_RATIO: f32 = 0.0; //@spec
const NODE_MOST_RATIO: f32 = 0.0; //@spec
const NODE_NEAR_PIVOT: f32 = 0.0; //@spec
const NODE_PASS_LIMIT: f32 = 0.0; //@spec
const NODE_RETREAT: f32 = 0.0; //@spec
const NODE_SMALLEST_FIRST_STEP: f32 = 0.0; //@spec
const NODE_SMALLEST_STEP: f32 = 0.0; //@spec
const NODE_TRUST: f32 = 0.0; //@spec

// The size of a step that is no number.
const LOST: f32 = 1e30;

// Where the path goes on after a turn.
const GOES_ON: u32 = 0u;
const REACHED: u32 = 1u;
const AT_FOLD: u32 = 2u;
const EXHAUSTED: u32 = 3u;
const FAILED: u32 = 4u;

// Puts the path at rest, where the nodes are.
fn start_path() {
    hold(LAMBDA, 0.0);
    hold(LAMBDA_BEFORE, 0.0);
    hold(LAMBDA_EARLIER, 0.0);
    hold(LOAD_STEP, NODE_FIRST_STEP);
    hold(GOAL, NODE_FIRST_STEP);
    hold(LAST_LEAST, 1.0);
    hold(WEAKEST, 1.0);
    hold(LAST_SIZE, NODE_TRUST / NODE_CONTRACTION);
    hold(FIRST_SIZE, 0.0);
    hold(NEWTON_STEPS, 0.0);
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let node = held_node(at + NODE);
        hold_node(at + ACCEPTED, node);
        hold_node(at + BEFORE, node);
        hold_node(at + EARLIER, node);
    }
}

// Leads the sample from rest to its full load, a Newton step a turn, after a pass and its step of `size`.
fn follow_nodes(rod: Rod, size: f32) -> u32 {
    let goal = held(GOAL);
    let corrections = held(NEWTON_STEPS);
    // Newton's method leads to other branches from where the energy is not convex.
    let convex = node_index < 0.5;
    let near = least < memory_settings.least_pivot;
    let stable = convex && !near && !leaps(least, held(LAST_LEAST));
    let partial = goal < 1.0;
    let converged = size < narrowed(least) * memory_settings.path_tolerance;
    let contracting = size < held(LAST_SIZE) * NODE_CONTRACTION && corrections < CORRECTIONS;
    let accept = converged && stable;
    let go_on = !converged && contracting && convex;
    let rejected = !accept && !go_on;
    let used = goal - held(LAMBDA);
    let most = affordable(least, held(LAST_LEAST), used, NODE_NEAR_PIVOT, SPENT);
    if accept {
        hold(LAST_LEAST, least);
        hold(WEAKEST, min(held(WEAKEST), least));
        keep();
    }
    let unstable = rejected && converged;
    if accept {
        hold(LAMBDA_EARLIER, held(LAMBDA_BEFORE));
        hold(LAMBDA_BEFORE, held(LAMBDA));
        hold(LAMBDA, goal);
    }
    let lambda = held(LAMBDA);
    if corrections < 0.5 { hold(FIRST_SIZE, size); }
    let ratio = clamp(sqrt(narrowed(held(LAST_LEAST)) * NODE_AIM * NODE_TRUST / max(held(FIRST_SIZE), 1e-6)), NODE_LEAST_RATIO, NODE_MOST_RATIO);
    var step = held(LOAD_STEP);
    if accept { step = min(used * ratio, most); }
    // From rest the first correction is as the load.
    let is_first = corrections < 0.5 && lambda < NODE_SMALLEST_FIRST_STEP;
    let back = select(NODE_RETREAT, min(NODE_RETREAT, NODE_AIM * NODE_TRUST / size), is_first);
    if rejected { step = used * back; }
    hold(LOAD_STEP, step);
    let smallest = max(lambda * NODE_SMALLEST_STEP, NODE_SMALLEST_FIRST_STEP);
    let failed = rejected && step < smallest;
    let reached = accept && !partial;
    if !go_on && !reached {
        let next = min(lambda + step, 1.0);
        hold(GOAL, next);
        predict(next);
        hold_base(rod);
    }
    hold(LAST_SIZE, select(narrowed(held(LAST_LEAST)) * (NODE_TRUST / NODE_CONTRACTION), size, go_on));
    hold(NEWTON_STEPS, select(0.0, corrections + 1.0, go_on));
    hold(PASSES, held(PASSES) + 1.0);
    if reached { return REACHED; }
    if held(PASSES) >= NODE_PASS_LIMIT { return EXHAUSTED; }
    let is_fold = unstable || held(WEAKEST) < NODE_FOLD_PIVOT;
    return select(GOES_ON, select(FAILED, AT_FOLD, is_fold), failed);
}

// The share of a correction's bounds that holds at a least pivot: next to a bifurcation other branches are as near as its
// root.
fn narrowed(pivot: f32) -> f32 {
    return sqrt(clamp(pivot * (1.0 / NODE_NEAR_PIVOT), 0.0, 1.0));
}

// Whether a load step changes the least pivot so much, where it is small, that stability may be lost and won again between.
fn leaps(pivot: f32, last: f32) -> bool {
    return differs_widely(pivot, last, NODE_NEAR_PIVOT, WIDENING);
}

// Puts the nodes where the last equilibria point to: three, or two where two are one.
fn predict(goal: f32) {
    let last = on_path(held(LAMBDA));
    let before = on_path(held(LAMBDA_BEFORE));
    let earlier = select(before, on_path(held(LAMBDA_EARLIER)), memory_settings.least_pivot > 0.0);
    let ahead = on_path(goal) - last;
    let secant = last - before;
    let secant_before = before - earlier;
    // Newton's form of the parabola: the last secant, and the change from the one before it.
    let bend = select(0.0, over(ahead * (ahead + secant), secant + secant_before), secant_before > 0.0);
    let by_last = over(ahead, secant) + over(bend, secant);
    let by_before = over(bend, secant_before);
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let accepted = held_node(at + ACCEPTED);
        let second = held_node(at + BEFORE);
        let third = held_node(at + EARLIER);
        let w = turn(second, accepted) * by_last - turn(third, second) * by_before;
        let m = axpy(-by_before, second.m - third.m, axpy(by_last, accepted.m - second.m, accepted.m));
        hold_node(at + NODE, Node(rotate(w, accepted.d1), rotate(w, accepted.t), m));
    }
}

// What a path goes along: the load, quickly its square root.
fn on_path(lambda: f32) -> f32 {
    return select(lambda, sqrt(lambda), memory_settings.least_pivot > 0.0);
}

// A share of a load step; none of one that has not been.
fn over(span: f32, step: f32) -> f32 {
    return select(0.0, span / step, step > 0.0);
}
