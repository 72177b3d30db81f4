//! By how much errors grow along a rod: what single shooting must be able to bear.

use super::Vector;
use super::rod::{FlexibleRod, Rod, RodSegment};

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
}

/// max(1, EI_max / GJ) / EI_min
fn softness(segment: &FlexibleRod) -> f64 {
    let near = segment.stiffness;
    let far = [0, 1, 2].map(|k| near[k] + segment.stiffness_rise[k]);
    let least = near[0].min(near[1]).min(far[0]).min(far[1]);
    let most = near[0].max(near[1]).max(far[0]).max(far[1]);
    (most / near[2].min(far[2])).max(1.0) / least
}

fn norm(v: Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
