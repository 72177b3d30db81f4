//! Values of a command line that mend a scene: they are set before it is judged.

use crate::common::texts::SCENE;
use rodsweep::input::{AssignError, read_scene_with};
use rodsweep::model::{Parameter, Scene};
use std::path::PathBuf;
use tempfile::TempDir;

struct Text {
    _folder: TempDir,
    file: PathBuf,
}

fn text(from: &str, to: &str) -> Text {
    assert!(SCENE.contains(from), "{from}");
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, SCENE.replacen(from, to, 1)).expect("a file");
    Text { _folder: folder, file }
}

impl Text {
    fn with(&self, set: &[&str]) -> Result<Scene, AssignError> {
        read_scene_with(&self.file, set)
    }
}

fn value(scene: &Scene, name: &str) -> f64 {
    Parameter::parse(scene, name).expect("a parameter")[0].get(scene)
}

#[test]
fn values_mend_what_is_out_of_range() {
    let cases = [
        ("youngs_modulus = \"5 MPa\"", "youngs_modulus = \"-5 MPa\"", "tube.youngs_modulus", "6 MPa", 6e6),
        ("length = \"80 mm\"", "length = \"-80 mm\"", "tube.length", "70 mm", 0.07),
        ("mass = \"58 mg\"", "mass = \"-58 mg\"", "coil.mass", "5e-5", 5e-5),
        ("outer_radius = \"1 mm\"", "outer_radius = \"0.4 mm\"", "tube.tube.outer_radius", "1 mm", 1e-3),
        // Text that cannot be read at all.
        ("length = \"80 mm\"", "length = \"as long as it takes\"", "tube.length", "70 mm", 0.07),
        ("turns = [30, 30, 100]", "turns = [30, \"many\", 100]", "coil.turns.y", "20", 20.0),
        ("flux_density = [0, \"3 T\", 0]", "flux_density = [0, \"3 apples\", 0]", "field.flux_density.y", "2 T", 2.0),
    ];
    for (from, to, name, new, expected) in cases {
        let text = text(from, to);
        let set = format!("{name}={new}");
        let scene = text.with(&[&set]).unwrap_or_else(|error| panic!("{set}: {error}"));
        let found = value(&scene, name);
        assert!((found - expected).abs() <= 1e-15 * expected, "{set}: {found}");
        // Without the value, and with another, the file is to blame as before.
        for set in [&[][..], &["coil.current.x=0.1"]] {
            let error = text.with(set).expect_err(to);
            let AssignError::Input(error) = error else { panic!("{error}") };
            let line = 1 + SCENE.lines().position(|line| line.contains(from)).expect("a line");
            assert!(error.file == text.file && error.line == Some(line), "{error}");
        }
    }
}

#[test]
fn values_that_are_wrong_are_named() {
    let good = text("name = \"test\"", "name = \"other\"");
    let error = good.with(&["tube.youngs_modulus=-5 MPa"]).expect_err("a negative modulus");
    assert!(matches!(error, AssignError::Scene(_)) && error.to_string().contains("tube.youngs_modulus"), "{error}");
    let error = good.with(&["tube.lenght=5 mm"]).expect_err("no parameter").to_string();
    assert!(error.contains("did you mean `tube.length`"), "{error}");
    let error = good.with(&["tube.length=5 apples"]).expect_err("no length").to_string();
    assert!(error.starts_with("`tube.length`"), "{error}");
    let error = good.with(&["tube.length"]).expect_err("no value").to_string();
    assert!(error.contains("has no `=`"), "{error}");
    // Mended in one place and wrong in another.
    let bad = text("length = \"80 mm\"", "length = \"-80 mm\"");
    let error = bad.with(&["tube.length=80 mm", "coil.mass=-1"]).expect_err("a negative mass");
    assert!(matches!(error, AssignError::Scene(_)) && error.to_string().contains("coil.mass"), "{error}");
}
