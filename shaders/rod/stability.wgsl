// Elastic stability: the index of the second variation, by conjugate points over the steps of a pass. S1 to S3
// crates/core/src/cpu/rod/stability.rs

const INDEX_NOISE: f32 = 0.0; //@spec
const EPSILON: f32 = 0.0; //@spec
const SMALLEST: f32 = 1.17549435e-38;

// The distal end of the intervals that have been counted.
struct Station {
    // w of the columns.
    by_moment: mat3x3<f32>,
    by_rotation: mat3x3<f32>,
    // How much of the rod lies before it, rigid segments not counted.
    s: f32,
    // Negative eigenvalues so far.
    index: f32,
}

// That of the last recorded pass.
var<private> station: Station;

// Counts the interval from the last station to the end of a step, unless it is too short: its b is round-off.
//
// Without columns by base rotation the rod that is cut off there is counted: nothing at all is none of the whole (S4).
fn add_station(rotates: bool, shortest: f32, s: f32, end: Tip) {
    if !rotates {
        station.index = stability_index(end);
        return;
    }
    //@if ROTATION
    //@if LANES
    share_column();
    let by_moment = shared_rotation(0u);
    let by_rotation = shared_rotation(3u);
    //@else
    let by_moment = columns[BY_MOMENT].w;
    let by_rotation = columns[BY_ROTATION].w;
    //@end
    if s - station.s <= shortest { return; }
    let b = by_moment * transpose(station.by_rotation) - by_rotation * transpose(station.by_moment);
    let q = transpose(station.by_moment) * (inverse(b) * by_moment);
    station = Station(by_moment, by_rotation, s, station.index + negative_count(q));
    //@end
}

// Counts one more where an interval of length `h` under a force up to `n` may buckle by itself: force times the square of the
// length over stiffness is `most` or more. S1 and S4 count only what intervals do together.
fn add_doubt(rod: Rod, segment: Flexible, h: f32, n: f32, most: f32) {
    var softening = n;
    //@if MAGNET
    if segment.has_magnet { softening = softening + length(segment.mu) * length(rod.B); }
    //@end
    let least = min(min(segment.stiffness.x, segment.stiffness.y), segment.stiffness.z);
    station.index = station.index + count(least * most < softening * h * h);
}

// Number of negative eigenvalues of the second variation, from the columns and the station of the last pass.
fn stability_index(tip: Tip) -> f32 {
    return station.index + negative_count(transpose(columns[BY_MOMENT].w) * canonical(tip, BY_MOMENT));
}

//@if !ROTATES
//@if GUARDS
// The stability index at a base moment, with columns by base rotation.
fn whole_index(rod: Rod, m0: vec3<f32>) -> f32 {
    columns[BY_MOMENT] = moment_columns();
    columns[BY_ROTATION] = rotation_columns(m0);
    let tip = shoot(FINE, rod, 1.0, m0, STABILITY_COLUMNS, true);
    return stability_index(tip);
}
//@end
//@end

// Squared Frobenius norm.
fn squared_norm(a: mat3x3<f32>) -> f32 {
    return dot(a[0], a[0]) + dot(a[1], a[1]) + dot(a[2], a[2]);
}

// The stability margin that belongs to (dr/dm0)^-1.
fn margin(w_inverse: mat3x3<f32>) -> f32 {
    return sqrt(3.0 / squared_norm(w_inverse));
}

// Whether the margin that belongs to (dr/dm0)^-1 of this squared norm is above a bound.
fn is_above(square: f32, bound: f32) -> bool {
    return square * (bound * bound) < 3.0;
}

//@if LOAD_WITHOUT_ENERGY
// Where a dead moment acts at the tip: its work depends on the way, and no energy tells stability. S6
fn has_no_energy(rod: Rod) -> bool {
    return any(rod.l_tip != vec3<f32>());
}

// By how much dr/dm0 differs from an earlier one with the inverse `before`, relative to it: below 1 its determinant has the
// same sign. S6
fn departure(before: mat3x3<f32>, w: mat3x3<f32>) -> f32 {
    return sqrt(squared_norm(before * w - identity()));
}
//@end

// Whether an index other than 0 means anything, where dr/dm0 is `w`: its round-off is small.
fn is_sharp(w: mat3x3<f32>) -> bool {
    return EPSILON * squared_norm(w) < INDEX_NOISE;
}

// mu = dm - w x m / 2 of three columns at the tip.
fn canonical(tip: Tip, k: u32) -> mat3x3<f32> {
    let half_m = tip.m * 0.5;
    return columns_cross_sub(columns[k].w, half_m, tip_moment_columns(tip, k));
}

// 1 where the condition holds, else 0.
fn count(condition: bool) -> f32 {
    return select(0.0, 1.0, condition);
}

// Number of negative eigenvalues of the symmetric part, by the signs of its leading minors.
fn negative_count(q: mat3x3<f32>) -> f32 {
    let sum = q + transpose(q);
    let diagonal = max(max(abs(sum[0].x), abs(sum[1].y)), abs(sum[2].z));
    let largest = max(max(max(diagonal, abs(sum[1].x)), abs(sum[2].x)), abs(sum[2].y));
    // Nothing is left to eliminate next to the base.
    let s = sum * (1.0 / max(largest, SMALLEST));
    let first = s[0].x;
    let second = s[0].x * s[1].y - s[1].x * s[1].x;
    let third = dot(s[0], cross(s[1], s[2]));
    return count(first < 0.0) + count(first * second < 0.0) + count(second * third < 0.0);
}
