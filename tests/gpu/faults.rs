//! What follows when a GPU fails: smaller dispatches, another attempt or the CPU, with a message, and every sample once.
//! Faults are injected where the real ones would appear, see `src/gpu/faults.rs`.

use crate::common::root;
use crate::common::runs::{manifest_of, read_columns};
use rodsweep::backend::{Backend, BackendError, Precision, ReduceJob, Reduced};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::testing::{Faults, Flip, device_or_skip};
use rodsweep::gpu::{Device, Gpu};
use rodsweep::model::{BLOCK, Plan, PlanOptions, Quantity, Stepper};
use rodsweep::reference::Reference;
use rodsweep::results::{SampleOrigin, TIPS_FILE, WORKSPACE_FILE, read_parquet_table};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{Fallback, ResultDirectory, RunOptions, Summary, run_with_fallback};
use rodsweep::table::Table;
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

const SAMPLES: usize = 4096;
const TOLERANCE: f64 = 2e-5;
/// Two blocks of samples a dispatch at most, so that a run has many; fewer where the device is slow.
const FEW_WORKGROUPS: Option<u32> = Some(8);
/// One block: every run has as many dispatches, whatever time they take.
const FEWEST_WORKGROUPS: Option<u32> = Some(4);
/// Dispatches that every run has after the first, which has no samples.
const CERTAIN_DISPATCHES: u64 = (SAMPLES / (2 * BLOCK)) as u64;

/// Every sample has an equilibrium, so that engines may differ by round-off only.
fn spec(format: &str) -> SweepSpec {
    let axis = |name: &str, most: f64| format!("[[axis]]\nparameter = \"{name}\"\nfrom = {}\nto = {most}\n", -most);
    let text = format!(
        "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = {SAMPLES}\nseed = 5\n{}{}\
         [output]\nformat = \"{format}\"\nderivatives = [\"coil.current\"]\n[workspace]\nvoxel = \"2 mm\"\n",
        axis("coil.current.x", 0.2),
        axis("coil.current.y", 0.2),
    );
    let file = root().join("sweeps/faults.toml");
    let mut spec = SweepSpec::parse(&file, &text).expect("the sweep reads");
    spec.tolerance = TOLERANCE;
    spec
}

fn plan(spec: &SweepSpec) -> Plan {
    let options = PlanOptions { stepper: Stepper::Rk4, steps: 16, tolerance: TOLERANCE, ..PlanOptions::default() };
    spec.plan(options).expect("it plans")
}

/// An engine whose device fails as planned; `None` without a GPU.
fn gpu(plan: &Plan, faults: Faults) -> Option<Result<Gpu, BackendError>> {
    device_or_skip("faults of a GPU")?;
    let device = Device::open_with_faults(None, faults).expect("it was there before");
    Some(Gpu::new(device, plan, Precision::F32).map(|gpu| gpu.with_counting(true)))
}

fn cpu(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::new(plan, Precision::F32)?))
}

fn trusted(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Reference::new(plan)))
}

/// Runs with the CPU to fall back on; what was told, and what came of it.
fn go(spec: &SweepSpec, backend: &mut dyn Backend, out: &Path) -> (Vec<String>, Summary) {
    let options = RunOptions { chunk: 500, trusted: Some(&trusted), ..RunOptions::new() };
    let told = RefCell::new(Vec::new());
    let tell = |error: &BackendError| told.borrow_mut().push(error.to_string());
    let fallback = Fallback { engine: &cpu, search: None, tell: &tell };
    let summary = run_with_fallback(spec, backend, &options, &fallback, &mut ResultDirectory::new(out));
    (told.take(), summary.expect("runs"))
}

/// A run on a GPU that fails as planned, into a directory of its own.
fn go_with(format: &str, faults: Faults, dir: &Path, name: &str) -> Option<(Vec<String>, Summary)> {
    let spec = spec(format);
    let mut gpu = gpu(&plan(&spec), faults)?.expect("starts");
    Some(go(&spec, &mut gpu, &dir.join(name)))
}

/// Every part and table by name.
fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let names = fs::read_dir(dir).expect("a directory").flatten().map(|entry| entry.file_name().into_string());
    let mut names: Vec<String> = names.map(|name| name.expect("UTF-8")).collect();
    names.retain(|name| name.starts_with("part-") || [WORKSPACE_FILE, TIPS_FILE].contains(&name.as_str()));
    names.into_iter().map(|name| (name.clone(), fs::read(dir.join(name)).expect("reads"))).collect()
}

/// Every part and table to the last byte.
fn expect_same_files(found: &Path, expected: &BTreeMap<String, Vec<u8>>) {
    let found = files(found);
    assert!(!expected.is_empty());
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "{name} differs");
    }
}

/// Every sample once, with the status and, to the tolerance, the tip of a run without faults.
fn expect_close(found: &Path, b: &Table) {
    let a = read_columns(found, &[]).expect("reads");
    assert_eq!(a.samples(), (0..SAMPLES as u64).collect::<Vec<_>>());
    let length = spec("parquet").scene.total_length();
    let [p, q] = [&a, b].map(|table| table.vector_columns("tip.position").expect("tips"));
    for row in 0..SAMPLES {
        assert_eq!(a.statuses()[row].is_success(), b.statuses()[row].is_success(), "sample {row}");
        let off = (0..3).map(|axis| (p[axis].number(row) - q[axis].number(row)).abs()).fold(0.0, f64::max);
        assert!(off <= 2.0 * TOLERANCE * length, "sample {row}: {off:e} m");
    }
}

/// A run without faults, a block a dispatch.
struct Undisturbed {
    /// The first one, without samples, included.
    dispatches: u64,
    files: BTreeMap<String, Vec<u8>>,
    /// Of a run with rows.
    rows: Table,
}

impl Undisturbed {
    fn new(format: &str) -> Option<Undisturbed> {
        let dir = tempfile::tempdir().expect("a directory");
        let faults = Faults { most_workgroups: FEWEST_WORKGROUPS, ..Faults::default() };
        let (told, summary) = go_with(format, faults.clone(), dir.path(), "undisturbed")?;
        assert!(told.is_empty() && summary.notes.is_empty(), "{told:?} {:?}", summary.notes);
        assert_eq!((summary.solved, summary.failed()), (SAMPLES as u64, 0));
        assert_eq!(summary.spot_check.map(|check| (check.compared, check.wrong)), Some((256, 0)));
        let out = dir.path().join("undisturbed");
        let rows = read_columns(&out, &[]).expect("reads");
        Some(Undisturbed { dispatches: faults.counts.dispatches(), files: files(&out), rows })
    }
}

static WITH_ROWS: LazyLock<Option<Undisturbed>> = LazyLock::new(|| Undisturbed::new("parquet"));
static WITHOUT_ROWS: LazyLock<Option<Undisturbed>> = LazyLock::new(|| Undisturbed::new("none"));

/// Made once for all tests; `None` without a GPU.
fn undisturbed(format: &str) -> Option<&'static Undisturbed> {
    match format {
        "parquet" => WITH_ROWS.as_ref(),
        _ => WITHOUT_ROWS.as_ref(),
    }
}

#[test]
fn a_lost_device_is_opened_again_and_the_run_goes_on() {
    for format in ["parquet", "none"] {
        let dir = tempfile::tempdir().expect("a directory");
        let Some(expected) = undisturbed(format) else { return };
        let dispatches = expected.dispatches;
        assert!(dispatches > 2 * CERTAIN_DISPATCHES, "{dispatches}");
        for (lost, most_workgroups) in [
            (1, FEW_WORKGROUPS),
            (CERTAIN_DISPATCHES / 2, FEW_WORKGROUPS),
            (CERTAIN_DISPATCHES, FEW_WORKGROUPS),
            (dispatches - 1, FEWEST_WORKGROUPS),
        ] {
            let faults = Faults { lost_at: vec![lost], most_workgroups, ..Faults::default() };
            let name = format!("lost-{lost}");
            let Some((told, summary)) = go_with(format, faults.clone(), dir.path(), &name) else { return };
            assert_eq!((faults.counts.losses(), told.len(), summary.solved), (1, 0, SAMPLES as u64), "{format} {lost}");
            assert!(summary.notes[0].contains("the device was lost"), "{:?}", summary.notes);
            assert!(summary.notes[0].contains("opened again"), "{:?}", summary.notes);
            let manifest = manifest_of(&dir.path().join(&name));
            assert_eq!(manifest["notes"].as_array().and_then(|notes| notes[0].as_str()), Some(&*summary.notes[0]));
            for name in ["open", "compile", "first_dispatch", "upload", "kernel", "copy", "wait", "unpack"] {
                assert!(manifest["timings"]["gpu"][name].as_f64().is_some(), "no {name} in {manifest}");
            }
            assert_eq!(summary.reduction.row_count(), SAMPLES as u64);
            assert_eq!(summary.origin == SampleOrigin::Device, format == "none");
            expect_same_files(&dir.path().join(name), &expected.files);
        }
    }
}

/// What a sweep without rows leaves: samples by voxel; how often each came back; how many were counted on the device.
type Counted = (HashMap<[i32; 3], u32>, HashMap<u64, u32>, u64);

fn counted(faults: Faults) -> Option<Counted> {
    let spec = spec("none");
    let (plan, sampler) = (plan(&spec), spec.sampler());
    let recipe = sampler.recipe();
    let mut gpu = gpu(&plan, faults)?.expect("starts").with_stages(true).expect("compiles");
    let job = ReduceJob {
        recipe: recipe.as_ref(),
        ranges: &[0..2500, 2600..SAMPLES as u64],
        voxel: spec.workspace.voxel,
        tolerance: TOLERANCE,
        wanted: &|range| range.filter(|index| index % 1000 == 0).collect(),
        values: &|index, row| sampler.values(index, row),
    };
    let (mut cells, mut returned, mut on_device) = (HashMap::new(), HashMap::new(), 0);
    let reduced = gpu.reduce(&job, &mut |rows| {
        on_device += rows.counted.iter().sum::<u64>();
        for (row, index) in rows.indices.iter().enumerate() {
            *returned.entry(*index).or_default() += 1;
            let tip = rows.solutions.vector(row, Quantity::TipPosition);
            *cells.entry(tip.map(|x| (x / spec.workspace.voxel).floor() as i32)).or_default() += 1;
        }
        true
    });
    let Ok(Some(Reduced::Voxels(voxels))) = reduced else { panic!("{reduced:?}") };
    assert_eq!(u64::from(voxels.values().sum::<u32>()), on_device);
    voxels.into_iter().for_each(|(cell, count)| *cells.entry(cell).or_default() += count);
    Some((cells, returned, on_device))
}

#[test]
fn what_only_a_lost_device_had_counted_is_counted_again() {
    let faults = Faults { most_workgroups: FEWEST_WORKGROUPS, ..Faults::default() };
    let Some((cells, returned, on_device)) = counted(faults.clone()) else { return };
    assert_eq!(on_device + returned.len() as u64, SAMPLES as u64 - 100);
    assert!(on_device > SAMPLES as u64 / 2, "{on_device}");
    let last = faults.counts.dispatches() - 1;
    for lost in [last - 10, last - 1, last] {
        let faults = Faults { lost_at: vec![lost], ..Faults { counts: Default::default(), ..faults.clone() } };
        let Some((again, returned, on_device)) = counted(faults.clone()) else { return };
        assert_eq!(faults.counts.losses(), 1);
        assert!(again == cells, "lost at {lost} of {last}");
        assert_eq!(on_device + returned.len() as u64, SAMPLES as u64 - 100);
        assert_eq!(returned.values().max(), Some(&1), "a row came back twice");
    }
}

#[test]
fn a_device_lost_twice_gives_way_to_the_cpu() {
    let dir = tempfile::tempdir().expect("a directory");
    for format in ["parquet", "none"] {
        let base = dir.path().join(format);
        let Some(expected) = undisturbed(format) else { return };
        // Parts are whole by then: a dispatch is one block, however slow the device.
        let lost_at = vec![CERTAIN_DISPATCHES, CERTAIN_DISPATCHES + 3];
        let faults = Faults { lost_at, most_workgroups: FEWEST_WORKGROUPS, ..Faults::default() };
        let Some((told, summary)) = go_with(format, faults, &base, "lost") else { return };
        assert!(told.len() == 1 && told[0].contains("the device was lost"), "{told:?}");
        assert_eq!(summary.notes.len(), 2, "{:?}", summary.notes);
        assert!(summary.notes[1].contains("cpu f32") && summary.notes[1].ends_with("went on"), "{:?}", summary.notes);
        assert_eq!(summary.reduction.row_count(), SAMPLES as u64);
        assert_eq!((summary.failed(), summary.spot_check.as_ref().map(|check| check.wrong)), (0, Some(0)));
        if format == "parquet" {
            assert!(summary.resumed > 0 && summary.solved + summary.resumed == SAMPLES as u64);
            expect_close(&base.join("lost"), &expected.rows);
        } else {
            // Counted from the start, as if there had been no GPU.
            let spec = spec(format);
            let (_, alone) = go(&spec, cpu(&plan(&spec)).expect("supported").as_mut(), &base.join("cpu"));
            assert!(summary.reduction.voxels == alone.reduction.voxels);
            assert_eq!(summary.reduction.voxels.values().sum::<u32>() as usize, SAMPLES);
            // The identity stays that of the run as it was begun, so the files differ in it alone.
            for name in [WORKSPACE_FILE, TIPS_FILE] {
                let read = |dir: &str| read_parquet_table(&base.join(dir).join(name)).expect("a table");
                assert_eq!(read("lost"), read("cpu"), "{name}");
            }
        }
    }
}

#[test]
fn too_little_memory_means_smaller_dispatches() {
    for format in ["parquet", "none"] {
        let dir = tempfile::tempdir().expect("a directory");
        let Some(expected) = undisturbed(format) else { return };
        // A block of outputs takes 37 columns of 1 KiB: there is room for three, and one with what comes back in a list.
        let faults = Faults { memory: Some(130 << 10), ..Faults::default() };
        let Some((told, summary)) = go_with(format, faults.clone(), dir.path(), "short") else { return };
        assert!(told.is_empty() && faults.counts.refusals() >= 2, "{told:?} {:?}", faults.counts);
        assert_eq!(summary.notes.len(), 1, "{:?}", summary.notes);
        assert!(summary.notes[0].contains("too little memory"), "{:?}", summary.notes);
        expect_same_files(&dir.path().join("short"), &expected.files);
    }
    // Not even for a block.
    let faults = Faults { memory: Some(32 << 10), ..Faults::default() };
    let Some(Err(error)) = gpu(&plan(&spec("parquet")), faults) else { panic!("no engine starts without memory") };
    assert!(matches!(error, BackendError::OutOfMemory { .. }), "{error}");
    assert!(error.to_string().contains("use the CPU engine"), "{error}");
}

#[test]
fn tiny_limits_are_respected() {
    let dir = tempfile::tempdir().expect("a directory");
    let Some(expected) = undisturbed("parquet") else { return };
    for (name, largest_buffer, most_workgroups) in
        [("default", Some(128 << 20), None), ("a MiB", Some(1 << 20), None), ("four workgroups", None, Some(4))]
    {
        let faults = Faults { largest_buffer, most_workgroups, ..Faults::default() };
        let Some((told, summary)) = go_with("parquet", faults, dir.path(), name) else { return };
        assert!(told.is_empty() && summary.notes.is_empty(), "{name}: {told:?} {:?}", summary.notes);
        expect_same_files(&dir.path().join(name), &expected.files);
    }
    let faults = Faults { largest_buffer: Some(32 << 10), ..Faults::default() };
    let Some(Err(error)) = gpu(&plan(&spec("parquet")), faults) else { panic!("a block does not fit") };
    assert!(matches!(error, BackendError::DeviceFailed { .. }), "{error}");
}

#[test]
fn a_driver_that_computes_wrong_is_refused_at_the_start() {
    let faults = Faults { wrong_arithmetic: true, ..Faults::default() };
    let Some(started) = gpu(&plan(&spec("parquet")), faults) else { return };
    let error = started.err().expect("refused").to_string();
    assert!(error.contains("computes wrong numbers (division: ") && error.contains("use the CPU engine"), "{error}");
}

#[test]
fn numbers_that_go_wrong_on_the_way_are_found() {
    let dir = tempfile::tempdir().expect("a directory");
    // Tips off by up to 3 %: plausible, and nothing but another engine can tell.
    let flipped = Some(Flip { dispatches: 3..1000, column: Quantity::TipPosition.column(), bit: 18 });
    let faults = Faults { flipped, most_workgroups: FEW_WORKGROUPS, ..Faults::default() };
    let Some((told, summary)) = go_with("parquet", faults.clone(), dir.path(), "tips") else { return };
    let check = summary.spot_check.expect("checked");
    assert!(told.is_empty() && faults.counts.flips() > 0);
    assert!(check.wrong > check.compared / 2 && check.wrong < check.compared, "{check:?}");

    // Statuses are marked, so that a changed one is noticed at once.
    let Some(expected) = undisturbed("parquet") else { return };
    let flipped = Some(Flip { dispatches: 6..7, column: Quantity::Status.column(), bit: 0 });
    let faults = Faults { flipped, most_workgroups: FEW_WORKGROUPS, ..Faults::default() };
    let Some((told, summary)) = go_with("parquet", faults, dir.path(), "statuses") else { return };
    assert!(told.len() == 1 && told[0].contains("unwritten"), "{told:?}");
    assert_eq!(summary.reduction.row_count(), SAMPLES as u64);
    expect_close(&dir.path().join("statuses"), &expected.rows);
}
