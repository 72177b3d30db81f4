//! Every equilibrium of a rod that can be found: Newton's method from many base moments, deflated by what is known.

use crate::backend::{Backend, BackendError, Precision};
use crate::model::{Batch, MOST_KNOWN, Plan, PlanOptions, Quantity, Solutions, Vector};
use std::ops::Range;

/// Searches of a round; rounds, until so many in a row have found nothing.
const ROUND: usize = 512;
const EMPTY_ROUNDS: usize = 3;
const MOST_ROUNDS: usize = 32;
const LEAST_STEPS: usize = 48;
/// Fractional parts of its multiples fill the cube evenly (Roberts' generalised golden ratio).
const GOLDEN: f64 = 1.220_744_084_605_759_5;

/// Prepares an engine for a plan.
pub type MakeEngine<'a> = dyn FnMut(&Plan) -> Result<Box<dyn Backend>, BackendError> + 'a;

/// The equilibria of one rod.
#[derive(Clone, Debug)]
pub struct Branches {
    /// One row each, in no particular order.
    pub solutions: Solutions,
    /// Whether the signs of det(dr/dm0) add up to 1, as they do over all equilibria. A necessary condition.
    pub balanced: bool,
    /// Searches made.
    pub searches: usize,
}

/// Looks for the equilibria of one sample of a plan's batch, beside that from rest.
pub fn find_branches(
    plan: &Plan,
    batch: &Batch,
    sample: usize,
    from_rest: &Solutions,
    make: &mut MakeEngine,
) -> Result<Branches, BackendError> {
    // Equilibria far from rest may be bent much more than the one from rest.
    let steps = plan.options.steps.max(LEAST_STEPS);
    let searching = plan.with_options(PlanOptions { steps, ..plan.options }).with_starts();
    let mut engine = make(&searching)?;
    let closeness = match engine.info().precision {
        Precision::F64 => 1e-6,
        Precision::F32 => 1e-3,
    };
    let unit = plan.units.moment();
    let mut found = Found { moments: Vec::new(), signs: 0, closeness, unit };
    found.add(from_rest, sample..sample + 1);
    let radius = plan.moment_bound(batch, sample).max(unit);
    let mut searches = 0;
    let mut empty_rounds = 0;
    for round in 0..MOST_ROUNDS {
        let starts: Vec<Vector> = (searches..searches + ROUND).map(|k| point_in_ball(k, radius)).collect();
        searches += ROUND;
        // Every other round without deflation, which may also push a search past what it would find.
        let known = if round % 2 == 0 { 0 } else { found.moments.len().min(MOST_KNOWN) };
        let before = found.moments.len();
        let batch = plan.start_batch(batch, sample, &starts, &found.moments[..known]);
        found.add(&engine.solve(&batch)?, 0..ROUND);
        empty_rounds = if found.moments.len() > before { 0 } else { empty_rounds + 1 };
        if empty_rounds == EMPTY_ROUNDS {
            break;
        }
    }
    // Each once more, from where it is.
    let solutions = engine.solve(&plan.start_batch(batch, sample, &found.moments, &[]))?;
    Ok(Branches { solutions, balanced: found.signs == 1, searches })
}

/// Distinct equilibria so far.
struct Found {
    moments: Vec<Vector>,
    signs: i64,
    closeness: f64,
    unit: f64,
}

impl Found {
    fn add(&mut self, solutions: &Solutions, rows: Range<usize>) {
        for row in rows {
            if !solutions.status(row).is_converged() {
                continue;
            }
            let m0 = solutions.vector(row, Quantity::BaseMoment);
            let size = self.unit + norm(m0);
            let is_near = |other: &Vector| norm(std::array::from_fn(|k| m0[k] - other[k])) < self.closeness * size;
            if m0.iter().all(|m| m.is_finite()) && !self.moments.iter().any(is_near) {
                self.moments.push(m0);
                let index = solutions.get(row, Quantity::StabilityIndex).round() as i64;
                self.signs += if index % 2 == 0 { 1 } else { -1 };
            }
        }
    }
}

fn norm(v: Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Point k of a sequence that fills a ball, more densely towards its centre; point 0 is the centre.
fn point_in_ball(k: usize, radius: f64) -> Vector {
    let [x, y, z] = [1, 2, 3].map(|power| (k as f64 * GOLDEN.powi(-power)).fract());
    let (height, angle) = (2.0 * y - 1.0, 2.0 * std::f64::consts::PI * z);
    let across = (1.0 - height * height).max(0.0).sqrt();
    let r = radius * x;
    [r * across * angle.cos(), r * across * angle.sin(), r * height]
}
