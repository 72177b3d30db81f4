//! The verdict on a run: what speaks against its rows stands until they are solved again, and adds up over shards.

use crate::arc::{Arc, arc, options, small};
use crate::common::runs::{manifest_of, resume_in, run_into};
use rodsweep::backend::{Backend, BackendError};
use rodsweep::model::{Plan, PlanOptions};
use rodsweep::results::{DoubtKind, Results, Verdict, merge};
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::RunOptions;
use std::fs;
use std::path::Path;

fn truth(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Arc { fails: false, ..Arc::new(plan) }))
}

fn checked<'a>() -> RunOptions<'a> {
    RunOptions { trusted: Some(&truth), ..options() }
}

/// Off by a hundredth of the rod's length, which it does not know.
fn wrong(spec: &SweepSpec) -> Arc {
    Arc { offset: 0.943e-3, fails: false, ..arc(spec) }
}

fn right(spec: &SweepSpec) -> Arc {
    Arc { fails: false, ..arc(spec) }
}

fn verdict_of(dir: &Path) -> Verdict {
    Results::open(dir).unwrap().verdict().unwrap().expect("a verdict")
}

#[test]
fn what_was_seen_stands_until_the_rows_are_solved_again() {
    for format in ["parquet", "csv"] {
        let spec = small(format);
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path().join("out");
        let summary = run_into(&dir, &spec, &mut wrong(&spec), &checked()).unwrap();
        assert!(!summary.verdict.sound);
        let doubt = summary.verdict.doubt(DoubtKind::RowsElsewhere).expect("rows elsewhere");
        assert_eq!((doubt.samples, doubt.of, doubt.seen.len()), (256, 256, 256));
        assert!((doubt.how_far - 0.01).abs() < 2e-3, "{}", doubt.how_far);
        let names: Vec<&str> = doubt.inputs.iter().map(|input| input.name.as_str()).collect();
        assert_eq!(names, ["coil.current.x", "proximal.youngs_modulus", "distal.youngs_modulus"]);
        assert!(doubt.inputs[0].from < -0.09 && doubt.inputs[0].to > 0.09 && doubt.inputs[0].unit == "A");
        assert_eq!(manifest_of(&dir)["verdict"]["sound"], false);
        assert!(dir.join("distrusted-rows-elsewhere.toml").exists());
        // Finished: to go on changes nothing, and says the same.
        let before = fs::read(dir.join("manifest.json")).unwrap();
        let again = resume_in(&dir, &spec, &mut wrong(&spec), &checked()).unwrap();
        assert_eq!((again.solved, &again.verdict), (0, &summary.verdict));
        assert_eq!(again.spot_check, summary.spot_check);
        assert!(again.worst_error_estimate > 0.0 && fs::read(dir.join("manifest.json")).unwrap() == before);
        // Without the account, the rows that are there are checked once more.
        fs::remove_file(dir.join("manifest.json")).unwrap();
        let found = resume_in(&dir, &spec, &mut right(&spec), &checked()).unwrap();
        assert_eq!(found.solved, 0);
        let doubt = found.verdict.doubt(DoubtKind::RowsElsewhere).expect("rows elsewhere");
        assert_eq!((doubt.samples, found.verdict.samples), (256, 5000));
        // Half of the rows are solved again, rightly.
        for part in 2..5 {
            fs::remove_file(dir.join(format!("part-{part:010}.{format}"))).unwrap();
        }
        let half = resume_in(&dir, &spec, &mut right(&spec), &checked()).unwrap();
        let doubt = half.verdict.doubt(DoubtKind::RowsElsewhere).expect("rows elsewhere");
        assert!(doubt.samples > 90 && doubt.seen.iter().all(|sample| *sample < 2000), "{doubt:?}");
        assert_eq!(half.verdict.checked, 256);
        for part in 0..2 {
            fs::remove_file(dir.join(format!("part-{part:010}.{format}"))).unwrap();
        }
        let whole = resume_in(&dir, &spec, &mut right(&spec), &checked()).unwrap();
        assert!(whole.verdict.sound && verdict_of(&dir).sound, "{:?}", whole.verdict.doubts);
    }
}

#[test]
fn verdicts_of_shards_add_up() {
    let spec = small("parquet");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let whole = run_into(&path("whole"), &spec, &mut wrong(&spec), &checked()).unwrap().verdict;
    let mut apart = Vec::new();
    for k in 1..=3 {
        let shard = Shard::parse(&format!("{k}/3")).unwrap();
        let options = RunOptions { shard, ..checked() };
        let dir = path(&format!("{k}"));
        run_into(&dir, &spec, &mut wrong(&spec), &options).unwrap();
        resume_in(&path("shared"), &spec, &mut wrong(&spec), &options).unwrap();
        apart.push(dir);
    }
    merge(&apart, &path("merged")).unwrap();
    let of = |verdict: &Verdict| {
        let doubt = verdict.doubt(DoubtKind::RowsElsewhere).expect("rows elsewhere").clone();
        (verdict.samples, verdict.checked, doubt.samples, doubt.seen, doubt.inputs, doubt.worst)
    };
    for name in ["merged", "shared", "whole"] {
        assert_eq!(of(&verdict_of(&path(name))), of(&whole), "{name}");
    }
    assert!(path("merged").join("distrusted-rows-elsewhere.toml").exists());
    let manifest = manifest_of(&path("shared"));
    assert_eq!(manifest["verdict"]["doubts"][0]["samples"], 256);
    // The whole takes in what shards have said.
    let again = resume_in(&path("shared"), &spec, &mut wrong(&spec), &checked()).unwrap();
    assert_eq!(of(&again.verdict), of(&whole));
    assert_eq!(of(&verdict_of(&path("shared"))), of(&whole));
}

#[test]
fn a_tolerance_that_is_missed_and_rows_that_fail_speak_too() {
    let spec = small("parquet");
    let folder = tempfile::tempdir().unwrap();
    let kinds = |name: &str, spec: &SweepSpec, engine: &mut Arc, options: &RunOptions| {
        let dir = folder.path().join(name);
        let verdict = run_into(&dir, spec, engine, options).unwrap().verdict;
        assert_eq!(verdict_of(&dir), verdict);
        verdict.doubts.iter().map(|doubt| (doubt.kind, doubt.samples)).collect::<Vec<_>>()
    };
    let coarse = spec.plan(PlanOptions { steps: 4, ..PlanOptions::default() }).unwrap();
    let mut engine = Arc { fails: false, ..Arc::new(&coarse) };
    assert_eq!(kinds("coarse", &spec, &mut engine, &options()), [(DoubtKind::ToleranceMissed, 5000)]);
    let failing = |name: &str, allow_failures: Option<f64>, max_failures: Option<u64>| {
        let spec = SweepSpec { allow_failures, ..spec.clone() };
        kinds(name, &spec, &mut arc(&spec), &RunOptions { max_failures, ..options() })
    };
    let found = failing("strict", None, None);
    let [(DoubtKind::TooManyFailures, failed)] = found[..] else { panic!("{found:?}") };
    assert!(failed > 10);
    assert_eq!(failing("share", Some(0.5), None), []);
    assert_eq!(failing("few", Some(1e-4), None), found);
    assert_eq!(failing("count", None, Some(failed)), []);
    assert_eq!(failing("one less", Some(0.5), Some(failed - 1)), found);
    // Wrong rows and rows that the reference has not.
    let found = kinds("both", &spec, &mut arc(&spec), &checked());
    assert_eq!(found[0].0, DoubtKind::FalseFailures, "{found:?}");
    let text =
        SweepSpec::parse("sweep.toml".as_ref(), &spec.to_toml().replace("branch =", "allow_failures = 0.2\nbranch ="));
    let text = text.unwrap();
    assert_eq!(text.allow_failures, Some(0.2));
    assert!(text.to_toml().contains("allow_failures = 0.2"));
}
