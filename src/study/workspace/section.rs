//! What a plane or a line cuts out of a cube.

use crate::model::Vector;

/// Components of a normal below this are taken as this: the closed form divides by them.
const LEAST_NORMAL: f64 = 1e-4;

/// Area or length inside the cube of edge 1 about the origin: of the plane through a point with a unit normal, or of
/// the line through it with a unit direction.
pub(super) fn section(dimension: usize, direction: Vector, point: Vector) -> f64 {
    match dimension {
        2 => plane_section(direction, point),
        _ => line_section(direction, point),
    }
}

/// A = Σ over the corners b of (-1)^|b| max(0, q - b·n)² / (2 n1 n2 n3) with q = ½ Σ n + |d|, all n positive, d the
/// distance of the plane from the middle.
fn plane_section(normal: Vector, point: Vector) -> f64 {
    let distance = (0..3).map(|k| normal[k] * point[k]).sum::<f64>().abs();
    let mut n = normal.map(|x| x.abs().max(LEAST_NORMAL));
    let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
    n = n.map(|x| x / length);
    let half: f64 = 0.5 * n.iter().sum::<f64>();
    if distance >= half {
        return 0.0;
    }
    let corner = |corner: usize| {
        let bit = |axis: usize| ((corner >> axis) & 1) as f64;
        let along = half + distance - (0..3).map(|axis| bit(axis) * n[axis]).sum::<f64>();
        let sign = if corner.count_ones().is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * along.max(0.0).powi(2)
    };
    ((0..8).map(corner).sum::<f64>() / (2.0 * n[0] * n[1] * n[2])).max(0.0)
}

fn line_section(direction: Vector, point: Vector) -> f64 {
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (d, p) = (direction[axis], point[axis]);
        if d.abs() < 1e-12 {
            if p.abs() > 0.5 {
                return 0.0;
            }
            continue;
        }
        let (a, b) = ((-0.5 - p) / d, (0.5 - p) / d);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    (to - from).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_those_of_geometry() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-3, "{a} {b}");
        near(plane_section([0.0, 0.0, 1.0], [0.0; 3]), 1.0);
        near(plane_section([0.0, 0.0, 1.0], [0.0, 0.0, 0.6]), 0.0);
        let n = 0.5f64.sqrt();
        near(plane_section([n, n, 0.0], [0.0; 3]), 2f64.sqrt());
        let n = (1.0f64 / 3.0).sqrt();
        near(plane_section([n, -n, n], [0.0; 3]), 0.75 * 3f64.sqrt());
        near(line_section([1.0, 0.0, 0.0], [0.3, 0.1, 0.1]), 1.0);
        near(line_section([n, n, n], [0.0; 3]), 3f64.sqrt());
        near(line_section([1.0, 0.0, 0.0], [0.0, 0.6, 0.0]), 0.0);
    }

    #[test]
    fn sections_of_a_lattice_add_up() {
        // Of the plane through the origin with this normal: so much inside a cube of edge 8, by cubes of edge 1.
        let n = [0.6, 0.48, 0.64];
        let whole = plane_section(n, [0.01, 0.02, -0.005]) * 64.0;
        let mut sum = 0.0;
        for (x, y, z) in (0..512).map(|k| (k % 8, k / 8 % 8, k / 64)) {
            let centre = [x, y, z].map(|k| f64::from(k) - 3.5);
            let point: Vector = std::array::from_fn(|k| 8.0 * [0.01, 0.02, -0.005][k] - centre[k]);
            sum += plane_section(n, point);
        }
        assert!((sum - whole).abs() < 1e-9, "{sum} {whole}");
    }
}
