//! Every byte of a run is covered by a checksum that is read, and shards are put together only where they fit.

use crate::arc::{arc, contents, options, parts, small};
use crate::common::root;
use crate::common::runs::{resume_in, run_into, status_of};
use rodsweep::input::{read_input_table, read_scene};
use rodsweep::results::{DirectoryStatus, Results, ResultsError, merge};
use rodsweep::spec::{Shard, SweepSpec};
use rodsweep::sweep::{RunOptions, SweepError};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use tempfile::TempDir;

/// Whether what was done with the flipped file is an error.
type Notices<'a> = &'a dyn Fn() -> bool;

/// Flips a bit of every so many bytes of a file; each flip has to be noticed.
fn flip(path: &Path, step: usize, notices: Notices) {
    let whole = fs::read(path).unwrap();
    for at in (0..whole.len()).step_by(step) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at / step % 8);
        fs::write(path, &flipped).unwrap();
        assert!(notices(), "{}: bit {} of byte {at} of {}", path.display(), at / step % 8, whole.len());
    }
    fs::write(path, whole).unwrap();
    assert!(!notices(), "{}: the whole file is refused", path.display());
}

fn a_run(format: &str, samples: u64) -> (TempDir, SweepSpec) {
    let spec = SweepSpec { sample_count: samples, ..small(format) };
    let dir = tempfile::tempdir().unwrap();
    run_into(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    (dir, spec)
}

#[test]
fn a_flipped_bit_of_a_part_is_noticed() {
    for format in ["parquet", "csv", "npz"] {
        let (dir, spec) = a_run(format, 30);
        let is_damaged = || status_of(dir.path()).unwrap().damaged.len() == 1;
        let files = fs::read_dir(dir.path()).unwrap().map(|entry| entry.unwrap().path());
        let files: Vec<PathBuf> =
            files.filter(|path| path.file_name().unwrap().to_string_lossy().starts_with("part-")).collect();
        assert_eq!(files.len(), if format == "parquet" { 1 } else { 2 }, "{files:?}");
        let before = contents(dir.path());
        for file in files {
            flip(&file, fs::metadata(&file).unwrap().len() as usize / 700 + 1, &is_damaged);
            // The last byte that a column's name has, or a count: the run solves the part again.
            let mut bytes = fs::read(&file).unwrap();
            let at = bytes.len() * 3 / 4;
            bytes[at] ^= 1;
            fs::write(&file, bytes).unwrap();
            let summary = resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
            assert_eq!((summary.quarantined.len(), summary.solved), (1, 30), "{}", file.display());
            assert!(contents(dir.path()) == before && status_of(dir.path()).unwrap().is_complete());
        }
    }
}

/// The first was found by a fuzzer: its footer says that 131 million flags are to be skipped. The crate counts through them.
#[test]
fn lists_longer_than_the_file_are_refused_unread() {
    let (dir, spec) = a_run("parquet", 30);
    let (before, part) = (contents(dir.path()), dir.path().join("part-0000000000.parquet"));
    fs::write(&part, include_bytes!("../data/found/part-list-of-flags")).unwrap();
    let longer = "a list has more entries than there are bytes";
    let damaged = status_of(dir.path()).unwrap().damaged;
    assert_eq!(damaged.len(), 1);
    assert!(damaged[0].0 == part && damaged[0].1.ends_with(&format!("in its footer, {longer}")), "{damaged:?}");
    let refused = Results::open(dir.path()).unwrap().read_part(0, &[]).unwrap_err();
    assert!(refused.to_string().contains("part-0000000000.parquet"), "{refused}");
    assert_eq!(resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap().quarantined.len(), 1);
    assert!(contents(dir.path()) == before && status_of(dir.path()).unwrap().is_complete());
    // Its page is made of a list of 124 million numbers that stands in the place of a structure.
    let table = dir.path().join("inputs.parquet");
    fs::write(&table, include_bytes!("../data/found/parquet-skipped-list")).unwrap();
    let scene = read_scene(&root().join("sweeps/scenes/p6.toml")).unwrap();
    let refused = read_input_table(&table, &scene).unwrap_err().to_string();
    assert!(refused.starts_with(&table.display().to_string()), "{refused}");
    assert!(refused.ends_with("in a page header, a field has a type that it cannot have"), "{refused}");
}

#[test]
fn a_flipped_bit_of_what_the_run_is_is_noticed() {
    let (dir, _) = a_run("parquet", 30);
    flip(&dir.path().join("sweep.toml"), 1, &|| status_of(dir.path()).is_err());
    // A number may be written in several ways.
    let path = dir.path().join("run.json");
    let (whole, record) = (fs::read(&path).unwrap(), status_of(dir.path()).unwrap().record);
    for at in 0..8 * whole.len() {
        let mut flipped = whole.clone();
        flipped[at / 8] ^= 1 << (at % 8);
        fs::write(&path, &flipped).unwrap();
        assert!(!status_of(dir.path()).is_ok_and(|status| status.record != record), "bit {at}");
    }
}

/// A shard of a sweep without rows, in a directory of its own.
fn shard(text: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    run_shard(dir.path(), text).unwrap();
    dir
}

fn run_shard(dir: &Path, text: &str) -> Result<(), SweepError> {
    let spec = small("none");
    let options = RunOptions { shard: Shard::parse(text).unwrap(), ..options() };
    resume_in(dir, &spec, &mut arc(&spec), &options).map(|_| ())
}

fn merged(dirs: &[&TempDir]) -> Result<(DirectoryStatus, u64), ResultsError> {
    let out = tempfile::tempdir().unwrap();
    let dirs: Vec<PathBuf> = dirs.iter().map(|dir| dir.path().into()).collect();
    let status = merge(&dirs, out.path())?;
    let results = Results::open(out.path())?;
    let voxels = results.voxels(0.0)?.numbers("count").unwrap().iter().sum::<f64>() as u64;
    assert_eq!(results.status()?.counts, status.counts);
    Ok((status, voxels))
}

#[test]
fn shards_without_rows_are_merged_only_where_they_fit() {
    let [one, two, third] = ["1/2", "2/2", "3/3"].map(shard);
    let (status, voxels) = merged(&[&one, &two]).unwrap();
    assert_eq!((status.samples_done, status.is_complete()), (5000, true));
    let usable = status.counts.iter().sum::<u64>() - status.failed();
    assert_eq!(voxels, usable);
    let refused = |dirs: &[&TempDir], words: &str| {
        let error = merged(dirs).unwrap_err();
        assert!(matches!(error, ResultsError::Unmergeable { .. }) && !error.is_usage(), "{error:?}");
        assert!(error.to_string().contains(words), "{error}");
    };
    refused(&[&one, &two, &third], "shard 3/3, where the first is one of 2");
    refused(&[&one, &third], "shard 3/3");
    refused(&[&one, &one], "it is shard 1/2, as ");
    refused(&[&two], "shard 1/2 is missing");
    let whole = tempfile::tempdir().unwrap();
    merge(&[one.path().into(), two.path().into()], whole.path()).unwrap();
    refused(&[&whole, &two], "of shards put together");
    for name in ["workspace.parquet", "tips.parquet"] {
        let path = two.path().join(name);
        let step = fs::metadata(&path).unwrap().len() as usize / 400 + 1;
        flip(&path, step, &|| merged(&[&one, &two]).is_err());
        let own = fs::read(&path).unwrap();
        fs::copy(one.path().join(name), &path).unwrap();
        refused(&[&one, &two], "tips.parquet is not");
        fs::remove_file(&path).unwrap();
        refused(&[&one, &two], &format!("{name} is missing"));
        fs::write(&path, own).unwrap();
    }
    let manifest = two.path().join("manifest.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replace("\"complete\": true", "\"complete\": false")).unwrap();
    refused(&[&one, &two], "manifest.json");
}

#[test]
fn a_shard_without_rows_is_not_overwritten_by_another() {
    let one = shard("1/2");
    let files = ["workspace.parquet", "tips.parquet", "manifest.json"].map(|name| one.path().join(name));
    let before = files.clone().map(|path| fs::read(path).unwrap());
    let refuse = || {
        let error = run_shard(one.path(), "2/2").unwrap_err();
        assert!(error.is_usage(), "{error}");
        assert!(error.to_string().contains("its shard is 1/2, here it is 2/2"), "{error}");
    };
    refuse();
    assert!(files.clone().map(|path| fs::read(path).unwrap()) == before, "shard 1/2 has changed");
    fs::remove_file(&files[2]).unwrap();
    refuse();
    run_shard(one.path(), "1/2").unwrap();
    merged(&[&one, &shard("2/2")]).unwrap();
}

#[test]
fn the_status_of_a_run_without_rows_is_that_of_its_tables() {
    let dir = shard("1/1");
    let whole = status_of(dir.path()).unwrap();
    assert_eq!((whole.samples_done, whole.counts.iter().sum::<u64>(), whole.is_complete()), (5000, 5000, true));
    let path = dir.path().join("workspace.parquet");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
    let cut = status_of(dir.path()).unwrap();
    assert_eq!((cut.damaged.len(), cut.is_complete()), (1, false));
    assert!(matches!(Results::open(dir.path()).unwrap().voxels(0.0), Err(ResultsError::Damaged { .. })));
    fs::remove_file(&path).unwrap();
    assert!(!status_of(dir.path()).unwrap().is_complete());
}

#[test]
fn an_incomplete_result_is_not_merged() {
    let (dir, spec) = a_run("parquet", 5000);
    let out = tempfile::tempdir().unwrap();
    let part = dir.path().join(&parts(dir.path())[3]);
    let whole = fs::read(&part).unwrap();
    fs::write(&part, &whole[..whole.len() / 2]).unwrap();
    let error = merge(&[dir.path().into()], out.path()).unwrap_err();
    assert!(matches!(&error, ResultsError::Damaged { path, .. } if *path == part) && !error.is_usage(), "{error:?}");
    fs::remove_file(&part).unwrap();
    let error = merge(&[dir.path().into()], out.path()).unwrap_err();
    assert!(matches!(error, ResultsError::MissingParts { count: 1, total: 5, first: 3 }), "{error:?}");
    resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    assert!(merge(&[dir.path().into()], out.path()).unwrap().is_complete());
    assert_eq!(contents(dir.path()), contents(out.path()));
}

/// Only what is provably ours is removed.
#[test]
fn hidden_files_of_the_user_stay() {
    let (dir, spec) = a_run("parquet", 5000);
    let names = [".notes.tmp-2024", ".part-0000000000.parquet.tmp-17-3", ".x.writing"];
    for name in names {
        let file = fs::File::create(dir.path().join(name)).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(10_800)).unwrap();
    }
    resume_in(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    assert!(names.iter().all(|name| dir.path().join(name).is_file()));
}
