//! The baselines converge to the reference with their own order, their Jacobians too.

#![allow(non_snake_case)]

use crate::common::root;
use crate::common::scenes::{catheter, parameters};
use rodsweep::backend::Backend;
use rodsweep::input::read_scene;
use rodsweep::model::{
    Parameter, Plan, PlanOptions, Quantity, Scene, SegmentKind, SegmentParameter, Solutions, Vector,
};
use rodsweep::reference::Reference;
use rodsweep_bench::baseline::{
    Adaptive, BaselineError, Chain, Differences, Input, Jacobian, Method, Paper, Rod, Scheme, control_step, from_rest,
    solve,
};
use rodsweep_bench::random::Random;

/// A random configuration with its answer.
struct Case {
    name: String,
    rod: Rod,
    inputs: Vec<Input>,
    truth: Solutions,
}

fn shipped(name: &str) -> Scene {
    let path = root().join("sweeps/scenes").join(name);
    read_scene(&path).expect("a shipped scene")
}

fn inputs_of(scene: &Scene) -> Vec<Parameter> {
    let is_current = |p: &Parameter| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_)));
    let mut inputs: Vec<Parameter> = Parameter::all(scene).into_iter().filter(is_current).collect();
    inputs.push(Parameter::Insertion);
    inputs
}

/// What else Jacobians are taken by: forces, rest curvature and stiffness of the first and the last segment.
fn others_of(scene: &Scene) -> Vec<Parameter> {
    let mut others = parameters(scene, &["loads.tip_force", "proximal.rest_curvature", "distal.rest_curvature"]);
    let is_modulus = |p: &Parameter| p.name(scene).ends_with("s_modulus") || p.name(scene).ends_with("r_modulus");
    others.extend(Parameter::all(scene).into_iter().filter(is_modulus));
    others
}

/// What the Jacobians of the cases are taken by.
#[derive(Clone, Copy, PartialEq)]
enum By {
    /// What a controller sets.
    Inputs,
    Everything,
}

/// Random currents, insertions and tip forces on four scenes: with weight, without, in a tilted pose, with two coils.
fn cases(by: By) -> Vec<Case> {
    let mut random = Random(31);
    let mut cases = Vec::new();
    for (scene, current, force) in [
        (shipped("p6.toml"), 0.3, 2e-4),
        (shipped("p35.toml"), 0.2, 5e-4),
        (catheter(), 2e-3, 2e-6),
        (shipped("two_coil.toml"), 0.1, 2e-4),
    ] {
        for k in 0..3 {
            let mut scene = scene.clone();
            let wrt = inputs_of(&scene);
            let insertion = scene.total_length() * random.within(0.9, 1.1);
            for parameter in &wrt {
                let value =
                    if *parameter == Parameter::Insertion { insertion } else { random.within(-current, current) };
                parameter.set(&mut scene, value).expect("an input");
            }
            scene.loads.tip_force = Some(random.vector(force));
            let wrt = if by == By::Everything { [wrt, others_of(&scene)].concat() } else { wrt };
            let plan = Plan::single(&scene, &wrt, PlanOptions::default()).expect("a plan");
            let truth = Reference::new(&plan).solve(&plan.batch(1, |_, _| {})).expect("the reference");
            assert!(truth.status(0).is_success(), "{} {k}: {:?}", scene.name, truth.status(0));
            let inputs = wrt.iter().map(|p| Input::new(*p, &scene).expect("an input")).collect();
            let rod = Rod::new(&scene).expect("a rod");
            cases.push(Case { name: format!("{} {k}", scene.name), rod, inputs, truth });
        }
    }
    cases
}

/// Errors of the tip (position over length, or directors) and of the worst column, relative.
fn errors(case: &Case, jacobian: &Jacobian) -> [f64; 2] {
    let length = case.rod.length();
    let distance = |a: Vector, b: Vector| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let R = case.truth.tip_rotation(0);
    let rotation = (0..3).map(|row| distance(jacobian.tip.R[row], R[row])).fold(0.0, f64::max);
    let tip = (distance(jacobian.tip.p, case.truth.vector(0, Quantity::TipPosition)) / length).max(rotation);
    let mut worst = 0.0f64;
    for (k, column) in jacobian.columns.iter().enumerate() {
        let rows: [f64; 6] = std::array::from_fn(|row| case.truth.derivative(0, k, row));
        let scale = |row: usize| if row < 3 { length } else { 1.0 };
        let found: Vec<f64> = column.dp.iter().chain(&column.w).copied().collect();
        let norm = |of: &dyn Fn(usize) -> f64| (0..6).map(|row| (of(row) / scale(row)).powi(2)).sum::<f64>().sqrt();
        // A current along the tangent does next to nothing: small columns are measured against their natural size.
        let size = norm(&|row| rows[row]).max(1e-3 / case.rod.scale(&case.inputs[k]));
        worst = worst.max(norm(&|row| found[row] - rows[row]) / size);
    }
    [tip, worst]
}

fn largest(cases: &[Case], make: &dyn Fn(&Rod) -> Box<dyn Method>) -> [f64; 2] {
    cases.iter().fold([0.0; 2], |largest, case| {
        let method = make(&case.rod);
        let unknowns = from_rest(&*method, &case.rod).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let jacobian = method.jacobian(&case.rod, &unknowns, &case.inputs).expect("a Jacobian");
        let errors = errors(case, &jacobian);
        assert!(errors.iter().all(|e| *e < 0.3), "{}: {errors:?} is another branch", case.name);
        [largest[0].max(errors[0]), largest[1].max(errors[1])]
    })
}

/// Largest errors at growing resolutions.
fn convergence(by: By, make: &dyn Fn(&Rod, usize) -> Box<dyn Method>, sizes: &[usize]) -> Vec<[f64; 2]> {
    let cases = cases(by);
    let errors: Vec<[f64; 2]> = sizes.iter().map(|size| largest(&cases, &|rod| make(rod, *size))).collect();
    println!("{sizes:?}: {errors:?}");
    errors
}

#[test]
fn the_papers_form_is_of_fourth_order() {
    let errors = convergence(By::Everything, &|rod, steps| Box::new(Paper::new(rod, steps)), &[32, 64, 128, 256, 1024]);
    for what in [0, 1] {
        for pair in errors[1..4].windows(2) {
            let ratio = pair[0][what] / pair[1][what];
            assert!((11.0..24.0).contains(&ratio), "halving the step divides the error by {ratio}");
        }
        assert!(errors[4][what] < 1e-9, "{:?}", errors[4]);
    }
}

#[test]
fn the_chain_is_of_second_order() {
    let errors = convergence(By::Inputs, &|rod, joints| Box::new(Chain::new(rod, joints)), &[8, 16, 32, 64]);
    for what in [0, 1] {
        for pair in errors.windows(2) {
            let ratio = pair[0][what] / pair[1][what];
            assert!((2.8..5.6).contains(&ratio), "twice the links divide the error by {ratio}");
        }
        let ratio = errors[1][what] / errors[3][what];
        assert!((13.0..20.0).contains(&ratio), "four times the links divide the error by {ratio}");
    }
}

/// The tolerance is that of a step, against the mean of all numbers that are integrated; what it leaves at the tip follows
/// it down to round-off. Weak columns, measured against their own size, keep a thousand times as much.
#[test]
fn the_adaptive_crate_follows_its_tolerance() {
    let digits = [4, 6, 8, 10, 12];
    let make = |_: &Rod, digits: usize| -> Box<dyn Method> { Box::new(Adaptive::new(0.1f64.powi(digits as i32))) };
    let errors = convergence(By::Everything, &make, &digits);
    for (errors, digits) in errors.iter().zip(digits) {
        let tolerance = 0.1f64.powi(digits as i32);
        assert!(errors[0] < 5.0 * tolerance, "to {tolerance:e}: tip {:e}", errors[0]);
        assert!(errors[1] < 2e3 * tolerance, "to {tolerance:e}: column {:e}", errors[1]);
    }
    for what in [0, 1] {
        let gain = errors[0][what] / errors[4][what];
        assert!(gain > 1e5, "eight more digits asked for, only {gain:.0e} times better");
    }
}

#[test]
fn differences_err_by_their_step_until_round_off() {
    let cases = cases(By::Inputs);
    let error = |scheme, step| largest(&cases, &|rod| Box::new(Differences::with_step(rod, 512, scheme, step)))[1];
    for (scheme, order, step) in
        [(Scheme::Forward, 1, 1e-3), (Scheme::Central, 2, 1e-2), (Scheme::Integrations, 1, 1e-3)]
    {
        let (coarse, fine) = (error(scheme, step), error(scheme, 0.1 * step));
        let expected = 10f64.powi(order);
        println!("{scheme:?}: {coarse:.2e} {fine:.2e}");
        let ratio = coarse / fine;
        assert!((0.7 * expected..1.4 * expected).contains(&ratio), "{scheme:?}: {coarse} / {fine} = {ratio}");
    }
}

#[test]
fn differences_agree_with_the_reference() {
    let cases = cases(By::Inputs);
    for (scheme, limit) in [(Scheme::Forward, 1e-5), (Scheme::Central, 1e-7), (Scheme::Integrations, 1e-5)] {
        let [tip, column] = largest(&cases, &|rod| Box::new(Differences::new(rod, 512, scheme)));
        println!("{scheme:?}: tip {tip:.2e}, column {column:.2e}");
        assert!(tip < 1e-9 && column < limit, "{scheme:?}: tip {tip}, column {column}");
    }
}

#[test]
fn control_reaches_its_target() {
    for case in cases(By::Inputs) {
        let methods: [Box<dyn Method>; 4] = [
            Box::new(Paper::new(&case.rod, 64)),
            Box::new(Adaptive::new(1e-8)),
            Box::new(Differences::new(&case.rod, 64, Scheme::Forward)),
            Box::new(Chain::new(&case.rod, 16)),
        ];
        for method in methods {
            let mut unknowns = from_rest(&*method, &case.rod).expect("an equilibrium");
            let mut rod = case.rod.clone();
            // A target that can be reached: where slightly other inputs lead.
            let aim =
                case.inputs.iter().fold(rod.clone(), |rod, input| rod.moved(input, 0.005 * case.rod.scale(input)));
            let there = solve(&*method, &aim, &unknowns).unwrap_or_else(|| panic!("{}", case.name));
            let target = method.tip(&aim, &there).p;
            let miss = |rod: &Rod, unknowns: &[f64]| -> Vector {
                let p = method.tip(rod, unknowns).p;
                std::array::from_fn(|k| target[k] - p[k])
            };
            let size = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let start = size(miss(&rod, &unknowns));
            for _ in 0..30 {
                let error = miss(&rod, &unknowns);
                let step = control_step(&*method, &rod, &unknowns, &case.inputs, error).expect("a step");
                (rod, unknowns) = (step.rod, step.unknowns);
            }
            let end = size(miss(&rod, &unknowns));
            assert!(end < 0.05 * start, "{}: {start} m to {end} m", case.name);
        }
    }
}

#[test]
fn segments_of_no_length_change_nothing() {
    let whole = catheter();
    let mut more = whole.clone();
    more.segments.push(rodsweep::model::Segment { name: "nothing".into(), length: 0.0, ..whole.segments[2].clone() });
    let tip = |scene: &Scene| {
        let rod = Rod::new(scene).expect("a rod");
        let methods: [Box<dyn Method>; 3] =
            [Box::new(Paper::new(&rod, 64)), Box::new(Adaptive::new(1e-10)), Box::new(Chain::new(&rod, 16))];
        methods.map(|method| method.tip(&rod, &from_rest(&*method, &rod).expect("an equilibrium")).p)
    };
    for (a, b) in tip(&whole).iter().flatten().zip(tip(&more).iter().flatten()) {
        assert!((a - b).abs() < 1e-12, "{a} m or {b} m");
    }
    let bare = Scene {
        segments: whole.segments.into_iter().map(|s| rodsweep::model::Segment { length: 0.0, ..s }).collect(),
        ..more
    };
    assert!(Rod::new(&bare).is_err());
}

fn key(scene: &Scene) -> String {
    match Rod::new(scene) {
        Err(BaselineError::Unsupported { key, remedy }) => {
            assert!(!remedy.is_empty());
            key
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_not_modelled_is_refused() {
    let changed = |change: &dyn Fn(&mut Scene)| {
        let mut scene = catheter();
        change(&mut scene);
        key(&scene)
    };
    let set = |name: &'static str, value: f64| {
        move |scene: &mut Scene| parameters(scene, &[name])[0].set(scene, value).expect("a parameter")
    };
    assert_eq!(changed(&|scene| scene.loads.tip_moment = Some([1e-5, 0.0, 0.0])), "loads.tip_moment");
    assert_eq!(changed(&|scene| scene.rigid_force_arm = false), "model.rigid_force_arm = false");
    assert_eq!(changed(&|scene| scene.segments.remove(0).length = 0.0), "coil");
    let flexible = |change: &dyn Fn(&mut rodsweep::model::Flexible)| {
        changed(&|scene| match &mut scene.segments[2].kind {
            SegmentKind::Flexible(flexible) => change(flexible),
            SegmentKind::Rigid(_) => unreachable!("the distal segment is flexible"),
        })
    };
    assert_eq!(flexible(&|f| f.dipole_per_length = Some([0.0, 0.0, 0.1])), "distal.dipole_per_length");
    assert!(flexible(&|f| f.stiffness_shear = Some([1.0, 1.0])).contains("distal.stiffness_shear"));
    let nodes = |n: f64| rodsweep::model::Node { at: n, value: [n, 0.0, 0.0] };
    let profile = rodsweep::model::Profile::Nodes(vec![nodes(0.0), nodes(0.033)]);
    assert!(flexible(&|f| f.rest_curvature = profile.clone()).contains("distal.rest_curvature"));
    // Scenes that are no rod keep their own error, and inputs that are no inputs are named.
    let mut scene = catheter();
    set("field.flux_density.x", f64::NAN)(&mut scene);
    assert!(matches!(Rod::new(&scene), Err(BaselineError::Scene(_))));
    let scene = catheter();
    let error = Input::new(parameters(&scene, &["field.flux_density.x"])[0], &scene).expect_err("no input");
    assert!(error.to_string().contains("field.flux_density.x"), "{error}");
    let overloaded = Scene { flux_density: [0.0, 0.0, 1e50], ..scene };
    let rod = Rod::new(&overloaded).expect("a rod");
    assert!(matches!(from_rest(&Paper::new(&rod, 16), &rod), Err(BaselineError::NotConverged { .. })));
}
