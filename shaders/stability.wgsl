// Elastic stability: the index of the second variation, by conjugate points over the steps of a pass.
// src/lanes/stability.rs

const SHORTEST_INTERVAL: f32 = 0.0; //@spec

// The end of a step.
struct Station {
    // w of the first two threes.
    by_moment: mat3x3<f32>,
    by_rotation: mat3x3<f32>,
    // How much of the rod lies before it, rigid segments not counted.
    s: f32,
}

// Number of negative eigenvalues of the second variation, from the columns and stations of the last pass.
fn stability_index(tip: Tip) -> f32 {
    let by_moment = transpose(canonical(tip, BY_MOMENT));
    let by_rotation = transpose(canonical(tip, BY_ROTATION));
    var index = 0.0;
    var before = Station(zero_matrix(), identity(), 0.0);
    let shortest = stations[station_count - 1u].s * SHORTEST_INTERVAL;
    var proximal = free(before, by_moment, by_rotation);
    for (var i = 0u; i < station_count; i++) {
        let station = stations[i];
        // Of an interval of no length, b is round-off.
        if station.s - before.s <= shortest { continue; }
        let distal = free(station, by_moment, by_rotation);
        let b = station.by_moment * transpose(before.by_rotation) - station.by_rotation * transpose(before.by_moment);
        let q = transpose(distal) * (transpose(inverse(b)) * proximal);
        index = index + negative_count(q);
        before = station;
        proximal = distal;
    }
    return index;
}

// mu = dm - w x m / 2 of three columns at the tip.
fn canonical(tip: Tip, k: u32) -> mat3x3<f32> {
    let half_m = tip.m * 0.5;
    return columns_cross_sub(columns[k].w, half_m, tip_moment_columns(tip, k));
}

// w of the columns that leave the tip free, at a station.
fn free(station: Station, by_moment: mat3x3<f32>, by_rotation: mat3x3<f32>) -> mat3x3<f32> {
    return station.by_rotation * by_moment - station.by_moment * by_rotation;
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
    let s = sum * (1.0 / largest);
    let first = s[0].x;
    let second = s[0].x * s[1].y - s[1].x * s[1].x;
    let third = dot(s[0], cross(s[1], s[2]));
    return count(first < 0.0) + count(first * second < 0.0) + count(second * third < 0.0);
}
