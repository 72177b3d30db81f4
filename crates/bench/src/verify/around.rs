//! Boxes around random scenes, each solved as a sweep: pilot, batches, anchors, second attempts.

use super::answer::Answer;
use super::search::{Contender, SearchOptions};
use super::verdicts::{Place, Verdicts};
use crate::error::BenchError;
use rodsweep::engines::{EngineRequest, witness};
use rodsweep::input::sweep_of_rows;
use rodsweep::model::{PlanOptions, Scene};
use rodsweep::spec::{InputTable, Method, OutputQuantity, SweepSpec};
use rodsweep::sweep::{Memory, SweepJob};

/// Adds the box around one scene to the verdicts of each engine; `false` where the scene has nothing that can vary.
pub fn judge_box(
    options: &SearchOptions,
    number: u64,
    contenders: &[Contender],
    verdicts: &mut [Verdicts],
) -> Result<bool, BenchError> {
    let Some(spec) = sweep(options, number)? else { return Ok(false) };
    let Ok(plan) = spec.plan(PlanOptions::default()) else { return Ok(false) };
    let sampler = spec.sampler();
    let count = spec.sample_count as usize;
    let batch = plan.batch(count, |sample, row| sampler.values(sample as u64, row));
    let expected = witness(&plan).solve(&batch)?;
    let expected: Vec<Answer> = (0..count).map(|sample| Answer::of_solution(&expected, sample)).collect();
    let scenes: Vec<Scene> = (0..spec.sample_count).map(|sample| spec.sample_scene(sample)).collect();
    let mut always = options.judge_all;
    let mut had_anchors = false;
    for (contender, verdicts) in contenders.iter().zip(verdicts) {
        // Without anchors either way, both are one run.
        if !contender.anchors && !had_anchors {
            continue;
        }
        let spec = SweepSpec { anchors: contender.anchors, tolerance: contender.tolerance(), ..spec.clone() };
        let request = EngineRequest::of(contender.backend).precision(Some(contender.precision));
        let mut rows = Memory::new();
        let job = SweepJob::new(spec.clone()).engine(request).spot_check(None).prepare(&rows)?;
        had_anchors = job.method().anchors;
        verdicts.anchored += usize::from(had_anchors);
        let tolerance = job.spec().tolerance;
        job.run(&mut rows)?;
        let rows = rows.into_table();
        for row in 0..rows.row_count() {
            let sample = rows.samples()[row];
            let at = sample as usize;
            let found = Answer::of_row(&rows, row);
            let place = Place { number, sample: Some(sample), scene: &scenes[at] };
            let agree = verdicts.add(found, &expected[at], tolerance, always, place);
            if let Some(mismatch) = verdicts.mismatches.last_mut().filter(|_| !agree) {
                mismatch.sweep = Some(spec.to_toml());
            }
        }
        always = false;
    }
    Ok(true)
}

/// The sweep over the box of a scene.
fn sweep(options: &SearchOptions, number: u64) -> Result<Option<SweepSpec>, BenchError> {
    let scene = options.kind.scene(options.seed, number);
    let axes = options.kind.inputs(options.seed, number);
    let samples = options.around.unwrap_or(0);
    if axes.is_empty() || samples == 0 {
        return Ok(None);
    }
    let base = sweep_of_rows(scene, InputTable::new(Vec::new(), Vec::new()))?;
    Ok(Some(SweepSpec {
        method: Method::Sobol,
        seed: options.seed ^ number,
        sample_count: samples,
        axes,
        table: None,
        quantities: OutputQuantity::ALL[..9].to_vec(),
        ..base
    }))
}
