//! Walls in figures: hatched where panels cut them, with the force on the tip and what friction holds.

use crate::common::root;
use crate::common::walls::golden_wall;
use rodsweep::draw::{DrawnWall, Figure, ImageFormat, encode};
use rodsweep::figures::{draw_workspace, rod_shape};
use rodsweep::spec::SweepSpec;
use rodsweep::study::Solve;
use rodsweep::study::workspace::{Workspace, WorkspaceExtras, WorkspaceJob};

fn svg(figure: &dyn Figure) -> String {
    String::from_utf8(encode(figure, ImageFormat::Svg).expect("a figure")).expect("text")
}

fn svg_of(name: &str) -> String {
    let drawn = rod_shape(&Solve::new(golden_wall(name)).run().expect("an answer")).expect("a shape");
    let svg = svg(&drawn);
    assert!(!svg.contains("NaN") && !svg.contains("\"inf"), "{name}: a number is not finite");
    svg
}

/// Short strokes beside the lines of the wall.
fn strokes(svg: &str) -> usize {
    svg.matches(&format!("stroke=\"{}\" stroke-width=\"0.5\"", DrawnWall::COLOUR.code())).count()
}

/// Lines where panels cut the wall.
fn lines(svg: &str) -> usize {
    svg.matches(&format!("stroke=\"{}\" stroke-width=\"1\"", DrawnWall::COLOUR.code())).count()
}

#[test]
fn walls_are_hatched_where_panels_cut_them() {
    // A plane across z is no line in the panel of x and y. Each legend has one more line, and a sample of the hatching.
    for (name, cut) in [("p6-end-on", 2), ("p6-tilted", 3), ("p6-chamber", 3), ("p6-obstacle", 3)] {
        let svg = svg_of(name);
        assert_eq!(lines(&svg), cut + 1, "{name}");
        assert!(strokes(&svg) > 40, "{name}: {} strokes", strokes(&svg));
        assert!(svg.contains("wall, cut through the tip") && svg.contains("force of the wall f, "), "{name}");
        assert!(!svg.contains("cone of friction"), "{name}: the tip slides");
    }
    // A vessel along the rod is cut in two lines or an ellipse.
    assert!(lines(&svg_of("p6-vessel")) >= 4);
    assert!(svg_of("p6-tissue").contains("wall of 120 N/m, cut through the tip"));
}

#[test]
fn a_held_tip_has_its_cone_and_a_free_one_no_force() {
    let held = svg_of("p6-held");
    assert!(held.contains("cone of friction 0.3; holding takes 0.42"), "{held}");
    let pulled = svg_of("p6-pulled");
    assert!(pulled.contains("force of the wall f, pulls, 39.6 mN"), "{pulled}");
    assert!(pulled.contains("which holds no tip that pulls"));
    let free = svg_of("p6-free");
    assert!(free.contains("wall, cut through the tip") && !free.contains("force of the wall"));
    let mut without = golden_wall("p6-free");
    without.wall = None;
    let svg = svg(&rod_shape(&Solve::new(without).run().expect("an answer")).expect("a shape"));
    assert_eq!((strokes(&svg), svg.contains("wall")), (0, false));
}

/// Slices and projections of a workspace are cut by the wall where it crosses them.
#[test]
fn workspaces_show_the_wall() {
    let axis = |name: &str| format!("[[axis]]\nparameter = \"{name}\"\nfrom = \"-0.3 A\"\nto = \"0.3 A\"\n");
    let axes = ["coil.current.x", "coil.current.y", "coil.current.z"].map(axis).concat();
    let text = format!("scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 64\n{axes}");
    let mut spec = SweepSpec::parse(&root().join("sweeps/wall.toml"), &text).expect("a sweep");
    spec.scene = golden_wall("p6-end-on");
    let found = WorkspaceJob::of_sweep(&spec).voxel(9e-3).run().expect("a workspace");
    let drawn = |found: &Workspace| {
        let folder = tempfile::tempdir().expect("a folder");
        draw_workspace(found, &WorkspaceExtras::default(), &[], folder.path()).expect("figures");
        std::fs::read_to_string(folder.path().join("workspace.svg")).expect("a figure")
    };
    let svg = drawn(&found);
    // A plane across z is no line in the panels of x and y.
    let panels = if found.grown.dimension == 3 { 4 } else { 2 };
    assert_eq!(lines(&svg), panels + 1, "dimension {}", found.grown.dimension);
    assert!(strokes(&svg) > 40 && svg.contains("wall, cut through each slice"), "{} strokes", strokes(&svg));
    let mut without = found;
    without.scene.wall = None;
    let svg = drawn(&without);
    assert_eq!((lines(&svg), svg.contains("wall")), (0, false));
}
