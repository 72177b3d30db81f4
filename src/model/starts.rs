//! Looking for equilibria from given base moments instead of from rest.

use super::{BLOCK, Batch, Blocks, Entry, Plan, Vector};

/// Known equilibria that a search can be kept away from.
pub const MOST_KNOWN: usize = 12;

/// Entries of a search: the base moment to start from, then those of known equilibria.
pub const SEARCH_ENTRIES: usize = 3 + 3 * MOST_KNOWN;

/// Where an unused place for a known equilibrium lies: too far to be felt (plan units).
const FAR: f64 = 1e9;

impl Plan {
    /// The same rods, each solved from a base moment of its own.
    pub fn with_starts(&self) -> Plan {
        let mut plan = self.clone();
        plan.start = Some(plan.entries.len());
        plan.entries.extend((0..SEARCH_ENTRIES).map(|k| Entry::Varying(self.input_count + k)));
        plan.input_count += SEARCH_ENTRIES;
        plan
    }

    /// A batch for [`Plan::with_starts`] out of one sample of this plan: one search from each base moment [N·m, world
    /// frame], kept away from `known` ones, of which at most [`MOST_KNOWN`] count.
    pub fn start_batch(&self, batch: &Batch, sample: usize, starts: &[Vector], known: &[Vector]) -> Batch {
        let far = [FAR * self.units.moment(); 3];
        let known: Vec<Vector> = (0..MOST_KNOWN).map(|k| known.get(k).copied().unwrap_or(far)).collect();
        let mut inputs = Blocks::new(self.input_count + SEARCH_ENTRIES, starts.len());
        for (row, start) in starts.iter().enumerate() {
            for column in 0..self.input_count {
                inputs.set(row, column, batch.inputs.get(sample, column));
            }
            for (k, value) in start.iter().chain(known.iter().flatten()).enumerate() {
                inputs.set(row, self.input_count + k, *value);
            }
        }
        debug_assert!(inputs.block_len().is_multiple_of(BLOCK));
        Batch { inputs, bad: vec![batch.bad[sample]; starts.len()] }
    }

    /// No base moment of an equilibrium is larger: the moment of all loads on the longest lever arms [N·m].
    pub fn moment_bound(&self, batch: &Batch, sample: usize) -> f64 {
        use super::RodSegment::{Flexible, Rigid};
        let norm = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let rod = self.sample_rod(batch, sample);
        let field = norm(rod.flux_density);
        let length = rod.total_length();
        let of_segments = rod.segments.iter().map(|segment| match segment {
            Flexible(s) => s.length * (norm(s.load) * length + norm(s.dipole) * field),
            Rigid(s) => norm(s.weight) * length + norm(s.dipole) * field,
        });
        norm(rod.tip_moment) + norm(rod.tip_force) * length + of_segments.sum::<f64>()
    }
}
