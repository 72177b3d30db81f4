//! Scene files with fields that vary in space: what they mean, mistakes in them, that they read back as written.

use crate::common::texts::SCENE;
use rodsweep::input::{InputError, assign, parse_scene, write_scene};
use rodsweep::model::{CoilLoad, MagnetShape, Parameter, Plan, PlanOptions, Scene, Slot};
use std::path::Path;

const SOURCES: &str = r#"
[[magnet]]
name = "em1"
position = ["150 mm", 0, "100 mm"]
moment = [0, 0, "70 A·m^2"]
[[magnet]]
name = "bar"
position = [0, "-120 mm", 0]
axis = [0, 0, 2]
diameter = "10 mm"
length = "40 mm"
remanence = "1.4 T"
rotation = [0.3, 0, 0]
[[magnet]]
name = "disc"
position = [0, "120 mm", 0]
axis = [0, 0, 1]
diameter = "40 mm"
length = "5 mm"
moment = [0, 1, 6]
[[coil_array]]
name = "octomag"
current = ["5 A", -3]
[[coil_array.coil]]
dipoles = [{ position = ["0.2 m", 0, 0], moment_per_ampere = [-0.6, 0, 0] }]
[[coil_array.coil]]
dipoles = [
  { position = [0, "0.2 m", 0], moment_per_ampere = [0, -0.3, 0] },
  { position = [0, "0.22 m", 0], moment_per_ampere = [0, -0.3, 0] },
]
[model]
coil_load = "middle"
"#;
const GRADIENT: &str =
    "gradient = { xx = \"0.3 T/m\", xz = \"10 G/cm\", yy = \"-10 mT/cm\" }\norigin = [0, 0, \"0.1 m\"]\n";

fn text() -> String {
    let field = "flux_density = [0, \"3 T\", 0]\n";
    assert!(SCENE.contains(field));
    SCENE.replacen(field, &format!("{field}{GRADIENT}"), 1) + SOURCES
}

fn parsed(text: &str) -> Result<Scene, InputError> {
    parse_scene(Path::new("x.toml"), text)
}

fn good() -> Scene {
    parsed(&text()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn sources_are_read_and_written() {
    let scene = good();
    let sources = &scene.sources;
    assert_eq!(sources.gradient, Some([0.3, 0.0, 0.1, -1.0, 0.0]));
    assert_eq!((sources.origin, sources.coil_load), ([0.0, 0.0, 0.1], CoilLoad::Middle));
    assert_eq!(sources.magnets[0].moment, [0.0, 0.0, 70.0]);
    // Br V / mu0
    let volume = std::f64::consts::PI / 4.0 * 0.01 * 0.01 * 0.04;
    let moment = 1.4 * volume / (4e-7 * std::f64::consts::PI);
    assert!((sources.magnets[1].moment[2] - moment).abs() < 1e-12 * moment, "{:?}", sources.magnets[1]);
    assert_eq!(sources.magnets[1].clearance, 0.02);
    assert_eq!(sources.magnets.iter().map(|magnet| magnet.dipole_count()).collect::<Vec<_>>(), [1, 2, 4]);
    assert_eq!(sources.arrays[0].current, [5.0, -3.0]);
    assert_eq!(scene.rod().field.expect("a field that varies").dipoles.len(), 10);
    let again = write_scene(&scene);
    assert_eq!(parsed(&again).unwrap_or_else(|error| panic!("{error}\n{again}")), scene);
}

/// Sphere and cylinder: the second moment of what stands for a cylinder is its own.
#[test]
fn cylinders_keep_their_second_moment() {
    for magnet in &good().sources.magnets[1..] {
        let MagnetShape::Cylinder { axis, length, diameter, .. } = magnet.body.expect("a body").shape else {
            panic!("no cylinder")
        };
        let dipoles = magnet.dipoles();
        let share = 1.0 / dipoles.len() as f64;
        let turned = rodsweep::model::rotation_matrix(magnet.rotation);
        let axis: [f64; 3] = std::array::from_fn(|r| (0..3).map(|c| turned[r][c] * axis[c]).sum());
        let (mut along, mut all) = (0.0, 0.0);
        for dipole in &dipoles {
            let r: [f64; 3] = std::array::from_fn(|k| dipole.position[k] - magnet.position[k]);
            along += share * (0..3).map(|k| r[k] * axis[k]).sum::<f64>().powi(2);
            all += share * r.iter().map(|x| x * x).sum::<f64>();
        }
        // Up to a multiple of the unit matrix, of which a potential knows nothing.
        let across = 0.5 * (all - along);
        let expected = length * length / 12.0 - diameter * diameter / 16.0;
        assert!((along - across - expected).abs() < 1e-15, "{} {along} {across} {expected}", magnet.name);
    }
}

#[test]
fn parameters_have_names_and_chains() {
    let scene = good();
    let count = |name: &str| Parameter::parse(&scene, name).unwrap_or_else(|error| panic!("{error}")).len();
    assert_eq!(count("field.gradient"), 5);
    assert_eq!(count("field.origin"), 3);
    assert_eq!(count("magnets.em1.position"), 3);
    assert_eq!(count("magnets.bar.rotation.x"), 1);
    assert_eq!(count("octomag.current"), 2);
    assert!(Parameter::parse(&scene, "magnets.em2.position.x").unwrap_err().to_string().contains("em1"));
    // Each rate is the slope of the rod's own numbers.
    for parameter in Parameter::all(&scene) {
        let chain = parameter.chain(&scene);
        if !chain.iter().any(|(slot, _)| slot.is_of_sources()) {
            continue;
        }
        let h = 1e-4;
        let at = |by: f64| {
            let mut moved = scene.clone();
            parameter.set(&mut moved, parameter.get(&scene) + by).expect("a number that can be set");
            moved.rod().field.expect("a field that varies")
        };
        let (up, down) = (at(h), at(-h));
        for (slot, rate) in chain {
            let difference = match slot {
                Slot::FieldGradient(entry) => up.gradient[entry.index()] - down.gradient[entry.index()],
                Slot::FieldOrigin(axis) => up.origin[axis.index()] - down.origin[axis.index()],
                Slot::SourcePosition(k, axis) => {
                    up.dipoles[k].position[axis.index()] - down.dipoles[k].position[axis.index()]
                }
                Slot::SourceMoment(k, axis) => {
                    up.dipoles[k].moment[axis.index()] - down.dipoles[k].moment[axis.index()]
                }
                _ => continue,
            };
            let name = parameter.name(&scene);
            assert!((difference / (2.0 * h) - rate).abs() < 1e-6 * rate.abs().max(1.0), "{name} {slot:?} {rate}");
        }
    }
}

/// What a sample of a sweep reads back is what its scene says.
#[test]
fn swept_sources_reach_the_rod() {
    let scene = good();
    for name in ["magnets.bar.rotation.y", "magnets.disc.position.z", "octomag.current.2", "field.gradient.xy"] {
        let axes = vec![Parameter::parse(&scene, name).expect("a parameter")];
        let wrt = Parameter::parse(&scene, "magnets.bar").unwrap_or_default();
        let plan = Plan::new(&scene, &axes, &wrt, PlanOptions::default()).expect("a plan");
        let batch = plan.batch(3, |i, row| row[0] = 0.1 * i as f64);
        let mut expected = scene.clone();
        assign(&mut expected, &[format!("{name}=0.2")]).expect("an assignment");
        assert_eq!(plan.sample_rod(&batch, 2).field, expected.rod().field, "{name}");
    }
}

#[test]
fn mistakes_are_named() {
    let cases = [
        ("xx = \"0.3 T/m\"", "xx = \"0.3 T\"", "field.gradient.xx", "gradient of a field such as \"0.3 T/m\""),
        ("yy = \"-10 mT/cm\"", "yy = 0, zz = 0", "field.gradient.zz", "div B = 0"),
        (GRADIENT, "gradient = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n", "field.gradient", "trace zero"),
        (GRADIENT, "gradient = [[1, 2, 0], [0, -1, 0], [0, 0, 0]]\n", "field.gradient", "symmetric"),
        (GRADIENT, "gradient = { xx = 1 }\nmri_gradient = [0, 0, 1]\n", "field.gradient", "keep one of the two"),
        (GRADIENT, "origin = [0, 0, 0]\n", "field.gradient", "is where the gradient adds nothing"),
        ("name = \"em1\"\n", "", "magnet[0].name", "start with `magnets.`"),
        ("name = \"bar\"", "name = \"em1\"", "magnet[1].name", "give each its own name"),
        ("name = \"octomag\"", "name = \"coil\"", "coil_array[0].name", "give each its own name"),
        ("\"70 A·m^2\"", "\"70 T·m^3\"", "magnet[0].moment[2]", "a magnetic moment"),
        ("\"70 A·m^2\"", "0", "magnet[0].moment", "a magnet without moment does nothing"),
        ("position = [\"150 mm\", 0, \"100 mm\"]", "position = [\"4 mm\", 0, 0]", "magnet[0].position", "clearance"),
        ("moment = [0, 0, \"70 A·m^2\"]\n", "", "magnet[0].moment", "or remanence with axis"),
        ("axis = [0, 0, 2]\n", "", "magnet[1].axis", "a cylinder has axis, diameter and length"),
        ("axis = [0, 0, 2]", "axis = [0, 0, 0]", "magnet[1].axis", "a direction other than zero"),
        ("remanence = \"1.4 T\"", "remanense = \"1.4 T\"", "magnet[1].remanense", "did you mean `remanence`"),
        ("current = [\"5 A\", -3]", "current = [5]", "coil_array[0].current", "one current for each coil"),
        ("coil_load = \"middle\"", "coil_load = \"midle\"", "model.coil_load", "did you mean `middle`"),
        ("kind = \"flexible\"\nlength", "kind = \"rigid\"\nlength", "segment[0].youngs_modulus", "flexible"),
    ];
    for (from, to, key, words) in cases {
        let text = text();
        assert!(text.contains(from), "{from}");
        let error = parsed(&text.replacen(from, to, 1)).expect_err(to);
        let message = error.to_string();
        assert_eq!(error.key, key, "{message}");
        assert!(error.line.is_some() && message.contains(words), "{message}\n  has not: {words}");
    }
}

/// What once was refused: a rigid start, and forces without their arm.
#[test]
fn combinations_are_read() {
    let start = SCENE.find("[[segment]]").expect("a segment");
    let rigid = "[[segment]]\nname = \"holder\"\nkind = \"rigid\"\nlength = \"5 mm\"\n";
    let armless = SOURCES.replace("[model]", "[model]\nrigid_force_arm = false");
    let scene = parsed(&format!("{}{rigid}{}{armless}", &SCENE[..start], &SCENE[start..])).expect("a good scene");
    assert!(!scene.rigid_force_arm && !scene.rod().segments[0].is_flexible());
    assert_eq!(parsed(&write_scene(&scene)).expect("what was written"), scene);
}
