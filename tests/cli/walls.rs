//! A wall in the program: what is refused before anything is solved.

use crate::sandbox::Sandbox;
use std::fs;

const SCENE: &str = "[wall]
kind = \"plane\"
position = [0, 0, \"50 mm\"]
normal = [0, 0, -1]
[[segment]]
name = \"tube\"
kind = \"flexible\"
length = \"60 mm\"
stiffness = { bending = 2e-5, torsion = 1.5e-5 }
";
const SWEEP: &str = "scene = \"wall.toml\"
[sampling]
method = \"grid\"
[[axis]]
parameter = \"wall.position.z\"
from = \"50 mm\"
to = \"58 mm\"
points = 3
";

fn sandbox(scene: &str) -> Sandbox {
    let sandbox = Sandbox::new();
    fs::write(sandbox.path("wall.toml"), scene).expect("written");
    fs::write(sandbox.path("sweep.toml"), SWEEP).expect("written");
    sandbox
}

#[test]
fn walls_are_for_the_cpu() {
    let sandbox = sandbox(SCENE);
    for command in [&["solve", "wall.toml"][..], &["run", "sweep.toml", "--dry-run"]] {
        let output = sandbox.run(&[command, &["--backend", "gpu"]].concat());
        assert_eq!(output.code, 2, "{}", output.stderr);
        assert!(output.stderr.contains("walls are for the CPU"), "{}", output.stderr);
        assert!(output.stderr.contains("--backend cpu"), "{}", output.stderr);
    }
}

#[test]
fn so_limp_a_rod_cannot_touch_a_wall() {
    let limp = SCENE.replace("2e-5", "2e-8").replace("1.5e-5", "1.5e-8") + "[loads]\ntip_force = [0, 0, 1]\n";
    let sandbox = sandbox(&limp);
    for command in [&["solve", "wall.toml"][..], &["run", "sweep.toml", "--dry-run"]] {
        let output = sandbox.run(command);
        assert_eq!(output.code, 2, "{}", output.stderr);
        assert!(output.stderr.contains("rods solved by nodes cannot touch a wall yet"), "{}", output.stderr);
    }
}

#[test]
fn numbers_of_a_wall_are_listed() {
    let output = sandbox(SCENE).run(&["parameters", "wall.toml"]);
    assert_eq!(output.code, 0, "{}", output.stderr);
    for name in ["wall.position.x", "wall.rotation.z", "wall.tip_radius", "wall.stiffness", "wall.friction"] {
        assert!(output.stdout.contains(name), "{}", output.stdout);
    }
}
