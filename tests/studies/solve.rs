//! One scene through the library: numbers against the reference, what has no answer, and what goes wrong.

use crate::common::root;
use rodsweep::backend::{Backend, BackendError, BackendKind};
use rodsweep::engines::EngineRequest;
use rodsweep::input::{assign, parse_scene, read_scene};
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Status};
use rodsweep::reference::Reference;
use rodsweep::study::{Solve, SolveError, Solved};
use rodsweep::{figures, model};

const SCENE: &str = r#"name = "test"
[field]
flux_density = [0, "3 T", 0]
[[segment]]
name = "tube"
kind = "flexible"
length = "80 mm"
tube = { inner_radius = "0.5 mm", outer_radius = "1 mm" }
youngs_modulus = "5 MPa"
shear_modulus = "2 MPa"
rest_curvature = [0, 0, 0]
[[segment]]
name = "coil"
kind = "rigid"
length = "13 mm"
mass = "58 mg"
coil = { turns = [30, 30, 100], area = ["4.67 mm^2", "4.67 mm^2", "1.13 mm^2"], current = [0, 0, 0] }
"#;

fn scene(assignments: &[&str]) -> Scene {
    let mut scene = parse_scene("test.toml".as_ref(), SCENE).expect("a scene");
    assign(&mut scene, assignments).expect("known parameters");
    scene
}

fn solved(assignments: &[&str]) -> Solved {
    Solve::new(scene(assignments)).run().expect("an answer")
}

/// Too much load: the path from rest ends before it.
fn overloaded() -> Solved {
    solved(&["loads.tip_force.z=-3", "coil.current.x=5"])
}

fn assert_close(found: f64, expected: f64, size: f64) {
    assert!((found - expected).abs() <= 1e-8 * size.max(expected.abs()), "{found} {expected}");
}

#[test]
fn numbers_are_those_of_the_reference() {
    let scene = scene(&["coil.current.z=0.1"]);
    let wrt = [Parameter::parse(&scene, "coil.current").expect("a group"), vec![Parameter::Insertion]].concat();
    let plan = Plan::single(&scene, &wrt, PlanOptions::default()).expect("a plan");
    let truth = Reference::new(&plan).solve(&plan.batch(1, |_, _| {})).expect("solutions");
    let solved = Solve::new(scene.clone()).wrt(&["coil.current", " insertion", ""]).run().expect("an answer");
    assert!(solved.is_equilibrium() && solved.is_converged() && solved.is_stable());
    assert!(solved.status().is_success() && truth.status(0).is_success());
    assert_eq!((solved.stability_index(), solved.load_fraction()), (Some(0), 1.0));
    let jacobian = solved.jacobian();
    assert_eq!(jacobian.names(), wrt.iter().map(|parameter| parameter.name(&scene)).collect::<Vec<_>>());
    assert_eq!((jacobian.units(), jacobian.len()), (vec!["A", "A", "A", "m"], 4));
    let rod = solved.rod();
    for row in 0..3 {
        assert_close(solved.tip_position()[row], truth.vector(0, Quantity::TipPosition)[row], 0.1);
        assert_close(solved.base_moment()[row], truth.vector(0, Quantity::BaseMoment)[row], 1e-3);
        for column in 0..3 {
            assert_close(solved.tip_rotation()[row][column], truth.tip_rotation(0)[row][column], 1.0);
        }
        for k in 0..wrt.len() {
            assert_close(jacobian.position()[row][k], truth.derivative(0, k, row), 0.1);
            assert_close(jacobian.rotation()[row][k], truth.derivative(0, k, 3 + row), 1.0);
            assert_close(jacobian.base_moment()[row][k], truth.derivative(0, k, 6 + row), 1e-3);
        }
    }
    assert_eq!(solved.base_curvature(), model::base_curvature(&rod, solved.base_moment()));
    assert!(solved.error_estimate() <= 1e-9 && solved.residual() >= 0.0 && solved.iterations() > 0);
    let norm: f64 = solved.tip_quaternion().iter().map(|x| x * x).sum();
    assert_close(norm, 1.0, 1.0);
}

#[test]
fn derivatives_by_default_and_none() {
    let expected = ["coil.current.x", "coil.current.y", "coil.current.z", "insertion"];
    let forces = ["loads.tip_force.x", "loads.tip_force.y", "loads.tip_force.z"];
    assert_eq!(solved(&[]).jacobian().names(), [&expected[..], &forces].concat());
    let bare = Solve::new(scene(&[])).without_derivatives().run().expect("an answer");
    assert!(bare.jacobian().is_empty() && bare.jacobian().position()[0].is_empty());
}

#[test]
fn engines_agree() {
    for backend in [BackendKind::Cpu, BackendKind::Reference] {
        let task = Solve::new(scene(&["coil.current.z=0.1"])).engine(EngineRequest::of(backend));
        let solved = task.run().expect("an answer");
        assert!(solved.engine().starts_with(backend.name()), "{}", solved.engine());
        assert_close(solved.tip_position()[2], self::solved(&["coil.current.z=0.1"]).tip_position()[2], 0.1);
    }
}

#[test]
fn points_along_the_rod() {
    let solved = solved(&["coil.current.z=0.1"]);
    let shape = solved.evenly(5).expect("a shape");
    assert_eq!(shape.arc_lengths().len(), 5);
    assert_close(shape.arc_lengths()[4], 0.093, 0.1);
    assert_eq!((shape.positions()[0], shape.names().len()), ([0.0; 3], 7));
    for row in 0..3 {
        assert_close(shape.positions()[4][row], solved.tip_position()[row], 0.1);
        // By the currents.
        for k in 0..3 {
            assert_close(shape.position_jacobian()[4][row][k], solved.jacobian().position()[row][k], 0.1);
            assert_close(shape.rotation_jacobian()[4][row][k], solved.jacobian().rotation()[row][k], 1.0);
        }
    }
    // In the order asked for.
    let some = solved.shape(&[0.09, 0.01]).expect("a shape");
    assert_eq!(some.points().iter().map(|point| point.curvature == [0.0; 3]).collect::<Vec<_>>(), [true, false]);
    assert_eq!(solved.evenly(1), Err(SolveError::TooFewPoints { count: 1 }));
    for wrong in [-0.01, 0.2, f64::NAN] {
        assert!(matches!(solved.shape(&[wrong]), Err(SolveError::OffTheRod { .. })), "{wrong}");
    }
}

#[test]
fn a_rod_without_equilibrium_has_no_numbers() {
    let solved = overloaded();
    assert!(!solved.is_equilibrium() && !solved.is_converged() && !solved.is_stable());
    assert!(solved.load_fraction() < 1.0 && solved.stability_index().is_none());
    let vectors = [solved.tip_position(), solved.tip_curvature(), solved.base_moment(), solved.base_curvature()];
    assert!(vectors.iter().flatten().chain(solved.tip_rotation().as_flattened()).all(|x| x.is_nan()));
    assert!(solved.jacobian().position().iter().flatten().all(|x| x.is_nan()));
    assert_eq!(solved.jacobian().residual(), None);
    assert_eq!(solved.evenly(3), Err(SolveError::NoEquilibrium { status: solved.status() }));
    assert!(solved.to_json()["tip"].is_null() && solved.to_string().contains("no equilibrium"));
    assert_ne!(figures::rod_shape(&solved).expect_err("nothing to draw").status, Status::Ok);
}

#[test]
fn the_equilibrium_from_rest_is_among_all() {
    let solved = solved(&["coil.current.z=0.1"]);
    let all = solved.all_branches().expect("equilibria");
    assert!(all.is_balanced() && all.search_count() > 0);
    let from_rest: Vec<_> = all.branches().iter().filter(|branch| branch.is_from_rest()).collect();
    assert_eq!(from_rest.len(), 1);
    assert_eq!(from_rest[0].solved().tip_position(), solved.tip_position());
    assert!(from_rest[0].energy().is_some());
    let reference = Solve::new(scene(&[])).engine(EngineRequest::of(BackendKind::Reference)).run().expect("an answer");
    let refused = reference.all_branches().expect_err("no search");
    assert!(matches!(refused, SolveError::Backend(BackendError::Unsupported { .. })) && refused.is_usage());
}

/// Base moments do not tell the equilibria of a limp rod: the search says so.
#[test]
fn a_limp_rod_is_not_searched() {
    let limp = ["loads.tip_force.x=0.5", "loads.tip_force.z=5"];
    let solved = solved(&limp);
    assert!(solved.is_stable() && solved.rod().growth() > 12.0, "{}", solved.rod().growth());
    let refused = solved.all_branches().expect_err("no search");
    assert!(matches!(refused, SolveError::Backend(BackendError::Unsupported { .. })) && refused.is_usage());
    assert!(refused.to_string().contains("base moments do not tell equilibria apart"), "{refused}");
}

#[test]
fn a_plan_is_explained() {
    let solved = solved(&[]);
    let plan = solved.explain().expect("a plan");
    assert_eq!((plan.derivative_count, plan.pieces.len(), plan.passes.len()), (7, 2, 4));
    assert!(plan.terms.contains(&("coils", true)) && plan.terms.contains(&("tip moment", false)));
    assert!(plan.passes.iter().all(|pass| pass.operations.total() > 0));
    let json = plan.to_json();
    assert_eq!((json["derivatives"].as_u64(), json["terms"]["permanent_magnets"].as_bool()), (Some(7), Some(false)));
    for word in ["plan\n", "solved by", "answer and Jacobian"] {
        assert!(plan.to_string().contains(word), "{word}: {plan}");
    }
}

#[test]
fn wrong_questions() {
    for tolerance in [0.0, 1.0, -1e-6, f64::NAN] {
        let error = Solve::new(scene(&[])).tolerance(tolerance).run().expect_err("no tolerance");
        assert!(error.is_usage() && error.to_string().contains("between 0 and 1"), "{error}");
    }
    let error = Solve::new(scene(&[])).wrt(&["coil.curent"]).run().expect_err("no parameter");
    assert!(error.to_string().contains("did you mean `coil.current`?"), "{error}");
    let mut broken = scene(&[]);
    broken.segments.clear();
    assert!(matches!(Solve::new(broken).run(), Err(SolveError::Plan(_))));
}

/// A beam exactly opposed to its field: above 2.68 mT a ring of stable rods, the straight one unstable. At 42 mT their tips are the limit
/// of a small field across.
#[test]
fn rods_opposed_to_their_field_form_rings() {
    let beam = read_scene(&root().join("tests/data/reports/03-hard-magnetic-beam/beam.toml")).expect("the scene");
    for (field, tip) in
        [(2.6e-3, None), (2.7e-3, Some([0.0; 2])), (4e-3, Some([0.0; 2])), (42e-3, Some([1.9287e-3, -4.0709e-3]))]
    {
        let mut scene = beam.clone();
        Parameter::parse(&scene, "field.flux_density.z").expect("a name")[0].set(&mut scene, -field).expect("a value");
        let solved = Solve::new(scene).run().expect("an answer");
        let all = solved.all_branches().expect("equilibria");
        let stable: Vec<_> = all.branches().iter().filter(|branch| branch.solved().is_stable()).collect();
        assert_eq!(stable.len(), 1, "{field}: {all}");
        assert!(all.is_balanced(), "{field}: {all}");
        assert_eq!(stable[0].is_of_a_ring(), tip.is_some(), "{field}: {all}");
        assert_eq!(all.to_string().contains("one of a ring"), tip.is_some(), "{field}: {all}");
        let [x, y, z] = stable[0].solved().tip_position();
        let radius = x.hypot(y);
        match tip {
            None => assert!(radius < 1e-9, "{radius}"),
            Some([0.0, _]) => assert!(radius > 1e-4 && radius < 6e-3, "{radius}"),
            Some(tip) => assert!((radius - tip[0]).abs() < 1e-7 && (z - tip[1]).abs() < 1e-7, "{radius} {z}"),
        }
        let straight =
            all.branches().iter().find(|branch| !branch.is_of_a_ring() && branch.solved().tip_position()[2] > 5.99e-3);
        assert_eq!(straight.expect("the straight rod").solved().is_stable(), tip.is_none(), "{field}: {all}");
    }
}

/// A strip in its stiff plane has a growth exponent of 79 by its soft axis, while its columns do not grow at all.
#[test]
fn a_strip_past_its_lateral_buckling_is_searched() {
    let scene = read_scene(&root().join("tests/data/reports/15-strip-buckling/strip.toml")).expect("the scene");
    let mut scene = scene.clone();
    Parameter::parse(&scene, "loads.tip_force.y").expect("a name")[0].set(&mut scene, 1.0).expect("a value");
    let solved = Solve::new(scene).run().expect("an answer");
    assert!(solved.rod().growth() > 12.0);
    let all = solved.all_branches().expect("equilibria");
    // Two of them mirror each other in the stiff plane, near the tip with a thousandth of the force across.
    for side in [1.0, -1.0] {
        let is_there = |tip: [f64; 3]| (tip[0] - 0.1977 * side).abs() < 2e-3 && (tip[1] - 0.0801).abs() < 2e-3;
        let stable = all.branches().iter().map(|branch| branch.solved()).filter(|solved| solved.is_stable());
        assert_eq!(stable.filter(|solved| is_there(solved.tip_position())).count(), 1, "{all}");
    }
    let flat =
        all.branches().iter().find(|branch| branch.solved().tip_position()[0].abs() < 1e-9).expect("the flat one");
    assert_eq!(flat.solved().stability_index(), Some(1), "{all}");
}
