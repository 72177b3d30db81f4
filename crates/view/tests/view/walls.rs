//! The wall beside the rod, on the wire.

use super::client::{Running, shipped};
use super::export::data;
use rodsweep::input::{assign, parse_scene};
use rodsweep::study::Solve;
use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;

/// The scene of a golden file as a file of its own, and its text.
fn scene(name: &str) -> (tempfile::TempDir, PathBuf, String) {
    let golden = fs::read_to_string(shipped("tests/data/wall").join(name).with_extension("json")).expect("a file");
    let golden: Value = serde_json::from_str(&golden).expect("JSON");
    let text = golden["scene"].as_str().expect("a scene").to_owned();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, &text).expect("written");
    (folder, path, text)
}

#[test]
fn it_follows_its_sliders_and_presses() {
    let (_folder, path, text) = scene("p6-tissue");
    let server = Running::new(&path);
    let view = server.json("api/view", None);
    assert_eq!((&view["wall"]["kind"], &view["wall"]["tip_radius"]), (&json!("plane"), &json!(0.0015)));
    let sliders = view["sliders"].as_array().expect("sliders");
    let of_wall = sliders.iter().filter(|slider| slider["group"] == "wall").count();
    // Position, rotation, radius of the tip, stiffness, friction.
    assert_eq!(of_wall, 9, "{sliders:?}");
    let mut forces = Vec::new();
    for z in [0.08, 0.079] {
        let answer = server.json("api/solve", Some(json!({ "values": { "wall.position.z": z } })));
        assert_eq!(answer["shape"]["wall"]["position"], json!([0.0, 0.0, z]));
        let mut scene = parse_scene("scene.toml".as_ref(), &text).expect("a scene");
        assign(&mut scene, &[format!("wall.position.z={z}")]).expect("a place");
        let contact = Solve::new(scene).run().expect("an answer").contact().expect("a wall");
        let told = answer["solution"]["contact"]["normal_force"].as_f64().expect("a force");
        assert!((told / contact.normal_force - 1.0).abs() < 1e-9, "{told} N of {}", contact.normal_force);
        forces.push(told);
    }
    assert!(forces[1] > forces[0], "a wall that comes nearer presses more: {forces:?}");
}

#[test]
fn curved_walls_have_a_radius_and_held_tips_their_friction() {
    let (_folder, path, _) = scene("p6-vessel");
    let wall = Running::new(&path).json("api/view", None)["wall"].clone();
    assert_eq!((&wall["kind"], &wall["radius"], &wall["outside"]), (&json!("cylinder"), &json!(0.01), &json!(false)));
    assert!(wall["friction"].is_null(), "the tip slides");
    let (_folder, path, _) = scene("p6-held");
    assert_eq!(Running::new(&path).json("api/view", None)["wall"]["friction"], json!(0.3));
    assert!(Running::scene().json("api/view", None)["wall"].is_null());
}

#[test]
fn an_exported_page_has_wall_and_force() {
    let (_folder, path, _) = scene("p6-held");
    let page = data(&path);
    assert_eq!(page["wall"]["kind"], "plane");
    assert_eq!(page["rod"]["shape"]["wall"], page["wall"]);
    let force = page["rod"]["solution"]["contact"]["normal_force"].as_f64().expect("a force");
    assert!((force - 0.059_997_931_74).abs() < 1e-9, "{force} N");
}
