//! Magnets whose field is that of their cuboid. F13

use crate::common::root;
use crate::exact_magnets::{BESIDE, apart, check_around, check_columns, engines, norm};
use crate::stretches::distance;
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::input::{parse_scene, write_scene};
use rodsweep::model::{MagnetShape, Quantity, Scene, Vector};
use std::f64::consts::PI;

/// A cuboid with a polarisation (T), and B at a place by magpylib 6.3.
struct Point {
    size: Vector,
    polarisation: Vector,
    at: Vector,
    flux_density: Vector,
}

/// A thousand places: near faces, edges and corners, in the planes of faces, on the lines of edges, on axes, as far as thirty lengths.
fn points() -> Vec<Point> {
    let text = std::fs::read_to_string(root().join("tests/data/magnets/cuboids.csv")).expect("there");
    let read = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let three = |from: usize| std::array::from_fn(|k| cells[from + k]);
        Point { size: three(0), polarisation: three(3), at: three(6), flux_density: three(9) }
    };
    text.lines().skip(1).map(read).collect()
}

fn parsed(text: &str) -> Scene {
    parse_scene("scene.toml".as_ref(), text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// A cuboid about the origin, and a rod.
fn scene(size: Vector, moment: Vector, rest: &str) -> Scene {
    parsed(&format!(
        "[[magnet]]\nname = \"arm\"\nposition = [0, 0, 0]\nsize = {size:?}\nmoment = {moment:?}\nfield = \"exact\"\n{rest}"
    ))
}

/// The moment of a polarisation (T).
fn moment(size: Vector, polarisation: Vector) -> Vector {
    MagnetShape::Cuboid(size).moment(1.0, polarisation)
}

#[test]
fn the_field_is_that_of_another_program_at_a_thousand_places() {
    let points = points();
    assert_eq!(points.len(), 1000);
    let probe = "[base]\nposition = [0, 0, 9]\n[[segment]]\nname = \"stem\"\nkind = \"flexible\"\nlength = 1e-6\nstiffness = { bending = 1, torsion = 1 }\n";
    for (k, Point { size, polarisation, at, flux_density }) in points.into_iter().enumerate() {
        let field = scene(size, moment(size, polarisation), probe).sources.rod_field().expect("a field");
        let error = apart(field.flux_density(at), flux_density) / norm(flux_density);
        assert!(error < 2e-9, "point {k}: {error:.1e}");
        // The force on a dipole is the slope of mu . B.
        let away = (0..3).map(|k| (at[k].abs() - 0.5 * size[k]).max(0.0).powi(2)).sum::<f64>().sqrt();
        let (mu, h) = ([0.3, -0.5, 0.8], 0.01 * away);
        let moved = |axis: usize, by: f64| {
            let b = field.flux_density(std::array::from_fn(|k| at[k] + if k == axis { by } else { 0.0 }));
            (0..3).map(|k| mu[k] * b[k]).sum::<f64>()
        };
        let slope = std::array::from_fn(|axis| {
            (8.0 * (moved(axis, h) - moved(axis, -h)) - (moved(axis, 2.0 * h) - moved(axis, -2.0 * h))) / (12.0 * h)
        });
        let error = apart(field.load(at, mu).0, slope) / norm(slope);
        assert!(error < 1e-6, "point {k}: force {error:.1e}");
    }
}

/// A stiff probe bears the torque of the field at its place: kernels and reference agree with the model's field.
#[test]
fn kernels_have_the_same_field() {
    for (k, Point { size, polarisation, at: [x, y, z], flux_density }) in points().into_iter().enumerate().step_by(3) {
        // A torque of about 1 N·m, which turns the probe by a billionth.
        let mu = 1.0 / norm(flux_density);
        let probe = format!(
            "[base]\nposition = [{x}, {y}, {z}]\n[[segment]]\nname = \"stem\"\nkind = \"flexible\"\nlength = 1e-9\n\
             stiffness = {{ bending = 1, torsion = 1 }}\n[[segment]]\nname = \"probe\"\nkind = \"rigid\"\nlength = 1e-9\n\
             dipole_per_length = [{}, 0, 0]\n",
            1e9 * mu
        );
        let scene = scene(size, moment(size, polarisation), &format!("clearance = 1e-6\n{probe}"));
        // Torque and force at the probe's middle: mu e1 x B = mu (0, -Bz, By).
        let arm = 1.5e-9;
        let field = scene.sources.rod_field().expect("a field");
        let (force, torque) = field.load([x, y, z + arm], [mu, 0.0, 0.0]);
        let expected = [torque[0] - arm * force[1], torque[1] + arm * force[0], torque[2]];
        // In single precision such moments are round-off.
        for (name, found, pose) in engines(&scene, &[]).into_iter().filter(|(name, ..)| !name.ends_with("f32")) {
            let error = apart(found.vector(0, Quantity::BaseMoment), expected);
            assert!(found.status(0).is_success(), "{name}, point {k}: {:?}", found.status(0));
            assert!(error < 10.0 * pose, "{name}, point {k}: {error:.1e}");
        }
    }
}

/// The rod beside a cuboid that is turned.
fn beside() -> Scene {
    let size = [0.02, 0.03, 0.04];
    let mut scene = scene(size, moment(size, [0.5, -0.4, 0.7]), BESIDE);
    scene.sources.magnets[0].rotation = [0.4, -0.2, 0.7];
    scene
}

#[test]
fn columns_are_those_of_neighbours() {
    let names = [
        "magnets.arm.position",
        "magnets.arm.rotation",
        "magnets.arm.moment",
        "magnets.arm.strength",
        "base.position",
        "tube.length",
    ];
    check_columns(&beside(), &names);
}

#[test]
fn engines_agree_and_nothing_comes_too_near() {
    check_around(&beside());
}

/// Two halves, face to face, are the whole.
#[test]
fn a_cuboid_is_the_sum_of_its_halves() {
    let whole = beside();
    let mut halves = whole.clone();
    let turned = rodsweep::model::rotation_matrix(whole.sources.magnets[0].rotation);
    let mut half = whole.sources.magnets[0].clone();
    half.body.iter_mut().for_each(|body| body.shape = MagnetShape::Cuboid([0.02, 0.03, 0.02]));
    half.moment = half.moment.map(|x| 0.5 * x);
    let shifted = |name: &str, by: f64| {
        let mut of = half.clone();
        of.name = name.into();
        of.position = std::array::from_fn(|k| of.position[k] + by * turned[k][2]);
        of
    };
    halves.sources.magnets = vec![shifted("upper", 0.01), shifted("lower", -0.01)];
    let (one, two) = (engines(&whole, &[]), engines(&halves, &[]));
    for ((name, of_one, pose), (_, of_two, _)) in one.iter().zip(&two) {
        assert!(of_one.status(0).is_success() && of_two.status(0).is_success(), "{name}");
        let error = distance(of_one, of_two, 0.046);
        assert!(error < pose.max(2e-9), "{name}: {error:.1e}");
    }
}

/// The dipoles that stand for a cuboid have its second moment, and its moment is that of its volume.
#[test]
fn dipoles_of_a_cuboid_have_its_second_moment() {
    for (k, size) in [[0.02, 0.03, 0.04], [0.03, 0.03, 0.01], [0.01, 0.01, 0.05], [0.02; 3]].into_iter().enumerate() {
        let block = |field: &str| {
            parsed(&format!(
                "[[magnet]]\nname = \"arm\"\nposition = [0, 0, 0]\nsize = {size:?}\naxis = [0, 3, 4]\nremanence = 1.2\nfield = \"{field}\"\n\
                 [base]\nposition = [0, 0, 9]\n[[segment]]\nname = \"stem\"\nkind = \"flexible\"\nlength = 1e-6\n\
                 stiffness = {{ bending = 1, torsion = 1 }}\n"
            ))
        };
        let scenes = ["exact", "dipoles"].map(block);
        assert_eq!(scenes[1].sources.magnets[0].dipole_count(), [4, 4, 2, 1][k]);
        let expected = 1.2 * size.iter().product::<f64>() / (4e-7 * PI);
        assert!((norm(scenes[0].sources.magnets[0].moment) / expected - 1.0).abs() < 1e-9);
        assert_eq!(parsed(&write_scene(&scenes[k % 2])), scenes[k % 2]);
        let fields = scenes.map(|scene| scene.sources.rod_field().expect("a field"));
        let worst_at = |away: f64| {
            let off = |direction: Vector| {
                let [exact, stands_for] = [0, 1].map(|k| fields[k].flux_density(direction.map(|x| x * away)));
                apart(exact, stands_for) / norm(exact)
            };
            [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.48, 0.6, 0.64]].map(off).into_iter().fold(0.0, f64::max)
        };
        // The error of the dipoles falls with the fourth power of the distance.
        let (near, far) = (worst_at(0.2), worst_at(0.4));
        assert!(near < 6e-3 && far < 0.1 * near, "{size:?}: {near:.1e}, {far:.1e}");
    }
}

#[test]
fn what_cannot_be_is_refused_and_a_gpu_leaves_it_to_the_cpu() {
    let scene = beside();
    assert_eq!(parsed(&write_scene(&scene)), scene);
    let engine = EngineRequest::default().backend(Some(BackendKind::Gpu)).choose_for(&scene, 1e-4).expect("an engine");
    assert!(engine.kind() == BackendKind::Cpu && engine.reason().contains("cuboid"), "{}", engine.reason());
    let text = write_scene(&scene);
    let line = |key: &str| text.lines().find(|line| line.starts_with(key)).expect("there");
    for (from, to, key, words) in [
        (line("clearance"), "clearance = 0", "magnet[0].clearance", "greater than zero"),
        (line("size"), "size = [0.02, 0, 0.04]", "magnet[0].size", "greater than zero"),
        (line("size"), "size = [0.02, 0.03, 0.04]\ndiameter = 0.01", "magnet[0].size", "keep one of the two"),
        (line("size"), "size = [0.02, 0.03, 0.04]\naxis = [0, 0, 1]", "magnet[0].axis", "keep one of the two"),
        (line("moment"), "remanence = 1", "magnet[0].axis", "direction of magnetisation"),
        (line("size"), "", "magnet[0].axis", "or size"),
    ] {
        let error = parse_scene("x.toml".as_ref(), &text.replace(from, to)).expect_err(key);
        assert_eq!(error.key, key, "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
}
