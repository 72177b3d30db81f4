//! Magnets whose field is that of their cylinder. F12

use crate::common::root;
use crate::stretches::{distance, solve};
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::EngineRequest;
use rodsweep::input::{parse_scene, read_scene, write_scene};
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Solutions, Status, Stepper, Vector};
use rodsweep::reference::Reference;
use std::path::PathBuf;

/// A magnet of 1 T along this axis; what it makes at the rod's base turns the dipole of a probe there.
fn scene(axis: &str, diameter: f64, length: f64, rest: &str) -> Scene {
    let text = format!(
        "[[magnet]]\nname = \"arm\"\nposition = [0, 0, 0]\naxis = {axis}\ndiameter = {diameter}\nlength = {length}\nremanence = 1\nfield = \"exact\"\n{rest}"
    );
    parse_scene("scene.toml".as_ref(), &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn reports() -> PathBuf {
    root().join("tests/data/reports/14-near-magnet")
}

/// A place beside a magnet of 1 T along z, and B there by magpylib 6.3.
struct Point {
    diameter: f64,
    bore: f64,
    length: f64,
    at: Vector,
    flux_density: Vector,
}

/// A thousand places beside cylinders, three hundred beside rings.
fn points() -> Vec<Point> {
    let read = |name: &str| std::fs::read_to_string(root().join("tests/data/magnets").join(name)).expect("there");
    let number = |cell: &str| cell.parse::<f64>().expect("a number");
    let cells = |line: &str| line.split(',').map(number).collect::<Vec<f64>>();
    let of_cylinder = |line: &str| {
        let cells = cells(line);
        [&[cells[0], 0.0], &cells[1..]].concat()
    };
    let (cylinders, rings) = (read("cylinders.csv"), read("rings.csv"));
    let all = cylinders.lines().skip(1).map(of_cylinder).chain(rings.lines().skip(1).map(cells));
    let three = |cells: &[f64]| std::array::from_fn(|k| cells[k]);
    all.map(|c| Point { diameter: c[0], bore: c[1], length: c[2], at: three(&c[3..]), flux_density: three(&c[6..]) })
        .collect()
}

pub fn norm(v: Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub fn apart(a: Vector, b: Vector) -> f64 {
    norm(std::array::from_fn(|k| a[k] - b[k]))
}

fn plan(scene: &Scene, wrt: &[Parameter], precision: Precision) -> Plan {
    let tolerance = if precision == Precision::F64 { 1e-9 } else { 2e-5 };
    let options = PlanOptions { stepper: Stepper::Dop853, steps: 16, tolerance, ..PlanOptions::default() };
    Plan::new(scene, &[], wrt, options).expect("the scene plans")
}

pub fn engines(scene: &Scene, wrt: &[Parameter]) -> Vec<(String, Solutions, f64)> {
    let mut all = Vec::new();
    for (precision, pose) in [(Precision::F64, 1e-8), (Precision::F32, 1e-4)] {
        let plan = plan(scene, wrt, precision);
        all.push((format!("cpu {precision}"), solve(&plan, &mut Cpu::new(&plan, precision).expect("supported")), pose));
    }
    let plan = plan(scene, wrt, Precision::F64);
    all.push(("reference".into(), solve(&plan, &mut Reference::new(&plan)), 1e-9));
    all
}

/// Axes that turn z to another axis of the world, whose field is that of z with components in turn.
const TURNS: [(&str, [usize; 3]); 3] = [("[0, 0, 1]", [0, 1, 2]), ("[1, 0, 0]", [1, 2, 0]), ("[0, 1, 0]", [2, 0, 1])];

#[test]
fn the_field_is_that_of_another_program_at_a_thousand_places() {
    let points = points();
    assert_eq!(points.len(), 1300);
    let probe =
        "[[segment]]\nname = \"stem\"\nkind = \"flexible\"\nlength = 1e-6\nstiffness = { bending = 1, torsion = 1 }\n";
    for (k, Point { diameter, bore, length, at, flux_density }) in points.into_iter().enumerate() {
        let (axis, order) = TURNS[k % 3];
        let field = scene(
            axis,
            diameter,
            length,
            &format!("inner_diameter = {bore}\n[base]\nposition = [0, 0, {}]\n{probe}", 100.0 * length.max(diameter)),
        )
        .sources
        .rod_field()
        .expect("a field");
        // `order` says which component of the world is x, y, z of the magnet.
        let in_world = |v: Vector| -> Vector {
            let mut w = [0.0; 3];
            order.iter().zip(v).for_each(|(at, x)| w[*at] = x);
            w
        };
        let (at, expected) = (in_world(at), in_world(flux_density));
        let found = field.flux_density(at);
        let error = apart(found, expected) / norm(expected);
        assert!(error < 2e-9, "point {k}: {error:.1e}");
        // The force on a dipole is the slope of mu . B.
        let (mu, h) = ([0.3, -0.5, 0.8], 1e-4 * norm(at));
        let moved = |axis: usize, by: f64| {
            let b = field.flux_density(std::array::from_fn(|k| at[k] + if k == axis { by } else { 0.0 }));
            (0..3).map(|k| mu[k] * b[k]).sum::<f64>()
        };
        let slope = std::array::from_fn(|axis| {
            (8.0 * (moved(axis, h) - moved(axis, -h)) - (moved(axis, 2.0 * h) - moved(axis, -2.0 * h))) / (12.0 * h)
        });
        let force = field.load(at, mu).0;
        let error = apart(force, slope) / norm(slope);
        assert!(error < 1e-6 || k % 5 == 1, "point {k}: force {error:.1e}");
    }
}

/// A stiff probe bears the torque of the field at its place: kernels and reference agree with the model's field.
#[test]
fn kernels_have_the_same_field() {
    for (k, Point { diameter, bore, length, at: [x, y, z], flux_density }) in
        points().into_iter().enumerate().step_by(9)
    {
        // A torque of about 1 N·m, which turns the probe by a billionth.
        let moment = 1e9 / norm(flux_density);
        let probe = format!(
            "inner_diameter = {bore}\n[base]\nposition = [{x}, {y}, {z}]\n[[segment]]\nname = \"stem\"\nkind = \"flexible\"\nlength = 1e-9\n\
             stiffness = {{ bending = 1, torsion = 1 }}\n[[segment]]\nname = \"probe\"\nkind = \"rigid\"\nlength = 1e-9\n\
             dipole_per_length = [{moment}, 0, 0]\n"
        );
        let scene = scene("[0, 0, 1]", diameter, length, &probe);
        // Torque and force at the probe's middle: mu e1 x B = mu (0, -Bz, By).
        let (mu, arm) = (1e-9 * moment, 1.5e-9);
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

/// Tips of a shooting solver of its own in magpylib's field.
#[test]
fn a_guidewire_beside_a_magnet_bends_as_another_program_has_it() {
    for (x, tip) in [(0.05, -5.614e-3), (0.055, -5.413e-3), (0.06, -5.083e-3)] {
        let mut scene = read_scene(&reports().join("guidewire.toml")).expect("there");
        let magnet = &mut scene.sources.magnets[0];
        magnet.position[0] = x;
        magnet.body.iter_mut().for_each(|body| body.is_exact = true);
        magnet.clearance = 1e-3;
        for (name, found, _) in engines(&scene, &[]) {
            assert!(found.status(0).is_success(), "{name} at {x}: {:?}", found.status(0));
            let error = (found.vector(0, Quantity::TipPosition)[0] - tip).abs();
            assert!(error < 6e-7, "{name} at {x}: {error:.1e} m");
        }
    }
}

/// A magnetised tube and a magnet at its tip, as the end of a scene whose magnet stands about the origin.
pub const BESIDE: &str = "[base]\nposition = [0.045, 0.01, -0.02]\nrotation = [0.2, -0.3, 0.1]\n[loads]\ngravity = [0, -9.81, 0]\n\
     [[segment]]\nname = \"tube\"\nkind = \"flexible\"\nlength = 0.04\nlinear_density = 1e-3\n\
     stiffness = { bending_x = 2e-5, bending_y = 3e-5, torsion = 1.5e-5 }\ndipole_per_length = [0, 0, 0.3]\n\
     [[segment]]\nname = \"tip\"\nkind = \"rigid\"\nlength = 0.006\nmass = 2e-5\ndipole_per_length = [0, 0, 3]\n";

/// The rod beside a magnet that is turned.
fn beside() -> Scene {
    let mut scene = scene("[0, 0.6, 0.8]", 0.03, 0.04, BESIDE);
    scene.sources.magnets[0].rotation = [0.4, -0.2, 0.7];
    scene
}

#[test]
fn columns_are_those_of_neighbours() {
    let names =
        ["magnets.arm.position", "magnets.arm.rotation", "magnets.arm.strength", "base.position", "tube.length"];
    check_columns(&beside(), &names);
}

/// Columns by these parameters are those of the reference's tips beside the scene.
pub fn check_columns(scene: &Scene, names: &[&str]) {
    let wrt: Vec<Parameter> = names.iter().flat_map(|name| Parameter::parse(scene, name).expect(name)).collect();
    let all = engines(scene, &wrt);
    for (k, parameter) in wrt.iter().enumerate() {
        let value = parameter.get(scene);
        let size = match parameter.unit() {
            "m" => 0.02,
            "A·m²" => norm(scene.sources.magnets[0].moment),
            _ => 1.0,
        };
        let tip = |by: f64| {
            let mut moved = scene.clone();
            parameter.set(&mut moved, value + by * size).expect("a value");
            let plan = plan(&moved, &[], Precision::F64);
            solve(&plan, &mut Reference::new(&plan)).vector(0, Quantity::TipPosition)
        };
        let (low, high) = (tip(-1e-4), tip(1e-4));
        let slope = [0, 1, 2].map(|axis| (high[axis] - low[axis]) / (2e-4 * size));
        for (name, found, pose) in &all {
            assert!(found.status(0).is_success(), "{name}: {:?}", found.status(0));
            let column = [0, 1, 2].map(|axis| found.derivative(0, k, axis));
            let error = apart(column, slope) / norm(slope);
            assert!(error < 1e-5 + 20.0 * pose, "{name}, {}: {error:.1e}", parameter.name(scene));
        }
    }
}

#[test]
fn engines_agree_and_nothing_comes_too_near() {
    check_around(&beside());
}

/// Engines agree with the reference at sixty places of the base around the magnet, some of which are too near.
pub fn check_around(scene: &Scene) {
    let (mut solved, mut near) = (0, 0);
    for k in 0..60 {
        let mut moved = scene.clone();
        let angle = 0.3 * k as f64;
        let away = 0.022 + 4e-4 * k as f64;
        moved.base.position = [away * angle.cos(), away * angle.sin(), -0.03 + 1e-3 * (k % 40) as f64];
        if moved.validate().is_err() {
            near += 1;
            continue;
        }
        let found = engines(&moved, &[]);
        let truth = &found[2].1;
        near += usize::from(truth.status(0) == Status::TooNearMagnet);
        solved += usize::from(truth.status(0).is_success());
        for (name, of, pose) in &found[..2] {
            if of.status(0).is_success() && truth.status(0).is_success() {
                let error = distance(of, truth, 0.046);
                assert!(error < 10.0 * pose, "{name}, {k}: {error:.1e}");
            }
        }
    }
    assert!(solved > 25 && near > 3, "{solved} solved, {near} too near");
}

/// Beyond a few of its sizes the dipoles that stand for a ring have its field, and its moment is that of its volume.
#[test]
fn a_ring_of_dipoles_has_its_second_moment() {
    for (k, Point { diameter, bore, length, .. }) in points().into_iter().enumerate().skip(1000) {
        let probe = "[base]\nposition = [0, 0, 9]\n[[segment]]\nname = \"stem\"\nkind = \"flexible\"\nlength = 1e-6\nstiffness = { bending = 1, torsion = 1 }\n";
        let ring = scene("[0, 0.6, 0.8]", diameter, length, &format!("inner_diameter = {bore}\n{probe}"));
        let volume = std::f64::consts::PI / 4.0 * (diameter * diameter - bore * bore) * length;
        let moment = norm(ring.sources.magnets[0].moment) * 4e-7 * std::f64::consts::PI;
        assert!((moment / volume - 1.0).abs() < 1e-9, "ring {k}: {moment} against {volume}");
        assert_eq!(parse_scene("x.toml".as_ref(), &write_scene(&ring)).expect("what was written"), ring);
        let mut dipoles = ring.clone();
        dipoles.sources.magnets[0].body.iter_mut().for_each(|body| body.is_exact = false);
        let fields = [&ring, &dipoles].map(|scene| scene.sources.rod_field().expect("a field"));
        let worst_at = |sizes: f64| {
            let apart_in = |direction: Vector| {
                let at = direction.map(|x| x * sizes * length.max(diameter));
                let [exact, stands_for] = [0, 1].map(|k| fields[k].flux_density(at));
                apart(exact, stands_for) / norm(exact)
            };
            [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.48, 0.6, 0.64]].map(apart_in).into_iter().fold(0.0, f64::max)
        };
        // The error of the dipoles falls with the fourth power of the distance.
        let (near, far) = (worst_at(4.0), worst_at(8.0));
        assert!(near < 4e-3 && far < 0.1 * near, "ring {k}: {near:.1e}, {far:.1e}");
    }
}

#[test]
fn what_cannot_be_is_refused_and_a_gpu_leaves_it_to_the_cpu() {
    let scene = beside();
    assert_eq!(parse_scene("x.toml".as_ref(), &write_scene(&scene)).expect("what was written"), scene);
    assert!(Parameter::parse(&scene, "magnets.arm.moment").is_err());
    let engine = EngineRequest::default().backend(Some(BackendKind::Gpu)).choose_for(&scene, 1e-4).expect("an engine");
    assert!(engine.kind() == BackendKind::Cpu && engine.reason().contains("cylinder"), "{}", engine.reason());
    let text = write_scene(&scene);
    let clearance = text.lines().find(|line| line.starts_with("clearance")).expect("a clearance");
    let moment = text.lines().find(|line| line.starts_with("moment")).expect("a moment");
    for (from, to, key, words) in [
        (clearance, "clearance = 1e-5", "magnet[0].clearance", "fiftieth"),
        (moment, "moment = [1, 0, 0]", "magnet[0].moment", "along `axis`"),
        ("field = \"exact\"", "field = \"exactly\"", "magnet[0].field", "did you mean `exact`"),
        ("field =", "inner_diameter = 0.03\nfield =", "magnet[0].inner_diameter", "less than `diameter`"),
        ("field =", "inner_diameter = -0.01\nfield =", "magnet[0].inner_diameter", "at least zero"),
    ] {
        let error = parse_scene("x.toml".as_ref(), &text.replace(from, to)).expect_err(key);
        assert_eq!(error.key, key, "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
}
