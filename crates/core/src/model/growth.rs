//! By how much errors grow along a rod: what single shooting must be able to bear.

use super::record::{FLEXIBLE_RECORD, FLUX_DENSITY_AT, TIP_FORCE_AT, WEIGHT_AT, record_offsets};
use super::rod::{FlexibleRod, Rod, RodSegment};
use super::tolerances::growth_limit;
use super::vectors::norm;
use super::{Entry, Plan};

/// Panels of the midpoint rule over a segment.
const PANELS: usize = 32;

impl Rod {
    /// Growth exponent: what happens at the base tells at the tip, and the other way about, by e to this power. MS1
    ///
    /// A rod without force and without magnets has none. Digits of single shooting go at about 8 in f64 and 3 in f32.
    pub fn growth(&self) -> f64 {
        let mut n = self.tip_force;
        let mut growth = 0.0;
        for segment in self.segments.iter().rev() {
            match segment {
                RodSegment::Flexible(flexible) => {
                    let pull = |at: f64| norm([0, 1, 2].map(|k| n[k] + at * flexible.length * flexible.load[k]));
                    let magnet = norm(flexible.dipole) * norm(self.flux_density);
                    let softness = softness(flexible);
                    let give = flexible.shear_compliance.iter().fold(0.0, |most: f64, c| most.max(*c));
                    let rate = |panel: usize| {
                        let pull = pull((panel as f64 + 0.5) / PANELS as f64);
                        ((pull * (1.0 + give * pull) + magnet) * softness).sqrt()
                    };
                    growth += (0..PANELS).map(rate).sum::<f64>() * flexible.length / PANELS as f64;
                    (0..3).for_each(|k| n[k] += flexible.length * flexible.load[k]);
                }
                RodSegment::Rigid(rigid) => (0..3).for_each(|k| n[k] += rigid.weight[k]),
            }
        }
        growth
    }

    /// Whether a rod is so limp or so taut that a base moment does not tell its equilibria: those that differ far from the
    /// base have the same one but for what round-off leaves.
    pub fn is_too_limp(&self) -> bool {
        self.growth() > growth_limit(f64::EPSILON)
    }
}

impl Plan {
    /// Whether samples may differ in their growth exponent.
    fn growth_varies(&self) -> bool {
        let varies =
            |first: usize, count: usize| self.entries[first..][..count].iter().any(|e| matches!(e, Entry::Varying(_)));
        let rod = self.scene.rod();
        let of_segment = |(segment, first): (&RodSegment, usize)| match segment {
            RodSegment::Flexible(_) => varies(first, FLEXIBLE_RECORD),
            RodSegment::Rigid(_) => varies(first + WEIGHT_AT, 3),
        };
        varies(TIP_FORCE_AT, 3)
            || self.terms.magnet && varies(FLUX_DENSITY_AT, 3)
            || rod.segments.iter().zip(record_offsets(&rod.segments)).any(of_segment)
    }

    /// Whether starts of continuations are left aside: of all samples or of none, or, where it depends on the sample, `None`.
    pub fn leaves_starts(&self) -> Option<bool> {
        let continues = self.start.is_some() && !self.searches() && !self.terms.varying_field;
        if !continues || !(self.terms.force || self.terms.magnet) {
            return Some(false);
        }
        (!self.growth_varies()).then(|| self.scene.rod().is_too_limp())
    }
}

/// max(1, EI_max / GJ) / EI_min
fn softness(segment: &FlexibleRod) -> f64 {
    let near = segment.stiffness;
    let far = [0, 1, 2].map(|k| near[k] + segment.stiffness_rise[k]);
    let least = near[0].min(near[1]).min(far[0]).min(far[1]);
    let most = near[0].max(near[1]).max(far[0]).max(far[1]);
    (most / near[2].min(far[2])).max(1.0) / least
}
