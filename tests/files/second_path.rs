//! Second paths beside a run: what becomes of rows whose ends differ, with a small analytic backend.

use crate::arc::{Arc, arc, options, small};
use crate::common::runs::{manifest_of, run_into};
use rodsweep::backend::{Backend, BackendError, BackendInfo};
use rodsweep::model::{Batch, Plan, Quantity, RodSegment, Solutions, Status};
use rodsweep::results::Results;
use rodsweep::sweep::{PathCheckOptions, RunOptions, SpotCheckOptions};

/// Leaves its branch where the coil's dipole along x is between two values (A·m²); may call it a fold, or not be sure.
struct Elsewhere {
    arc: Arc,
    from: f64,
    to: f64,
    says: Status,
}

impl Backend for Elsewhere {
    fn info(&self) -> BackendInfo {
        self.arc.info()
    }

    fn plan(&self) -> &Plan {
        self.arc.plan()
    }

    fn batch_size(&self) -> usize {
        self.arc.batch_size()
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let mut solutions = self.arc.solve(batch)?;
        for at in 0..batch.sample_count() {
            if (self.from..self.to).contains(&dipole(&self.arc.plan, batch, at)) {
                let [x, y, z] = solutions.vector(at, Quantity::TipPosition);
                solutions.set_vector(at, Quantity::TipPosition, [x + 0.02, y, z]);
                solutions.set_status(at, self.says);
            }
        }
        Ok(solutions)
    }
}

/// The coil's dipole along x.
fn dipole(plan: &Plan, batch: &Batch, at: usize) -> f64 {
    let rod = plan.sample_rod(batch, at);
    let rigid = rod.segments.iter().find_map(|segment| match segment {
        RodSegment::Rigid(rigid) => Some(rigid.dipole[0]),
        RodSegment::Flexible(_) => None,
    });
    rigid.expect("a coil")
}

/// The dipole by a current of 1 A.
fn per_ampere(plan: &Plan) -> f64 {
    let batch = plan.batch(1, |_, row| row.copy_from_slice(&[1.0, 5.5e6]));
    dipole(plan, &batch, 0)
}

fn sure(plan: &Plan) -> Arc {
    Arc { fails: false, ..Arc::new(plan) }
}

/// Leaves its branch between two currents (A).
fn elsewhere(plan: &Plan, from: f64, to: f64, says: Status) -> Elsewhere {
    let k = per_ampere(plan);
    Elsewhere { arc: sure(plan), from: k * from, to: k * to, says }
}

/// Of an engine that is wrong from 0 to 0.05 A, each third of the range meets a reference that knows better, a fold, and no
/// certain answer.
#[test]
fn rows_whose_ends_differ_are_decided_by_the_reference() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let follower = |plan: &Plan| Ok(Box::new(sure(plan)) as Box<dyn Backend>);
    let reference = |plan: &Plan| {
        let truth = elsewhere(plan, 0.02, 0.05, Status::Fold);
        Ok(Box::new(truth) as Box<dyn Backend>)
    };
    let run = |name: &str, rows: PathCheckOptions| {
        let options = RunOptions { trusted: Some(&reference), second_path: Some((&follower, rows)), ..options() };
        let plan = arc(&spec).plan;
        let mut engine = elsewhere(&plan, 0.0, 0.05, Status::Ramped);
        let out = dir.path().join(name);
        let summary = run_into(&out, &spec, &mut engine, &options).unwrap();
        assert_eq!(manifest_of(&out)["path_check"], serde_json::to_value(&summary.path_check).unwrap(), "{name}");
        (summary.path_check.unwrap(), Results::open(&out).unwrap().read(&[]).unwrap())
    };
    let (found, rows) = run("all", PathCheckOptions::All);
    let currents = rows.numbers("coil.current.x").unwrap();
    let count = |from: f64, to: f64| currents.iter().filter(|current| (from..to).contains(*current)).count() as u64;
    assert!(found.all && found.followed == 5000 && found.doubtful == 0 && found.confirmed == 0, "{found:?}");
    assert_eq!((found.elsewhere, found.past_fold), (count(0.0, 0.02), count(0.02, 0.05)));
    assert!(found.elsewhere > 100 && found.past_fold > 100);
    let first = found.sample.unwrap();
    assert_eq!(found.values[0], ("coil.current.x".to_owned(), currents[first as usize]));
    for (current, status) in currents.iter().zip(rows.statuses()) {
        let expected = match current {
            c if (0.0..0.02).contains(c) => Status::Refined,
            c if (0.02..0.05).contains(c) => Status::Fold,
            _ => Status::Ok,
        };
        assert_eq!(*status, expected, "{current}");
    }
    let (some, _) = run("share", PathCheckOptions::Share);
    assert!(!some.all && some.followed == 1024 && some.elsewhere > 20 && some.past_fold > 20, "{some:?}");
}

/// A second path that fails calls no right row into question, and a reference without an answer leaves the row doubtful.
#[test]
fn a_second_path_alone_condemns_no_row() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let follower = |plan: &Plan| Ok(Box::new(elsewhere(plan, 0.0, 0.05, Status::Ramped)) as Box<dyn Backend>);
    let run = |name: &str, says: Status| {
        let reference = move |plan: &Plan| {
            let says = elsewhere(plan, if says == Status::Ok { 1.0 } else { 0.0 }, 2.0, says);
            Ok(Box::new(says) as Box<dyn Backend>)
        };
        let second_path = Some((&follower as _, PathCheckOptions::All));
        let options = RunOptions { trusted: Some(&reference), second_path, ..options() };
        run_into(&dir.path().join(name), &spec, &mut sure(&arc(&spec).plan), &options).unwrap()
    };
    let confirmed = run("confirmed", Status::Ok).path_check.unwrap();
    assert!(confirmed.wrong() == 0 && confirmed.confirmed > 500, "{confirmed:?}");
    let doubtful = run("doubtful", Status::Doubtful);
    let found = doubtful.path_check.as_ref().unwrap();
    assert_eq!((found.doubtful, found.elsewhere), (confirmed.confirmed, 0), "{found:?}");
    assert_eq!(doubtful.count(Status::Doubtful), found.doubtful);
}

/// A row that the reference has solved is not led from rest again, and the reference is not asked twice.
#[test]
fn rows_of_the_reference_are_followed_no_more() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let fails = |plan: &Plan| Ok(Box::new(elsewhere(plan, 0.0, 0.05, Status::NotConverged)) as Box<dyn Backend>);
    let reference = |plan: &Plan| Ok(Box::new(sure(plan)) as Box<dyn Backend>);
    // It is wrong where the reference was asked, and is not followed there; elsewhere it is right.
    let follower = |plan: &Plan| Ok(Box::new(elsewhere(plan, 0.0, 0.05, Status::Ramped)) as Box<dyn Backend>);
    let nobody = |_: &Plan| -> Result<Box<dyn Backend>, BackendError> { panic!("the reference is asked again") };
    let options = RunOptions {
        refiners: vec![&fails, &reference],
        trusted: Some(&nobody),
        spot_check: SpotCheckOptions { share: 0.0, least: 0, most: 0 },
        second_path: Some((&follower, PathCheckOptions::All)),
        ..options()
    };
    let mut engine = elsewhere(&arc(&spec).plan, 0.0, 0.05, Status::NotConverged);
    let summary = run_into(dir.path(), &spec, &mut engine, &options).unwrap();
    let found = summary.path_check.unwrap();
    assert_eq!((found.followed, found.wrong(), found.doubtful), (5000, 0, 0), "{found:?}");
    assert!(found.confirmed == summary.refined && found.confirmed > 500, "{found:?} {}", summary.refined);
}
