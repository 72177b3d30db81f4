// Base moments between the points of a grid of equilibria. crates/core/src/cpu/equilibrium/anchors.rs

//@if ANCHORS
const ANCHOR_AXES: u32 = 1u; //@spec
const ANCHOR_CORNERS: u32 = 2u; //@spec
// Points of each axis, and between one and the next along it.
const ANCHOR_POINTS: array<u32, 1> = array<u32, 1>(2u); //@spec
const ANCHOR_STRIDES: array<u32, 1> = array<u32, 1>(1u); //@spec
// First input column of a sample's coordinates.
const ANCHOR_COLUMN: u32 = 0u; //@spec

// By anchor, the last axis fastest: m0, a slope for each axis, the columns of the inverse of W. Beside m0 stands what the
// edges of its cell miss; below zero where no sample may start.
@group(0) @binding(4) var<storage, read> anchors: array<vec4<f32>>;

//@if ANCHORED
// A cell, as its first corner, and what its edges miss.
struct Cell {
    first: u32,
    mismatch: f32,
}

// What is predicted of a sample.
struct Prediction {
    m0: vec3<f32>,
    inverse: mat3x3<f32>,
}

// The cell of a sample and what its edges miss; below zero outside of the grid.
fn cell(coordinates: vec4<f32>) -> Cell {
    var first = 0u;
    var is_inside = true;
    for (var axis = 0u; axis < ANCHOR_AXES; axis++) { //@unroll
        let at = coordinates[axis];
        // The far end belongs to the last cell. Samples made here may lie beyond the ends by round-off. NaN is outside.
        is_inside = is_inside && at >= -1e-6 && at <= f32(ANCHOR_POINTS[axis] - 1u) * 1.000001;
        first = first * ANCHOR_POINTS[axis] + min(u32(max(at, 0.0)), ANCHOR_POINTS[axis] - 2u);
    } //@end
    if !is_inside { return Cell(0u, -1.0); }
    return Cell(first, anchors[first * (ANCHOR_AXES + 4u)].w);
}

// What is predicted within a cell.
fn predict_within(first: u32, coordinates: vec4<f32>) -> Prediction {
    var share = vec4<f32>();
    for (var axis = 0u; axis < ANCHOR_AXES; axis++) { //@unroll
        share[axis] = coordinates[axis] - f32(min(u32(max(coordinates[axis], 0.0)), ANCHOR_POINTS[axis] - 2u));
    } //@end
    var m0 = vec3<f32>();
    var w_inverse = mat3x3<f32>();
    for (var corner = 0u; corner < ANCHOR_CORNERS; corner++) {
        var at = first;
        var weight = 1.0;
        var way = vec4<f32>();
        for (var axis = 0u; axis < ANCHOR_AXES; axis++) { //@unroll
            let is_far = ((corner >> axis) & 1u) == 1u;
            at += select(0u, ANCHOR_STRIDES[axis], is_far);
            weight *= select(1.0 - share[axis], share[axis], is_far);
            way[axis] = select(share[axis], share[axis] - 1.0, is_far);
        } //@end
        let row = at * (ANCHOR_AXES + 4u);
        m0 = axpy(weight, anchors[row].xyz, m0);
        for (var axis = 0u; axis < ANCHOR_AXES; axis++) { //@unroll
            m0 = axpy(0.5 * weight * way[axis], anchors[row + 1u + axis].xyz, m0);
        } //@end
        let column = row + 1u + ANCHOR_AXES;
        let columns = mat3x3<f32>(anchors[column].xyz, anchors[column + 1u].xyz, anchors[column + 2u].xyz);
        w_inverse = columns_axpy(weight, columns, w_inverse);
    }
    return Prediction(m0, w_inverse);
}

// Where the path of a sample would end, as it is predicted; not reached where it may not start from anchors.
fn anchored_end() -> PathEnd {
    var end: PathEnd;
    var coordinates = vec4<f32>();
    for (var axis = 0u; axis < ANCHOR_AXES; axis++) { //@unroll
        coordinates[axis] = input(ANCHOR_COLUMN + axis);
    } //@end
    let at = cell(coordinates);
    end.path = ANCHORED;
    end.history.lambda = 1.0;
    end.reached = at.mismatch >= 0.0;
    if end.reached {
        let prediction = predict_within(at.first, coordinates);
        end.m0 = prediction.m0;
        end.inverse = prediction.inverse;
        end.close = at.mismatch * at.mismatch < settings.tolerance;
    }
    return end;
}
//@end
//@end
