//! Lines of the field, on the wire.

use super::client::{Running, shipped};
use rodsweep::draw::Surroundings;
use rodsweep::input::{assign, read_scene};
use serde_json::{Value, json};

const ARM: &str = "sweeps/scenes/arm_magnet.toml";

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn region(view: &Value) -> [[f64; 2]; 3] {
    let sides: Vec<Vec<f64>> = view["region"].as_array().expect("a region").iter().map(numbers).collect();
    std::array::from_fn(|k| [sides[k][0], sides[k][1]])
}

#[test]
fn they_are_those_of_the_library() {
    let server = Running::new(&shipped(ARM));
    let region = region(&server.json("api/view", None));
    let values =
        json!({ "magnets.arm.position.y": 0.02, "magnets.arm.rotation.y": 0.4, "field.flux_density.z": 0.001 });
    let answer = server.json("api/solve", Some(json!({ "values": values, "lines": 0 })));
    let mut scene = read_scene(&shipped(ARM)).expect("a scene");
    let texts = ["magnets.arm.position.y=0.02", "magnets.arm.rotation.y=0.4", "field.flux_density.z=0.001"];
    assign(&mut scene, &texts.map(String::from)).expect("values");
    let around = Surroundings::of(&scene).expect("a magnet");
    let (expected, found) = (around.lines_within(region), answer["lines"]["lines"].as_array().expect("lines"));
    assert!(found.len() > 20 && found.len() == expected.len(), "{} lines", found.len());
    for (line, found) in expected.iter().zip(found) {
        let [positions, sizes, weights] = ["positions", "flux_density", "weights"].map(|key| numbers(&found[key]));
        assert_eq!([positions.len(), sizes.len(), weights.len()], [3, 1, 1].map(|of| of * line.places.len()));
        for (k, place) in line.places.iter().enumerate() {
            let off = (0..3).map(|axis| (positions[3 * k + axis] - place.at[axis]).abs()).fold(0.0, f64::max);
            assert!(off < 3e-5 && (weights[k] - place.weight).abs() < 6e-4, "{off} m");
            assert!((sizes[k] / place.flux_density - 1.0).abs() < 6e-3);
        }
    }
    let tip = numbers(&answer["solution"]["tip"]["position"]);
    let at_tip = around.magnitude([tip[0], tip[1], tip[2]]).expect("a field");
    assert!((answer["shape"]["flux_density_at_tip"].as_f64().expect("a number") / at_tip - 1.0).abs() < 1e-12);
}

#[test]
fn they_are_sent_where_the_page_has_others() {
    let server = Running::new(&shipped(ARM));
    let solve =
        |values: Value, known: Value| server.json("api/solve", Some(json!({ "values": values, "lines": known })));
    let first = solve(json!({}), json!(0))["lines"].clone();
    assert!(first["number"].as_u64().is_some_and(|number| number > 0));
    // The rod moves, the field stays.
    for rod in [json!({}), json!({ "tube.youngs_modulus": 9e6, "loads.tip_force.y": 1e-3 })] {
        let answer = solve(rod, first["number"].clone());
        assert!(answer.get("lines").is_none() && answer["solution"]["tip"].is_object());
    }
    let moved = solve(json!({ "magnets.arm.position.z": 0.05 }), first["number"].clone())["lines"].clone();
    assert_ne!(moved["number"], first["number"]);
    assert_ne!(moved["lines"], first["lines"]);
    let back = solve(json!({}), moved["number"].clone())["lines"].clone();
    assert_eq!(back["lines"], first["lines"]);
    // Another window has none yet.
    assert_eq!(solve(json!({}), json!(0))["lines"], back);
    // Nobody wants them.
    let silent = server.json("api/solve", Some(json!({ "values": { "magnets.arm.position.z": 0.055 } })));
    assert!(silent.get("lines").is_none() && silent["shape"]["flux_density_at_tip"].is_number());
    assert_eq!(solve(json!({}), json!(0))["lines"]["number"], back["number"], "none were traced meanwhile");
    for wrong in [json!(-1), json!("all"), json!(0.5)] {
        assert_eq!(server.post("api/solve", json!({ "lines": wrong }).to_string().as_bytes()).0, 400, "{wrong}");
    }
}

#[test]
fn a_uniform_field_has_none() {
    let server = Running::scene();
    let view = server.json("api/view", None);
    assert_eq!(view["field_varies"], false);
    let answer = server.json("api/solve", Some(json!({ "values": {}, "lines": 0 })));
    assert_eq!(keys(&answer), ["engine", "seconds", "shape", "solution", "stability_index"]);
    assert_eq!(keys(&answer["shape"]), ["flux_density", "sources", "stretches", "tip_force"]);
    // Room for a rod of 86 mm that bends to all sides.
    let length = view["length"].as_f64().expect("a length");
    let [x, y, z] = region(&view);
    for (found, [low, high]) in [(x, [-0.66, 0.66]), (y, [-0.66, 0.66]), (z, [-0.21, 1.11])] {
        assert!((found[0] / length - low).abs() < 1e-9 && (found[1] / length - high).abs() < 1e-9, "{found:?}");
    }
}

/// Lines fill what the view shows, the magnet in it, and grow with a box that a turned base needs.
#[test]
fn the_region_holds_rod_and_magnet() {
    let [x, _, z] = region(&Running::new(&shipped(ARM)).json("api/view", None));
    assert!(x[0] < -0.039 && x[1] > 0.17 && x[1] < 0.2 && z[0] < -0.009 && z[1] > 0.09, "{x:?} {z:?}");
    // Coils leave the rod less than a third: the view shows the rod.
    let [x, ..] = region(&Running::new(&shipped("sweeps/scenes/coil_array.toml")).json("api/view", None));
    assert!(x[1] < 0.1, "{x:?}");
}
