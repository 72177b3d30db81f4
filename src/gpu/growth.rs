//! Which samples of a batch are of so much growth that a single pass over the rod does not tell them.

use super::shader::interval_bound;
use crate::backend::Precision;
use crate::clock::Busy;
use crate::model::tolerances::growth_limit;
use crate::model::vectors::norm;
use crate::model::{Batch, Plan, Quantity, Rod, RodSegment, Solutions, Status};
use rayon::prelude::*;

/// A path that ends on a smaller share of the load has not told why.
const LEAST_LOAD: f64 = 1.0 / 16.0;

/// A sample for nodes.
pub(super) struct Grown {
    pub sample: usize,
    /// Powers of e by which errors grow from base to tip.
    pub growth: f64,
    /// Turns of the rod at rest (rad), and powers of e by which its stiffness changes.
    shape: f64,
}

impl Grown {
    /// Intervals that it is cut into at most.
    pub fn interval_bound(&self, plan: &Plan, spacing: f64) -> usize {
        interval_bound(plan, self.growth, self.shape, spacing)
    }
}

/// Samples of much growth without a row, with a doubtful one, or whose derivatives a single pass does not tell.
pub(super) fn grown_samples(plan: &Plan, batch: &Batch, solutions: &Solutions, precision: Precision) -> Vec<Grown> {
    // Nothing else makes errors grow.
    if !(plan.terms.force || plan.terms.load || plan.terms.magnet) {
        return Vec::new();
    }
    let limit = growth_limit(precision.epsilon());
    let has_derivatives = !plan.derivatives.is_empty();
    let is_certain = |sample| solutions.get(sample, Quantity::ErrorEstimate) <= plan.options.tolerance;
    let of_sample = |rod: &mut Rod, sample: usize| {
        let status = solutions.status(sample);
        let is_asked = match status {
            Status::BadParameter => false,
            _ if status.is_success() => has_derivatives || !is_certain(sample),
            _ => true,
        };
        if batch.bad[sample] || !is_asked {
            return None;
        }
        plan.read_sample_rod(batch, sample, rod);
        if growth_bound(rod) <= limit {
            return None;
        }
        let growth = rod.growth();
        // What counts is the load that the path came to; one that never set out tells nothing.
        let load = match status {
            Status::Fold | Status::Unstable => solutions.get(sample, Quantity::LoadFraction).max(LEAST_LOAD),
            _ => 1.0,
        };
        let is_grown = growth * load.sqrt() > limit;
        is_grown.then(|| Grown { sample, growth, shape: curl(rod) + rise(rod) })
    };
    let (samples, busy) = ((0..batch.sample_count()).into_par_iter(), Busy::here());
    samples
        .map_init(|| (plan.scene.rod(), busy.enter()), |(rod, _), sample| of_sample(rod, sample))
        .flatten_iter()
        .collect()
}

/// No rod grows more than by the largest force and the softest section all along each segment; quickly told.
fn growth_bound(rod: &Rod) -> f64 {
    let of_segment = |segment: &RodSegment| match segment {
        RodSegment::Flexible(flexible) => flexible.length * norm(flexible.load),
        RodSegment::Rigid(rigid) => norm(rigid.weight),
    };
    let pull = norm(rod.tip_force) + rod.segments.iter().map(of_segment).sum::<f64>();
    let field = norm(rod.flux_density);
    let of_segment = |segment: &RodSegment| {
        let RodSegment::Flexible(flexible) = segment else { return 0.0 };
        let (near, rise) = (flexible.stiffness, flexible.stiffness_rise);
        let least = |k: usize| near[k].min(near[k] + rise[k]);
        let most = |k: usize| near[k].max(near[k] + rise[k]);
        let soft = (most(0).max(most(1)) / least(2)).max(1.0) / least(0).min(least(1));
        let give = flexible.shear_compliance.iter().fold(0.0, |most: f64, c| most.max(*c));
        ((pull * (1.0 + give * pull) + norm(flexible.dipole) * field) * soft).sqrt() * flexible.length
    };
    rod.segments.iter().map(of_segment).sum()
}

/// By how many powers of e the stiffness of tapers changes, each by the axis where that is most.
fn rise(rod: &Rod) -> f64 {
    let of_segment = |segment: &RodSegment| match segment {
        RodSegment::Flexible(flexible) => {
            let of_axis = |k: usize| (1.0 + flexible.stiffness_rise[k] / flexible.stiffness[k]).ln().abs();
            of_axis(0).max(of_axis(1)).max(of_axis(2))
        }
        RodSegment::Rigid(_) => 0.0,
    };
    rod.segments.iter().map(of_segment).sum()
}

fn curl(rod: &Rod) -> f64 {
    let of_segment = |segment: &RodSegment| match segment {
        RodSegment::Flexible(flexible) => {
            let near = flexible.rest_curvature;
            let far = std::array::from_fn(|k| near[k] + flexible.rest_curvature_rise[k]);
            norm(near).max(norm(far)) * flexible.length
        }
        RodSegment::Rigid(_) => 0.0,
    };
    rod.segments.iter().map(of_segment).sum()
}
