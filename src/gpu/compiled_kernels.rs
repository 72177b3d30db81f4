//! The kernels that a device has compiled, so that the same source is not compiled twice.

use super::shader::Kernel;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Kernels kept; the oldest goes first.
const MOST_KERNELS: usize = 16;

/// Compiled kernels of one device. They end with it: a device that is opened again has none.
#[derive(Debug, Default)]
pub(super) struct CompiledKernels(Mutex<VecDeque<Compiled>>);

#[derive(Debug)]
struct Compiled {
    entry_point: &'static str,
    text: String,
    pipeline: wgpu::ComputePipeline,
}

impl CompiledKernels {
    fn kernels(&self) -> MutexGuard<'_, VecDeque<Compiled>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The pipeline of a kernel with this entry point and this very text.
    pub fn get(&self, kernel: &Kernel) -> Option<wgpu::ComputePipeline> {
        let is_same = |held: &&Compiled| held.entry_point == kernel.entry_point && held.text == kernel.source.text;
        self.kernels().iter().find(is_same).map(|held| held.pipeline.clone())
    }

    /// Keeps a pipeline.
    pub fn add(&self, kernel: &Kernel, pipeline: &wgpu::ComputePipeline) {
        let mut kernels = self.kernels();
        if kernels.len() == MOST_KERNELS {
            kernels.pop_front();
        }
        let (entry_point, text) = (kernel.entry_point, kernel.source.text.clone());
        kernels.push_back(Compiled { entry_point, text, pipeline: pipeline.clone() });
    }
}
