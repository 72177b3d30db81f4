// The index of the second variation by elimination of intervals from the tip. F7
// crates/core/src/cpu/rod/field/index.rs
//
// z = (dp, w) and y = (dn, dm - w x m / 2) of an interval's end follow from those of its start by (a, b; c, d). Held at
// its start its end yields by C = b d^-1. Where what lies beyond answers with y = S z, its pivot C^-1 - S has as many
// negative eigenvalues as J - B^T S B, where C = B J B^T and J is a diagonal of signs: an interval that cannot lengthen needs no
// inverse of C. A piece that is soft in torsion may be unstable by itself (a sign of -1) and stable as a part of the rod.

const EPSILON: f32 = 0.0; //@spec

// Six numbers in each of six rows.
alias Rows = array<array<vec3<f32>, 2>, 6>;

// Of the second variation, over that of a rod without loads.
var<private> determinant: f32;

// Negative eigenvalues of all pivots; their determinant is left behind.
fn stability_index() -> f32 {
    var index = 0.0;
    determinant = 1.0;
    var S: Mat6;
    for (var i = interval_count; i > 0u; i--) {
        let at = interval_at(i - 1u);
        let b = held_mat6(at + TRANSFER_B);
        let d = held_mat6(at + TRANSFER_D);
        if held(at + BENDS) > 0.5 { index = index + pivots(b, d, S); }
        let left = minus(d, times(S, b));
        let right = minus(times(S, held_mat6(at + TRANSFER_A)), held_mat6(at + TRANSFER_C));
        let next = solve(left, right);
        S = symmetric(next);
    }
    return index;
}

// Negative eigenvalues of one pivot.
fn pivots(b: Mat6, d: Mat6, S: Mat6) -> f32 {
    let C = solve(transposed(d), transposed(b));
    var index = 0.0;
    var signs = vec3<f32>(1.0);
    let root = root(symmetric(C), &signs);
    let product = times(transposed(root), times(swapped(S), root));
    var J = identity6();
    for (var k = 0u; k < 3u; k++) { //@unroll
        J.a[k] *= signs[k];
    } //@end
    var rows = rows_of(minus(J, product));
    for (var k = 0u; k < 6u; k++) { //@unroll UNROLLED
        let pivot = rows[k][k / 3u][k % 3u];
        // A number that is none is no sign of stability.
        if !(pivot > 0.0 && is_finite(pivot)) { index = index + 1.0; }
        determinant *= pivot;
        for (var j = 1u; j < 6u; j++) { //@unroll UNROLLED
            if j > k {
                let factor = rows[j][k / 3u][k % 3u] / pivot;
                rows[j][0] = axpy(-factor, rows[k][0], rows[j][0]);
                rows[j][1] = axpy(-factor, rows[k][1], rows[j][1]);
            }
        } //@end
    } //@end
    return index;
}

// B of a symmetric C = B J B^T, rotations before displacements, a column of zeros and a sign of 1 where C does not yield; `signs`
// are those of rotations. To displacements along it an interval hardly yields, and less than its pass errs.
fn root(C: Mat6, signs: ptr<function, vec3<f32>>) -> Mat6 {
    var rows = rows_of(swapped(C));
    var found: Rows;
    var largest = 0.0;
    for (var k = 0u; k < 6u; k++) { //@unroll UNROLLED
        largest = max(largest, abs(rows[k][k / 3u][k % 3u]));
    } //@end
    let least = largest * (64.0 * EPSILON);
    for (var k = 0u; k < 6u; k++) { //@unroll UNROLLED
        let pivot = rows[k][k / 3u][k % 3u];
        // A displacement that is negative within round-off does not yield, either.
        let is_negative = k < 3u && pivot < -least;
        let sign = select(1.0, -1.0, is_negative);
        if is_negative { (*signs)[k % 3u] = -1.0; }
        let inverse = select(0.0, 1.0 / sqrt(max(abs(pivot), least)), least < pivot || is_negative);
        let first = rows[k][0] * inverse;
        let last = rows[k][1] * inverse;
        for (var j = 0u; j < 3u; j++) { //@unroll
            rows[j][0] = axpy(-sign * first[j], first, rows[j][0]);
            rows[j][1] = axpy(-sign * first[j], last, rows[j][1]);
            rows[j + 3u][0] = axpy(-sign * last[j], first, rows[j + 3u][0]);
            rows[j + 3u][1] = axpy(-sign * last[j], last, rows[j + 3u][1]);
        } //@end
        found[k] = array<vec3<f32>, 2>(first, last);
    } //@end
    // Its columns are in hand.
    return Mat6(
        mat3x3<f32>(found[0][0], found[1][0], found[2][0]),
        mat3x3<f32>(found[3][0], found[4][0], found[5][0]),
        mat3x3<f32>(found[0][1], found[1][1], found[2][1]),
        mat3x3<f32>(found[3][1], found[4][1], found[5][1]),
    );
}

fn rows_of(m: Mat6) -> Rows {
    let columns = transposed(m);
    var rows: Rows;
    for (var k = 0u; k < 3u; k++) { //@unroll
        rows[k] = array<vec3<f32>, 2>(columns.a[k], columns.c[k]);
        rows[k + 3u] = array<vec3<f32>, 2>(columns.b[k], columns.d[k]);
    } //@end
    return rows;
}

// The last of a pair first.
fn swapped(m: Mat6) -> Mat6 {
    return Mat6(m.d, m.c, m.b, m.a);
}

fn symmetric(m: Mat6) -> Mat6 {
    let sum = plus(m, transposed(m));
    return Mat6(sum.a * 0.5, sum.b * 0.5, sum.c * 0.5, sum.d * 0.5);
}
