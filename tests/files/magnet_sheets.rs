//! Magnets by their data sheet: dipole and mass follow from size and material, with derivatives.

use crate::common::root;
use rodsweep::input::{InputError, assign, parse_scene, read_scene, write_scene};
use rodsweep::model::{Parameter, RodSegment, Scene, SegmentKind};
use rodsweep::study::Solve;
use std::f64::consts::PI;

const MU0: f64 = 4e-7 * PI;

fn text(tip: &str) -> String {
    format!(
        "[field]\nflux_density = [\"30 mT\", 0, \"5 mT\"]\n[loads]\ngravity = [0, 1, -9.81]\nfluid_density = 1060\n[[segment]]\nname = \
         \"wire\"\nkind = \"flexible\"\nlength = \"60 mm\"\nstiffness = {{ bending = 2e-5, torsion = 1.5e-5 }}\nlinear_density = 1e-3\n\
         [[segment]]\nname = \"tip\"\nkind = \"rigid\"\nlength = \"4 mm\"\n{tip}\n"
    )
}

fn read(tip: &str) -> Result<Scene, InputError> {
    parse_scene("scene.toml".as_ref(), &text(tip))
}

fn good(tip: &str) -> Scene {
    read(tip).unwrap_or_else(|error| panic!("{error}"))
}

/// Dipole and mass of the tip.
fn tip(scene: &Scene) -> ([f64; 3], f64) {
    let RodSegment::Rigid(rod) = scene.rod().segments[1] else { panic!("no tip") };
    let SegmentKind::Rigid(rigid) = &scene.segments[1].kind else { panic!("no tip") };
    (rod.dipole, scene.mass(rigid, 4e-3))
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-14 * expected.abs(), "{found} {expected}");
}

#[test]
fn dipole_and_mass_follow() {
    let area = PI * (1e-3_f64.powi(2) - 0.3e-3_f64.powi(2));
    let tube = "tube = { inner_radius = \"0.3 mm\", outer_radius = \"1 mm\" }\n";
    let (dipole, mass) = tip(&good(&format!("{tube}density = 7500\nremanence = \"1.4 T\"")));
    close(dipole[2], 1.4 / MU0 * area * 4e-3);
    // Net of displaced fluid, as that of flexible tubes.
    close(mass, (7500.0 - 1060.0) * area * 4e-3);
    let (dipole, mass) =
        tip(&good(&format!("{tube}mass = \"1 g\"\nmagnetization = [\"100 kA/m\", 0, -2e5]\nvolume_fraction = 0.3")));
    close(dipole[0], 0.3 * 1e5 * area * 4e-3);
    close(dipole[2], -0.3 * 2e5 * area * 4e-3);
    assert_eq!((dipole[1], mass), (0.0, 1e-3));
    let (dipole, mass) = tip(&good("diameter = \"2 mm\"\nremanence = [0, 0, \"1.4 T\"]"));
    close(dipole[2], 1.4 / MU0 * PI * 1e-6 * 4e-3);
    assert_eq!(mass, 0.0);
    // A magnetic tube that bends.
    let bends = "[field]\nflux_density = [0, \"10 mT\", 0]\n[[segment]]\nname = \"w\"\nkind = \"flexible\"\nlength = \"20 mm\"\ndiameter = \
                 \"0.8 mm\"\nyoungs_modulus = \"3 MPa\"\npoisson_ratio = 0.45\nremanence = \"0.15 T\"\nvolume_fraction = 0.25\n";
    let scene = parse_scene("scene.toml".as_ref(), bends).unwrap_or_else(|error| panic!("{error}"));
    let RodSegment::Flexible(rod) = scene.rod().segments[0] else { panic!("no wire") };
    close(rod.dipole[2], 0.25 * 0.15 / MU0 * PI * 0.16e-6);
    assert_eq!(parse_scene("x.toml".as_ref(), &write_scene(&scene)).expect("what was written"), scene);
    has_derivatives(
        &scene,
        &["w.remanence", "w.volume_fraction", "w.tube.outer_radius", "w.youngs_modulus", "w.length"],
    );
}

/// Tips of neighbours against the Jacobian.
fn has_derivatives(scene: &Scene, names: &[&str]) {
    let solved = Solve::new(scene.clone()).tolerance(1e-9).wrt(names).run().expect("an answer");
    assert!(solved.is_converged());
    for (k, name) in names.iter().enumerate() {
        let value = Parameter::parse(scene, name).expect("a parameter")[0].get(scene);
        let step = 1e-4 * value.abs().max(1e-3);
        let tip = |by: f64| {
            let mut moved = scene.clone();
            assign(&mut moved, &[format!("{name}={}", value + by * step)]).expect("a value");
            let solved = Solve::new(moved).tolerance(1e-9).without_derivatives().run().expect("an answer");
            solved.tip_position()
        };
        let (low, high) = (tip(-1.0), tip(1.0));
        let column: [f64; 3] = std::array::from_fn(|row| solved.jacobian().position()[row][k]);
        let size = column.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        assert!(size > 0.0, "{name} moves nothing");
        for row in 0..3 {
            let expected = (high[row] - low[row]) / (2.0 * step);
            assert!((column[row] - expected).abs() < 2e-5 * size + 1e-10 / step, "{name}: {column:?} {expected}");
        }
    }
}

#[test]
fn numbers_of_the_sheet_have_derivatives() {
    let tube = "tube = { inner_radius = \"0.3 mm\", outer_radius = \"1 mm\" }\n";
    let scene = good(&format!("{tube}density = 7500\nremanence = \"1.4 T\"\nvolume_fraction = 0.2"));
    let names =
        ["tip.remanence", "tip.volume_fraction", "tip.density", "tip.tube.inner_radius", "tip.tube.outer_radius"];
    has_derivatives(
        &scene,
        &[&names[..], &["tip.diameter", "tip.length", "loads.gravity.y", "loads.fluid_density"]].concat(),
    );
    let scene = good(&format!("{tube}density = 7500\nmagnetization = [1e5, 2e4, 3e5]"));
    has_derivatives(&scene, &["tip.magnetization.x", "tip.magnetization.y", "tip.magnetization.z"]);
    assert_eq!(parse_scene("x.toml".as_ref(), &write_scene(&scene)).expect("what was written"), scene);
}

#[test]
fn contradictions_are_named() {
    let cases = [
        ("diameter = 1e-3\nremanence = 1.2\ndipole_per_length = [0, 0, 1]", "remanence", "dipole_per_length"),
        ("diameter = 1e-3\nremanence = 1.2\nmagnetization = 1e6", "remanence", "magnetization"),
        ("diameter = 1e-3\nmass = 1e-4\ndensity = 7500", "density", "mass"),
        ("diameter = 1e-3\ntube = { inner_radius = 0, outer_radius = 1e-3 }", "diameter", "tube"),
        ("remanence = 1.2", "tube", "give tube, or diameter"),
        ("density = 7500", "tube", "give tube, or diameter"),
        ("diameter = 1e-3\nvolume_fraction = 0.2", "remanence", "give remanence or magnetization"),
        ("diameter = 1e-3\nremanence = 1.2\nvolume_fraction = 1.2", "volume_fraction", "from 0 to 1"),
        ("tube = { inner_radius = 2e-3, outer_radius = 1e-3 }", "tube.inner_radius", "below"),
        ("diameter = 1e-3\nremanence = \"3 mm\"", "remanence", "flux density"),
        ("mass = -1e-4", "mass", "not negative"),
    ];
    for (tip, key, words) in cases {
        let error = read(tip).expect_err(tip);
        assert_eq!(error.key, format!("segment[1].{key}"), "{error}");
        assert!(error.line.is_some() && error.to_string().contains(words), "{error}");
    }
    let error = read_scene(&root().join("tests/data/reports/lumpneg.toml")).expect_err("a negative mass").to_string();
    assert!(error.contains("segment[1].mass") && error.contains("not negative"), "{error}");
}
