//! The workspace of P6 against numbers that were found by other means: sums of touched voxels, integrals, searches.

use crate::common::root;
use flate2::read::GzDecoder;
use rodsweep::backend::BackendKind;
use rodsweep::engines::EngineRequest;
use rodsweep::spec::{SweepSpec, Target};
use rodsweep::study::workspace::{
    EngineMap, MOST_INPUTS, MapOptions, Preference, Variation, Workspace, WorkspaceJob, base_scene, neighbours,
    workspace_inputs,
};
use rodsweep::table::Lattice;
use serde_json::Value;
use std::collections::HashSet;
use std::io::Read;
use std::sync::OnceLock;

/// Of the six faces of the box of currents, by an integral over 393,216 equilibria (cm³), and its error of 95 %.
const VOLUME: f64 = 281.5;
const VOLUME_ERROR: f64 = 0.3;
/// The same at full insertion (cm²).
const AREA: f64 = 171.4;

/// Three currents, and insertion where it is wanted.
fn spec(insertion: bool) -> SweepSpec {
    let mut spec = SweepSpec::read(&root().join("sweeps/volume.toml")).expect("a sweep");
    spec.axes.truncate(if insertion { 4 } else { 3 });
    spec
}

fn job(spec: &SweepSpec) -> WorkspaceJob<'_> {
    WorkspaceJob::of_sweep(spec).engine(EngineRequest::of(BackendKind::Cpu)).voxel_values(false)
}

/// At 2 mm, on the lattice of the golden centres.
fn at_two_millimetres() -> &'static Workspace {
    static FOUND: OnceLock<Workspace> = OnceLock::new();
    FOUND.get_or_init(|| {
        let lattice = Lattice { origin: [-0.052, -0.084, -0.002], spacing: 2e-3 };
        job(&spec(true)).voxel(2e-3).lattice(Some(lattice)).run().expect("a workspace")
    })
}

fn data(name: &str) -> Vec<u8> {
    std::fs::read(root().join("tests/data/analyses").join(name)).expect("golden numbers")
}

#[test]
fn the_volume_is_the_known_one() {
    let found = at_two_millimetres();
    let volume = found.volume.expect("a volume");
    assert!((1e6 * volume.value / VOLUME - 1.0).abs() < 0.005, "{volume:?}");
    let check = found.check.expect("an independent value");
    let integral = check.by_change_of_variables;
    assert!(check.agrees, "{check:?}");
    assert!((1e6 * integral.value - VOLUME).abs() < 3e6 * integral.standard_error + VOLUME_ERROR, "{check:?}");
    assert!((integral.multiplicity - 1.0).abs() < 0.005, "{check:?}");
    // What every published map does is far off.
    let touched = found.counts.len() as f64 * 0.2f64.powi(3);
    assert!(touched < 0.6 * VOLUME, "65,536 rows touch {touched} cm³");
    assert!(found.ends.undecided_share() < 0.01, "{:?}", found.ends);
}

#[test]
fn the_voxels_are_the_known_ones() {
    let mut text = String::new();
    GzDecoder::new(&data("p6_centres_2mm.csv.gz")[..]).read_to_string(&mut text).expect("text");
    let number = |cell: &str| cell.parse::<i32>().expect("a number");
    let golden: HashSet<[i32; 3]> = text
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            [number(cells[0]), number(cells[1]), number(cells[2])]
        })
        .collect();
    let grown = &at_two_millimetres().grown;
    let ours: HashSet<[i32; 3]> = grown.reached().map(|at| grown.voxels[at].cell).collect();
    let apart: Vec<&[i32; 3]> = golden.symmetric_difference(&ours).collect();
    assert!(apart.len() * 100 <= golden.len(), "{} of {} voxels differ", apart.len(), golden.len());
    // A voxel that is missing here lies at the boundary.
    let deep = |cell: &&[i32; 3]| golden.contains(*cell) && neighbours(**cell).iter().all(|n| golden.contains(n));
    let lost: Vec<_> = golden.difference(&ours).filter(|cell| deep(cell)).collect();
    assert!(lost.is_empty(), "{lost:?} are missing inside");
}

#[test]
fn smaller_voxels_come_nearer() {
    let volume = job(&spec(true)).voxel(1e-3).seed(1).run().expect("a workspace").volume.expect("a volume");
    assert!((1e6 * volume.value / VOLUME - 1.0).abs() < 0.0015 + VOLUME_ERROR / VOLUME, "{volume:?}");
}

#[test]
fn the_area_is_the_known_one() {
    for (edge, share) in [(2e-3, 0.01), (1e-3, 0.005)] {
        let found = job(&spec(false)).voxel(edge).seed(1).run().expect("a workspace");
        assert_eq!(found.dimension.rank, 2);
        let area = found.area.expect("an area");
        assert!((1e4 * area.value / AREA - 1.0).abs() < share, "{area:?}");
        let check = found.check.expect("an independent value");
        assert!(check.agrees, "{check:?} {area:?}");
    }
}

#[test]
fn intervals_hold_the_volume() {
    let spec = spec(true);
    let holds = |seed: u64| {
        let volume = job(&spec).voxel(6e-3).seed(seed).run().expect("a workspace").volume.expect("a volume");
        1e6 * volume.low <= VOLUME + VOLUME_ERROR && VOLUME - VOLUME_ERROR <= 1e6 * volume.high
    };
    let held = (0..20).filter(|seed| holds(*seed)).count();
    assert!(held >= 18, "{held} of 20 intervals hold the volume");
}

#[test]
fn queries_are_answered_rightly() {
    let text = String::from_utf8(data("p6_reach_queries.csv")).expect("text");
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let number = |cell: &str| cell.parse::<f64>().expect("a number");
    let targets: Vec<Target> =
        rows.iter().map(|row| Target::at([number(row[0]), number(row[1]), number(row[2])])).collect();
    let (spec, found) = (spec(true), at_two_millimetres());
    let mut map = job(&spec).map(&found.inputs).expect("an engine");
    let answers = found.reach(&mut map, &targets, Preference::Margin, 1e-6).expect("answers");
    let mut wrong = Vec::new();
    for (row, answer) in rows.iter().zip(&answers) {
        let is_reached = answer.status == "reached";
        let expected = match row[3] {
            "reachable" | "inside" | "yes" => true,
            "near" => continue,
            _ => false,
        };
        if is_reached != expected {
            wrong.push((row.clone(), *answer));
        }
        let distance: f64 = (0..3).map(|k| (answer.tip[k] - answer.target.position[k]).powi(2)).sum::<f64>().sqrt();
        assert_eq!(distance <= 1e-6, is_reached, "{answer:?}");
    }
    assert!(wrong.is_empty(), "{} wrong, such as {:?}", wrong.len(), wrong[0]);
    // Of several solutions the preferred one is at least as good in what is preferred.
    let reached: Vec<Target> =
        answers.iter().filter(|answer| answer.status == "reached").map(|answer| answer.target).take(20).collect();
    let with = |preference, map: &mut EngineMap| found.reach(map, &reached, preference, 1e-6).expect("answers");
    let (stable, roomy) = (with(Preference::Margin, &mut map), with(Preference::Reserve, &mut map));
    for (stable, roomy) in stable.iter().zip(&roomy) {
        assert!(stable.margin >= roomy.margin - 1e-9 && roomy.reserve >= stable.reserve - 1e-9);
    }
}

#[test]
fn stiffer_rods_reach_less() {
    let spec = spec(true);
    let job = job(&spec).voxel(4e-3).seed(3);
    let nominal = job.run().expect("a workspace");
    let text = "proximal.youngs_modulus+distal.youngs_modulus+proximal.shear_modulus+distal.shear_modulus=-2%..2%:3";
    let variation = Variation::parse(&nominal.scene, text).expect("a variation");
    let study = job.vary(&nominal, &variation).expect("a study");
    let truth = [286.313, 281.496, 276.74];
    for (design, truth) in study.designs.iter().zip(truth) {
        assert!((1e6 * design.size.value / truth - 1.0).abs() < 0.01, "{design:?}, in truth {truth}");
    }
    assert!((1e6 * study.slope + 239.0).abs() < 24.0, "{} cm³", 1e6 * study.slope);
}

#[test]
fn jacobians_and_compliance_are_the_known_ones() {
    let golden: Value = serde_json::from_slice(&data("p6_measures.json")).expect("JSON");
    let spec = spec(true);
    let (inputs, _) = workspace_inputs(&spec).expect("inputs");
    let engine = EngineRequest::of(BackendKind::Cpu).choose(1e-6).expect("an engine");
    let options = MapOptions { engine, tolerance: 1e-9, steps: Some(24) };
    let mut map = EngineMap::new(&base_scene(&spec), &inputs, &options).expect("a map");
    let sampler = spec.sampler();
    for row in golden["rows"].as_array().expect("rows") {
        let mut values = vec![0.0; 4];
        sampler.values(row["sample"].as_u64().expect("a sample"), &mut values);
        let mut at = [0.0; MOST_INPUTS];
        (0..4).for_each(|k| at[k] = inputs[k].scaled(values[k]));
        let (tip, compliance) = map.with_compliance(&[at]).expect("an equilibrium")[0];
        let number = |value: &Value| value.as_f64().expect("a number");
        for axis in 0..3 {
            assert!((tip.position[axis] - number(&row["tip"][axis])).abs() < 1e-7, "{row}");
            for k in 0..4 {
                let found = tip.jacobian[k][axis] / inputs[k].half_range();
                assert!((found - number(&row["J"][axis][k])).abs() < 1e-4 * 1.0f64.max(found.abs()), "{row}");
            }
        }
        assert!((0..9).all(|k| (compliance[k / 3][k % 3] - compliance[k % 3][k / 3]).abs() < 1e-5), "{compliance:?}");
    }
}
