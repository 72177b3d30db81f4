//! Samples that take many turns, each a pass over the rod: dispatch after dispatch takes all of them one turn further. What
//! they hold lies in a buffer that outlasts a dispatch, so that no invocation loops for long.

use super::bindings::bind_group;
use super::conversion::pack;
use super::device::{Device, failed};
use super::dispatch_buffers::read_back;
use super::dispatcher::Dispatcher;
use super::pipelines::TurnPipeline;
use super::shader::{Settings, WORKGROUP_SIZE};
use crate::backend::BackendError;
use crate::model::{BLOCK, Batch, Solutions};
use wgpu::BufferUsages as Usage;

/// Memory of the samples of one dispatch at most (bytes).
const MEMORY_BUDGET: u64 = 512 << 20;
/// Samples of one dispatch at most: so many that no dispatch takes long.
const MOST_SAMPLES: usize = 1 << 14;
/// Samples side by side in memory are a multiple of this.
pub(super) const ALIGNMENT: usize = 32;
/// Turns between two looks at how many samples are left.
const TURNS: usize = 8;

/// What takes samples one turn further.
pub(super) struct Turns<'a> {
    pub pipeline: &'a TurnPipeline,
    /// But for mark and number of samples.
    pub settings: Settings<f64>,
    /// `MemorySettings` in `shaders/memory.wgsl` but for the stride.
    pub memory_settings: [u32; 5],
    /// Memory of a sample.
    pub sample_bytes: u64,
    /// Turns that a sample takes at most.
    pub most: usize,
}

/// Samples of one dispatch that the device's limits allow, where each holds so many bytes.
pub(super) fn most_samples(dispatcher: &Dispatcher, sample_bytes: u64) -> usize {
    let adapter = dispatcher.device.adapter();
    let budget = MEMORY_BUDGET.min(adapter.max_storage_binding_size).min(adapter.max_buffer_size);
    let by_memory = (budget / sample_bytes.max(1)) as usize / ALIGNMENT * ALIGNMENT;
    let by_workgroups = u64::from(adapter.max_workgroups) * u64::from(WORKGROUP_SIZE);
    MOST_SAMPLES.min(by_memory).min(by_workgroups as usize)
}

/// Dispatches turns until every sample is done.
pub(super) fn run(dispatcher: &mut Dispatcher, turns: &Turns, batch: &Batch) -> Result<Solutions, BackendError> {
    let pipeline = turns.pipeline;
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
    let settings = Settings { mark, sample_count: count as u32, ..turns.settings };
    let mut memory_settings = vec![stride as u32];
    memory_settings.extend(turns.memory_settings);
    let inputs = pack(&batch.inputs, 0..block_count, &dispatcher.input_units, precision);
    let settings = filled("settings", Usage::UNIFORM, &settings.bytes(precision))?;
    let inputs = filled("inputs", Usage::STORAGE, &inputs)?;
    let memory_settings = filled("memory settings", Usage::UNIFORM, bytemuck::cast_slice(&memory_settings))?;
    let output_bytes = dispatcher.output_bytes(block_count);
    let outputs = device.buffer("outputs", output_bytes, Usage::STORAGE | Usage::COPY_SRC)?;
    let bytes = stride as u64 * turns.sample_bytes;
    let memory = device.buffer("memory", bytes, Usage::STORAGE | Usage::COPY_DST)?;
    let under_way = device.buffer("samples left", 4, Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST)?;
    let buffers = [&settings, &dispatcher.solver.constants, &inputs, &outputs, &memory_settings, &memory, &under_way];
    let group = bind_group(device, &pipeline.layout, &buffers)?;
    // Every sample starts at rest.
    clear(device, &memory);
    let workgroups = (count as u32).div_ceil(WORKGROUP_SIZE);
    for _ in (0..turns.most).step_by(TURNS) {
        let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        // The last turn counts.
        for repeats in [TURNS - 1, 1] {
            encoder.clear_buffer(&under_way, 0, None);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline.pipeline);
            pass.set_bind_group(0, &group, &[]);
            (0..repeats).for_each(|_| pass.dispatch_workgroups(workgroups, 1, 1));
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
                _ => Err(failed(format!("{}: {unwritten} rows were left unwritten", device.adapter().name))),
            };
        }
    }
    Err(failed(format!("{}: samples take more turns than they may", device.adapter().name)))
}

fn clear(device: &Device, buffer: &wgpu::Buffer) {
    let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.clear_buffer(buffer, 0, None);
    device.queue.submit([encoder.finish()]);
}
