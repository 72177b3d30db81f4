// A sample's nodes in its memory. src/gpu/shader/nodes.rs owns the sizes.

// Numbers of a sample, and of each of its intervals.
const HEAD_NUMBERS: u32 = 52u; //@spec
const INTERVAL_NUMBERS: u32 = 174u; //@spec

// Of a sample: how far it is, its intervals, where it stands on its path.
const STAGE: u32 = 0u;
const INTERVALS: u32 = 1u;
const LAMBDA: u32 = 2u;
const LAMBDA_BEFORE: u32 = 3u;
const LAMBDA_EARLIER: u32 = 12u;
const LOAD_STEP: u32 = 4u;
const GOAL: u32 = 5u;
const LAST_LEAST: u32 = 6u;
const WEAKEST: u32 = 7u;
const LAST_SIZE: u32 = 8u;
const FIRST_SIZE: u32 = 9u;
const NEWTON_STEPS: u32 = 10u;
const PASSES: u32 = 11u;
// dm0 by base rotation, less its canonical part.
const BASE_ROTATION: u32 = 43u;
// Which number of steps, whether Newton's method has converged on it, the three of parameters in hand.
const LEVEL: u32 = 13u;
const IS_CONVERGED: u32 = 14u;
const THREE: u32 = 15u;
// What the number of steps before has come to.
const COARSER_P: u32 = 16u;
const COARSER_D1: u32 = 19u;
const COARSER_T: u32 = 22u;
const COARSER_W: u32 = 25u;
const COARSER_DP: u32 = 34u;

// Of an interval: what of the rod it is, its length where it bends, the force at its start.
const KIND: u32 = 0u;
const FIRST: u32 = 1u;
const END: u32 = 2u;
const START: u32 = 3u;
const SHARE: u32 = 4u;
const BENT_LENGTH: u32 = 5u;
const FORCE_THERE: u32 = 6u;
// The node at its start: on trial, accepted last, before that, and earlier.
const NODE: u32 = 9u;
const ACCEPTED: u32 = 18u;
const BEFORE: u32 = 27u;
const EARLIER: u32 = 36u;
// How its end moves with its start, in the canonical pair (w, mu), displacement last. S1, N1
const A_THERE: u32 = 45u;
const B_THERE: u32 = 54u;
const C_THERE: u32 = 63u;
const D_THERE: u32 = 72u;
const DP_W: u32 = 81u;
const DP_MU: u32 = 90u;
const DEFECT_W: u32 = 99u;
const DEFECT_MU: u32 = 102u;
// What elimination leaves at its start: mu = s w + g.
const PIVOT_INVERSE: u32 = 105u;
const PIVOT_S: u32 = 114u;
// Change of the node, and g of three loads.
const CHANGE_W: u32 = 123u;
const CHANGE_MU: u32 = 126u;
const G_MOMENT: u32 = 129u;
// What three loads or parameters do over it while its start is held, and their g.
const DRIVE_W: u32 = 138u;
const DRIVE_MU: u32 = 147u;
const DRIVE_DP: u32 = 156u;
const G_DRIVE: u32 = 165u;

const_assert BASE_ROTATION + 9u <= HEAD_NUMBERS;
//@if RECIPROCITY
const_assert G_DRIVE + 9u <= INTERVAL_NUMBERS;
//@else
//@if DRIVES
const_assert DRIVE_DP + 9u <= INTERVAL_NUMBERS;
//@end
//@end
const_assert G_MOMENT + 9u <= INTERVAL_NUMBERS;

var<private> interval_count: u32;

fn interval_at(i: u32) -> u32 {
    return HEAD_NUMBERS + i * INTERVAL_NUMBERS;
}

fn held_node(at: u32) -> Node {
    return Node(held_vector(at), held_vector(at + 3u), held_vector(at + 6u));
}

fn hold_node(at: u32, node: Node) {
    hold_vector(at, node.d1);
    hold_vector(at + 3u, node.t);
    hold_vector(at + 6u, node.m);
}
