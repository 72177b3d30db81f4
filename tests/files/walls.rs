//! Walls in scene and sweep files: what is read, what is refused and with which remedy, what is written, which columns rows have.

use rodsweep::input::{InputError, assign, parse_scene, write_scene};
use rodsweep::model::{Parameter, Scene, Side, TipOnWall, WallShape};
use rodsweep::spec::{OutputQuantity, SweepSpec};

const ROD: &str = "[[segment]]
name = \"tube\"
kind = \"flexible\"
length = \"60 mm\"
stiffness = { bending = 2e-5, torsion = 1.5e-5 }
";
const PLANE: &str = "kind = \"plane\"\nposition = [0, 0, \"50 mm\"]\nnormal = [0, 0, -2]\n";
const SPHERE: &str = "kind = \"sphere\"\nposition = [0, 0, 0]\nradius = \"35 mm\"\nside = \"inside\"\n";
const CYLINDER: &str =
    "kind = \"cylinder\"\nposition = [0, 0, 0]\naxis = [1, 0, 0]\nradius = 0.035\nside = \"outside\"\n";

fn read(wall: &str) -> Result<Scene, InputError> {
    parse_scene("scene.toml".as_ref(), &format!("[wall]\n{wall}\n{ROD}"))
}

fn good(wall: &str) -> Scene {
    read(wall).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn walls_are_read_and_written() {
    let held = "tip = \"sticks\"\nanchor = [\"25 mm\", 0, \"50 mm\"]\n";
    let tissue = "rotation = [0, \"10 deg\", 0]\ntip_radius = \"1.5 mm\"\nstiffness = \"120 N/m\"\nfriction = 0.3\n";
    for kind in [PLANE, SPHERE, CYLINDER] {
        for more in [String::new(), held.into(), tissue.into(), format!("{tissue}{held}")] {
            let scene = good(&format!("{kind}{more}"));
            let again = parse_scene("again.toml".as_ref(), &write_scene(&scene)).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(again, scene, "{kind}{more}");
            // What is written once is written the same again.
            assert_eq!(write_scene(&again), write_scene(&scene));
        }
    }
    let wall = good(&format!("{PLANE}{tissue}{held}")).wall.expect("a wall");
    assert_eq!(wall.shape, WallShape::Plane { normal: [0.0, 0.0, -2.0] });
    assert_eq!((wall.stiffness, wall.friction, wall.tip_radius), (Some(120.0), Some(0.3), 0.0015));
    assert_eq!((wall.position, wall.tip), ([0.0, 0.0, 0.05], TipOnWall::Sticks([0.025, 0.0, 0.05])));
    assert!((wall.rotation[1] - 10f64.to_radians()).abs() < 1e-15);
    let wall = good(PLANE).wall.expect("a wall");
    assert_eq!((wall.stiffness, wall.friction, wall.tip), (None, None, TipOnWall::Slides));
    let wall = good(CYLINDER).wall.expect("a wall");
    assert_eq!(wall.shape, WallShape::Cylinder { axis: [1.0, 0.0, 0.0], radius: 0.035, side: Side::Outside });
    assert_eq!(parse_scene("scene.toml".as_ref(), ROD).expect("a scene").wall, None);
}

#[test]
fn numbers_of_a_wall_have_names_and_units() {
    let mut scene = good(&format!("{SPHERE}tip = \"sticks\"\nanchor = [0, 0, \"35 mm\"]"));
    let sets = [
        "wall.position.x=2 mm",
        "wall.rotation.z=10 deg",
        "wall.radius=40 mm",
        "wall.tip_radius=1 mm",
        "wall.stiffness=80 N/m",
        "wall.friction=0.2",
        "wall.anchor.y=3 mm",
    ];
    assign(&mut scene, &sets).unwrap_or_else(|error| panic!("{error}"));
    let wall = scene.wall.expect("a wall");
    assert_eq!(wall.shape, WallShape::Sphere { radius: 0.04, side: Side::Inside });
    assert_eq!((wall.position[0], wall.tip_radius), (0.002, 0.001));
    assert_eq!((wall.stiffness, wall.friction), (Some(80.0), Some(0.2)));
    assert_eq!(wall.tip, TipOnWall::Sticks([0.0, 0.003, 0.035]));
    let unit = |name: &str| Parameter::parse(&scene, name).expect(name)[0].unit();
    assert_eq!(
        ["wall.position", "wall.rotation", "wall.stiffness", "wall.friction"].map(unit),
        ["m", "rad", "N/m", ""]
    );
    assert_eq!(Parameter::parse(&scene, "wall.anchor").expect("a group").len(), 3);
    // A plane has no radius, a sliding tip no anchor.
    let plane = good(PLANE);
    assert!(Parameter::parse(&plane, "wall.radius").is_err() && Parameter::parse(&plane, "wall.anchor.x").is_err());
}

#[test]
fn mistakes_name_key_and_remedy() {
    let cases = [
        (PLANE.replace("plane", "plan"), "wall.kind", "did you mean `plane`"),
        (PLANE.replace("kind = \"plane\"\n", ""), "wall.kind", "sphere"),
        (PLANE.replace("normal = [0, 0, -2]", ""), "wall.normal", "from the plane to the rod"),
        (PLANE.replace("position = [0, 0, \"50 mm\"]", ""), "wall.position", "a point of the plane"),
        (PLANE.replace("\"50 mm\"", "\"50 g\""), "wall.position[2]", "is a mass"),
        (PLANE.replace("[0, 0, -2]", "[0, 0, 0]"), "wall.normal", "any length but 0"),
        (CYLINDER.replace("[1, 0, 0]", "[0, 0, 0]"), "wall.axis", "any length but 0"),
        (CYLINDER.replace("axis = [1, 0, 0]", ""), "wall.axis", "direction of the cylinder"),
        (SPHERE.replace("\"35 mm\"", "0"), "wall.radius", "greater than zero"),
        (SPHERE.replace("radius = \"35 mm\"", ""), "wall.radius", "35 mm"),
        (SPHERE.replace("side = \"inside\"", ""), "wall.side", "where the rod is"),
        (SPHERE.replace("inside", "insde"), "wall.side", "did you mean `inside`"),
        (format!("{SPHERE}tip_radius = \"35 mm\""), "wall.radius", "does not fit inside"),
        (format!("{SPHERE}tip_radius = \"-1 mm\""), "wall.tip_radius", "not negative"),
        (format!("{PLANE}stiffness = 0"), "wall.stiffness", "leave it out for a rigid wall"),
        (format!("{PLANE}stiffness = \"3 N\""), "wall.stiffness", "N/m"),
        (format!("{PLANE}stiffness = 1e61"), "wall.stiffness", "is 1e61: it must be at most 1e60 in size"),
        (format!("{PLANE}stiffness = 1e-61"), "wall.stiffness", "is 1e-61: it must be at least 1e-60"),
        (format!("{PLANE}friction = 1e61"), "wall.friction", "at most 1e60 in size"),
        (format!("{PLANE}tip_radius = 1e61"), "wall.tip_radius", "at most 1e60 in size"),
        (SPHERE.replace("\"35 mm\"", "1e61"), "wall.radius", "is 1e61: it must be at most 1e60 in size"),
        (SPHERE.replace("\"35 mm\"", "1e-61"), "wall.radius", "at least 1e-60"),
        (SPHERE.replace("[0, 0, 0]", "[0, 1e61, 0]"), "wall.position[1]", "at most 1e60 in size"),
        (CYLINDER.replace("[1, 0, 0]", "[1e-61, 0, 0]"), "wall.axis", "at least 1e-60"),
        (format!("{PLANE}friction = -0.1"), "wall.friction", "not negative"),
        (format!("{PLANE}radius = 0.1"), "wall.radius", "belongs to a sphere or a cylinder"),
        (format!("{PLANE}side = \"inside\""), "wall.side", "belongs to a sphere or a cylinder"),
        (format!("{SPHERE}normal = [0, 0, 1]"), "wall.normal", "belongs to a plane"),
        (format!("{SPHERE}axis = [0, 0, 1]"), "wall.axis", "belongs to a cylinder"),
        (format!("{PLANE}tip = \"slide\""), "wall.tip", "did you mean `slides`"),
        (format!("{PLANE}tip = \"sticks\""), "wall.anchor", "a held tip needs one"),
        (format!("{PLANE}anchor = [0, 0, 0.05]"), "wall.anchor", "a sliding tip has no anchor"),
        (format!("{PLANE}fricton = 0.1"), "wall.fricton", "did you mean `friction`"),
        (format!("{PLANE}[loads]\ntip_moment = [0, 0, 1e-3]"), "loads.tip_moment", "leave them out, or `[wall]`"),
        (format!("{PLANE}[model]\nrigid_force_arm = false"), "model.rigid_force_arm", "use the complete balance"),
    ];
    for (text, key, remedy) in cases {
        let error = read(&text).expect_err(&text);
        let message = error.to_string();
        assert_eq!(error.key, key, "{message}");
        assert!(error.line.is_some() && message.starts_with("scene.toml:"), "{message}");
        assert!(message.contains(remedy), "{message}");
    }
}

#[test]
fn one_wall_at_a_time() {
    for count in [1, 2] {
        let walls = format!("[[wall]]\n{PLANE}").repeat(count);
        let error = parse_scene("scene.toml".as_ref(), &format!("{walls}{ROD}")).expect_err("a list");
        assert_eq!((error.key.as_str(), error.line), ("wall", Some(1)), "{error}");
        assert!(error.to_string().contains("one wall at a time: `[wall]`, not `[[wall]]`"), "{error}");
    }
    let named = ROD.replace("tube", "wall");
    let error = parse_scene("scene.toml".as_ref(), &format!("[wall]\n{PLANE}{named}")).expect_err("a name twice");
    assert_eq!(error.key, "segment[0].name", "{error}");
    // Without a wall the name is free.
    parse_scene("scene.toml".as_ref(), &named).unwrap_or_else(|error| panic!("{error}"));
}

fn sweep(scene: &str, rest: &str) -> Result<SweepSpec, InputError> {
    let sampling = "scene = \"s.toml\"\n[sampling]\nmethod = \"grid\"\n[[axis]]\nparameter = \"loads.tip_force.x\"\n\
                    from = 0\nto = 1e-3\npoints = 2\n";
    SweepSpec::parse_with("sweep.toml".as_ref(), &format!("{sampling}{rest}"), &[("s.toml", scene)])
}

#[test]
fn rows_of_a_wall_have_its_columns() {
    let scene = format!("[wall]\n{PLANE}\n{ROD}");
    let spec =
        sweep(&scene, "[output]\nderivatives = [\"wall.position.z\"]\n").unwrap_or_else(|error| panic!("{error}"));
    assert!(spec.quantities.contains(&OutputQuantity::Contact));
    let names = spec.column_names();
    let first = names.iter().position(|name| name == "contact.touching").expect("contact");
    let expected = [
        "touching",
        "gap",
        "normal_force",
        "force.x",
        "force.y",
        "force.z",
        "friction_ratio",
        "holds",
        "angle",
        "body_gap",
        "force_error",
    ];
    assert_eq!(names[first..first + expected.len()], expected.map(|name| format!("contact.{name}")));
    // A resolved sweep is the sweep.
    let again = SweepSpec::parse("sweep.toml".as_ref(), &spec.to_toml()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((again.scene, again.quantities), (spec.scene, spec.quantities));
    // Asked for without one, or left out with one.
    let few = sweep(&scene, "[output]\nquantities = [\"tip_position\"]\n").unwrap_or_else(|error| panic!("{error}"));
    assert!(few.column_names().iter().all(|name| !name.starts_with("contact")));
    let plain = sweep(ROD, "").unwrap_or_else(|error| panic!("{error}"));
    assert!(plain.column_names().iter().all(|name| !name.starts_with("contact")));
    let error = sweep(ROD, "[output]\nquantities = [\"tip_position\", \"contact\"]\n").expect_err("no wall");
    assert_eq!(error.key, "output.quantities[1]", "{error}");
    assert!(error.to_string().contains("add `[wall]`"), "{error}");
}

#[test]
fn sweeps_of_a_wall_refuse_what_is_not_known() {
    let scene = format!("[wall]\n{PLANE}friction = 0.3\n{ROD}");
    let cases = [
        ("[solver]\nbranch = \"all\"\n", "solver.branch", "not searched with a wall yet"),
        ("[output]\nderivatives = [\"wall.friction\"]\n", "output.derivatives", "changes no equilibrium"),
        ("[output]\nderivatives = [\"loads.tip_moment.x\"]\n", "output.derivatives", "tip moment has no energy"),
    ];
    let stiffness = "[[axis]]\nparameter = \"wall.stiffness\"\nfrom = 10\nto = 100\npoints = 2\n";
    let error = sweep(&scene, stiffness).expect_err("a rigid wall");
    assert!(error.key.starts_with("axis[1]") && error.to_string().contains("give the scene a stiffness"), "{error}");
    sweep(&scene.replace("friction = 0.3", "stiffness = 50"), stiffness).unwrap_or_else(|error| panic!("{error}"));
    for (rest, key, remedy) in cases {
        let error = sweep(&scene, rest).expect_err(rest);
        assert!(error.key.starts_with(key) && error.to_string().contains(remedy), "{error}");
        assert!(error.line.is_some(), "{error}");
    }
}
