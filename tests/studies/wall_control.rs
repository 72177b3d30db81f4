//! A tip that is led along a wall and pressed against it: position and force are reached, and hold when solved again.

use crate::common::root;
use crate::common::walls::{EI, LENGTH, golden_wall, wire};
use rodsweep::input::{parse_coordinates, parse_trajectory, read_trajectory};
use rodsweep::model::Scene;
use rodsweep::spec::{Target, Trajectory};
use rodsweep::study::{ControlError, ControlJob, ControlRun, Outcome, Solve};
use std::f64::consts::TAU;

/// Every target is reached, and where its inputs are solved anew the tip and the force are those asked for.
fn check(run: &ControlRun, coordinates: [bool; 3]) {
    assert!(run.mark().is_none(), "{:?}", run.mark());
    for (k, result) in run.results().iter().enumerate() {
        assert_eq!(result.outcome, Outcome::Reached, "target {k}: {result:?}");
        let scene = run.commanded_scene(result).expect("a scene");
        let solved = Solve::new(scene).run().expect("an answer");
        assert!(solved.is_converged() && solved.is_stable(), "target {k}: {:?}", solved.status());
        let contact = solved.contact().expect("a wall");
        for axis in (0..3).filter(|axis| coordinates[*axis]) {
            let off = (solved.tip_position()[axis] - result.target.position[axis]).abs();
            assert!(off < 1e-7, "target {k}: {off:e} m off along {axis}");
        }
        if let Some(force) = result.target.normal_force {
            assert!(contact.touching, "target {k}");
            let off = (contact.normal_force / force - 1.0).abs();
            assert!(off < 1e-6, "target {k}: {} N instead of {force} N", contact.normal_force);
            let told = result.contact.expect("a wall").normal_force;
            assert!((told / contact.normal_force - 1.0).abs() < 1e-6, "target {k}: {told} N are told");
        }
    }
}

fn circle(centre: [f64; 3], radius: f64, count: usize, force: f64) -> Trajectory {
    let target = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
        Target::at([centre[0] + radius * cos, centre[1] + radius * sin, centre[2]]).pressing(force)
    };
    Trajectory::new("circle", (0..count).map(target).collect())
}

#[test]
fn p6_goes_round_on_a_plane_at_a_constant_force() {
    let scene = golden_wall("p6-end-on");
    let tip = Solve::new(scene.clone()).run().expect("an answer").tip_position();
    let mut trajectory = circle(tip, 2e-3, 16, 7e-3);
    trajectory.coordinates = [true, true, false];
    let job = ControlJob::new(scene).input("coil.current=0.3").and_then(|job| job.input("insertion=80 mm..105 mm"));
    let run = job.expect("inputs").follow(&trajectory).expect("a run");
    check(&run, trajectory.coordinates);
    // The force is known to its own error, too: it stands in the table, with what friction would have to hold.
    let table = run.table();
    for name in ["target.normal_force", "contact.normal_force", "contact.force.z", "contact.force_error"] {
        assert!(table.columns.iter().any(|column| column.name == name && column.unit == "N"), "{name}");
    }
    let worst = run.summary().largest_force_error.expect("forces");
    assert!(worst < 1e-8, "{worst:e} N");
    assert!(run.text().contains("normal force where reached"), "{}", run.text());
}

/// Pushed aside by d, a wire presses with 3 EI d / L³, but for (d/L)². The search begins where the wall is away.
#[test]
fn a_wire_is_pushed_until_it_presses() {
    let scene = wire("position = [\"1 mm\", 0, 0]");
    let forces = [1e-3, 2e-3, 3.5e-3];
    let trajectory = Trajectory::new("push", forces.map(|force| Target::default().pressing(force)).into());
    let only_force = parse_coordinates(&["normal_force"]).expect("a coordinate");
    let job = ControlJob::new(scene).input("wall.position.x=-5 mm..1 mm").expect("an input").coordinates(only_force);
    for run in [job.follow(&trajectory), job.reach(&trajectory)] {
        let run = run.expect("a run");
        check(&run, [false; 3]);
        for (result, force) in run.results().iter().zip(forces) {
            let aside = -result.inputs[0];
            let of_beam = 3.0 * EI * aside / LENGTH.powi(3);
            let allowed = 2.0 * (aside / LENGTH).powi(2) + 1e-6;
            assert!((of_beam / force - 1.0).abs() < allowed, "{force} N: {aside} m, of a beam {of_beam} N");
        }
    }
}

#[test]
fn the_place_where_a_tip_is_held_can_be_commanded() {
    let scene = golden_wall("p6-held-buckled");
    let plane = 0.088;
    let targets = (0..6).map(|k| Target::at([1e-3 + 5e-4 * f64::from(k), 2e-3, plane])).collect();
    let job =
        ControlJob::new(scene).input("wall.anchor.x=-10 mm..10 mm").and_then(|job| job.input("wall.anchor.y=10 mm"));
    let run = job.expect("inputs").follow(&Trajectory::new("along", targets)).expect("a run");
    check(&run, [true; 3]);
    for result in run.results() {
        let [x, y] = result.inputs[..] else { panic!("two inputs") };
        assert!((x - result.target.position[0]).abs() < 1e-7 && (y - result.target.position[1]).abs() < 1e-7);
    }
    let forces: Vec<f64> = run.results().iter().map(|result| result.contact.expect("a wall").normal_force).collect();
    assert!(forces.windows(2).all(|pair| pair[0] != pair[1]), "{forces:?}");
}

fn refusal(scene: &Scene, text: &str) -> String {
    match parse_trajectory("path.toml".as_ref(), text, scene) {
        Ok(_) => panic!("taken: {text}"),
        Err(error) => error.to_string(),
    }
}

const CIRCLE: &str = "shape = \"circle\"\nsize = \"2 mm\"\ncentre = [0, 0, \"80 mm\"]\npoints = 8\n";

#[test]
fn a_force_that_no_wall_can_give_is_refused() {
    let with_wall = wire("position = [0, 0, 0]");
    let without = rodsweep::input::read_scene(&root().join("sweeps/scenes/p6.toml")).expect("a scene");
    let coordinates = "coordinates = [\"x\", \"y\", \"normal_force\"]\n";
    let force = "normal_force = \"2 mN\"\n";
    for (scene, text, words) in [
        (&without, format!("{CIRCLE}{coordinates}"), ["toml:5:", "`coordinates`", "add [wall]"]),
        (&without, format!("{CIRCLE}{force}"), ["toml:5:", "`normal_force`", "add [wall]"]),
        (
            &with_wall,
            format!("{CIRCLE}{coordinates}"),
            ["`normal_force`", "is missing", "how hard the tip should press"],
        ),
        (
            &with_wall,
            format!("{CIRCLE}{force}coordinates = [\"x\"]\n"),
            ["toml:5:", "`normal_force`", "add \"normal_force\" to the coordinates"],
        ),
        (&with_wall, format!("{CIRCLE}normal_force = -1e-3\n"), ["toml:5:", "`normal_force`", "does not pull"]),
        (&with_wall, format!("{CIRCLE}normal_force = \"2 mm\"\n"), ["toml:5:", "`normal_force`", "force"]),
    ] {
        let told = refusal(scene, &text);
        assert!(words.iter().all(|word| told.contains(word)), "{text}\n{told}\n{words:?}");
    }
    let taken = parse_trajectory("path.toml".as_ref(), &format!("{CIRCLE}{force}{coordinates}"), &with_wall);
    let taken = taken.unwrap_or_else(|error| panic!("{error}"));
    assert!(taken.targets.iter().all(|target| target.normal_force == Some(2e-3)));
    assert_eq!(taken.coordinates, [true, true, false]);
    let job = ControlJob::new(without).input("coil.current=0.3").expect("an input");
    let pressing = Trajectory::new("one", vec![Target::at([0.0; 3]).pressing(1e-3)]);
    assert!(matches!(job.follow(&pressing), Err(ControlError::NoWall)));
    let free = Trajectory::new("one", vec![Target::at([0.0; 3])]);
    let only_force = parse_coordinates(&["normal_force"]).expect("a coordinate");
    let job = ControlJob::new(with_wall).input("wall.position.x=5 mm").expect("an input").coordinates(only_force);
    assert!(matches!(job.follow(&free), Err(ControlError::NoForce { target: 0 })));
}

#[test]
fn tables_have_a_column_of_forces() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("targets.csv");
    std::fs::write(&file, "x,y,normal_force [mN]\n0,0.001,1.5\n0,0.002,2\n").expect("written");
    let read = read_trajectory(&file, &wire("position = [0, 0, 0]")).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(read.coordinates, [true, true, false]);
    let forces: Vec<Option<f64>> = read.targets.iter().map(|target| target.normal_force).collect();
    assert_eq!(forces, [Some(1.5e-3), Some(2e-3)]);
    let without = rodsweep::input::read_scene(&root().join("sweeps/scenes/p6.toml")).expect("a scene");
    let told = read_trajectory(&file, &without).expect_err("no wall").to_string();
    assert!(["targets.csv", "normal_force", "add [wall]"].iter().all(|word| told.contains(word)), "{told}");
}
