//! How far the dipoles that stand for a cylindrical magnet are from its field.

use crate::model::vectors::{cross, dot};
use crate::model::{MU0_OVER_4PI, Magnet, MagnetBody, Vector};
use std::f64::consts::PI;

/// Distances from its middle at which that is told, over half of its length or its radius, whichever is larger.
const DISTANCES: [f64; 3] = [2.0, 4.0, 8.0];
/// Directions from its axis to across it.
const DIRECTIONS: usize = 19;
/// Points of a disc: rings, and points on each.
const RINGS: usize = 48;
const ON_RING: usize = 96;
/// A moment across the axis by more than this share is not that of a magnet by its data sheet.
const ALONG: f64 = 1e-6;

/// What is said of a magnet with a body; `None` of a dipole, and of a moment that is not along the axis.
pub fn cylinder_note(magnet: &Magnet) -> Option<String> {
    let body = magnet.body.filter(|body| !body.is_exact)?;
    let along = dot(magnet.moment, body.axis);
    let across: Vector = std::array::from_fn(|k| magnet.moment[k] - along * body.axis[k]);
    if along == 0.0 || dot(across, across).sqrt() > ALONG * along.abs() {
        return None;
    }
    let size = body.length.max(body.diameter) / 2.0;
    let at = |factor: &f64| {
        let distance = factor * size;
        format!("{:.2} % at {:.0} mm", 100.0 * worst(magnet, &body, along, distance), 1e3 * distance)
    };
    let told = DISTANCES.iter().map(at).collect::<Vec<_>>().join(", ");
    Some(format!(
        "`magnets.{}`: dipoles stand for its cylinder, and their field is off by up to {told} from its middle; error estimates do not hold that, field = \"exact\" mends it",
        magnet.name
    ))
}

/// The largest difference of both fields on a sphere, over the exact one there.
fn worst(magnet: &Magnet, body: &MagnetBody, along: f64, distance: f64) -> f64 {
    // Turned about its centre and moved there, it is off by as much.
    let still = Magnet { position: [0.0; 3], rotation: [0.0; 3], strength: 1.0, ..magnet.clone() };
    let dipoles = still.dipoles();
    let side = sideways(body.axis);
    let error = |k: usize| {
        let angle = PI / 2.0 * k as f64 / (DIRECTIONS - 1) as f64;
        let x: Vector = std::array::from_fn(|k| distance * (angle.cos() * body.axis[k] + angle.sin() * side[k]));
        let exact = cylinder_field(body, along, x);
        let ours = dipoles.iter().fold([0.0; 3], |sum, dipole| {
            let r = std::array::from_fn(|k| x[k] - dipole.position[k]);
            add(sum, dipole_field(dipole.moment, r))
        });
        let off = add(ours, exact.map(|b| -b));
        (dot(off, off) / dot(exact, exact)).sqrt()
    };
    (0..DIRECTIONS).map(error).fold(0.0, f64::max)
}

/// Flux density (T) of a cylinder about the origin that is magnetised along its axis, by the charges on its ends; moment in A·m².
fn cylinder_field(body: &MagnetBody, moment: f64, x: Vector) -> Vector {
    let radii = [body.diameter, body.bore].map(|diameter| diameter / 2.0);
    let charge = moment / (PI * (radii[0] * radii[0] - radii[1] * radii[1]) * body.length);
    let (one, two) = (sideways(body.axis), cross(body.axis, sideways(body.axis)));
    let mut field = [0.0; 3];
    for end in [-0.5, 0.5] {
        for ring in 0..RINGS {
            // Rings of one area.
            let [outer, inner] = radii.map(|radius| radius * radius);
            let at = (inner + (outer - inner) * (ring as f64 + 0.5) / RINGS as f64).sqrt();
            let area = PI * (outer - inner) / (RINGS * ON_RING) as f64;
            for k in 0..ON_RING {
                let (sin, cos) = (2.0 * PI * (k as f64 + 0.5) / ON_RING as f64).sin_cos();
                let r: Vector = std::array::from_fn(|k| {
                    x[k] - end * body.length * body.axis[k] - at * (cos * one[k] + sin * two[k])
                });
                let factor = MU0_OVER_4PI * charge * area * 2.0 * end / dot(r, r).powf(1.5);
                field = add(field, r.map(|x| x * factor));
            }
        }
    }
    field
}

fn dipole_field(moment: Vector, r: Vector) -> Vector {
    let square = dot(r, r);
    let along = 3.0 * dot(moment, r) / square;
    std::array::from_fn(|k| MU0_OVER_4PI * (along * r[k] - moment[k]) / square.powf(1.5))
}

fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

/// A unit vector across another.
fn sideways(axis: Vector) -> Vector {
    let least = (0..3).fold(0, |best, k| if axis[k].abs() < axis[best].abs() { k } else { best });
    let v = cross(axis, std::array::from_fn(|k| f64::from(u8::from(k == least))));
    v.map(|x| x / dot(v, v).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cylinder of 50 mm by 50 mm and 1.45 T: on its axis by the closed form, beside it by an independent program (T).
    #[test]
    fn a_cylinder_has_its_known_field() {
        let body = MagnetBody { axis: [0.0, 0.0, 1.0], length: 0.05, diameter: 0.05, bore: 0.0, is_exact: false };
        let moment = body.moment(1.45)[2];
        let end = |s: f64| s / s.hypot(0.025);
        for z in [0.05, 0.1, 0.3] {
            let exact = 1.45 / 2.0 * (end(z + 0.025) - end(z - 0.025));
            let found = cylinder_field(&body, moment, [0.0, 0.0, z])[2];
            assert!((found - exact).abs() < 1e-4 * exact, "{z}: {found} against {exact}");
        }
        for (x, exact) in [(0.026, -0.248_562), (0.03, -0.207_782), (0.04, -0.125_473), (0.05, -0.075_186)] {
            let found: f64 = cylinder_field(&body, moment, [x, 0.0, 0.0])[2];
            assert!((found - exact).abs() < 1e-4 * f64::abs(exact), "{x}: {found} against {exact}");
        }
    }

    #[test]
    fn a_note_tells_how_far_dipoles_are_off() {
        let body = MagnetBody { axis: [0.0, 0.0, 1.0], length: 0.05, diameter: 0.05, bore: 0.0, is_exact: false };
        let magnet = Magnet {
            name: "arm".into(),
            position: [0.1, 0.0, 0.0],
            moment: body.moment(1.45),
            rotation: [0.0, 1.0, 0.0],
            strength: 1.0,
            body: Some(body),
            clearance: 0.025,
        };
        let note = cylinder_note(&magnet).expect("a note");
        // 17 % on the axis at its own size; the far field is a dipole's.
        let off = |distance| worst(&magnet, &body, magnet.moment[2], distance);
        assert!(off(0.05) > 0.16 && off(0.05) < 0.25 && off(0.4) < 1e-3, "{note}");
        assert!(note.contains("magnets.arm") && note.contains("at 50 mm"), "{note}");
        assert_eq!(cylinder_note(&Magnet { body: None, ..magnet.clone() }), None);
        assert_eq!(cylinder_note(&Magnet { moment: [1.0, 0.0, 1.0], ..magnet }), None);
    }
}
