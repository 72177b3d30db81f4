//! Lines of the field in a box of space. Seeds are the same for every field. A line fades where it comes near to one before
//! it, so that lines are spread evenly, and none jumps while a source moves.

use super::super::vectors::{distance, norm, widest};
use super::line::{Walk, local};
use super::near::Known;
use super::sources::Surroundings;
use crate::model::Vector;

/// Lines that are seen in full keep this distance (share of the side of a cube as large as the box).
pub(super) const SEPARATION: f64 = 0.185;
/// At this share of it a line is seen no more.
const NEAREST: f64 = 0.6;
/// Places at which a line may begin.
pub(super) const SEEDS: usize = 140;
/// Of a step (share of the separation).
const STEP: f64 = 0.35;
/// A line ends where steps are shorter (share of the longest).
const LEAST_STEP: f64 = 3e-4;
/// Of a line on each side of its seed (share of the widest side).
const LONGEST: f64 = 2.0;
/// Lines whose visible part is shorter fade (share of the separation).
const SHORT: [f64; 2] = [1.0, 2.0];
/// A line ends where it is fainter; beyond a place where it is faint it stays so.
const FAINTEST: f64 = 0.02;
const FAINT: [f64; 2] = [FAINTEST, 0.5];
/// A line begins only where it is seen so well, and is whole from there on.
const AT_SEED: [f64; 2] = [0.4, 0.9];
/// Points of a line on each side of its seed.
const MOST_POINTS: usize = 200;
/// Points of all lines.
const MOST: usize = 8000;

/// A line of the field in space, from where it comes to where it goes.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldLine {
    /// Along it.
    pub places: Vec<LinePlace>,
}

/// A place on a line of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePlace {
    /// In m
    pub at: Vector,
    /// |B| (T)
    pub flux_density: f64,
    /// How well it is seen, 1 in full: lines that come together fade, but for one.
    pub weight: f64,
}

impl Surroundings {
    /// Lines of the field within limits of x, y and z (m), spread evenly: none where the limits hold nothing.
    pub fn lines_within(&self, limits: [[f64; 2]; 3]) -> Vec<FieldLine> {
        let sides = limits.map(|[low, high]| high - low);
        let cube = sides.iter().product::<f64>().cbrt();
        if !(sides.iter().all(|side| *side > 0.0) && cube.is_normal()) {
            return Vec::new();
        }
        let room = Room { surroundings: self, limits, extent: widest(limits), separation: SEPARATION * cube };
        let mut known = Known::new(limits, room.separation);
        let mut lines = Vec::new();
        let mut left = MOST;
        for number in 0..SEEDS {
            let seed = room.seed(number);
            let share = ramp(room.weight(seed, &known), AT_SEED);
            if share == 0.0 {
                continue;
            }
            let Some(local) = local(self, None, seed) else { continue };
            let mut line = room.line(seed, local.size, share, &known);
            line.places.truncate(left);
            if line.places.len() < 2 || line.places.iter().all(|place| place.weight < FAINTEST) {
                continue;
            }
            left -= line.places.len();
            line.places.iter().for_each(|place| known.add(place.at, place.weight));
            lines.push(line);
        }
        lines
    }
}

struct Room<'a> {
    surroundings: &'a Surroundings,
    limits: [[f64; 2]; 3],
    extent: f64,
    /// In m
    separation: f64,
}

impl Room<'_> {
    /// A place of the additive sequence that is even in three dimensions (Roberts, 2018): along any direction seeds hide
    /// few of each other.
    fn seed(&self, number: usize) -> Vector {
        // 1 = x^3 (x + 1)
        const STEPS: Vector = [0.819_172_513_396_164_4, 0.671_043_606_703_789_3, 0.549_700_477_901_930_2];
        std::array::from_fn(|k| {
            let share = (0.5 + number as f64 * STEPS[k]).fract();
            self.limits[k][0] + share * (self.limits[k][1] - self.limits[k][0])
        })
    }

    /// How well a line is seen beside those before it.
    fn weight(&self, at: Vector, known: &Known<3>) -> f64 {
        let hidden = |(distance, weight): (f64, f64)| weight * (1.0 - ramp(distance / self.separation, [NEAREST, 1.0]));
        1.0 - known.around(at).map(hidden).fold(0.0, f64::max)
    }

    fn line(&self, seed: Vector, flux_density: f64, share: f64, known: &Known<3>) -> FieldLine {
        let mut places = vec![LinePlace { at: seed, flux_density, weight: self.weight(seed, known) }];
        for forwards in [false, true] {
            places.reverse();
            self.extend(&mut places, seed, forwards, known);
        }
        let visible: f64 = places.windows(2).map(|pair| pair[1].weight * distance(pair[0].at, pair[1].at)).sum();
        let share = share * ramp(visible / self.separation, SHORT);
        places.iter_mut().for_each(|place| place.weight *= share);
        FieldLine { places }
    }

    /// Goes on from a seed to where the line ends: at a side of the box, at a source, at a grid's edge, or hidden.
    fn extend(&self, places: &mut Vec<LinePlace>, seed: Vector, forwards: bool, known: &Known<3>) {
        let step = STEP * self.separation;
        let (mut last, mut length, mut lowest) = (seed, 0.0, 1.0f64);
        for (at, local) in Walk::new(self.surroundings, None, seed, step, forwards).take(MOST_POINTS) {
            let inside = self.share_inside(last, at);
            let end = std::array::from_fn(|k| last[k] + inside * (at[k] - last[k]));
            // Before a place without field it hardly goes on.
            if inside == 1.0 && distance(last, at) < LEAST_STEP * step {
                return;
            }
            let flux_density = if inside < 1.0 { norm(self.surroundings.flux_density(end)) } else { local.size };
            let weight = self.weight(end, known);
            lowest = lowest.min(weight);
            places.push(LinePlace { at: end, flux_density, weight: weight.min(ramp(lowest, FAINT)) });
            length += distance(last, at);
            last = at;
            if inside < 1.0 || lowest < FAINTEST || length > LONGEST * self.extent {
                return;
            }
        }
    }

    /// Which share of a way that begins in the box lies in it.
    fn share_inside(&self, from: Vector, to: Vector) -> f64 {
        let of_axis = |k: usize| {
            let [low, high] = self.limits[k];
            let way = to[k] - from[k];
            let side = if way > 0.0 { high } else { low };
            if way == 0.0 { 1.0 } else { ((side - from[k]) / way).clamp(0.0, 1.0) }
        };
        (0..3).map(of_axis).fold(1.0, f64::min)
    }
}

/// From 0 at one limit to 1 at the other, smooth at both.
fn ramp(x: f64, [from, to]: [f64; 2]) -> f64 {
    let share = ((x - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
