//! Shaders without a GPU: every piece validates, and its layout is the host's.

use crate::common::day::{is_of_today, of_today};
use rodsweep::backend::Precision;
use rodsweep::gpu::shader::{
    Form, Generator, KERNELS, Kernel, Piece, REQUEST_FLOATS, REQUEST_WORDS, Value, WORKGROUP_SIZE, check,
    settings_members, specialisation,
};
use rodsweep::model::{
    Anchor, AnchorAxis, Anchors, BLOCK, Density, MOST_ANCHOR_AXES, Node, Parameter, Plan, PlanOptions, Profile,
    RecipeMethod, SampleRecipe, Scene, SegmentKind, Sensitivity, Stepper, Stiffness, Terms,
};
use std::sync::Arc;

const IDLE: &str = "@compute @workgroup_size(WORKGROUP)\nfn idle(@builtin(global_invocation_id) id: vec3<u32>) {\n    \
                    if select_sample(id.x) { store_status(STATUS_OK); }\n}\n";

fn plans() -> Vec<Plan> {
    let scene = crate::common::scenes::catheter();
    let mut plans = Vec::new();
    for stepper in Stepper::ALL {
        let options = PlanOptions { stepper, ..PlanOptions::default() };
        plans.push(Plan::single(&scene, &[], options).unwrap());
        let axes = crate::common::scenes::parameters(&scene, &["coil.current", "loads.tip_force"]);
        let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
        let wrt = crate::common::scenes::parameters(&scene, &["coil.current", "insertion", "distal.youngs_modulus"]);
        plans.push(Plan::new(&scene, &axes, &wrt, options).unwrap());
    }
    plans
}

/// The catheter with everything that may vary along its distal segment, and a magnet all along it.
pub fn general() -> Scene {
    let mut scene = crate::common::scenes::catheter();
    let node = |at: f64, value: f64| Node { at, value: [value; 3] };
    if let SegmentKind::Flexible(distal) = &mut scene.segments[2].kind {
        distal.stiffness = Stiffness::Nodes(vec![node(0.0, 3e-7), node(0.033, 1e-7)]);
        distal.rest_curvature = Profile::Nodes(vec![node(0.0, 3.0), node(0.02, 1.0)]);
        distal.stiffness_shear = Some([1.0, 2.0]);
        distal.stiffness_axial = Some(3.0);
        distal.dipole_per_length = Some([1e-5; 3]);
        distal.density = Some(Density::Linear(1e-4));
    }
    if let SegmentKind::Rigid(coil) = &mut scene.segments[1].kind {
        coil.mass = Some(1e-5);
    }
    scene.loads.gravity = Some([0.0, 0.0, -9.81]);
    scene
}

/// Parameters to differentiate by: one of each kind alone, all.
fn derivatives(scene: &Scene, kinds: &[&str]) -> Vec<Vec<Parameter>> {
    let mut lists: Vec<Vec<Parameter>> =
        kinds.iter().map(|name| crate::common::scenes::parameters(scene, &[name])).collect();
    lists.push(Parameter::all(scene));
    lists
}

const KINDS: [&str; 11] = [
    "insertion",
    "base.position.x",
    "base.rotation.y",
    "field.flux_density.z",
    "loads.tip_force.x",
    "loads.tip_moment.y",
    "loads.distributed_force.z",
    "distal.length",
    "distal.rest_curvature.x",
    "distal.stiffness.bending",
    "coil.current.y",
];
const GENERAL_KINDS: [&str; 7] = [
    "distal.rest_curvature.node_1.x",
    "distal.stiffness.node_2.bending",
    "distal.stiffness_shear",
    "distal.dipole_per_length.x",
    "field.flux_density.z",
    "coil.mass",
    "distal.length",
];

#[test]
fn the_prelude_validates_and_has_the_layout_of_the_host() {
    for plan in plans() {
        let piece = Piece { name: "idle.wgsl".into(), text: IDLE.into() };
        expect_layout(&Kernel::custom("idle", &[piece], &plan).unwrap(), &plan);
    }
}

/// A valid kernel whose layout is the host's.
fn expect_layout(kernel: &Kernel, plan: &Plan) {
    let reflection = check(&kernel.source)
        .unwrap_or_else(|error| panic!("{}: {error}\n{:?} {:?}", kernel.precision, plan.terms, plan.options));
    let members = reflection.members("Settings").unwrap();
    let members: Vec<_> = members.iter().map(|(name, offset)| (name.as_str(), *offset)).collect();
    assert_eq!(members, settings_members(kernel.precision));
    let bindings = reflection.bindings();
    let bindings: Vec<_> = bindings.iter().map(|(group, index, name)| (*group, *index, name.as_str())).collect();
    let all = ["settings", "constants", "inputs", "outputs", "anchors", "taken_list", "left_list", "handover"];
    let all: Vec<_> = (0..).zip(all).map(|(at, name)| (0, at, name)).collect();
    assert!(bindings.starts_with(&all[..4]) && bindings.iter().all(|binding| all.contains(binding)), "{bindings:?}");
    assert_eq!(bindings.contains(&all[4]), plan.anchors.is_some());
    assert_eq!(reflection.workgroup_size(kernel.entry_point), Some([WORKGROUP_SIZE, 1, 1]));
    assert_eq!(BLOCK % WORKGROUP_SIZE as usize, 0);
}

/// A plan as if its samples used these terms and no others.
fn force_terms(plan: &mut Plan, terms: Terms) {
    plan.terms = terms;
    for segment in &mut plan.segments {
        segment.has_dipole &= terms.dipole;
        segment.has_magnet &= terms.magnet;
        segment.shears &= terms.shear;
        segment.tapers &= terms.taper;
        segment.curvature_rises &= terms.curvature_rise;
    }
}

/// A sixth of them each day.
#[test]
fn every_kernel_validates_for_every_combination_of_terms() {
    let scene = general();
    let mut count = 0;
    // Every combination of the first five beside all or none of the others, and the other way round.
    let first = (0..1 << 5).flat_map(|bits| [bits, bits | 0b1111 << 5]);
    let others = (0..1 << 4).flat_map(|bits| [bits << 5, bits << 5 | 0b11111]);
    for (number, bits) in first.chain(others).enumerate().filter(|(number, _)| is_of_today(*number, 6)) {
        let bit = |k: usize| bits >> k & 1 == 1;
        let terms = Terms {
            force: bit(0) || bit(1) || bit(6),
            load: bit(1),
            anisotropic: bit(2),
            load_without_energy: bit(3),
            dipole: bit(4),
            magnet: bit(5),
            shear: bit(6),
            taper: bit(7),
            curvature_rise: bit(8),
            varying_field: false,
            wall: false,
        };
        let stepper = Stepper::ALL[number / 6 % 2];
        for (turn, sensitivity) in
            [Sensitivity::Auto, Sensitivity::Reciprocity, Sensitivity::Forward].into_iter().enumerate()
        {
            let wrt = if sensitivity == Sensitivity::Auto { Vec::new() } else { Parameter::all(&scene) };
            let options = PlanOptions { stepper, sensitivity, ..PlanOptions::default() };
            let mut plan = Plan::single(&scene, &wrt, options).unwrap();
            plan.scene.rigid_force_arm = number / 6 % 3 != 0;
            force_terms(&mut plan, terms);
            validate_whole(&plan);
            // Short kernels have hardly a term of their own.
            if number / 6 % 3 == turn {
                validate_stages(&plan);
            }
            count += 1;
        }
    }
    assert_eq!(count, 32 + 16);
}

/// A sixth of the kinds each day.
#[test]
fn every_kernel_validates_for_every_kind_of_derivative() {
    for sensitivity in [Sensitivity::Forward, Sensitivity::Reciprocity] {
        for plan in plans() {
            for wrt in of_today(derivatives(&plan.scene, &KINDS), 6) {
                let options = PlanOptions { sensitivity, ..plan.options };
                validate(&Plan::new(&plan.scene, &plan.axes, &wrt, options).unwrap());
            }
        }
        let scene = general();
        for wrt in of_today(derivatives(&scene, &GENERAL_KINDS), 6) {
            let options = PlanOptions { stepper: Stepper::Rk4, sensitivity, ..PlanOptions::default() };
            // Some of all parameters follow from others and cannot be swept.
            let swept = if wrt.len() > 3 { &[][..] } else { &wrt };
            let axes: Vec<_> = swept.iter().map(|parameter| vec![*parameter]).collect();
            validate(&Plan::new(&scene, &axes, &wrt, options).unwrap());
            validate(&Plan::single(&scene, &wrt, options).unwrap());
        }
    }
}

#[test]
fn a_free_distal_part_validates() {
    let mut scene = crate::common::scenes::catheter();
    scene.loads.tip_force = None;
    for names in [&[][..], &["coil.current"], &["insertion", "coil.current", "distal.stiffness.bending"]] {
        for sensitivity in [Sensitivity::Forward, Sensitivity::Reciprocity] {
            let options = PlanOptions { sensitivity, ..PlanOptions::default() };
            let plan = Plan::single(&scene, &crate::common::scenes::parameters(&scene, names), options).unwrap();
            assert!(plan.free.is_some());
            validate(&plan);
        }
    }
}

#[test]
fn a_rod_of_one_segment_and_one_of_many_validate() {
    let mut scene = crate::common::scenes::catheter();
    let segments = scene.segments.clone();
    scene.segments.truncate(1);
    validate(&Plan::single(&scene, &Parameter::all(&scene), PlanOptions::default()).unwrap());
    scene.segments.clear();
    for k in 0..12 {
        let mut segment = segments[k % 2].clone();
        segment.name = format!("segment{k}");
        scene.segments.push(segment);
    }
    validate(&Plan::single(&scene, &Parameter::all(&scene), PlanOptions::default()).unwrap());
}

fn validate(plan: &Plan) {
    validate_whole(plan);
    validate_stages(plan);
}

fn validate_whole(plan: &Plan) {
    for entry in KERNELS {
        for (precision, unrolled) in [(Precision::F32, false), (Precision::F32, true), (Precision::F64, false)] {
            expect_layout(&Kernel::new(entry, plan, precision, unrolled).unwrap(), plan);
        }
    }
}

/// The kernels beside the whole one. In f64 most are the same text but for its types.
fn validate_stages(plan: &Plan) {
    for precision in [Precision::F32, Precision::F64] {
        let kernel = Kernel::new(&KERNELS[0], plan, precision, false).unwrap();
        let stages: Vec<_> = kernel.stages.iter().flat_map(|stages| stages.named()).collect();
        let others = stages.into_iter().filter(|(name, _)| precision == Precision::F32 || *name == "guarded");
        others.map(|(_, stage)| stage).chain(kernel.anchored.as_deref()).for_each(|other| expect_layout(other, plan));
    }
}

/// A plan with anchors over the first so many axes; what is not solved here holds the numbers of its place.
pub fn anchored(axis_count: usize, wrt: &[&str]) -> Plan {
    let scene = crate::common::scenes::catheter();
    let mut axes = crate::common::scenes::parameters(&scene, &["coil.current", "insertion"]);
    axes.truncate(axis_count);
    let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
    let wrt = crate::common::scenes::parameters(&scene, wrt);
    let plan = Plan::new(&scene, &axes, &wrt, PlanOptions::default()).unwrap();
    let grid: Vec<AnchorAxis> =
        (0..axis_count).map(|axis| AnchorAxis { from: 0.1, spacing: 0.01, points: 2 + axis }).collect();
    let count: usize = grid.iter().map(|axis| axis.points).product();
    let one = |at: usize| [at as f64, 0.0, 1.0];
    let anchor =
        |at: usize| Anchor { m0: one(at), slopes: vec![one(at); axis_count], inverse: [one(at); 3], margin: 1.0 };
    plan.with_anchors(Arc::new(Anchors::new(grid, &(0..count).map(anchor).collect::<Vec<_>>())))
}

#[test]
fn kernels_that_start_from_anchors_validate_and_others_know_none() {
    for axis_count in 1..=MOST_ANCHOR_AXES {
        for wrt in [&[][..], &["coil.current", "insertion", "loads.tip_force"]] {
            let plan = anchored(axis_count, wrt);
            validate(&plan);
            let names = |kernel: &Kernel| check(&kernel.source).unwrap().functions();
            let has = |kernel: &Kernel, name: &str| names(kernel).iter().any(|function| function == name);
            let kernel = Kernel::new(&KERNELS[0], &plan, Precision::F32, false).unwrap();
            let start = kernel.anchored.as_ref().unwrap();
            let stages = kernel.stages.as_ref().unwrap();
            let start_of_stages = stages.anchored.as_ref().unwrap();
            assert!(has(start, "cell") && has(start_of_stages, "cell") && !has(&kernel, "cell"));
            assert!(stages.named().all(|(name, stage)| has(stage, "cell") == (name == "check-anchored")));
            for plain in [plan.with_starts(), Plan { anchors: None, ..plan }] {
                let kernel = Kernel::new(&KERNELS[0], &plain, Precision::F32, false).unwrap();
                assert!(kernel.anchored.is_none() && !has(&kernel, "cell"));
                assert!(!kernel.source.text.contains("ANCHOR_POINTS") && !kernel.source.text.contains("anchors:"));
            }
        }
    }
}

/// A recipe of each method for two axes.
pub fn recipes() -> [SampleRecipe; 4] {
    let methods = [
        RecipeMethod::Grid(vec![vec![-0.1, 0.0, 0.1], vec![0.0, 0.2]]),
        RecipeMethod::Sobol { directions: vec![vec![1 << 31; 32]; 2], keys: vec![1, 2] },
        RecipeMethod::LatinHypercube { rounds: vec![[1, 2, 3, 4, 5, 6]; 2], jitter: vec![7, 8] },
        RecipeMethod::Uniform(vec![1, 2]),
    ];
    methods.map(|method| SampleRecipe { method, ranges: vec![(-0.1, 0.1), (0.0, 0.2)], sample_count: 6 })
}

#[test]
fn kernels_that_make_and_count_samples_validate_and_have_the_layout_of_the_host() {
    let scene = crate::common::scenes::catheter();
    let axes = crate::common::scenes::parameters(&scene, &["coil.current.x", "loads.tip_force.y"]);
    let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
    let plan = Plan::new(&scene, &axes, &[], PlanOptions::default()).unwrap();
    let bindings_of = |kernel: &Kernel| {
        let reflection = check(&kernel.source).unwrap_or_else(|error| panic!("{error}\n{}", kernel.source.text));
        assert_eq!(reflection.workgroup_size(kernel.entry_point), Some([WORKGROUP_SIZE, 1, 1]));
        let names = reflection.bindings().into_iter().map(|(_, _, name)| name).collect::<Vec<_>>().join(" ");
        (reflection, names)
    };
    for precision in [Precision::F32, Precision::F64] {
        for recipe in recipes() {
            let generator = Generator::new(&plan, &recipe).unwrap();
            let (_, names) = bindings_of(&Kernel::generate(&plan, &generator, precision).unwrap());
            assert_eq!(names, "range recipe tables inputs");
        }
        let (reflection, names) = bindings_of(&Kernel::reduce(&plan, precision).unwrap());
        assert_eq!(names, "request outputs tally returned voxels");
        let size = precision.size();
        let floats = REQUEST_FLOATS.iter().enumerate().map(|(at, name)| (name.to_string(), at * size));
        let words = (0..).zip(REQUEST_WORDS).map(|(at, name)| (name.to_string(), REQUEST_FLOATS.len() * size + 4 * at));
        assert_eq!(reflection.members("Request").unwrap(), floats.chain(words).collect::<Vec<_>>());
    }
}

#[test]
fn what_the_device_cannot_make_is_declined_with_a_reason() {
    let scene = crate::common::scenes::catheter();
    let refused = |names: &[&str], range: (f64, f64)| {
        let parameters = crate::common::scenes::parameters(&scene, names);
        let axes: Vec<_> = parameters.into_iter().map(|parameter| vec![parameter]).collect();
        let plan = Plan::new(&scene, &axes, &[], PlanOptions::default()).unwrap();
        let method = RecipeMethod::Uniform(vec![1; axes.len()]);
        Generator::new(&plan, &SampleRecipe { method, ranges: vec![range; axes.len()], sample_count: 9 }).unwrap_err()
    };
    assert_eq!(refused(&["base.rotation.x"], (0.0, 1.0)), "an input is no linear function of the axes");
    assert_eq!(refused(&["distal.length"], (-0.1, 0.1)), "some of its samples make no rod");
    // The same as a grid is no trouble: its values are tabulated.
    let axes =
        crate::common::scenes::parameters(&scene, &["base.rotation"]).into_iter().map(|p| vec![p]).collect::<Vec<_>>();
    let plan = Plan::new(&scene, &axes, &[], PlanOptions::default()).unwrap();
    let method = RecipeMethod::Grid(vec![vec![-0.1, 0.2, 0.5]; 3]);
    Generator::new(&plan, &SampleRecipe { method, ranges: vec![(-0.1, 0.5); 3], sample_count: 27 }).unwrap();
}

#[test]
fn a_plan_names_its_terms() {
    let plan = &plans()[1];
    let terms = specialisation(plan, Precision::F32, Form::ROLLED).terms;
    let holds = |name: &str| terms[name];
    assert!(holds("DIPOLE") && holds("FORCE") && holds("RECIPROCITY") && !holds("LOAD"));
    assert!(holds("FLEXIBLE[0]") && !holds("FLEXIBLE[1]"));
    assert!(holds("WANT_INSERTION") && holds("WANT_DIPOLE") && holds("WANT_STIFFNESS"));
    assert!(!holds("WANT_TIP_FORCE") && !holds("WANT_LENGTH"));
    assert!(holds("COLLECT_STRAIN") && holds("COLLECT_DIPOLE") && !holds("COLLECT_LOAD") && !holds("COLLECT_FIELD"));
    assert!(!holds("FORWARD") && !holds("FREE"));
    // Flexible, rigid, flexible with integrals.
    assert_eq!(specialisation(plan, Precision::F32, Form::ROLLED).constants["FLAGS"], Value::u32_array([1, 0, 17]));
    assert!(holds("A[0][1][0]") && !holds("A[0][2][0]") && holds("B[0][3]"));
}

/// Coordinates are differences of numbers that may be large: a range far from zero is no reason to decline.
#[test]
fn coordinates_among_anchors_are_made_on_the_device() {
    let scene = crate::common::scenes::catheter();
    let axes = crate::common::scenes::parameters(&scene, &["distal.youngs_modulus"]);
    let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
    let plan = Plan::new(&scene, &axes, &[], PlanOptions::default()).unwrap();
    let (from, to) = (5e6, 5.001e6);
    let axis = AnchorAxis { from, spacing: (to - from) / 8.0, points: 9 };
    let anchor = Anchor { m0: [0.0; 3], slopes: vec![[0.0; 3]], inverse: [[0.0; 3]; 3], margin: 1.0 };
    let plan = plan.with_anchors(Arc::new(Anchors::new(vec![axis], &vec![anchor; 9])));
    let method = RecipeMethod::Uniform(vec![1]);
    Generator::new(&plan, &SampleRecipe { method, ranges: vec![(from, to)], sample_count: 9 }).unwrap();
}

/// Plans of golden scenes in fields that vary in space, without derivatives and by every slot, and one with a rigid start.
pub fn varying_plans() -> Vec<Plan> {
    use crate::common::fields::{cases, plan_by_slots, slots};
    let mut plans = Vec::new();
    for (number, case) in cases().into_iter().enumerate().step_by(4) {
        let options = PlanOptions { stepper: Stepper::ALL[number / 4 % 2], ..PlanOptions::default() };
        plans.push(Plan::single(&case.scene, &[], options).unwrap());
        let options = PlanOptions { base_moment_rows: number % 8 == 0, ..options };
        plans.push(plan_by_slots(&case.scene, &slots(&case), options));
        let mut scene = case.scene;
        scene.rigid_force_arm = false;
        let mut segments = scene.segments.clone();
        segments.retain(|segment| matches!(segment.kind, SegmentKind::Rigid(_)));
        segments.truncate(1);
        segments.iter_mut().for_each(|segment| segment.name = "start".into());
        scene.segments.splice(0..0, segments);
        let wrt: Vec<Parameter> =
            Parameter::all(&scene).into_iter().filter(|parameter| *parameter != Parameter::Insertion).collect();
        plans.push(Plan::single(&scene, &wrt, PlanOptions { base_moment_rows: true, ..options }).unwrap());
    }
    plans
}

#[test]
fn kernels_for_fields_that_vary_validate_and_have_the_layout_of_the_host() {
    for plan in varying_plans() {
        for unrolled in [true, false] {
            let kernel = Kernel::varying(&plan, unrolled).unwrap();
            let reflection = check(&kernel.source).unwrap_or_else(|error| panic!("{}: {error}", plan.scene.name));
            let members = reflection.members("Settings").unwrap();
            let members: Vec<_> = members.iter().map(|(name, offset)| (name.as_str(), *offset)).collect();
            assert_eq!(members, settings_members(Precision::F32));
            let names: Vec<String> = reflection.bindings().into_iter().map(|(_, _, name)| name).collect();
            assert_eq!(names.join(" "), "settings constants inputs outputs memory_settings memory under_way");
            assert_eq!(reflection.workgroup_size("advance"), Some([WORKGROUP_SIZE, 1, 1]));
        }
    }
}

/// The kernel by nodes has the settings of the others, and memory of its own.
#[test]
fn kernels_by_nodes_validate_and_have_the_layout_of_the_host() {
    let scene = general();
    let mut all = plans();
    for sensitivity in [Sensitivity::Forward, Sensitivity::Reciprocity] {
        for wrt in derivatives(&scene, &GENERAL_KINDS) {
            let options = PlanOptions { stepper: Stepper::Rk4, sensitivity, ..PlanOptions::default() };
            all.push(Plan::single(&scene, &wrt, options).unwrap());
        }
    }
    let mut free = crate::common::scenes::catheter();
    free.loads.tip_force = None;
    let wrt = crate::common::scenes::parameters(&free, &["coil.current"]);
    all.push(Plan::single(&free, &wrt, PlanOptions::default()).unwrap());
    assert!(all.last().unwrap().free.is_some());
    for plan in all {
        for unrolled in [true, false] {
            let kernel = Kernel::nodes(&plan, unrolled).unwrap();
            let reflection = check(&kernel.source).unwrap_or_else(|error| panic!("{error}"));
            let members = reflection.members("Settings").unwrap();
            let members: Vec<_> = members.iter().map(|(name, offset)| (name.as_str(), *offset)).collect();
            assert_eq!(members, settings_members(Precision::F32));
            let of_nodes = reflection.members("MemorySettings").unwrap();
            let names = ["stride", "most_intervals", "spacing", "path_steps", "path_tolerance", "least_pivot"];
            let names = names.map(str::to_owned).into_iter();
            assert_eq!(of_nodes, names.zip((0..).step_by(4)).collect::<Vec<_>>());
            let names: Vec<String> = reflection.bindings().into_iter().map(|(_, _, name)| name).collect();
            assert_eq!(names.join(" "), "settings constants inputs outputs memory_settings memory under_way");
            assert_eq!(reflection.workgroup_size("advance"), Some([WORKGROUP_SIZE, 1, 1]));
        }
    }
}
