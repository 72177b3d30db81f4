//! Fits recover what made the shapes, say how sure they are, and name what cannot be told.

use crate::common::root;
use rayon::prelude::*;
use rodsweep::backend::{Backend, BackendError, BackendInfo, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::input::{read_scene, read_shapes, read_shapes_with};
use rodsweep::model::{Batch, Density, Node, Parameter, Plan, Profile, Quantity, Scene, SegmentKind, Solutions};
use rodsweep::reference::{shape, solve_rod};
use rodsweep::spec::{ObservedPoint, ObservedShape, ObservedShapes};
use rodsweep::study::{Fit, FitError, FitJob, Strength};
use rodsweep_bench::random::Random;

const CURRENTS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.15, 0.05], [-0.12, 0.05, -0.1]];
const MARKERS: [f64; 4] = [0.03, 0.055, 0.075, 0.0943];
const NOISE: f64 = 2e-4;

fn p6() -> Scene {
    read_scene(&root().join("sweeps/scenes/p6.toml")).expect("the scene")
}

fn cpu(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::new(plan, Precision::F64)?))
}

fn parse(scene: &Scene, name: &str) -> Vec<Parameter> {
    name.split('+').flat_map(|name| Parameter::parse(scene, name).expect("a parameter")).collect()
}

fn with(scene: &Scene, values: &[(&str, f64)]) -> Scene {
    let mut scene = scene.clone();
    for (name, value) in values {
        parse(&scene, name).into_iter().for_each(|parameter| parameter.set(&mut scene, *value).expect("a parameter"));
    }
    scene
}

/// What the reference sees of a scene; `None` stands for the tip.
fn observe(truth: &Scene, markers: &[Option<f64>]) -> ObservedShapes {
    let known = parse(truth, "coil.current");
    let of = |currents: &[f64; 3]| {
        let mut scene = truth.clone();
        Parameter::set_all(&mut scene, known.iter().copied().zip(currents.iter().copied())).expect("parameters");
        let rod = scene.rod();
        let equilibrium = solve_rod(&rod, &[]);
        let at: Vec<f64> = markers.iter().map(|at| at.unwrap_or(scene.total_length())).collect();
        let poses = shape(&rod, &equilibrium, &at);
        let point = |(pose, at): (&rodsweep::reference::Pose, &Option<f64>)| ObservedPoint {
            arc_length: *at,
            position: pose.position,
        };
        ObservedShape {
            known: currents.to_vec(),
            points: poses.iter().zip(markers).map(point).collect(),
            ..ObservedShape::default()
        }
    };
    ObservedShapes { shapes: CURRENTS.iter().map(of).collect(), known }
}

fn job(start: &Scene, truth: &Scene, free: &[&str], markers: &[Option<f64>]) -> FitJob {
    FitJob::new(start.clone(), observe(truth, markers)).free(free).expect("parameters")
}

fn solve(job: &FitJob) -> Fit {
    let fit = job.run_on(&mut cpu).expect("a fit");
    assert!(fit.converged, "{fit:?}");
    fit
}

const CURVATURES: [&str; 4] =
    ["proximal.rest_curvature.x", "proximal.rest_curvature.y", "distal.rest_curvature.x", "distal.rest_curvature.y"];
const TRUE_CURVATURES: [f64; 4] = [1.1, -0.5, 0.8, -0.6];

fn curved() -> Scene {
    let values: Vec<(&str, f64)> = CURVATURES.into_iter().zip(TRUE_CURVATURES).collect();
    with(&p6(), &values)
}

fn markers() -> Vec<Option<f64>> {
    MARKERS.iter().map(|at| Some(*at)).collect()
}

#[test]
fn known_rest_curvature_comes_back() {
    for markers in [markers(), vec![None]] {
        let fit = solve(&job(&p6(), &curved(), &CURVATURES, &markers));
        for (fitted, truth) in fit.parameters.iter().zip(TRUE_CURVATURES) {
            assert!((fitted.value - truth).abs() < 1e-8 * truth.abs(), "{fitted:?}, made with {truth}");
        }
        assert!(fit.rms < 1e-12, "{}", fit.rms);
        assert!(fit.findings.is_empty(), "{:?}", fit.findings);
        assert!(fit.evaluations < 20, "{}", fit.evaluations);
    }
}

#[test]
fn curvature_nodes_and_stiffness_come_back_together() {
    let mut start = p6();
    let SegmentKind::Flexible(flexible) = &mut start.segments[0].kind else { panic!("a flexible segment") };
    let node = |at: f64| Node { at, value: [0.0; 3] };
    flexible.rest_curvature = Profile::Nodes(vec![node(0.015), node(0.05)]);
    let truth = with(
        &start,
        &[
            ("proximal.rest_curvature.node_1.x", 1.5),
            ("proximal.rest_curvature.node_1.y", -0.4),
            ("proximal.rest_curvature.node_2.x", -0.7),
            ("proximal.rest_curvature.node_2.y", 0.9),
            ("proximal.youngs_modulus", 4.4e6),
            ("distal.youngs_modulus", 4.4e6),
        ],
    );
    let start = with(&start, &[("proximal.youngs_modulus", 5.5e6), ("distal.youngs_modulus", 5.5e6)]);
    let free = [
        "proximal.rest_curvature.node_1.x",
        "proximal.rest_curvature.node_1.y",
        "proximal.rest_curvature.node_2.x",
        "proximal.rest_curvature.node_2.y",
        "proximal.youngs_modulus+distal.youngs_modulus",
    ];
    let fit = solve(&job(&start, &truth, &free, &markers()));
    for (fitted, truth) in fit.parameters.iter().zip([1.5, -0.4, -0.7, 0.9, 4.4e6f64]) {
        assert!((fitted.value - truth).abs() < 1e-8 * truth.abs(), "{fitted:?}, made with {truth}");
    }
    let moduli = parse(&fit.scene, "proximal.youngs_modulus+distal.youngs_modulus");
    assert_eq!(moduli[0].get(&fit.scene), moduli[1].get(&fit.scene));
}

/// Standard normal (Box and Muller).
fn normal(random: &mut Random) -> f64 {
    let (u, v) = (random.within(1e-12, 1.0), random.within(0.0, 1.0));
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    const FITS: usize = 1000;
    let clean = observe(&curved(), &markers());
    for known in [true, false] {
        let covered: Vec<[bool; 4]> = (0..FITS)
            .into_par_iter()
            .map(|k| {
                let mut random = Random(7919 * (k as u64 + 1));
                let mut noisy = clean.clone();
                for point in noisy.shapes.iter_mut().flat_map(|shape| &mut shape.points) {
                    point.position.iter_mut().for_each(|x| *x += NOISE * normal(&mut random));
                }
                let job = FitJob::new(p6(), noisy).free(&CURVATURES).expect("parameters");
                let fit = solve(&if known { job.noise(NOISE) } else { job });
                std::array::from_fn(|k| {
                    let [low, high] = fit.parameters[k].interval;
                    low <= TRUE_CURVATURES[k] && TRUE_CURVATURES[k] <= high
                })
            })
            .collect();
        for (k, name) in CURVATURES.iter().enumerate() {
            let share = covered.iter().filter(|covered| covered[k]).count() as f64 / FITS as f64;
            eprintln!("{name}, noise {}: {:.1} %", if known { "given" } else { "estimated" }, 100.0 * share);
            assert!((0.93..=0.97).contains(&share), "{name}: {share}");
        }
    }
}

const MODULI: [&str; 3] = [
    "proximal.youngs_modulus+distal.youngs_modulus",
    "proximal.shear_modulus+distal.shear_modulus",
    "coil.turns.x+coil.turns.y+coil.turns.z",
];

#[test]
fn a_ridge_is_named_and_only_where_it_is() {
    // Without gravity only ratios of stiffness and dipole show.
    let mut weightless = curved();
    weightless.loads.gravity = None;
    let fit = solve(&job(&weightless, &weightless, &MODULI, &markers()));
    let [finding] = &fit.findings[..] else { panic!("{:?}", fit.findings) };
    assert!(MODULI.iter().all(|name| finding.contains(name)) && finding.contains("scale together"), "{finding}");
    assert_eq!(fit.directions.last().map(|direction| direction.strength), Some(Strength::Ridge));
    assert!(fit.parameters.iter().all(|fitted| fitted.deviation.is_infinite()), "{:?}", fit.parameters);

    // From elsewhere on the ridge the ratios are found, the scale stays where it was.
    let softer = with(&weightless, &[("proximal.youngs_modulus", 4e6), ("distal.youngs_modulus", 4e6)]);
    let fit = solve(&job(&softer, &weightless, &MODULI, &markers()));
    let ratio = |k: usize| fit.parameters[k].value / MODULI_TRUE[k];
    assert!((ratio(0) / ratio(1) - 1.0).abs() < 1e-6 && (ratio(1) / ratio(2) - 1.0).abs() < 1e-6, "{fit:?}");
    assert!((0.5..2.0).contains(&ratio(0)), "{}", ratio(0));

    // Gravity sets the scale.
    let fit = solve(&job(&curved(), &curved(), &MODULI, &markers()));
    assert!(fit.directions.iter().all(|direction| direction.strength != Strength::Ridge), "{:?}", fit.directions);
    assert!(fit.parameters.iter().all(|fitted| fitted.deviation.is_finite()));
    // ... but weakly: noise hides it, and that is said.
    let fit = solve(&job(&curved(), &curved(), &MODULI, &markers()).noise(NOISE));
    assert_eq!(fit.directions.last().map(|direction| direction.strength), Some(Strength::Weak));
    assert!(fit.findings.iter().any(|finding| finding.contains("told apart badly")), "{:?}", fit.findings);
}

const MODULI_TRUE: [f64; 3] = [5.3948e6, 2.3881e6, 30.0];

#[test]
fn a_number_without_effect_is_named() {
    // The distal segment carries no moment, so twist at its end moves no point of the centreline.
    let mut free = CURVATURES.to_vec();
    free.push("distal.shear_modulus");
    let mut weightless = curved();
    weightless.loads.gravity = None;
    let fit = solve(&job(&weightless, &weightless, &free, &markers()));
    assert!(fit.findings.iter().any(|finding| finding.contains("distal.shear_modulus changes nothing")), "{fit:?}");
    assert!(fit.parameters[4].deviation.is_infinite());
    assert!(fit.parameters[..4].iter().all(|fitted| fitted.deviation.is_finite()), "{:?}", fit.parameters);
}

#[test]
fn a_fit_without_sense_is_refused() {
    let mut few = observe(&curved(), &[None]);
    few.shapes.truncate(1);
    let few = FitJob::new(p6(), few).free(&CURVATURES).expect("parameters");
    assert!(matches!(few.run_on(&mut cpu), Err(FitError::TooFew { observations: 3, parameters: 4 })));
    let joined = job(&p6(), &curved(), &["proximal.rest_curvature.x+distal.rest_curvature.x"], &[None]);
    assert!(matches!(joined.run_on(&mut cpu), Err(FitError::Zero(_))));
    let known = job(&p6(), &curved(), &["coil.current.x"], &[None]);
    assert!(matches!(known.run(), Err(FitError::FreeAndKnown(_))));
    let again = FitJob::new(p6(), observe(&curved(), &[None])).free(&["coil.turns", "coil.turns.x"]);
    assert!(matches!(again, Err(FitError::NamedTwice(_))));
}

/// An engine whose tips lie 5 mm from where its base moments lead.
struct Astray(Cpu);

impl Backend for Astray {
    fn info(&self) -> BackendInfo {
        self.0.info()
    }

    fn plan(&self) -> &Plan {
        self.0.plan()
    }

    fn batch_size(&self) -> usize {
        self.0.batch_size()
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let mut solutions = self.0.solve(batch)?;
        for at in 0..batch.sample_count() {
            let [x, y, z] = solutions.vector(at, Quantity::TipPosition);
            solutions.set_vector(at, Quantity::TipPosition, [x + 5e-3, y, z]);
        }
        Ok(solutions)
    }
}

#[test]
fn fitted_rods_are_checked_against_the_reference() {
    let job = job(&p6(), &curved(), &CURVATURES, &markers());
    let sound = solve(&job);
    assert_eq!((sound.check.checked, sound.check.wrong, sound.mark()), (CURRENTS.len(), 0, None));
    assert!(sound.text(&job).contains("4 of 4 equilibria were checked against the reference"), "{}", sound.text(&job));
    let wrong = job.run_on(&mut |plan| Ok(Box::new(Astray(Cpu::new(plan, Precision::F64)?)))).expect("a fit");
    assert_eq!(wrong.check.wrong, CURRENTS.len());
    let mark = wrong.mark().expect("a mark");
    assert!(mark.starts_with("DISTRUSTED: 4 of 4 equilibria") && wrong.text(&job).starts_with(mark));
    let answer = wrong.to_json();
    assert_eq!((answer["distrusted"].as_str(), answer["check"]["wrong"].as_u64()), (Some(mark), Some(4)));
}

const NODES: &str =
    "tube.rest_curvature.node_1,tube.rest_curvature.node_2,tube.rest_curvature.node_3,tube.rest_curvature.node_4";

fn coiled() -> std::path::PathBuf {
    root().join("tests/data/reports/16-fit-markers")
}

/// The centre line of a coil of 330 degrees, exact points, with arc lengths and without.
#[test]
fn a_coiled_rest_shape_comes_back() {
    let names: Vec<&str> = NODES.split(',').collect();
    let start = read_scene(&coiled().join("curved.toml")).expect("the scene");
    for (file, notes, within) in [("centreline.csv", 0, 1e-3), ("centreline_no_s.csv", 1, 0.02)] {
        let mut told = Vec::new();
        let observed = read_shapes_with(&coiled().join(file), &start, &mut told).expect("points");
        assert_eq!(told.len(), notes, "{told:?}");
        let fit = solve(&FitJob::new(start.clone(), observed).free(&names).expect("parameters"));
        assert_eq!((fit.mark(), &fit.misfit), (None, &None), "{file}");
        for (k, fitted) in fit.parameters.iter().enumerate() {
            let truth = [0.0, [10.0, 30.0, 50.0, 70.0][k / 3], 5.0][k % 3];
            assert!((fitted.value - truth).abs() < within, "{file}: {fitted:?}, made with {truth}");
        }
        assert!(fit.rms < 1e-6, "{file}: {}", fit.rms);
    }
}

/// A misfit is said: a tube whose curvature is free at its base alone, seen as a coil.
#[test]
fn points_far_off_the_fitted_rod_are_told() {
    let start = read_scene(&coiled().join("curved.toml")).expect("the scene");
    let observed = read_shapes(&coiled().join("centreline.csv"), &start).expect("points");
    let job = FitJob::new(start, observed).free(&["tube.rest_curvature.node_1"]).expect("parameters");
    let fit = job.run().expect("a fit");
    let mark = fit.mark().expect("a mark");
    assert!(mark.starts_with("DISTRUSTED: the points lie ") && mark.contains("their own noise"), "{mark}");
    assert_eq!((fit.misfit.as_deref(), fit.check.mark.as_deref()), (Some(mark), None));
    assert!(fit.text(&job).starts_with(mark) && fit.to_json()["misfit"].is_string());
    assert!(fit.noise_of_points.expect("noise") < 1e-6);
}

/// Two turns at rest, seen under load: the points do not say by themselves how much of the bend is the load's.
#[test]
fn a_coil_under_load_comes_back() {
    let names: Vec<&str> = NODES.split(',').collect();
    let mut start = read_scene(&coiled().join("curved.toml")).expect("the scene");
    start.loads.tip_force = Some([1.5e-3, 1e-3, -1e-3]);
    start.loads.gravity = Some([0.0, 0.0, -9.81]);
    start.name = "Two turns".into();
    let SegmentKind::Flexible(tube) = &mut start.segments[0].kind else { panic!("no tube") };
    tube.density = Some(Density::Volume(1100.0));
    let mut truth = start.clone();
    let values: Vec<f64> =
        (0..12).map(|k| [[5.0, 0.0, 10.0, 0.0][k / 3], [70.0, 80.0, 60.0, 75.0][k / 3], 5.0][k % 3]).collect();
    let free = names.iter().flat_map(|name| parse(&truth, name)).collect::<Vec<_>>();
    Parameter::set_all(&mut truth, free.iter().copied().zip(values.iter().copied())).expect("curvatures");
    let rod = truth.rod();
    let at: Vec<f64> = (1..=24).map(|k| 0.18 * f64::from(k) / 24.0).collect();
    let poses = shape(&rod, &solve_rod(&rod, &[]), &at);
    let point = |(pose, at): (&rodsweep::reference::Pose, &f64)| ObservedPoint {
        arc_length: Some(*at),
        position: pose.position,
    };
    let points = poses.iter().zip(&at).map(point).collect();
    let observed =
        ObservedShapes { shapes: vec![ObservedShape { points, ..ObservedShape::default() }], known: Vec::new() };
    let fit = FitJob::new(start, observed).free(&names).expect("parameters").run_on(&mut cpu).expect("a fit");
    for (fitted, truth) in fit.parameters.iter().zip(&values) {
        assert!((fitted.value - truth).abs() < 1e-2, "{fitted:?}, made with {truth}");
    }
    assert!(fit.rms < 1e-6 && fit.mark().is_none(), "{} {:?}", fit.rms, fit.mark());
}
