//! How far the dipoles that stand for a magnet with a size are from its field.

use crate::model::vectors::{cross, dot, norm};
use crate::model::{FieldSources, MU0_OVER_4PI, Magnet, MagnetBody, MagnetShape, Vector};
use std::f64::consts::PI;

/// Distances from its middle at which that is told, over half of its largest extent.
const DISTANCES: [f64; 3] = [2.0, 4.0, 8.0];
/// Directions from the axis of a cylinder to across it.
const DIRECTIONS: usize = 19;
/// Directions from a cuboid, over an eighth of a sphere and its neighbours: steps of each coordinate.
const STEPS: i32 = 3;
/// Points of a disc: rings, and points on each.
const RINGS: usize = 48;
const ON_RING: usize = 96;
/// A moment across the axis by more than this share is not that of a magnet by its data sheet.
const ALONG: f64 = 1e-6;

/// What is said of a magnet with a body; `None` of a dipole, and of a moment that is not along the axis.
pub fn magnet_note(magnet: &Magnet) -> Option<String> {
    let body = magnet.body.filter(|body| !body.is_exact)?;
    if let MagnetShape::Cylinder { axis, .. } = body.shape {
        let along = dot(magnet.moment, axis);
        let across: Vector = std::array::from_fn(|k| magnet.moment[k] - along * axis[k]);
        if along == 0.0 || norm(across) > ALONG * along.abs() {
            return None;
        }
    }
    let at = |factor: &f64| {
        let distance = factor * body.shape.extent() / 2.0;
        format!("{:.2} % at {:.0} mm", 100.0 * worst(magnet, &body, distance), 1e3 * distance)
    };
    let told = DISTANCES.iter().map(at).collect::<Vec<_>>().join(", ");
    Some(format!(
        "`magnets.{}`: dipoles stand for its {}, and their field is off by up to {told} from its middle; error estimates do not hold that, field = \"exact\" mends it",
        magnet.name,
        match body.shape {
            MagnetShape::Cylinder { .. } => "cylinder",
            MagnetShape::Cuboid(_) => "cuboid",
        }
    ))
}

/// The largest difference of both fields on a sphere, over the exact one there.
fn worst(magnet: &Magnet, body: &MagnetBody, distance: f64) -> f64 {
    // Turned about its centre and moved there, it is off by as much.
    let still = Magnet { position: [0.0; 3], rotation: [0.0; 3], strength: 1.0, ..magnet.clone() };
    let dipoles = still.dipoles();
    let error = |direction: Vector| {
        let x = direction.map(|x| distance * x);
        let exact = exact_field(&still, body, x);
        let ours = dipoles.iter().fold([0.0; 3], |sum, dipole| {
            let r = std::array::from_fn(|k| x[k] - dipole.position[k]);
            add(sum, dipole_field(dipole.moment, r))
        });
        norm(add(ours, exact.map(|b| -b))) / norm(exact)
    };
    directions(&body.shape).into_iter().map(error).fold(0.0, f64::max)
}

/// Directions, of length one, that show all of a magnet's field.
fn directions(shape: &MagnetShape) -> Vec<Vector> {
    let MagnetShape::Cylinder { axis, .. } = *shape else {
        let steps = -STEPS..=STEPS;
        let all = steps.clone().flat_map(|x| steps.clone().flat_map(move |y| (0..=STEPS).map(move |z| [x, y, z])));
        let outermost = all.filter(|at| at.iter().any(|x| x.abs() == STEPS)).map(|at| at.map(f64::from));
        return outermost.map(|at| at.map(|x| x / norm(at))).collect();
    };
    let side = sideways(axis);
    let at = |k: usize| {
        let (sin, cos) = (PI / 2.0 * k as f64 / (DIRECTIONS - 1) as f64).sin_cos();
        std::array::from_fn(|k| cos * axis[k] + sin * side[k])
    };
    (0..DIRECTIONS).map(at).collect()
}

/// Flux density (T) of a magnet with its centre in the origin.
fn exact_field(magnet: &Magnet, body: &MagnetBody, x: Vector) -> Vector {
    match body.shape {
        MagnetShape::Cylinder { axis, length, diameter, bore } => {
            cylinder_field((axis, length, [diameter, bore]), dot(magnet.moment, axis), x)
        }
        MagnetShape::Cuboid(_) => {
            let exact = Magnet { body: Some(MagnetBody { is_exact: true, ..*body }), ..magnet.clone() };
            let sources = FieldSources { magnets: vec![exact], ..FieldSources::default() };
            sources.rod_field().map_or([0.0; 3], |field| field.flux_density(x))
        }
    }
}

/// Flux density (T) of a cylinder about the origin that is magnetised along its axis, by the charges on its ends; axis, length and
/// diameters, outer and inner (m), moment in A·m².
fn cylinder_field((axis, length, diameters): (Vector, f64, [f64; 2]), moment: f64, x: Vector) -> Vector {
    let radii = diameters.map(|diameter| diameter / 2.0);
    let charge = moment / (PI * (radii[0] * radii[0] - radii[1] * radii[1]) * length);
    let (one, two) = (sideways(axis), cross(axis, sideways(axis)));
    let mut field = [0.0; 3];
    for end in [-0.5, 0.5] {
        for ring in 0..RINGS {
            // Rings of one area.
            let [outer, inner] = radii.map(|radius| radius * radius);
            let at = (inner + (outer - inner) * (ring as f64 + 0.5) / RINGS as f64).sqrt();
            let area = PI * (outer - inner) / (RINGS * ON_RING) as f64;
            for k in 0..ON_RING {
                let (sin, cos) = (2.0 * PI * (k as f64 + 0.5) / ON_RING as f64).sin_cos();
                let r: Vector =
                    std::array::from_fn(|k| x[k] - end * length * axis[k] - at * (cos * one[k] + sin * two[k]));
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
        let cylinder = ([0.0, 0.0, 1.0], 0.05, [0.05, 0.0]);
        let moment = 1.45 * PI / 4.0 * 0.05 * 0.05 * 0.05 / (4.0 * PI * MU0_OVER_4PI);
        let end = |s: f64| s / s.hypot(0.025);
        for z in [0.05, 0.1, 0.3] {
            let exact = 1.45 / 2.0 * (end(z + 0.025) - end(z - 0.025));
            let found = cylinder_field(cylinder, moment, [0.0, 0.0, z])[2];
            assert!((found - exact).abs() < 1e-4 * exact, "{z}: {found} against {exact}");
        }
        for (x, exact) in [(0.026, -0.248_562), (0.03, -0.207_782), (0.04, -0.125_473), (0.05, -0.075_186)] {
            let found: f64 = cylinder_field(cylinder, moment, [x, 0.0, 0.0])[2];
            assert!((found - exact).abs() < 1e-4 * f64::abs(exact), "{x}: {found} against {exact}");
        }
    }

    #[test]
    fn a_note_tells_how_far_dipoles_are_off() {
        let axis = [0.0, 0.0, 1.0];
        let shape = MagnetShape::Cylinder { axis, length: 0.05, diameter: 0.05, bore: 0.0 };
        let body = MagnetBody { shape, is_exact: false };
        let magnet = Magnet {
            name: "arm".into(),
            position: [0.1, 0.0, 0.0],
            moment: shape.moment(1.45, axis),
            rotation: [0.0, 1.0, 0.0],
            strength: 1.0,
            body: Some(body),
            clearance: 0.025,
        };
        let note = magnet_note(&magnet).expect("a note");
        // 17 % on the axis at its own size; the far field is a dipole's.
        let off = |distance| worst(&magnet, &body, distance);
        assert!(off(0.05) > 0.16 && off(0.05) < 0.25 && off(0.4) < 1e-3, "{note}");
        assert!(note.contains("magnets.arm") && note.contains("at 50 mm"), "{note}");
        assert_eq!(magnet_note(&Magnet { body: None, ..magnet.clone() }), None);
        assert_eq!(magnet_note(&Magnet { moment: [1.0, 0.0, 1.0], ..magnet.clone() }), None);
        // The error of a cuboid's dipoles falls with the fourth power of the distance, whatever its moment's direction.
        let cuboid = MagnetBody { shape: MagnetShape::Cuboid([0.05, 0.03, 0.02]), is_exact: false };
        let block = Magnet { moment: [10.0, -20.0, 30.0], body: Some(cuboid), ..magnet };
        let [near, far] = [0.1, 0.2].map(|distance| worst(&block, &cuboid, distance));
        assert!(near < 0.02 && far < 0.1 * near, "{near} {far}");
        assert!(magnet_note(&block).expect("a note").contains("its cuboid"));
    }
}
