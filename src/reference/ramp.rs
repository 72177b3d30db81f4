//! From rest to the full load: all loads grow together, and every step must stay on the stable branch.

use super::chain::Chain;
use super::extrapolation::{Extrapolation, RunAway};
use super::shooting::{Passage, pass};
use super::stability;
use nalgebra::Vector3;

/// Error per step of the integrator on the way; only the end of the path must be sharp.
const TOLERANCE: f64 = 1e-10;
/// Newton's step at which the corrector has arrived.
const ARRIVED: f64 = 1e-7;
/// Each of Newton's steps must be shorter than the last by this factor.
const CONTRACTION: f64 = 0.3;
/// The predictor may turn the tip by this much in the first step (rad).
const FIRST_TURN: f64 = 0.5;
/// Corrections may be this large against the predicted step, ...
const CORRECTION: f64 = 0.3;
/// ... or against this change of the base moment, where hardly any is predicted.
const SMALL_MOMENT: f64 = 0.1;
/// Load steps below this mean that the path ends.
const SMALLEST_STEP: f64 = 1e-5;
/// Passages over the rod before giving up.
const MOST_PASSES: usize = 3000;

/// Where the path from rest leads.
pub(super) struct Path {
    pub m0_body: Vector3<f64>,
    /// Share of the load reached.
    pub lambda: f64,
    pub steps: usize,
    pub passes: usize,
    /// Ended by the bound on passages, not by the path.
    pub gave_up: bool,
}

/// Follows the equilibrium from the unloaded rod as far as it stays stable.
pub(super) fn from_rest(chain: &Chain) -> Path {
    let mut path = Path { m0_body: Vector3::zeros(), lambda: 0.0, steps: 0, passes: 1, gave_up: false };
    let mut integrator = Extrapolation::new(TOLERANCE);
    let Ok(rest) = loaded_pass(chain, 0.0, path.m0_body, &mut integrator) else { return path };
    let Some(mut tangent) = tangent(&rest) else { return path };
    let mut step = (FIRST_TURN / turn(&rest, tangent)).min(1.0);
    while path.lambda < 1.0 && path.passes < MOST_PASSES {
        let lambda = if path.lambda + step >= 1.0 { 1.0 } else { path.lambda + step };
        let predicted = tangent * (lambda - path.lambda);
        let corrected = correct(chain, lambda, path.m0_body, predicted, &mut integrator, &mut path.passes);
        match corrected {
            Some((m0_body, next_tangent, fast)) => {
                (path.m0_body, path.lambda, tangent) = (m0_body, lambda, next_tangent);
                path.steps += 1;
                step *= if fast { 2.0 } else { 1.0 };
            }
            None => {
                step = 0.5 * (lambda - path.lambda);
                if step < SMALLEST_STEP {
                    break;
                }
            }
        }
    }
    path.gave_up = path.passes >= MOST_PASSES;
    path
}

/// A passage with the columns of the base moment and of the load.
fn loaded_pass(
    chain: &Chain,
    lambda: f64,
    m0_body: Vector3<f64>,
    integrator: &mut Extrapolation,
) -> Result<Passage, RunAway> {
    let mut variations = chain.base_moment_variations().to_vec();
    variations.push(chain.load_variation(lambda));
    pass(&chain.loaded(lambda), m0_body, &variations, integrator)
}

/// d(base moment)/d(lambda)
fn tangent(passage: &Passage) -> Option<Vector3<f64>> {
    passage.matrix().lu().solve(&-passage.dresidual[3])
}

/// Rotation of the tip by a unit of load.
fn turn(passage: &Passage, tangent: Vector3<f64>) -> f64 {
    let columns = &passage.tip.columns;
    let w: Vector3<f64> = (0..3).map(|k| columns[k].w * tangent[k]).sum();
    (w + columns[3].w).norm()
}

/// Newton's iteration from the predicted moment: the stable equilibrium it contracts to, the tangent there, and
/// whether it was reached fast.
fn correct(
    chain: &Chain,
    lambda: f64,
    m0_body: Vector3<f64>,
    predicted: Vector3<f64>,
    integrator: &mut Extrapolation,
    passes: &mut usize,
) -> Option<(Vector3<f64>, Vector3<f64>, bool)> {
    let mut m0_body = m0_body + predicted;
    let mut allowed = CORRECTION * predicted.norm().max(SMALL_MOMENT);
    let mut first = None;
    loop {
        let passage = loaded_pass(chain, lambda, m0_body, integrator).ok()?;
        *passes += 1;
        let step: Vector3<f64> = passage.matrix().lu().solve(&-passage.residual)?;
        let size = step.norm();
        let first = *first.get_or_insert(size);
        if size <= ARRIVED * (1.0 + m0_body.norm()) {
            *passes += 1;
            let is_stable = stability::index(&chain.loaded(lambda), m0_body, integrator) == Some(0);
            let tangent = tangent(&passage)?;
            let fast = first < 0.3 * CORRECTION * predicted.norm().max(SMALL_MOMENT);
            return is_stable.then_some((m0_body + step, tangent, fast));
        }
        // Also false for NaN.
        let contracts = size <= allowed;
        if !contracts {
            return None;
        }
        allowed = CONTRACTION * size;
        m0_body += step;
    }
}
