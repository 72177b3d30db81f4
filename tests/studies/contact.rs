//! Which force the tip can press where: closed forms, brute force, and answers that hold as they stand.

use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::figures::draw_contact;
use rodsweep::model::{
    Axis, ContactColumn, Parameter, Plan, PlanOptions, Quantity, Solutions, TipOnWall, Vector, WallParameter, WallShape,
};
use rodsweep::results::read_mark;
use rodsweep::spec::SweepSpec;
use rodsweep::study::contact::{
    Answer, Cause, ContactDesign, ContactError, ContactJob, ContactMap, ContactStage, RobustContact,
};
use rodsweep::study::workspace::draw_designs;
use std::cell::Cell;
use std::fs;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

const SAMPLING: &str = "[sampling]\nmethod = \"sobol\"\nsamples = 16\n";

fn axis(name: &str, from: &str, to: &str) -> String {
    format!("[[axis]]\nparameter = \"{name}\"\nfrom = \"{from}\"\nto = \"{to}\"\n")
}

fn spec(text: &str) -> SweepSpec {
    SweepSpec::parse("sweep.toml".as_ref(), text).unwrap_or_else(|error| panic!("{error}"))
}

/// A straight wire beside tissue that begins 2 mm across its way; its base moves.
fn wire(friction: f64) -> SweepSpec {
    let axes = axis("base.position.x", "-1 mm", "1 mm")
        + &axis("base.position.y", "-1 mm", "1 mm")
        + &axis("base.position.z", "-0.06 mm", "0.06 mm");
    let scene = format!(
        "[scene.wall]\nkind = \"plane\"\nposition = [\"2 mm\", 0, 0]\nnormal = [1, 0, 0]\nfriction = {friction}\n\
         stiffness = \"10 N/m\"\n[[scene.segment]]\nname = \"wire\"\nkind = \"flexible\"\nlength = \"100 mm\"\n\
         stiffness = {{ bending = 2e-5, torsion = 1.5e-5 }}\n"
    );
    spec(&format!("{SAMPLING}{axes}[scene]\nname = \"wire\"\n{scene}"))
}

/// P6 in 3 T before a plane, with three currents.
fn p6(friction: &str) -> SweepSpec {
    let currents = ["x", "y", "z"].map(|k| axis(&format!("coil.current.{k}"), "-0.3 A", "0.3 A")).concat();
    let tube = "tube = { inner_radius = \"0.9906 mm\", outer_radius = \"1.5875 mm\" }\nyoungs_modulus = \"5.3948 MPa\"\n\
                shear_modulus = \"2.3881 MPa\"\nlinear_density = \"2.8814e-4 kg/m\"\n";
    let scene = format!(
        "[scene.field]\nflux_density = [0, 3, 0]\n[scene.loads]\ngravity = [0, 0, 9.81]\n\
         [scene.wall]\nkind = \"plane\"\nposition = [0, 0, \"80 mm\"]\nnormal = [0.1, 0, -1]\n{friction}\n\
         [[scene.segment]]\nname = \"proximal\"\nkind = \"flexible\"\nlength = \"57.5 mm\"\n{tube}\
         rest_curvature = [0.74, -0.229, 0]\n\
         [[scene.segment]]\nname = \"coil\"\nkind = \"rigid\"\nlength = \"18.3 mm\"\nmass = \"63 mg\"\n\
         coil = {{ turns = [30, 30, 100], area = [\"46.665 mm^2\", \"46.665 mm^2\", \"11.252 mm^2\"], current = [0, 0, 0] }}\n\
         [[scene.segment]]\nname = \"distal\"\nkind = \"flexible\"\nlength = \"18.5 mm\"\n{tube}"
    );
    spec(&format!("{SAMPLING}{currents}[scene]\nname = \"P6\"\n{scene}"))
}

/// P6 beside a wall across its plane of bending, with three currents.
fn p6_beside(tissue: &str) -> SweepSpec {
    let text = p6(&format!("friction = 0.3\n{tissue}")).to_toml();
    let mut spec = spec(&text);
    let wall = spec.scene.wall.as_mut().expect("a wall");
    wall.position = [0.0, -0.03, 0.0];
    wall.shape = WallShape::Plane { normal: [0.0, 1.0, 0.0] };
    spec
}

/// The rod held at points by inputs, as a plan of its own.
struct Held {
    plan: Plan,
    engine: Cpu,
}

impl Held {
    fn new(map: &ContactMap) -> Held {
        let mut scene = map.scene.clone();
        scene.wall.as_mut().expect("a wall").tip = TipOnWall::Sticks([0.0; 3]);
        let inputs = map.inputs.iter().map(|input| input.parameters.clone());
        let anchors = Axis::ALL.map(|axis| vec![Parameter::Wall(WallParameter::Anchor(axis))]);
        let axes: Vec<Vec<Parameter>> = inputs.chain(anchors).collect();
        let plan = Plan::new(&scene, &axes, &[], PlanOptions { steps: 12, ..PlanOptions::default() }).expect("a plan");
        let engine = Cpu::new(&plan, Precision::F64).expect("an engine");
        Held { plan, engine }
    }

    fn solve(&mut self, rows: &[(Vector, Vec<f64>)]) -> Solutions {
        let batch = self.plan.batch(rows.len(), |row, values| {
            if let Some((place, inputs)) = rows.get(row) {
                values[..inputs.len()].copy_from_slice(inputs);
                values[inputs.len()..].copy_from_slice(place);
            }
        });
        self.engine.solve(&batch).expect("solved")
    }
}

/// Normal force and friction of a row; `None` where it is no success.
fn forces(solutions: &Solutions, row: usize) -> Option<(f64, f64)> {
    let force = solutions.contact(row, ContactColumn::NormalForce);
    let (f, n) =
        (solutions.contact_vector(row, ContactColumn::Force), solutions.contact_vector(row, ContactColumn::Normal));
    let along = (0..3).map(|k| (f[k] - force * n[k]).powi(2)).sum::<f64>().sqrt();
    solutions.status(row).is_success().then_some((force, along))
}

/// Solves all answers of a map again, and checks that they hold.
fn check_answers(map: &ContactMap) -> usize {
    let answers: Vec<(usize, Answer)> = map
        .points
        .iter()
        .enumerate()
        .flat_map(|(at, point)| [point.least, point.most].into_iter().flatten().map(move |answer| (at, answer)))
        .collect();
    let rows: Vec<(Vector, Vec<f64>)> =
        answers.iter().map(|(at, answer)| (map.lattice.points[*at], map.values(answer))).collect();
    let solutions = Held::new(map).solve(&rows);
    for (row, (at, answer)) in answers.iter().enumerate() {
        let (force, along) = forces(&solutions, row).unwrap_or_else(|| panic!("point {at} is no success"));
        assert!((force / answer.force - 1.0).abs() < 1e-3, "point {at}: {force} N, told {}", answer.force);
        assert!((along / force - answer.ratio).abs() < 1e-3, "point {at}");
        assert!(answer.margin >= map.minimum_margin, "point {at}");
        let margin = solutions.get(row, Quantity::StabilityMargin);
        assert!((margin - answer.margin).abs() < 1e-3, "point {at}: margin {margin}, told {}", answer.margin);
        if let (None, Some(friction)) = (map.force, map.friction) {
            assert!(answer.force > 0.0 && answer.ratio <= friction, "point {at}");
        }
        let is_within = |(value, input): (&f64, _)| {
            let input: &rodsweep::study::workspace::WorkspaceInput = input;
            (input.low..=input.high).contains(value)
        };
        assert!(rows[row].1.iter().zip(&map.inputs).all(is_within), "point {at}");
    }
    answers.len()
}

/// The point of a map that is nearest to another.
fn nearest(map: &ContactMap, to: Vector) -> usize {
    let far = |at: &usize| (0..3).map(|k| (map.lattice.points[*at][k] - to[k]).powi(2)).sum::<f64>();
    (0..map.points.len()).min_by(|a, b| far(a).total_cmp(&far(b))).expect("a point")
}

#[test]
fn a_wire_that_is_pushed_aside_presses_as_a_cantilever() {
    let spec = wire(0.01);
    let map = ContactJob::of_sweep(&spec).extent(Some(1e-3)).run().expect("a map");
    assert_eq!(map.lattice.axes.join(" "), "y z");
    let point = map.points[nearest(&map, [2e-3, 0.0, 0.1])];
    let (least, most) = (point.least.expect("a force"), point.most.expect("a force"));
    // 3 EI d/L³ in series with the tissue; relative errors of (d/L)² and of the friction along the wire.
    for (found, d) in [(most.force, 3e-3), (least.force, 1e-3)] {
        let expected = d / (0.1f64.powi(3) / (3.0 * 2e-5) + 0.1);
        assert!((found / expected - 1.0).abs() < 3e-3, "{found} N, expected {expected} N");
    }
    assert!(check_answers(&map) >= 2);
}

/// The best of a grid over three inputs, so many on a side, that is refined about its best row; `value` is larger where better.
fn brute_force(
    map: &ContactMap,
    at: usize,
    (first, fine): (usize, usize),
    value: &dyn Fn(f64, f64) -> Option<f64>,
) -> f64 {
    let mut held = Held::new(map);
    let (mut middle, mut half, mut side) = ([0.0; 3], 1.0, first);
    let mut best = f64::NEG_INFINITY;
    for _ in 0..9 {
        let step = |k: usize, of: usize| -half + 2.0 * half * k as f64 / (of - 1) as f64;
        let scaled = |k: usize| -> [f64; 3] {
            let at = [k % side, k / side % side, k / side / side];
            std::array::from_fn(|axis| (middle[axis] + step(at[axis], side)).clamp(-1.0, 1.0))
        };
        let inputs = |k: usize| map.inputs.iter().zip(scaled(k)).map(|(input, t)| input.value(t)).collect();
        let rows: Vec<(Vector, Vec<f64>)> = (0..side.pow(3)).map(|k| (map.lattice.points[at], inputs(k))).collect();
        let solutions = held.solve(&rows);
        let of = |row: usize| forces(&solutions, row).and_then(|(force, along)| value(force, along));
        let found = (0..rows.len()).filter_map(|row| Some((of(row)?, row))).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((found, row)) = found.filter(|(found, _)| *found >= best) {
            best = found;
            middle = scaled(row);
        }
        half *= 0.4;
        side = fine;
    }
    best
}

#[test]
fn no_grid_of_inputs_finds_more() {
    let spec = wire(0.3);
    let map = ContactJob::of_sweep(&spec).extent(Some(1e-3)).run().expect("a map");
    let along = [[2e-3, 1e-3, 0.1], [2e-3, 0.0, 0.1]].map(|place| nearest(&map, place));
    for at in along {
        let point = map.points[at];
        let holds = |force: f64, along: f64| force > 0.0 && along <= 0.3 * force;
        let most = brute_force(&map, at, (31, 15), &|force, along| holds(force, along).then_some(force));
        let found = point.most.expect("a force").force;
        assert!((found / most - 1.0).abs() < 1e-3, "point {at}: {found} N, a grid finds {most} N");
        let least = -brute_force(&map, at, (31, 15), &|force, along| holds(force, along).then_some(-force));
        let found = point.least.expect("a force").force;
        assert!((found / least - 1.0).abs() < 1e-3, "point {at}: {found} N, a grid finds {least} N");
    }
}

#[test]
fn no_grid_of_currents_finds_more_beside_a_wall() {
    for tissue in ["", "stiffness = \"120 N/m\""] {
        let map = ContactJob::of_sweep(&p6_beside(tissue)).extent(Some(15e-3)).spacing(3e-3).run().expect("a map");
        let reached: Vec<usize> = map.reached().map(|(at, _)| at).collect();
        assert!(reached.len() > 8, "{}", reached.len());
        assert!(check_answers(&map) > 16);
        for at in [reached[reached.len() / 4], reached[3 * reached.len() / 4]] {
            let holds = |force: f64, along: f64| force > 0.0 && along <= 0.3 * force;
            let most = brute_force(&map, at, (15, 7), &|force, along| holds(force, along).then_some(force));
            let found = map.points[at].most.expect("a force").force;
            assert!(found > most * (1.0 - 1e-3), "point {at}: {found} N, a grid finds {most} N");
            let least = -brute_force(&map, at, (15, 7), &|force, along| holds(force, along).then_some(-force));
            // With less force the rod from rest has two equilibria, and the least may lie on the border of either.
            let found = map.points[at].least.expect("a force").force;
            assert!(found < least * (1.0 + 1e-2), "point {at}: {found} N, a grid finds {least} N");
        }
    }
}

#[test]
fn designs_hold_where_their_own_maps_say() {
    let uncertain = "[[uncertain]]\nparameter = \"wall.friction\"\nfrom = 0.1\nto = 0.4\n";
    let sweep = spec(&format!("{uncertain}{}", p6_beside("stiffness = \"120 N/m\"").to_toml()));
    fn of(sweep: &SweepSpec) -> ContactJob<'_> {
        ContactJob::of_sweep(sweep).extent(Some(12e-3)).spacing(4e-3)
    }
    let map = of(&sweep).run().expect("a map");
    let count = 3;
    let robust = of(&sweep).robust(&map, count).expect("designs");
    let drawn = draw_designs(&sweep, &map.scene, count, sweep.workspace.seed).expect("designs");
    let mut expected = vec![0u32; map.points.len()];
    for ((values, scene), design) in drawn.into_iter().zip(&robust.designs) {
        assert_eq!(values, design.values);
        let sweep = SweepSpec { scene, ..sweep.clone() };
        let own = of(&sweep).run().expect("a map");
        own.reached().for_each(|(at, _)| expected[at] += 1);
    }
    let differ: u32 = expected.iter().zip(&robust.counts).map(|(a, b)| a.abs_diff(*b)).sum();
    assert!(differ * 20 <= (count * map.points.len()) as u32, "{differ}: {expected:?}, {:?}", robust.counts);
    assert!(robust.counts.contains(&(count as u32)) && robust.counts.contains(&0));
    let table = map.table(Some(&robust));
    assert!(table.column("hold.probability").is_some() && table.row_count() == map.points.len());
}

/// Few points of the wall beside P6, for several tests.
fn few_points(spec: &SweepSpec) -> ContactJob<'_> {
    ContactJob::of_sweep(spec).extent(Some(8e-3)).spacing(4e-3)
}

fn map_of_few_points() -> &'static ContactMap {
    static MAP: OnceLock<ContactMap> = OnceLock::new();
    MAP.get_or_init(|| few_points(&p6("friction = 0.3")).run().expect("a map"))
}

#[test]
fn answers_hold_as_they_stand_and_are_the_same_again() {
    let map = map_of_few_points();
    assert_eq!(map.points.len(), 25);
    assert!(check_answers(map) > 20);
    assert_eq!(few_points(&p6("friction = 0.3")).run().expect("a map").points, map.points);
}

#[test]
fn the_least_friction_at_a_force() {
    let spec = p6("friction = 0.3");
    let (range, job) = (map_of_few_points(), few_points(&spec));
    // With the most force of a point, which 0.3 holds there.
    let at = nearest(range, [0.0, 0.0, 0.08]);
    let most = range.points[at].most.expect("a force");
    let map = job.force(Some(most.force)).run().expect("a map");
    assert!(check_answers(&map) == map.reached().count());
    for (at, answer) in map.reached() {
        assert!((answer.force / most.force - 1.0).abs() <= 1e-4, "point {at}: {} N", answer.force);
    }
    let least = map.points[at].most.expect("an answer");
    assert!(least.ratio < 1.01 * most.ratio.max(0.3), "{least:?}, {most:?}");
}

#[test]
fn causes_are_told_and_mistakes_refused() {
    let spec = p6("friction = 0.3");
    let map = ContactJob::of_sweep(&spec).spacing(16e-3).run().expect("a map");
    assert!(map.points.iter().any(|point| point.cause == Cause::Reached));
    assert!(map.points.iter().any(|point| point.cause != Cause::Reached));
    let account = map.account(None);
    assert_eq!(account.causes.iter().map(|(_, count)| count).sum::<usize>(), map.points.len());
    assert_eq!(map.table(None).row_count(), map.points.len());
    let strict = ContactJob::of_sweep(&spec).spacing(16e-3).minimum_margin(0.9).run().expect("a map");
    assert!(strict.area() <= map.area());
    assert!(strict.reached().all(|(_, answer)| answer.margin >= 0.9));
    let refused = |job: ContactJob| job.run().expect_err("refused").to_string();
    assert!(refused(ContactJob::of_sweep(&spec).spacing(1e-6)).contains("take"));
    let job = ContactJob::of_sweep(&p6("")).run();
    assert!(matches!(job, Err(ContactError::NoFriction { .. })));
}

#[test]
fn a_raised_flag_ends_a_job_at_once() {
    let spec = wire(0.1);
    let (flag, told) = (AtomicBool::new(true), Cell::new(0));
    let count = |_: ContactStage| told.set(told.get() + 1);
    let job = ContactJob::of_sweep(&spec).extent(Some(2e-3)).interrupt(&flag).progress(Some(&count));
    assert!(matches!(job.run(), Err(ContactError::Interrupted)));
    assert_eq!(told.get(), 0, "not even the first batch is solved");
    // Raised on the way: no batch follows.
    flag.store(false, Ordering::Relaxed);
    let raise = |_: ContactStage| {
        told.set(told.get() + 1);
        flag.store(told.get() >= 3, Ordering::Relaxed);
    };
    let job = job.progress(Some(&raise));
    assert!(matches!(job.run(), Err(ContactError::Interrupted)));
    assert_eq!(told.get(), 3);
}

#[test]
fn answers_are_checked_against_the_reference() {
    let spec = wire(0.1);
    let mut map = ContactJob::of_sweep(&spec).extent(Some(2e-3)).run().expect("a map");
    let answers = map.points.iter().flat_map(|point| [point.most, point.least]).flatten().count();
    assert!(map.check.of > map.reached().count() && map.check.of <= answers, "{:?}", map.check);
    assert_eq!((map.check.checked, map.check.wrong), (map.check.of.min(64), 0), "{:?}", map.check);
    assert!(map.check.farthest_force.is_some_and(|most| most < 1e-6), "{:?}", map.check);
    let account = map.account(None);
    assert!(account.text().contains("equilibria were checked against the reference"), "{}", account.text());
    assert!(account.distrusted.is_none() && account.json().contains("\"farthest_force\""));
    // The doubt about answers stands in words and in every file.
    map.check.mark = Some("DISTRUSTED: 1 of 64 equilibria".into());
    let designs = vec![ContactDesign { values: vec![1.0], area: 0.0 }];
    let robust = RobustContact { names: vec!["factor".into()], designs, counts: vec![1; map.points.len()], solves: 0 };
    let account = map.account(Some(&robust));
    assert!(account.headline().starts_with("DISTRUSTED: 1 of 64 equilibria; the tip can press on "));
    assert!(account.text().starts_with("DISTRUSTED: 1 of 64 equilibria\nthe tip can press on "), "{}", account.text());
    assert!(account.text().contains("; not checked against the reference"), "{}", account.text());
    let folder = tempfile::tempdir().expect("a folder");
    map.write(folder.path(), &account, Some(&robust)).expect("files");
    assert!(draw_contact(&map, Some(&robust), folder.path()).expect("figures").len() > 3);
    let mark = read_mark(&folder.path().join("contact.parquet")).expect("a file");
    assert_eq!(mark.as_deref(), Some("DISTRUSTED: 1 of 64 equilibria"));
    for name in ["contact.json", "robust_designs.csv", "force.svg", "angle.svg"] {
        let text = fs::read_to_string(folder.path().join(name)).expect("a file");
        assert!(text.contains("DISTRUSTED: 1 of 64"), "{name}");
    }
}
