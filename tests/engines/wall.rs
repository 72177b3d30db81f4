//! A wall that the tip touches: golden scenes, closed forms, limits, symmetries.
#![allow(non_snake_case)]

use super::common::check::{SMALL_COLUMN, column_error, difference, natural_size, norm, pose_error};
use super::common::day::today;
use super::common::root;
use super::rods::{all_slots, moved, rod_units, wall_slots};
use nalgebra::{DMatrix, Matrix3, Matrix3x2, Rotation3, SMatrix, SymmetricEigen, Vector3};
use rayon::prelude::*;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::second_attempt;
use rodsweep::input::{parse_scene, read_scene};
use rodsweep::model::{
    Axis, BaseWrench, ContactColumn, Matrix, Parameter, Plan, PlanOptions, Quantity, Rigid, Rod, RodField, RodSegment,
    RodWall, Scene, SegmentKind, Side, Slot, Solutions, Status, TipOnWall, Vector, Wall, WallParameter, WallShape,
};
use rodsweep::reference::{
    Equilibrium, Reference, TipContact, energy_of, shape, shape_with_derivatives, solve_rod, stability_at,
};
use rodsweep_bench::judge::{Word, judge};
use rodsweep_bench::random::{Random, RandomScenes};
use rodsweep_bench::verify::{SearchOptions, search_disagreements};
use serde_json::Value;
use std::f64::consts::TAU;
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

/// Held by tissue that its tip presses into. The golden status and least gap count that as the rod in the wall; the force of the tissue is
/// in the model, so the row is a success.
const PRESSES_INTO_TISSUE: &str = "p35-held-tissue";

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
    let presses = value["name"] == PRESSES_INTO_TISSUE;
    let status = if presses { "success" } else { expected["status"].as_str().expect("a status") };
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
            body_gap: if presses { 0.0 } else { read(&contact["body_gap"]) },
            of_pose,
            of_force: read(&derivatives["force"]),
            of_normal_force: read(&derivatives["normal_force"]),
        }
    });
    WallCase {
        parameters: names.iter().map(named).collect(),
        status: status.to_owned(),
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

/// A scene's rod in equilibrium.
fn solved(scene: &Scene, slots: &[Slot]) -> (Rod, Equilibrium, TipContact) {
    let rod = scene.rod();
    let found = solve_rod(&rod, slots);
    assert!(found.status.is_converged(), "{}: {:?} at {}", scene.name, found.status, found.load_fraction);
    let contact = found.contact.expect("a contact");
    (rod, found, contact)
}

/// A scene with another wall.
fn walled(scene: &Scene, change: impl FnOnce(&mut Wall)) -> Scene {
    let mut scene = scene.clone();
    change(scene.wall.as_mut().expect("a wall"));
    scene
}

fn wrench(found: &Equilibrium) -> BaseWrench {
    BaseWrench { moment: found.m0, force: Some(found.n0) }
}

/// The rod without its wall, under the wall's force as a dead one.
fn under_dead_force(rod: &Rod, force: Vector) -> Rod {
    let tip_force = std::array::from_fn(|k| rod.tip_force[k] + force[k]);
    Rod { wall: None, tip_force, field: rod.field.clone().or(Some(RodField::none())), ..rod.clone() }
}

fn negative<const N: usize>(form: SMatrix<f64, N, N>) -> usize {
    let eigen = SymmetricEigen::new(DMatrix::from_column_slice(N, N, form.as_slice()));
    eigen.eigenvalues.iter().filter(|value| **value < 0.0).count()
}

/// How the wall's normal follows a point.
fn curvature(wall: &RodWall, at: Vector) -> Matrix3<f64> {
    let curvature = wall.gap(at).curvature;
    Matrix3::from_fn(|row, col| curvature[row][col])
}

/// Indices under the wall's force as a dead one, of the pinned rod, and of rod and wall, by the tip's compliance C under that force. W8
fn indices_by_dead_force(
    rod: &Rod,
    found: &Equilibrium,
    contact: &TipContact,
    C: Matrix3<f64>,
) -> (usize, usize, usize) {
    let wall = rod.wall.expect("a wall");
    let dead = under_dead_force(rod, contact.force);
    let index_dead = stability_at(&dead, wrench(found)).expect("integrable").index;
    let pinned = index_dead - negative(C);
    let K = C.try_inverse().expect("a regular compliance");
    let n = Vector3::from(contact.normal);
    let pressed = K - contact.normal_force * curvature(&wall, found.p_tip);
    let across = n.cross(&Vector3::ith(n.iamin(), 1.0)).normalize();
    let T = Matrix3x2::from_columns(&[across, n.cross(&across)]);
    let of_wall = match (wall.kind.sticks, wall.compliance) {
        (false, 0.0) => negative(T.transpose() * pressed * T),
        (false, c) => negative(pressed + n * n.transpose() / c),
        (true, 0.0) => 0,
        (true, c) => negative(K + Matrix3::identity() / c),
    };
    (index_dead, pinned, pinned + of_wall)
}

/// A golden scene with other currents, beside a wall of any kind that its tip would go into by up to a seventh of its length, or that holds
/// it up to a fifth away.
fn random_scene(random: &mut Random) -> Scene {
    const NAMES: [&str; 7] =
        ["p6-tilted", "p6-gradient", "p6-held", "p35-side", "two-coil-plane", "tip-coil-plane", "wire-buckled"];
    let mut scene = named(NAMES[(random.bits() % NAMES.len() as u64) as usize]).scene;
    for segment in &mut scene.segments {
        if let SegmentKind::Rigid(Rigid { coil: Some(coil), .. }) = &mut segment.kind {
            coil.current = random.vector(0.3);
        }
    }
    let free = under_dead_force(&scene.rod(), [0.0; 3]);
    let (p, length) = (Vector3::from(solve_rod(&free, &[]).p_tip), free.total_length());
    let n = Vector3::from(random.vector(1.0)).normalize();
    let (depth, radius) = (random.within(-0.02, 0.15) * length, random.within(0.1, 0.6) * length);
    let tip_radius = if random.chance(0.5) { 0.0 } else { 0.015 * length };
    let side = if random.chance(0.5) { Side::Inside } else { Side::Outside };
    let sign = if side == Side::Outside { 1.0 } else { -1.0 };
    // Where the gap of the free tip is -depth along n.
    let centre = p - (sign * radius + tip_radius - depth) * n;
    let axis = n.cross(&Vector3::new(0.3, 0.5, -0.8)).normalize().into();
    let (shape, position) = match random.bits() % 3 {
        0 => (WallShape::Plane { normal: n.into() }, p + (depth - tip_radius) * n),
        1 => (WallShape::Sphere { radius, side }, centre),
        _ => (WallShape::Cylinder { axis, radius, side }, centre),
    };
    let unit = rod_units(&free).force / length;
    let stiffness = random.chance(0.5).then(|| random.between(0.1, 1e4) * unit);
    let tip = match random.chance(0.5) {
        true => TipOnWall::Slides,
        false => TipOnWall::Sticks((p + 0.2 * length * Vector3::from(random.vector(1.0))).into()),
    };
    let (position, rotation) = (position.into(), [0.0; 3]);
    scene.wall = Some(Wall { shape, position, rotation, tip_radius, stiffness, friction: None, tip });
    scene
}

fn bending_stiffness(rod: &Rod) -> f64 {
    match &rod.segments[0] {
        RodSegment::Flexible(segment) => segment.stiffness[0],
        RodSegment::Rigid(_) => panic!("a rigid segment"),
    }
}

#[test]
fn reference_matches_golden_walls() {
    check_golden("reference", PlanOptions::default(), REFERENCE, |plan| Box::new(Reference::new(plan)));
}

/// As fine as a sweep at a tight tolerance, in which no second attempt helps.
const CPU: Tolerance = Tolerance { pose: 1e-9, force: 1e-9, columns: 1e-7, small_column: SMALL_COLUMN, fold: 1e-4 };

#[test]
fn cpu_matches_golden_walls() {
    let options = PlanOptions { steps: 32, tolerance: 1e-11, derivative_tolerance: 1e-8, ..PlanOptions::default() };
    let engine = |plan: &Plan| Cpu::new(plan, Precision::F64).expect("instructions of this machine");
    check_golden("cpu f64", options, CPU, |plan| Box::new(engine(plan)));
}

/// The judge minimises the energy of rod and wall, and follows the minimum while the wall comes.
#[test]
fn engine_reference_and_judge_agree_on_random_walls() {
    let options = SearchOptions::new(RandomScenes::Walls, today(), 120).judge_all(true);
    let found = search_disagreements(&options, &mut |_| {}).expect("engines that solve walls");
    assert!(found.undecided().is_some_and(|undecided| undecided <= 1), "{}", found.text());
}

/// Its free rod is solved by nodes, and the stability of that is not counted where the wall begins. Once such a row was called solved, with
/// its tip behind the wall and no force on it.
#[test]
fn a_limp_rod_behind_its_wall_is_not_called_free() {
    let scene = read_scene(&root().join("tests/data/found/limp-behind-a-wall.toml")).expect("the scene reads");
    let plan = Plan::new(&scene, &[], &[], PlanOptions::default()).expect("a plan");
    let engine = Box::new(Cpu::new(&plan, Precision::F64).expect("instructions of this machine")) as Box<dyn Backend>;
    for mut engine in [engine, second_attempt(&plan).expect("an engine")] {
        let solutions = engine.solve(&plan.batch(1, |_, _| {})).expect("solved");
        let number = |column| solutions.contact(0, column);
        let is_free = number(ContactColumn::Touching) == 0.0 && number(ContactColumn::Gap) < 0.0;
        assert!(!(solutions.status(0).is_success() && is_free), "{}", number(ContactColumn::Gap));
    }
}

/// Rows of a search that are not confirmed yet: the path without care leads where the one with care does, or it leads nowhere.
#[test]
fn bold_paths_lead_to_the_rows_of_careful_ones_or_nowhere() {
    const ROWS: usize = 512;
    for name in ["p6-held", "two-coil-plane", "p6-gradient"] {
        let mut scene = named(name).scene;
        let rod = scene.rod();
        let tip = solve_rod(&under_dead_force(&rod, [0.0; 3]), &[]).p_tip;
        let length = rod.total_length();
        if let Some(wall) = &mut scene.wall {
            wall.tip = TipOnWall::Sticks(tip);
        }
        let axes = Axis::ALL.map(|axis| vec![Parameter::Wall(WallParameter::Anchor(axis))]).to_vec();
        let plan = Plan::new(&scene, &axes, &[], PlanOptions::default()).expect("a plan");
        let mut random = Random(today());
        let near = |away: Vector| -> Vector { std::array::from_fn(|axis| tip[axis] + away[axis]) };
        let anchors: Vec<Vector> = (0..ROWS).map(|_| near(random.vector(0.3 * length))).collect();
        let batch = plan.batch(ROWS, |row, values| values.copy_from_slice(&anchors[row]));
        let solve = |bold: bool| {
            let plan = plan.with_options(PlanOptions { bold, ..plan.options });
            let mut engine = Cpu::new(&plan, Precision::F64).expect("instructions of this machine");
            engine.solve(&batch).expect("solved")
        };
        let (bold, careful) = (solve(true), solve(false));
        let found: Vec<usize> = (0..ROWS).filter(|row| bold.status(*row).is_success()).collect();
        let unsettled = |row: &usize| bold.status(*row) == Status::Pending && careful.status(*row).is_success();
        let missed = (0..ROWS).filter(unsettled).count();
        let is_other = |row: &&usize| {
            let tip = |rows: &Solutions| rows.vector(**row, Quantity::TipPosition);
            let apart = difference(&tip(&bold), &tip(&careful));
            !careful.status(**row).is_success() || apart > 1e-5 * length
        };
        let others = found.iter().filter(is_other).count();
        assert!(100 * others <= found.len(), "{name}: {others} of {} are other equilibria", found.len());
        assert!(3 * missed <= found.len(), "{name}: {missed} were missed, {} found", found.len());
        assert!(found.len() > ROWS / 8, "{name}: {} found", found.len());
    }
}

/// Scenes of random searches on which engine and reference once differed, or agreed on a fold that is none: straight rods whose tip is
/// held; rods that shear, turn far between two stations, dip into the wall or graze it; a long magnet close to another.
#[test]
fn found_scenes_are_solved_alike() {
    let through = ["held-straight-chain", "dips-into-a-wall", "grazes-a-wall"];
    let clear = ["held-straight", "shears-before-a-wall", "turns-before-a-wall", "long-magnet-near-a-magnet"];
    let expected = [(&through[..], Status::ThroughWall), (&clear[..], Status::Ramped)];
    for (name, status) in expected.into_iter().flat_map(|(names, status)| names.iter().map(move |name| (name, status)))
    {
        let scene = read_scene(&root().join(format!("tests/data/found/{name}.toml"))).expect("the scene reads");
        let length = scene.total_length();
        let options = PlanOptions { steps: 32, tolerance: 1e-11, ..PlanOptions::default() };
        let plan = Plan::new(&scene, &[], &[], options).expect("a plan");
        let engine = Box::new(Cpu::new(&plan, Precision::F64).expect("instructions of this machine"));
        let engines = [engine as Box<dyn Backend>, Box::new(Reference::new(&plan))];
        let [found, judged] = engines.map(|mut engine| engine.solve(&plan.batch(1, |_, _| {})).expect("solved"));
        for solutions in [&found, &judged] {
            assert_eq!(solutions.status(0), status, "{name}");
        }
        let position = [&found, &judged].map(|of| of.vector(0, Quantity::TipPosition));
        assert!(difference(&position[0], &position[1]) < 2e-10 * length, "{name}");
        let force = [&found, &judged].map(|of| of.contact_vector(0, ContactColumn::Force));
        assert!(difference(&force[0], &force[1]) < 1e-8 * norm(&force[1]), "{name}");
        let body_gap = [&found, &judged].map(|of| of.contact(0, ContactColumn::BodyGap));
        assert!((body_gap[0] - body_gap[1]).abs() < 1e-4 * body_gap[1].abs() + 1e-7 * length, "{name}: {body_gap:?}");
    }
}

/// A strip with a dipole m at its tip in a field B against it bends aside by an angle psi: EI psi / L = m B (sin psi + tilt cos psi). It is
/// as stable on the other side. A wall that pushes it there presses less and less, and no more where psi is the small root: there the
/// tip jumps, wherever the wall is to come to and however soft it is.
#[test]
fn a_tip_that_leaves_its_wall_has_no_equilibrium() {
    const LENGTH: f64 = 0.06;
    const RIGID: f64 = 0.003;
    const DIPOLE: f64 = 0.3 * RIGID;
    let mut random = Random(today());
    for stiffness in ["", "stiffness = 5.0\n", "stiffness = 0.2\n"] {
        let (bending, tilt) = (2.4e-8 * random.within(0.9, 1.1), random.within(0.02, 0.1));
        let field = random.within(1.4, 1.9) * bending / (LENGTH * DIPOLE);
        let scene = |wall: &str| {
            let text = format!(
                "[field]\nflux_density = [{}, 0, {}]\n[[segment]]\nname = \"strip\"\nkind = \"flexible\"\nlength = {LENGTH}\n\
                 stiffness = {{ bending_x = 4e-7, bending_y = {bending}, torsion = 4e-7 }}\n\
                 [[segment]]\nname = \"tip\"\nkind = \"rigid\"\nlength = {RIGID}\ndipole_per_length = [0, 0, 0.3]\n{wall}",
                tilt * field,
                -field
            );
            parse_scene(Path::new("strip.toml"), &text).expect("the scene reads")
        };
        let tip_at = |from: f64| {
            let ratio = field * DIPOLE * LENGTH / bending;
            let newton = |psi: f64| {
                let slope = ratio * (psi.cos() - tilt * psi.sin()) - 1.0;
                psi - (ratio * (psi.sin() + tilt * psi.cos()) - psi) / slope
            };
            let psi = (0..50).fold(from, |psi, _| newton(psi));
            LENGTH * (1.0 - psi.cos()) / psi + RIGID * psi.sin()
        };
        let (free, jumps) = (tip_at(2.0), tip_at(-0.1));
        let pushed = |by: f64| {
            let at = free - by;
            scene(&format!("[wall]\nkind = \"plane\"\nposition = [{at}, 0, 0]\nnormal = [-1, 0, 0]\n{stiffness}"))
        };
        let design = format!("{stiffness}EI {bending:e}, {field:e} T, tilt {tilt}");
        let found = |by: f64| {
            let scene = pushed(by);
            let plan = Plan::new(&scene, &[], &[], PlanOptions::default()).expect("a plan");
            let engine = Box::new(Cpu::new(&plan, Precision::F64).expect("instructions of this machine"));
            [engine as Box<dyn Backend>, Box::new(Reference::new(&plan))].map(|mut engine| {
                let row = engine.solve(&plan.batch(1, |_, _| {})).expect("solved");
                let way = by * (row.get(0, Quantity::LoadFraction) - 1.0);
                (row.status(0), way, row.contact(0, ContactColumn::NormalForce))
            })
        };
        // The judge's straight elements jump a little before or behind.
        let (way, judged) = (free - jumps, 1.005);
        for by in [1.0002, random.within(1.01, 1.1), 1.3].map(|share| share * way) {
            for (status, at, _) in found(by) {
                assert_eq!(status, Status::Fold, "{design}: {by} of {way}");
                assert!((at / way - 1.0).abs() < 2e-4, "{design}: {at} {way}");
            }
            let word = judge(&pushed(by).rod());
            assert!(by < judged * way || matches!(word, Word::Ends { .. }), "{design}: {by} of {way}, {word:?}");
        }
        let most = found(0.5 * way)[0].2;
        for by in [0.9998, random.within(0.7, 0.99), 0.6].map(|share| share * way) {
            for (status, _, force) in found(by) {
                assert_eq!(status, Status::Ramped, "{design}: {by} of {way}");
                assert!(force > 0.0 && force < most, "{design}: {by} of {way}, {force:e} of {most:e}");
            }
            let word = judge(&pushed(by).rod());
            assert!(judged * by > way || matches!(word, Word::Arrives { .. }), "{design}: {by} of {way}, {word:?}");
        }
    }
}

/// A straight rod whose tip is held a little farther in bears the load under which a column buckles whose end cannot move across, 20.19 EI / L².
#[test]
fn a_straight_rod_whose_tip_is_held_bears_the_load_of_a_column() {
    const BUCKLING: f64 = 20.190_728_556_426_63;
    let column = BUCKLING * 2e-6 / 0.01;
    for (inward, off) in [(1e-5, 1e-4), (1e-4, 1e-3)] {
        let z = 0.1 - inward;
        let text = format!(
            "[[segment]]\nname = \"rod\"\nkind = \"flexible\"\nlength = 0.1\nstiffness = {{ bending = 2e-6, torsion = 1e-6 }}\n\
             [wall]\nkind = \"plane\"\nposition = [0, 0, {z}]\nnormal = [0, 0, -1]\ntip = \"sticks\"\nanchor = [1e-7, 0, {z}]\n"
        );
        let scene = parse_scene(Path::new("held.toml"), &text).expect("the scene reads");
        let plan = Plan::new(&scene, &[], &[], PlanOptions::default()).expect("a plan");
        let engine = second_attempt(&plan).expect("an engine");
        for mut engine in [engine, Box::new(Reference::new(&plan)) as Box<dyn Backend>] {
            let solutions = engine.solve(&plan.batch(1, |_, _| {})).expect("solved");
            assert!(solutions.status(0).is_success(), "{}", solutions.status(0).name());
            let borne = solutions.contact_vector(0, ContactColumn::Force);
            assert!((borne[2] / -column - 1.0).abs() < off, "{borne:?} {column}");
        }
    }
}

/// A rod much longer than l = sqrt(EI / F), which leaves its clamp by an angle phi to the force F, follows tan(psi / 4) = tan(phi / 4) e^(-s / l):
/// so the tip lies at L - 2 l (1 - cos(phi / 2)) along the force and 2 l sin(phi / 2) across, and m0 = 2 sqrt(EI F) sin(phi / 2), to e^(-2 L / l).
#[test]
fn a_tip_that_tissue_pulls_taut_is_told_in_closed_form() {
    const STIFFNESS: f64 = 2e-5;
    const LENGTH: f64 = 0.1;
    let mut random = Random(today());
    for _ in 0..12 {
        let (growth, phi): (f64, f64) = (random.within(13.0, 18.0), random.within(0.1, 1.2));
        let (sin, cos) = (0.5 * phi).sin_cos();
        let around = random.within(0.0, TAU);
        let ell = LENGTH / growth;
        let force = STIFFNESS / ell.powi(2);
        let across = Vector3::new(f64::cos(around), f64::sin(around), 0.0);
        // At the clamp the rod is along z.
        let (pull, aside) =
            (Vector3::z() * phi.cos() + across * phi.sin(), Vector3::z() * phi.sin() - across * phi.cos());
        let tip = pull * (LENGTH - 2.0 * ell * (1.0 - cos)) + aside * (2.0 * ell * sin);
        let yields = random.within(0.05, 0.25) * LENGTH;
        let [x, y, z] = (tip + pull * yields).into();
        let text = format!(
            "[[segment]]\nname = \"rod\"\nkind = \"flexible\"\nlength = {LENGTH}\nstiffness = {{ bending = {STIFFNESS}, torsion = 1.5e-5 }}\n\
             [wall]\nkind = \"plane\"\nposition = [{x}, {y}, {z}]\nnormal = [0, 0, -1]\nstiffness = {}\ntip = \"sticks\"\nanchor = [{x}, {y}, {z}]\n",
            force / yields
        );
        let scene = parse_scene(Path::new("taut.toml"), &text).expect("the scene reads");
        let (_, found, contact) = solved(&scene, &[]);
        let own = 100.0 * (-2.0 * growth).exp();
        let off_tip = (Vector3::from(found.p_tip) - tip).norm() / LENGTH;
        let off_force = (Vector3::from(contact.force) - pull * force).norm();
        let m0 = 2.0 * (STIFFNESS * force).sqrt() * sin;
        let off_moment = (norm(&found.m0) / m0 - 1.0).abs();
        println!(
            "{growth:.1} {phi:.2}: {off_tip:.1e} {:.1e}, {off_moment:.1e}; {:.1e}",
            off_force / force,
            found.error_estimate
        );
        let by_force = contact.force_error / force;
        assert!(off_tip <= found.error_estimate + own, "{text}: {off_tip:e} {:e}", found.error_estimate);
        // By size and angle of the force.
        let by_both = by_force * (0.5 + 0.5 / (0.5 * phi).tan()) + own;
        assert!(off_moment <= by_both, "{text}: {off_moment:e} {by_both:e}");
        assert!(off_force <= contact.force_error + own * force, "{text}: {off_force:e} {by_force:e}");
        assert!(found.error_estimate < 1e-5, "{text}: {:e}", found.error_estimate);
    }
}

/// What a dead force of the same size tells of index and columns: W8, and W12, in which the rod alone has its derivatives.
#[test]
fn a_dead_force_tells_index_and_columns() {
    let (mut worst, mut symmetry, mut count) = (Worst::default(), Worst::default(), 0);
    for case in cases() {
        let Some(expected) = case.solution.as_ref().filter(|solution| solution.touching) else { continue };
        let name = &case.scene.name;
        let mut slots = all_slots(&case.scene.rod());
        // A point that is as far from the base as the tip is not the tip of a rod that becomes longer.
        let last = Slot::Length(case.scene.rod().segments.len() - 1);
        slots.retain(|slot| !matches!(slot, Slot::TipMoment(_)) && *slot != last);
        let (rod, found, contact) = solved(&case.scene, &slots);
        let dead = under_dead_force(&rod, contact.force);
        let length = rod.total_length();
        let by_force = Axis::ALL.map(Slot::TipForce);
        let derivatives = |slots: &[Slot]| {
            let poses = shape_with_derivatives(&dead, wrench(&found), &[length], slots).expect("a pose");
            assert!(difference(&poses[0].position, &found.p_tip) <= 1e-12 * length, "{name}");
            poses[0].derivatives.iter().map(|d| (Vector3::from(d.dp), Vector3::from(d.w))).collect::<Vec<_>>()
        };
        let columns = derivatives(&by_force);
        let C = Matrix3::from_columns(&[0, 1, 2].map(|k| columns[k].0));
        symmetry.take((C - C.transpose()).norm() / C.norm(), || name.clone());
        let wall = rod.wall.expect("a wall");
        let (n, lambda) = (Vector3::from(contact.normal), contact.normal_force);
        let G = curvature(&wall, found.p_tip);
        let (index_dead, index_pinned, index) = indices_by_dead_force(&rod, &found, &contact, C);
        assert_eq!((index_dead, index_pinned), (expected.index_dead, expected.index_pinned), "{name}");
        assert_eq!(index, found.index, "{name}");
        let turned = Matrix3::from_columns(&[0, 1, 2].map(|k| columns[k].1));
        for ((p_t, w_t), (slot, d)) in derivatives(&slots).into_iter().zip(slots.iter().zip(&found.derivatives)) {
            let (dp, df, dlambda);
            if wall.kind.sticks {
                df = -(C + wall.compliance * Matrix3::identity()).try_inverse().expect("regular") * p_t;
                dp = p_t + C * df;
                dlambda = n.dot(&df) + (G * dp).dot(&Vector3::from(contact.force));
            } else {
                let A = (Matrix3::identity() - lambda * C * G).try_inverse().expect("regular");
                let q = A * p_t;
                dlambda = -n.dot(&q) / (n.dot(&(A * C * n)) + wall.compliance);
                dp = q + A * C * n * dlambda;
                df = n * dlambda + lambda * G * dp;
            }
            let dw = w_t + turned * df;
            let place = || format!("{name} {slot:?}");
            let found: [f64; 6] = std::array::from_fn(|k| if k < 3 { d.dp[k] } else { d.w[k - 3] });
            let by_dead: [f64; 6] = std::array::from_fn(|k| if k < 3 { dp[k] } else { dw[k - 3] });
            let small = SMALL_COLUMN / slot.unit(&rod_units(&rod));
            worst.take(column_error(&found, &by_dead, small, length), place);
            let size = df.norm().max(small * rod_units(&rod).force);
            worst.take((Vector3::from(d.df) - df).norm() / size, place);
            worst.take((d.dnormal_force - dlambda).abs() / size, place);
        }
        count += 1;
    }
    println!("columns {:.1e} ({}), asymmetry {:.1e} ({})", worst.0, worst.1, symmetry.0, symmetry.1);
    assert_eq!(count, 24);
    assert!(worst.0 <= 1e-9, "{:e} {}", worst.0, worst.1);
    assert!(symmetry.0 <= 1e-10, "{:e} {}", symmetry.0, symmetry.1);
}

/// The second variation on what the wall allows has as many negative directions as the compliances tell.
#[test]
fn the_index_is_that_of_the_compliances() {
    let mut random = Random(5);
    let scenes: Vec<Scene> = (0..80).map(|_| random_scene(&mut random)).collect();
    let buckled = |scene: &Scene| {
        let rod = scene.rod();
        let found = solve_rod(&rod, &[]);
        let contact = found.contact.filter(|contact| contact.touching && found.status.is_converged())?;
        let length = rod.total_length();
        let dead = under_dead_force(&rod, contact.force);
        let slots = Axis::ALL.map(Slot::TipForce);
        let poses = shape_with_derivatives(&dead, wrench(&found), &[length], &slots).expect("a pose");
        let C = Matrix3::from_columns(&[0, 1, 2].map(|k| Vector3::from(poses[0].derivatives[k].dp)));
        let (index_dead, _, index) = indices_by_dead_force(&rod, &found, &contact, C);
        assert_eq!(index, found.index, "{scene:?}");
        assert!(found.index == 0 && found.margin > 0.0, "{scene:?}");
        let may_pull = rod.wall.expect("a wall").kind.sticks;
        assert!(may_pull || contact.normal_force >= 0.0, "{scene:?}");
        Some(index_dead > 0)
    };
    let found: Vec<bool> = scenes.par_iter().filter_map(buckled).collect();
    let beyond = found.iter().filter(|is_buckled| **is_buckled).count();
    println!("{} touch, {beyond} beyond what a dead force would buckle", found.len());
    assert!(found.len() >= 50 && beyond >= 5, "{} {beyond}", found.len());
}

#[test]
fn energy_and_shape_are_those_of_the_row() {
    for case in cases() {
        let Some(expected) = &case.solution else { continue };
        let name = &case.scene.name;
        let slots = [Slot::Insertion, Slot::WallPosition(Axis::X), Slot::WallTipRadius];
        let (rod, found, _) = solved(&case.scene, &slots);
        let length = rod.total_length();
        let weight: Vector = std::array::from_fn(|k| {
            let of = |segment: &RodSegment| match segment {
                RodSegment::Flexible(flexible) => flexible.length * flexible.load[k],
                RodSegment::Rigid(rigid) => rigid.weight[k],
            };
            rod.tip_force[k] + rod.segments.iter().map(of).sum::<f64>()
        });
        // Of the golden energies, dead loads count from the world's origin.
        let lifted: f64 = (0..3).map(|k| rod.base_position[k] * weight[k]).sum();
        let energy = energy_of(&rod, &found).expect("an energy") - lifted;
        assert!(
            (energy - expected.energy).abs() <= ENERGY * expected.energy.abs(),
            "{name}: {energy} {}",
            expected.energy
        );
        let poses = shape(&rod, &found, &[0.5 * length, length]);
        assert!(difference(&poses[1].position, &found.p_tip) <= 1e-12 * length, "{name}");
        for base in [wrench(&found), found.m0.into()] {
            let moving = shape_with_derivatives(&rod, base, &[0.5 * length, length], &slots).expect("a shape");
            assert!(difference(&moving[0].position, &poses[0].position) <= 1e-11 * length, "{name}");
            for (of_tip, d) in moving[1].derivatives.iter().zip(&found.derivatives) {
                assert!(difference(&of_tip.dp, &d.dp) <= 1e-8 * (1.0 + norm(&d.dp)), "{name}: {of_tip:?} {d:?}");
            }
        }
        let stability = stability_at(&rod, wrench(&found)).expect("integrable");
        assert_eq!(stability.index as f64, expected.index, "{name}");
        assert!((stability.margin / found.margin - 1.0).abs() <= 1e-8, "{name}: {stability:?}");
    }
}

/// 3 EI d / L^3 for a straight wire that is pushed aside by d, up to (d / L)^2.
#[test]
fn a_wire_pushed_aside_is_a_cantilever() {
    let case = named("wire-side");
    let errors = [0.002, 0.001].map(|d| {
        let (rod, _, contact) = solved(&walled(&case.scene, |wall| wall.position[0] = -d), &[]);
        let length = rod.total_length();
        let small = 3.0 * bending_stiffness(&rod) * d / length.powi(3);
        (contact.normal_force / small - 1.0) / (d / length).powi(2)
    });
    println!("{errors:?}");
    assert!(errors.iter().all(|error| (0.1..2.0).contains(&error.abs())), "{errors:?}");
    assert!((errors[0] / errors[1] - 1.0).abs() <= 1e-2, "{errors:?}");
}

/// A straight wire pressed end on buckles at k L = pi / 2 where its tip slides, and at tan(k L) = k L where it is held.
#[test]
fn euler_loads_of_sliding_and_held_tips() {
    let case = named("wire-side");
    let held = 20.190_728_556_426_63;
    let sliding = std::f64::consts::FRAC_PI_2.powi(2);
    for (critical, tip) in [(sliding, TipOnWall::Slides), (held, TipOnWall::Sticks([0.0, 0.0, 0.1]))] {
        let scene = walled(&case.scene, |wall| {
            wall.shape = WallShape::Plane { normal: [0.0, 0.0, -1.0] };
            (wall.position, wall.tip) = ([0.0, 0.0, 0.1], tip);
        });
        let rod = scene.rod();
        let unit = bending_stiffness(&rod) / rod.total_length().powi(2);
        for (share, index) in [(0.5, 0), (0.999, 0), (1.001, 2), (1.2, 2)] {
            let force = [0.0, 0.0, -share * critical * unit];
            let found = stability_at(&rod, BaseWrench { moment: [0.0; 3], force: Some(force) }).expect("integrable");
            assert_eq!(found.index, index, "{tip:?} at {share} of the load");
        }
    }
}

#[test]
fn stiff_tissue_is_rigid_and_soft_tissue_is_nothing() {
    let case = named("p6-tissue");
    let with = |stiffness| solved(&walled(&case.scene, |wall| wall.stiffness = stiffness), &[]);
    let (rod, rigid, force) = with(None);
    let off = [1e5, 1e6].map(|stiffness| {
        let (_, found, contact) = with(Some(stiffness));
        (difference(&found.p_tip, &rigid.p_tip), (contact.normal_force - force.normal_force).abs())
    });
    assert!((off[0].0 / off[1].0 - 10.0).abs() <= 0.01 && (off[0].1 / off[1].1 - 10.0).abs() <= 0.01, "{off:?}");
    let free = solve_rod(&Rod { wall: None, ..rod.clone() }, &[]);
    let gap = rod.wall.expect("a wall").gap(free.p_tip).gap;
    let stiffness = 1e-5;
    let (_, found, contact) = with(Some(stiffness));
    assert!((contact.normal_force / (-gap * stiffness) - 1.0).abs() <= 1e-4, "{contact:?}");
    assert!(difference(&found.p_tip, &free.p_tip) <= 1e-4 * -gap);
}

/// Spheres and cylinders about a far centre, whichever side the rod is on.
#[test]
fn a_large_sphere_is_a_plane() {
    for name in ["p6-end-on", "p6-held"] {
        let scene = named(name).scene;
        let (rod, flat, force) = solved(&scene, &[]);
        let wall = scene.wall.expect("a wall");
        let n = Vector3::from(force.normal);
        let along = n.cross(&Vector3::x()).normalize().into();
        for (side, sign) in [(Side::Outside, -1.0), (Side::Inside, 1.0)] {
            for is_cylinder in [false, true] {
                let off = [100.0, 1000.0].map(|radius| {
                    let position = (Vector3::from(wall.position) + sign * radius * n).into();
                    let shape = match is_cylinder {
                        true => WallShape::Cylinder { axis: along, radius, side },
                        false => WallShape::Sphere { radius, side },
                    };
                    let round = Scene { wall: Some(Wall { shape, position, ..wall }), ..scene.clone() };
                    let (_, found, contact) = solved(&round, &[]);
                    let of_force = difference(&contact.force, &force.force) / norm(&force.force);
                    (difference(&found.p_tip, &flat.p_tip) / rod.total_length()).max(of_force)
                });
                assert!(off[1] <= 1e-3 && (off[0] / off[1] - 10.0).abs() <= 0.1, "{name} {side:?}: {off:?}");
            }
        }
    }
}

/// The force begins at nothing, as the rod's compliance along the normal says.
#[test]
fn a_wall_that_just_touches_changes_nothing() {
    let case = named("p6-end-on");
    let normal = Vector3::from(case.solution.expect("a solution").normal);
    let rod = case.scene.rod();
    let free = solve_rod(&Rod { wall: None, ..rod.clone() }, &Axis::ALL.map(Slot::TipForce));
    let C = Matrix3::from_columns(&[0, 1, 2].map(|k| Vector3::from(free.derivatives[k].dp)));
    for gap in [1e-9, 0.0, -1e-9] {
        let position = (Vector3::from(free.p_tip) - gap * normal).into();
        let (_, found, contact) = solved(&walled(&case.scene, |wall| wall.position = position), &[]);
        let expected = -f64::min(gap, 0.0) / normal.dot(&(C * normal));
        assert!((contact.normal_force - expected).abs() <= 1e-3 * expected + 1e-12, "{gap}: {contact:?}");
        assert!((contact.gap - gap.max(0.0)).abs() <= 1e-15, "{gap}: {contact:?}");
        assert!(gap == 0.0 || contact.touching == (gap < 0.0), "{gap}: {contact:?}");
        assert!(difference(&found.p_tip, &free.p_tip) <= 1e-14 + 100.0 * -gap.min(0.0), "{gap}");
    }
}

/// Reciprocity: what a force at the tip does to the wall's is what a larger ball does to the tip's place.
#[test]
fn responses_are_reciprocal() {
    let mut worst = Worst::default();
    for case in cases() {
        if case.solution.is_none() {
            continue;
        }
        let mut slots = Axis::ALL.map(Slot::TipForce).to_vec();
        slots.push(Slot::WallTipRadius);
        let (_, found, contact) = solved(&case.scene, &slots);
        let n = Vector3::from(contact.normal);
        let by = |k: usize| &found.derivatives[k];
        let C = Matrix3::from_columns(&[0, 1, 2].map(|k| Vector3::from(by(k).dp)));
        let place = || case.scene.name.clone();
        // A rigid hold leaves none.
        if C.norm() > 0.0 && !(case.scene.rod().wall.expect("a wall").kind.sticks) {
            worst.take((C - C.transpose()).norm() / C.norm(), place);
        }
        // The foot of a held tip goes along its own normal.
        let is_flat = matches!(case.scene.wall.expect("a wall").shape, WallShape::Plane { .. });
        if contact.touching && (is_flat || !case.scene.rod().wall.expect("a wall").kind.sticks) {
            for k in 0..3 {
                let (force, place_by) = (n.dot(&Vector3::from(by(k).df)), by(3).dp[k]);
                worst.take((force + place_by).abs() / norm(&by(3).dp), place);
            }
        }
    }
    println!("{:.1e} ({})", worst.0, worst.1);
    assert!(worst.0 <= 1e-10, "{:e} {}", worst.0, worst.1);
}

/// A turn and a shift of base, loads, field and wall.
#[test]
fn everything_moved_together_moves_the_answer() {
    let turn = Rotation3::new(Vector3::new(0.4, -0.7, 1.1));
    let shift = Vector3::new(0.03, 0.2, -0.1);
    let turned = |v: Vector| -> Vector { (turn * Vector3::from(v)).into() };
    let placed = |v: Vector| -> Vector { (turn * Vector3::from(v) + shift).into() };
    for name in ["p35-moved", "p6-vessel", "p6-chamber", "p6-held", "p35-held-tissue", "p6-pulled", "p6-free"] {
        let (rod, before, contact) = solved(&named(name).scene, &[]);
        let mut other = rod.clone();
        other.base_position = placed(rod.base_position);
        let R = turn.matrix() * Matrix3::from_fn(|row, col| rod.base_rotation[row][col]);
        other.base_rotation = std::array::from_fn(|row| std::array::from_fn(|col| R[(row, col)]));
        (other.flux_density, other.tip_force) = (turned(rod.flux_density), turned(rod.tip_force));
        for segment in &mut other.segments {
            match segment {
                RodSegment::Flexible(segment) => segment.load = turned(segment.load),
                RodSegment::Rigid(segment) => segment.weight = turned(segment.weight),
            }
        }
        let wall = other.wall.as_mut().expect("a wall");
        (wall.position, wall.axis) = (placed(wall.position), turned(wall.axis));
        wall.anchor = placed(wall.anchor);
        let after = solve_rod(&other, &[]);
        let moved = after.contact.expect("a contact");
        assert_eq!((after.status, after.index), (before.status, before.index), "{name}");
        let size = norm(&contact.force).max(rod_units(&rod).force);
        assert!(difference(&after.p_tip, &placed(before.p_tip)) <= 1e-11 * rod.total_length(), "{name}");
        assert!(difference(&moved.force, &turned(contact.force)) <= 1e-10 * size, "{name}");
        assert!((moved.body_gap - contact.body_gap).abs() <= 1e-10 * rod.total_length(), "{name}");
        assert!((after.margin / before.margin - 1.0).abs() <= 1e-9, "{name}");
    }
}

/// A flat wall's force may as well be a dead one, which the rod bears from rest by other equations.
#[test]
fn a_flat_wall_is_a_dead_force() {
    let mut count = 0;
    for case in cases() {
        let Some(expected) = &case.solution else { continue };
        let rod = case.scene.rod();
        let is_uniform = case.scene.rod_field().is_none_or(|field| field == RodField::none());
        if expected.index_dead > 0 || !is_uniform {
            continue;
        }
        let (_, found, contact) = solved(&case.scene, &[]);
        let dead = solve_rod(&Rod { field: None, ..under_dead_force(&rod, contact.force) }, &[]);
        let name = &case.scene.name;
        assert!(dead.status.is_success(), "{name}: {:?}", dead.status);
        let error = difference(&dead.p_tip, &found.p_tip) / rod.total_length();
        assert!(error <= 1e-10, "{name}: {error:e}");
        count += 1;
    }
    assert_eq!(count, 17);
}

/// Central differences by every number of wall and rod.
#[test]
fn columns_are_differences() {
    let names = ["p6-tilted", "p6-trabecula", "p6-obstacle", "p6-gradient", "p6-held", "p35-held-tissue", "arm-magnet"];
    let mut worst = Worst::default();
    for (at, name) in names.into_iter().enumerate() {
        let mut rod = named(name).scene.rod();
        // So large that it may become smaller.
        let wall = rod.wall.as_mut().expect("a wall");
        wall.tip_radius = wall.tip_radius.max(5e-4);
        let wall = *wall;
        let mut slots: Vec<Slot> = all_slots(&rod).into_iter().skip(at % 6).step_by(6).collect();
        slots.retain(|slot| !matches!(slot, Slot::TipMoment(_) | Slot::ShearCompliance(..)));
        slots.extend(wall_slots(&wall));
        // A rigid wall's compliance may not become negative.
        slots.retain(|slot| *slot != Slot::WallCompliance || wall.compliance > 0.0);
        let found = solve_rod(&rod, &slots);
        let units = rod_units(&rod);
        let off: Vec<(f64, Slot)> = slots
            .par_iter()
            .zip(&found.derivatives)
            .map(|(slot, d)| {
                let unit = slot.unit(&units);
                let moves = (norm(&d.dp) / units.length).max(norm(&d.w)).max(norm(&d.df) / units.force);
                let most = match slot {
                    Slot::WallTipRadius => 0.2 * wall.tip_radius,
                    Slot::WallCompliance => 0.2 * wall.compliance,
                    _ => f64::INFINITY,
                };
                let h = (1e-3 / moves.max(0.1 / unit)).min(most);
                let at = |steps: f64| solve_rod(&moved(&rod, *slot, steps * h), &[]);
                let [down2, down, up, up2] = [-2.0, -1.0, 1.0, 2.0].map(at);
                let by = |of: &dyn Fn(&Equilibrium) -> f64| {
                    (8.0 * (of(&up) - of(&down)) - of(&up2) + of(&down2)) / (12.0 * h)
                };
                let force = |e: &Equilibrium, k: usize| e.contact.expect("a contact").force[k];
                let dp: Vector = std::array::from_fn(|k| by(&|e| e.p_tip[k]));
                let df: Vector = std::array::from_fn(|k| by(&|e| force(e, k)));
                let dlambda = by(&|e| e.contact.expect("a contact").normal_force);
                let R = |e: &Equilibrium| Matrix3::from_fn(|row, col| e.R_tip[row][col]);
                let dR = Matrix3::from_fn(|row, col| by(&|e| R(e)[(row, col)])) * R(&found).transpose();
                let w = [dR[(2, 1)], dR[(0, 2)], dR[(1, 0)]];
                let error = (difference(&dp, &d.dp) / units.length)
                    .max(difference(&w, &d.w))
                    .max(difference(&df, &d.df) / units.force)
                    .max((dlambda - d.dnormal_force).abs() / units.force);
                (error / moves.max(1e-3 / unit), *slot)
            })
            .collect();
        for (error, slot) in off {
            worst.take(error, || format!("{name} {slot:?}"));
        }
    }
    println!("{:.1e} ({})", worst.0, worst.1);
    assert!(worst.0 <= 1e-6, "{:e} {}", worst.0, worst.1);
}

/// Held next to where it slides to, on the wall, a rod has more energy; held there, it pushes along the normal.
#[test]
fn a_tip_slides_to_the_least_energy() {
    for name in ["p6-end-on", "p6-tilted", "p6-chamber", "p6-obstacle", "p6-vessel", "wire-buckled"] {
        let scene = named(name).scene;
        let (rod, found, contact) = solved(&scene, &[]);
        let least = energy_of(&rod, &found).expect("an energy");
        let n = Vector3::from(contact.normal);
        // The wall at the end itself, not at its ball.
        let tip_radius = scene.wall.expect("a wall").tip_radius;
        let place = Vector3::from(found.p_tip) - tip_radius * n;
        let held = |at: Vector3<f64>| {
            let (rod, found, contact) = solved(&walled(&scene, |wall| wall.tip = TipOnWall::Sticks(at.into())), &[]);
            (energy_of(&rod, &found).expect("an energy"), contact.force)
        };
        let (energy, force) = held(place);
        assert!((energy - least).abs() <= 1e-9 * least.abs(), "{name}: {energy} {least}");
        assert!(difference(&force, &contact.force) <= 1e-7 * rod_units(&rod).force, "{name}");
        let across = n.cross(&Vector3::ith(n.iamin(), 1.0)).normalize();
        let step = 1e-3 * rod.total_length();
        for way in [across, -across, n.cross(&across), -n.cross(&across)] {
            let (energy, _) = held(place + step * way);
            assert!(energy > least, "{name}: {energy} {least}");
        }
    }
}

#[test]
fn walls_without_a_normal_are_bad_parameters() {
    let wire = named("wire-side").scene;
    let vessel = WallShape::Cylinder { axis: [0.0, 0.0, 2.0], radius: 0.01, side: Side::Inside };
    let on_axis = walled(&wire, |wall| (wall.shape, wall.position) = (vessel, [0.0, 0.0, 0.05]));
    assert_eq!(solve_rod(&on_axis.rod(), &[]).status, Status::BadParameter);
    let beside = walled(&on_axis, |wall| wall.position[0] = 0.001);
    assert!(solve_rod(&beside.rod(), &[]).status.is_success());
    let chamber = WallShape::Sphere { radius: 0.04, side: Side::Inside };
    let centre = [0.01, 0.0, 0.08];
    let held_at = |anchor| {
        let tip = TipOnWall::Sticks(anchor);
        let scene = walled(&wire, |wall| (wall.shape, wall.position, wall.tip) = (chamber, centre, tip));
        solve_rod(&scene.rod(), &[]).status
    };
    assert_eq!(held_at(centre), Status::BadParameter);
    assert_eq!(held_at([0.01, 0.0, 0.2]), Status::OutOfReach);
}

/// Beside a wall in a uniform field, rods are solved without it; those that it does not reach keep their rows to the last bit.
#[test]
fn rods_that_a_wall_does_not_touch_keep_their_rows() {
    let scene = named("p6-flat").scene;
    let free = Scene { wall: None, ..scene.clone() };
    let axes: Vec<Vec<Parameter>> = ["coil.current.x", "coil.current.y", "coil.current.z"]
        .map(|name| Parameter::parse(&scene, name).expect("a parameter"))
        .to_vec();
    let wrt = axes.concat();
    let mut random = Random(11);
    let rows: Vec<Vector> = (0..600).map(|_| random.vector(0.3)).collect();
    let solve = |scene: &Scene| {
        let plan = Plan::new(scene, &axes, &wrt, PlanOptions::default()).expect("a plan");
        let batch = plan.batch(rows.len(), |row, values| values.copy_from_slice(&rows[row]));
        Cpu::new(&plan, Precision::F64).expect("instructions of this machine").solve(&batch).expect("solutions")
    };
    let (beside, alone) = (solve(&scene), solve(&free));
    let mut untouched = 0;
    for row in 0..rows.len() {
        if beside.contact(row, ContactColumn::Touching) == 1.0 {
            continue;
        }
        untouched += 1;
        for column in 0..Quantity::COUNT + 18 {
            let (a, b) = (beside.values.get(row, column), alone.values.get(row, column));
            assert_eq!(a.to_bits(), b.to_bits(), "row {row}, column {column}: {a} and {b}");
        }
        assert!(beside.contact(row, ContactColumn::Gap) >= 0.0, "row {row}");
        assert_eq!(beside.force_derivative(row, 0), [0.0; 4], "row {row}");
    }
    assert!((20..580).contains(&untouched), "{untouched} of {} rows", rows.len());
}

/// Where a coming wall makes the rod snap, the engine sees its way turn; the reference halves its steps up to there.
#[test]
fn turns_of_a_coming_wall_are_seen() {
    let mut random = Random(23);
    let (mut seen, mut unseen) = (0, 0);
    let held = |name: &str, far: f64, random: &mut Random| {
        let mut scene = named(name).scene;
        let TipOnWall::Sticks(anchor) = scene.wall.expect("a wall").tip else { panic!("a tip that slides") };
        let moved = std::array::from_fn(|k| anchor[k] + far * random.vector(1.0)[k]);
        scene.wall.as_mut().expect("a wall").tip = TipOnWall::Sticks(moved);
        scene
    };
    let scenes: Vec<Scene> =
        (0..24).map(|k| held(["p6-held-fold", "two-coil-held-fold", "p6-held"][k % 3], 0.004, &mut random)).collect();
    for scene in scenes {
        let options = PlanOptions { steps: 16, ..PlanOptions::default() };
        let plan = Plan::single(&scene, &[], options).expect("a plan");
        let batch = plan.batch(1, |_, _| {});
        let row = Cpu::new(&plan, Precision::F64).expect("instructions of this machine").solve(&batch);
        let row = row.expect("a solution");
        if row.status(0) != Status::Fold {
            continue;
        }
        let (at, error) = (row.get(0, Quantity::LoadFraction), row.get(0, Quantity::LoadFractionError));
        if !row.is_seen_fold(0) {
            unseen += 1;
            continue;
        }
        seen += 1;
        let found = solve_rod(&scene.rod(), &[]);
        assert_eq!(found.status, Status::Fold, "{}: engine at {at}", scene.name);
        let apart = (found.load_fraction - at).abs();
        assert!(error < 1e-6 && apart < 5e-5, "{}: {at} +- {error:e}, reference {}", scene.name, found.load_fraction);
    }
    assert!(seen >= 8 && unseen * 4 <= seen, "{seen} seen, {unseen} not");
}
