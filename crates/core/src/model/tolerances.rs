//! How the engines follow the path from rest to full load: settings that all of them share.

use super::Stepper;

/// Newton's steps on a path followed with care, and in a search, end below this change of the base moment (plan units,
/// relative to 1 + the moment) and turn of the tip (radians).
pub const PATH_TOLERANCE: f64 = 1e-3;
/// On a ramp, the same under part of the load.
pub const LOAD_STEP_TOLERANCE: f64 = 0.2;
/// On a ramp, the same under the full load: the fine grid corrects the rest.
pub const FULL_LOAD_TOLERANCE: f64 = 0.03;
/// On the path each correction must be smaller than this share of the one before.
pub const CONTRACTION: f64 = 0.3;
/// A first correction above this many plan units of moment or radians of the tip is not trusted on any path: another branch may
/// be as near. With [`FIRST_BEND`] it keeps opposed coils on their branch; either alone does not.
pub const TRUST: f64 = 0.2;
/// A step of Newton's method on the fine grid above this is not taken.
pub const FINE_TRUST: f64 = 0.3;
/// A correction smaller than this leads to no other branch, wherever it starts.
pub const NEARBY: f64 = 0.03;
/// Newton steps on one load step.
pub const CORRECTIONS: f64 = 8.0;
/// The first load step bends no part of the rod by more, to first order (plan units of the largest moment inside).
pub const FIRST_BEND: f64 = 0.4;
/// A load step is chosen so that its first correction, which grows like the step's fourth power, will be this share of
/// what is trusted.
pub const AIM: f64 = 0.375;
/// The correction over the aim is taken to be at least this: a step becomes 3 times as long at most.
pub const LEAST_RATIO: f64 = 1.0 / 81.0;
/// The correction over the aim is taken to be at most this: a step becomes a fifth as long at least.
pub const MOST_RATIO: f64 = 625.0;
/// A step that failed is followed by one at most this share as long.
pub const RETREAT: f64 = 0.5;
/// A ramp that has retreated so many times in a row did not stand on its branch.
pub const RETREATS: f64 = 4.0;
/// The smallest load step on a ramp (share of the full load).
pub const SMALLEST_RAMP_STEP: f64 = 1.0 / 64.0;
/// The smallest load step with care (share of the full load), in single precision, and in a field that varies.
pub const SMALLEST_GUARDED_STEP: f64 = 1.0 / 4096.0;
/// The same in double precision, as a share of the load so far, and next to rest of [`LITTLE_LOAD`].
pub const SMALLEST_SHARP_STEP: f64 = 1.0 / 131_072.0;
/// A share of the full load.
pub const LITTLE_LOAD: f64 = 1.0 / 64.0;
/// With care and under a tip moment, where small margins ask for short steps.
pub const SMALLEST_UNSYMMETRIC_STEP: f64 = 1.0 / 1_048_576.0;
/// A path on the coarse grid that comes nearer than this to a fold or a bifurcation (stability margin) is followed again
/// with care: few steps may unfold the bifurcation the other way. So is one whose load step was tried beyond it.
pub const SAFE_MARGIN: f64 = 0.1;
/// With care and in double precision, where branches lie closer than this, corrections are trusted the less. Under a tip moment, a load step that
/// starts or ends nearer is bounded by [`WIDENING`]: stability may be lost and won again between.
pub const NEAR_MARGIN: f64 = 0.3;
/// A load step uses up this share of a margin below [`NEAR_MARGIN`], as far as its fall tells: beyond a pitchfork other branches
/// are stable.
pub const SPENT: f64 = 0.9;
/// In double precision, and in a field that varies, corrections there end below this (plan units of moment and radians): the margin
/// changes within little.
pub const NEAR_TOLERANCE: f64 = 2e-3;
/// In a field that varies and with care, corrections end below this everywhere: a large force hides how far the tip still turns.
pub const FIELD_TOLERANCE: f64 = 0.05;
/// There a load step is a secant for the next prediction if it is so many times as long as its last correction.
pub const FIELD_TELLING: f64 = 4.0;
/// Passes along a path with care in a field that varies: a rod under large loads takes many short steps, and the reference far more.
pub const FIELD_PASS_LIMIT: f64 = 2000.0;
/// Shortest step of a wall that comes, as a share of its way.
pub const WALL_SMALLEST_SHARP_STEP: f64 = 4e-6;
/// See [`WALL_SMALLEST_SHARP_STEP`]; in single precision.
pub const WALL_SMALLEST_STEP: f64 = 6e-5;
/// A rod that is in the wall by more than this share of its length is through it.
pub const THROUGH_WALL: f64 = 1e-6;
/// A wall that pulls a sliding tip by less than this (plan units of force) has only come to it.
pub const WALL_LEAST_PULL: f64 = 1e-3;
/// A path with care in double precision takes a wall that pulls a sliding tip by less than this (plan units of force) for one that touches it.
pub const WALL_LEAST_SHARP_PULL: f64 = 1e-6;
/// Such a step may change the inverse square of the margin by this factor at most: the margin twofold.
pub const WIDENING: f64 = 4.0;
/// Under a dead tip moment, with care, a load step may change dr/dm0 by this share of itself at most (Frobenius norm of
/// W0^-1 W - 1): below 1 its determinant keeps its sign on the way.
pub const DEPARTURE: f64 = 0.7;
/// The next step there goes as far as would change it by this share of that.
pub const DEPARTURE_AIM: f64 = 0.7;
/// A path that comes nearer than this and moves away again has passed what no grid resolves, and ends there.
pub const NARROW_MARGIN: f64 = 1e-3;
/// Along the curve of equilibria: the first correction is at most this share of the step.
pub const CURVE_SHARE: f64 = 0.3;
/// Steps are chosen so that it is this share of what is trusted.
pub const CURVE_AIM: f64 = 0.2;
/// And so that the tangent turns by so much (radians).
pub const CURVE_ANGLE: f64 = 0.45;
/// Two tangents in a row have at least this cosine.
pub const CURVE_COSINE: f64 = 0.75;
/// Corrections there end below this (plan units, relative to 1 + the moment).
pub const CURVE_TOLERANCE: f64 = 1e-3;
/// Halfway over a step the load rises at least by this share of the lesser slope at its ends: else it may turn twice between.
pub const CURVE_SAG: f64 = 0.3;
/// And below this share of the step.
pub const CURVE_NEAR: f64 = 0.03;
/// A step towards a point where curves cross goes so much of the way: the curve may bend away before.
pub const CURVE_APPROACH: f64 = 0.75;
/// While two tangents in a row have this cosine it has not.
pub const CURVE_STRAIGHT: f64 = 0.99;
/// A point is on top of a crossing where the determinant is below this share of the one at the last point.
pub const CURVE_ON_TOP: f64 = 0.05;
/// The smallest step along the curve (plan units of moment, radians of the tip and shares of the load) in single precision.
pub const SMALLEST_ARC: f64 = 1.0 / 2048.0;
/// The same in double precision.
pub const SMALLEST_SHARP_ARC: f64 = 2e-6;
/// Passes along one curve.
pub const CURVE_LIMIT: f64 = 150.0;
/// Passes in a field that varies, on the coarse grid: a curve that needs more is seldom followed there at all.
pub const FIELD_CURVE_LIMIT: f64 = 100.0;
/// Passes there with care, on the fine grid: load steps, the next resort, take ten times as long.
pub const FIELD_CURVE_CAREFUL_LIMIT: f64 = 1000.0;
/// A turn of the load is found where the last correction is below this (relative to 1 + the moment),
pub const TURN_TOLERANCE: f64 = 1e-5;
/// and the load would rise by less than this share of it.
pub const TURN_FLATNESS: f64 = 1e-6;
/// Passes between the points before and behind a turn.
pub const TURN_LIMIT: f64 = 12.0;
/// Passes that take it to the fine grid, at most.
pub const TURN_CORRECTIONS: usize = 5;
/// Passes on the fine grid to a point of the curve on either side of a turn, where the load is less
pub const TURN_SIDE: usize = 2;
/// by this many times the error of the turn's load.
pub const TURN_EVIDENCE: f64 = 4.0;
/// On the fine grid, a secant from this far before it tells where curves cross.
pub const CROSSING_SPAN: f64 = 1e-3;
/// A fold whose load is known better than this has been seen: as a turn of the load, or where curves cross.
pub const FOLD_EVIDENCE: f64 = 1e-3;
/// Error of the slope of a fold's load, over it, by what the place of the fold may be off: so many times the error of its load.
pub const FOLD_SLOPE_PLACE: f64 = 100.0;
/// The same by round-off.
pub const FOLD_SLOPE_NOISE: f64 = 1e-7;
/// A path that ends without having come so near has not met a fold: shooting has failed.
pub const FOLD_MARGIN: f64 = 0.25;
/// Above this round-off (epsilon times the squared norm of dr/dm0) a stability index other than 0 says nothing.
pub const INDEX_NOISE: f64 = 1e-5;
/// Above this round-off (the same) a single pass does not tell the columns: the rod is solved by nodes.
pub fn growth_noise(epsilon: f64) -> f64 {
    (2500.0 * epsilon).max(1e-12)
}
/// Errors that grow by more powers of e than this leave half the digits of columns: what a single pass says of a rod that
/// it does not solve means little.
pub fn growth_limit(epsilon: f64) -> f64 {
    -0.25 * epsilon.ln()
}
/// Errors that grow by more powers of e leave none: such a rod is solved by nodes at once.
pub fn limp_growth(epsilon: f64) -> f64 {
    4.0 / 3.0 * growth_limit(epsilon)
}
/// Passes over the rod in one search from a given base moment.
pub const SEARCH_LIMIT: f64 = 60.0;
/// The longest step of a search (plan units of moment, or of force over 1 + the force at the base).
pub const SEARCH_STEP: f64 = 1.0;
/// Before it, in a field that varies: passes that find the force at the base.
pub const SEARCH_FORCE_LIMIT: usize = 8;
/// A sample starts from anchors where each corner of its cell is farther from a fold or a bifurcation than this
/// (stability margin).
pub const ANCHOR_MARGIN: f64 = 0.1;
/// The same: where each edge of the cell is predicted from both ends alike, within this (plan units of moment).
pub const ANCHOR_MISMATCH: f64 = 0.1;
/// A first correction above this is not trusted after anchors (plan units of moment).
pub const ANCHOR_TRUST: f64 = 1e-2;
/// Nor is a correction above this share of the one before.
pub const ANCHOR_CONTRACTION: f64 = 0.2;
/// Passes over the rod on one path.
pub const PASS_LIMIT: f64 = 600.0;
/// Chord steps on the fine grid.
pub const CHORD_LIMIT: usize = 4;
/// Full Newton steps on the fine grid, after the chord steps.
pub const NEWTON_LIMIT: usize = 5;
/// Longest chord step that is taken (plan units of moment).
pub const CHORD_TRUST: f64 = 0.1;
/// Intervals of the stability index shorter than this share of the rod join the next.
pub const SHORTEST_INTERVAL: f64 = 1e-4;
/// A difference in pose is at most so many times the differences of position, d1 and t: sqrt(2) where a rotation about
/// an axis between d1 and t moves both alike; the rest is for second orders.
pub const DIFFERENCE: f64 = 1.6;
/// [`PlanOptions::error_share`](super::PlanOptions::error_share) where nothing was measured: half. In fourth order it is a
/// fifteenth; long steps are not there yet.
pub const ERROR_SHARE: f64 = 0.5;
/// Columns by base moment alone show stability (S4) where force times the square of a step, over stiffness, is below
/// this: a cantilever buckles at (pi / 2)^2.
pub const UNBUCKLED: f64 = 2.0;
/// Columns by base moment and by base rotation show stability (S1) where that number is below this: an interval whose ends
/// do not turn buckles at pi^2.
pub const UNBUCKLED_BETWEEN: f64 = 8.0;
/// No tip is farther from the base than this many lengths of the rod; steps too long may throw it there.
pub const REACH: f64 = 100.0;
/// See [`turn_tolerance`].
const TURN_SHARE: f64 = 0.1;
/// Error of a tip that is moved to first order, over the square of how far that turns it.
pub const SECOND_ORDER: f64 = 2.0;
/// Round-off of a pass, in units of the number format's epsilon.
pub const ROUND_OFF: f64 = 4.0;
/// Above this base moment (plan units, about the angle by which a rod turns) round-off grows faster: see [`Stepper::bend_noise`].
pub const LITTLE_TURN: f64 = 4.0;
/// [`Stepper::bend_noise`] counts so many times in fields that vary. A rod in f32 that turned by 43 rad in 48 steps of DOP853 needs 3 for its
/// pose, 5 for its columns.
pub const FIELD_BEND_NOISE: f64 = 6.0;
/// Round-off of columns in the same units, near a fold.
pub const COLUMN_NOISE: f64 = 32.0;
/// Round-off in f32 of the numbers that a column is made of, in units of epsilon, over the column's own size.
pub const SMALL_COLUMN_NOISE: f64 = 2.0;
/// Round-off of derivatives by stiffness grows with the rod's largest stiffness over its smallest, up to so many times: they are
/// integrals over products of two moments.
pub const STIFFNESS_NOISE: f64 = 7.0;
/// Rows by multiple shooting take so many times the floor of derivatives that a pilot has measured: 1.8 was seen.
pub const NODE_FLOOR: f64 = 2.0;
/// Round-off of columns in fields that vary, in units of epsilon: a small column is the difference of large ones. 230 was measured.
pub const FIELD_COLUMN_NOISE: f64 = 320.0;
/// The same where columns grow along the rod.
pub const GROWTH_NOISE: f64 = 4.0;
/// How a path by nodes is followed.
#[derive(Clone, Copy, Debug)]
pub struct NodePace {
    /// Nodes lie so close that errors grow by this power of e from one to the next.
    pub spacing: f64,
    /// Steps between two nodes.
    pub steps: usize,
    /// Corrections of the nodes end below this.
    pub tolerance: f64,
    /// A path that comes to a smaller least pivot ends; it then tells nothing.
    pub least_pivot: f64,
}

impl NodePace {
    /// Whether it predicts by a parabola through three equilibria, along the square root of the load, as what is limp or taut
    /// bends in a layer of that thickness. Others predict by the last secant: a parabola is wrong beside a bifurcation.
    pub fn is_quick(&self) -> bool {
        self.least_pivot > 0.0
    }
}

/// One after the other until a rod has its answer. The first is quick and stays away from folds and bifurcations; a fold
/// must repeat on the meshes of both others.
pub const NODE_PACES: [NodePace; 3] = [
    NodePace { spacing: 1.0, steps: 1, tolerance: 0.2, least_pivot: 0.3 },
    NodePace { spacing: 1.0, steps: 2, tolerance: 1e-3, least_pivot: 0.0 },
    NodePace { spacing: 0.5, steps: 2, tolerance: 1e-3, least_pivot: 0.0 },
];
/// Methods and steps between two nodes for the answer: as many as bring the error below what is asked for.
pub const NODE_LEVELS: [(Stepper, usize); 5] =
    [(Stepper::Tp7, 1), (Stepper::Dop853, 1), (Stepper::Dop853, 2), (Stepper::Dop853, 4), (Stepper::Dop853, 8)];
/// Changes of the tip below this, over the rod's length or in radians, are never asked for.
pub const NODE_GOOD: f64 = 1e-10;
/// Relative to the unloaded rod, the compliance at a node (norm over sqrt(3)) that tells of no fold.
pub const NODE_USUAL: f64 = 2.0;
/// Round-off by nodes, in units of epsilon, of the largest moment and of the square root of the number of intervals.
pub const NODE_ROUND_OFF: f64 = 32.0;
/// Newton's last step by nodes is at most so many times what is good: its square is left.
pub const NODE_ENOUGH: f64 = 3.0;
/// What is asked of the columns, relative to them, where `good` is asked of the tip: 3e-4 for 1e-6, 3e-10 for 1e-9; in f32 5e-4.
pub fn node_columns_good(good: f64, epsilon: f64) -> f64 {
    (3e8 * good * good).clamp(NODE_GOOD, 3e-4).max(4096.0 * epsilon)
}
/// The error of an answer over its change from the level before: less than a hundredth as a rule, a ninth was measured.
pub const NODE_ERROR_SHARE: f64 = 0.3;
/// The error of a column over the difference of those by tip moment.
pub const NODE_COLUMNS_ERROR: f64 = 4.0;
/// What integrals along the rod are off by, relative to them, on so many steps between two nodes: products of responses grow
/// twice as fast as these. 9e-6 was measured on one step; on four, in columns that are nearly zero, 4e-5 over 4^6.5.
pub fn node_integrals(steps: usize) -> f64 {
    3e-5 * (steps as f64).powi(-6)
}
/// What Newton's last step leaves in the columns, relative to it and to how soft torsion is: 40 was measured.
pub const NODE_LEFT_OVER: f64 = 60.0;
/// Newton's steps for the answer start nearer than this to it (radians, or moment relative to 1 plus the largest).
pub const NODE_NEARBY: f64 = 0.3;
/// Newton steps by nodes for the answer.
pub const NODE_CORRECTIONS: usize = 8;
/// The first load step by nodes.
pub const NODE_FIRST_STEP: f64 = 0.1;
/// The largest first correction of a node: radians, or moment relative to 1 plus the largest.
pub const NODE_TRUST: f64 = 0.2;
/// Share of a load step's tolerance that holds under loads without energy.
pub const NODE_WARY: f64 = 1e-3;
/// Halfway along a load step under loads without energy the first correction is less than this share of the step.
pub const NODE_HALFWAY: f64 = 0.25;
/// Each correction of the nodes must be smaller than this share of the one before.
pub const NODE_CONTRACTION: f64 = 0.3;
/// A load step by nodes is chosen so that its first correction will be this share of what is trusted; that grows like
/// the step's square.
pub const NODE_AIM: f64 = 0.35;
/// It is so many times as long as the one before, at least and at most.
pub const NODE_LEAST_RATIO: f64 = 0.4;
/// See [`NODE_LEAST_RATIO`].
pub const NODE_MOST_RATIO: f64 = 4.0;
/// After one that failed it is this share as long.
pub const NODE_RETREAT: f64 = 1.0 / 3.0;
/// The smallest load step by nodes, as a share of the load so far, and next to rest as a share of the full load.
pub const NODE_SMALLEST_STEP: f64 = 1.0 / 1_048_576.0;
/// See [`NODE_SMALLEST_STEP`].
pub const NODE_SMALLEST_FIRST_STEP: f64 = 1e-10;
/// A load step by nodes that starts or ends where the least pivot is smaller than this, relative to the pivot of the
/// interval alone, may change it by [`WIDENING`] at most.
pub const NODE_NEAR_PIVOT: f64 = 0.1;
/// A path by nodes that ends without having come to so small a pivot has not met a fold.
pub const NODE_FOLD_PIVOT: f64 = 0.05;
/// Passes over all intervals on one path.
pub const NODE_PASS_LIMIT: f64 = 600.0;
/// In a field that varies: a load step that starts or ends nearer to a fold (stability margin) may halve or double the margin.
pub const FIELD_NEAR_MARGIN: f64 = 0.6;
/// Under a tip moment there, with care, the determinant of the second variation, over that of a rod without loads, may grow or
/// shrink so many times in a load step, where it is smaller than [`FIELD_SOFT`]: stability may be lost and won again between.
pub const FIELD_SOFT_RATIO: f64 = 2.5;
/// See [`FIELD_SOFT_RATIO`].
pub const FIELD_SOFT: f64 = 0.5;
/// There a step goes as far as it takes, as things go, to half the determinant, but need not be smaller than this.
pub const FIELD_LITTLE_STEP: f64 = 1e-4;
/// The smallest load step there with care and in double precision, as a share of the load so far, and next to rest of
/// [`LITTLE_LOAD`].
pub const FIELD_SMALLEST_STEP: f64 = 1.0 / 524_288.0;
/// With care and in double precision a path that ends at a fold has there at least this slope (plan units of the load at the
/// base over the share of the load) times the margin: 0.3 and more were measured. Next to a bifurcation it is small.
pub const FOLD_STEEPNESS: f64 = 0.05;
/// Under part of the load corrections of the load at the base end below this.
pub const FIELD_LOAD_TOLERANCE: f64 = 0.05;
/// The same on a GPU: Newton steps on the fine grid, and how many of them may be chord steps.
pub const FIELD_NEWTON_LIMIT: f64 = 14.0;
/// See [`FIELD_NEWTON_LIMIT`].
pub const FIELD_CHORD_LIMIT: f64 = 8.0;
/// The method that follows the path.
pub const PATH_STEPPER: Stepper = Stepper::Rk4;
/// The method that follows it with care on the CPU, where the field does not vary: a path in these few steps is as near to the
/// truth as one of [`PATH_STEPPER`] in its many, in less than half the time.
pub const CAREFUL_STEPPER: Stepper = Stepper::Tp6;

impl Stepper {
    /// Round-off of a pass in a field that varies, over [`ROUND_OFF`]. Where steps are long, a method's large coefficients, of
    /// which only a little is left, multiply it: their sums over a stage come to 3 in TP6, to 42 in TP7, and to 96 in DOP853.
    pub fn stage_noise(self) -> f64 {
        match self {
            Stepper::Rk4 | Stepper::Tp6 => 1.0,
            Stepper::Tp7 => 2.0,
            Stepper::Dop853 => 4.0,
        }
    }

    /// Round-off of a pass in a uniform field, over [`ROUND_OFF`]. In f64 no tip needs more than that.
    pub fn uniform_stage_noise(self, epsilon: f64) -> f64 {
        let is_double = epsilon < 1e-12;
        if is_double { 1.0 } else { (0.5 * self.stage_noise()).max(1.0) }
    }

    /// Round-off of a pass in a uniform field, over [`ROUND_OFF`], of what a rod bends beyond [`LITTLE_TURN`]: about an eighth of the sum
    /// of a method's coefficients over a stage (see [`Stepper::stage_noise`]). Rods in f32 that turn by 16 rad in a few steps need 5.
    pub fn bend_noise(self) -> f64 {
        match self {
            Stepper::Rk4 | Stepper::Tp6 => 0.0,
            Stepper::Tp7 => 6.0,
            Stepper::Dop853 => 12.0,
        }
    }

    /// Steps over a segment while following the path, where the answer takes `steps`.
    pub fn path_steps(self, steps: usize) -> usize {
        let share = match self {
            Stepper::Rk4 => 3,
            Stepper::Tp6 | Stepper::Tp7 | Stepper::Dop853 => 2,
        };
        steps.div_ceil(share).max(2).min(steps)
    }

    /// The same with care, by some method: so many times the steps, up to so many.
    pub fn careful_steps(self, steps: usize, by: Stepper) -> usize {
        let path_steps = self.path_steps(steps);
        let (more, most) = match by {
            Stepper::Rk4 => (6 * path_steps, 24),
            Stepper::Tp6 | Stepper::Tp7 | Stepper::Dop853 => ((3 * path_steps).div_ceil(2), 8),
        };
        path_steps.max(more.min(most))
    }
}

/// Chord steps end below this times the stability margin, for Newton's tolerance: one more follows, on the grid of the
/// error estimate, and each leaves a hundredth or less of the one before; more, where the margin is small.
pub fn chord_tolerance(newton_tolerance: f64) -> f64 {
    (3000.0 * newton_tolerance).min(1e-3)
}

/// Whether the edges of a cell of anchors miss so little (plan units of moment) that the check is the first pass. Within the
/// cell a prediction misses a tenth as much, as a cubic does, and a step leaves its square.
pub fn is_close(mismatch: f64, newton_tolerance: f64) -> bool {
    mismatch * mismatch < newton_tolerance
}

/// A step below this times the stability margin does to first order: columns are then off by a small part of themselves,
/// the tip by the square. It falls faster than the tolerance, as small columns amplify it.
pub fn first_order_tolerance(newton_tolerance: f64) -> f64 {
    (3e4 * newton_tolerance.powf(1.5)).min(1e-5)
}

/// Newton's last step must move the tip by less than this (radians, or over the rod's length), too: rods that are soft in
/// torsion turn far by little moment, and the square of a turn is left.
///
/// Where columns are asked for, less than a tenth of their tolerance, too: they are not led to equilibrium to first order as
/// poses are.
pub fn turn_tolerance(newton_tolerance: f64, column_tolerance: Option<f64>) -> f64 {
    TURN_SHARE * newton_tolerance.sqrt().min(column_tolerance.unwrap_or(f64::INFINITY))
}

/// Whether nodes and a single pass have found two equilibria, from how far apart their tips are and from the pass's own error
/// estimate, both over the rod's length. A pass that loses digits does not lose the branch; how many, its estimate says.
pub fn are_two_equilibria(apart: f64, estimate: f64) -> bool {
    const SAME_TIP: f64 = 1e-2;
    apart > estimate.max(SAME_TIP)
}

/// Newton's last step must be below this (plan units of moment), for a target error and a number format.
pub fn newton_tolerance(tolerance: f64, epsilon: f64) -> f64 {
    tolerance.clamp(16.0 * epsilon, 1e-4)
}

/// Tips on both grids that differ by less than so many times what round-off can do differ by it alone. In single precision
/// each step adds some, so that where they are many the finer grid is the worse one.
pub fn rounded(epsilon: f64, steps: usize) -> f64 {
    const MANY_STEPS: usize = 12;
    if epsilon > 1e-10 && steps > MANY_STEPS { 8.0 } else { 1.0 }
}
