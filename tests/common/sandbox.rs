//! The program in a directory of its own.

use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use tempfile::TempDir;

pub const SCENE: &str = r#"name = "test"
[base]
position = [0, 0, 0]
[field]
flux_density = [0, "3 T", 0]
[loads]
tip_force = [0, 0, 0]
[[segment]]
name = "tube"
kind = "flexible"
length = "80 mm"
tube = { inner_radius = "0.5 mm", outer_radius = "1 mm" }
youngs_modulus = "5 MPa"
shear_modulus = "2 MPa"
rest_curvature = [0, 0, 0]
[[segment]]
name = "coil"
kind = "rigid"
length = "13 mm"
mass = "58 mg"
coil = { turns = [30, 30, 100], area = ["4.67 mm^2", "4.67 mm^2", "1.13 mm^2"], current = [0, 0, 0] }
"#;

pub const SWEEP: &str = r#"scene = "scene.toml"
[sampling]
method = "grid"
seed = 7
[[axis]]
parameter = "coil.current.x"
from = "-0.1 A"
to = "0.1 A"
points = 5
[solver]
tolerance = 1e-6
branch = "from_rest"
[output]
quantities = ["tip_position"]
derivatives = ["coil.current"]
format = "parquet"
[workspace]
voxel = "1 mm"
"#;

/// A grid sweep over one parameter.
pub fn sweep(parameter: &str, from: &str, to: &str, points: usize) -> String {
    SWEEP
        .replace("\"coil.current.x\"", &format!("\"{parameter}\""))
        .replace("\"-0.1 A\"", from)
        .replace("\"0.1 A\"", to)
        .replace("points = 5", &format!("points = {points}"))
}

/// A temporary directory that holds `scene.toml` and `sweep.toml`.
pub struct Sandbox {
    dir: TempDir,
    /// Some graphics drivers complain when they have no such directory.
    runtime: TempDir,
}

/// What a command answered.
pub fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// How a command ended.
pub struct Output {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Output {
    /// The lines that begin with `error:`.
    pub fn errors(&self) -> Vec<&str> {
        self.stderr.lines().filter(|line| line.starts_with("error:")).collect()
    }
}

impl Sandbox {
    pub fn new() -> Sandbox {
        let sandbox = Sandbox { dir: tempfile::tempdir().unwrap(), runtime: tempfile::tempdir().unwrap() };
        sandbox.write("scene.toml", SCENE);
        sandbox.write("sweep.toml", SWEEP);
        sandbox
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rodsweep"));
        command.args(arguments).current_dir(self.dir.path()).stdin(Stdio::null());
        command.env("XDG_RUNTIME_DIR", self.runtime.path());
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Output {
        let output = self.command(arguments).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        assert!(!stderr.contains("panicked"), "{arguments:?}: {stderr}");
        Output { code: output.status.code().unwrap_or(-1), stdout, stderr }
    }

    /// Runs a command that must end well.
    pub fn ok(&self, arguments: &[&str]) -> Output {
        let output = self.run(arguments);
        assert_eq!(output.code, 0, "{arguments:?}: {}", output.stderr);
        output
    }
}
