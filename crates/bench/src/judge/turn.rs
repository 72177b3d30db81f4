//! Rotations by quaternions, body to world.

use nalgebra::{Matrix3, Quaternion, Vector3};

/// `hat(v) x = v × x`
pub fn hat(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The quaternion of a rotation vector.
pub fn exp(w: &Vector3<f64>) -> Quaternion<f64> {
    let angle = w.norm();
    let by = if angle < 1e-4 { 0.5 - angle * angle / 48.0 } else { (0.5 * angle).sin() / angle };
    let v = w * by;
    Quaternion::new((0.5 * angle).cos(), v.x, v.y, v.z)
}

/// The rotation vector of a quaternion, at most a half turn.
pub fn log(q: &Quaternion<f64>) -> Vector3<f64> {
    let (v, w) = if q.w < 0.0 { (-q.imag(), -q.w) } else { (q.imag(), q.w) };
    let size = v.norm();
    if size < 1e-12 { 2.0 * v } else { v * (2.0 * size.atan2(w) / size) }
}

/// The rotation matrix of a unit quaternion.
pub fn matrix_of(q: &Quaternion<f64>) -> Matrix3<f64> {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// The second order of `b · exp(w) a` in w: the matrix H of `w · H w / 2`.
pub fn second_order(a: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
    let outer = a * b.transpose();
    0.5 * (outer + outer.transpose()) - Matrix3::from_diagonal_element(a.dot(b))
}
