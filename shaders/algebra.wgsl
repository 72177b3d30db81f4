// Products of vectors and 3 x 3 matrices; a matrix is its columns. crates/core/src/cpu/algebra.rs

fn zero_matrix() -> mat3x3<f32> {
    return mat3x3<f32>();
}

fn identity() -> mat3x3<f32> {
    return mat3x3<f32>(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(0.0, 0.0, 1.0));
}

// s a + b
fn axpy(s: f32, a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return s * a + b;
}

// a x b + c
fn cross_add(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    return cross(a, b) + c;
}

// c - a x b
fn cross_sub(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    return cross_add(b, a, c);
}

// Inverse by cofactors; its accuracy suffices because Newton's iteration corrects itself.
fn inverse(a: mat3x3<f32>) -> mat3x3<f32> {
    let yz = cross(a[1], a[2]);
    let zx = cross(a[2], a[0]);
    let xy = cross(a[0], a[1]);
    let determinant = dot(a[0], yz);
    return transpose(mat3x3<f32>(yz, zx, xy)) * (1.0 / determinant);
}

// a_k x v + c_k
fn columns_cross_add(a: mat3x3<f32>, v: vec3<f32>, c: mat3x3<f32>) -> mat3x3<f32> {
    return mat3x3<f32>(cross_add(a[0], v, c[0]), cross_add(a[1], v, c[1]), cross_add(a[2], v, c[2]));
}

// c_k - a_k x v
fn columns_cross_sub(a: mat3x3<f32>, v: vec3<f32>, c: mat3x3<f32>) -> mat3x3<f32> {
    return mat3x3<f32>(cross_sub(a[0], v, c[0]), cross_sub(a[1], v, c[1]), cross_sub(a[2], v, c[2]));
}

// a_k x v
fn columns_cross(a: mat3x3<f32>, v: vec3<f32>) -> mat3x3<f32> {
    return mat3x3<f32>(cross(a[0], v), cross(a[1], v), cross(a[2], v));
}

// a row^T + sum
fn outer(a: vec3<f32>, row: vec3<f32>, sum: mat3x3<f32>) -> mat3x3<f32> {
    return mat3x3<f32>(axpy(row.x, a, sum[0]), axpy(row.y, a, sum[1]), axpy(row.z, a, sum[2]));
}

// s a + b
fn columns_axpy(s: f32, a: mat3x3<f32>, b: mat3x3<f32>) -> mat3x3<f32> {
    return mat3x3<f32>(axpy(s, a[0], b[0]), axpy(s, a[1], b[1]), axpy(s, a[2], b[2]));
}

// The matrix whose columns are v x e_k.
fn hat(v: vec3<f32>) -> mat3x3<f32> {
    return mat3x3<f32>(vec3<f32>(0.0, v.z, -v.y), vec3<f32>(-v.z, 0.0, v.x), vec3<f32>(v.y, -v.x, 0.0));
}

// v . a_k
fn row_times(v: vec3<f32>, a: mat3x3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(v, a[0]), dot(v, a[1]), dot(v, a[2]));
}

// Whether two numbers, one of them below `near`, differ more than `most` times.
fn differs_widely(a: f32, b: f32, near: f32, most: f32) -> bool {
    return min(a, b) < near && (a * most < b || b * most < a);
}

// The longest load step from a margin below `near`, which a load step of `used` has taken there from `last`: as it falls, the next
// uses up `share` of it. Beyond a pitchfork other branches are stable. A margin that does not fall bounds no step.
fn affordable(margin: f32, last: f32, used: f32, near: f32, share: f32) -> f32 {
    if margin < last && margin < near { return margin * used * share / (last - margin); }
    return 2.0;
}
