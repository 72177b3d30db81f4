//! The workspace of a tip that slides on a wall, and of one that does so at times.

use crate::common::walls::golden_wall;
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::input::write_scene;
use rodsweep::spec::SweepSpec;
use rodsweep::study::workspace::{WorkspaceError, WorkspaceJob};

/// P6 under a plane at z = 85 mm; `axes` are the ranges of its inputs.
fn spec(axes: &[(&str, f64, f64)]) -> SweepSpec {
    let scene = write_scene(&golden_wall("p6-end-on"));
    let scene = scene.replace("\n[", "\n[scene.").replace("[scene.[", "[[scene.");
    let axis =
        |(name, low, high): &(&str, f64, f64)| format!("[[axis]]\nparameter = \"{name}\"\nfrom = {low}\nto = {high}\n");
    let axes: String = axes.iter().map(axis).collect();
    let text = format!("[sampling]\nmethod = \"sobol\"\nsamples = 512\n{axes}[scene]\n{scene}");
    SweepSpec::parse("wall.toml".as_ref(), &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn tips_that_touch_lie_on_the_wall_and_press() {
    let spec = spec(&[("coil.current.x", -0.15, 0.15), ("coil.current.z", -0.15, 0.15)]);
    let job = WorkspaceJob::of_sweep(&spec).engine(EngineRequest::of(BackendKind::Cpu)).voxel(4e-3);
    let found = job.run().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(found.dimension.rank, 2, "a surface");
    let table = found.voxel_table();
    let column = |name: &str| table.numbers(name).unwrap_or_else(|| panic!("no column {name}"));
    let reached: Vec<bool> = column("reached").iter().map(|flag| *flag == 1.0).collect();
    let (z, force) = (column("voxel.z"), column("contact.normal_force"));
    let touching = (0..z.len()).filter(|k| reached[*k] && force[*k] > 0.0).count();
    assert!(touching > 5, "{touching} voxels on the wall");
    for k in (0..z.len()).filter(|k| reached[*k]) {
        assert!(force[k] >= 0.0, "voxel {k}: {} N", force[k]);
        // A tip that touches lies in the plane, so its voxel is cut by it.
        assert!(
            force[k] == 0.0 || (z[k] - 0.085).abs() < 2.1e-3,
            "voxel {k} at {} m presses with {} N",
            z[k],
            force[k]
        );
    }
    assert!(found.mark.is_none(), "{:?}", found.mark);
}

#[test]
fn a_surface_on_the_wall_and_a_body_before_it_are_no_one_map() {
    let spec = spec(&[("coil.current.x", -0.15, 0.15), ("coil.current.y", -0.15, 0.15), ("insertion", 0.08, 0.1)]);
    let job = WorkspaceJob::of_sweep(&spec).engine(EngineRequest::of(BackendKind::Cpu)).voxel(3e-3);
    let Err(error) = job.run() else { panic!("some tips touch, some do not") };
    let WorkspaceError::OnAndBeforeWall { touching, before } = error else { panic!("{error}") };
    assert!(touching > before && before > 0, "{touching} touch, {before} do not");
    let told = error.to_string();
    assert!(told.contains("wall.position") && told.contains("leave `[wall]` out"), "{told}");
}
