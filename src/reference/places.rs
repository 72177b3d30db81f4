//! Places along the rod: where intervals of multiple shooting begin, and the state there.

use super::chain::{Chain, Variation};
use super::extrapolation::{Extrapolation, RunAway};
use super::flexible::Flexible;
use super::rigid;
use super::state::{Column, State};
use nalgebra::{Matrix3, Vector3};

/// Points on a segment at which the growth is summed up.
const SAMPLES: usize = 256;
/// More intervals than this mean that hardly any stiffness is left.
const MOST_INTERVALS: usize = 5000;
/// Intervals for each segment, as far as nothing else asks for them. MS2
const PER_SEGMENT: f64 = 2.0;

/// A point in segment `segment`, `s` from its proximal end, before all that comes beyond it. The tip is at the start of
/// the segment after the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub segment: usize,
    pub s: f64,
}

impl Place {
    pub(super) const BASE: Place = Place { segment: 0, s: 0.0 };

    pub(super) fn tip(chain: &Chain) -> Self {
        Self { segment: chain.is_flexible.len(), s: 0.0 }
    }

    /// Whether it lies at or before `other`.
    pub(super) fn is_up_to(&self, other: Place) -> bool {
        self.segment < other.segment || self.segment == other.segment && self.s <= other.s
    }
}

/// Pose and moment at a place, in the units of the chain.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub place: Place,
    pub p: Vector3<f64>,
    pub R: Matrix3<f64>,
    pub m_body: Vector3<f64>,
}

impl Node {
    /// The base, as the only node: all else follows from its moment.
    pub(super) fn base(chain: &Chain, m_body: Vector3<f64>) -> Self {
        Self { place: Place::BASE, p: Vector3::zeros(), R: chain.R0, m_body }
    }

    pub(super) fn state(&self, columns: Vec<Column>) -> State {
        State { p: self.p, R: self.R, m_body: self.m_body, columns }
    }
}

/// A stretch of one segment between two places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    pub segment: usize,
    pub start: f64,
    pub end: f64,
    /// Whether it reaches the segment's distal end and leads over it.
    pub leaves: bool,
}

/// The stretches between two places, in order; a rigid segment is among them if its whole length is.
pub(super) fn sections(chain: &Chain, from: Place, to: Place) -> impl Iterator<Item = Section> + '_ {
    let last = to.segment.min(chain.is_flexible.len() - 1);
    let section = move |segment: usize| {
        let leaves = segment < to.segment;
        let start = if segment == from.segment { from.s } else { 0.0 };
        let end = if leaves { chain.numbers.segments[segment].length } else { to.s };
        Section { segment, start, end, leaves }
    };
    (from.segment..=last).map(section).filter(|section| section.leaves || chain.is_flexible[section.segment])
}

/// The end of each node's interval: the next node, the tip after the last.
pub(super) fn ends(chain: &Chain, nodes: &[Node]) -> Vec<Place> {
    nodes.iter().skip(1).map(|node| node.place).chain([Place::tip(chain)]).collect()
}

/// Every segment with what varies, flexible or not.
pub(super) fn all_flexible(chain: &Chain, variations: &[Variation]) -> Vec<Flexible> {
    (0..chain.is_flexible.len()).map(|j| Flexible::new(chain, j, variations)).collect()
}

/// Takes the state with its columns from one place to another; `flexible` has the same variations.
pub(super) fn march(
    chain: &Chain,
    flexible: &[Flexible],
    variations: &[Variation],
    (from, to): (Place, Place),
    state: &mut State,
    integrator: &mut Extrapolation,
) -> Result<(), RunAway> {
    for section in sections(chain, from, to) {
        let j = section.segment;
        if !chain.is_flexible[j] {
            rigid::cross(chain, j, variations, state);
            continue;
        }
        flexible[j].advance(integrator, section.start, section.end, state)?;
        if section.leaves {
            flexible[j].lengthen(state);
        }
    }
    Ok(())
}

/// u and its columns at the start of the first flexible segment; zero without one.
pub(super) fn first_curvature(
    chain: &Chain,
    variations: &[Variation],
    mut base: State,
) -> (Vector3<f64>, Vec<Vector3<f64>>) {
    let Some(first) = chain.is_flexible.iter().position(|is_flexible| *is_flexible) else {
        return (Vector3::zeros(), vec![Vector3::zeros(); variations.len()]);
    };
    (0..first).for_each(|j| rigid::cross(chain, j, variations, &mut base));
    Flexible::new(chain, first, variations).curvature(0.0, &base)
}

/// u at the end of the last flexible segment; zero without one.
pub(super) fn last_curvature(chain: &Chain, nodes: &[Node], integrator: &mut Extrapolation) -> Option<Vector3<f64>> {
    let Some(last) = chain.is_flexible.iter().rposition(|is_flexible| *is_flexible) else {
        return Some(Vector3::zeros());
    };
    let end = Place { segment: last, s: chain.numbers.segments[last].length };
    let node = nodes.iter().rev().find(|node| node.place.is_up_to(end))?;
    let flexible = all_flexible(chain, &[]);
    let mut state = node.state(Vec::new());
    march(chain, &flexible, &[], (node.place, end), &mut state, integrator).ok()?;
    Some(flexible[last].curvature(end.s, &state).0)
}

/// By what power of e changes of the base moment grow along the rod at most. MS1
pub(super) fn growth(chain: &Chain) -> f64 {
    let flexible = all_flexible(chain, &[]);
    let of = |j: usize| {
        let length = chain.numbers.segments[j].length;
        let samples = (0..SAMPLES).map(|k| flexible[j].growth_rate(length * (k as f64 + 0.5) / SAMPLES as f64));
        samples.sum::<f64>() * length / SAMPLES as f64
    };
    (0..flexible.len()).filter(|j| chain.is_flexible[*j]).map(of).sum()
}

/// Where intervals begin, each no longer than `longest` in units of the growth. MS2
///
/// `None` where there would be too many. The first place is the base; what is rigid there belongs to the first interval.
pub(super) fn mesh(chain: &Chain, longest: f64) -> Option<Vec<Place>> {
    let flexible = all_flexible(chain, &[]);
    let mut places = vec![Place::BASE];
    let mut is_first = true;
    for (j, segment) in chain.numbers.segments.iter().enumerate() {
        if !chain.is_flexible[j] || segment.length <= 0.0 {
            continue;
        }
        let h = segment.length / SAMPLES as f64;
        let rate = |k: usize| {
            let s = (k as f64 + 0.5) * h;
            flexible[j].growth_rate(s) + flexible[j].rest_bend(s) + PER_SEGMENT / segment.length
        };
        // xi at the ends of the samples.
        let mut xi = vec![0.0];
        for k in 0..SAMPLES {
            xi.push(xi[k] + h * rate(k));
        }
        let count = (xi[SAMPLES] / longest).ceil();
        // Also false for NaN.
        let is_countable = count + places.len() as f64 <= MOST_INTERVALS as f64;
        if !is_countable {
            return None;
        }
        let mut k = 0;
        for i in 0..count as usize {
            let target = xi[SAMPLES] * i as f64 / count;
            while xi[k + 1] < target {
                k += 1;
            }
            let s = h * (k as f64 + (target - xi[k]) / (xi[k + 1] - xi[k]));
            let is_base = std::mem::take(&mut is_first);
            if !is_base {
                places.push(Place { segment: j, s });
            }
        }
    }
    Some(places)
}
