//! Where the rod is cut for multiple shooting: nodes so close that no error grows much from one to the next. MS2
//!
//! A rod's cuts depend on that rod alone. Lanes share the number of pieces of a segment; one that needs fewer has pieces
//! of no length at the segment's start.

use crate::cpu::algebra::{Vec3, axpy, length};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::section::Flexible;
use crate::cpu::rod::segments::Segment;
use crate::cpu::simd::lane::{Lane, Scalar, WIDEST};

/// Panels of the midpoint rule over a segment.
const PANELS: usize = 64;
/// Pieces of a segment at most.
const MOST_PIECES: usize = 4096;

/// What lies between two nodes.
#[derive(Clone, Copy, Debug)]
pub enum Interval<L> {
    /// A piece of a flexible segment: where it starts and how long it is, as shares of the segment.
    Piece { segment: usize, start: L, share: L, is_last: bool },
    /// Rigid segments in a row, after the last of them the unloaded distal part.
    Rigid { first: usize, count: usize, is_tip: bool },
}

impl<L: Lane> Interval<L> {
    /// Lanes in which there is something of it; `of` is any number.
    #[inline(always)]
    pub fn is_there(&self, of: L) -> L::Mask {
        let zero = of.constant(0.0);
        match self {
            Interval::Piece { share, .. } => zero.lt(*share),
            Interval::Rigid { .. } => zero.lt(zero.constant(1.0)),
        }
    }
}

/// The intervals of a rod, base to tip.
#[derive(Clone, Debug)]
pub struct Mesh<L> {
    /// Where the pieces of each segment start and end, as shares of it, in every lane; none of a rigid one.
    pub ends: Vec<Vec<[f64; WIDEST]>>,
    pub intervals: Vec<Interval<L>>,
    /// Force at the distal end of each under full loads.
    pub n: Vec<Vec3<L>>,
}

impl<L: Lane> Mesh<L> {
    pub fn new() -> Self {
        Self { ends: Vec::new(), intervals: Vec::new(), n: Vec::new() }
    }

    /// Cuts the rods so that errors grow by `spacing` powers of e between two nodes.
    #[inline(always)]
    pub fn cut(&mut self, problem: &Problem<'_, L>, spacing: f64) {
        let rod = problem.rod;
        self.ends.clear();
        let mut n = rod.base_force(problem.program.terms);
        let field = length(rod.B);
        for segment in &rod.segments {
            match segment {
                Segment::Flexible(flexible) => {
                    self.ends.push(pieces(flexible, n, field, spacing));
                    n = axpy(-flexible.length, flexible.w, n); // R1
                }
                Segment::Rigid(rigid) => {
                    self.ends.push(Vec::new());
                    n = n - rigid.w; // R1
                }
            }
        }
        self.lay(problem);
    }

    /// Lays the intervals between `ends`.
    #[inline(always)]
    pub fn lay(&mut self, problem: &Problem<'_, L>) {
        let rod = problem.rod;
        self.intervals.clear();
        self.n.clear();
        let mut n = rod.base_force(problem.program.terms);
        for (index, (segment, shares)) in rod.segments.iter().zip(&self.ends).enumerate() {
            match segment {
                Segment::Flexible(flexible) => {
                    let count = shares.len() - 1;
                    for k in 0..count {
                        let (start, end) = (lanes(n.x, &shares[k]), lanes(n.x, &shares[k + 1]));
                        let is_last = k + 1 == count;
                        self.intervals.push(Interval::Piece { segment: index, start, share: end - start, is_last });
                        self.n.push(axpy(-(flexible.length * end), flexible.w, n)); // R1
                    }
                    n = axpy(-flexible.length, flexible.w, n); // R1
                }
                Segment::Rigid(rigid) => {
                    n = n - rigid.w; // R1
                    if let Some(Interval::Rigid { count, .. }) = self.intervals.last_mut() {
                        *count += 1;
                        self.n.pop();
                    } else {
                        self.intervals.push(Interval::Rigid { first: index, count: 1, is_tip: false });
                    }
                    self.n.push(n);
                }
            }
        }
        if rod.free.is_some() {
            if let Some(Interval::Rigid { is_tip, .. }) = self.intervals.last_mut() {
                *is_tip = true;
            } else {
                let first = rod.segments.len();
                self.intervals.push(Interval::Rigid { first, count: 0, is_tip: true });
                self.n.push(n);
            }
        }
    }
}

/// The ends of the pieces of a segment, as shares of it, of every lane; `n` is the force at its start.
#[inline(always)]
fn pieces<L: Lane>(segment: &Flexible<L>, n: Vec3<L>, field: L, spacing: f64) -> Vec<[f64; WIDEST]> {
    let one = n.x.constant(1.0);
    let lost = segment.w * segment.length;
    let magnet = length(segment.mu) * field;
    let give = segment.shear.x.max(segment.shear.y).max(segment.shear.z);
    let least = |k: Vec3<L>| k.x.min(k.y);
    let (near, far) = (segment.stiffness, segment.stiffness + segment.stiffness_rise);
    let bend = least(near).min(least(far));
    let soft = near.x.max(near.y).max(far.x).max(far.y) / near.z.min(far.z);
    let curl = length(segment.u_star).max(length(segment.u_star + segment.u_star_rise)) * segment.length;
    // Growth over the segment at the rate in the middle of each panel.
    let mut rates = [[0.0; WIDEST]; PANELS];
    for (panel, rates) in rates.iter_mut().enumerate() {
        let at = one.constant((panel as f64 + 0.5) / PANELS as f64);
        let pull = length(axpy(-at, lost, n));
        let tension = (give * pull).mul_add(pull, pull + magnet);
        let rate = (tension / bend * one.max(soft)).sqrt() * segment.length; // MS2
        *rates = numbers(rate);
    }
    if segment.tapers {
        let axes = |k: Vec3<L>| [numbers(k.x), numbers(k.y), numbers(k.z)];
        let (near, far) = (axes(near), axes(far));
        for (panel, rates) in rates.iter_mut().enumerate() {
            let share = panel as f64 / PANELS as f64;
            for (lane, rate) in rates[..L::COUNT].iter_mut().enumerate() {
                let powers = |axis: usize| rise(near[axis][lane], far[axis][lane], share);
                *rate += PANELS as f64 * powers(0).max(powers(1)).max(powers(2)); // MS2
            }
        }
    }
    let curls = numbers(curl + one.constant(2.0));
    let mut ends = Vec::new();
    for lane in 0..L::COUNT {
        let rate = |panel: usize| (rates[panel][lane] + curls[lane]) / PANELS as f64;
        let total: f64 = (0..PANELS).map(rate).sum();
        let count = (total / spacing).ceil();
        let count = if count.is_finite() { (count as usize).clamp(1, MOST_PIECES) } else { 1 };
        let mut of_lane = vec![0.0];
        let (mut panel, mut before) = (0, 0.0);
        for k in 1..count {
            let wanted = total * k as f64 / count as f64;
            while panel + 1 < PANELS && before + rate(panel) < wanted {
                before += rate(panel);
                panel += 1;
            }
            of_lane.push((panel as f64 + ((wanted - before) / rate(panel)).clamp(0.0, 1.0)) / PANELS as f64);
        }
        of_lane.push(1.0);
        ends.push(of_lane);
    }
    let count = ends.iter().map(Vec::len).max().unwrap_or(2);
    let at = |k: usize| {
        let mut shares = [1.0; WIDEST];
        for (share, of_lane) in shares.iter_mut().zip(&ends) {
            *share = of_lane[(k + of_lane.len()).saturating_sub(count)];
        }
        shares
    };
    (0..count).map(at).collect()
}

/// By how many powers of e a stiffness that changes linearly along a segment does over the panel that begins at this share of it.
fn rise(near: f64, far: f64, share: f64) -> f64 {
    let at = |share: f64| (far - near).mul_add(share, near);
    (at(share + 1.0 / PANELS as f64) / at(share)).ln().abs()
}

/// The largest bending stiffness of a segment over that of torsion, at least 1.
#[inline(always)]
pub fn softness<L: Lane>(problem: &Problem<'_, L>) -> L {
    let mut soft = problem.rod.t.x.constant(1.0);
    for segment in &problem.rod.segments {
        if let Segment::Flexible(flexible) = segment {
            let (near, far) = (flexible.stiffness, flexible.stiffness + flexible.stiffness_rise);
            soft = soft.max(near.x.max(near.y).max(far.x).max(far.y) / near.z.min(far.z));
        }
    }
    soft
}

/// The numbers of all lanes.
#[inline(always)]
fn numbers<L: Lane>(x: L) -> [f64; WIDEST] {
    let mut stored = [L::Scalar::default(); WIDEST];
    x.store(&mut stored);
    stored.map(Scalar::to_f64)
}

/// And back.
#[inline(always)]
fn lanes<L: Lane>(of: L, numbers: &[f64; WIDEST]) -> L {
    L::load(of.token(), &numbers.map(L::Scalar::from_f64))
}
