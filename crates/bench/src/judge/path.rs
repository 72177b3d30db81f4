//! The minimum of the energy, followed from rest to the full load, and on while a wall comes.

use super::chain::Chain;
use super::hessian::look;
use super::state::{Look, Move, State};
use super::turn::exp;
use nalgebra::{Quaternion, Vector3};

/// The first load step.
const FIRST: f64 = 1.0 / 200.0;
/// A path whose load step is below this share of the load so far, or next to rest of [`LITTLE_LOAD`], has ended.
const SMALLEST: f64 = 1e-6;
const LITTLE_LOAD: f64 = 1e-3;
/// No node turns further in one load step (rad)
const MOST_TURN: f64 = 0.3;
/// A correction below this has arrived (rad)
const ARRIVED: f64 = 1e-7;
/// Each correction is at most this share of the one before.
const CONTRACTION: f64 = 0.5;
const CORRECTIONS: usize = 7;
/// A load step does not make the least pivot less than this share of what it was, nor, where it is below [`SOFT`], more than the
/// inverse: stability may be lost and won again between.
const SOFTENING: f64 = 0.5;
const SOFT: f64 = 0.3;
/// What a first correction is brought to, as a share of the trust.
const AIM: f64 = 0.25;
/// Looks on one path at most.
const MOST_LOOKS: usize = 20_000;
/// Looks at most while a wall comes.
const MOST_LOOKS_OF_WALL: usize = 4_000;
/// A tip is on a rigid wall where it is off by less than this share of the length, after so many corrections at most.
const OFF: f64 = 1e-9;
const MOST_HARDENINGS: usize = 200;

/// Where a path has led.
pub enum Followed {
    /// Tip under the full load, and the force of a wall on it.
    Arrives { p: Vector3<f64>, q: Quaternion<f64>, force: Vector3<f64> },
    /// Share of the load at which the load steps became too small; 1 more than the share of a wall's way.
    Ends(f64),
    /// Too many steps, or too near to a magnet.
    Lost,
}

/// Follows a chain from rest. `trust` bounds the first correction of a load step at every node (rad).
pub fn follow(mut chain: Chain, trust: f64) -> Followed {
    let wall = chain.wall.take();
    let rest = State::new(&chain, chain.rest(), vec![Vector3::zeros(); chain.elements.len()]);
    let free = match lead(&chain, rest, trust) {
        Ok(free) => free,
        Err(end) => return end,
    };
    let tip_of_free = tip(&chain, &free);
    chain.wall = wall.and_then(|wall| wall.met_by(&tip_of_free));
    if chain.wall.is_none() {
        return arrives(&chain, &free);
    }
    match lead(&chain, free, trust) {
        Ok(touching) => harden(chain, touching, trust),
        Err(Followed::Ends(share)) => Followed::Ends(1.0 + share),
        Err(end) => end,
    }
}

/// Takes back the spring before a wall that has come, in parts that the rod can follow.
fn harden(mut chain: Chain, mut state: State, trust: f64) -> Followed {
    let total: f64 = chain.elements.iter().map(|element| element.h).sum();
    let mut part = 1.0;
    for _ in 0..MOST_HARDENINGS {
        let at = tip(&chain, &state);
        let Some(wall) = chain.wall.take().filter(|wall| wall.presses(&at, 1.0)) else { return Followed::Lost };
        if wall.spring_length(&at) <= OFF * total {
            chain.wall = Some(wall);
            return arrives(&chain, &state);
        }
        chain.wall = Some(wall.harder(&at, part));
        match correct(&chain, state.clone(), 1.0, trust, &mut 0) {
            Some((settled, seen, _)) => {
                // A step that has arrived is still longer than the tip may be off.
                state = turned(&chain, &settled, &seen.step, 1.0);
                part = (2.0 * part).min(1.0);
            }
            None => {
                chain.wall = Some(wall);
                part *= 0.3;
            }
        }
    }
    Followed::Lost
}

/// Follows a chain from one minimum while its load grows, or its wall comes, all the way; else where that ends.
fn lead(chain: &Chain, mut state: State, trust: f64) -> Result<State, Followed> {
    let Some(mut seen) = look(chain, &state, 0.0).filter(|seen| seen.softest > 0.0) else { return Err(Followed::Lost) };
    let (mut share, mut step, mut looks) = (0.0_f64, FIRST, 0);
    // A tip that its wall presses no more jumps away from it.
    let presses = |state: &State, share| chain.wall.as_ref().is_none_or(|wall| wall.presses(&tip(chain, state), share));
    while share < 1.0 {
        let steepest = largest(chain, &seen.tangent);
        if steepest * step > MOST_TURN {
            step = MOST_TURN / steepest;
        }
        if step < SMALLEST * share.max(LITTLE_LOAD) {
            return Err(Followed::Ends(share));
        }
        if looks > if chain.wall.is_some() { MOST_LOOKS_OF_WALL } else { MOST_LOOKS } {
            return Err(Followed::Lost);
        }
        let goal = if share + step > 1.0 - 1e-9 { 1.0 } else { share + step };
        let predicted = turned(chain, &state, &seen.tangent, goal - share);
        match correct(chain, predicted, goal, trust, &mut looks) {
            Some((arrived, found, first)) if is_near(seen.softest, found.softest) && presses(&arrived, goal) => {
                (state, seen, share) = (arrived, found, goal);
                step *= (AIM * trust / first.max(1e-12)).sqrt().clamp(0.5, 2.0);
            }
            _ => step *= 0.4,
        }
        if !is_clear(chain, &state) {
            return Err(Followed::Lost);
        }
    }
    Ok(state)
}

/// Newton's method from a prediction; `None` where it was too far off, or what it leads to is no minimum, under a dead
/// tip moment is beyond a point where equilibria are not isolated.
fn correct(chain: &Chain, mut state: State, share: f64, trust: f64, looks: &mut usize) -> Option<(State, Look, f64)> {
    let (mut first, mut last) = (0.0, f64::INFINITY);
    for k in 0..CORRECTIONS {
        let seen = look(chain, &state, share)?;
        *looks += 1;
        let size = largest(chain, &seen.step);
        if k == 0 {
            first = size;
        }
        // Also false for NaN.
        if !(size <= trust && (size <= CONTRACTION * last || size <= ARRIVED)) {
            return None;
        }
        if size <= ARRIVED {
            return (seen.softest > 0.0).then_some((state, seen, first));
        }
        state = turned(chain, &state, &seen.step, 1.0);
        last = size;
    }
    None
}

/// Whether a step changes the least pivot little enough.
fn is_near(before: f64, after: f64) -> bool {
    after >= SOFTENING * before.min(1.0) && (before >= SOFT || after * SOFTENING <= before)
}

fn turned(chain: &Chain, state: &State, by: &Move, share: f64) -> State {
    let turn = |(q, w): (&Quaternion<f64>, &Vector3<f64>)| (exp(&(w * share)) * q).normalize();
    let y = state.y.iter().zip(&by.y).map(|(y, dy)| y + share * dy).collect();
    State::new(chain, state.q.iter().zip(&by.w).map(turn).collect(), y)
}

/// Of all turns (rad) and strains; NaN counts as the largest.
fn largest(chain: &Chain, by: &Move) -> f64 {
    let strains = chain.elements.iter().zip(&by.y).map(|(element, y)| element.compliance.component_mul(y).norm());
    by.w.iter().map(|w| w.norm()).chain(strains).fold(0.0, |a, b| if b <= a { a } else { b })
}

/// Whether nodes and rigid segments keep their distance from every magnet.
fn is_clear(chain: &Chain, state: &State) -> bool {
    let Some(field) = &chain.field else { return true };
    state.p.iter().zip(&state.R).zip(&chain.nodes).all(|((p, R), node)| {
        let along = |k: u32| p + 0.125 * f64::from(k) * node.jump * R.column(2);
        field.is_clear(p) && (node.jump == 0.0 || (1..=8).all(|k| field.is_clear(&along(k))))
    })
}

/// The tip, with what shear and stretch add in a uniform field.
fn tip(chain: &Chain, state: &State) -> Vector3<f64> {
    let last = chain.elements.len();
    let mut p = state.p[last] + chain.nodes[last].jump * state.R[last].column(2);
    let yielding = chain.elements.iter().enumerate().filter(|(_, element)| element.yields() && chain.field.is_none());
    for (i, element) in yielding {
        for R in &state.R[i..=i + 1] {
            p += 0.5 * element.h * (R * element.compliance.component_mul(&(R.transpose() * element.n)));
        }
    }
    p
}

fn arrives(chain: &Chain, state: &State) -> Followed {
    let p = tip(chain, state);
    let force = chain.wall.as_ref().map_or(Vector3::zeros(), |wall| wall.push(&p, 1.0).F);
    Followed::Arrives { p, q: state.q[chain.elements.len()], force }
}
