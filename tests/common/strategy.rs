//! Random scenes with any combination of terms, and a search for the worst of them that ends at a small one.
//!
//! Everything follows from a fixed seed. Values shrink towards zero, terms and segments towards none.

use proptest::array::{uniform2, uniform3};
use proptest::collection::vec;
use proptest::option::{of, weighted};
use proptest::prelude::{Just, Strategy, any, prop_oneof};
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use rayon::prelude::*;
use rodsweep::input::write_scene;
use rodsweep::model::{
    Base, Coil, CoilWinding, Density, Flexible, Frame, InnerLoad, LoadPlace, Loads, Node, Profile, Rigid, Scene,
    Segment, SegmentKind, ShearElasticity, Stiffness, Vector,
};
use std::path::Path;

/// A catheter-sized rod under loads too mild for a second equilibrium, most of the time.
pub fn scenes() -> impl Strategy<Value = Scene> {
    let loads = (of(vector(3e-3)), of(vector(1e-4)), of(vector(4.0)), of(vector(6e-3)), of(0.0..1200.0));
    let loads = loads.prop_map(|(tip_force, tip_moment, gravity, distributed_force, fluid_density)| Loads {
        tip_force,
        tip_moment,
        gravity,
        distributed_force,
        fluid_density,
    });
    let base = (vector(0.05), vector(1.7)).prop_map(|(position, rotation)| Base { position, rotation });
    let segments = (bending(length()), vec(segment(), 0..4), 0..4_usize);
    let force = (0..4_usize, 0.0..1.0, vector(1e-3));
    let choices = (weighted(0.3, -0.7..0.5), weighted(0.2, Just(())), weighted(0.3, force));
    (base, vector(1.5), loads, segments, choices).prop_map(
        |(base, flux_density, loads, (main, mut segments, at), (insertion, no_arm, force))| {
            segments.insert(at.min(segments.len()), main);
            name(&mut segments);
            let is_flexible = matches!(segments[0].kind, SegmentKind::Flexible(_));
            let inserted = insertion.filter(|_| is_flexible).map_or(0.0, |share| share * segments[0].length);
            let inner_loads = force.map(|force| inner_load(&segments, force)).into_iter().collect();
            let mut scene = Scene {
                name: "random".into(),
                base,
                flux_density,
                sources: Default::default(),
                loads,
                inner_loads,
                wall: None,
                segments,
                inserted,
                rigid_force_arm: no_arm.is_none(),
            };
            if scene.validate().is_err() {
                // Nothing has a mass.
                scene.loads.gravity = None;
            }
            scene.validate().expect("a rod");
            scene
        },
    )
}

/// At a share of a segment's length, at the middle of a rigid one.
fn inner_load(segments: &[Segment], (at, share, force): (usize, f64, [f64; 3])) -> InnerLoad {
    let segment = at % segments.len();
    let place = match segments[segment].kind {
        SegmentKind::Flexible(_) => LoadPlace::At(share * segments[segment].length),
        SegmentKind::Rigid(_) => LoadPlace::Middle,
    };
    InnerLoad { name: "push".into(), segment, place, force, moment: None, frame: Frame::World }
}

fn name(segments: &mut [Segment]) {
    segments.iter_mut().enumerate().for_each(|(k, segment)| segment.name = format!("s{}", k + 1));
}

fn vector(size: f64) -> impl Strategy<Value = Vector> {
    uniform3(-size..size)
}

fn length() -> impl Strategy<Value = f64> {
    0.02..0.05
}

fn segment() -> impl Strategy<Value = Segment> {
    prop_oneof![
        4 => bending(prop_oneof![6 => length(), 1 => Just(0.0)]),
        3 => rigid(prop_oneof![6 => 0.005..0.02, 1 => Just(0.0)]),
    ]
}

fn bending(length: impl Strategy<Value = f64>) -> impl Strategy<Value = Segment> {
    let curvature = prop_oneof![
        1 => vector(5.0).prop_map(Profile::Constant),
        1 => nodes(vector(5.0)).prop_map(Profile::Nodes),
    ];
    let density = weighted(0.6, (any::<bool>(), 0.0..1.0));
    let parts = (stiffness(), curvature, of(uniform2(0.1..2.0)), of(0.1..2.0), density, of(vector(1e-3)));
    (length, parts).prop_map(|(length, (stiffness, curvature, stiffness_shear, stiffness_axial, density, magnet))| {
        let is_tube = matches!(stiffness, Stiffness::Tube { .. });
        let stiffness = match stiffness {
            Stiffness::Nodes(nodes) => Stiffness::Nodes(placed(nodes, length)),
            other => other,
        };
        let rest_curvature = match curvature {
            Profile::Nodes(nodes) => Profile::Nodes(placed(nodes, length)),
            constant => constant,
        };
        let density = density.map(|(volume, share)| match volume && is_tube {
            true => Density::Volume(500.0 + 1000.0 * share),
            false => Density::Linear(1e-3 * share),
        });
        let flexible = Flexible {
            stiffness,
            rest_curvature,
            stiffness_shear,
            stiffness_axial,
            density,
            dipole_per_length: magnet,
            magnet: None,
        };
        Segment { name: String::new(), length, kind: SegmentKind::Flexible(flexible) }
    })
}

fn stiffness() -> impl Strategy<Value = Stiffness> {
    let ei = || 2e-5..8e-5;
    let tube = |shear: ShearElasticity| {
        (3e-4..6e-4, 1e-3..1.3e-3, 25e6..40e6).prop_map(move |(inner_radius, outer_radius, youngs_modulus)| {
            Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear }
        })
    };
    prop_oneof![
        (ei(), ei()).prop_map(|(bending, torsion)| Stiffness::Direct {
            bending_x: bending,
            bending_y: bending,
            torsion
        }),
        [ei(), ei(), ei()].prop_map(|[bending_x, bending_y, torsion]| Stiffness::Direct {
            bending_x,
            bending_y,
            torsion
        }),
        (8e6..15e6).prop_flat_map(move |modulus| tube(ShearElasticity::Modulus(modulus))),
        (0.2..0.49).prop_flat_map(move |ratio| tube(ShearElasticity::PoissonRatio(ratio))),
        nodes([ei(), ei(), ei()]).prop_map(Stiffness::Nodes),
    ]
}

/// Nodes whose places are shares of the length; before the proximal end, too.
fn nodes(value: impl Strategy<Value = Vector>) -> impl Strategy<Value = Vec<Node>> {
    let at = prop_oneof![1 => Just(0.0), 1 => Just(1.0), 2 => -0.3..1.0];
    vec((at, value).prop_map(|(at, value)| Node { at, value }), 1..4)
}

fn placed(mut nodes: Vec<Node>, length: f64) -> Vec<Node> {
    nodes.iter_mut().for_each(|node| node.at *= length);
    nodes.sort_by(|a, b| a.at.total_cmp(&b.at));
    nodes.dedup_by(|a, b| a.at == b.at);
    nodes
}

fn rigid(length: impl Strategy<Value = f64>) -> impl Strategy<Value = Segment> {
    let winding = prop_oneof![
        (uniform3(10.0..100.0), uniform3(1e-6..1e-5)).prop_map(|(turns, area)| CoilWinding::Axes { turns, area }),
        uniform3(vector(1e-3)).prop_map(CoilWinding::Matrix),
    ];
    let coil = (winding, vector(0.1), weighted(0.3, vector(0.5)));
    let coil = coil.prop_map(|(winding, current, alignment)| Coil {
        winding,
        current,
        alignment: alignment.unwrap_or_default(),
    });
    (length, weighted(0.6, 0.0..5e-4), weighted(0.6, coil), weighted(0.3, vector(5e-3))).prop_map(
        |(length, mass, coil, dipole_per_length)| {
            let kind = SegmentKind::Rigid(Rigid { mass, coil, dipole_per_length, ..Rigid::default() });
            Segment { name: String::new(), length, kind }
        },
    )
}

fn runner() -> TestRunner {
    // What fails is written as a scene instead.
    let config = Config { failure_persistence: None, max_shrink_iters: 2000, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// The first scenes of the sequence.
pub fn some_scenes(count: usize) -> Vec<Scene> {
    let mut runner = runner();
    let scenes = scenes();
    (0..count).map(|_| scenes.new_tree(&mut runner).expect("a scene").current()).collect()
}

/// How many scenes a property is checked on.
#[derive(Clone, Copy, Debug)]
pub struct Count {
    pub scenes: usize,
    /// As many may have no solution that the property could be checked on.
    pub most_unsolved: usize,
}

/// Asserts that an error stays within a tolerance on random scenes.
///
/// `measure` gives the error and what it is of; `None` for a scene without a solution. The worst scene beyond the
/// tolerance is shrunk and written as a file that `rodsweep solve` reads.
pub fn check_scenes(
    property: &str,
    count: Count,
    tolerance: f64,
    measure: impl Fn(&Scene) -> Option<(f64, String)> + Sync,
) {
    let mut runner = runner();
    let strategy = scenes();
    let trees: Vec<_> = (0..count.scenes).map(|_| strategy.new_tree(&mut runner).expect("a scene")).collect();
    let found: Vec<_> = trees.iter().map(ValueTree::current).collect::<Vec<_>>().par_iter().map(&measure).collect();
    let unsolved = found.iter().filter(|measured| measured.is_none()).count();
    let size = |measured: &Option<(f64, String)>| match measured {
        Some((error, _)) if error.is_nan() => f64::INFINITY,
        Some((error, _)) => *error,
        None => f64::NEG_INFINITY,
    };
    let worst = (0..found.len()).max_by(|a, b| size(&found[*a]).total_cmp(&size(&found[*b]))).expect("scenes");
    println!("{property}: worst {:?} of scene {worst}; {unsolved} of {} unsolved", found[worst], found.len());
    assert!(unsolved <= count.most_unsolved, "{property}: {unsolved} scenes are unsolved");
    if size(&found[worst]) <= tolerance {
        return;
    }
    let tree = trees.into_iter().nth(worst).expect("the worst");
    let outcome = runner.run_one(tree, |scene| match measure(&scene) {
        Some((error, of)) if error.is_nan() || error > tolerance => {
            Err(TestCaseError::fail(format!("{error:e} of {of}")))
        }
        _ => Ok(()),
    });
    let Err(TestError::Fail(reason, scene)) = outcome else { panic!("{property}: {:?}", found[worst]) };
    let text = write_scene(&scene);
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}.toml", property.replace(' ', "-")));
    std::fs::write(&file, &text).expect("writable");
    panic!("{property}: {reason}, beyond {tolerance:e}; `rodsweep solve {}` solves\n{text}", file.display());
}
