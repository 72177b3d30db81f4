//! Lone passes of the CPU engine against the reference's, from base moments that are no equilibrium's.

use crate::common::strategy::{Count, check_scenes};
use rodsweep::backend::{BackendError, Precision};
use rodsweep::input::parse_scene;
use rodsweep::lanes::{InstructionSet, Lanes};
use rodsweep::model::{
    BLOCK, Parameter, PassColumn, PassEnd, PassEnds, Plan, PlanOptions, Scene, Stepper, Units, Vector, rotation_angle,
};
use rodsweep::reference::pass_end;
use std::path::Path;

const SCENES: Count = Count { scenes: 120, most_unsolved: 0 };
/// 256 steps of order eight, fewer than two of them over a short piece of a profile, and the reference's own tolerance.
const F64: f64 = 1e-10;
/// Round-off of f32 (6e-8) over some hundred stages.
const F32: f64 = 2e-5;
/// Base moments, in units of the rod's.
const MOMENTS: [Vector; 3] = [[0.0; 3], [0.7, -0.4, 0.2], [-0.3, 0.9, -0.5]];

const BEAM: &str = "[field]\nflux_density = [0, 0, 3]\n[[segment]]\nname = \"beam\"\nkind = \"flexible\"\nlength = 0.1\n\
    stiffness = { bending = 6e-5, torsion = 3e-5 }\n";

/// The largest difference: pure numbers, of columns relative to all of one.
fn error(found: &PassEnd, truth: &PassEnd, units: &Units) -> f64 {
    let apart = |a: Vector, b: Vector| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let column = |(found, truth): (&PassColumn, &PassColumn)| {
        let sizes = |a: &PassColumn, b: &PassColumn| {
            let of_moment = [apart(a.w, b.w), apart(a.dp, b.dp) / units.length].map(|x| x * units.moment());
            [of_moment[0], of_moment[1], apart(a.dm, b.dm)].into_iter().fold(0.0, |most: f64, x| most + x)
        };
        sizes(found, truth) / sizes(truth, &PassColumn::default())
    };
    let columns = found.columns.iter().zip(&truth.columns).map(column);
    let state = [
        apart(found.position, truth.position) / units.length,
        apart(found.moment, truth.moment) / units.moment(),
        rotation_angle(&found.rotation, &truth.rotation),
    ];
    // NaN is the largest.
    state.into_iter().chain(columns).fold(0.0, |most: f64, x| if x <= most { most } else { x })
}

fn worst(scene: &Scene, precision: Precision, set: InstructionSet) -> Option<(f64, String)> {
    let options = PlanOptions { stepper: Stepper::Dop853, steps: 256, ..PlanOptions::default() };
    let plan = Plan::new(scene, &[], &[], options).ok()?;
    let plan = Plan { free: None, ..plan }.with_lone_starts();
    let lanes = Lanes::with_instruction_set(&plan, precision, set).ok()?;
    // More than one block, the last not full.
    let count = BLOCK + 5;
    let m0 = |sample: usize| MOMENTS[sample % MOMENTS.len()].map(|m| m * plan.units.moment());
    let mut batch = plan.batch(count, |_, _| {});
    (0..count).for_each(|sample| plan.set_lone_start(&mut batch, sample, m0(sample)));
    let mut ends = PassEnds::new(0);
    lanes.pass(&batch, &mut ends).ok()?;
    let truths: Vec<PassEnd> = (0..MOMENTS.len()).map(|k| pass_end(&scene.rod(), m0(k))).collect::<Option<_>>()?;
    let errors = (0..count).map(|sample| error(&ends.end(sample), &truths[sample % truths.len()], &plan.units));
    let (at, worst) = errors.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((worst, format!("sample {at}, {} {precision}", set.name())))
}

#[test]
fn lone_passes_are_those_of_the_reference() {
    for set in InstructionSet::available() {
        let (name, fewer) = (set.name(), Count { scenes: SCENES.scenes / 4, ..SCENES });
        let scenes = if set == InstructionSet::available()[0] { SCENES } else { fewer };
        check_scenes(&format!("lone pass {name}"), scenes, F64, |scene| worst(scene, Precision::F64, set));
        check_scenes(&format!("lone pass {name} f32"), fewer, F32, |scene| worst(scene, Precision::F32, set));
    }
}

/// Values that make no rod have no numbers, their neighbours do.
#[test]
fn a_pass_over_no_rod_is_empty() {
    let scene = parse_scene(Path::new("beam.toml"), BEAM).expect("a scene");
    let length = Parameter::parse(&scene, "beam.length").expect("a parameter");
    let plan = Plan::new(&scene, &[length], &[], PlanOptions::default()).expect("a plan").with_lone_starts();
    let lanes = Lanes::new(&plan, Precision::F64).expect("an engine");
    let batch = plan.batch(20, |sample, row| row[0] = if sample == 7 { -1.0 } else { 0.1 + 0.01 * sample as f64 });
    let mut ends = PassEnds::new(0);
    lanes.pass(&batch, &mut ends).expect("passes");
    for sample in 0..20 {
        let PassEnd { position, columns, .. } = ends.end(sample);
        let numbers = position.into_iter().chain(columns.iter().flat_map(|column| column.dp));
        assert!(numbers.clone().all(|x| x.is_finite() == (sample != 7)), "{sample}: {position:?}");
        // Without moment and load it stays straight.
        assert!(sample == 7 || (position[2] - 0.1 - 0.01 * sample as f64).abs() < 1e-14, "{sample}: {position:?}");
    }
}

#[test]
fn what_has_no_lone_pass_is_refused() {
    let scene = parse_scene(Path::new("beam.toml"), BEAM).expect("a scene");
    let varying = BEAM.replace(
        "flux_density = [0, 0, 3]",
        "flux_density = [0, 0, 3]\ngradient = { xx = 0.1, xy = 0, xz = 0, yy = 0, yz = 0 }",
    );
    let varying = parse_scene(Path::new("varying.toml"), &varying).expect("a scene");
    let plan = |scene: &Scene| Plan::new(scene, &[], &[], PlanOptions::default()).expect("a plan");
    for (plan, words) in [(plan(&scene), "base moment"), (plan(&varying).with_lone_starts(), "varies")] {
        let batch = plan.batch(1, |_, _| {});
        let refused = Lanes::new(&plan, Precision::F64).expect("an engine").pass(&batch, &mut PassEnds::new(0));
        let Err(BackendError::Unsupported { what, .. }) = refused else { panic!("{words}: {refused:?}") };
        assert!(what.contains(words), "{what}");
    }
    assert!(pass_end(&varying.rod(), [0.0; 3]).is_none());
    assert!(pass_end(&scene.rod(), [0.0; 3]).is_some());
}
