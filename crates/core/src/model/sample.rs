//! The numbers of one sample after another: what no swept parameter moves is computed once.

use super::anchors::PlanAnchors;
use super::dependence::touched_segments;
use super::rest_shape::{REST_POSE, rest_pose};
use super::{Batch, Blocks, Entry, Parameter, Plan, Rod, Scene, Vector};
use std::collections::BTreeSet;
use std::ops::Deref;
use std::sync::Arc;

/// A sample of a plan: its scene, its rod and its entries.
#[derive(Clone)]
pub(super) struct Sample<P> {
    plan: P,
    /// Segments that samples differ in, and the first piece of each.
    changed: Vec<(usize, usize)>,
    scene: Scene,
    rod: Rod,
    /// SI; only those that vary are good.
    entries: Vec<f64>,
}

/// Puts a sample's axis values into a scene. Insertion is applied after the other lengths.
pub(super) fn set_axes(plan: &Plan, row: &[f64], scene: &mut Scene) {
    let values = plan.axes.iter().zip(row).flat_map(|(axis, value)| axis.iter().map(|p| (*p, *value)));
    // Every swept parameter was set once when the plan was made.
    let _ = Parameter::set_all(scene, values);
}

impl<P: Deref<Target = Plan>> Sample<P> {
    /// The plan's own scene.
    pub fn new(plan: P) -> Self {
        let scene = plan.scene.clone();
        let swept = plan.axes.iter().flatten();
        let changed: BTreeSet<usize> = swept.flat_map(|parameter| touched_segments(*parameter, &scene)).collect();
        let changed = changed.into_iter().map(|segment| (segment, scene.piece_indices(segment).start)).collect();
        Sample { entries: Vec::with_capacity(plan.entries.len()), plan, changed, rod: scene.rod(), scene }
    }

    /// Goes on to the sample of these axis values; false, with the plan's own scene, where they make no rod.
    pub fn set(&mut self, row: &[f64]) -> bool {
        let Sample { plan, changed, scene, rod, entries } = self;
        let plan: &Plan = plan;
        set_axes(plan, row, scene);
        scene.update_rod(rod, changed);
        let valid = rod.is_valid();
        if !valid {
            *scene = plan.scene.clone();
            *rod = scene.rod();
        }
        rod.write_record(entries);
        if let Some(free) = plan.free {
            let varies = matches!(plan.entries[free.entry], Entry::Varying(_));
            entries.extend(if varies { rest_pose(&rod.segments[free.segment..]) } else { [0.0; REST_POSE] });
        }
        for derivative in &plan.derivatives {
            let end = entries.len() + derivative.terms.len();
            let first = derivative.terms.first().map(|(_, entry)| plan.entries[*entry]);
            if let Some(Entry::Varying(_)) = first {
                entries.extend(derivative.parameter.chain(scene).iter().map(|(_, rate)| rate));
            }
            // Constant coefficients are not read from here; a segment shrunk to nothing has fewer.
            entries.resize(end, 0.0);
        }
        if let Some(PlanAnchors { grid, .. }) = &plan.anchors {
            entries.extend(row.iter().enumerate().map(|(axis, value)| grid.coordinate(axis, *value)));
        }
        valid
    }

    /// Columns of a batch and this sample's values.
    pub fn varying(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.plan.varying(&self.entries)
    }
}

/// A batch of one sample, set to other values again and again in the same memory.
pub struct OneSample {
    sample: Sample<Arc<Plan>>,
    row: Vec<f64>,
    batch: Batch,
}

impl Plan {
    /// A batch of one sample of this plan, for calls one after another. It is bad until its values are set.
    pub fn one_sample(&self) -> OneSample {
        let batch = Batch { inputs: Blocks::new(self.input_count, 1), bad: vec![true] };
        OneSample { sample: Sample::new(Arc::new(self.clone())), row: vec![0.0; self.axes.len()], batch }
    }
}

impl OneSample {
    /// Goes on to other values: `values` writes that of each axis.
    pub fn set(&mut self, values: impl FnOnce(&mut [f64])) {
        let OneSample { sample, row, batch } = self;
        values(row);
        batch.bad[0] = !sample.set(row);
        sample.varying().for_each(|(column, value)| batch.inputs.set(0, column, value));
    }

    /// Where it starts from (N·m, world frame), if its plan is one of [`Plan::with_lone_starts`].
    pub fn start_at(&mut self, m0: Vector) {
        self.sample.plan.set_lone_start(&mut self.batch, 0, m0);
    }

    /// The sample as a batch.
    pub fn batch(&self) -> &Batch {
        &self.batch
    }
}
