//! A scene and a sweep as files.

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
