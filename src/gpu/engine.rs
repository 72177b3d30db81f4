//! The GPU engine: one plan on one device, as a backend.

use super::device::{Device, failed};
use super::dispatcher::{Dispatcher, block_limit};
use super::self_test::expect_right;
use super::shader::{KERNELS, Kernel, fits, has_anchors, integrated, pass_limit};
use super::timings::Timings;
use super::{solve_batch, voxel_sweep};
use crate::backend::{
    Backend, BackendError, BackendInfo, BackendKind, Precision, ReduceJob, Reduced, Returned, RungCount,
};
use crate::model::{BLOCK, Batch, Magnet, Plan, Solutions};

/// Outputs of one dispatch at most (bytes).
const OUTPUT_BUDGET: u64 = 64 << 20;

/// Full dispatches in a batch of the recommended size.
const DISPATCHES_PER_BATCH: usize = 4;

/// A path over the rod needs this many passes in all but the hardest cases.
const FEWEST_PASSES: f64 = 40.0;

/// The GPU engine for one plan on one device.
pub struct Gpu {
    pub(super) dispatcher: Dispatcher,
    /// Whether sweeps without rows are counted on the device.
    counts_on_device: bool,
    block_limit: usize,
}

impl Gpu {
    /// Compiles the solving kernel for a plan and checks that the device computes right.
    ///
    /// # Errors
    ///
    /// `Unsupported`: f64 on an adapter that has none, a plan of so many steps that a kernel would run too long, or in a
    /// field that varies in space f64, starts, or a map of the field.
    /// `DeviceFailed`, `OutOfMemory`: the device gave an error, or wrong numbers.
    pub fn new(device: Device, plan: &Plan, precision: Precision) -> Result<Self, BackendError> {
        if precision == Precision::F64 && !device.adapter().has_f64 {
            return Err(BackendError::Unsupported {
                backend: BackendKind::Gpu,
                what: format!("f64 on {}, which has none", device.adapter().name),
                remedy: "use f32, or the CPU engine for f64".into(),
            });
        }
        if plan.segments.iter().any(|segment| segment.has_couple || segment.follows) {
            return Err(BackendError::Unsupported {
                backend: BackendKind::Gpu,
                what: "a load that turns with the rod, or a moment inside of it".into(),
                remedy: "use the CPU engine".into(),
            });
        }
        if plan.scene.sources.magnets.iter().any(Magnet::is_exact) {
            return Err(BackendError::Unsupported {
                backend: BackendKind::Gpu,
                what: "the exact field of a cylindrical magnet".into(),
                remedy: "use the CPU engine, or leave out field = \"exact\"".into(),
            });
        }
        if plan.terms.varying_field {
            expect_solved_in_turns(plan, precision)?;
        }
        let has_room = if plan.terms.varying_field { fits(plan) } else { pass_limit(plan) >= FEWEST_PASSES };
        if !has_room {
            return Err(BackendError::Unsupported {
                backend: BackendKind::Gpu,
                what: format!(
                    "as many as {} steps",
                    integrated(plan).iter().map(|segment| segment.steps).sum::<usize>()
                ),
                remedy: "take fewer steps of a method of higher order, or use the CPU engine".into(),
            });
        }
        let is_software = device.adapter().is_software();
        let kernel = match plan.terms.varying_field {
            true => Kernel::varying(plan, is_software),
            false => Kernel::new(&KERNELS[0], plan, precision, is_software),
        };
        let kernel = kernel.map_err(failed)?;
        expect_right(&device)?;
        Self::with_kernel(device, plan, &kernel)
    }

    /// Prepares a kernel of one's own for a plan, for tests. It must call `store_status` for every sample.
    #[doc(hidden)]
    pub fn with_kernel(device: Device, plan: &Plan, kernel: &Kernel) -> Result<Self, BackendError> {
        let counts_on_device = !device.adapter().is_software();
        let block_limit = block_limit(&device, plan, kernel.precision, OUTPUT_BUDGET);
        let dispatcher = Dispatcher::new(device, plan, kernel, block_limit)?;
        Ok(Self { dispatcher, counts_on_device, block_limit })
    }

    /// The same engine with samples solved by short kernels, one after the other, or each by one kernel.
    ///
    /// Without it hardware takes short kernels, and a software adapter one.
    ///
    /// # Errors
    ///
    /// `DeviceFailed`, `OutOfMemory`: a kernel for this could not be compiled.
    pub fn with_stages(mut self, in_stages: bool) -> Result<Self, BackendError> {
        self.dispatcher.set_stages(in_stages)?;
        Ok(self)
    }

    /// The same engine with the tips of sweeps without rows counted on the device, or by the host.
    ///
    /// Without it the device counts where it is hardware.
    pub fn with_counting(mut self, on_device: bool) -> Self {
        self.counts_on_device = on_device;
        self
    }

    /// The device that solves; another one after a loss.
    pub fn device(&self) -> &Device {
        &self.dispatcher.device
    }

    /// Where the time went so far.
    pub fn timings(&self) -> &Timings {
        &self.dispatcher.timings
    }
}

/// The kernel for fields that vary in space knows no f64, no search from a given start and no map.
fn expect_solved_in_turns(plan: &Plan, precision: Precision) -> Result<(), BackendError> {
    let what = match () {
        _ if precision == Precision::F64 => "f64 in fields that vary in space",
        _ if plan.start.is_some() => "every equilibrium in fields that vary in space",
        _ if !plan.scene.sources.maps.is_empty() => "fields sampled on a grid",
        _ => return Ok(()),
    };
    let remedy = "use the CPU engine".into();
    Err(BackendError::Unsupported { backend: BackendKind::Gpu, what: what.into(), remedy })
}

impl Backend for Gpu {
    fn info(&self) -> BackendInfo {
        let adapter = self.dispatcher.device.adapter();
        BackendInfo {
            kind: BackendKind::Gpu,
            precision: self.dispatcher.precision,
            device: format!("{}, {}", adapter.name, adapter.kind),
            driver: format!("{} {}", adapter.api, adapter.driver),
        }
    }

    fn plan(&self) -> &Plan {
        &self.dispatcher.plan
    }

    fn batch_size(&self) -> usize {
        DISPATCHES_PER_BATCH * self.block_limit * BLOCK
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        solve_batch::solve(&mut self.dispatcher, batch)
    }

    fn reduce(
        &mut self,
        job: &ReduceJob,
        give: &mut dyn FnMut(Returned) -> bool,
    ) -> Result<Option<Reduced>, BackendError> {
        if self.dispatcher.plan.terms.varying_field {
            let reason = "in a field that varies in space samples take turns";
            return Ok(Some(Reduced::Declined(reason.into())));
        }
        if !self.counts_on_device {
            let reason = "a software adapter counts no faster than the host";
            return Ok(Some(Reduced::Declined(reason.into())));
        }
        voxel_sweep::run(&mut self.dispatcher, job, give).map(Some)
    }

    fn take_notes(&mut self) -> Vec<String> {
        self.dispatcher.take_notes()
    }

    fn timings(&self) -> Vec<(&'static str, f64)> {
        self.dispatcher.timings.named()
    }

    fn rungs(&self) -> Vec<RungCount> {
        self.dispatcher.timings.rungs(has_anchors(&self.dispatcher.plan))
    }
}
