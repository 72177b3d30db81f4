//! Memory in which blocks are solved.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

/// Memory of a block at work.
#[derive(Default)]
pub struct Scratch<S> {
    pub inputs: Vec<S>,
    pub bad: Vec<bool>,
    /// Free rods beside a wall.
    pub free: Vec<S>,
    pub order: Vec<usize>,
    pub values: Vec<S>,
    /// The kernel's own.
    pub memory: Option<Box<dyn Any + Send + Sync>>,
}

/// Memory that no block is at work with, kept from batch to batch: threads have as many jobs as they steal.
#[derive(Default)]
pub struct Pool<S>(Mutex<Vec<Scratch<S>>>);

/// Memory on loan.
pub struct Lent<'a, S: Default> {
    pool: &'a Pool<S>,
    pub scratch: Scratch<S>,
}

impl<S: Default> Pool<S> {
    pub fn lend(&self) -> Lent<'_, S> {
        // A panic elsewhere has taken its memory along.
        let scratch = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Lent { pool: self, scratch: scratch.unwrap_or_default() }
    }
}

impl<S: Default> Drop for Lent<'_, S> {
    fn drop(&mut self) {
        let scratch = std::mem::take(&mut self.scratch);
        self.pool.0.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }
}
