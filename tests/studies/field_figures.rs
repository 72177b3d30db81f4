//! What makes a field vary, in the figures of rods, clouds, paths and motions.

use crate::common::root;
use rodsweep::draw::{Cloud, Figure, ImageFormat, RodMotion, Stretch, StretchKind, Surroundings, TipPath, encode};
use rodsweep::figures::rod_shape;
use rodsweep::input::{parse_scene, read_scene};
use rodsweep::model::{Axis, MagnetParameter, Parameter, Scene};
use rodsweep::study::Solve;
use std::path::Path;

fn arm() -> Scene {
    read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("the scene")
}

fn svg(figure: &dyn Figure) -> String {
    String::from_utf8(encode(figure, ImageFormat::Svg).expect("a figure")).expect("text")
}

fn svg_of(scene: &Scene) -> String {
    svg(&rod_shape(&Solve::new(scene.clone()).run().expect("a solution")).expect("a shape"))
}

/// Words and places of the texts in an SVG, but for those on axes.
fn texts(svg: &str) -> Vec<(String, [f64; 2])> {
    let of = |line: &str| {
        let at = line.strip_prefix("<text transform=\"translate(")?.split_once(')')?.0.split_once(' ')?;
        let words = line.split_once("xml:space=\"preserve\">")?.1.strip_suffix("</text>")?;
        Some((words.to_owned(), [at.0.parse().ok()?, at.1.parse().ok()?]))
    };
    svg.lines().filter_map(of).collect()
}

fn count(svg: &str, words: &str) -> usize {
    texts(svg).iter().filter(|(text, _)| text == words).count()
}

#[test]
fn a_magnet_that_fits_is_drawn_in_every_view() {
    let svg = svg_of(&arm());
    assert_eq!(count(&svg, "arm"), 4);
    for words in ["magnet, 192 A·m", "clearance", "lines of B in the plane", "mT at the tip"] {
        assert!(svg.contains(words), "{words}");
    }
    assert!(!svg.contains("beyond the panel"));
    // Lines of the field, thin and light, in three panels.
    assert!(svg.matches("stroke=\"#a9b4c0\" stroke-width=\"0.55\"").count() > 60);
}

/// The magnet is 140 mm beside a rod of 66 mm; moved away it becomes a mark that tells the distance.
#[test]
fn a_magnet_far_away_is_a_mark_with_its_distance() {
    let mut scene = arm();
    scene.sources.magnets[0].position = [-0.5, 0.0, 0.03];
    scene.sources.magnets[0].strength = 1e-3;
    let svg = svg_of(&scene);
    // The rod hardly bends: its middle is half a metre away.
    assert_eq!(count(&svg, "arm: 500 mm"), 2, "one in x-z and one in x-y");
    assert!(svg.contains("beyond the panel") && count(&svg, "arm") == 0);
    let (near, far) = (svg_of(&arm()), svg);
    let widest = |svg: &str| {
        let ticks = texts(svg).into_iter().filter_map(|(text, _)| text.parse::<f64>().ok());
        ticks.fold(0.0, f64::max)
    };
    assert!(widest(&near) >= 160.0 && widest(&far) <= 80.0, "the view shows the rod");
}

#[test]
fn coils_have_numbers_and_signs() {
    let scene = read_scene(&root().join("sweeps/scenes/coil_array.toml")).expect("the scene");
    let svg = svg_of(&scene);
    let texts = texts(&svg);
    for words in ["array 1 (+): ", "array 3 (−): ", "array 6 (+), 7 (+): ", "array 4 (+): "] {
        assert!(texts.iter().any(|(text, _)| text.starts_with(words)), "{words}: {texts:?}");
    }
    let near = TEXT.replace("200 mm", "40 mm");
    let svg = svg_of(&parse_scene(Path::new("near.toml"), &near).expect("a scene"));
    assert_eq!([count(&svg, "em 1, +5 A"), count(&svg, "em 2, −3 A")], [4, 4]);
    assert!(svg.contains("electromagnet (size not to scale)"));
}

const TEXT: &str = r#"
[field]
flux_density = ["2 mT", 0, 0]

[[coil_array]]
name = "em"
current = ["5 A", "-3 A"]
[[coil_array.coil]]
dipoles = [{ position = ["200 mm", "8 mm", "20 mm"], moment_per_ampere = ["-0.1 m^2", 0, 0] }]
[[coil_array.coil]]
dipoles = [{ position = ["-200 mm", "-8 mm", "50 mm"], moment_per_ampere = ["0.1 m^2", 0, 0] }]

[[segment]]
name = "tube"
kind = "flexible"
length = "60 mm"
stiffness = { bending = "2e-5 N·m²", torsion = "1.5e-5 N·m²" }
dipole_per_length = [0, 0, "0.02 A·m"]
"#;

#[test]
fn a_uniform_part_is_told_apart() {
    let svg = svg_of(&parse_scene(Path::new("coils.toml"), TEXT).expect("a scene"));
    assert!(svg.contains("uniform field B") && svg.contains(", 2 mT"));
}

/// A magnet that a sweep moves is drawn where the scene has it, without the lines of one of its places.
#[test]
fn clouds_of_sweeps_that_move_the_field_have_no_lines() {
    let around = Surroundings::of(&arm()).expect("a magnet");
    let points: Vec<[f64; 3]> = (0..500).map(|k| [4e-5 * f64::from(k), 0.0, 0.06 - 2e-5 * f64::from(k)]).collect();
    let cloud = |around: Surroundings| Cloud {
        values: points.iter().map(|point| point[0]).collect(),
        points: points.clone(),
        rod: Some(vec![[0.0; 3], [0.0, 0.0, 0.066]]),
        surroundings: Some(around),
        ..Cloud::default()
    };
    let still = svg(&cloud(around.clone()));
    assert!(still.contains("lines of B") && count(&still, "arm") == 4);
    let moved = svg(&cloud(around.swept(Parameter::Magnet(0, MagnetParameter::Position(Axis::Y)))));
    assert!(!moved.contains("lines of B") && count(&moved, "arm, swept") == 4);
    assert!(!moved.contains("#a9b4c0") && still.contains("#a9b4c0"));
}

#[test]
fn magnets_move_along_with_the_rods() {
    let at = |k: usize| {
        let mut scene = arm();
        scene.sources.magnets[0].position[1] = 0.01 * k as f64;
        Surroundings::of(&scene).expect("a magnet").sources
    };
    let rod = |k: usize| -> Vec<[f64; 3]> { (0..20).map(|j| [1e-4 * (j * k) as f64, 0.0, 3e-3 * j as f64]).collect() };
    let mut around = Surroundings::of(&arm()).expect("a magnet");
    around.sources.clear();
    around.has_lines = false;
    let tips: Vec<[f64; 3]> = (0..5).map(|k| rod(k)[19]).collect();
    let path = TipPath {
        desired: tips.clone(),
        achieved: tips.clone(),
        rods: (0..5).map(rod).collect(),
        names: ["desired", "achieved"],
        order: true,
        surroundings: Some(around.clone()),
        magnets: (0..5).map(at).collect(),
        ..TipPath::default()
    };
    let with = svg(&path);
    let without = svg(&TipPath { magnets: Vec::new(), ..path.clone() });
    assert!(with.contains("magnet, first and last whole") && !without.contains("magnet, first"));
    // In four views five middles, and two arrows; the legend has one dot.
    assert_eq!(with.matches("<circle").count() - without.matches("<circle").count(), 4 * 5 + 1 + 2 * 2);
    let stretch =
        |k: usize| vec![Stretch { name: "rod".into(), kind: StretchKind::Flexible, points: rod(k), dipole: None }];
    let motion = RodMotion {
        desired: tips.clone(),
        tips,
        rods: (0..5).map(stretch).collect(),
        seconds: 2.0,
        surroundings: Some(around),
        magnets: (0..5).map(at).collect(),
        ..RodMotion::default()
    };
    let moving = svg(&motion);
    // The rod, the magnet's outline and its moment in each view.
    assert_eq!(moving.matches("attributeName=\"d\"").count(), 12);
    assert!(moving.contains("magnet that moves"));
}
