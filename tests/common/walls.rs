//! Scenes with a wall: those of the golden files, and a wire that a wall pushes aside.

use super::root;
use rodsweep::input::parse_scene;
use rodsweep::model::Scene;
use std::fs;

/// Bending stiffness (N·m²) and length (m) of the wire.
pub const EI: f64 = 6.136e-4;
pub const LENGTH: f64 = 0.1;

/// A straight wire along z; `wall` holds the keys of its wall, a plane beside the tip that pushes towards -x.
pub fn wire(wall: &str) -> Scene {
    let text = format!(
        "name = \"wire\"\n[[segment]]\nname = \"wire\"\nkind = \"flexible\"\nlength = {LENGTH}\n\
         stiffness = {{ bending = {EI}, torsion = {EI} }}\n\
         [wall]\nkind = \"plane\"\nnormal = [-1, 0, 0]\n{wall}\n"
    );
    parse_scene("wire.toml".as_ref(), &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The scene of a golden file, such as `p6-held`.
pub fn golden_wall(name: &str) -> Scene {
    let file = root().join("tests/data/wall").join(name).with_extension("json");
    let golden: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(file).expect("a golden file")).expect("JSON");
    let text = golden["scene"].as_str().expect("a scene");
    parse_scene("golden.toml".as_ref(), text).unwrap_or_else(|error| panic!("{name}: {error}"))
}
