//! What follows when the device is lost or its memory does not suffice: a new device, smaller dispatches.

use super::buffers::Slot;
use super::device::{failed, reason};
use super::engine::Gpu;
use super::self_test::expect_right;
use super::solver::Solver;
use crate::backend::BackendError;
use crate::model::BLOCK;

impl Gpu {
    /// Opens a lost device again, once; any other error remains one. What was under way has to be solved anew.
    pub(super) fn reopen(&mut self, error: BackendError) -> Result<(), BackendError> {
        if self.was_reopened || !self.device.is_lost() {
            return Err(error);
        }
        self.was_reopened = true;
        // Says why, whatever the loss looked like where it was noticed.
        let loss = reason(&self.device.check().err().unwrap_or(error));
        let again = |error: BackendError| failed(format!("{loss}; then, opening it again, {}", reason(&error)));
        self.try_reopening().map_err(again)?;
        // Systems reset a device that is busy for too long or short of memory.
        self.pace.ease();
        self.notes.push(format!("{loss}; it was opened again, and solved anew in smaller dispatches"));
        Ok(())
    }

    fn try_reopening(&mut self) -> Result<(), BackendError> {
        let device = self.device.reopen()?;
        expect_right(&device)?;
        let in_stages = self.solver.in_stages;
        self.slots.clear();
        self.solver = Solver { in_stages, ..Solver::new(&device, &self.plan, &self.kernel)? };
        self.device = device;
        self.warm_up()
    }

    /// Makes sure that a slot exists and holds so many blocks; fewer where there is no memory for them. Returns how
    /// many.
    pub(super) fn reserve(&mut self, slot: usize, mut block_count: usize) -> Result<usize, BackendError> {
        let made = loop {
            let outputs = self.output_bytes(block_count);
            if self.slots.get(slot).is_some_and(|slot| slot.capacity.outputs >= outputs) {
                return Ok(block_count);
            }
            match Slot::new(&self.device, &self.solver, self.sizes(block_count)) {
                Err(error @ BackendError::OutOfMemory { .. }) => {
                    if !self.pace.halve(block_count) {
                        return Err(error);
                    }
                    block_count /= 2;
                    self.note_shortage(&error, block_count);
                }
                made => break made?,
            }
        };
        match self.slots.get_mut(slot) {
            Some(old) => *old = made,
            None => self.slots.push(made),
        }
        Ok(block_count)
    }

    /// One note for all shortages.
    pub(super) fn note_shortage(&mut self, error: &BackendError, block_count: usize) {
        let BackendError::OutOfMemory { reason } = error else { return };
        let name = &self.device.adapter().name;
        let samples = BLOCK * block_count;
        let note = format!("{name} has too little memory ({reason}); going on with {samples} samples a dispatch");
        match &mut self.shortage {
            Some(at) if *at < self.notes.len() => self.notes[*at] = note,
            _ => {
                self.shortage = Some(self.notes.len());
                self.notes.push(note);
            }
        }
    }
}
