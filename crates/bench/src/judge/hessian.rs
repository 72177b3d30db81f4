//! Newton's step and the tangent of the path, by elimination of the Hessian from the tip; its pivots tell stability.

use super::chain::Chain;
use super::load::Arms;
use super::state::{Look, State};
use super::{uniform, varying};

/// Looks at a state under a share of the full load. `None` where an element bends too far, or a pivot has no inverse.
pub fn look(chain: &Chain, state: &State, share: f64) -> Option<Look> {
    let arms = Arms { work: chain.arm, motion: chain.arm };
    let eliminate = |arms, with_moment| match chain.field {
        Some(_) => varying::eliminate(chain, state, share, arms, with_moment),
        None => uniform::eliminate(chain, state, share, with_moment),
    };
    if chain.tip_moment.is_some() {
        // A dead moment has no energy: the path goes on as long as the product of all pivots is above zero.
        return eliminate(Arms { motion: 1.0, ..arms }, true);
    }
    let stable = eliminate(arms, false)?;
    match chain.field.is_some() && chain.arm == 0.0 {
        // Stability is a matter of the symmetric part.
        true => Some(Look { softest: stable.softest, ..eliminate(Arms { motion: 1.0, ..arms }, true)? }),
        false => Some(stable),
    }
}
