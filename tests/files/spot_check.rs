//! The spot check beside a run, with a small analytic backend.

use crate::arc::{Arc, arc, options, shipped, small};
use crate::common::runs::{manifest_of, run_into};
use rodsweep::backend::{Backend, BackendError, BackendKind};
use rodsweep::model::Plan;
use rodsweep::results::SpotCheck;
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::{RunOptions, SpotCheckOptions, SweepError};
use std::sync::atomic::AtomicBool;

/// Samples are checked as their rows come by: what is found is that of the sweep, not of its batches, parts or shards.
#[test]
fn the_spot_check_depends_on_the_samples_alone() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let trusted = |plan: &Plan| Ok(Box::new(Arc { fails: false, ..Arc::new(plan) }) as Box<dyn Backend>);
    let found = |name: &str, batch_size: usize, changed: RunOptions| {
        let options = RunOptions { trusted: Some(&trusted), ..changed };
        let mut engine = Arc { batch_size, offset: 0.943e-3, ..arc(&spec) };
        let summary = run_into(&dir.path().join(name), &spec, &mut engine, &options).unwrap();
        let manifest = manifest_of(&dir.path().join(name));
        assert_eq!(manifest["spot_check"], serde_json::to_value(&summary.spot_check).unwrap(), "{name}");
        summary.spot_check
    };
    let whole = found("whole", 700, options()).unwrap();
    assert!(whole.checked == 256 && whole.compared > 0, "{whole:?}");
    for (batch_size, chunk) in [(1, 1000), (4999, 1000), (700, 37), (100_000, 5000)] {
        let other = found(&format!("{batch_size}-{chunk}"), batch_size, RunOptions { chunk, ..options() });
        assert_eq!(other.as_ref(), Some(&whole), "{batch_size} {chunk}");
    }
    let shards = (1..=3).map(|k| Shard::parse(&format!("{k}/3")).unwrap());
    let of_shards =
        shards.map(|shard| found(&shard.to_string().replace('/', "-"), 700, RunOptions { shard, ..options() }));
    let checks: Vec<_> = of_shards.flatten().collect();
    let sum = |of: fn(&SpotCheck) -> u64| checks.iter().map(of).sum::<u64>();
    assert_eq!(sum(|check| check.checked), whole.checked);
    assert_eq!(sum(|check| check.compared), whole.compared);
    assert_eq!(sum(|check| check.only_trusted), whole.only_trusted);
    assert!(checks.iter().any(|check| check.worst_sample == whole.worst_sample));
}

/// A scene says how many samples are checked at least, not the clock.
#[test]
fn what_takes_the_reference_long_is_checked_less() {
    let least = |file: &str| SpotCheckOptions::of(&SweepSpec::read(&shipped().join(file)).expect(file).scene).least;
    for file in ["two_coil.toml", "insertion.toml", "stiffness.toml", "branches.toml"] {
        assert_eq!(least(file), 256, "{file}");
    }
    for file in ["arm_magnet.toml", "coil_array.toml"] {
        assert_eq!(least(file), 64, "{file}");
    }
    for (bench, expected) in [("weight", 256), ("limp", 64), ("taut", 64), ("magnet", 64)] {
        let file = shipped().join("bench").join(bench).with_extension("toml");
        let spec = rodsweep_bench::BenchSpec::read(&file).expect(bench);
        assert_eq!(SpotCheckOptions::of(&spec.sweep.scene).least, expected, "{bench}");
    }
}

#[test]
fn a_spot_check_that_fails_fails_the_run_and_one_of_a_run_cut_short_is_none() {
    let spec = small("parquet");
    let dir = tempfile::tempdir().unwrap();
    let unsupported = || BackendError::Unsupported {
        backend: BackendKind::Reference,
        what: "everything".into(),
        remedy: "none".into(),
    };
    let broken = |_: &Plan| -> Result<Box<dyn Backend>, BackendError> { Err(unsupported()) };
    let options = || RunOptions { trusted: Some(&broken), ..options() };
    let failed = run_into(&dir.path().join("out"), &spec, &mut arc(&spec), &options());
    assert!(matches!(failed, Err(SweepError::Backend(_))), "{failed:?}");
    let flag = AtomicBool::new(true);
    let cut = RunOptions { interrupt: Some(&flag), ..options() };
    let summary = run_into(&dir.path().join("cut"), &spec, &mut arc(&spec), &cut).unwrap();
    assert!(summary.interrupted && summary.spot_check.is_none());
}
