//! Looking for equilibria from given base moments instead of from rest.

use super::rest_shape::rest_pose;
use super::{BLOCK, Batch, Blocks, Entry, Plan, PlanOptions, Vector};
use crate::clock::Busy;
use rayon::prelude::*;

/// Known equilibria that a search can be kept away from.
pub const MOST_KNOWN: usize = 12;

/// Entries of a search: the base moment to start from, then those of known equilibria. In a field that varies the force at
/// the base to start from follows.
pub const SEARCH_ENTRIES: usize = 3 + 3 * MOST_KNOWN;

/// Where an unused place for a known equilibrium lies: too far to be felt (plan units). A force as large is none.
pub const FAR: f64 = 1e9;

/// A search: for the rod of a sample, from a base moment (N·m, world frame), away from known equilibria, of which at
/// most [`MOST_KNOWN`] count.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Row of the batch whose rod is meant.
    pub sample: usize,
    /// Base moment to start from (N·m, world frame)
    pub m0: Vector,
    /// Force at the base to start from (N), where the field varies; `None`: what goes with that moment.
    pub n0: Option<Vector>,
    /// Base moments of known equilibria (N·m, world frame)
    pub known: &'a [Vector],
}

impl Plan {
    /// The same rods, each solved from a base moment of its own.
    pub fn with_starts(&self) -> Plan {
        let mut plan = self.clone();
        plan.start = Some(plan.entries.len());
        let count = self.search_entries();
        plan.entries.extend((0..count).map(|k| Entry::Varying(self.input_count + k)));
        plan.input_count += count;
        plan
    }

    /// A plan for rods in a field that varies whose base loads are known from another grid. Each is solved from its own by Newton's method
    /// on the fine grid alone.
    pub fn with_near_starts(&self) -> Plan {
        Plan { starts_near: true, ..self.with_starts() }
    }

    /// Entries of a search.
    pub(super) fn search_entries(&self) -> usize {
        SEARCH_ENTRIES + if self.terms.varying_field { 3 } else { 0 }
    }

    /// Whether its samples are searches. Starts of continuations are none: in a field that varies, and where a base moment tells
    /// nothing ([`is_too_limp`](super::Rod::is_too_limp)), they are left aside, and the path from rest is followed.
    pub fn searches(&self) -> bool {
        self.start.is_some_and(|start| matches!(self.entries[start + 3], Entry::Varying(_)))
    }

    /// The same for searches that are kept away from nothing: three more columns, the base moment to start from.
    pub fn with_lone_starts(&self) -> Plan {
        let mut plan = self.with_starts();
        plan.input_count = self.input_count + 3;
        let first = self.entries.len() + 3;
        plan.entries[first..].fill(Entry::Constant(FAR * self.units.moment()));
        plan.entries[first + 3 * MOST_KNOWN..].fill(Entry::Constant(FAR * self.units.force));
        plan
    }

    /// Where a sample of [`Plan::with_lone_starts`] starts from (N·m, world frame).
    pub fn set_lone_start(&self, batch: &mut Batch, sample: usize, m0: Vector) {
        let first = self.input_count - 3;
        m0.into_iter().enumerate().for_each(|(axis, value)| batch.inputs.set(sample, first + axis, value));
    }

    /// A batch for [`Plan::with_starts`] out of a batch of this plan, one search a row.
    pub fn start_batch(&self, batch: &Batch, starts: &[Start]) -> Batch {
        let far = [FAR * self.units.moment(); 3];
        let no_force = [FAR * self.units.force; 3];
        let mut inputs = Blocks::new(self.input_count + self.search_entries(), starts.len());
        let (block_len, busy) = (inputs.block_len(), Busy::here());
        inputs.data_mut().par_chunks_mut(block_len).zip(starts.par_chunks(BLOCK)).for_each(|(out, starts)| {
            let _busy = busy.enter();
            for (lane, start) in starts.iter().enumerate() {
                let mut put = |column: usize, value: f64| out[column * BLOCK + lane] = value;
                for column in 0..self.input_count {
                    put(column, batch.inputs.get(start.sample, column));
                }
                let known = (0..MOST_KNOWN).map(|k| start.known.get(k).copied().unwrap_or(far));
                let force = self.terms.varying_field.then(|| start.n0.unwrap_or(no_force));
                let vectors = std::iter::once(start.m0).chain(known).chain(force);
                vectors.flatten().enumerate().for_each(|(k, value)| put(self.input_count + k, value));
            }
        });
        Batch { inputs, bad: starts.iter().map(|start| batch.bad[start.sample]).collect() }
    }

    /// The same rods without derivatives, at another resolution.
    pub fn without_derivatives(&self, options: PlanOptions) -> Plan {
        // What could be planned with derivatives can be planned without.
        Plan::new(&self.scene, &self.axes, &[], options).unwrap_or_else(|_| self.with_options(options))
    }

    /// The rods of a batch of another plan of the same scene and axes, as a batch of this one.
    pub fn same_rods(&self, other: &Plan, batch: &Batch) -> Batch {
        let mut inputs = Blocks::new(self.input_count, batch.sample_count());
        let (block_len, busy) = (inputs.block_len().max(1), Busy::here());
        inputs.data_mut().par_chunks_mut(block_len).enumerate().for_each(|(block, out)| {
            let _busy = busy.enter();
            let mut entries = Vec::with_capacity(self.entries.len());
            let first = block * BLOCK;
            for sample in first..batch.sample_count().min(first + BLOCK) {
                let rod = other.sample_rod(batch, sample);
                rod.write_record(&mut entries);
                if let Some(free) = self.free {
                    entries.extend(rest_pose(&rod.segments[free.segment..]));
                }
                self.varying(&entries).for_each(|(column, value)| out[column * BLOCK + sample - first] = value);
            }
        });
        Batch { inputs, bad: batch.bad.clone() }
    }

    /// No base moment of an equilibrium is larger: the moment of all loads on the longest lever arms (N·m). In a field that
    /// varies that holds for what was found of the field within the rod's reach.
    pub fn moment_bound(&self, batch: &Batch, sample: usize) -> f64 {
        use super::RodSegment::{Flexible, Rigid};
        let norm = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let rod = self.sample_rod(batch, sample);
        let length = rod.total_length();
        let (varying, gradient) =
            rod.field.as_ref().map_or((0.0, 0.0), |field| field.strongest(rod.base_position, length));
        let field = norm(rod.flux_density) + varying + gradient * length;
        let of_segments = rod.segments.iter().map(|segment| match segment {
            Flexible(s) => s.length * (norm(s.load) * length + norm(s.dipole) * field),
            Rigid(s) => norm(s.weight) * length + norm(s.couple) + norm(s.dipole) * field,
        });
        norm(rod.tip_moment) + norm(rod.tip_force) * length + of_segments.sum::<f64>()
    }
}
