//! Samples of much growth, which a single pass does not solve, by nodes: dispatch after dispatch takes each a pass further.
//!
//! What the device has no room for stays as it is, for the CPU.

use super::bindings::bind_group;
use super::conversion::{gathered, pack};
use super::device::{Device, failed};
use super::dispatch_buffers::read_back;
use super::dispatcher::Dispatcher;
use super::growth::grown_samples;
use super::node_pipeline::NodePipeline;
use super::shader::{KERNELS, Settings, WORKGROUP_SIZE, most_intervals, most_turns, node_bytes};
use crate::backend::{BackendError, Precision};
use crate::model::path::NODE_SPACINGS;
use crate::model::{BLOCK, Batch, Quantity, Solutions, Status};
use std::time::Instant;
use wgpu::BufferUsages as Usage;

/// Memory of the nodes of one dispatch at most (bytes).
const NODE_BUDGET: u64 = 512 << 20;
/// Samples of one dispatch at most: so many that no dispatch takes long.
const MOST_SAMPLES: usize = 1 << 14;
/// Two ways to the same equilibrium end no farther apart, over the rod's length.
const SAME_TIP: f64 = 1e-2;
/// Intervals of a rod at most: more leave no digits in f32.
const MOST_INTERVALS: usize = 1 << 14;
/// Samples side by side in memory are a multiple of this.
const ALIGNMENT: usize = 32;
/// Turns between two looks at how many samples are left.
const TURNS: usize = 8;

/// Solves by nodes what a single pass has not solved, or whose columns it does not tell, where errors grow much.
pub(super) fn solve_grown(
    dispatcher: &mut Dispatcher,
    batch: &Batch,
    solutions: &mut Solutions,
) -> Result<(), BackendError> {
    let has_kernel = dispatcher.entry_point() == KERNELS[0].entry_point && dispatcher.plan.start.is_none();
    if !has_kernel || dispatcher.refuses_nodes || dispatcher.precision != Precision::F32 {
        return Ok(());
    }
    let mut grown = grown_samples(&dispatcher.plan, batch, solutions, dispatcher.precision);
    if grown.is_empty() {
        return Ok(());
    }
    // A loss is told when what is in flight has ended.
    dispatcher.device.wait(None)?;
    if !has_pipeline(dispatcher)? {
        return Ok(());
    }
    // Those of as many intervals share their loops.
    grown.sort_by(|a, b| a.growth.total_cmp(&b.growth));
    let mut folds = vec![true; grown.len()];
    let mut left: Vec<usize> = (0..grown.len()).collect();
    let mut most = MOST_SAMPLES;
    for spacing in NODE_SPACINGS {
        let bounds: Vec<usize> = left.iter().map(|at| grown[*at].interval_bound(&dispatcher.plan, spacing)).collect();
        let (mut unsolved, mut first) = (Vec::new(), 0);
        while first < left.len() {
            let group = &left[first..first + group_size(dispatcher, &bounds[first..], most)];
            let samples: Vec<usize> = group.iter().map(|at| grown[*at].sample).collect();
            let found = match group.len() {
                0 => None,
                count => solve_group(dispatcher, &gathered(batch, &samples), bounds[first + count - 1], spacing)?,
            };
            let Some(found) = found else {
                if group.len() > ALIGNMENT {
                    most = group.len() / 2;
                    continue;
                }
                // The others are no shorter.
                dispatcher.note_too_long(left.len() - first);
                left[first..].iter().for_each(|at| folds[*at] = false);
                break;
            };
            for (from, at) in group.iter().enumerate() {
                folds[*at] &= found.status(from) == Status::Fold;
                if found.status(from) == Status::Ramped {
                    take(dispatcher.plan.scene.total_length(), solutions, grown[*at].sample, &found, from);
                } else {
                    unsolved.push(*at);
                }
            }
            first += group.len();
        }
        left = unsolved;
    }
    for at in left {
        let sample = grown[at].sample;
        // A fold that is none on some mesh is taken back.
        if solutions.status(sample) == Status::Fold && !folds[at] {
            solutions.set_status(sample, Status::NotConverged);
        }
    }
    Ok(())
}

/// Makes the kernel when it is first needed; false where the device does not take it.
fn has_pipeline(dispatcher: &mut Dispatcher) -> Result<bool, BackendError> {
    if dispatcher.nodes.is_none() {
        let start = Instant::now();
        match NodePipeline::new(&dispatcher.device, &dispatcher.plan) {
            Ok(pipeline) => dispatcher.nodes = Some(pipeline),
            Err(error) if dispatcher.device.is_lost() => return Err(error),
            Err(error) => dispatcher.refuse_nodes(&error),
        }
        dispatcher.timings.compile += start.elapsed().as_secs_f64();
    }
    Ok(dispatcher.nodes.is_some())
}

/// Replaces a row by what nodes have found, unless that is another equilibrium.
fn take(length: f64, solutions: &mut Solutions, to: usize, found: &Solutions, from: usize) {
    let (before, after) = (solutions.vector(to, Quantity::TipPosition), found.vector(from, Quantity::TipPosition));
    let apart = (0..3).map(|k| (before[k] - after[k]).powi(2)).sum::<f64>().sqrt();
    // A single pass has lost digits, not the branch.
    if solutions.status(to).is_success() && apart > SAME_TIP * length {
        solutions.set_status(to, Status::NotConverged);
    } else {
        solutions.copy_row(to, found, from);
    }
}

/// How many of the samples with these bounds, in rising order, fit into one dispatch.
fn group_size(dispatcher: &Dispatcher, bounds: &[usize], most_samples: usize) -> usize {
    let adapter = dispatcher.device.adapter();
    let budget = NODE_BUDGET.min(adapter.max_storage_binding_size).min(adapter.max_buffer_size);
    let most = if adapter.is_software() { most_intervals(&dispatcher.plan) } else { MOST_INTERVALS };
    let fits = |count: usize| {
        let intervals = bounds[count - 1];
        let stride = count.next_multiple_of(ALIGNMENT) as u64;
        intervals <= most && stride * node_bytes(&dispatcher.plan, intervals) <= budget
    };
    let by_workgroups = (u64::from(adapter.max_workgroups) * u64::from(WORKGROUP_SIZE)).min(MOST_SAMPLES as u64);
    let most_here = bounds.len().min(most_samples).min(by_workgroups as usize);
    (1..=most_here).take_while(|count| fits(*count)).last().unwrap_or(0)
}

/// Solves some samples with room for so many intervals each; `None` where the device has not the memory.
fn solve_group(
    dispatcher: &mut Dispatcher,
    batch: &Batch,
    intervals: usize,
    spacing: f64,
) -> Result<Option<Solutions>, BackendError> {
    let Some(pipeline) = dispatcher.nodes.take() else { return Ok(None) };
    let start = Instant::now();
    let solved = run(dispatcher, &pipeline, batch, intervals, spacing);
    dispatcher.nodes = Some(pipeline);
    dispatcher.timings.wait += start.elapsed().as_secs_f64();
    match solved {
        Err(BackendError::OutOfMemory { .. }) => Ok(None),
        solved => solved.map(Some),
    }
}

/// Dispatches turns until every sample is done.
fn run(
    dispatcher: &mut Dispatcher,
    pipeline: &NodePipeline,
    batch: &Batch,
    intervals: usize,
    spacing: f64,
) -> Result<Solutions, BackendError> {
    let (count, mark) = (batch.sample_count(), dispatcher.next_mark());
    let (device, precision) = (&dispatcher.device, dispatcher.precision);
    let block_count = count.div_ceil(BLOCK);
    let stride = count.next_multiple_of(ALIGNMENT);
    let filled = |what: &str, usage: Usage, bytes: &[u8]| {
        // A binding may not be empty.
        let buffer = device.buffer(what, bytes.len().max(16) as u64, usage | Usage::COPY_DST)?;
        device.queue.write_buffer(&buffer, 0, bytes);
        Ok::<_, BackendError>(buffer)
    };
    let settings = Settings { mark, sample_count: count as u32, ..Settings::default() };
    let node_settings = [(spacing as f32).to_bits(), intervals as u32, stride as u32];
    let inputs = pack(&batch.inputs, 0..block_count, &dispatcher.input_units, precision);
    let settings = filled("settings", Usage::UNIFORM, &settings.bytes(precision))?;
    let inputs = filled("inputs", Usage::STORAGE, &inputs)?;
    let node_settings = filled("node settings", Usage::UNIFORM, bytemuck::bytes_of(&node_settings))?;
    let output_bytes = dispatcher.output_bytes(block_count);
    let outputs = device.buffer("outputs", output_bytes, Usage::STORAGE | Usage::COPY_SRC)?;
    let bytes = stride as u64 * node_bytes(&dispatcher.plan, intervals);
    let memory = device.buffer("nodes", bytes, Usage::STORAGE | Usage::COPY_DST)?;
    let under_way = device.buffer("samples left", 4, Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST)?;
    let buffers = [&settings, &dispatcher.solver.constants, &inputs, &outputs, &node_settings, &memory, &under_way];
    let group = bind_group(device, &pipeline.layout, &buffers)?;
    // Every sample starts at rest.
    clear(device, &memory, (stride * precision.size()) as u64);
    let workgroups = (count as u32).div_ceil(WORKGROUP_SIZE);
    for _ in (0..most_turns(&dispatcher.plan)).step_by(TURNS) {
        let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        // The last turn counts.
        for turns in [TURNS - 1, 1] {
            encoder.clear_buffer(&under_way, 0, None);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline.pipeline);
            pass.set_bind_group(0, &group, &[]);
            (0..turns).for_each(|_| pass.dispatch_workgroups(workgroups, 1, 1));
        }
        device.queue.submit([encoder.finish()]);
        let mut left = 0;
        read_back(device, &under_way, 0..4, |bytes| left = u32::from_le_bytes(std::array::from_fn(|k| bytes[k])))?;
        if left == 0 {
            let mut solutions = Solutions::new(&dispatcher.plan, count);
            let conversion = dispatcher.conversion(batch, mark);
            let block_len = solutions.values.block_len();
            let mut unwritten = 0;
            read_back(device, &outputs, 0..output_bytes, |bytes| {
                let rows: Vec<f32> = bytemuck::pod_collect_to_vec(bytes);
                let blocks = solutions.values.data_mut().chunks_mut(block_len).zip(rows.chunks(block_len));
                unwritten = blocks.enumerate().map(|(block, (to, from))| conversion.block(block, from, to)).sum();
            })?;
            return match unwritten {
                0 => Ok(solutions),
                _ => Err(failed(format!("{}: {unwritten} rows by nodes were left unwritten", device.adapter().name))),
            };
        }
    }
    Err(failed(format!("{}: the kernel by nodes does not end", device.adapter().name)))
}

fn clear(device: &Device, buffer: &wgpu::Buffer, bytes: u64) {
    let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.clear_buffer(buffer, 0, Some(bytes));
    device.queue.submit([encoder.finish()]);
}
