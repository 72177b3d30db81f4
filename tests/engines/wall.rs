//! A wall that the tip touches: golden scenes, closed forms, limits, symmetries.
#![allow(non_snake_case)]

use super::common::check::{SMALL_COLUMN, column_error, difference, natural_size, norm, pose_error};
use super::common::root;
use rodsweep::backend::Backend;
use rodsweep::input::parse_scene;
use rodsweep::model::{
    ContactColumn, Matrix, Parameter, Plan, PlanOptions, Quantity, Scene, Side, Status, TipOnWall, Vector, Wall,
    WallShape,
};
use rodsweep::reference::Reference;
use serde_json::Value;
use std::path::Path;

/// A scene with what two independent computations agree to.
struct WallCase {
    scene: Scene,
    parameters: Vec<Parameter>,
    /// In words of the data: any success is "success".
    status: String,
    /// Of a path that ends while the wall comes.
    load_fraction: f64,
    /// `None`: there is no solution.
    solution: Option<Solution>,
}

struct Solution {
    touching: bool,
    index: f64,
    index_dead: usize,
    index_pinned: usize,
    p: Vector,
    R: Matrix,
    base_moment: Vector,
    energy: f64,
    margin: f64,
    gap: f64,
    normal: Vector,
    force: Vector,
    normal_force: f64,
    body_gap: f64,
    /// Six rows, tip position and rotation.
    of_pose: Vec<Vec<f64>>,
    of_force: Vec<Vec<f64>>,
    /// `None` of a held tip.
    of_normal_force: Option<Vec<f64>>,
}

/// Largest errors that an engine may show.
#[derive(Clone, Copy)]
struct Tolerance {
    /// Tip position over length, rotation (rad), gap over length.
    pose: f64,
    /// Relative, as base moment and margin.
    force: f64,
    /// Of pose and force, relative.
    columns: f64,
    /// Columns below this share of their natural size are measured against it.
    small_column: f64,
    /// Of the wall's way, where a path ends on it.
    fold: f64,
}

const REFERENCE: Tolerance =
    Tolerance { pose: 1e-9, force: 1e-9, columns: 1e-7, small_column: SMALL_COLUMN, fold: 1e-4 };
/// The golden least gap along the rod is sampled (m).
const BODY_GAP: f64 = 1e-5;
/// Energies are good to this, relative.
const ENERGY: f64 = 1e-9;

/// All golden scenes by name.
fn cases() -> Vec<WallCase> {
    let folder = root().join("tests/data/wall");
    let mut files: Vec<_> =
        std::fs::read_dir(&folder).expect("a folder").map(|file| file.expect("a file").path()).collect();
    files.sort();
    assert_eq!(files.len(), 28);
    files.iter().map(|file| case(file)).collect()
}

fn read<T: serde::de::DeserializeOwned>(value: &Value) -> T {
    T::deserialize(value).expect("data of this kind")
}

fn case(file: &Path) -> WallCase {
    let text = std::fs::read_to_string(file).expect("a readable file");
    let value: Value = serde_json::from_str(&text).expect("valid JSON");
    let text = value["scene"].as_str().expect("a scene");
    let scene = scene(text);
    let names = value["parameters"].as_array().map_or(&[][..], Vec::as_slice);
    let named = |name: &Value| {
        let found = Parameter::parse(&scene, name.as_str().expect("a name")).expect("a parameter");
        assert_eq!(found.len(), 1, "{name}");
        found[0]
    };
    let expected = &value["expected"];
    let solution = (!value["tip"].is_null()).then(|| {
        let (contact, derivatives) = (&value["contact"], &value["derivatives"]);
        let mut of_pose: Vec<Vec<f64>> = read(&derivatives["position"]);
        of_pose.extend(read::<Vec<Vec<f64>>>(&derivatives["rotation"]));
        Solution {
            touching: read(&expected["touching"]),
            index: read(&expected["index"]),
            index_dead: read(&expected["index_dead"]),
            index_pinned: read(&expected["index_pinned"]),
            p: read(&value["tip"]["position"]),
            R: read(&value["tip"]["rotation"]),
            base_moment: read(&value["base_moment"]),
            energy: read(&value["energy"]),
            margin: read(&value["margin"]),
            gap: read(&contact["gap"]),
            normal: read(&contact["normal"]),
            force: read(&contact["force"]),
            normal_force: read(&contact["normal_force"]),
            body_gap: read(&contact["body_gap"]),
            of_pose,
            of_force: read(&derivatives["force"]),
            of_normal_force: read(&derivatives["normal_force"]),
        }
    });
    WallCase {
        parameters: names.iter().map(named).collect(),
        status: expected["status"].as_str().expect("a status").to_owned(),
        load_fraction: expected["load_fraction"].as_f64().unwrap_or(1.0),
        solution,
        scene,
    }
}

fn named(name: &str) -> WallCase {
    case(&root().join("tests/data/wall").join(name).with_extension("json"))
}

/// A scene with its wall, which stands last.
fn scene(text: &str) -> Scene {
    let (rest, wall) = text.split_once("\n[wall]\n").expect("a wall");
    let scene = parse_scene("golden.toml".as_ref(), rest).expect("a good scene");
    let wall: toml_edit::DocumentMut = wall.parse().expect("good keys");
    let number = |key: &str| wall.get(key).map(|x| x.as_float().expect("a number"));
    let triple = |key: &str| {
        let item = wall.get(key)?.as_array().expect("a vector");
        Some(std::array::from_fn(|k| item.get(k).and_then(|x| x.as_float()).expect("three numbers")))
    };
    let word = |key: &str| wall.get(key).map(|x| x.as_str().expect("a word"));
    let side = match word("side") {
        Some("outside") => Side::Outside,
        _ => Side::Inside,
    };
    let radius = number("radius").unwrap_or_default();
    let shape = match word("kind").expect("a kind") {
        "plane" => WallShape::Plane { normal: triple("normal").expect("a normal") },
        "sphere" => WallShape::Sphere { radius, side },
        "cylinder" => WallShape::Cylinder { axis: triple("axis").expect("an axis"), radius, side },
        other => panic!("{other}"),
    };
    let tip = match word("tip") {
        Some("sticks") => TipOnWall::Sticks(triple("anchor").expect("an anchor")),
        _ => TipOnWall::Slides,
    };
    let wall = Wall {
        shape,
        position: triple("position").expect("a position"),
        rotation: triple("rotation").unwrap_or_default(),
        tip_radius: number("tip_radius").unwrap_or_default(),
        stiffness: number("stiffness"),
        friction: number("friction"),
        tip,
    };
    Scene { wall: Some(wall), ..scene }
}

/// Worst of what was measured, and where.
#[derive(Default)]
struct Worst(f64, String);

impl Worst {
    /// Takes NaN as the worst.
    fn take(&mut self, error: f64, place: impl Fn() -> String) {
        if error.is_nan() || error > self.0 {
            *self = Worst(error, place());
        }
    }
}

/// Solves every golden scene and compares all that its row tells.
fn check_golden(engine: &str, options: PlanOptions, tolerance: Tolerance, make: impl Fn(&Plan) -> Box<dyn Backend>) {
    let (mut pose, mut force, mut base) = (Worst::default(), Worst::default(), Worst::default());
    let (mut columns, mut of_force, mut fold) = (Worst::default(), Worst::default(), Worst::default());
    let mut beside = Worst::default();
    for case in cases() {
        let name = &case.scene.name;
        let plan = Plan::single(&case.scene, &case.parameters, options).expect("a valid plan");
        let solutions = make(&plan).solve(&plan.batch(1, |_, _| {})).expect("a solved batch");
        let (status, units) = (solutions.status(0), plan.units);
        let word = if status.is_success() { "success" } else { status.name() };
        assert_eq!(word, case.status, "{name}: {status:?} at {}", solutions.get(0, Quantity::LoadFraction));
        if status == Status::Fold {
            fold.take((solutions.get(0, Quantity::LoadFraction) - case.load_fraction).abs(), || name.clone());
        }
        let Some(expected) = &case.solution else { continue };
        let contact = |column| solutions.contact(0, column);
        let contact_vector = |column: ContactColumn| -> Vector {
            let first = plan.contact_column().expect("a wall") + column as usize;
            std::array::from_fn(|k| solutions.values.get(0, first + k))
        };
        assert_eq!(contact(ContactColumn::Touching) != 0.0, expected.touching, "{name}");
        assert_eq!(solutions.get(0, Quantity::StabilityIndex), expected.index, "{name}");
        assert_eq!(solutions.get(0, Quantity::LoadFraction), 1.0, "{name}");
        let place = || name.clone();
        pose.take(pose_error(&solutions, 0, &expected.p, &expected.R, units.length), place);
        pose.take((contact(ContactColumn::Gap) - expected.gap).abs() / units.length, place);
        pose.take(difference(&contact_vector(ContactColumn::Normal), &expected.normal), place);
        let size = if expected.touching { norm(&expected.force) } else { units.force };
        force.take(difference(&contact_vector(ContactColumn::Force), &expected.force) / size, place);
        force.take((contact(ContactColumn::NormalForce) - expected.normal_force).abs() / size, place);
        let estimate = contact(ContactColumn::ForceError);
        let error = difference(&contact_vector(ContactColumn::Force), &expected.force);
        assert!(error <= estimate + 1e-12 * size, "{name}: force off by {error:e}, said to be {estimate:e}");
        let moment = solutions.vector(0, Quantity::BaseMoment);
        base.take(difference(&moment, &expected.base_moment) / norm(&expected.base_moment).max(units.moment()), place);
        let margin = solutions.get(0, Quantity::StabilityMargin);
        base.take((margin - expected.margin).abs() / expected.margin.abs(), place);
        beside.take((contact(ContactColumn::BodyGap) - expected.body_gap).abs(), place);
        for (k, parameter) in case.parameters.iter().enumerate() {
            let place = || format!("{name} {}", parameter.name(&case.scene));
            let natural = natural_size(&case.scene, *parameter, &units);
            let small = tolerance.small_column * natural;
            let found: [f64; 6] = std::array::from_fn(|row| solutions.derivative(0, k, row));
            let column: [f64; 6] = std::array::from_fn(|row| expected.of_pose[row][k]);
            columns.take(column_error(&found, &column, small, units.length), place);
            let found = solutions.force_derivative(0, k);
            let column: Vector = std::array::from_fn(|row| expected.of_force[row][k]);
            let size = norm(&column).max(small * norm(&expected.force).max(units.force));
            let off = |error: f64| if error == 0.0 { 0.0 } else { error / size };
            of_force.take(off(difference(&[found[1], found[2], found[3]], &column)), place);
            if let Some(row) = &expected.of_normal_force {
                of_force.take(off((found[0] - row[k]).abs()), place);
            }
        }
    }
    let all = [
        ("pose, gap, normal", pose, tolerance.pose),
        ("force", force, tolerance.force),
        ("base moment, margin", base, tolerance.columns),
        ("columns of the pose", columns, tolerance.columns),
        ("columns of the force", of_force, tolerance.columns),
        ("end of the wall's way", fold, tolerance.fold),
        ("gap of the rod", beside, BODY_GAP),
    ];
    for (what, Worst(error, place), _) in &all {
        println!("{engine}, {what}: {error:.1e} ({place})");
    }
    for (what, Worst(error, place), most) in all {
        assert!(error <= most, "{engine}, {what}: {error:e} at {place}");
    }
}

#[test]
fn reference_matches_golden_walls() {
    check_golden("reference", PlanOptions::default(), REFERENCE, |plan| Box::new(Reference::new(plan)));
}
