// Matrices of six rows, and their elimination with a choice of pivots.
// crates/core/src/cpu/rod/field/matrix.rs

// By blocks: first of a pair by first, first by last, last by first, last by last. The first three of a pair are of
// displacement or force, the last of rotation or moment.
struct Mat6 {
    a: mat3x3<f32>,
    b: mat3x3<f32>,
    c: mat3x3<f32>,
    d: mat3x3<f32>,
}

// Force and moment, or displacement and rotation.
struct Pair {
    first: vec3<f32>,
    last: vec3<f32>,
}

// Half of a matrix: the blocks of its first rows, or of its last.
struct Pair3 {
    first: mat3x3<f32>,
    last: mat3x3<f32>,
}

// A row of a matrix and one of what stands on the right of it.
struct Row {
    a: array<vec3<f32>, 2>,
    b: array<vec3<f32>, 2>,
}

fn identity6() -> Mat6 {
    return Mat6(identity(), mat3x3<f32>(), mat3x3<f32>(), identity());
}

fn transposed(m: Mat6) -> Mat6 {
    return Mat6(transpose(m.a), transpose(m.c), transpose(m.b), transpose(m.d));
}

fn times(m: Mat6, by: Mat6) -> Mat6 {
    return Mat6(
        m.a * by.a + m.b * by.c,
        m.a * by.b + m.b * by.d,
        m.c * by.a + m.d * by.c,
        m.c * by.b + m.d * by.d,
    );
}

// Half of one matrix, its first or last columns, times half of another.
fn product(first: mat3x3<f32>, last: mat3x3<f32>, rows: Pair3) -> Mat6 {
    return Mat6(first * rows.first, first * rows.last, last * rows.first, last * rows.last);
}

fn plus(m: Mat6, other: Mat6) -> Mat6 {
    return Mat6(m.a + other.a, m.b + other.b, m.c + other.c, m.d + other.d);
}

fn minus(m: Mat6, other: Mat6) -> Mat6 {
    return Mat6(m.a - other.a, m.b - other.b, m.c - other.c, m.d - other.d);
}

// Sum of the squares of its entries.
fn squared_norm(m: Mat6) -> f32 {
    let first = dot(m.a[0], m.a[0]) + dot(m.a[1], m.a[1]) + dot(m.a[2], m.a[2]);
    let second = dot(m.b[0], m.b[0]) + dot(m.b[1], m.b[1]) + dot(m.b[2], m.b[2]);
    let third = dot(m.c[0], m.c[0]) + dot(m.c[1], m.c[1]) + dot(m.c[2], m.c[2]);
    return first + second + third + dot(m.d[0], m.d[0]) + dot(m.d[1], m.d[1]) + dot(m.d[2], m.d[2]);
}

// The matrix times a pair of vectors.
fn on(m: Mat6, pair: Pair) -> Pair {
    return Pair(m.a * pair.first + m.b * pair.last, m.c * pair.first + m.d * pair.last);
}

// m^-1 right by elimination, the largest pivot of each column chosen.
fn solve(m: Mat6, right: Mat6) -> Mat6 {
    let left_rows = transposed(m);
    let right_rows = transposed(right);
    var rows: array<Row, 6>;
    for (var k = 0u; k < 3u; k++) { //@unroll
        rows[k] = row_of(left_rows.a[k], left_rows.c[k], right_rows.a[k], right_rows.c[k]);
        rows[k + 3u] = row_of(left_rows.b[k], left_rows.d[k], right_rows.b[k], right_rows.d[k]);
    } //@end
    for (var k = 0u; k < 6u; k++) { //@unroll UNROLLED
        for (var j = 1u; j < 6u; j++) { //@unroll UNROLLED
            if j > k && abs(rows[k].a[k / 3u][k % 3u]) < abs(rows[j].a[k / 3u][k % 3u]) {
                let other = rows[k];
                rows[k] = rows[j];
                rows[j] = other;
            }
        } //@end
        let inverse = 1.0 / rows[k].a[k / 3u][k % 3u];
        for (var j = 1u; j < 6u; j++) { //@unroll UNROLLED
            if j > k { rows[j] = without(rows[j], rows[k], rows[j].a[k / 3u][k % 3u] * inverse); }
        } //@end
    } //@end
    for (var i = 0u; i < 6u; i++) { //@unroll UNROLLED
        // From the last row upwards.
        let inverse = 1.0 / rows[5u - i].a[(5u - i) / 3u][(5u - i) % 3u];
        rows[5u - i].b[0] = rows[5u - i].b[0] * inverse;
        rows[5u - i].b[1] = rows[5u - i].b[1] * inverse;
        for (var j = 0u; j < 5u; j++) { //@unroll UNROLLED
            if j + i < 5u {
                let factor = rows[j].a[(5u - i) / 3u][(5u - i) % 3u];
                rows[j].b[0] = axpy(-factor, rows[5u - i].b[0], rows[j].b[0]);
                rows[j].b[1] = axpy(-factor, rows[5u - i].b[1], rows[j].b[1]);
            }
        } //@end
    } //@end
    let found = Mat6(
        mat3x3<f32>(rows[0].b[0], rows[1].b[0], rows[2].b[0]),
        mat3x3<f32>(rows[3].b[0], rows[4].b[0], rows[5].b[0]),
        mat3x3<f32>(rows[0].b[1], rows[1].b[1], rows[2].b[1]),
        mat3x3<f32>(rows[3].b[1], rows[4].b[1], rows[5].b[1]),
    );
    return transposed(found);
}

fn row_of(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, d: vec3<f32>) -> Row {
    return Row(array<vec3<f32>, 2>(a, b), array<vec3<f32>, 2>(c, d));
}

// A row less `factor` times another.
fn without(row: Row, other: Row, factor: f32) -> Row {
    return row_of(
        axpy(-factor, other.a[0], row.a[0]),
        axpy(-factor, other.a[1], row.a[1]),
        axpy(-factor, other.b[0], row.b[0]),
        axpy(-factor, other.b[1], row.b[1]),
    );
}
