//! Rotations as matrices, vectors and angles.

use super::{Matrix, Vector};

/// Rotation vector of a rotation matrix, angle up to pi, by way of the quaternion (no loss near 0 or pi).
pub fn rotation_vector(r: &Matrix) -> Vector {
    let trace = r[0][0] + r[1][1] + r[2][2];
    // Four times w² and the squares of x, y, z: divide by the largest.
    let squares = [1.0 + 2.0 * r[0][0] - trace, 1.0 + 2.0 * r[1][1] - trace, 1.0 + 2.0 * r[2][2] - trace];
    let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let largest = (0..3).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    let (mut w, mut v);
    if 1.0 + trace >= squares[largest] {
        (w, v) = (1.0 + trace, skew);
    } else {
        w = skew[largest];
        v = std::array::from_fn(|k| if k == largest { squares[k] } else { r[k][largest] + r[largest][k] });
    }
    if w < 0.0 {
        w = -w;
        v = v.map(|x: f64| -x);
    }
    let sine = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    // Below the bound atan2(s, w)/s is 1/w to the last bit.
    let scale = if sine < 1e-9 * w { 2.0 / w } else { 2.0 * sine.atan2(w) / sine };
    v.map(|x| x * scale)
}

/// Angle of the rotation between two orthonormal frames (rad).
pub fn rotation_angle(a: &Matrix, b: &Matrix) -> f64 {
    let relative: Matrix = std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| a[k][r] * b[k][c]).sum()));
    let v = rotation_vector(&relative);
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// Product of two 3 x 3 matrices.
pub(super) fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|row| std::array::from_fn(|col| (0..3).map(|k| a[row][k] * b[k][col]).sum()))
}

/// Rotation by a rotation vector (Rodrigues).
pub fn rotation_matrix(vector: Vector) -> Matrix {
    let [x, y, z] = vector;
    let angle2 = x * x + y * y + z * z;
    let angle = angle2.sqrt();
    // The series agree with the quotients to the last bit below the bound.
    let (sine, cosine) = if angle < 1e-4 {
        (1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0)
    } else {
        (angle.sin() / angle, (1.0 - angle.cos()) / angle2)
    };
    let diagonal = 1.0 - cosine * angle2;
    [
        [diagonal + cosine * x * x, cosine * x * y - sine * z, cosine * x * z + sine * y],
        [cosine * x * y + sine * z, diagonal + cosine * y * y, cosine * y * z - sine * x],
        [cosine * x * z - sine * y, cosine * y * z + sine * x, diagonal + cosine * z * z],
    ]
}

/// Rotation by rows whose last column points along `t` and whose first lies in the plane of `d1` and `t`.
pub(super) fn orthonormal(d1: Vector, t: Vector) -> Matrix {
    let t = normalised(t);
    let along: f64 = (0..3).map(|k| d1[k] * t[k]).sum();
    let d1 = normalised(std::array::from_fn(|k| d1[k] - along * t[k]));
    let d2 = [t[1] * d1[2] - t[2] * d1[1], t[2] * d1[0] - t[0] * d1[2], t[0] * d1[1] - t[1] * d1[0]];
    std::array::from_fn(|row| [d1[row], d2[row], t[row]])
}

fn normalised(v: Vector) -> Vector {
    let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / norm)
}
