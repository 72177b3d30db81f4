//! Shaders without a GPU: every piece validates, and its layout is the host's.

use rodsweep::gpu::{KERNELS, Kernel, Piece, SETTINGS_MEMBERS, Value, WORKGROUP_SIZE, check, specialisation};
use rodsweep::model::{BLOCK, Parameter, Plan, PlanOptions, Stepper, Terms};

mod common;

const IDLE: &str = "@compute @workgroup_size(WORKGROUP)\nfn idle(@builtin(global_invocation_id) id: vec3<u32>) {\n    \
                    if select_sample(id.x) { store_status(STATUS_OK); }\n}\n";

fn plans() -> Vec<Plan> {
    let scene = common::scenes::catheter();
    let mut plans = Vec::new();
    for stepper in Stepper::ALL {
        let options = PlanOptions { stepper, ..PlanOptions::default() };
        plans.push(Plan::single(&scene, &[], options).unwrap());
        let axes = common::scenes::parameters(&scene, &["coil.current", "loads.tip_force"]);
        let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
        let wrt = common::scenes::parameters(&scene, &["coil.current", "insertion", "distal.youngs_modulus"]);
        plans.push(Plan::new(&scene, &axes, &wrt, options).unwrap());
    }
    plans
}

/// Parameters to differentiate by: none, one of each kind alone, all.
fn derivatives(plan: &Plan) -> Vec<Vec<Parameter>> {
    let kinds = [
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
    let alone = kinds.iter().map(|name| common::scenes::parameters(&plan.scene, &[name]));
    let mut lists: Vec<Vec<Parameter>> = alone.collect();
    lists.push(Vec::new());
    lists.push(Parameter::all(&plan.scene));
    lists
}

#[test]
fn the_prelude_validates_and_has_the_layout_of_the_host() {
    for plan in plans() {
        let piece = Piece { name: "idle.wgsl".into(), text: IDLE.into() };
        expect_layout(&Kernel::custom("idle", &[piece], &plan).unwrap());
    }
}

fn expect_layout(kernel: &Kernel) {
    let reflection = check(&kernel.source).unwrap_or_else(|error| panic!("{error}\n{}", kernel.source.text));
    let members = reflection.members("Settings").unwrap();
    let members: Vec<_> = members.iter().map(|(name, offset)| (name.as_str(), *offset)).collect();
    assert_eq!(members, SETTINGS_MEMBERS);
    let bindings = reflection.bindings();
    let bindings: Vec<_> = bindings.iter().map(|(group, index, name)| (*group, *index, name.as_str())).collect();
    assert_eq!(bindings, [(0, 0, "settings"), (0, 1, "constants"), (0, 2, "inputs"), (0, 3, "outputs")]);
    assert_eq!(reflection.workgroup_size(kernel.entry_point), Some([WORKGROUP_SIZE, 1, 1]));
    assert_eq!(BLOCK % WORKGROUP_SIZE as usize, 0);
}

#[test]
fn every_kernel_validates_for_every_combination_of_terms() {
    let mut count = 0;
    for plan in plans().into_iter().step_by(2) {
        for bits in 0..1 << 6 {
            let bit = |k: usize| bits >> k & 1 == 1;
            let terms = Terms {
                force: bit(0),
                load: bit(1),
                anisotropic: bit(2),
                tip_moment: bit(3),
                dipole: bit(4),
                ..Terms::default()
            };
            if terms.load && !terms.force {
                continue;
            }
            let wrt = if bit(5) { Parameter::all(&plan.scene) } else { Vec::new() };
            let mut plan = Plan::single(&plan.scene, &wrt, plan.options).unwrap();
            plan.terms = terms;
            for arm in [true, false] {
                plan.scene.rigid_force_arm = arm;
                if !terms.dipole {
                    plan.segments.iter_mut().for_each(|segment| segment.has_dipole = false);
                }
                validate(&plan);
                count += 1;
            }
        }
    }
    assert_eq!(count, 2 * 48 * 2);
}

#[test]
fn every_kernel_validates_for_every_kind_of_derivative() {
    for plan in plans() {
        for wrt in derivatives(&plan) {
            let axes: Vec<Vec<Parameter>> = plan.axes.clone();
            validate(&Plan::new(&plan.scene, &axes, &wrt, plan.options).unwrap());
        }
    }
}

#[test]
fn a_rod_of_one_segment_and_one_of_many_validate() {
    let mut scene = common::scenes::catheter();
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
    for entry in KERNELS {
        let kernel = Kernel::new(entry, plan).unwrap();
        if let Err(error) = check(&kernel.source) {
            panic!("{error}\n{:?} {:?}", plan.terms, plan.options);
        }
        expect_layout(&kernel);
    }
}

#[test]
fn a_plan_names_its_terms() {
    let plan = &plans()[1];
    let terms = specialisation(plan).terms;
    let holds = |name: &str| terms[name];
    assert!(holds("DIPOLE") && holds("FORCE") && holds("RECIPROCITY") && !holds("LOAD"));
    assert!(holds("FLEXIBLE[0]") && !holds("FLEXIBLE[1]"));
    assert!(holds("WANT_INSERTION") && holds("WANT_DIPOLE") && holds("WANT_STIFFNESS"));
    assert!(!holds("WANT_TIP_FORCE") && !holds("WANT_LENGTH"));
    assert!(holds("COLLECT_STRAIN") && holds("COLLECT_DIPOLE") && !holds("COLLECT_LOAD") && !holds("COLLECT_FIELD"));
    assert!(!holds("FORWARD") && !holds("FREE"));
    // Flexible, rigid, flexible with integrals.
    assert_eq!(specialisation(plan).constants["FLAGS"], Value::u32_array([1, 0, 17]));
    assert!(holds("A[0][1][0]") && !holds("A[0][2][0]") && holds("B[0][3]"));
}
