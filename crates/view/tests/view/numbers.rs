//! What the page is told of one rod is what `solve` says of it.

use super::client::{Running, shipped};
use rodsweep::draw::{AZIMUTH, Colour, ColourMap, ELEVATION, FourViews, RodShape};
use rodsweep::input::{assign, read_scene};
use rodsweep::study::Solve;
use serde_json::{Value, json};

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

#[test]
fn the_rod_is_that_of_solve() {
    let server = Running::scene();
    let values = json!({ "coil.current.x": 0.12, "coil.current.z": -0.2, "insertion": 0.09, "field.flux_density.z": 0.5,
                         "proximal.youngs_modulus": 6.1e6, "loads.tip_force.x": 1e-3 });
    let answer = server.json("api/solve", Some(json!({ "values": values, "rest": true })));
    let mut scene = read_scene(&shipped("sweeps/scenes/p6.toml")).expect("a scene");
    let texts: Vec<String> =
        values.as_object().expect("values").iter().map(|(name, value)| format!("{name}={value}")).collect();
    assign(&mut scene, &texts).expect("values");
    let solved = Solve::new(scene).run().expect("a rod");
    let mut expected = solved.to_json();
    let mut found = answer["solution"].clone();
    // Derivatives, numbers and words: all of it, bit for bit.
    assert_eq!(found, expected);
    assert!(found["tip"].is_object());
    found["tip"]["position"][0] = json!(0.0);
    expected["stable"] = json!(false);
    assert_ne!(found, expected);
    // The shape ends at the tip.
    let stretches = answer["shape"]["stretches"].as_array().expect("stretches");
    assert_eq!(
        stretches.iter().map(|s| s["kind"].as_str().expect("a kind")).collect::<Vec<_>>(),
        ["flexible", "coil", "flexible"]
    );
    let last = numbers(&stretches[2]["positions"]);
    let tip = solved.tip_position();
    for axis in 0..3 {
        assert!((last[last.len() - 3 + axis] - tip[axis]).abs() < 1e-9, "{last:?} {tip:?}");
    }
    assert_eq!(numbers(&answer["shape"]["flux_density"]), [0.0, 3.0, 0.5]);
    assert!(answer["rest"].as_array().expect("the rod at rest").len() > 40);
}

#[test]
fn every_equilibrium_is_that_of_solve() {
    let server = Running::scene();
    let values = json!({ "coil.current.x": 0.12, "coil.current.y": -0.25, "coil.current.z": 0.2 });
    let answer = server.json("api/branches", Some(json!({ "values": values })));
    let mut scene = read_scene(&shipped("sweeps/scenes/p6.toml")).expect("a scene");
    assign(&mut scene, &["coil.current.x=0.12", "coil.current.y=-0.25", "coil.current.z=0.2"]).expect("values");
    let all = Solve::new(scene).run().expect("a rod").all_branches().expect("branches");
    assert_eq!(answer["branches"], all.to_json()["branches"]);
    assert!(all.branches().len() >= 3);
    assert_eq!(answer["shapes"].as_array().map(Vec::len), Some(all.branches().len()));
}

#[test]
fn the_tip_is_dragged_within_limits() {
    let server = Running::scene();
    let solve = |values: Value| server.json("api/solve", Some(json!({ "values": values })));
    // Where it can go: the tip of other currents.
    let there = solve(json!({ "coil.current.x": 0.05, "coil.current.y": 0.02, "coil.current.z": 0.1 }));
    let target = there["solution"]["tip"]["position"].clone();
    let drag = |target: &Value, begin: bool| {
        server.json("api/drag", Some(json!({ "values": {}, "target": target, "begin": begin, "precise": true })))
    };
    let found = drag(&target, true);
    assert_eq!(found["outcome"], "reached", "{found}");
    let back = solve(found["values"].clone());
    let (tip, target) = (numbers(&back["solution"]["tip"]["position"]), numbers(&target));
    assert!(tip.iter().zip(&target).all(|(a, b)| (a - b).abs() < 1e-6), "{tip:?} {target:?}");
    // Out of reach: the nearest place, within the limits of the sliders.
    let far = drag(&json!([0.5, 0.5, 0.0]), false);
    assert_ne!(far["outcome"], "reached");
    for (name, value) in far["values"].as_object().expect("values") {
        assert!(value.as_f64().is_some_and(|x| x.abs() <= 0.3), "{name}: {value}");
    }
}

#[test]
fn the_tip_is_dragged_in_the_picture() {
    let server = Running::scene();
    let solve = |values: Value| server.json("api/solve", Some(json!({ "values": values })));
    let along = [0.5, -0.6, 0.4];
    let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
    let rest = numbers(&solve(json!({}))["solution"]["tip"]["position"]);
    // From rest, where the tip moves in two directions alone, to the place of other currents, moved along the view.
    for [x, y, z] in [[0.02, 0.0, 0.01], [-0.05, 0.03, 0.04], [0.25, -0.2, -0.15]] {
        let currents = json!({ "coil.current.x": x, "coil.current.y": y, "coil.current.z": z });
        let there = numbers(&solve(currents)["solution"]["tip"]["position"]);
        let mut found = Value::Null;
        for k in 1..=5 {
            let share = f64::from(k) / 5.0;
            let place: Vec<f64> =
                (0..3).map(|a| rest[a] + share * (there[a] - rest[a]) + 0.03 * along[a] * share).collect();
            let body = json!({ "values": {}, "target": place, "along": along, "begin": k == 1 });
            found = server.json("api/drag", Some(body));
        }
        assert_eq!(found["outcome"], "reached", "{found}");
        assert_eq!(found["held"], json!([]));
        let tip = numbers(&solve(found["values"].clone())["solution"]["tip"]["position"]);
        let way: Vec<f64> = (0..3).map(|a| tip[a] - there[a]).collect();
        let depth: f64 = (0..3).map(|a| way[a] * along[a] / length).sum();
        let beside = (0..3).map(|a| (way[a] - depth * along[a] / length).powi(2)).sum::<f64>().sqrt();
        assert!(beside < 2e-4, "{beside} m beside the line, for the currents {x}, {y}, {z}");
    }
    for along in [json!([0, 0, 0]), json!([1, 2]), json!("up")] {
        let body = json!({ "values": {}, "target": rest, "along": along, "begin": true }).to_string();
        assert_eq!(server.post("api/drag", body.as_bytes()).0, 400, "{along}");
    }
}

#[test]
fn sliders_have_units_and_limits() {
    let of = |path: &str| Running::new(&shipped(path)).json("api/view", None);
    let scene = of("sweeps/scenes/p6.toml");
    let sliders = scene["sliders"].as_array().expect("sliders").clone();
    let slider = |sliders: &[Value], name: &str| {
        sliders.iter().find(|slider| slider["name"] == name).cloned().unwrap_or_else(|| panic!("no slider {name}"))
    };
    for name in [
        "coil.current.x",
        "insertion",
        "field.flux_density.y",
        "loads.tip_force.z",
        "proximal.rest_curvature.x",
        "proximal.youngs_modulus",
    ] {
        let slider = slider(&sliders, name);
        let [low, value, high] = ["low", "value", "high"].map(|key| slider[key].as_f64().expect("a number"));
        assert!(low <= value && value <= high && low < high, "{slider}");
    }
    assert_eq!(slider(&sliders, "insertion")["shown_unit"], "mm");
    assert_eq!(slider(&sliders, "proximal.youngs_modulus")["shown_unit"], "MPa");
    assert!(!sliders.iter().any(|slider| slider["name"] == "proximal.stiffness.bending"), "it follows from the tube");
    let sweep = of("sweeps/volume.toml");
    let insertion = slider(sweep["sliders"].as_array().expect("sliders"), "insertion");
    assert_eq!(insertion["limits"], "sweep");
    assert!((insertion["low"].as_f64().expect("a number") - 0.0643).abs() < 1e-12);
}

/// Magnets and coils stand where the scene has them, and follow their sliders.
#[test]
fn sources_of_the_field_are_those_of_the_scene() {
    let server = Running::new(&shipped("sweeps/scenes/arm_magnet.toml"));
    let known = server.json("api/view", None)["sources"].clone();
    let values = json!({ "magnets.arm.position.y": 0.02, "magnets.arm.rotation.z": std::f64::consts::FRAC_PI_2 });
    let moved = server.json("api/solve", Some(json!({ "values": values })))["shape"]["sources"].clone();
    let [known, moved] = [&known, &moved].map(|all| all.as_array().expect("sources").clone());
    assert_eq!([known.len(), moved.len()], [1, 1]);
    let near = |value: &Value, expected: [f64; 3]| {
        let found = numbers(value);
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + b.abs())), "{found:?}");
    };
    // Br V / mu0, from S to N.
    let moment = 1.42 * std::f64::consts::PI * 0.03f64.powi(2) * 0.06 / (4e-7 * std::f64::consts::PI);
    assert_eq!((&known[0]["name"], &known[0]["kind"]), (&json!("arm"), &json!("magnet")));
    near(&known[0]["position"], [0.14, 0.0, 0.06]);
    near(&known[0]["moment"], [moment, 0.0, 0.0]);
    near(&moved[0]["position"], [0.14, 0.02, 0.06]);
    near(&moved[0]["moment"], [0.0, moment, 0.0]);
    near(&moved[0]["body"]["axis"], [0.0, 1.0, 0.0]);
    assert_eq!(moved[0]["body"]["diameter"], 0.06);
    let coils = Running::new(&shipped("sweeps/scenes/coil_array.toml")).json("api/view", None)["sources"].clone();
    let coils = coils.as_array().expect("coils");
    assert_eq!((coils.len(), &coils[1]["current"], &coils[1]["kind"]), (8, &json!(-2.0), &json!("electromagnet")));
    // The first coil's field points to its back.
    assert!(numbers(&coils[0]["moment"])[0] < 0.0 && numbers(&coils[0]["position"])[0] > 0.2);
    assert_eq!(Running::scene().json("api/view", None)["sources"], json!([]));
}

#[test]
fn camera_and_colours_are_those_of_the_figures() {
    let style = Running::scene().json("api/view", None)["style"].clone();
    let hex = |colour: Colour| format!("#{:02x}{:02x}{:02x}", colour.red, colour.green, colour.blue);
    assert_eq!(style["colours"]["coil"], hex(RodShape::COIL_COLOUR));
    assert_eq!(style["maps"]["sequential"][0], hex(ColourMap::Sequential.at(0.0)));
    assert_eq!(style["maps"]["diverging"][255], hex(ColourMap::Diverging.at(1.0)));
    let (azimuth, elevation) = (style["azimuth"].as_f64(), style["elevation"].as_f64());
    assert_eq!((azimuth, elevation), (Some(AZIMUTH), Some(ELEVATION)));
    // They are the angles of the panel in space.
    let space = &FourViews::new([[-1.0, 1.0]; 3], 500.0, 30.0, 14.0).views[3];
    let (a, e) = (AZIMUTH.to_radians(), ELEVATION.to_radians());
    let toward = [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
    assert!(space.toward.iter().zip(toward).all(|(x, y)| (x - y).abs() < 1e-12), "{space:?}");
}
