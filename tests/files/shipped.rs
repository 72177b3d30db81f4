//! Shipped scenes and sweeps, and single numbers of them.

use crate::arc::{Arc, arc, options, shipped};
use crate::common::runs::{run_into, spec_of};
use rodsweep::backend::{Backend, BackendError};
use rodsweep::input::{assign, parse_scene, read_scene, write_scene};
use rodsweep::model::{FlexibleRod, Plan, RigidRod, RodSegment, base_curvature, rotation_vector};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{BranchTools, RunOptions};
use std::fs;
use std::path::Path;

#[test]
fn shipped_sweeps_have_their_counts_and_run_limited() {
    let declared = [
        ("workspace", 226_981),
        ("stiffness", 16_384),
        ("insertion", 20_000),
        ("ten_million", 10_000_000),
        ("billion", 1_000_000_000),
        ("two_coil", 65_536),
        ("branches", 81),
        ("lap", 8),
        ("p6_errors", 8192),
        ("p6_calibration", 2048),
        ("volume", 65_536),
        ("arm_magnet", 27_225),
        ("coil_array", 16_384),
        ("atrial_wall", 1024),
    ];
    let mut files: Vec<String> = fs::read_dir(shipped())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    files.sort();
    let mut names: Vec<&str> = declared.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    assert_eq!(files, names, "every shipped sweep declares its count here");
    for (name, count) in declared {
        let spec = SweepSpec::read(&shipped().join(format!("{name}.toml"))).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(spec.sample_count, count, "{name}");
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let make = |plan: &Plan| -> Result<Box<dyn Backend>, BackendError> { Ok(Box::new(Arc::new(plan))) };
        let search = Some(BranchTools { engine: &make, finisher: &make, energy: &|_, _| None });
        let limited = RunOptions { limit: Some(2000), search, ..options() };
        let summary = run_into(&out, &spec, &mut arc(&spec), &limited).unwrap();
        assert_eq!(summary.solved, count.min(2000), "{name}");
        assert_eq!(spec_of(&out).unwrap().to_toml(), spec.to_toml(), "{name}");
    }
}

#[test]
fn shipped_scenes_read_and_round_trip() {
    for entry in fs::read_dir(shipped().join("scenes")).unwrap() {
        let path = entry.unwrap().path();
        let scene = read_scene(&path).unwrap_or_else(|error| panic!("{error}"));
        let text = write_scene(&scene);
        assert_eq!(parse_scene(Path::new("again.toml"), &text).as_ref(), Ok(&scene), "{}\n{text}", path.display());
    }
}

#[test]
fn p6_is_the_prototype() {
    let scene = read_scene(&shipped().join("scenes/p6.toml")).unwrap();
    assert!((scene.total_length() - 0.0943).abs() < 1e-15);
    assert!((scene.segments[0].length - 0.0575).abs() < 1e-15);
    let rod = scene.rod();
    let RodSegment::Flexible(FlexibleRod { stiffness, .. }) = rod.segments[0] else { panic!() };
    assert!((stiffness[0] - 2.28299e-5).abs() < 1e-9, "{stiffness:?}");
    assert!(scene.rigid_force_arm);
}

#[test]
fn rotation_vectors_survive_small_and_half_turns() {
    let mut scene = read_scene(&shipped().join("scenes/cantilever.toml")).unwrap();
    let pi = std::f64::consts::PI;
    for angle in [0.0, 1e-12, 1e-7, 1e-3, 1.0, pi - 1e-3, pi - 1e-7, pi - 1e-12] {
        for axis in [[1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0]] {
            scene.base.rotation = axis.map(|a| a * angle);
            let v = rotation_vector(&scene.rod().base_rotation);
            for k in 0..3 {
                assert!((v[k] - axis[k] * angle).abs() < 1e-14 + 1e-15 * angle, "{angle} {axis:?}: {v:?}");
            }
        }
    }
}

#[test]
fn base_curvature_takes_leading_rigid_segments_into_account() {
    let mut rod = read_scene(&shipped().join("scenes/cantilever.toml")).unwrap().rod();
    rod.base_rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    rod.flux_density = [0.0, 3.0, 0.0];
    rod.tip_force = [1.0, 0.0, 0.0];
    let (dipole, weight) = ([1e-3, 0.0, 0.0], [0.0, 0.2, 0.0]);
    rod.segments.insert(0, RodSegment::Rigid(RigidRod { length: 0.1, dipole, weight, ..RigidRod::default() }));
    let RodSegment::Flexible(FlexibleRod { stiffness, .. }) = rod.segments[1] else { panic!() };
    // m - mu x B - L t x n - L/2 t x w; t x (1, 0, 0) = (0, 1, 0), t x (0, 0.2, 0) = (-0.2, 0, 0).
    let m = [0.5 + 0.01, 0.6 - 0.1, 0.7 - 3e-3];
    let u = base_curvature(&rod, [0.5, 0.6, 0.7]);
    for k in 0..3 {
        assert!((u[k] * stiffness[k] - m[k]).abs() < 1e-14, "{u:?}");
    }
    rod.rigid_force_arm = false;
    let u = base_curvature(&rod, [0.5, 0.6, 0.7]);
    assert!((u[1] * stiffness[1] - 0.6).abs() < 1e-14 && (u[2] * stiffness[2] - 0.697).abs() < 1e-14);
}

#[test]
fn assignments_set_scenes() {
    let mut scene = read_scene(&shipped().join("scenes/p6.toml")).unwrap();
    assign(&mut scene, &["insertion=90 mm", "coil.current.x=20 mA", "distal.length=0.02", "base.position=1 mm"])
        .unwrap();
    assert!((scene.total_length() - 0.09).abs() < 1e-15 && scene.segments[2].length == 0.02);
    assert_eq!(scene.base.position, [1e-3; 3]);
    let mut refused = |text: &str| assign(&mut scene, &[text]).unwrap_err().to_string();
    assert!(refused("coil.current.x").contains("write NAME=VALUE"));
    assert!(refused("coil.curent.x=1").contains("did you mean `coil.current.x`?"));
    assert!(refused("coil.current.x=1 m").contains("`coil.current.x`: \"1 m\" is a length"));
    assert!(refused("proximal.stiffness.torsion=1").contains("follows from `tube`"));
    assert!(refused("insertion=1 mm").contains("must be finite and not negative"));
}
