//! What a scene costs depends on what it uses: counted operations of the kernels, plan by plan.

use rodsweep::backend::Precision;
use rodsweep::cpu::{Cpu, PassOperations};
use rodsweep::input::parse_scene;
use rodsweep::model::{Parameter, Plan, PlanOptions, Scene, Sensitivity, Stepper};
use std::path::Path;

const STIFFNESS: &str = "stiffness = { bending = 4e-5, torsion = 3e-5 }";
const STEPS: usize = 12;

/// A catheter with a coil; what is put into its proximal segment and its loads.
fn scene(proximal: &str, loads: &str) -> Scene {
    let text = format!(
        "[field]\nflux_density = [0, 3, 0]\n{loads}\n\
         [[segment]]\nname = \"proximal\"\nkind = \"flexible\"\nlength = 0.06\nlinear_density = 3e-4\n{proximal}\n\
         [[segment]]\nname = \"coil\"\nkind = \"rigid\"\nlength = 0.01\n\
         coil = {{ turns = [30, 30, 100], area = [46e-6, 46e-6, 11e-6], current = [0.02, 0.01, 0.03] }}\n\
         [[segment]]\nname = \"distal\"\nkind = \"flexible\"\nlength = 0.03\n{STIFFNESS}\n"
    );
    parse_scene(Path::new("scene"), &text).expect("a scene")
}

fn plan(scene: &Scene, wrt: &[&str], sensitivity: Sensitivity) -> Plan {
    let wrt: Vec<Parameter> = wrt.iter().flat_map(|name| Parameter::parse(scene, name).expect("a parameter")).collect();
    let options = PlanOptions {
        tolerance: 1e-9,
        stepper: Stepper::Dop853,
        steps: STEPS,
        sensitivity,
        base_moment_rows: false,
        ..PlanOptions::default()
    };
    Plan::single(scene, &wrt, options).expect("a plan")
}

fn count(plan: &Plan) -> PassOperations {
    let lanes = Cpu::new(plan, Precision::F64).expect("lanes");
    lanes.count_operations(&plan.batch(1, |_, _| {}), 0)
}

fn counted(proximal: &str, loads: &str, wrt: &[&str]) -> PassOperations {
    count(&plan(&scene(proximal, loads), wrt, Sensitivity::Auto))
}

/// Operations of each kind of pass.
fn totals(operations: &PassOperations) -> [u64; 4] {
    let PassOperations { path, chord, answer, check, .. } = operations;
    [path, chord, answer, check].map(|operations| operations.total())
}

#[track_caller]
fn assert_cheaper(less: &PassOperations, more: &PassOperations) {
    let (less, more) = (totals(less), totals(more));
    assert!(less.iter().zip(more).all(|(less, more)| *less < more), "{less:?} {more:?}");
}

const FORCE: &str = "[loads]\ntip_force = [1e-3, 0, 0]";
const WEIGHT: &str = "[loads]\ngravity = [0, 0, -9.81]";
/// Derivatives by which the distal part is integrated, whatever loads it.
const ALL_ALONG: [&str; 2] = ["coil.current", "loads.tip_force"];

#[test]
fn terms_cost_only_where_they_are() {
    let plain = counted(STIFFNESS, "", &ALL_ALONG);
    let force = counted(STIFFNESS, FORCE, &ALL_ALONG);
    let weight = counted(STIFFNESS, WEIGHT, &ALL_ALONG);
    assert_cheaper(&plain, &force);
    assert_cheaper(&force, &weight);
    let anisotropic = "stiffness = { bending_x = 4e-5, bending_y = 5e-5, torsion = 3e-5 }";
    assert_cheaper(&force, &counted(anisotropic, FORCE, &ALL_ALONG));
    // Against the anisotropic kernel, of which the rarely used terms are an extension.
    let anisotropic = counted(anisotropic, FORCE, &ALL_ALONG);
    for term in [
        "stiffness_axial = 3.0",
        "rest_curvature = [{ at = 0, value = [1, 2, 3] }, { at = 0.06, value = [4, 5, 6] }]",
        "dipole_per_length = [0, 0, 1e-3]",
    ] {
        let with = counted(&format!("{STIFFNESS}\n{term}"), FORCE, &ALL_ALONG);
        assert!(totals(&with)[2] > totals(&anisotropic)[2], "{term}");
    }
}

#[test]
fn a_dead_tip_moment_adds_nothing_along_the_rod() {
    let moment = "[loads]\ntip_moment = [1e-5, 0, 0]";
    assert_eq!(totals(&counted(STIFFNESS, "", &ALL_ALONG))[1], totals(&counted(STIFFNESS, moment, &ALL_ALONG))[1]);
}

#[test]
fn an_unloaded_distal_part_is_closed_form() {
    let scene = scene(STIFFNESS, "");
    let free = plan(&scene, &["coil.current", "insertion", "distal.stiffness"], Sensitivity::Auto);
    assert_eq!(free.free.map(|free| free.segment), Some(2));
    let integrated = plan(&scene, &ALL_ALONG, Sensitivity::Auto);
    assert_eq!(integrated.free, None);
    let (free, integrated) = (totals(&count(&free)), totals(&count(&integrated)));
    // A third of the flexible length, and so of the steps, lies beyond the coil.
    for (pass, (free, integrated)) in free.iter().zip(integrated).enumerate() {
        let share = *free as f64 / integrated as f64;
        assert!((0.55..0.8).contains(&share), "pass {pass}: {share}");
    }
}

#[test]
fn derivatives_cost_what_they_need() {
    let none = counted(STIFFNESS, FORCE, &[]);
    let currents = counted(STIFFNESS, FORCE, &["coil.current"]);
    let many = counted(STIFFNESS, FORCE, &["coil.current", "coil.turns", "coil.area", "coil.alignment", "insertion"]);
    let integrals = counted(STIFFNESS, FORCE, &["coil.current", "proximal.rest_curvature", "proximal.stiffness"]);
    // Only the last pass knows of derivatives.
    for other in [&currents, &many, &integrals] {
        assert_eq!((none.path, none.chord, none.check), (other.path, other.chord, other.check));
    }
    let [none, currents, many, integrals] = [none, currents, many, integrals].map(|o| o.answer.total() as f64);
    // Three columns more for the first derivative, hardly anything for the next ten, integrals where there are some.
    assert!((1.4..2.0).contains(&(currents / none)), "{none} {currents}");
    assert!(many < 1.03 * currents, "{currents} {many}");
    assert!((1.03..1.5).contains(&(integrals / currents)), "{currents} {integrals}");
}

#[test]
fn the_cheaper_way_to_differentiate_is_chosen() {
    let bent = format!(
        "{STIFFNESS}\nrest_curvature = [{{ at = 0.01, value = [1, 2, 3] }}, {{ at = 0.05, value = [4, 5, 6] }}]"
    );
    for (scene, wrt) in [
        (scene(STIFFNESS, FORCE), &["coil.current.x"][..]),
        (scene(STIFFNESS, FORCE), &["coil.current", "insertion", "loads.tip_force"]),
        (scene(STIFFNESS, FORCE), &["proximal.rest_curvature"]),
        (scene(STIFFNESS, FORCE), &["proximal.rest_curvature", "proximal.stiffness"]),
        (scene(&bent, FORCE), &["coil.current"]),
        (scene(&bent, FORCE), &["proximal.rest_curvature.node_1"]),
        (scene(&bent, FORCE), &["proximal.rest_curvature.node_2.x", "insertion"]),
        (scene(&bent, FORCE), &["proximal.rest_curvature", "distal.stiffness.bending"]),
    ] {
        let of = |sensitivity| count(&plan(&scene, wrt, sensitivity)).answer.total();
        let (forward, reciprocity) = (of(Sensitivity::Forward), of(Sensitivity::Reciprocity));
        // Within a twentieth either will do.
        let bound = forward.min(reciprocity) as f64 * 1.05;
        assert!(of(Sensitivity::Auto) as f64 <= bound, "{wrt:?}: forward {forward}, reciprocity {reciprocity}");
    }
}

#[test]
fn without_the_force_arm_only_forward_columns_hold() {
    let mut scene = scene(STIFFNESS, FORCE);
    scene.rigid_force_arm = false;
    assert!(plan(&scene, &["coil.current", "insertion", "loads.tip_force"], Sensitivity::Auto).forward);
    let wrt = [Parameter::Insertion];
    let options = PlanOptions { sensitivity: Sensitivity::Reciprocity, ..PlanOptions::default() };
    assert!(Plan::single(&scene, &wrt, options).is_err());
}
