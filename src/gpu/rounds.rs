//! The solving kernels of a dispatch, one after the other, and what each leaves to the next: lists of samples on the device,
//! and what is known of each sample so far.

use super::bindings::bind_group;
use super::device::Device;
use super::device_time::{LISTS, Stage};
use super::pipelines::{SolvePipeline, Solver, StagePipelines};
use super::shader::{HANDOVER_COUNT, LANES};
use crate::backend::BackendError;
use crate::model::BLOCK;
use wgpu::BufferUsages as Usage;

/// Words of a list before its samples, as `shaders/lists.wgsl` has them: workgroups in three dimensions of all its samples, and
/// of those to be followed with care; how many samples; how many with care, and others; whether it takes none.
const HEADER: usize = 10;
type Header = [u32; HEADER];
/// The list that has every sample of the dispatch, and that which takes none.
const EVERYONE: Header = [0, 1, 1, 0, 1, 1, u32::MAX, 0, 0, 0];
const CLOSED: Header = [0, 1, 1, 0, 1, 1, 0, 0, 0, 1];
/// Bytes before the workgroups of all samples, those of samples to be followed with care, and the two counts.
const GROUPS_AT: u64 = 0;
const WITH_CARE_AT: u64 = 12;
const COUNTS_AT: u64 = 24;

/// Lists and bind groups of one dispatch.
pub(super) struct Rounds {
    /// See [`LISTS`]; the first alone where samples are solved by one kernel.
    lists: Vec<wgpu::Buffer>,
    /// From every sample to the first list.
    from_all: wgpu::BindGroup,
    /// From every sample, or of plans with anchors from the first list, to none.
    from_rest: wgpu::BindGroup,
    /// From every sample to the second list.
    first: wgpu::BindGroup,
    /// From each list but the first to the next, and from the last to none.
    after: Vec<wgpu::BindGroup>,
    /// What a list begins with before a dispatch.
    empty: Header,
    has_anchors: bool,
}

/// Kernels that are timed together.
pub(super) struct Work<'a> {
    pub stage: Stage,
    /// Each with its buffers, and the list of its samples where it takes not all.
    pub kernels: Vec<Launch<'a>>,
}

/// Pipeline, buffers, and where the workgroups of its list stand.
pub(super) type Launch<'a> = (&'a wgpu::ComputePipeline, &'a wgpu::BindGroup, Option<(&'a wgpu::Buffer, u64)>);

impl Rounds {
    /// For dispatches of so many samples; `buffers` are settings, inputs and outputs.
    pub fn new(
        device: &Device,
        solver: &SolvePipeline,
        buffers: [&wgpu::Buffer; 3],
        samples: u64,
    ) -> Result<Self, BackendError> {
        let (stages, has_anchors) = match &solver.solver {
            Solver::Stages(stages) => (Some(stages), stages.anchored.is_some()),
            Solver::Whole { anchored, .. } => (None, anchored.is_some()),
            Solver::Turns(_) => (None, false),
        };
        let list = |header: Header, samples: u64| {
            let bytes = 4 * (HEADER as u64 + samples);
            let list =
                device.buffer("list", bytes, Usage::STORAGE | Usage::INDIRECT | Usage::COPY_DST | Usage::COPY_SRC)?;
            device.queue.write_buffer(&list, 0, bytemuck::bytes_of(&header));
            Ok::<_, BackendError>(list)
        };
        let lanes = if stages.is_some_and(|stages| stages.is_on_lanes) { LANES } else { 1 };
        let empty = [0, 1, 1, 0, lanes, 1, 0, 0, 0, 0];
        let (everyone, closed) = (list(EVERYONE, 0)?, list(CLOSED, 0)?);
        let lists = if stages.is_some() { LISTS } else { 1 };
        let room = |at: usize| if at == 0 && !has_anchors { 0 } else { samples };
        let lists = (0..lists).map(|at| list(empty, room(at))).collect::<Result<Vec<_>, _>>()?;
        let blocks = samples.div_ceil(BLOCK as u64);
        let handed =
            if stages.is_some() { (HANDOVER_COUNT * BLOCK * solver.precision.size()) as u64 * blocks } else { 16 };
        let handover = device.buffer("handover", handed, Usage::STORAGE)?;
        let [settings, inputs, outputs] = buffers;
        let group = |from: &wgpu::Buffer, to: &wgpu::Buffer| {
            let buffers = [settings, &solver.constants, inputs, outputs, &solver.anchors, from, to, &handover];
            bind_group(device, &solver.layout, &buffers)
        };
        let from_all = group(&everyone, &lists[0])?;
        let from_rest = group(if has_anchors { &lists[0] } else { &everyone }, &closed)?;
        let first = group(&everyone, lists.get(1).unwrap_or(&closed))?;
        let next = |at: usize| group(&lists[at], lists.get(at + 1).unwrap_or(&closed));
        let after = (1..lists.len()).map(next).collect::<Result<_, _>>()?;
        Ok(Self { lists, from_all, from_rest, first, after, empty, has_anchors })
    }

    /// Empties every list before a dispatch.
    pub fn clear(&self, device: &Device) {
        self.lists.iter().for_each(|list| device.queue.write_buffer(list, 0, bytemuck::bytes_of(&self.empty)));
    }

    /// Copies how many samples each list has, and how many to be followed with care.
    pub fn copy_counts(&self, encoder: &mut wgpu::CommandEncoder, to: &wgpu::Buffer, at: u64) {
        (0..).zip(&self.lists).for_each(|(k, list)| encoder.copy_buffer_to_buffer(list, COUNTS_AT, to, at + 8 * k, 8));
    }

    /// The kernels that solve, in order.
    pub fn works<'a>(&'a self, solver: &'a Solver) -> Vec<Work<'a>> {
        match solver {
            Solver::Whole { anchored, whole } => {
                let first = anchored.iter().map(|anchored| self.anchored(anchored));
                first.chain([Work { stage: Stage::Whole, kernels: vec![self.at_rest(whole)] }]).collect()
            }
            Solver::Stages(stages) => self.stages(stages),
            Solver::Turns(_) => Vec::new(),
        }
    }

    fn anchored<'a>(&'a self, pipeline: &'a wgpu::ComputePipeline) -> Work<'a> {
        Work { stage: Stage::Anchored, kernels: vec![(pipeline, &self.from_all, None)] }
    }

    /// A kernel for samples that start from rest.
    fn at_rest<'a>(&'a self, pipeline: &'a wgpu::ComputePipeline) -> Launch<'a> {
        (pipeline, &self.from_rest, self.has_anchors.then_some((&self.lists[0], GROUPS_AT)))
    }

    fn stages<'a>(&'a self, stages: &'a StagePipelines) -> Vec<Work<'a>> {
        let mut works: Vec<Work> = stages.anchored.iter().map(|anchored| self.anchored(anchored)).collect();
        works.push(Work { stage: Stage::Path, kernels: vec![self.at_rest(&stages.path)] });
        works.push(Work { stage: Stage::Check, kernels: vec![self.at_rest(&stages.check)] });
        works.push(Work { stage: Stage::Columns, kernels: vec![(&stages.columns, &self.first, None)] });
        let mut kernels = Vec::new();
        for (list, group) in self.lists[1..].iter().zip(&self.after) {
            // What anchors had certified may go from rest after all.
            if stages.anchored.is_some() {
                kernels.push((&stages.path, group, Some((list, GROUPS_AT))));
            }
            kernels.push((&stages.guarded, group, Some((list, WITH_CARE_AT))));
            kernels.push((&stages.check, group, Some((list, GROUPS_AT))));
            kernels.push((&stages.columns_again, group, Some((list, GROUPS_AT))));
        }
        works.push(Work { stage: Stage::Left, kernels });
        works
    }
}
