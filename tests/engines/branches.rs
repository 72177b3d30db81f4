//! Every equilibrium: the search from many base moments against complete lists.

use crate::common::golden;
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{Plan, PlanOptions, Quantity, Scene, Stepper};
use rodsweep::reference::energy;
use rodsweep::sweep::{BranchSearch, BranchTools, Branches};

fn lanes(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::new(plan, Precision::F64)?))
}

pub fn branches(scene: &Scene) -> Branches {
    let options = PlanOptions { tolerance: 1e-9, stepper: Stepper::Dop853, steps: 16, ..PlanOptions::default() };
    let plan = Plan::single(scene, &[], options).expect("a plan");
    let batch = plan.batch(1, |_, _| {});
    let from_rest = lanes(&plan).expect("lanes").solve(&batch).expect("solutions");
    let tools = BranchTools { engine: &lanes, finisher: &lanes, energy: &|rod, base| energy(rod, base) };
    let found = BranchSearch::new(&plan, tools).expect("a search").find(&batch, &from_rest, &|| false);
    found.expect("solutions").expect("an end")
}

pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn the_golden_lists_are_found() {
    let (mut known, mut found) = (0, 0);
    let (mut missing, mut more) = (Vec::new(), Vec::new());
    for case in golden::stability() {
        let branches = branches(&case.scene);
        let solutions = &branches.solutions;
        for row in 0..solutions.sample_count() {
            let (m0, estimate) =
                (solutions.vector(row, Quantity::BaseMoment), solutions.get(row, Quantity::ErrorEstimate));
            let size = distance(m0, [0.0; 3]);
            if case.equilibria.iter().all(|(other, ..)| distance(*other, m0) > 1e-6 * size) {
                assert!(estimate < 1e-6, "{}: {estimate:e}", case.scene.name);
                more.push(case.scene.name.clone());
            }
        }
        assert!(branches.samples[0].balanced, "{}", case.scene.name);
        for (m0, _, p_tip, index) in &case.equilibria {
            known += 1;
            let size = distance(*m0, [0.0; 3]);
            let row = (0..solutions.sample_count())
                .find(|row| distance(solutions.vector(*row, Quantity::BaseMoment), *m0) < 1e-6 * size + 1e-15);
            match row {
                Some(row) => {
                    found += 1;
                    let error = distance(solutions.vector(row, Quantity::TipPosition), *p_tip);
                    assert!(error < 1e-6 * case.scene.total_length(), "{}: {error:e}", case.scene.name);
                    let of_row = solutions.get(row, Quantity::StabilityIndex) as usize;
                    assert_eq!(of_row, *index, "{}", case.scene.name);
                }
                None => missing.push(format!("{} index {index}", case.scene.name)),
            }
        }
    }
    assert_eq!(missing, [""; 0], "{found} of {known} found");
    // What the lists lack: a pair of opposite signs.
    assert_eq!(more, ["stab_dev_10_FA", "stab_dev_10_FA"]);
}

#[test]
fn one_equilibrium_is_one() {
    let scene = rodsweep::input::parse_scene(
        "scene".as_ref(),
        "[[segment]]\nname = \"rod\"\nkind = \"flexible\"\nlength = 0.1\n\
         stiffness = { bending = 4e-5, torsion = 3e-5 }\nrest_curvature = [3, 1, 2]\n",
    );
    let branches = branches(&scene.expect("a scene"));
    assert_eq!(branches.solutions.sample_count(), 1);
    assert!(branches.samples[0].balanced && branches.branches[0].from_rest);
    assert!(branches.solutions.status(0).is_success());
}

/// A search depends on the rod alone.
#[test]
fn a_search_can_be_repeated() {
    let case = &golden::stability()[3];
    let (first, second) = (branches(&case.scene), branches(&case.scene));
    assert_eq!((&first.branches, &first.samples), (&second.branches, &second.samples));
    for row in 0..first.solutions.sample_count() {
        let tip = |branches: &Branches| branches.solutions.vector(row, Quantity::TipPosition).map(f64::to_bits);
        assert_eq!(tip(&first), tip(&second), "row {row}");
    }
}
