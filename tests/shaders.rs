//! Shaders without a GPU: every piece validates, and its layout is the host's.

use rodsweep::gpu::{KERNELS, Kernel, Piece, SETTINGS_MEMBERS, WORKGROUP_SIZE, check, specialisation};
use rodsweep::model::{BLOCK, Plan, PlanOptions, Stepper};

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

#[test]
fn the_prelude_validates_and_has_the_layout_of_the_host() {
    for plan in plans() {
        let piece = Piece { name: "idle.wgsl".into(), text: IDLE.into() };
        let kernel = Kernel::custom("idle", &[piece], &plan).unwrap();
        let reflection = check(&kernel.source).unwrap_or_else(|error| panic!("{error}\n{}", kernel.source.text));
        let members = reflection.members("Settings").unwrap();
        let members: Vec<_> = members.iter().map(|(name, offset)| (name.as_str(), *offset)).collect();
        assert_eq!(members, SETTINGS_MEMBERS);
        let bindings = reflection.bindings();
        let bindings: Vec<_> = bindings.iter().map(|(group, index, name)| (*group, *index, name.as_str())).collect();
        assert_eq!(bindings, [(0, 0, "settings"), (0, 1, "constants"), (0, 2, "inputs"), (0, 3, "outputs")]);
        assert_eq!(reflection.workgroup_size("idle"), Some([WORKGROUP_SIZE, 1, 1]));
        assert_eq!(BLOCK % WORKGROUP_SIZE as usize, 0);
    }
}

#[test]
fn every_kernel_validates_for_every_plan() {
    for plan in plans() {
        for entry in KERNELS {
            let kernel = Kernel::new(entry, &plan).unwrap();
            let reflection = check(&kernel.source).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(reflection.workgroup_size(kernel.entry_point), Some([WORKGROUP_SIZE, 1, 1]));
        }
    }
}

#[test]
fn a_plan_names_its_terms() {
    let plan = &plans()[1];
    let terms = specialisation(plan).terms;
    let holds = |name: &str| terms[name];
    assert!(holds("DIPOLE") && holds("FORCE") && holds("DERIVATIVES") && !holds("LOAD"));
    assert!(holds("FLEXIBLE[0]") && !holds("FLEXIBLE[1]") && holds("DIPOLE[1]") && !holds("DIPOLE[0]"));
    assert!(holds("WANT_INSERTION") && holds("WANT_DIPOLE") && holds("WANT_STIFFNESS"));
    assert!(!holds("WANT_TIP_FORCE") && !holds("WANT_LENGTH"));
    assert!(holds("COLLECT_CURVATURE") && holds("COLLECT_COIL") && !holds("COLLECT_LOAD") && !holds("COLLECT_LENGTH"));
    assert!(holds("A[0][1][0]") && !holds("A[0][2][0]") && holds("B[0][3]"));
}
